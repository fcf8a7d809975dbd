"""Execute the blocks of one G-code program in order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import EventKind
from sicp_formats.gcode.codes import HOMING, UNITS, heidenhain_text, one_of, refuse_codes
from sicp_formats.gcode.dialect import Dialect, whole_numbers
from sicp_formats.gcode.ending import is_torn, may_be_dropped
from sicp_formats.gcode.machine import Machine
from sicp_formats.gcode.motion import MOVING_LETTERS, Motion
from sicp_formats.gcode.plain import PlainMoves, plain_words
from sicp_formats.gcode.words import Block, GCodeError, Word, split_block
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList
from sicp_formats.paths.text import program_lines, suffix_of_program

__all__ = ["GCodeOptions", "GCodeReader", "execute"]

_SKIPPED = re.compile(r"[ \t]*/[0-9]?", re.ASCII)
_HEIDENHAIN_HEAD = re.compile(r"%[ \t]*(\S+)[ \t]+G(70|71)[ \t]*\*?", re.ASCII | re.IGNORECASE)
_HEIDENHAIN_END = re.compile(r"N[0-9]+[ \t]*%", re.ASCII | re.IGNORECASE)
_REMARK = re.compile(r'[(;"]')
_PROGRAM_NAME = re.compile(r"<([^<>=#]+)>", re.ASCII)


@dataclass(frozen=True, slots=True)
class GCodeOptions:
    """How a program is to be read: the options of `gcode.read_path`."""

    units: str | None = None
    limits: Limits = DEFAULT_LIMITS
    recover: bool = False
    feed_mm_min: float | None = None
    chord_mm: float = 0.005
    step_mm: float = 2.0
    rotary: str | None = None
    block_skip: bool = True
    decimal: str | None = None
    integers: str | None = None


def execute(path: Path, content: bytes, options: GCodeOptions) -> GCodeReader:
    """Return the reader that has executed a program to its end; its `moves` are not judged as a whole yet.

    Raises
    ------
    FormatError
        With the line, if a block cannot be understood or must not be guessed at.
    UnitError
        If the unit of `options` is unknown or contradicts the file.
    """
    kept = content.rstrip(b"\0")
    padding = len(content) - len(kept)
    if padding > 1 and b"\0" not in kept:  # UTF-16 text has NUL bytes everywhere
        if not options.recover:
            what = f"ends with {padding} NUL bytes, as after a crash; export it again, or repair it with --recover"
            raise FormatError(path, what, byte=len(kept))
        content = kept
    lines = program_lines(path, content, options.limits)
    suffix = suffix_of_program(path)
    dialect = Dialect.of(suffix, lines, decimal=options.decimal, integers=options.integers)
    reader = GCodeReader(path, options, dialect)
    if options.integers is None and (whole := whole_numbers(lines, dialect)):
        reader.moves.note(Notice.WHOLE_NUMBERS, whole[0], count=len(whole))
    if padding > 1 and options.recover:
        reader.moves.note(Notice.PADDING_DROPPED, 0, count=padding)
    reader.read(lines)
    return reader


class GCodeReader:
    """Executes the blocks of one program in order.

    `name` is what the program calls itself, `dialect` how it writes numbers.
    """

    def __init__(self, path: Path, options: GCodeOptions, dialect: Dialect) -> None:
        self.moves = MoveList(path, options.limits, options.units, options.chord_mm, options.step_mm)
        self.name = ""
        self.dialect = dialect
        may_lack_feed = options.feed_mm_min is not None
        self.machine = Machine(self.moves, may_lack_feed)
        self.motion = Motion(self.moves, self.machine, options.rotary, may_lack_feed=may_lack_feed)
        self.heidenhain = False
        self._options = options
        self._plain = PlainMoves(self.moves, self.machine, self.motion, options.rotary)
        self._begun = False

    def read(self, lines: Sequence[str]) -> None:
        """Execute the blocks up to the end of the program."""
        plain, lines = self._plain.execute, self.with_points(lines)
        cut = self.is_cut(lines[-1])
        for number, line in enumerate(lines[: len(lines) - cut], 1):
            if not plain(line, number) and self.execute(line, number, last=number == len(lines)):
                self._note_rest(lines, number)
                return
        if cut:
            self.moves.note(Notice.LAST_STATEMENT_DROPPED, len(lines))
        else:
            self.moves.note_missing_end(len(lines), torn=is_torn(lines[-1]))

    def with_points(self, lines: Sequence[str]) -> Sequence[str]:
        """Return the lines with decimal points, but for those with remarks, which are cut into words first."""
        if self.dialect.decimal == ".":
            return lines
        return [line if _REMARK.search(line) else line.replace(",", ".") for line in lines]

    def step(self, line: str, number: int) -> bool:
        """Execute one line; return True if the program ends with it."""
        return not self._plain.execute(line, number) and self.execute(line, number)

    def execute(self, line: str, number: int, *, last: bool = False) -> bool:
        """Execute one line, the last one if nothing ends it; return True if the program ends with it."""
        try:
            return self._line(line, number)
        except GCodeError as problem:
            remedy = ""
            if last and line.strip():
                droppable = may_be_dropped(line, self.dialect.decimal)
                remedy = f"; the file ends in this line: {'drop it with --recover' if droppable else 'export it again'}"
            raise self.moves.error(f"{problem}{remedy}", number) from None

    def words(self, line: str) -> list[Word]:
        """Return the words of a line that was executed, with their places in it; none where it holds no block."""
        if self.dialect.decimal == "." and not self.dialect.increments and (plain := plain_words(line)) is not None:
            return plain
        text = line.strip(" \t\f\v\x1a")
        if not text or text[0] in "%<" or (self.heidenhain and _HEIDENHAIN_END.match(text)):
            return []
        block = split_block(_SKIPPED.sub(_blanked, line, count=1), self.dialect.decimal)
        return [word._replace(number=self._value(word.letter, word.number, block)) for word in block.placed]

    def is_cut(self, last: str) -> bool:
        """Say whether the last line is to be dropped: it has no end, nor does it move anything or end the program."""
        return self._options.recover and may_be_dropped(last, self.dialect.decimal)

    def _note_rest(self, lines: Sequence[str], number: int) -> None:
        rest = [later for later, text in enumerate(lines[number:], number + 1) if text.strip(" \t%\x1a")]
        if rest:
            self.moves.note(Notice.TEXT_AFTER_END, rest[0], count=len(rest))

    # --- blocks ---

    def _line(self, line: str, number: int) -> bool:
        text = line.strip(" \t\f\v\x1a")
        if not text:
            return False
        if text[0] == "%" or (self.heidenhain and _HEIDENHAIN_END.match(text)):
            return self._percent(text[text.index("%") :], number)
        if not self.name and not len(self.moves) and (name := _PROGRAM_NAME.match(text)):
            self.name = name[1].strip()
            line = " " * (line.index(">") + 1) + line[line.index(">") + 1 :]
        self._begun = True
        self._plain.usable = False  # until the block has shown that nothing unusual rules
        if text[0] == "/":
            if self._options.block_skip:
                self.moves.note(Notice.BLOCK_SKIPPED, number)
                self.moves.event(EventKind.OTHER, number, 0.0, text)
                return self._settle(False)
            line = _SKIPPED.sub(_blanked, line, count=1)
        if text[0] == ":":
            line = line.replace(":", "O", 1)
        block = split_block(line, self.dialect.decimal)
        for comment in block.comments:
            self.moves.event(EventKind.COMMENT, number, 0.0, comment)
        if "N" in block.words:
            self._count_block(block.words.pop("N"), number)
        return self._settle(self._execute(block, number))

    def _settle(self, ended: bool) -> bool:
        self._plain.usable = (
            self.motion.absolute
            and self.machine.feed_mode == 94.0
            and self.motion.offset.is_in_use
            and not (self.dialect.increments or self.machine.feed_unit_unknown)
        )
        return ended

    def _count_block(self, block_number: str, line: int) -> None:
        if self._plain.count_block(block_number):
            return
        if self._options.recover and block_number.isdigit() and len(block_number) <= 12:
            self.moves.note(Notice.BLOCKS_RESTART, line)
            self._plain.block_number = int(block_number)
            return
        raise GCodeError(
            f"block number N{block_number} after N{self._plain.block_number}; are these two programs in one file? "
            "split it, or repair it with --recover"
        )

    def _percent(self, text: str, line: int) -> bool:
        if text == "%" or (self.heidenhain and self._begun):
            ended, self._begun = self._begun, True
            return ended
        if self._begun and len(self.moves):
            raise GCodeError("a second program begins here; split the file")
        if head := _HEIDENHAIN_HEAD.fullmatch(text):
            self.heidenhain, self._begun = True, True
            self.moves.state_unit(UNITS[float(head[2])], line)
            self.machine.feed_unit_unknown = head[2] == "70"
            self.machine.follow_unit(line)
        self.name = self.name or (head[1] if head else text.lstrip("%").removeprefix("_N_").strip())
        self.moves.event(EventKind.COMMENT, line, 0.0, text)
        return False

    def _execute(self, block: Block, line: int) -> bool:
        number = block.words.pop("O", None)
        if number is not None:
            if len(self.moves) or block.g or block.m:
                raise GCodeError(f"O{number}: subprograms and flow control are not executed; post one program")
            self.name = f"O{number}"
        if self.heidenhain and heidenhain_text(block):
            # The blank or the measures of a tool: numbers that no tip goes to.
            words = [f"{word.letter}{word.number}" for word in block.placed if word.letter != "N"]
            self.moves.event(EventKind.OTHER, line, 0.0, " ".join(words))
            return False
        self._take_units(block, line)
        if 4.0 in block.g:
            self._take_increments(block)
        self.machine.take(block, line, " ".join(f"M{code:g}" for code in block.m))
        refuse_codes(block, self.heidenhain)
        self.motion.take_modes(block, line)
        if 4.0 not in block.g:
            self._take_increments(block)
        self._move(block, line)
        if block.words:
            raise GCodeError(f"{next(iter(block.words))} word with no code that uses it; correct the line")
        return self.machine.stop(block, line)

    def _move(self, block: Block, line: int) -> None:
        if one_of(block, HOMING) is not None or "SUPA" in block.keywords:
            self.motion.go_home(block, line)
        elif any(letter in block.words for letter in MOVING_LETTERS):
            if self.heidenhain and any(letter in block.words for letter in "IJK"):
                raise GCodeError("I J K is the pole in Heidenhain's dialect; post arcs with R, or G1 blocks")
            self.motion.move(block, line)

    def _take_increments(self, block: Block) -> None:
        if self.dialect.increments:
            block.words.update({name: self._value(name, number, block) for name, number in block.words.items()})

    def _value(self, letter: str, number: str, block: Block) -> str:
        if letter in "IJK" and self.motion.vector_words and (self.motion.mode or 0.0) < 2.0:
            return number  # a vector, of whatever length
        return self.dialect.value(letter, number, inch=self.moves.mm == 25.4 and 4.0 not in block.g)

    def _take_units(self, block: Block, line: int) -> None:
        code = one_of(block, UNITS)
        if code is None:
            return
        before = self.moves.mm
        self.moves.state_unit(UNITS[code], line)
        if self.moves.mm != before and self.motion.position != [None, None, None]:
            raise GCodeError("the length unit changes after coordinates; state it at the head of the program")
        self.machine.feed_unit_unknown = code == 70.0 and (self.dialect.siemens or self.heidenhain)
        if code == 70.0 and not self.machine.feed_unit_unknown and self._options.feed_mm_min is None:
            self.moves.note(Notice.FEED_IN_INCHES, line)
        self.machine.follow_unit(line)


def _blanked(found: re.Match[str]) -> str:
    return " " * len(found[0])
