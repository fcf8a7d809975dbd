"""The text of KRL: comments, and the data file that belongs to a program."""

from __future__ import annotations

from pathlib import Path

from sicp_formats.robot.program import without_strings

__all__ = ["data_file", "without_comment"]


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
