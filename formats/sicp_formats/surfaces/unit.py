"""The unit of length in the comments of formats that have no place for one, as our writers and others state it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError, UnitError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.units import MM_PER_UNIT, mm_per_unit
from sicp_formats.surfaces.checks import Code

__all__ = ["StatedUnit", "chosen_unit", "known_unit", "one_unit", "unit_in"]

_WORDS = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("in", "inch", "inches"), "inch"),
}
_KNOWN = "|".join(sorted(_WORDS, key=len, reverse=True))
_END = r"(?=[.,;)\]\s]*$|[.,;)\]](?:\s|$))"
_BEFORE = r"(?<![\w-])"
# "unit: inch, 3 points" may go on; behind a bare "unit inch" nothing follows, or "one unit in 5 is m" would state one.
_STATEMENTS = (
    re.compile(rf"{_BEFORE}units?\s*[:=]\s*[\[(\"']?({_KNOWN})(?![\w-])", re.IGNORECASE),
    re.compile(rf"{_BEFORE}units?\s+(?:(?:in|is|are)\s+)?[\[(\"']?({_KNOWN})\b[\"']?{_END}", re.IGNORECASE),
    re.compile(rf"{_BEFORE}coordinates\s+(?:are\s+)?in\s+({_KNOWN})\b{_END}", re.IGNORECASE),
)
_UNKNOWN = re.compile(rf"{_BEFORE}units?\s*[:=]\s*([^\s,;:=]+)", re.IGNORECASE)
_UNKNOWN_BARE = re.compile(r"\s*units?\s+(?!(?:vectors?|normals?)\b)([^\s\-]+)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class StatedUnit:
    """The unit that a comment gives, or its word for it if that is not known; its line, 0 where there are no lines."""

    word: str
    line: int


def known_unit(word: str) -> str | None:
    """Return the unit of `MM_PER_UNIT` that a word means, None if it means none of them.

    >>> known_unit("Inches")
    'inch'
    """
    return _WORDS.get(word.strip().lower())


def unit_in(
    path: Path, comment: str, line: int, before: StatedUnit | None = None, *, title: bool = False
) -> StatedUnit | None:
    """Return the unit that a comment states, or the one stated before.

    Parameters
    ----------
    path, line
        Where the comment stands.
    comment
        Its text, such as `unit mm`, `Units = inches` or `coordinates in m`.
    before
        What was stated before it.
    title
        True for a text that may be a name, in which "unit cube" states none.

    Raises
    ------
    FormatError
        If the comments state two different units.

    >>> unit_in(Path("a.ply"), "unit mm", 3)
    StatedUnit(word='mm', line=3)
    """
    word = _stated_word(comment, title)
    return before if word is None else one_unit(path, before, StatedUnit(word, line))


def one_unit(path: Path, before: StatedUnit | None, found: StatedUnit | None) -> StatedUnit | None:
    """Return the one of two statements that there is.

    Raises
    ------
    FormatError
        If they differ.
    """
    if before is not None and found is not None and before.word != found.word:
        what = f"a comment states the unit {found.word}, another one in line {before.line} {before.word}; remove one"
        raise FormatError(path, what, line=found.line)
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
    where = f"{path}, line {stated.line}" if stated.line else f"{path}, byte 0"
    if stated.word not in MM_PER_UNIT:
        message = f"the unit '{stated.word}' of the comment is not known; {units or 'mm'} was taken instead"
        return units or "mm", units is not None, (Finding(Code.UNIT_UNKNOWN, Level.WARN, message, where),)
    if units is not None and units != stated.word:
        raise UnitError(f"{where}: the file states {stated.word}, the job {units}; correct or drop the unit of the job")
    return stated.word, True, ()


def _stated_word(comment: str, title: bool) -> str | None:
    for statement in _STATEMENTS:
        if match := statement.search(comment):
            return _WORDS[match[1].lower()]
    unknown = _UNKNOWN.search(comment) or (None if title else _UNKNOWN_BARE.fullmatch(comment))
    return printable(unknown[1], 40) if unknown else None
