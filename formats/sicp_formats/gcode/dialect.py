"""How a G-code program as a whole writes numbers: decimal mark, points, increments, and whose words it uses."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

from sicp_formats.gcode.style import number_like
from sicp_formats.gcode.words import decimal_mark

__all__ = ["INTEGERS_CHOICES", "Dialect", "whole_numbers"]

INTEGERS_CHOICES = ("units", "thousandths")
_LARGE = 100.0
_LETTERS = frozenset("XYZABCIJKRUVW")
_AXIS_WORD = r"(?<![A-Z_])[XYZABCIJKR][ \t]*+=?[ \t]*+[+-]?"
_POINTED = re.compile(rf"{_AXIS_WORD}[0-9]*+[.,]", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(rf"{_AXIS_WORD}([0-9]++)(?![.,])", re.ASCII | re.IGNORECASE)
_REMARK = re.compile(r'\([^()]*\)|;.*|"[^"]*"')
_NO_TIP = re.compile(r"^[ \t]*%|(?<![A-Z_])G0*(?:4|28|30|53)(?![0-9.])", re.ASCII | re.IGNORECASE)
# Words that no other control writes, or that write a number only as Siemens does.
_SIEMENS = re.compile(
    r"^[ \t]*%_N_|(?<![A-Z_])(?:TRAORI|TRAFOOF|SUPA|CYCLE[0-9]+|ORI(?:WKS|MKS|VECT|AXES)|MSG[ \t]*\("
    r"|G(?:700|710|5[0-9][0-9]|60[123]|64[1-5])(?![0-9.])|[ABC]3[ \t]*=|CR[ \t]*=|[XYZABC][ \t]*=[ \t]*(?:AC|IC|DC)\b)",
    re.ASCII | re.IGNORECASE,
)
_SELDOM = re.compile(r"[=_(%]|[A-Za-z]{2}|[Gg][0-9]{3}")  # in each line that _SIEMENS could find
_SIEMENS_SUFFIXES = (".mpf", ".spf")
_G70 = re.compile(r"[Gg]0*70(?![0-9])")
_LARGE_WHOLE = re.compile(r"[XYZABCIJKRxyzabcijkr][ \t]*+=?[ \t]*+(?:[A-Za-z]+\()?[+-]?[0-9]{3,}+(?![.,])")
_HEIDENHAIN = re.compile(r"[ \t]*%[ \t]*\S+[ \t]+G7[01]\b", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Dialect:
    """How one program writes numbers.

    Parameters
    ----------
    decimal
        Decimal mark, ``.`` or ``,``.
    points
        True if any coordinate has a decimal point: each new number gets one then.
    increments
        True if a coordinate without a point counts thousandths.
    siemens
        True if the words or the suffix are those of Siemens.
    may_have_whole
        False if no coordinate without a point is large enough to count thousandths.
    """

    decimal: str = "."
    points: bool = False
    increments: bool = False
    siemens: bool = False
    may_have_whole: bool = field(default=True, repr=False)

    @classmethod
    def of(cls, suffix: str, lines: Sequence[str], *, decimal: str | None, integers: str | None) -> Dialect:
        """Find out from the lines of a program, its suffix, and what the user says of decimal mark and integers.

        >>> Dialect.of(".nc", ["G1 X1. Y5"], decimal=None, integers=None)
        Dialect(decimal='.', points=True, increments=False, siemens=False)
        """
        increments = integers == "thousandths"
        points = increments or _has_points(lines)
        # Only where it matters, as looking for the words of a control takes long.
        text = "\n".join(lines)
        whole = not points or _LARGE_WHOLE.search(text) is not None
        matters = suffix.lower() in _SIEMENS_SUFFIXES or whole or _G70.search(text)
        siemens = bool(matters) and (suffix.lower() in _SIEMENS_SUFFIXES or _has_siemens_words(lines))
        return cls(decimal or decimal_mark(lines), points, increments, siemens, whole)

    def value(self, letter: str, number: str, *, inch: bool) -> str:
        """Return the number of a word as the decimal number that it means; an increment of inches is 0.0001.

        >>> Dialect(increments=True).value("X", "-50000", inch=False), Dialect().value("X", "5", inch=False)
        ('-50.000', '5')
        """
        if not self.increments or "." in number or letter not in _LETTERS:
            return number
        return format(Decimal(number).scaleb(-4 if inch and letter not in "ABC" else -3), "f")

    def written(self, token: str, value: float, least: int) -> str:
        """Return a number in the style of another, see `number_like`."""
        return number_like(token, value, least, self.decimal, point=self.points)


def whole_numbers(lines: Sequence[str], dialect: Dialect) -> list[int]:
    """Return the lines of coordinates without a decimal point that may count thousandths.

    In a program without points those are all but 0, in others those from 100 on, as smaller ones are increments that
    no post states. Siemens and Heidenhain controls take whole numbers for whole units.

    >>> whole_numbers(["G0 X0 Y0 Z50000", "G28 Z0"], Dialect()), whole_numbers(["X1. Y2", "X100"], Dialect(points=True))
    ([1], [2])
    """
    if dialect.siemens or not dialect.may_have_whole or any(_HEIDENHAIN.match(line) for line in lines[:20]):
        return []
    least = _LARGE if dialect.points else 1.0
    return [number for number, line in enumerate(lines, 1) if _has_whole(line, least)]


def _has_whole(line: str, least: float) -> bool:
    if not any(float(number) >= least for number in _WHOLE.findall(line)):
        return False
    code = _REMARK.sub("", line)
    return not _NO_TIP.search(code) and any(float(number) >= least for number in _WHOLE.findall(code))


def _has_siemens_words(lines: Sequence[str]) -> bool:
    # MSG( would be taken out as a remark but for a second bracket.
    return any(
        _SIEMENS.search(line) and _SIEMENS.search(_REMARK.sub("", line.replace("MSG(", "MSG((", 1)))
        for line in lines
        if _SELDOM.search(line)
    )


def _has_points(lines: Sequence[str]) -> bool:
    return any(_POINTED.search(line) for line in _codes(lines))


def _codes(lines: Sequence[str]) -> Iterator[str]:
    for line in lines:
        if "." in line or "," in line:
            yield _REMARK.sub("", line)
