"""Read tool paths from APT and CL files: CATIA, NX, Creo, SolidWorks CAM and posts that write ISO 4343 APT.

Only what a contour needs is executed; a statement that would change coordinates in a way that is not sure is refused
with its line; every other statement goes into the path as an event.
"""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import JobError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.apt_arcs import ARC_SENSES, ArcReader
from sicp_formats.apt_arguments import NUMBER, split_arguments
from sicp_formats.apt_frames import FRAME_CHOICES, Frames
from sicp_formats.apt_machine import Machine
from sicp_formats.apt_refusals import HARMLESS, reason_to_refuse
from sicp_formats.apt_statements import COMMENT, TEXT_WORDS, statements
from sicp_formats.arcs import Vector
from sicp_formats.moves import MoveList, check_options
from sicp_formats.path_findings import Notice
from sicp_formats.program_text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_POINT = re.compile(rf"{NUMBER},{NUMBER},{NUMBER}(?:,{NUMBER},{NUMBER},{NUMBER})?")

_UNITS = {
    **dict.fromkeys(("MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRE", "MILLIMETRES"), "mm"),
    **dict.fromkeys(("INCH", "INCHES", "IN"), "inch"),
    **dict.fromkeys(("CM", "CENTIMETER", "CENTIMETERS"), "cm"),
    **dict.fromkeys(("M", "METER", "METERS"), "m"),
}


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    frame: str = "refuse",
    arc_sense: str = "auto",
) -> ToolPath:
    """Read an APT or CL file into a path in mm, mm/min and unit axes (tip to holder).

    Parameters
    ----------
    path
        The file.
    units
        Unit of a file that states none; must not contradict one that does.
    limits
        Caps on the file and the path.
    feed_mm_min
        Feed for cutting moves that the file gives none.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    frame
        What to do with a machining frame (NX MSYS, CATIA's ``$$*CATIA0``, CSYS) other than that of the part:
        ``refuse``, ``apply`` it so that the path comes into the frame of the CAD model, or ``keep`` the coordinates.
    arc_sense
        ``ccw`` or ``cw`` about the axis of CIRCLE statements; ``auto`` takes that of the dialect.

    Raises
    ------
    FormatError
        With the line, if a statement cannot be understood or must not be guessed at.
    UnitError
        If `units` is unknown or contradicts the file.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if frame not in FRAME_CHOICES or arc_sense not in ARC_SENSES:
        raise JobError(
            f"path.frame = {frame!r} must be one of {', '.join(FRAME_CHOICES)}, "
            f"path.arc_sense = {arc_sense!r} one of {', '.join(ARC_SENSES)}"
        )
    content = read_bytes(path, limits)
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    reader = _Reader(moves, frame, arc_sense)
    reader.read(program_lines(path, content, limits))
    return moves.build(content, format="APT", name=reader.name, feed_mm_min=feed_mm_min)


class _Reader:
    """Executes the statements of one file in order."""

    def __init__(self, moves: MoveList, frame: str, arc_sense: str) -> None:
        self.moves = moves
        self.name = ""
        self._machine = machine = Machine(moves)
        self._frames = frames = Frames(moves, frame)
        self._axis: Vector = (0.0, 0.0, 1.0)
        self._axis_stated = False
        self._rapid = False
        self._home: Vector | None = None
        self._arcs = arcs = ArcReader(moves, arc_sense)
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
        known = self._statements
        for line, word, arguments in statements(self.moves.path, lines):
            execute = known.get(word)
            if execute is not None:
                execute(line, arguments)
            elif word in ("FINI", "END"):
                self._ended = True
                left = [number for number, text in enumerate(lines[line:], line + 1) if text.strip()]
                if left:
                    self.moves.tally.note(Notice.TEXT_AFTER_END, left[0], count=len(left))
                break
            else:
                self._other(line, word, arguments)
        self._finish(len(lines))

    def _finish(self, last_line: int) -> None:
        self._frames.finish(last_line)
        self._arcs.finish()
        if not self._ended:
            self.moves.note(Notice.END_MISSING, last_line)

    # --- motion ---

    def _goto(self, line: int, arguments: str) -> None:
        tip = self._point(line, arguments, "GOTO")
        if self._arcs.idle:
            self.moves.rows.extend((*tip, *self._axis, self._machine.feed_mm_min, self._rapid, line))
            self._rapid = False
        elif self._arcs.circle_waits:
            self._follow(tip, line)
        else:
            self._arcs.leave(tip, line, rapid=self._rapid)
            self._move(tip, line)

    def _point(self, line: int, arguments: str, word: str) -> Vector:
        match = _POINT.fullmatch(arguments)
        if match is None:
            raise self.moves.error(f"{word} needs 3 numbers, or 6 with the tool axis; correct the line", line)
        x, y, z, i, j, k = match.groups()
        if i is not None:
            self._turn_axis((float(i), float(j), float(k)), line)
        mm = self.moves.mm
        return (float(x) * mm, float(y) * mm, float(z) * mm)

    def _turn_axis(self, axis: Vector, line: int) -> None:
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
        self._arcs.follow(tip, self._axis, feed, self._rapid, line)
        self._rapid = False

    def _along_circle(self, line: int, arguments: str) -> None:
        self._follow(self._arcs.along(line, arguments), line)

    def _from(self, line: int, arguments: str) -> None:
        tip = self._point(line, arguments, "FROM")
        if len(self.moves):
            if tip != self.moves.position():
                raise self.moves.error("FROM in the middle of the path jumps to another point; split the file", line)
            return
        self._home = tip
        self.moves.move(tip, self._axis, 0.0, True, line)

    def _gohome(self, line: int, arguments: str) -> None:
        home = self._point(line, arguments, "GOHOME") if arguments.strip() else self._home
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
        self._arcs.leave(None, line, rapid=self._rapid)
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
        """Pass over MULTAX: an axis is read wherever one stands, and every move of the model has one."""

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
        else:
            reason = reason_to_refuse(word, arguments)
            if reason is not None:
                raise self.moves.error(f"{word}: {reason}", line)
            self._keep(line, word, arguments)

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
