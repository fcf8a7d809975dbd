"""Check the decimal points of a G-code program: some controls read X20 as 20 of their smallest steps, X20. as 20 mm."""

from __future__ import annotations

from collections.abc import Iterable

from sicp_formats.gcode.words import Block
from sicp_formats.paths.defects import Defects

__all__ = ["POINTS", "CheckedPoints"]

POINTS = 874
"""Code of the findings, that of words."""

_LETTERS = frozenset("XYZABCIJKR")
_OTHER_WAY = ("G70", "G71", "G700", "G710")
"""Units of controls to which a number is the same with and without a point."""


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
        """Take any block; dwells have no coordinates, and keywords stand in programs of Siemens only."""
        self._no_matter |= bool(block.keywords or block.manners) or any(f"G{code:g}" in _OTHER_WAY for code in block.g)
        if 4.0 not in block.g:
            self.take(block.words.items(), line)

    def finish(self, *, no_matter: bool) -> None:
        """Tell of letters with both kinds, unless it is no matter to the control of the program."""
        for letter, (count, first, line) in self._without.items():
            if letter in self._with_point and not (self._no_matter or no_matter):
                what = f"{count} {letter} word{'' if count == 1 else 's'} without a decimal point among those with one"
                what += f", the first {letter}{first}: some controls count it in their smallest steps"
                self._defects.warn(POINTS, what, line)
