"""Collect moves, events and findings while a program is read, and turn them into one ToolPath.

Readers append rows in millimetres; what all path formats have in common - units, caps, unit axes, missing feeds,
repeated points - is judged here once, over the whole path.
"""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import BoolArray, Event, EventKind, FloatArray, IntArray, Original, ToolPath
from sicp_cam.rigid_motion import from_parts
from sicp_cam.units import mm_per_unit
from sicp_formats.paths.arcs import Arc, Vector, dot, norm, unit
from sicp_formats.paths.findings import Notice, Tally
from sicp_formats.source import describe

__all__ = ["MoveList", "check_options"]

_COLUMNS = 9  # x, y, z, i, j, k, feed, rapid, line
_UNIT_AXIS_TOLERANCE = 1e-3
_SHORTEST_AXIS = 1e-6
_LONGEST_AXIS = 1e9
_PER_TURN = "{} state it per revolution, which cannot be converted: no speed in rev/min is stated"
_RETRACTS = 0.99  # cosine between a last move and the tool axis


@dataclass(slots=True)
class MoveList:
    """The moves and events of one file as they are found.

    Parameters
    ----------
    path, limits
        The file, for messages, and the caps.
    unit_option
        Unit that the user stated, if any.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    rows
        Nine numbers for each move: tip (mm), axis, feed (mm/min, 0 for none), rapid (0 or 1), line.
    mm
        Millimetres in one unit of the file, as far as it is known.
    poses
        (first row, (4, 4) motion to the part frame in the unit of the file) where a stated frame is to be applied.
    per_turn
        How many cuts have a feed per revolution that nothing makes one in mm/min.
    """

    path: Path
    limits: Limits = DEFAULT_LIMITS
    unit_option: str | None = None
    chord_mm: float = 0.005
    step_mm: float = 2.0
    rows: array[float] = field(default_factory=lambda: array("d"))
    events: list[Event] = field(default_factory=list)
    mm: float = 1.0
    unit: str | None = None
    poses: list[tuple[int, FloatArray]] = field(default_factory=list)
    frame_since: int = 0
    tally: Tally = field(default_factory=Tally)
    chosen_tools: list[tuple[int, Event]] = field(default_factory=list)
    per_turn: int = 0

    def __post_init__(self) -> None:
        if self.unit_option is not None:
            self.mm = mm_per_unit(self.unit_option)

    def __len__(self) -> int:
        return len(self.rows) // _COLUMNS

    def error(self, what: str, line: int) -> FormatError:
        """Return the error that names this file and a line."""
        return FormatError(self.path, what, line=line)

    def note(self, notice: Notice, line: int, detail: str = "", count: int = 1) -> None:
        """Count something worth a finding."""
        self.tally.note(notice, line, detail, count)

    def event(self, kind: EventKind, line: int, value: float = 0.0, text: str = "") -> None:
        """Append an event before the next move."""
        self.events.append(Event(len(self), kind, value, text, line))

    def choose_tool(self, line: int, number: float, text: str) -> None:
        """Append a tool that is chosen, not yet loaded: it counts as loaded only if the file never loads one."""
        self.event(EventKind.OTHER, line, 0.0, text)
        self.chosen_tools.append((len(self.events) - 1, Event(len(self), EventKind.TOOL, number, text, line)))

    def move(self, tip: Vector, axis: Vector, feed: float, rapid: bool, line: int) -> None:
        """Append one straight move."""
        self.rows.extend((*tip, *axis, feed, rapid, line))

    def position(self) -> Vector | None:
        """Return the tip after the last move as the program states it, or None if it is not known."""
        if len(self) == self.frame_since:
            return None
        x, y, z = self.rows[-_COLUMNS : 3 - _COLUMNS]
        return (x, y, z)

    def cuts_since(self, first: int) -> int:
        """Return how many moves are cuts, from that one on."""
        return self.rows[first * _COLUMNS + 7 :: _COLUMNS].count(0.0)

    def note_missing_end(self, line: int, *, torn: bool = False) -> None:
        """Note that no statement ends the program: a warning if it ends in a cut.

        Parameters
        ----------
        line
            The last line.
        torn
            True if the last statement moves the tool and not even its line has an end.
        """
        detail = ", whose line has no end either" if torn else ""
        self.tally.note(Notice.END_MISSING, line, detail, grave=torn or self._ends_in_a_cut())

    def _ends_in_a_cut(self) -> bool:
        """Say whether the last move is neither rapid nor straight off the part along the tool axis."""
        if not len(self) or self.rows[-2]:
            return False
        if len(self) == 1:
            return True
        x, y, z, i, j, k = self.rows[-_COLUMNS:-3]
        a, b, c = self.rows[-2 * _COLUMNS : 3 - 2 * _COLUMNS]
        travel = (x - a, y - b, z - c)
        return not dot(travel, (i, j, k)) > _RETRACTS * norm(travel) * norm((i, j, k))

    def change_frame(self, T: FloatArray) -> None:
        """Apply a motion to all moves from here on; where the tool is in the new frame is not known."""
        self.poses.append((len(self), T))
        self.frame_since = len(self)

    def state_unit(self, stated: str, line: int) -> None:
        """Take the unit that the file states.

        Raises
        ------
        UnitError
            If the user stated another one.
        FormatError
            If the unit changes, or comes only after moves that were read in another one.
        """
        if self.unit_option is not None and stated != self.unit_option:
            where = f"{self.path}, line {line}"
            raise UnitError(
                f"{where}: the file states {stated}, the job {self.unit_option}; correct or drop --path-units"
            )
        if (self.unit is not None and stated != self.unit) or (len(self) and mm_per_unit(stated) != self.mm):
            raise self.error(f"the length unit changes to {stated} within the path; split the file there", line)
        self.unit = stated
        self.mm = mm_per_unit(stated)

    def check_reach(self, numbers: tuple[float, ...], line: int) -> None:
        """Refuse coordinates in mm that are not finite or beyond the cap."""
        if not all(abs(number) <= self.limits.coordinate_mm for number in numbers):
            raise self.error(self._too_far(), line)

    def arc(self, arc: Arc, axes: tuple[Vector, Vector], feed: float, rapid: bool, line: int, sense: str) -> None:
        """Append an arc as straight moves; the axis turns evenly from the first to the second of `axes`."""
        steps = arc.steps(self.chord_mm, self.step_mm)
        if len(self) + steps > self.limits.path_points:
            raise self.error(self._too_many(), line)
        first, last = axes
        fixed = first == last
        for piece, tip in enumerate(arc.points(steps), 1):
            axis = last if fixed else _blended(first, last, piece / steps)
            if axis is None:
                raise self.error("the tool axis turns round by 180 degrees along the arc; split the arc", line)
            self.rows.extend((*tip, *axis, feed, rapid, line))
        self.note(Notice.ARC_FLATTENED, line, sense)

    def forget_lines(self) -> None:
        """Take all lines as not known: a line means nothing without its file, and a path has room for one file."""
        self.rows[_COLUMNS - 1 :: _COLUMNS] = array("d", bytes(8 * len(self)))
        self.events[:] = [replace(event, line=0) for event in self.events]
        for noted in self.tally.noted.values():
            noted.line = 0

    def build(
        self,
        content: bytes,
        *,
        format: str,
        name: str = "",
        feed_mm_min: float | None = None,
        original: Original | None = None,
    ) -> ToolPath:
        """Return the path.

        Parameters
        ----------
        content
            The bytes of the file, for its record.
        format, name
            Of the file, and of the program in it.
        feed_mm_min
            Feed for the cutting moves that have none.
        original
            What can write the program again.

        Raises
        ------
        FormatError
            If there are too few or too many moves, a coordinate is not finite or beyond the cap, or an axis is zero.
        """
        table = np.frombuffer(self.rows, dtype=np.float64).reshape(-1, _COLUMNS)
        lines = table[:, 8].astype(np.int64)
        self._check_tips(table[:, :3], lines)
        tips = self._placed(table[:, :3], points=True)
        axes = self._placed(self._unit_axes(table[:, 3:6], lines), points=False)
        rapid = table[:, 7] != 0.0
        feeds = self._feeds(table[:, 6], rapid, lines, feed_mm_min)
        self._note_repeats(tips, axes, lines)
        for column in (tips, axes, feeds, rapid, lines):
            column.setflags(write=False)  # the path takes locked arrays as they are
        stated = self.unit is not None or self.unit_option is not None
        if not stated:
            self.note(Notice.UNIT_ASSUMED, 0)
        source = describe(
            self.path, content, format=format, unit=self.unit or self.unit_option or "mm", unit_stated=stated
        )
        found = self.tally.findings(self.path)
        return ToolPath(tips, axes, feeds, rapid, lines, self._all_events(), name, source, found, original)

    def frames(self) -> list[tuple[int, int, FloatArray]]:
        """Return (first move, last move + 1, (4, 4) motion in mm) for each frame that is applied."""
        ends = [*(first for first, _ in self.poses[1:]), len(self)]
        return [
            (first, end, from_parts(T[:3, :3], T[:3, 3] * self.mm))
            for (first, T), end in zip(self.poses, ends, strict=False)
        ]

    def _placed(self, vectors: FloatArray, *, points: bool) -> FloatArray:
        placed = np.array(vectors)
        for first, end, T in self.frames():
            placed[first:end] = placed[first:end] @ T[:3, :3].T + (T[:3, 3] if points else 0.0)
        return placed

    def _check_tips(self, tips: FloatArray, lines: IntArray) -> None:
        if len(tips) > self.limits.path_points:
            raise self.error(self._too_many(), int(lines[self.limits.path_points]))
        if not len(tips):
            raise FormatError(self.path, "holds no move; is this a tool path?", line=1)
        bad = ~(np.abs(tips) <= self.limits.coordinate_mm).all(axis=1)
        if bad.any():
            raise self.error(self._too_far(), int(lines[bad][0]))
        if not (tips != tips[0]).any():
            raise self.error("all moves end at one point, which is no path; export the whole operation", int(lines[0]))

    def _unit_axes(self, axes: FloatArray, lines: IntArray) -> FloatArray:
        largest = np.abs(axes).max(axis=1)
        bad = ~((largest > _SHORTEST_AXIS) & (largest < _LONGEST_AXIS))
        if bad.any():
            raise self.error("the tool axis is no direction; state a vector of length 1", int(lines[bad][0]))
        scaled = axes / largest[:, None]
        lengths = np.linalg.norm(scaled, axis=1)
        off = np.flatnonzero(np.abs(lengths * largest - 1.0) > _UNIT_AXIS_TOLERANCE)
        if len(off):
            self.tally.note(Notice.AXIS_NOT_UNIT, int(lines[off[0]]), count=len(off))
        result: FloatArray = scaled / lengths[:, None]
        return result

    def _feeds(
        self,
        feeds: FloatArray,
        rapid: BoolArray,
        lines: IntArray,
        feed_mm_min: float | None,
    ) -> FloatArray:
        missing = ~rapid & (feeds == 0.0)
        if feed_mm_min is None and missing.any():
            detail = f" that is known in mm/min ({_PER_TURN.format(self.per_turn)})" if self.per_turn else ""
            self.tally.note(Notice.FEED_MISSING, int(lines[missing][0]), detail, int(missing.sum()))
        bad = ~np.isfinite(feeds)
        if bad.any():
            raise self.error("the feed is too large to be a number; correct it", int(lines[bad][0]))
        filled: FloatArray = np.where(missing, feed_mm_min or 0.0, feeds)
        return np.where(rapid, 0.0, filled)

    def _note_repeats(self, tips: FloatArray, axes: FloatArray, lines: IntArray) -> None:
        same = ((tips[1:] == tips[:-1]) & (axes[1:] == axes[:-1])).all(axis=1)
        if same.any():
            self.tally.note(Notice.POINT_REPEATED, int(lines[1:][same][0]), count=int(same.sum()))

    def _all_events(self) -> tuple[Event, ...]:
        if not any(event.kind is EventKind.TOOL for event in self.events):
            for index, event in self.chosen_tools:
                self.events[index] = event
        return tuple(self.events)

    def _too_far(self) -> str:
        return f"a coordinate is beyond the limit coordinate_mm = {self.limits.coordinate_mm:g}; is the unit right?"

    def _too_many(self) -> str:
        return f"the path has more moves than the limit path_points = {self.limits.path_points}; split it or raise it"


def check_options(*, feed_mm_min: float | None, chord_mm: float, step_mm: float) -> None:
    """Refuse lengths and feeds from a job that are not positive numbers, all at once, with a JobError."""
    given = {"path.feed_mm_min": feed_mm_min, "path.chord_mm": chord_mm, "path.step_mm": step_mm}
    problems = [
        f"{key} = {value} must be a positive number"
        for key, value in given.items()
        if value is not None and not (math.isfinite(value) and value > 0.0)
    ]
    if problems:
        raise JobError(*problems)


def _blended(first: Vector, last: Vector, share: float) -> Vector | None:
    a, b = unit(first), unit(last)
    if a is None or b is None:
        return None
    rest = 1.0 - share
    return unit((rest * a[0] + share * b[0], rest * a[1] + share * b[1], rest * a[2] + share * b[2]))
