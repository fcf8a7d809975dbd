"""Read a program that a postprocessor wrote, before it is kept, and compare it with the path it was written from.

The reader of the format and the postprocessor share no code, so that a mistake of one of them does not go through.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import plugins
from sicp_cam.checking.comparison import compared
from sicp_cam.errors import InputError, JobError, OutputError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Program, ToolPath

__all__ = ["ReadBack", "read_back"]

NOT_READ_BACK = 652
"""Code of the finding that a program was not compared."""

Options = Mapping[str, object]


@dataclass(frozen=True, slots=True)
class ReadBack:
    """What became of reading a program back.

    Parameters
    ----------
    facts
        `count` of the moves read and `largest_difference_mm` of the tips; None where nothing was compared.
    findings
        Why not.
    """

    facts: dict[str, Any] | None
    findings: tuple[Finding, ...] = ()


def read_back(
    post: Any,
    program: Program,
    files: Mapping[str, bytes],
    *,
    options: Options | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> ReadBack:
    """Read the files of a program back and compare its moves with those they were written from.

    Parameters
    ----------
    post
        The postprocessor; its `main_file` names the file to read, its `reading` what the reader must be told, or why
        there is nothing to compare.
    program, files
        What was written, and the bytes.
    options
        What the reader is told instead.
    limits
        Caps that the reader keeps.

    Raises
    ------
    OutputError
        If the program cannot be read back, or its tips, axes or moves are not those of the path.
    """
    reading = post.reading() if options is None else options
    name = post.main_file(files)
    if isinstance(reading, str):
        return ReadBack(None, (_not_compared(name, reading),) if reading else ())
    if "path" not in plugins.roles(Path(name)):
        return ReadBack(None, (_not_compared(name, "no reader knows its format"),))
    with tempfile.TemporaryDirectory(prefix="sicp-cam-") as folder:
        for file, content in files.items():
            place = Path(folder, file)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
        try:
            again = plugins.read_path(Path(folder, name), limits=limits, options=reading)
        except (InputError, JobError) as error:
            why = str(error).replace(str(Path(folder, "x"))[:-1], "")
            raise OutputError(
                f"post {post.name}: what was to be written cannot be read back ({why}); nothing was written: report it"
            ) from error
    return _same(post, program.path, again, name)


def _same(post: Any, path: ToolPath, again: ToolPath, name: str) -> ReadBack:
    comparison = compared(again, path, name)
    wrong = next((finding for finding in comparison.findings if finding.level is Level.FAIL), None)
    if wrong is not None:
        raise OutputError(
            f"post {post.name}: what was to be written reads back as something else ({wrong.where}: {wrong.message});"
            " nothing was written: report it"
        )
    return ReadBack({"count": len(again), "largest_difference_mm": _largest(comparison.facts)})


def _largest(facts: Mapping[str, Any]) -> float | None:
    largest = facts["max_mm"]
    return None if largest is None else float(np.float64(largest))


def _not_compared(name: str, why: str) -> Finding:
    return Finding(NOT_READ_BACK, Level.INFO, f"what was written was not read back: {why}", printable(name))
