"""Check the blocks of a G-code program one after the other: modes, feeds, words, block numbers."""

from __future__ import annotations

import re
from collections import Counter

from sicp_formats.gcode.checked_arcs import CheckedArcs
from sicp_formats.gcode.checked_axis import CheckedAxis
from sicp_formats.gcode.checked_calls import called_beside
from sicp_formats.gcode.checked_length import CheckedLength
from sicp_formats.gcode.checked_points import CheckedPoints
from sicp_formats.gcode.codes import HOMING, MOTION, UNITS, heidenhain_text, refuse_codes
from sicp_formats.gcode.machine import END_CODES
from sicp_formats.gcode.plain import PLAIN
from sicp_formats.gcode.words import Block, GCodeError, split_block
from sicp_formats.paths.defects import Defects

__all__ = ["CheckedBlocks"]

END, MODES, NUMBERS, WORDS, FEED = range(871, 876)
"""Codes of the findings; those of arcs and of the tool axis stand with them."""

_GROUPS = tuple(
    map(
        frozenset,
        (
            MOTION,
            (17.0, 18.0, 19.0),
            (90.0, 91.0),
            (90.1, 91.1),
            (93.0, 94.0, 95.0),
            tuple(UNITS),
            (40.0, 41.0, 41.1, 42.0, 42.1),
            (43.0, 43.1, 43.4, 43.5, 49.0, 234.0),
            (98.0, 99.0),
            (54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3, 500.0),
            (61.0, 61.1, 64.0),
            (96.0, 97.0),
        ),
    )
)
_GROUPS_M = (frozenset({0.0, 1.0, 2.0, 30.0}), frozenset({3.0, 4.0, 5.0}), frozenset({7.0, 9.0}), frozenset({8.0, 9.0}))
_MOVING = ("X", "Y", "Z", "A", "B", "C", "A3", "B3", "C3")
_COORDINATES = ("X", "Y", "Z", "A3", "B3", "C3", "I", "J", "K", "A", "B", "C")
_NO_MOTION = "coordinates without a motion word before them (G0 to G3)"
_NUMBERS_WRAP = 9000
_SKIPPED = re.compile(r"[ \t]*/[0-9]?", re.ASCII)
_PROGRAM_NAME = re.compile(r"<[^<>=#]+>", re.ASCII)
_HEIDENHAIN_HEAD = re.compile(r"%[ \t]*\S+[ \t]+G7[01]\b", re.ASCII | re.IGNORECASE)
_HEIDENHAIN_END = re.compile(r"N[0-9]+[ \t]*%", re.ASCII | re.IGNORECASE)


class CheckedBlocks:
    """What rules after the blocks so far, as far as it decides what is wrong with the next one.

    Parameters
    ----------
    defects
        Where it is noted.
    decimal
        Decimal mark of the program.
    rotary_step_deg
        Turn of a rotary axis from block to block beyond which it is told.
    """

    def __init__(self, defects: Defects, decimal: str, rotary_step_deg: float) -> None:
        self._defects = defects
        self._decimal = decimal
        self._axis = CheckedAxis(defects, rotary_step_deg)
        self._arcs = CheckedArcs(defects)
        self._length = CheckedLength(defects)
        self._points = CheckedPoints(defects)
        self._heidenhain = False
        self._stated: set[str] = set()
        self._moved = False
        self._mode: float | None = None
        self._absolute = True
        self._inverse_time = False
        self._feed_known = False
        self._number = -1
        self._ended = False

    def take(self, line: str, number: int) -> bool:
        """Check a line; return True if the program ends with it."""
        found = PLAIN(line)
        if found is not None:
            self._plain(found.groups(), number)
            return False
        text = line.strip(" \t\f\v\x1a")
        if not text or text[0] == "/":
            return False
        if text[0] == "%" or _HEIDENHAIN_END.match(text):
            if _HEIDENHAIN_HEAD.match(text):
                self._heidenhain = True
                self._stated.add("units")
            return False
        if name := _PROGRAM_NAME.match(text):
            line = text[name.end() :]
        try:
            block = split_block(line.replace(":", "O", 1) if text[0] == ":" else line, self._decimal)
        except GCodeError as problem:
            if called := called_beside(text, self._defects.path):
                self._defects.info(WORDS, f"{called} is a program of its own, not judged with this one", number)
                self._axis.forget()
            else:
                self._defects.fail(WORDS, str(problem), number)
            self._arcs.forget()
            return False
        return self._block(block, number)

    def finish(self, last: int) -> None:
        """Judge what only the whole program shows."""
        if not self._ended:
            self._defects.warn(END, "the program has no end (M2 or M30); is the file complete?", last)
        self._axis.finish()
        self._length.finish()
        self._points.finish(no_matter=self._heidenhain)

    # --- blocks ---

    def _plain(self, words: tuple[str | None, ...], line: int) -> None:
        """Check a straight move, which nearly all blocks are."""
        n, g, x, y, z, i3, j3, k3, i, j, k, a, b, c, f = words
        if n is not None:
            self._count(n, line)
        if g is not None:
            self._mode = float(g)
        if f is not None:
            self._take_feed(f, line)
        turns = a is not None or b is not None or c is not None
        points = i3 is not None or j3 is not None or k3 is not None or i is not None or j is not None or k is not None
        if not (turns or points or x is not None or y is not None or z is not None):
            return
        self._points.take(zip(_COORDINATES, words[2:], strict=False), line)
        if not self._moved:
            self._first_move(line)
        if self._mode is None:
            self._defects.fail(MODES, _NO_MOTION, line)
        elif self._mode > 1.0:
            self._arcs.block({"X": x, "Y": y, "Z": z, "I": i, "J": j, "K": k}, self._mode, self._absolute, line)
        else:
            self._arcs.straight(x, y, z, self._absolute)
            if points:
                siemens = i3 is not None or j3 is not None or k3 is not None
                self._axis.point(siemens, (i3, j3) if siemens else (i, j), line)
        if turns:
            self._turn({"A": a, "B": b, "C": c}, line, beside=z is not None)
        if self._mode:
            self._cut(f is not None, line)

    def _block(self, block: Block, line: int) -> bool:
        if number := block.words.get("N"):
            self._count(number, line)
        if self._heidenhain and heidenhain_text(block):
            return False
        self._check_groups(block, line)
        homing = any(code in HOMING for code in block.g) or "SUPA" in block.keywords
        self._take_modes(block, line)
        dwells = 4.0 in block.g
        if "F" in block.words and not dwells:
            self._take_feed(block.words["F"], line)
        moving = any(letter in block.words for letter in _MOVING) or (
            (self._mode or 0.0) >= 2.0 and any(letter in block.words for letter in "IJK")
        )
        if homing or any(code in (10.0, 52.0, 92.0) for code in block.g) or block.manners:
            self._arcs.forget()
            if any(letter in block.words for letter in "ABC") or not any(letter in block.words for letter in "XYZ"):
                self._axis.forget()
        elif moving and not dwells:
            self._move(block, line)
        return self._end(block, line)

    def _move(self, block: Block, line: int) -> None:
        words = block.words
        if not self._moved:
            self._first_move(line)
        if self._mode is None:
            self._defects.fail(MODES, _NO_MOTION, line)
        self._arcs.block(words, self._mode or 0.0, self._absolute, line)
        if (self._mode or 0.0) < 2.0:
            siemens = any(letter in words for letter in ("A3", "B3", "C3"))
            if siemens or any(letter in words for letter in "IJK"):
                sideways = ("A3", "B3") if siemens else ("I", "J")
                self._axis.point(siemens, (words.get(sideways[0]), words.get(sideways[1])), line)
        elif "plane" not in self._stated:
            self._stated.add("plane")
            self._defects.warn(MODES, "an arc before its plane is stated (G17, G18 or G19)", line)
        self._turn({letter: words.get(letter) for letter in "ABC"}, line, beside="Z" in words)
        if self._mode:
            self._cut("F" in words, line)

    def _turn(self, angles: dict[str, str | None], line: int, *, beside: bool) -> None:
        cuts = bool(self._mode)
        self._axis.turn(angles, absolute=self._absolute, cuts=cuts, beside=beside or cuts, line=line)

    def _end(self, block: Block, line: int) -> bool:
        if not any(code in END_CODES for code in block.m):
            return False
        self._ended = True
        self._axis.end(line)
        return True

    # --- modes ---

    def _take_modes(self, block: Block, line: int) -> None:
        for code in block.g:
            if code in MOTION:
                self._mode = None if code == 80.0 else code
            elif code in UNITS:
                self._stated.add("units")
                self._arcs.mm = 25.4 if UNITS[code] == "inch" else 1.0
            elif code in (17.0, 18.0, 19.0):
                self._stated.add("plane")
                self._arcs.plane = code
            elif code in (90.0, 91.0):
                self._stated.add("distance")
                self._absolute = code == 90.0
            elif code in (90.1, 91.1):
                self._arcs.centre_absolute = code == 90.1
            elif code in (93.0, 94.0, 95.0):
                self._feed_known = self._feed_known and (code == 93.0) == self._inverse_time
                self._inverse_time = code == 93.0
        self._axis.take_modes(block, line)
        self._length.take(block, line)
        self._points.take_block(block, line)

    def _first_move(self, line: int) -> None:
        self._moved = True
        for mode, words in (("units", "units (G20, G21)"), ("distance", "absolute coordinates (G90)")):
            if mode not in self._stated:
                self._defects.warn(MODES, f"the first move comes before {words} are stated", line)

    def _check_groups(self, block: Block, line: int) -> None:
        for codes, groups, letter in ((block.g, _GROUPS, "G"), (block.m, _GROUPS_M, "M")):
            for group in groups if len(codes) > 1 else ():
                found = [code for code in codes if code in group]
                if len(found) > 1:
                    told = ", ".join(f"{letter}{code:g}" for code in found)
                    self._defects.fail(WORDS, f"{told} in one block are of the same modal group; take one out", line)
        try:
            refuse_codes(block, self._heidenhain)
        except GCodeError as problem:
            if str(problem).startswith("unknown g code"):
                self._defects.fail(WORDS, str(problem), line)
        for word, count in Counter(block.m).items():
            if count > 1:
                self._defects.fail(WORDS, f"M{word:g} stands twice in one block", line)

    # --- numbers ---

    def _count(self, text: str, line: int) -> None:
        number = int(text) if text.isdigit() and len(text) <= 12 else -1
        if number < 0:
            self._defects.warn(NUMBERS, f"N{text} is no block number", line)
            return
        if number == self._number:
            self._defects.warn(NUMBERS, f"the block number N{number} stands twice", line)
        elif number < self._number < _NUMBERS_WRAP:
            self._defects.warn(NUMBERS, f"the block number N{number} comes after N{self._number}", line)
        self._number = number

    def _take_feed(self, text: str, line: int) -> None:
        self._feed_known = True
        if not float(text) > 0.0:
            self._defects.fail(FEED, f"F{text}: a feed must be more than 0", line)

    def _cut(self, has_feed: bool, line: int) -> None:
        self._axis.cut(line)
        if self._length.missing:
            self._length.cut(line)
        if self._inverse_time and not has_feed:
            self._defects.fail(FEED, "a cut under inverse time (G93) without F in its own block", line)
        elif not self._feed_known:
            self._feed_known = True
            self._defects.fail(FEED, "the first cut comes before a feed (F) is stated", line)
