"""Read tool paths from Mastercam's ASCII NCI files: records of two lines, a code and its parameters.

No description of the format is open; the records were learnt from published readers of it, and agree between them:
0 and 1 (compensation, x, y, z, feed), 11 (tip, a point further up the tool axis, feed), feed -1 for unchanged and -2
for rapid, 1000 to 1003, 1014 and 1027. For arcs they agree but for the order of plane and compensation, which their
values tell apart, and for the sense in the XZ plane, so such arcs are refused. **Not verified on files of every
version of Mastercam**; compare the path with what Mastercam shows. What might be motion and is not known is refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

from sicp_cam.errors import FormatError, JobError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.paths.arcs import Vector, arc_between, minus, norm
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.number_tokens import NUMBER_TOKEN
from sicp_formats.paths.text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_CODE = re.compile(r"\s*([0-9]{1,6})\s*", re.ASCII)
_UP: Vector = (0.0, 0.0, 1.0)
_COMPENSATION_OFF, _COMPENSATION_ON = (0.0, 40.0, 140.0), (41.0, 42.0)
_UNCHANGED, _RAPID = -1.0, -2.0
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_FRAME_TOLERANCE = 1e-7
_RADIUS_TOLERANCE_MM = 0.05
# Places of (u, v, w) in (x, y, z), and the normal that u and v turn about; XZ is left out, see above.
_PLANES: dict[float, tuple[tuple[int, int, int], Vector]] = {0.0: ((0, 1, 2), _UP), 1.0: ((1, 2, 0), (1.0, 0.0, 0.0))}
_REFUSED = {
    **dict.fromkeys((81, 82, 100), "drilling cycles are no contour; take them out of the path"),
    **dict.fromkeys((200, 201), "threading is not read; take it out of the path"),
    **dict.fromkeys((1018, 1019), "subprograms are not read; output the operation without them"),
}
_TEXTS = range(1005, 1009)
_PARAMETERS = frozenset((80, 1004, 1011, 1012, 1013, 1016, 1017, 1020, 1025, 1050))
_MOVES_NOTHING = frozenset((4, 1000, 1001, 1002, 1014, 1027, *_TEXTS, *_PARAMETERS))


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    cutcom: str = "refuse",
) -> ToolPath:
    """Read an ASCII NCI file into a path in mm, mm/min and unit axes (tip to holder).

    Parameters
    ----------
    path
        The file.
    units
        Unit of coordinates and feeds, which the format does not state.
    limits
        Caps on the file and the path.
    recover
        Leave out a last record that is cut short and moves nothing.
    feed_mm_min
        Feed for cutting moves that the file gives none.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    cutcom
        ``ignore`` to read points that the control would shift by the tool's radius (41, 42) as they stand.

    Raises
    ------
    FormatError
        With the line, if a record cannot be understood or must not be guessed at.
    UnitError
        If `units` is unknown.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if cutcom not in ("refuse", "ignore"):
        raise JobError(f"path.cutcom = {cutcom!r} must be one of refuse, ignore")
    content = read_bytes(path, limits)
    if b"\0" in content:
        what = "is a binary NCI file, which only Mastercam reads; let it write ASCII NCI, or output APT"
        raise FormatError(path, what, byte=content.find(b"\0"))
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    reader = _Reader(moves, ignore_compensation=cutcom == "ignore")
    text = program_lines(path, content, limits)
    records = _records(moves, text)
    for number, record in enumerate(records, 1):
        try:
            if reader.execute(record):
                break
        except FormatError as error:
            if number < len(records) or record.code not in _MOVES_NOTHING:
                raise
            _drop_last(moves, error, recover=recover)
    else:
        lines = len(text)
        torn = bool(len(moves) and text[-1].strip()) and moves.rows[-1] == lines
        moves.note_missing_end(lines, torn=torn)
    return moves.build(content, format="NCI", name=reader.name, feed_mm_min=feed_mm_min)


@dataclass(frozen=True, slots=True)
class _Record:
    """A code, the line of its parameters, and that text."""

    code: int
    line: int
    text: str


def _records(moves: MoveList, lines: list[str]) -> list[_Record]:
    numbered = iter(enumerate(lines, 1))
    records = []
    for number, line in numbered:
        if not line.strip():
            continue
        code = _CODE.fullmatch(line)
        if code is None:
            raise moves.error("is no NCI code (a whole number on a line of its own); is this ASCII NCI?", number)
        records.append(_Record(int(code[1]), number + 1, next(numbered, (0, ""))[1].strip()))
    return records


def _drop_last(moves: MoveList, error: FormatError, *, recover: bool) -> None:
    """Leave out the last record of a file that has no end, where the user wants repairs."""
    if not recover:
        what = f"{error.what}; if the file was cut here, repair it with --recover"
        raise FormatError(error.path, what, line=error.line) from None
    moves.note(Notice.LAST_STATEMENT_DROPPED, error.line or 0)


class _Reader:
    """Executes the records of one file in order."""

    def __init__(self, moves: MoveList, *, ignore_compensation: bool) -> None:
        self.name = ""
        self._moves = moves
        self._ignore_compensation = ignore_compensation
        self._feed = 0.0
        self._axis = _UP
        self._execute: dict[int, Callable[[_Record], None]] = {
            0: self._line,
            1: self._line,
            2: self._arc,
            3: self._arc,
            4: self._dwell,
            11: self._five_axis,
            **dict.fromkeys((1000, 1001, 1002), self._tool),
            **dict.fromkeys((1014, 1027), self._frame),
            **dict.fromkeys(_TEXTS, self._text),
        }

    def execute(self, record: _Record) -> bool:
        """Execute one record; say whether it ends the file."""
        code = record.code
        if code == 1003:
            return True
        if code in self._execute:
            self._execute[code](record)
        elif code in _REFUSED:
            raise self._moves.error(f"code {code}: {_REFUSED[code]}", record.line - 1)
        else:
            self._keep(record)
        return False

    def _keep(self, record: _Record) -> None:
        code = record.code
        if code < 1000 and code not in _PARAMETERS:
            what = f"code {code} is not known and might move the tool; output lines, arcs and five-axis moves only"
            raise self._moves.error(what, record.line - 1)
        if code == 1050 and len(words := record.text.split(None, 8)) == 9:
            self.name = PureWindowsPath(words[8]).stem
        self._moves.event(EventKind.OTHER, record.line - 1, 0.0, printable(f"{code} {record.text}"))
        if code < 10_000 and code not in _PARAMETERS:
            self._moves.note(Notice.WORD_UNKNOWN, record.line - 1, str(code))

    def _numbers(self, record: _Record, least: int) -> list[float]:
        words = record.text.split()
        if len(words) < least or not all(NUMBER_TOKEN.fullmatch(word) for word in words[:least]):
            what = f"code {record.code} needs {least} numbers; correct the line, or output the operation again"
            raise self._moves.error(what, record.line)
        return [float(word) for word in words[:least]]

    def _line(self, record: _Record) -> None:
        compensation, x, y, z, feed = self._numbers(record, 5)
        self._check_compensation(compensation, record.line)
        self._move((x, y, z), _UP, feed, record, rapid=record.code == 0)

    def _five_axis(self, record: _Record) -> None:
        x, y, z, i, j, k, feed = self._numbers(record, 7)
        self._move((x, y, z), minus((i, j, k), (x, y, z)), feed, record, rapid=False)

    def _move(self, tip: Vector, axis: Vector, feed: float, record: _Record, *, rapid: bool) -> None:
        length, mm = norm(axis), self._moves.mm
        if not length:
            raise self._moves.error("the tool axis is (0, 0, 0); output the operation again", record.line)
        rapid = self._fast(feed, record.line) or rapid
        self._axis = (axis[0] / length, axis[1] / length, axis[2] / length)
        x, y, z = tip
        self._moves.move((x * mm, y * mm, z * mm), self._axis, 0.0 if rapid else self._feed, rapid, record.line)

    def _arc(self, record: _Record) -> None:
        first, second, *numbers, feed = self._numbers(record, 8)
        plane, compensation = (second, first) if first >= 40.0 or second in (1.0, 2.0) else (first, second)
        self._check_compensation(compensation, record.line)
        if plane not in _PLANES:
            what = "arcs in the XZ plane can mean both senses; output arcs in the XY plane only, or as lines"
            raise self._moves.error(what, record.line)
        (u, v, w), normal = _PLANES[plane]
        end, centre = [0.0] * 3, [0.0] * 3
        end[u], end[v], centre[u], centre[v], end[w] = (number * self._moves.mm for number in numbers)
        centre[w] = end[w]
        if record.code == 2:
            normal = (-normal[0], -normal[1], -normal[2])
        self._turn((end[0], end[1], end[2]), (centre[0], centre[1], centre[2]), normal, feed, record)

    def _turn(self, end: Vector, centre: Vector, normal: Vector, feed: float, record: _Record) -> None:
        moves, start = self._moves, self._moves.position()
        if start is None:
            raise moves.error("an arc before any position; where does it start?", record.line)
        moves.check_reach((*start, *end, *centre), record.line)
        arc = arc_between(start, end, centre, normal)
        if arc is None or abs(arc.radius_start - arc.radius_end) > _RADIUS_TOLERANCE_MM:
            raise moves.error("start and end of the arc do not lie on one circle; output it as lines", record.line)
        rapid = self._fast(feed, record.line)
        feed = 0.0 if rapid else self._feed
        sense = "clockwise" if record.code == 2 else "counterclockwise"
        moves.arc(arc, (self._axis, _UP), feed, rapid, record.line, sense)
        self._axis = _UP

    def _fast(self, feed: float, line: int) -> bool:
        """Take the feed of a record; say whether it is rapid."""
        if feed not in (_UNCHANGED, _RAPID):
            if not feed > 0.0:
                raise self._moves.error("the feed must be above zero, -1 (unchanged) or -2 (rapid)", line)
            self._feed = feed * self._moves.mm
        return feed == _RAPID

    def _check_compensation(self, value: float, line: int) -> None:
        if value in _COMPENSATION_ON and self._ignore_compensation:
            self._moves.note(Notice.COMPENSATION_KEPT, line)
        elif value in _COMPENSATION_ON:
            what = (
                "the control would shift this path by the tool radius; set the compensation type to computer, "
                "or read the points as they stand with --set path.cutcom=ignore"
            )
            raise self._moves.error(what, line)
        elif value not in _COMPENSATION_OFF:
            raise self._moves.error(f"{value:g} is no cutter compensation (0, 40, 41, 42, 140)", line)

    def _dwell(self, record: _Record) -> None:
        (seconds,) = self._numbers(record, 1)
        if seconds < 0.0:
            raise self._moves.error("the dwell is negative; correct the line", record.line)
        self._moves.event(EventKind.DWELL, record.line, seconds, f"4 {record.text}")

    def _tool(self, record: _Record) -> None:
        """Take a tool change (1001, 1002), or an operation with the tool that is in the spindle (1000)."""
        numbers = self._numbers(record, 10)
        tool, speed, coolant = numbers[3], numbers[7], numbers[9]
        if tool < 0.0 or tool != int(tool):
            raise self._moves.error(f"{tool:g} is no tool number; correct the line", record.line)
        kind = EventKind.OTHER if record.code == 1000 else EventKind.TOOL
        self._moves.event(kind, record.line, 0.0 if record.code == 1000 else tool, f"{record.code} {record.text}")
        self._moves.event(EventKind.SPINDLE, record.line, speed, "")
        self._moves.event(EventKind.COOLANT, record.line, float(coolant != 0.0), "")

    def _frame(self, record: _Record) -> None:
        """Refuse a tool plane (1014) or work coordinate system (1027) that is not that of the part."""
        count = 9 if record.code == 1014 else 12
        numbers = self._numbers(record, count)
        if any(abs(number - one) > _FRAME_TOLERANCE for number, one in zip(numbers, _IDENTITY, strict=False)):
            name = "tool plane" if record.code == 1014 else "work coordinate system"
            what = f"the {name} is not that of the part (Top, origin 0); set all planes of the operation to Top"
            raise self._moves.error(what, record.line)
        self._moves.event(EventKind.OTHER, record.line, 0.0, f"{record.code} {record.text}")

    def _text(self, record: _Record) -> None:
        self._moves.event(EventKind.COMMENT, record.line, 0.0, record.text)
