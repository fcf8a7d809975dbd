"""What APT statements say beside the motion: feed, spindle, tool, coolant, dwell and stops."""

from __future__ import annotations

from dataclasses import dataclass

from sicp_cam.model import EventKind
from sicp_formats.apt.arguments import split_arguments
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["Machine"]

# Feed words: millimetres in the length (None: the unit of the file), and whether the feed is per revolution.
_FEED_UNITS: dict[str, tuple[float | None, bool]] = {
    "IPM": (25.4, False), "MMPM": (1.0, False), "PERMIN": (None, False),
    "IPR": (25.4, True), "MMPR": (1.0, True), "PERREV": (None, True),
}  # fmt: skip
_SPINDLE_WORDS = {"RPM", "CLW", "CCLW", "ON", "OFF", "FWD", "REV"}
_COOLANT_ON = {"ON", "FLOOD", "MIST", "THRU", "AIR", "TAP", "HIGH", "LOW", "MEDIUM", "BOTH"}


@dataclass(slots=True)
class Machine:
    """The modal feed and spindle speed, and the events of one file.

    `feed_mm_min` is 0 while the feed is not known: none stated yet, or one per revolution at an unknown speed.
    """

    moves: MoveList
    feed_mm_min: float = 0.0
    _feed: float = 0.0
    _feed_length_mm: float | None = None
    _per_revolution: bool = False
    _speed: float = 0.0
    _running: float = 0.0
    _unknown_since: int | None = None

    def feedrate(self, line: int, arguments: str) -> None:
        """FEDRAT/v, FEDRAT/v,MMPM or FEDRAT/MMPM,v: the feed of the cutting moves that follow."""
        numbers, words = split_arguments(arguments)
        if len(numbers) != 1 or len(words) > 1 or not set(words) <= set(_FEED_UNITS):
            units = ", ".join(_FEED_UNITS)
            raise self.moves.error(f"FEDRAT needs one number and at most one of {units}; correct the line", line)
        if not numbers[0] > 0.0:
            raise self.moves.error("FEDRAT needs a feed above zero; correct the line", line)
        self._feed_length_mm, self._per_revolution = _FEED_UNITS[words[0]] if words else (None, False)
        self._feed = numbers[0]
        self.update_feed()

    def spindle(self, line: int, arguments: str) -> None:
        """SPINDL with speed, RPM, CLW or CCLW, ON or OFF in any order; a surface speed is kept as text."""
        numbers, words = split_arguments(arguments)
        if len(numbers) > 1 or not set(words) <= _SPINDLE_WORDS or (not numbers and not words):
            self.moves.note(Notice.SPINDLE_UNKNOWN, line)
            self.moves.event(EventKind.OTHER, line, 0.0, f"SPINDL/{arguments.strip()}")
            self._running = 0.0
        elif "OFF" in words:
            self._turn(0.0, line, arguments)
        else:
            speed = abs(numbers[0]) if numbers else abs(self._speed)
            backwards = bool({"CCLW", "REV"} & set(words)) or (not numbers and words == ["ON"] and self._speed < 0.0)
            self._speed = -speed if backwards else speed
            self._turn(self._speed, line, arguments)
        self.update_feed()

    def load_tool(self, line: int, arguments: str, word: str) -> None:
        """LOADTL/n, LOAD/TOOL,n or TURRET/n."""
        numbers, _ = split_arguments(arguments)
        self.moves.event(
            EventKind.TOOL if numbers else EventKind.OTHER,
            line,
            numbers[0] if numbers else 0.0,
            f"{word}/{arguments.strip()}",
        )

    def choose_tool(self, line: int, arguments: str, word: str) -> None:
        """SELECT/TOOL,n or TOOLNO/n: names a tool that another statement may load."""
        numbers, _ = split_arguments(arguments)
        self.moves.choose_tool(line, numbers[0] if numbers else 0.0, f"{word}/{arguments.strip()}")

    def coolant(self, line: int, arguments: str) -> None:
        """COOLNT/ON, OFF, FLOOD, MIST ...; anything else is kept as text."""
        _, words = split_arguments(arguments)
        text = f"COOLNT/{arguments.strip()}"
        if words and (words == ["OFF"] or set(words) <= _COOLANT_ON):
            self.moves.event(EventKind.COOLANT, line, float(words != ["OFF"]), text)
        else:
            self.moves.event(EventKind.OTHER, line, 0.0, text)

    def delay(self, line: int, arguments: str) -> None:
        """DELAY/t in seconds, DELAY/n,REV in turns of the spindle."""
        numbers, words = split_arguments(arguments)
        text = f"DELAY/{arguments.strip()}"
        if len(numbers) != 1 or numbers[0] < 0.0 or (words and words != ["REV"]):
            raise self.moves.error(
                "DELAY needs one time in seconds, or a number of turns and REV; correct the line", line
            )
        if not words:
            self.moves.event(EventKind.DWELL, line, numbers[0], text)
        elif self._running:
            self.moves.event(EventKind.DWELL, line, numbers[0] * 60.0 / abs(self._running), text)
        else:
            raise self.moves.error("DELAY in turns while the spindle speed is not known; state seconds", line)

    def _turn(self, speed: float, line: int, arguments: str) -> None:
        self._running = speed
        self.moves.event(EventKind.SPINDLE, line, speed, f"SPINDL/{arguments.strip()}")

    def forget_feed(self) -> None:
        """Take the feed as not known, until the next statement of one."""
        self._feed = 0.0
        self.update_feed()

    def update_feed(self) -> None:
        """Work out the feed again after the unit of the file or the spindle speed has changed."""
        length_mm = self.moves.mm if self._feed_length_mm is None else self._feed_length_mm
        turns = abs(self._running) if self._per_revolution else 1.0
        self.feed_mm_min = self._feed * length_mm * turns
        self.finish()
        self._unknown_since = len(self.moves) if self._feed and not self.feed_mm_min else None

    def finish(self) -> None:
        """Count the cuts so far whose feed per revolution is of no use, because the speed was not known."""
        if self._unknown_since is not None:
            self.moves.per_turn += self.moves.cuts_since(self._unknown_since)
            self._unknown_since = None
