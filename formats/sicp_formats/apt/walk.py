"""Walk through the statements of an APT or CL program once more, and put other coordinates where they must stand.

What is in force in the text *as it is written* is tracked: the position, for statements that state differences, and the
tool axis, for those that state none. A statement whose moves are unchanged stays as it is.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.apt.layout import Layout, Precision, comments_of
from sicp_formats.apt.reader import AptReader
from sicp_formats.apt.statements import last_line, statements
from sicp_formats.paths.arcs import Vector, norm
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["Goal", "Walk"]

_KEPT_MM = 5e-5
_DRIFT_MM = 1e-9
_HOLDS = 2e-7  # between two axes that were both written with seven decimals
_ON_AXIS = 1e-6
_AXIS_PRECISION = (5e-8, 7)
_BARE = re.compile(r"[/,\s][+-]?\.[0-9]", re.ASCII)
_PLAIN = Layout("GOTO/", ("0.0000", "0.0000", "0.0000"), (",", ","), "")


@dataclass(frozen=True, slots=True)
class Goal:
    """Where a program shall go, and where it went: tips in mm and axes in the frame of its numbers.

    Parameters
    ----------
    tips, axes, source
        (n,) moves to write, unit axes, and the move as read that each belongs to.
    old_tips, old_axes, old_rapid, lines
        (m,) moves as read, axes as they are stated, and the line of each.
    changed
        (m,) True for the moves as read that are not as they were.
    """

    tips: FloatArray
    axes: FloatArray
    source: IntArray
    old_tips: FloatArray
    old_axes: FloatArray
    old_rapid: BoolArray
    lines: IntArray
    changed: BoolArray


class Walk:
    """Writes one program again; `text` does it."""

    def __init__(self, reader: AptReader, goal: Goal, lines: list[str], ends: list[str], tally: Tally) -> None:
        self._goal = goal
        self._lines, self._ends, self._tally = lines, ends, tally
        # Plain lists: a statement is looked up in them faster than in arrays.
        self._tips, self._axes = goal.tips.tolist(), goal.axes.tolist()
        self._move_lines, self._source = goal.lines.tolist(), goal.source.tolist()
        self._line_end = next(filter(None, ends), "\n")
        self._mm = mm = reader.moves.mm
        bare = any(_BARE.search(line) for line in lines)
        self._precision = Precision(_KEPT_MM / mm, max(4, math.ceil(4.0 + math.log10(mm) - 1e-9)), bare)
        self._program = self._statements(reader)
        self._sample = self._first_goto(2) or self._first_goto(5) or _PLAIN
        self._axis_sample = self._first_goto(5)
        self._groups: dict[int, list[int]] = {}
        for opening, end in reader.arcs.pieces:
            self._groups.setdefault(opening, []).append(end)
        self._opening = {end: opening for opening, end in reader.arcs.pieces}
        self._as_points: set[int] = set()
        self._edits: dict[int, tuple[int, str]] = {}
        self._tip: Vector = (0.0, 0.0, 0.0)
        self._axis: Vector = (0.0, 0.0, 1.0)
        self._home: Vector = self._tip
        self._rapid_text = "RAPID"

    def text(self) -> str:
        """Return the text of the program for the goal."""
        handlers = {
            "GOTO": self._goto,
            "FROM": self._from,
            "GODLTA": self._godlta,
            "GOHOME": self._gohome,
            "TLAXIS": self._tlaxis,
            "CIRCLE": self._opens,
            "INDIRV": self._opens,
            "TLON,GOFWD": self._tlon,
            "RAPID": self._rapid,
        }
        for line, word, arguments in self._program:
            if word in handlers:
                handlers[word](line, arguments)
        parts, line = [], 1
        while line <= len(self._lines):
            last, text = self._edits.get(line, (line, self._lines[line - 1] + self._ends[line - 1]))
            parts.append(text)
            line = last + 1
        return "".join(parts)

    def _statements(self, reader: AptReader) -> list[tuple[int, str, str]]:
        found = []
        for statement in statements(reader.moves.path, self._lines):
            if statement[1] in ("FINI", "END"):
                break
            found.append(statement)
        return found

    def _first_goto(self, commas: int) -> Layout | None:
        """Return the layout of the first GOTO of 3 numbers (2 commas) or 6 (5 commas)."""
        for line, word, arguments in self._program:
            if word == "GOTO" and arguments.count(",") == commas:
                layout = self._layout(line)[1]
                return replace(layout, lead=layout.bare_lead(), tail="")
        return None

    # --- statements ---

    def _goto(self, line: int, arguments: str) -> None:
        opening = self._opening.get(line)
        first, end = self._moves_of(line)
        if opening is None:
            stays = self._may_stay(first, end, six=arguments.count(",") == 5)
        else:
            stays = opening not in self._as_points
        if stays:
            self._arrive(end - 1)
        else:
            self._write(line, first, end, self._layout(line)[1])

    def _tlon(self, line: int, arguments: str) -> None:
        first, end = self._moves_of(line)
        if self._opening[line] in self._as_points:
            self._write(line, first, end, self._sample)
        else:
            self._arrive(end - 1)

    def _opens(self, line: int, arguments: str) -> None:
        """Decide for a whole arc, where it begins, whether it stays or becomes points."""
        ends = self._groups.get(line)
        if ends is None:
            return
        goal = self._goal
        first, end = self._moves_of(ends[0])[0], self._moves_of(ends[-1])[1]
        if goal.changed[first - 1 : end].any() or self._drifted(first - 1):
            self._as_points.add(line)
            last = last_line(self._lines, line)
            self._edits[line] = (last, comments_of(self._raw(line, last)))
            self._tally.note(Notice.ARC_AS_POINTS, line, count=len(ends))

    def _from(self, line: int, arguments: str) -> None:
        first, end = self._moves_of(line)
        six = arguments.count(",") == 5
        if first == end:  # FROM again, where the tool is already
            last, layout = self._layout(line)
            axis = self._turned(line, layout.tokens[3:]) if six else ()
            self._replace(line, last, layout.written(layout.renewed((*self._tip, *axis), self._precision)))
            return
        if self._may_stay(first, end, six=six):
            self._arrive(end - 1)
        else:
            self._write(line, first, end, self._layout(line)[1])
        self._home = self._tip

    def _gohome(self, line: int, arguments: str) -> None:
        first, end = self._moves_of(line)
        if arguments.strip():
            self._goto(line, arguments)
            return
        (output, *added) = reversed(self._outputs(first, end))
        off = np.abs(self._goal.tips[output] - np.array(self._home) * self._mm).max()
        if not added and off < _KEPT_MM and self._holds(output):
            self._tip = self._home
            return
        layout = self._layout(line)[1]
        gaps = tuple(gap if "$" not in gap else "," for gap in self._sample.gaps[:2])
        self._write(line, first, end, Layout(f"{layout.lead}/", self._sample.tokens[:3], gaps, layout.tail))

    def _godlta(self, line: int, arguments: str) -> None:
        first, end = self._moves_of(line)
        if not self._goal.changed[first] and not self._drifted(first - 1):
            self._arrive(first)
            return
        last, layout = self._layout(line)
        outputs = self._outputs(first, end)
        if len(outputs) > 1 or not self._holds(outputs[0]) or len(layout.tokens) != 3:
            self._write(line, first, end, self._sample)
            return
        delta = self._goal.tips[outputs[0]] / self._mm - self._tip
        tokens = layout.renewed(delta.tolist(), self._precision)
        x, y, z = (at + float(step) for at, step in zip(self._tip, tokens, strict=True))
        self._tip = (x, y, z)
        self._replace(line, last, layout.written(tokens))

    def _tlaxis(self, line: int, arguments: str) -> None:
        last, layout = self._layout(line)
        axis = self._turned(line, layout.tokens)
        precision = Precision(*_AXIS_PRECISION, self._precision.bare)
        tokens = layout.renewed(axis, precision)
        self._set_axis(tokens)
        self._replace(line, last, layout.written(tokens))

    def _rapid(self, line: int, arguments: str) -> None:
        self._rapid_text = self._layout(line)[1].bare_lead()

    # --- writing ---

    def _moves_of(self, line: int) -> tuple[int, int]:
        """Return the first move as read that a statement makes, and the one after its last."""
        return bisect_left(self._move_lines, line), bisect_right(self._move_lines, line)

    def _outputs(self, first: int, end: int) -> range:
        """Return the moves to write for a range of moves as read."""
        return range(bisect_left(self._source, first), bisect_left(self._source, end))

    def _turned(self, line: int, tokens: tuple[str, ...]) -> Vector:
        """Return what a statement of the axis must say for the next move to have its axis; what it says if in doubt."""
        i, j, k = map(float, tokens)
        stated = np.array([i, j, k])
        length, following = float(np.linalg.norm(stated)), self._moves_of(line)[1]
        if not length or following == len(self._goal.lines):
            return (i, j, k)
        before = self._goal.old_axes[following]
        if np.abs(before / np.linalg.norm(before) - stated / length).max() > _ON_AXIS:
            return (i, j, k)
        i, j, k = (self._goal.axes[self._outputs(following, following + 1)[0]] * length).tolist()
        return (i, j, k)

    def _may_stay(self, first: int, end: int, *, six: bool) -> bool:
        if self._goal.changed[first:end].any():
            return False
        return six or self._holds(self._outputs(first, end)[-1])

    def _write(self, line: int, first: int, end: int, layout: Layout) -> None:
        """Write points for moves in place of the statement in `line`: the last in its layout, added ones before it."""
        last = last_line(self._lines, line)
        line_end = self._ends[last - 1] or self._line_end
        own = layout is not self._sample
        goto = self._sample.lead if not own or "GOTO" not in layout.lead.upper() else layout.bare_lead()
        outputs, text = self._outputs(first, end), []
        for output in outputs:
            if output > outputs[0] and self._goal.old_rapid[first]:
                text.append(f"{self._rapid_text}{line_end}")
            ends_here = output == outputs[-1] and own
            if ends_here:
                text.append(self._point(layout, output, layout.lead, layout.tail))
            else:
                text.append(self._point(layout.without_comments(), output, goto, ""))
            text.append(line_end if output < outputs[-1] else self._ends[last - 1])
        comments = "" if own else comments_of(self._raw(line, last))
        self._edits[line] = (last, comments + "".join(text))

    def _point(self, layout: Layout, output: int, lead: str, tail: str) -> str:
        tip, axis = [part / self._mm for part in self._tips[output]], self._axes[output]
        values = tip
        if len(layout.tokens) == 6:
            i, j, k = map(float, layout.tokens[3:])
            # (0, 0, 0) means the axis in force, and may go on saying so.
            length = norm((i, j, k)) or float(not self._holds(output))
            values = [*tip, *(part * length for part in axis)]
        elif not self._holds(output):
            layout = layout.with_axis(self._axis_sample, self._line_end)
            values = [*tip, *axis]
        tokens = layout.renewed(values, self._precision)
        x, y, z = map(float, tokens[:3])
        self._tip = (x, y, z)
        if len(tokens) == 6:
            self._set_axis(tokens[3:])
        return layout.written(tokens, lead, tail)

    def _arrive(self, move: int) -> None:
        """Take a statement as it stands: the tool is where it was after it."""
        x, y, z = (self._goal.old_tips[move] / self._mm).tolist()
        i, j, k = self._goal.old_axes[move].tolist()
        self._tip, self._axis = (x, y, z), (i, j, k)

    def _set_axis(self, tokens: tuple[str, ...]) -> None:
        i, j, k = map(float, tokens)
        if norm((i, j, k)):
            self._axis = (i, j, k)

    def _holds(self, output: int) -> bool:
        """Say whether the axis in force in what is written is that of a move."""
        length, axis = norm(self._axis), self._axes[output]
        return all(abs(goal - now / length) <= _HOLDS for goal, now in zip(axis, self._axis, strict=True))

    def _drifted(self, move: int) -> bool:
        """Say whether the tool, in what is written, is not exactly where it was after a move."""
        before = self._goal.old_tips[move].tolist()
        return any(abs(now * self._mm - old) > _DRIFT_MM for now, old in zip(self._tip, before, strict=True))

    def _layout(self, line: int) -> tuple[int, Layout]:
        last = last_line(self._lines, line)
        return last, Layout.of(self._raw(line, last))

    def _raw(self, line: int, last: int) -> list[str]:
        return [self._lines[number - 1] + self._ends[number - 1] for number in range(line, last + 1)]

    def _replace(self, line: int, last: int, text: str) -> None:
        self._edits[line] = (last, text + self._ends[last - 1])
