"""Where the values of a job are stated: a job file, the environment, the command line; each becomes one `Layer`.

In every layer a value has a dotted key, `registration.segments` or `options.scan.decimal`. A job file nests tables; the
environment writes `SICP_REGISTRATION__SEGMENTS`; the command line writes `--set registration.segments=14`, and for the
options of readers and posts, whose tables would share their names with the file keys, the short form `scan.decimal`
stands for `options.scan.decimal` (likewise `part.`, `path.` and `post.NAME.`).
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sicp_cam.errors import JobError, printable
from sicp_cam.job.input_files import absent, no_job
from sicp_cam.options.values import Word

__all__ = ["OPTION_TABLES", "Layer", "environment", "load", "settings"]

OPTION_TABLES = ("scan", "part", "path", "post")
"""The tables of free options: one for each reader, and one that holds a table for each post."""

_JOB_BYTES = 2**20
_PREFIX = "SICP_"


@dataclass(frozen=True, slots=True)
class Layer:
    """Values stated in one place.

    Parameters
    ----------
    source
        How a message names the place.
    values
        Value by dotted key.
    folder
        What relative file names in it are relative to.
    """

    source: str
    values: Mapping[str, object]
    folder: Path


def load(path: Path) -> Layer:
    """Read a job file (TOML); file names in it are relative to its folder.

    Raises
    ------
    JobError
        If it cannot be read or is not TOML; the message names the line.
    """
    name = printable(str(path))
    try:
        with path.open("rb") as stream:
            content = stream.read(_JOB_BYTES + 1)
    except OSError as error:
        reason = absent(path) if isinstance(error, FileNotFoundError) else f"{error.strerror}; give a job file"
        told = f"; {no_job(path)}" if no_job(path) else ""
        raise JobError(f"{name}: cannot be read: {reason}{told}") from error
    try:
        values = _parsed(content)
    except ValueError as error:
        raise JobError(f"{name}: {no_job(path)}" if no_job(path) else f"{name}{error}") from error
    return Layer(name, dict(_flat(values, "")), path.parent)


def _parsed(content: bytes) -> dict[str, Any]:
    """Return the values of a job file; ValueError says what is wrong, to stand behind the file's name."""
    if len(content) > _JOB_BYTES:
        raise ValueError(f": larger than {_JOB_BYTES} bytes; this is no job file")
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise ValueError(f", byte {error.start}: not UTF-8; save the job file as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f": not TOML: {printable(str(error))}") from error
    except RecursionError as error:
        raise ValueError(": nested too deeply to be a job file") from error


def environment(variables: Mapping[str, str] | None = None) -> Layer:
    """Return what the `SICP_*` variables state: `SICP_OUT` is `out`, and a double underscore stands for the dot.

    >>> environment({"SICP_GATES__COVERAGE": "0.8", "HOME": "/root"}).values
    {'gates.coverage': '0.8'}
    """
    stated = os.environ if variables is None else variables
    values = {
        name.removeprefix(_PREFIX).lower().replace("__", "."): Word(value)
        for name, value in sorted(stated.items())
        if name.startswith(_PREFIX)
    }
    return Layer("environment", _long_keys(values), Path())


def settings(flags: Mapping[str, object], pairs: Iterable[str] = ()) -> Layer:
    """Return what a command line states.

    Parameters
    ----------
    flags
        Value by key; those that are None have not been stated, texts are read as the type wanted.
    pairs
        The `KEY=VALUE` of each `--set`; of two with the same key the later one holds.

    Raises
    ------
    JobError
        If a pair has no `=`, or its key is also given as a flag; all of them at once.

    >>> settings({"out": "here", "name": None}, ["scan.decimal=,", "gates.coverage=0.8"]).values
    {'out': 'here', 'options.scan.decimal': ',', 'gates.coverage': '0.8'}
    """
    values = {
        key: Word(value) if isinstance(value, str) else value for key, value in flags.items() if value is not None
    }
    set_values: dict[str, object] = {}
    problems = []
    for pair in pairs:
        key, equals, value = pair.partition("=")
        key = key.strip()
        if not equals or not key:
            problems.append(f"--set {printable(pair, 80)}: must be KEY=VALUE, such as --set registration.segments=14")
        elif key in values:
            problems.append(f"--set {printable(key)}: also given as --{key.replace('_', '-')}; leave one out")
        else:
            set_values[key] = Word(value)
    if problems:
        raise JobError(*problems)
    return Layer("command line", {**values, **_long_keys(set_values)}, Path())


def _long_keys(values: Mapping[str, object]) -> dict[str, object]:
    return {
        f"options.{key}" if key.partition(".")[0] in OPTION_TABLES and "." in key else key: value
        for key, value in values.items()
    }


def _flat(values: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, object]]:
    for key, value in values.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
