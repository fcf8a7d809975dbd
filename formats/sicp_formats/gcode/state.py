"""What rules in a G-code program before and after a block, and the block itself, for writing it again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from sicp_formats.gcode.program import GCodeReader
from sicp_formats.gcode.words import Word
from sicp_formats.paths.arcs import Vector, unit

__all__ = ["LineEdit", "Piece", "ReadBlock", "State"]


class State(NamedTuple):
    """The modes of a program between two blocks; lengths in mm, angles in degrees, `axis` of length 1."""

    moves: int
    position: tuple[float | None, ...]
    axis: Vector
    angles: dict[str, float]
    mode: float | None
    absolute: bool
    vector_words: bool
    tip_control: bool
    inverse_time: bool
    mm: float

    @classmethod
    def of(cls, reader: GCodeReader) -> State:
        """Return the state that a reader is in."""
        motion = reader.motion
        return cls(
            len(reader.moves),
            tuple(motion.position),
            unit(motion.axis) or motion.axis,
            dict(motion.angles),
            motion.mode,
            motion.absolute,
            motion.vector_words,
            motion.tip_control,
            reader.machine.feed_mode == 93.0,
            reader.moves.mm,
        )


class Piece(NamedTuple):
    """A straight move that is to be written.

    Its tip in mm, unit axis, how far it is along the old move (1 at its end), and F in 1/min, 0 but under G93.
    """

    tip: Vector
    axis: Vector
    share: float
    inverse_time: float


class ReadBlock(NamedTuple):
    """A line of the program as it was read: its words, the first of each letter, and the state before and after it."""

    text: str
    line: int
    words: list[Word]
    firsts: dict[str, Word]
    before: State
    after: State

    def word(self, letter: str) -> Word | None:
        """Return the word of a letter, or None."""
        return self.firsts.get(letter)


@dataclass(slots=True)
class LineEdit:
    """Changes of one line, made all at once, so that columns stay true until then.

    >>> edit = LineEdit("G2 X1 I5", [(0, 2, "G1"), (5, 8, "")])
    >>> edit.result()
    'G1 X1'
    """

    text: str
    changes: list[tuple[int, int, str]] = field(default_factory=list)

    def number(self, word: Word, text: str) -> None:
        """Write another number in a word."""
        self.changes.append((word.number_start, word.number_end, text))

    def put_before(self, word: Word, text: str, blank: str) -> None:
        """Insert text before a word, where the blanks before that begin if there are any."""
        start = self._blanks_before(word)
        self.insert(start, f"{self.text[start : word.start]}{text}" if start else f"{text}{blank}")

    def insert(self, column: int, text: str) -> None:
        """Insert text before a column."""
        self.changes.append((column, column, text))

    def remove(self, word: Word) -> None:
        """Take a word out, with the blanks before it."""
        self.changes.append((self._blanks_before(word), word.end, ""))

    def result(self) -> str:
        """Return the line with all changes."""
        text, place = [], 0
        for start, end, new in sorted(self.changes, key=lambda change: change[:2]):
            text += [self.text[place:start], new]
            place = max(place, end)
        return "".join([*text, self.text[place:]])

    def _blanks_before(self, word: Word) -> int:
        return len(self.text[: word.start].rstrip(" \t"))
