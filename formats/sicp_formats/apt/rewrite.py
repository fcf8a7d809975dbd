"""Write an APT or CL program again in its own words, with the coordinates and axes of another path."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sicp_cam.errors import InputError
from sicp_cam.model import BoolArray, FloatArray, IntArray, Rewritten, ToolPath
from sicp_formats.apt.options import AptOptions
from sicp_formats.apt.reader import AptReader, execute
from sicp_formats.apt.walk import Goal, Walk
from sicp_formats.paths.findings import Notice, Tally
from sicp_formats.paths.text import decoded, suffix_of_program

__all__ = ["AptOriginal"]

_SAME_MM, _SAME_AXIS = 5e-5, 1e-7
_AGREES_MM, _AGREES_AXIS = 2e-4, 1e-6
_SMALLEST_TURN_DEG = 1e-4
_MOST_NAMED = 5
_LINE_END = re.compile(r"\r\n|\r|\n")
_REPAIRS = {Notice.LAST_STATEMENT_DROPPED, Notice.STATEMENT_AS_TEXT, Notice.PADDING_DROPPED}


class _NoWordsError(Exception):
    """The program has no words for the path."""


@dataclass(frozen=True, slots=True)
class AptOriginal:
    """The bytes of a program and how they were read; nothing more is held until the program is written again."""

    path: Path
    content: bytes = field(repr=False)
    options: AptOptions

    @property
    def suffix(self) -> str:
        """Suffix of the file, with its dot."""
        return suffix_of_program(self.path)

    def rewritten(self, path: ToolPath, source_moves: IntArray) -> Rewritten:
        """Return the program with the moves of a path, see `sicp_cam.model.Original`.

        Numbers are kept as they stand where they tell the new value within 0.00005 mm, and axes within 5e-8; others
        are written in their own style. Arcs whose shape has changed become points. The result is read again and
        compared with the path before it is given out.
        """
        tally = Tally()
        try:
            content = self._written(path, np.asarray(source_moves, dtype=np.int64), tally)
        except _NoWordsError as reason:
            tally = Tally()
            tally.note(Notice.NOT_REWRITTEN, 0, str(reason))
            content = b""
        return Rewritten(content, tally.findings(self.path))

    def _written(self, path: ToolPath, source: IntArray, tally: Tally) -> bytes:
        try:
            reader = execute(self.path, self.content, self.options)
        except InputError as error:
            raise _NoWordsError(f"it is not readable any more ({error})") from None
        if _REPAIRS & set(reader.moves.tally.noted):
            raise _NoWordsError("it is damaged, and was repaired for reading only")
        before = _Moves.of(reader, self.options)
        self._check(before, path, source)
        goal = self._goal(reader, before, path, source, tally)
        if not goal.changed.any():
            return self.content
        if kept := reader.numbers_kept:
            more = f" and {len(kept) - _MOST_NAMED} more" if len(kept) > _MOST_NAMED else ""
            named = ", ".join(kept[:_MOST_NAMED])
            raise _NoWordsError(f"statements that are not known hold numbers that would stay: {named}{more}")
        text, mark, encoding = decoded(self.content)
        ends = [*_LINE_END.findall(text), ""]
        written = Walk(reader, goal, _LINE_END.split(text), ends, tally).text()
        content = mark + written.encode(encoding)
        self._verify(content, goal, before.feeds[source])
        return content

    @staticmethod
    def _check(before: _Moves, path: ToolPath, source: IntArray) -> None:
        """Refuse paths that are not made of the moves of this program."""
        whole = len(source) == len(path) and bool((np.diff(source) >= 0).all())
        if not whole or not np.array_equal(np.unique(source), np.arange(len(before.tips))):
            raise _NoWordsError("the path is not made of all moves of the program, in their order")
        if (before.rapid[source] != path.rapid).any() or not np.allclose(before.feeds[source], path.feeds_mm_min):
            raise _NoWordsError("the path has other feeds or rapid moves than the program")
        if before.feed_is_filled:
            raise _NoWordsError("it states no feed for some moves, and path.feed_mm_min cannot be put into it")

    @staticmethod
    def _goal(reader: AptReader, before: _Moves, path: ToolPath, source: IntArray, tally: Tally) -> Goal:
        """Return the path in the frame of the numbers of the file, and which moves of the file it changes."""
        tips, axes = np.array(path.tips_mm), np.array(path.axes)
        for first, end, T in reader.moves.frames():
            rows = (source >= first) & (source < end)
            tips[rows], axes[rows] = (tips[rows] - T[:3, 3]) @ T[:3, :3], axes[rows] @ T[:3, :3]
        if not reader.states_axes:
            turn = float(_angles_deg(before.axes[source], axes).max())
            if turn > _SMALLEST_TURN_DEG:
                tally.note(Notice.AXIS_NOT_WRITTEN, 0, f"{turn:.3g}")
            axes = before.axes[source]
        off = (np.abs(tips - before.tips[source]) >= _SAME_MM).any(axis=1)
        off |= (np.abs(axes - before.axes[source]) > _SAME_AXIS).any(axis=1)
        added = np.concatenate([source[1:] == source[:-1], [False]])
        changed = np.zeros(len(before.tips), dtype=bool)
        changed[source[off | added]] = True
        return Goal(tips, axes, source, before.tips, before.raw_axes, before.rapid, before.lines, changed)

    def _verify(self, content: bytes, goal: Goal, feeds: FloatArray) -> None:
        """Read what was written, and refuse it if it does not give the path back."""
        try:
            reader = execute(self.path, content, self.options, trusted=True)
        except InputError as error:
            raise _NoWordsError(f"what was written is not readable ({error})") from None
        after, limit_mm = _Moves.of(reader, self.options), self.options.limits.coordinate_mm
        if not (np.abs(after.tips) <= limit_mm).all():
            raise _NoWordsError(f"a coordinate is beyond the limit coordinate_mm = {limit_mm:g}")
        if len(after.tips) != len(goal.tips) or not np.allclose(after.feeds, feeds):
            raise _NoWordsError("what was written does not have the moves of the path")
        off_mm, off_axis = np.abs(after.tips - goal.tips).max(), np.abs(after.axes - goal.axes).max()
        if not (off_mm <= _AGREES_MM and off_axis <= _AGREES_AXIS):
            raise _NoWordsError(f"what was written differs by {off_mm:.2g} mm, and {off_axis:.2g} in the tool axis")


@dataclass(frozen=True, slots=True)
class _Moves:
    """The moves of a program in the frame of its numbers: tips in mm, axes as stated and of length 1, feeds, lines."""

    tips: FloatArray
    axes: FloatArray
    raw_axes: FloatArray
    feeds: FloatArray
    rapid: BoolArray
    lines: IntArray
    feed_is_filled: bool

    @classmethod
    def of(cls, reader: AptReader, options: AptOptions) -> _Moves:
        table = np.array(reader.moves.rows).reshape(-1, 9)
        raw, rapid = table[:, 3:6], table[:, 7] != 0.0
        missing = (table[:, 6] == 0.0) & ~rapid
        feeds = np.where(missing, options.feed_mm_min or 0.0, np.where(rapid, 0.0, table[:, 6]))
        filled = options.feed_mm_min is not None and bool(missing.any())
        units = raw / np.linalg.norm(raw, axis=1, keepdims=True)
        return cls(table[:, :3], units, raw, feeds, rapid, table[:, 8].astype(np.int64), filled)


def _angles_deg(a: FloatArray, b: FloatArray) -> FloatArray:
    across, along = np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)
    result: FloatArray = np.degrees(np.arctan2(across, along))
    return result
