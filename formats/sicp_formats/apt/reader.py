"""Execute the statements of one APT or CL file: what moves the tool, and what is kept beside the motion."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import EventKind
from sicp_formats.apt.arcs import ArcReader
from sicp_formats.apt.arguments import NUMBER, split_arguments
from sicp_formats.apt.frames import Frames
from sicp_formats.apt.machine import Machine
from sicp_formats.apt.options import AptOptions
from sicp_formats.apt.refusals import HARMLESS, MOVES_NOTHING, reason_to_refuse, switches_on
from sicp_formats.apt.statements import COMMENT, TEXT_WORDS, last_line, statements_of, word_of
from sicp_formats.paths.arcs import Vector, minus, norm
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList
from sicp_formats.paths.text import program_lines

__all__ = ["AptReader", "execute"]

_POINT = re.compile(rf"{NUMBER},{NUMBER},{NUMBER}(?:,{NUMBER},{NUMBER},{NUMBER})?")
# Long programs are mostly such lines: letters for numbers are out, and what is left float() reads as NUMBER does.
_PLAIN_GOTO = re.compile(r"\s*GOTO\s*/([-0-9+.,eE ]+)", re.IGNORECASE | re.ASCII)

_UNITS = {
    **dict.fromkeys(("MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRE", "MILLIMETRES"), "mm"),
    **dict.fromkeys(("INCH", "INCHES", "IN"), "inch"),
    **dict.fromkeys(("CM", "CENTIMETER", "CENTIMETERS"), "cm"),
    **dict.fromkeys(("M", "METER", "METERS"), "m"),
}
_KEEPS_ITS_PLACE_MM = 1e-4
_ENDS = ("FINI", "END")
_A_POINT = 3  # numbers from which a statement may hold coordinates


def execute(path: Path, content: bytes, options: AptOptions, *, trusted: bool = False) -> AptReader:
    """Return the reader that has executed a program to its end; its `moves` are not judged as a whole yet.

    Parameters
    ----------
    path, content
        The file and its bytes.
    options
        How to read it.
    trusted
        True if the sense of arcs was settled before, and needs no second look.

    Raises
    ------
    FormatError
        With the line, if a statement cannot be understood or must not be guessed at.
    UnitError
        If the unit of `options` is unknown or contradicts the file.
    """
    moves = MoveList(path, options.limits, options.units, options.chord_mm, options.step_mm)
    reader = AptReader(moves, options, trusted=trusted)
    text = content.rstrip(b"\0")
    padding = len(content) - len(text)
    if padding > 1 and b"\0" not in text:  # UTF-16 text has NUL bytes everywhere
        if not options.recover:
            what = f"ends with {padding} NUL bytes, as after a crash; export it again, or repair it with --recover"
            raise FormatError(path, what, byte=len(text))
        moves.note(Notice.PADDING_DROPPED, 0, count=padding)
        content = text
    reader.read(program_lines(path, content, options.limits))
    return reader


class AptReader:
    """Executes the statements of one file in order."""

    def __init__(self, moves: MoveList, options: AptOptions, *, trusted: bool = False) -> None:
        self.moves = moves
        self.name = ""
        self.states_axes = False
        self.numbers_kept: list[str] = []
        self.arcs = arcs = ArcReader(moves, options.arc_sense, options.arc_points)
        self._options = options
        self._trusted = trusted
        self._machine = machine = Machine(moves)
        self._frames = frames = Frames(moves, options.frame)
        self._axis: Vector = (0.0, 0.0, 1.0)
        self._axis_stated = False
        self._rapid = False
        self._home: Vector | None = None
        self._ended = False
        self._statements = {
            "GOTO": self._goto,
            "FROM": self._from,
            "GODLTA": self._godlta,
            "GOHOME": self._gohome,
            "RAPID": self._set_rapid,
            "TLAXIS": self._tool_axis,
            "CIRCLE": arcs.circle,
            "INDIRV": arcs.direction,
            "TLON,GOFWD": self._along_circle,
            "MULTAX": self._multax,
            "UNITS": self._unit,
            "UNIT": self._unit,
            "MSYS": frames.msys,
            "CSYS": frames.csys,
            "FEDRAT": machine.feedrate,
            "SPINDL": machine.spindle,
            "COOLNT": machine.coolant,
            "DELAY": machine.delay,
        }

    def read(self, lines: list[str]) -> None:
        """Execute the statements up to FINI or END."""
        plain = _PLAIN_GOTO.fullmatch
        numbered = iter(enumerate(lines, 1))
        for number, line in numbered:
            if (match := plain(line)) and len(numbers := _floats(match[1])) in (3, 6):
                self._go(number, numbers)
                continue
            try:
                ended = self._execute(number, line, numbered)
            except FormatError as error:
                if any(text.strip() for _, text in numbered):
                    raise
                self._drop_last(error, line)
                break
            if ended:
                break
        self._finish(lines)

    def _execute(self, number: int, text: str, numbered: Iterator[tuple[int, str]]) -> bool:
        """Execute the statements of a line and those that it goes on in; say whether the program ends there."""
        for line, word, arguments in statements_of(self.moves.path, number, text, numbered):
            execute = self._statements.get(word)
            if execute is None:
                if word in _ENDS:
                    self._ended = True
                    self._note_rest(line, numbered)
                    return True
                self._other(line, word, arguments)
                continue
            try:
                execute(line, arguments)
            except FormatError as error:
                self._repair(error, line, word, arguments)
        return False

    def _note_rest(self, line: int, numbered: Iterator[tuple[int, str]]) -> None:
        left = [number for number, text in numbered if text.strip()]
        if left:
            self.moves.note(Notice.TEXT_AFTER_END, left[0], count=len(left))

    def _repair(self, error: FormatError, line: int, word: str, arguments: str) -> None:
        """Keep a damaged statement that moves nothing as text; the feed is not known after a damaged FEDRAT."""
        if word not in ("FEDRAT", "DELAY"):
            raise error
        if not self._options.recover:
            raise self.moves.error(f"{error.what}, or repair it with --recover", line) from None
        if word == "FEDRAT":
            self._machine.forget_feed()
        self.moves.event(EventKind.OTHER, line, 0.0, f"{word}/{arguments.strip()}")
        self.moves.note(Notice.STATEMENT_AS_TEXT, line, printable(f"{word}/{arguments.strip()}", 40))

    def _drop_last(self, error: FormatError, text: str) -> None:
        """Leave out the last statement of a file that ends without FINI, if it moves nothing and repairs are wanted."""
        if word_of(text) not in MOVES_NOTHING:
            raise error
        if not self._options.recover:
            offered = "--recover" in error.what
            what = error.what if offered else f"{error.what}; if the file was cut here, repair it with --recover"
            raise FormatError(error.path, what, line=error.line) from None
        self.moves.note(Notice.LAST_STATEMENT_DROPPED, error.line or 0)

    def _finish(self, lines: list[str]) -> None:
        self._frames.finish(len(lines))
        self.arcs.finish(trusted=self._trusted)
        self._machine.finish()
        if not self._ended:
            moved = int(self.moves.rows[-1]) if len(self.moves) else 0
            torn = moved > 0 and bool(lines[-1].strip()) and last_line(lines, moved) == len(lines)
            self.moves.note_missing_end(len(lines), torn=torn)

    # --- motion ---

    def _goto(self, line: int, arguments: str) -> None:
        self._go(line, self._numbers(line, arguments, "GOTO"))

    def _go(self, line: int, numbers: list[float]) -> None:
        tip = self._point(line, numbers)
        if self.arcs.idle:
            self.moves.rows.fromlist([*tip, *self._axis, self._machine.feed_mm_min, self._rapid, line])
            self._rapid = False
        elif self.arcs.circle_waits or self.arcs.leave(tip, line, rapid=self._rapid):
            self._follow(tip, line)
        else:
            self._move(tip, line)

    def _numbers(self, line: int, arguments: str, word: str) -> list[float]:
        match = _POINT.fullmatch(arguments)
        if match is None:
            raise self.moves.error(f"{word} needs 3 numbers, or 6 with the tool axis; correct the line", line)
        return [float(number) for number in match.groups() if number is not None]

    def _point(self, line: int, numbers: list[float]) -> Vector:
        if len(numbers) == 6:
            self._turn_axis((numbers[3], numbers[4], numbers[5]), line)
        mm = self.moves.mm
        return (numbers[0] * mm, numbers[1] * mm, numbers[2] * mm)

    def _turn_axis(self, axis: Vector, line: int) -> None:
        self.states_axes = True
        if axis == (0.0, 0.0, 0.0):
            if not self._axis_stated:
                raise self.moves.error("the tool axis is (0, 0, 0) and none was stated before; state one", line)
            self.moves.note(Notice.AXIS_ZERO, line)
        else:
            self._axis = axis
            self._axis_stated = True

    def _move(self, tip: Vector, line: int) -> None:
        self.moves.move(tip, self._axis, 0.0 if self._rapid else self._machine.feed_mm_min, self._rapid, line)
        self._rapid = False

    def _follow(self, tip: Vector, line: int) -> None:
        feed = 0.0 if self._rapid else self._machine.feed_mm_min
        self.arcs.follow(tip, self._axis, feed, self._rapid, line)
        self._rapid = False

    def _along_circle(self, line: int, arguments: str) -> None:
        self._follow(self.arcs.along(line, arguments), line)

    def _from(self, line: int, arguments: str) -> None:
        tip = self._point(line, self._numbers(line, arguments, "FROM"))
        before = self.moves.position()
        if len(self.moves):
            if before is None or norm(minus(tip, before)) > _KEEPS_ITS_PLACE_MM:
                raise self.moves.error("FROM in the middle of the path jumps to another point; split the file", line)
            return
        self._home = tip
        self.moves.move(tip, self._axis, 0.0, True, line)

    def _gohome(self, line: int, arguments: str) -> None:
        given = arguments.strip()
        home = self._point(line, self._numbers(line, arguments, "GOHOME")) if given else self._home
        if home is None:
            raise self.moves.error("GOHOME without a point, and no FROM before it; state the point", line)
        self._straight(home, line)

    def _godlta(self, line: int, arguments: str) -> None:
        numbers, words = split_arguments(arguments)
        start = self.moves.position()
        if len(numbers) != 3 or words or start is None:
            raise self.moves.error("GODLTA needs dx,dy,dz and a position before it; correct the line", line)
        mm = self.moves.mm
        dx, dy, dz = numbers
        self._straight((start[0] + dx * mm, start[1] + dy * mm, start[2] + dz * mm), line)

    def _straight(self, tip: Vector, line: int) -> None:
        self.arcs.leave(None, line, rapid=self._rapid)
        self._move(tip, line)

    def _set_rapid(self, line: int, arguments: str) -> None:
        if arguments.strip():
            raise self.moves.error("RAPID takes no arguments; correct the line", line)
        self._rapid = True

    def _tool_axis(self, line: int, arguments: str) -> None:
        numbers, words = split_arguments(arguments)
        if len(numbers) != 3 or words:
            raise self.moves.error("TLAXIS needs i,j,k; correct the line", line)
        self._turn_axis((numbers[0], numbers[1], numbers[2]), line)

    def _unit(self, line: int, arguments: str) -> None:
        unit_name = _UNITS.get(arguments.strip().upper())
        if unit_name is None:
            raise self.moves.error("UNITS needs MM, INCHES, CM or METERS; correct the line", line)
        self.moves.state_unit(unit_name, line)
        self._machine.update_feed()

    def _multax(self, line: int, arguments: str) -> None:
        """Note that the program may state axes; they are read wherever one stands, whatever MULTAX says."""
        self.states_axes = self.states_axes or switches_on(arguments)

    # --- everything else ---

    def _other(self, line: int, word: str, arguments: str) -> None:
        if word == COMMENT:
            self._comment(line, arguments)
        elif word in TEXT_WORDS:
            kind = EventKind.OTHER if word in ("INSERT", "LETTER") else EventKind.COMMENT
            self.moves.event(kind, line, 0.0, arguments if kind is EventKind.COMMENT else f"{word} {arguments}")
            if word == "PARTNO" and not self.name:
                self.name = arguments
        elif word in ("LOADTL", "LOAD", "TURRET"):
            self._machine.load_tool(line, arguments, word)
        elif word in ("SELECT", "TOOLNO"):
            self._machine.choose_tool(line, arguments, word)
        elif word in ("STOP", "OPSTOP"):
            self.moves.event(EventKind.STOP, line, 0.0, word)
        elif (allowed := self._allowed(word, arguments)) is not None:
            self.moves.note(allowed, line)
            self._keep(line, word, arguments)
        else:
            reason = reason_to_refuse(word, arguments)
            if reason is not None:
                raise self.moves.error(f"{word}: {reason}", line)
            self._keep(line, word, arguments)

    def _allowed(self, word: str, arguments: str) -> Notice | None:
        """Return what must be noted of a statement that is read only because the user wants it so."""
        if word == "CUTCOM" and self._options.cutcom == "ignore" and switches_on(arguments):
            return Notice.COMPENSATION_KEPT
        if word == "CYCLE" and self._options.cycles == "points" and switches_on(arguments):
            return Notice.CYCLE_AS_POINTS
        return None

    def _comment(self, line: int, text: str) -> None:
        self.moves.event(EventKind.COMMENT, line, 0.0, text)
        self._frames.comment(line, text)

    def _keep(self, line: int, word: str, arguments: str) -> None:
        self.moves.event(EventKind.OTHER, line, 0.0, f"{word}/{arguments.strip()}" if arguments.strip() else word)
        if word in ("TOOLPATH", "END-OF-PATH"):
            self._ended = word == "END-OF-PATH"
            self.name = self.name or arguments.split(",")[0].strip()
        if word not in HARMLESS:
            self.moves.note(Notice.WORD_UNKNOWN, line, printable(word, 40))
            if len(split_arguments(arguments)[0]) >= _A_POINT:
                self.numbers_kept.append(printable(f"{word} (line {line})", 60))


def _floats(text: str) -> list[float]:
    try:
        return list(map(float, text.split(",")))
    except ValueError:
        return []
