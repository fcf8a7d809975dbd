"""Read tool paths from G-code: RS-274 of the usual controls, with tool orientation as vectors or rotary angles.

The reader executes motion only. What would need a control - variables, macros, cycles, cutter compensation, tilted
planes - is refused with its line, in the words that LinuxCNC uses where it has them.
"""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.gcode_axis import ROTARY_CHOICES
from sicp_formats.gcode_codes import HOMING, UNITS, one_of, refuse_codes
from sicp_formats.gcode_machine import Machine
from sicp_formats.gcode_motion import MOVING_LETTERS, Motion
from sicp_formats.gcode_words import FIND_WORDS, Block, GCodeError, split_block
from sicp_formats.moves import MoveList, check_options
from sicp_formats.path_findings import Notice
from sicp_formats.program_text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_PLAIN_LETTERS = frozenset("NGXYZF")
_PLAIN_MOTION = {"0": 0.0, "00": 0.0, "1": 1.0, "01": 1.0}
_BLOCK_NUMBER_WRAP = 9000


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    rotary: str | None = None,
    block_skip: bool = True,
) -> ToolPath:
    """Read a G-code program into a path in mm, mm/min and unit axes (tip to holder).

    X Y Z are the tool tip in the part frame, as posted for tool tip control (G43.4, TRAORI ...). The axis is (0, 0, 1)
    until a word states it: I J K under G43.5, A3= B3= C3=, or rotary angles if `rotary` says how to read them.

    Parameters
    ----------
    path
        The file.
    units
        Unit of a program that states none; must not contradict one that does.
    limits
        Caps on the file and the path.
    feed_mm_min
        Feed for cutting moves that the program gives none.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    rotary
        ``AC``, ``BC``, ``AB`` or ``BA``: the tilting and the carrying rotary axis of a head-head machine, in degrees,
        right-handed: n = R_second R_first z (see `gcode_axis.axis_from_angles`). Without it angles other than 0 are
        refused.
    block_skip
        True to leave out blocks that begin with a slash, False to read them.

    Raises
    ------
    FormatError
        With the line, if a block cannot be understood or must not be guessed at.
    UnitError
        If `units` is unknown or contradicts the program.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if rotary is not None and rotary not in ROTARY_CHOICES:
        raise JobError(f"path.rotary = {rotary!r} must be one of {', '.join(ROTARY_CHOICES)}")
    content = read_bytes(path, limits)
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    reader = _Reader(moves, rotary, block_skip, may_lack_feed=feed_mm_min is not None)
    reader.read(program_lines(path, content, limits))
    return moves.build(content, format="G-code", name=reader.name, feed_mm_min=feed_mm_min)


class _Reader:
    """Executes the blocks of one program in order."""

    def __init__(self, moves: MoveList, rotary: str | None, block_skip: bool, *, may_lack_feed: bool) -> None:
        self.moves = moves
        self.name = ""
        self._machine = Machine(moves)
        self._motion = Motion(moves, self._machine, rotary, may_lack_feed=may_lack_feed)
        self._block_skip = block_skip
        self._block_number = -1
        self._begun = False
        self._plain_modes = True

    def read(self, lines: list[str]) -> None:
        """Execute the blocks up to the end of the program."""
        plain = _PLAIN_LETTERS
        for number, line in enumerate(lines, 1):
            pairs = FIND_WORDS(line)
            words = dict(pairs)
            if words.keys() <= plain and len(words) == len(pairs) and self._plain_move(words, number):
                continue
            try:
                ended = self._line(line.strip(), number)
            except GCodeError as problem:
                raise self.moves.error(str(problem), number) from None
            if ended:
                self._note_rest(lines, number)
                return
        self.moves.note(Notice.END_MISSING, len(lines))

    def _plain_move(self, words: dict[str, str], line: int) -> bool:
        """Execute a straight absolute move of X Y Z and nothing unusual; return False for anything else.

        This is the way of nearly all lines, so it does without the general machinery.
        """
        x, y, z, f = words.get("X"), words.get("Y"), words.get("Z"), words.get("F")
        motion = self._motion
        mode = _PLAIN_MOTION.get(words["G"]) if "G" in words else motion.mode
        if (mode != 1.0 and mode != 0.0) or not self._plain_modes or "" in words.values():
            return False
        if x is None and y is None and z is None:
            return False
        mm, position = self.moves.mm, motion.position
        tip_x = position[0] if x is None else float(x) * mm
        tip_y = position[1] if y is None else float(y) * mm
        tip_z = position[2] if z is None else float(z) * mm
        feed = self._machine.plain_feed_mm_min if f is None else float(f) * mm
        if tip_x is None or tip_y is None or tip_z is None or feed < 0.0 or (mode == 1.0 and feed == 0.0):
            return False
        if "N" in words and not self._count_block(words["N"]):
            return False
        self._machine.plain_feed_mm_min = feed
        motion.mode, self._begun = mode, True
        position[0], position[1], position[2] = tip_x, tip_y, tip_z
        self.moves.rows.extend((tip_x, tip_y, tip_z, *motion.axis, feed, mode == 0.0, line))
        return True

    def _count_block(self, number: str) -> bool:
        """Take a block number; False if it goes back, as where two programs were joined, other than by wrapping."""
        if not number.isdigit() or len(number) > 12:
            return False
        value = int(number)
        if value < self._block_number < _BLOCK_NUMBER_WRAP:
            return False
        self._block_number = value
        return True

    def _note_rest(self, lines: list[str], number: int) -> None:
        rest = [later for later, text in enumerate(lines[number:], number + 1) if text.strip(" \t%\x1a")]
        if rest:
            self.moves.tally.note(Notice.TEXT_AFTER_END, rest[0], count=len(rest))

    # --- blocks ---

    def _line(self, text: str, line: int) -> bool:
        """Execute one line; return True if the program ends with it."""
        if not text:
            return False
        if text[0] == "%":
            return self._percent(text, line)
        self._begun = True
        if text[0] == "/":
            if self._block_skip:
                self.moves.note(Notice.BLOCK_SKIPPED, line)
                self.moves.event(EventKind.OTHER, line, 0.0, text)
                return False
            text = re.sub(r"^/[0-9]?", "", text)
        if text[0] == ":":
            text = f"O{text[1:]}"
        block = split_block(text)
        for comment in block.comments:
            self.moves.event(EventKind.COMMENT, line, 0.0, comment)
        if "N" in block.words and not self._count_block(number := block.words.pop("N")):
            raise GCodeError(f"block number N{number} after N{self._block_number}; are these two programs in one file?")
        return self._execute(block, line)

    def _percent(self, text: str, line: int) -> bool:
        if text == "%":
            ended, self._begun = self._begun, True
            return ended
        if self._begun and len(self.moves):
            raise GCodeError("a second program begins here; split the file")
        self.name = self.name or text.lstrip("%").removeprefix("_N_").strip()
        self.moves.event(EventKind.COMMENT, line, 0.0, text)
        return False

    def _execute(self, block: Block, line: int) -> bool:
        number = block.words.pop("O", None)
        if number is not None:
            if len(self.moves) or block.g or block.m:
                raise GCodeError(f"O{number}: subprograms and flow control are not executed; post one program")
            self.name = f"O{number}"
        self._take_units(block, line)
        self._machine.take(block, line, " ".join(f"M{code:g}" for code in block.m))
        refuse_codes(block)
        self._motion.take_modes(block, line)
        if one_of(block, HOMING) is not None or "SUPA" in block.keywords:
            self._motion.go_home(block, line)
        elif any(letter in block.words for letter in MOVING_LETTERS):
            self._motion.move(block, line)
        if block.words:
            raise GCodeError(f"{next(iter(block.words))} word with no code that uses it; correct the line")
        self._plain_modes = self._motion.absolute and self._machine.feed_mode == 94.0
        return self._machine.stop(block, line)

    def _take_units(self, block: Block, line: int) -> None:
        code = one_of(block, UNITS)
        if code is None:
            return
        before = self.moves.mm
        self.moves.state_unit(UNITS[code], line)
        if self.moves.mm != before and self._motion.position != [None, None, None]:
            raise GCodeError("the length unit changes after coordinates; state it at the head of the program")
        self._machine.follow_unit()
