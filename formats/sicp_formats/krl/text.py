"""The text of KRL: subprograms, comments, and the data file that belongs to a program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sicp_formats.krl.data import Values
from sicp_formats.robot.program import Statement, without_strings

__all__ = ["Module", "Subprogram", "data_file", "without_comment"]


@dataclass(frozen=True, slots=True)
class Subprogram:
    """A subprogram of a file: whether it takes arguments, and its statements."""

    name: str
    takes_arguments: bool
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Module:
    """A .src file: its subprograms by upper-case name, and the values of the variables in the .dat file beside it."""

    file: Path
    subprograms: Mapping[str, Subprogram]
    values: Values


def without_comment(line: str) -> tuple[str, str]:
    """Return the code of a line, and its comment with the semicolon.

    >>> without_comment("PTP P1 ; above")
    ('PTP P1', '; above')
    """
    place = without_strings(line).find(";")
    return (line.strip(), "") if place < 0 else (line[:place].strip(), line[place:].strip())


def data_file(path: Path) -> Path | None:
    """Return the .dat file of the same name beside a .src file, None if there is none."""
    stem = path.name[: path.name.lower().rindex(".src")] if ".src" in path.name.lower() else path.stem
    candidates = [path.with_name(stem + suffix) for suffix in (".dat", ".DAT", ".dat.gz")]
    return next((file for file in candidates if file.is_file()), None)
