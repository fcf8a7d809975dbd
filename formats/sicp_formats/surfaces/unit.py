"""The unit of length in the comments of formats that have no place for one, as our writers state it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError, UnitError
from sicp_cam.findings import Finding, Level
from sicp_cam.units import MM_PER_UNIT, mm_per_unit
from sicp_formats.surfaces.checks import Code

__all__ = ["StatedUnit", "chosen_unit", "unit_in"]


@dataclass(frozen=True, slots=True)
class StatedUnit:
    """The word that a comment gives as the unit, and its line."""

    word: str
    line: int


def unit_in(path: Path, comment: Sequence[bytes], line: int, before: StatedUnit | None = None) -> StatedUnit | None:
    """Return the unit that the words of a comment state, or the one stated before.

    Raises
    ------
    FormatError
        If the comments state two different units.

    >>> unit_in(Path("a.ply"), [b"unit", b"mm"], 3)
    StatedUnit(word='mm', line=3)
    """
    match comment:
        case [b"unit" | b"units", word]:
            found = StatedUnit(word.decode("latin-1"), line)
        case _:
            return before
    if before is not None and before.word != found.word:
        what = f"a comment states the unit {found.word}, another one in line {before.line} {before.word}; remove one"
        raise FormatError(path, what, line=line)
    return before or found


def chosen_unit(path: Path, stated: StatedUnit | None, units: str | None) -> tuple[str, bool, tuple[Finding, ...]]:
    """Return the unit to read in, whether the file or the user stated it, and a finding where its word is not known.

    Raises
    ------
    UnitError
        If the user states another unit than the file, or one that is not known.
    """
    mm_per_unit("mm" if units is None else units)
    if stated is None:
        return units or "mm", units is not None, ()
    if stated.word not in MM_PER_UNIT:
        message = f"the unit '{stated.word}' of the comment is not known; {units or 'mm'} was taken instead"
        finding = Finding(Code.UNIT_UNKNOWN, Level.WARN, message, f"{path}, line {stated.line}")
        return units or "mm", units is not None, (finding,)
    if units is not None and units != stated.word:
        where = f"{path}, line {stated.line}"
        raise UnitError(f"{where}: the file states {stated.word}, the job {units}; correct or drop the unit of the job")
    return stated.word, True, ()
