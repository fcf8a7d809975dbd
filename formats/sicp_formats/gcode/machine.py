"""What G-code says beside the motion: spindle, tool, coolant, dwell, stops and the feed mode."""

from __future__ import annotations

from dataclasses import dataclass

from sicp_cam.model import EventKind
from sicp_formats.gcode.words import Block, GCodeError
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["END_CODES", "Machine"]

END_CODES = {2.0, 30.0, 17.0, 99.0}
_STOP_CODES = {0.0, 1.0}
_CALLS = {96.0, 97.0, 98.0, 198.0}
_FEED_MODES = {93.0, 94.0, 95.0}


@dataclass(slots=True)
class Machine:
    """The modal feed, spindle and tool of one program; `plain_feed_mm_min` is the feed while G94 rules.

    `feed_unit_unknown` says that G70 rules on a control on which it does not concern F, `may_lack_feed` that the user
    has stated a feed for such moves.
    """

    moves: MoveList
    may_lack_feed: bool = False
    feed_unit_unknown: bool = False
    feed_mode: float = 94.0
    plain_feed_mm_min: float = 0.0
    _feed: float = 0.0
    _feed_in_block: bool = False
    _speed: float = 0.0
    _speed_known: bool = False
    _direction: float = 0.0
    _tool: str = ""
    _tool_number: float = 0.0

    def feed_mm_min(self, length_mm: float) -> float:
        """Return the feed of a cutting move of that length, 0 if none is known.

        G94: units per minute. G95: units per revolution at the running spindle. G93: F moves per minute, to be stated
        in the block itself; a move without length keeps the tip where it is and has the feed 0.
        """
        if self.feed_mode == 94.0:
            return self.plain_feed_mm_min
        if self.feed_mode == 95.0:
            return self._feed * self.moves.mm * self._speed * abs(self._direction)
        if not self._feed_in_block:
            raise GCodeError("F word missing with inverse time G1, G2 or G3 move (G93); state it in each block")
        return self._feed * length_mm

    def take(self, block: Block, line: int, text: str) -> None:
        """Take feed, speed, tool and M codes of a block, in the order in which a control executes them.

        The words that are used up are taken out of `block.words`.
        """
        self._take_feed(block, line)
        self._take_spindle(block, line)
        self._take_tool(block, line)
        for code in (code for code in block.m if code in (7.0, 8.0, 9.0)):
            self.moves.event(EventKind.COOLANT, line, float(code != 9.0), f"M{code:g}")
        if any(code in _CALLS for code in block.m):
            raise GCodeError(f"{text}: subprograms are not called; post the path as one program")
        self._take_dwell(block, line)

    def state_plain_feed(self, feed: float) -> None:
        """Take a feed in units of the program per minute."""
        self._feed, self.plain_feed_mm_min = feed, feed * self.moves.mm

    def follow_unit(self, line: int) -> None:
        """Read a feed that was stated before the unit in that unit."""
        if self.feed_unit_unknown and self._feed and self.feed_mode != 93.0:
            self._feed = self._feed_put_aside(line)
        self.plain_feed_mm_min = self._feed * self.moves.mm

    def stop(self, block: Block, line: int) -> bool:
        """Append the program stops of a block, which come after its motion; return True if the program ends here."""
        for code in block.m:
            if code in _STOP_CODES:
                self.moves.event(EventKind.STOP, line, 0.0, f"M{code:g}")
        return any(code in END_CODES for code in block.m)

    def _take_feed(self, block: Block, line: int) -> None:
        modes = [code for code in block.g if code in _FEED_MODES]
        if len(modes) > 1:
            raise GCodeError("two feed modes on one line; take one out")
        if modes and modes[0] != self.feed_mode:
            self.feed_mode, self._feed, self.plain_feed_mm_min = modes[0], 0.0, 0.0
        self._feed_in_block = "F" in block.words and 4.0 not in block.g
        if self._feed_in_block:
            self._feed = _positive(block.words.pop("F"), "F")
            if self.feed_unit_unknown and self.feed_mode != 93.0:
                self._feed = self._feed_put_aside(line)
            self.plain_feed_mm_min = self._feed * self.moves.mm

    def _feed_put_aside(self, line: int) -> float:
        """Return 0, no feed, where it is not known in what unit a feed is stated, if the user has another."""
        if not self.may_lack_feed:
            raise GCodeError(
                "F under G70: this control does not take it for inch/min; state G700 (Siemens), post in mm, or state "
                "one feed for all cuts with --set path.feed_mm_min=..."
            )
        self.moves.note(Notice.FEED_PUT_ASIDE, line)
        return 0.0

    def _take_spindle(self, block: Block, line: int) -> None:
        if 4.0 in block.g:
            return
        speed = block.words.pop("S", None)
        if speed is not None:
            self._speed, self._speed_known = _positive(speed, "S"), True
        turns = [code for code in block.m if code in (3.0, 4.0, 5.0)]
        if len(turns) > 1:
            raise GCodeError("two of M3, M4, M5 on one line; take one out")
        if turns:
            self._direction = {3.0: 1.0, 4.0: -1.0, 5.0: 0.0}[turns[0]]
        words = [f"M{code:g}" for code in turns] + ([f"S{speed}"] if speed is not None else [])
        text = " ".join(words)
        if self._direction and not self._speed_known and turns:
            self.moves.note(Notice.SPINDLE_UNKNOWN, line)
            self.moves.event(EventKind.OTHER, line, 0.0, text)
        elif turns or (speed is not None and self._direction):
            self.moves.event(EventKind.SPINDLE, line, self._direction * self._speed, text)
        elif speed is not None:
            self.moves.event(EventKind.OTHER, line, 0.0, text)

    def _take_tool(self, block: Block, line: int) -> None:
        tool = block.words.pop("T", None)
        if tool is not None:
            self._tool, self._tool_number = f"T{tool}", float(tool)
        elif block.tool_name:
            # A name has no number; a tool that has neither counts as 0.
            self._tool, self._tool_number = f'T="{block.tool_name}"', 0.0
        if 6.0 in block.m:
            kind = EventKind.TOOL if self._tool else EventKind.OTHER
            self.moves.event(kind, line, self._tool_number, f"{self._tool} M6".strip())
        elif tool is not None or block.tool_name:
            self.moves.choose_tool(line, self._tool_number, self._tool)

    def _take_dwell(self, block: Block, line: int) -> None:
        if 4.0 not in block.g:
            return
        given = [letter for letter in "PXUF" if letter in block.words]
        if len(given) != 1:
            raise GCodeError("G4 needs one dwell time (P, X, U or F)")
        number = block.words.pop(given[0])
        if any(letter in block.words for letter in "XYZABC"):
            raise GCodeError("G4 with coordinates in one block; state the dwell in a block of its own")
        seconds = _positive(number, given[0])
        if given == ["P"] and "." not in number:
            self.moves.note(Notice.DWELL_IN_MS, line)
            seconds /= 1000.0
        self.moves.event(EventKind.DWELL, line, seconds, f"G4 {given[0]}{number}")


def _positive(number: str, letter: str) -> float:
    value = float(number)
    if value < 0.0:
        raise GCodeError(f"negative {letter} word used; correct the line")
    return value
