"""Check the decimal points of a G-code program: some controls read X20 as 20 of their smallest steps, X20. as 20 mm."""

from __future__ import annotations

from collections.abc import Iterable

from sicp_formats.gcode.words import Block
from sicp_formats.paths.defects import Defects

__all__ = ["POINTS", "CheckedPoints"]

POINTS = 874
"""Code of the findings, that of words."""

_LETTERS = frozenset("XYZABCIJKR")
_UNITS = (70.0, 71.0, 700.0, 710.0)
"""How controls of Siemens and Heidenhain state units; to them a number is the same with and without a point."""


class CheckedPoints:
    """Which letters have had numbers with a point, and how many without one, from where on."""

    def __init__(self, defects: Defects) -> None:
        self._defects = defects
        self._with_point: set[str] = set()
        self._without: dict[str, tuple[int, str, int]] = {}
        self._no_matter = False

    def take(self, words: Iterable[tuple[str, str | None]], line: int) -> None:
        """Take letters and numbers of a block; 0 is 0 with and without a point."""
        for letter, text in words:
            if text is None or letter not in _LETTERS:
                continue
            if "." in text:
                self._with_point.add(letter)
            elif float(text):
                count, first, at = self._without.get(letter, (0, text, line))
                self._without[letter] = (count + 1, first, at)

    def take_block(self, block: Block, line: int) -> None:
        """Take any block; keywords stand in programs of Siemens only, G64 P in those of LinuxCNC."""
        linuxcnc = any(code in (428.0, 429.0) for code in block.m) or (64.0 in block.g and "P" in block.words)
        other = bool(block.keywords or block.manners) or any(code in _UNITS for code in block.g)
        self._no_matter = self._no_matter or linuxcnc or other
        if 4.0 not in block.g:
            self.take(block.words.items(), line)

    def finish(self, *, no_matter: bool) -> None:
        """Tell of letters with both kinds, unless it is no matter to the control of the program."""
        for letter, (count, first, line) in self._without.items():
            if letter in self._with_point and not (self._no_matter or no_matter):
                what = f"{count} {letter} word{'' if count == 1 else 's'} without a decimal point among those with one"
                what += f", the first {letter}{first}: some controls count it in their smallest steps"
                self._defects.warn(POINTS, what, line)
