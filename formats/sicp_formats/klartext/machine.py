"""What a conversational program says beside the motion: feed, tool, spindle, coolant, tool tip control."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sicp_cam.model import EventKind
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["Machine"]

_SPEED = re.compile(r"(?<![A-Z])S[ \t]*([0-9]+(?:[.,][0-9]+)?)", re.ASCII)
_TURNS = {3.0: 1.0, 13.0: 1.0, 4.0: -1.0, 14.0: -1.0, 5.0: 0.0}
_COOLANT = {7.0: 1.0, 8.0: 1.0, 13.0: 1.0, 14.0: 1.0, 9.0: 0.0}
_STOPS = frozenset({0.0, 1.0})
_ENDS = frozenset({2.0, 30.0})
_MODES = frozenset({126.0, 127.0, 128.0, 129.0})
_MOVING = frozenset({89.0, 90.0, 97.0, 98.0, 99.0, 103.0, 107.0, 108.0, 110.0, 111.0, 114.0, 118.0, 130.0, 136.0, 138.0,
                     140.0, 144.0, 148.0})  # fmt: skip
_KNOWN = frozenset({6.0, *_TURNS, *_COOLANT, *_STOPS, *_ENDS, *_MODES})


class Machine:
    """The modal feed, spindle and tool of one program.

    `feed_mm_min` is 0 where none is known, `tip_control` tells whether the control keeps the tip while the tool turns.
    """

    def __init__(self, moves: MoveList, *, may_lack_feed: bool) -> None:
        self.feed_mm_min = 0.0
        self.tip_control = False
        self._moves = moves
        self._may_lack_feed = may_lack_feed
        self._speed = 0.0
        self._direction = 0.0

    def take_feed(self, feed: float, line: int) -> None:
        """Take a feed in mm/min; in a program in inches controls read it in different units."""
        if not 0.0 < feed < 1e12:
            raise self._moves.error(f"the feed F{feed:g} is not possible; correct the line", line)
        if self._moves.mm == 1.0:
            self.feed_mm_min = feed
        elif self._may_lack_feed:
            self._moves.note(Notice.FEED_PUT_ASIDE, line)
        else:
            raise self._moves.error(
                "F in a program in inches: controls read it in different units; post in mm, or state one feed for all"
                " cuts with --set path.feed_mm_min=...",
                line,
            )

    def tool(self, tool: str | None, rest: str, line: int) -> None:
        """Take a TOOL CALL: the tool, if one is named, and the speed of the spindle."""
        if speed := _SPEED.search(rest):
            self._speed = float(speed[1].replace(",", "."))
            if self._direction:
                self._spindle(f"S{speed[1]}", line)
        if tool is not None:
            # A name has no number; a tool that has neither counts as 0.
            number = 0.0 if tool.startswith('"') else float(tool)
            self._moves.event(EventKind.TOOL, line, number, f"TOOL CALL {tool}")

    def codes(self, codes: Sequence[float], line: int) -> bool:
        """Take the M functions of a block in their order; return True if one ends the program."""
        for code in codes:
            self._code(code, f"M{code:g}", line)
        return any(code in _ENDS for code in codes)

    def _code(self, code: float, text: str, line: int) -> None:
        if code in _MOVING:
            what = f"{text} changes how the tool moves; take it out, or post the path plainly"
            raise self._moves.error(what, line)
        if code in _TURNS:
            self._direction = _TURNS[code]
            self._spindle(text, line)
        if code in _COOLANT:
            self._moves.event(EventKind.COOLANT, line, _COOLANT[code], text)
        if code in _STOPS:
            self._moves.event(EventKind.STOP, line, 0.0, text)
        if code in (128.0, 129.0):
            self.tip_control = code == 128.0
        if code not in _KNOWN:
            self._moves.note(Notice.WORD_UNKNOWN, line, text)
        if code in _MODES or code not in _KNOWN:
            self._moves.event(EventKind.OTHER, line, 0.0, text)

    def _spindle(self, text: str, line: int) -> None:
        if self._direction and not self._speed:
            self._moves.note(Notice.SPINDLE_UNKNOWN, line)
            self._moves.event(EventKind.OTHER, line, 0.0, text)
        else:
            self._moves.event(EventKind.SPINDLE, line, self._direction * self._speed, text)
