"""Check the tool lengths of a G-code program: the H word of tip control, and a new one after each tool change."""

from __future__ import annotations

from sicp_formats.gcode.words import Block
from sicp_formats.paths.defects import Defects

__all__ = ["LENGTH", "CheckedLength"]

LENGTH = 876
"""Code of the findings, that of tip control: it turns the tool about the tip that the length says."""

_PLAIN, _TIP = frozenset({43.0, 43.1}), frozenset({43.4, 43.5, 234.0})


class CheckedLength:
    """Which tool and which length rule after the blocks so far.

    `missing` tells that the next cut is the first with a tool whose length no word has stated.
    """

    def __init__(self, defects: Defects) -> None:
        self.missing = False
        self._defects = defects
        self._known = self._used = False
        self._chosen = self._tool = ""
        self._cuts: list[tuple[str, int]] = []

    def take(self, block: Block, line: int) -> None:
        """Take tool, tool change and length of a block, in the order in which controls execute them."""
        words = block.words
        if "T" in words:
            self._chosen = words["T"]
        if 6.0 in block.m:
            self.missing = self.missing or not self._tool or self._chosen != self._tool
            self._tool = self._chosen
        plain, tip = (next((code for code in block.g if code in codes), None) for codes in (_PLAIN, _TIP))
        if plain is None and tip is None:
            return
        self._used = True
        if "H" in words:
            self._known, self.missing = True, False
            if self._tool and float(words["H"]) != float(self._tool):
                self._defects.info(LENGTH, f"the length H{words['H']} is taken for the tool T{self._tool}", line)
        elif plain is not None:  # LinuxCNC takes the length of the tool in the spindle
            self._known, self.missing = True, False
        elif not self._known:
            self._known, self.missing = True, False
            self._defects.warn(LENGTH, f"G{tip:g} without H: no word has said which tool length holds", line)

    def cut(self, line: int) -> None:
        """Take a cut with a tool whose length is missing."""
        self._cuts.append((f"T{self._tool}" if self._tool else "the tool change", line))
        self.missing = False

    def finish(self) -> None:
        """Tell of those cuts, if the program takes lengths by G43 at all; other controls know them by the tool."""
        for since, line in self._cuts if self._used else ():
            self._defects.warn(LENGTH, f"a cut with no H since {since}: the length of the tool before holds", line)
