"""The Python face: the correction for scripts, with paths and keywords where the command line has flags."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from sicp_cam import plugins
from sicp_cam.limits import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from sicp_cam.model import Part, Scan, ToolPath
    from sicp_cam.result import Correction

__all__ = ["correct", "read_part", "read_path", "read_scan"]


def correct(
    *,
    cad: str | os.PathLike[str],
    scan: str | os.PathLike[str],
    path: str | os.PathLike[str],
    **settings: object,
) -> Correction:
    """Correct a tool path to the scanned shape of its part, in memory.

    Parameters
    ----------
    cad, scan, path
        The nominal part, its measured surface, and the path, as files.
    **settings
        Every key of a job file, with `__` for the dot: `align="pose.txt"`, `method="rigid"`, `contour="1,2"`,
        `registration__segments=14`, `options__scan__decimal=","`.

    Returns
    -------
    Correction
        With `write(post, folder)`, `report(file)`, `corrected` and `document()`. Its gates were kept.

    Raises
    ------
    SicpError
        As the command does, see `sicp_cam.errors`.
    """
    from sicp_cam.job import build
    from sicp_cam.job.layers import Layer
    from sicp_cam.pipeline import run

    files = {"cad": os.fspath(cad), "scan": os.fspath(scan), "path": os.fspath(path), "out": os.curdir}
    values = {key.replace("__", "."): value for key, value in settings.items()}
    return run(build(Layer("keywords", {**files, **values}, Path())))


def read_part(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    **options: object,
) -> Part:
    """Read a nominal part, in millimetres; `options` are what its reader takes.

    With `recover`, what can be repaired is repaired, and each repair stands in the findings.

    Raises
    ------
    InputError
        If the file cannot be read; the message names file and line or byte.
    """
    return plugins.read_part(Path(path), units=units, limits=limits, options=options, recover=recover)


def read_scan(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    **options: object,
) -> Scan:
    """Read a scan, in millimetres; parameters and errors as in `read_part`."""
    return plugins.read_scan(Path(path), units=units, limits=limits, options=options, recover=recover)


def read_path(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    **options: object,
) -> ToolPath:
    """Read a tool path, in millimetres and mm/min; parameters and errors as in `read_part`."""
    return plugins.read_path(Path(path), units=units, limits=limits, options=options, recover=recover)
