"""The blocks that nearly all lines of a path are: one straight move with coordinates, tool axis and feed."""

from __future__ import annotations

import re

from sicp_formats.gcode.axis import axis_from_angles
from sicp_formats.gcode.machine import Machine
from sicp_formats.gcode.motion import Motion
from sicp_formats.gcode.words import Word
from sicp_formats.paths.moves import MoveList

__all__ = ["PLAIN", "PlainMoves", "plain_words"]

_VALUE = r"[ \t]*+([+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++))[ \t]*+"


def _word(letter: str) -> str:
    return f"(?:{letter}{_VALUE})?"


PLAIN = re.compile(
    r"[ \t]*+(?:N[ \t]*+([0-9]{1,12}+)[ \t]*+)?(?:G0?([01])(?![0-9.])[ \t]*+)?"
    + _word("X=?") + _word("Y=?") + _word("Z=?")
    + _word("A3=") + _word("B3=") + _word("C3=") + _word("I") + _word("J") + _word("K")
    + _word("A=?") + _word("B=?") + _word("C=?") + _word("F=?"),
    re.ASCII,
).fullmatch  # fmt: skip
"""Matches a plain block; its groups are the numbers of N, G, X, Y, Z, A3, B3, C3, I, J, K, A, B, C and F."""

_LETTERS = ("N", "G", "X", "Y", "Z", "A3", "B3", "C3", "I", "J", "K", "A", "B", "C", "F")
_BLOCK_NUMBER_WRAP = 9000


def plain_words(text: str) -> list[Word] | None:
    """Return the words of a plain block with their places; None for any other, which `split_block` cuts.

    >>> [(word.letter, word.number, word.start, word.end) for word in plain_words("X1. A3=.5") or ()]
    [('X', '1.', 0, 3), ('A3', '.5', 4, 9)]
    """
    found = PLAIN(text)
    if found is None:
        return None
    words, place = [], 0
    for group, (letter, number) in enumerate(zip(_LETTERS, found.groups(), strict=True), 1):
        if number is not None:
            start, end = found.span(group)
            first = text.index(letter[0], place)
            # G stands with one digit in its group: a zero before it belongs to the number.
            zero = letter == "G" and text[start - 1] == "0"
            words.append(Word(letter, f"0{number}" if zero else number, first, end, start - zero, end))
            place = end
    return words


class PlainMoves:
    """Executes straight absolute moves under G94 without the general machinery, which is slow.

    Whatever is unusual in a block is left alone: it needs the general way, which knows all the rules and messages.
    """

    __slots__ = ("_machine", "_motion", "_moves", "_rotary", "block_number", "usable")

    def __init__(self, moves: MoveList, machine: Machine, motion: Motion, rotary: str | None) -> None:
        self._moves = moves
        self._machine = machine
        self._motion = motion
        self._rotary = rotary
        self.block_number = -1
        self.usable = False  # until a block has shown that nothing unusual rules

    def execute(self, text: str, line: int) -> bool:
        """Execute a block; return False, with nothing changed, if it is not a plain move."""
        found = PLAIN(text)
        if found is None or not self.usable:
            return False
        n, g, x, y, z, i3, j3, k3, i, j, k, a, b, c, f = found.groups()
        motion = self._motion
        mode = motion.mode if g is None else float(g)
        if (mode != 1.0 and mode != 0.0) or (x is None and y is None and z is None):
            return False
        mm, position = self._moves.mm, motion.position
        tip_x = position[0] if x is None else float(x) * mm
        tip_y = position[1] if y is None else float(y) * mm
        tip_z = position[2] if z is None else float(z) * mm
        feed = self._machine.plain_feed_mm_min if f is None else float(f) * mm
        if tip_x is None or tip_y is None or tip_z is None or feed < 0.0 or (mode == 1.0 and feed == 0.0):
            return False
        if n is not None and int(n) < self.block_number and not self.count_block(n):
            return False
        if a or b or c:
            if i3 or j3 or k3 or i or j or k or not self._turn_rotaries(a, b, c):
                return False
        elif i or j or k:
            if i3 or j3 or k3 or not motion.vector_words or not self._turn(i, j, k):
                return False
        elif (i3 or j3 or k3) and not self._turn(i3, j3, k3):
            return False
        if n is not None:
            self.block_number = int(n)
        if f is not None:
            self._machine.state_plain_feed(float(f))
        motion.mode = mode
        position[0], position[1], position[2] = tip_x, tip_y, tip_z
        self._moves.rows.extend((tip_x, tip_y, tip_z, *motion.axis, feed, mode == 0.0, line))
        return True

    def count_block(self, number: str) -> bool:
        """Take a block number; False if it goes back, as where two programs were joined, other than by wrapping."""
        if not number.isdigit() or len(number) > 12:
            return False
        value = int(number)
        if value < self.block_number < _BLOCK_NUMBER_WRAP:
            return False
        self.block_number = value
        return True

    def _turn(self, i: str | None, j: str | None, k: str | None) -> bool:
        """Take a vector of which a missing component is 0; False if it is no direction."""
        axis = (float(i or 0.0), float(j or 0.0), float(k or 0.0))
        if axis == (0.0, 0.0, 0.0):
            return False
        self._motion.axis, self._motion.axis_stated = axis, True
        return True

    def _turn_rotaries(self, a: str | None, b: str | None, c: str | None) -> bool:
        """Take angles; False, with nothing changed, where it is not known or not certain what they do."""
        rotary, motion = self._rotary, self._motion
        if rotary is None or not motion.tip_control:
            return False
        if (a and "A" not in rotary) or (b and "B" not in rotary) or (c and "C" not in rotary):
            return False
        angles = motion.angles
        angles["A"] = angles["A"] if a is None else float(a)
        angles["B"] = angles["B"] if b is None else float(b)
        angles["C"] = angles["C"] if c is None else float(c)
        motion.axis = axis_from_angles(rotary, angles)
        return True
