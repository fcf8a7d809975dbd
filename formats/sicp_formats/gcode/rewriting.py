"""Go through a G-code program line by line and write it again with the moves of another path."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray, ToolPath
from sicp_formats.gcode.blocks import BlockWriter
from sicp_formats.gcode.orientation import FURTHER_DEG, Orientation
from sicp_formats.gcode.program import GCodeOptions, GCodeReader
from sicp_formats.gcode.state import Piece, ReadBlock, State
from sicp_formats.gcode.text import ProgramText
from sicp_formats.gcode.words import GCodeError
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["NewMoves", "Rewriting"]

_SAME_MM = 5e-5
_SAME_VECTOR = 5e-8
_LEAST_MISS_DEG = 1e-4
_LEARNT_LINES = 1000
_REMARK = re.compile(r'\([^()]*\)|;.*|"[^"]*"')
_STATED = re.compile(
    r"(?<![A-Z_])([ABC](?:3(?=[ \t]*=))?)[ \t]*(?:=[ \t]*)?(?:[-+.0-9]|(?:AC|IC|DC|ACP|ACN)\b)",
    re.ASCII | re.IGNORECASE,
)
_COORDINATE = re.compile(r"(?<![A-Z_])[XYZ][ \t]*=?[ \t]*[-+.0-9]", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class NewMoves:
    """The moves of a path by the moves of the program that they stand for.

    Parameters
    ----------
    tips, axes
        (n, 3) of the path that is to be written.
    starts
        (m + 1,) first of them for each move of the program.
    same
        True where nothing is to be changed, one per move of the path.
    largest
        Largest difference from the program in any number.
    """

    tips: FloatArray
    axes: FloatArray
    starts: IntArray
    same: list[bool]
    largest: float

    @classmethod
    def of(cls, path: ToolPath, source_moves: IntArray, tips: FloatArray, axes: FloatArray) -> NewMoves:
        """Compare a path with the (m, 3) tips and axes of the program."""
        moved = np.abs(path.tips_mm - tips[source_moves]).max(axis=1)
        turned = np.abs(path.axes - axes[source_moves]).max(axis=1)
        starts = np.searchsorted(source_moves, np.arange(len(tips) + 1))
        same = (moved < _SAME_MM) & (turned < _SAME_VECTOR)
        return cls(path.tips_mm, path.axes, starts, same.tolist(), float(max(moved.max(), turned.max())))

    def is_as_read(self, tolerance: float) -> bool:
        """Say whether the path is that of the program."""
        return len(self.tips) == len(self.starts) - 1 and self.largest <= tolerance

    def rows(self, first: int, last: int) -> range:
        """Return the moves that stand for those of the program from first up to last, exclusively."""
        return range(int(self.starts[first]), int(self.starts[last]))

    def tip(self, row: int) -> Vector:
        """Return the tip of a move as plain floats."""
        x, y, z = self.tips[row].tolist()
        return (x, y, z)

    def axis(self, row: int) -> Vector:
        """Return the axis of a move as plain floats."""
        i, j, k = self.axes[row].tolist()
        return (i, j, k)


class Rewriting:
    """One pass through a program; `written_axes` says for which moves of the path the axis could be stated."""

    def __init__(
        self,
        path: Path,
        content: bytes,
        options: GCodeOptions,
        read: GCodeReader,
        moves: NewMoves,
        *,
        keep_arcs: bool,
    ) -> None:
        self.tally = Tally()
        self.written_axes: BoolArray = np.ones(len(moves.tips), dtype=np.bool_)
        self._text = ProgramText.of(content)
        self._lines = list(self._text.lines)
        self._reader = GCodeReader(path, options, read.dialect)
        self._orientation = Orientation(options.rotary, _stated(self._lines), read.dialect)
        self._writer = BlockWriter(self._orientation, read.dialect)
        self._rows = read.moves.rows
        self._moves = moves
        self._keep_arcs = keep_arcs
        self._leading: dict[str, ReadBlock] = {}
        self._worst_miss_deg = 0.0
        self._learn_style()

    def content(self) -> bytes:
        """Return the bytes of the whole program."""
        reader, lines = self._reader, self._reader.with_points(self._lines)
        before, ended = State.of(reader), False
        last = len(lines) - reader.is_cut(lines[-1])
        for index, line in enumerate(lines):
            if ended or index >= last:
                self._leave(index)
                continue
            ended = reader.step(line, index + 1)
            after = State.of(reader)
            if self._lines[index].lstrip()[:1] == "/" and before == after:
                self._leave(index)
            elif before.moves == after.moves:
                self._follow(index, before, after)
            else:
                self._move(index, before, after)
            before = after
        if self._worst_miss_deg > _LEAST_MISS_DEG:
            self._note_misses()
        return self._text.content()

    def _learn_style(self) -> None:
        """See how the program writes words, before the first is to be written."""
        for line in self._lines[:_LEARNT_LINES]:
            # What is not executed - optional blocks, text after the end - need not be G-code.
            with contextlib.suppress(GCodeError):
                self._writer.note_style(line, self._reader.words(line))

    def _leave(self, index: int) -> None:
        """Leave a line that is not part of the path, and count it if it holds coordinates."""
        if _COORDINATE.search(_REMARK.sub("", self._lines[index])):
            self.tally.note(Notice.BLOCKS_LEFT_AS_THEY_WERE, index + 1)

    def _block(self, index: int, before: State, after: State) -> ReadBlock:
        words = self._reader.words(self._lines[index])
        firsts = {word.letter: word for word in reversed(words)}
        return ReadBlock(self._lines[index], index, words, firsts, before, after)

    def _follow(self, index: int, before: State, after: State) -> None:
        """Leave a line without a move; its coordinates lead to the first move behind it."""
        block = self._block(index, before, after)
        self._writer.follow_text(block)
        for letter, position in zip("XYZ", after.position, strict=True):
            if position is None:
                self._leading.pop(letter, None)
        stated = [*self._writer.coordinates(block)]
        if stated and self._orientation.states_axis(block):
            stated.append("axis")
        self._leading |= dict.fromkeys(stated, block)

    def _move(self, index: int, before: State, after: State) -> None:
        rows = self._moves.rows(before.moves, after.moves)
        same = len(rows) == after.moves - before.moves and all(self._moves.same[rows.start : rows.stop])
        if same and self._writer.is_as_in(before):
            self._writer.follow(after)
            self._leading.clear()
            return
        block = self._block(index, before, after)
        self._lead(block, rows[0])
        arc = (after.mode or 0.0) >= 2.0
        if arc and same and self._keep_arcs and self._writer.arc_may_stay(block):
            self._text.lines[index] = self._writer.keep_arc(block)
            return
        if arc:
            self.tally.note(Notice.ARC_AS_POINTS, index + 1)
        lines, missed = self._writer.write(block, self._pieces(block, rows))
        self._text.lines[index] = self._text.line_end(index).join(lines)
        self._note(index, rows, missed)

    def _lead(self, block: ReadBlock, row: int) -> None:
        """Let the coordinates that stood before the first known position lead to the first move."""
        if not self._leading:
            return
        leading, self._leading = self._leading, {}
        tip = dict(zip("XYZ", self._moves.tip(row), strict=True))
        for index in sorted({earlier.line for earlier in leading.values()}):
            earlier = next(found for found in leading.values() if found.line == index)
            letters = [name for name, found in leading.items() if found.line == index and not block.word(name)]
            turned = "axis" in letters and not self._orientation.states_axis(block) and earlier.after.absolute
            self._text.lines[index] = self._writer.restate(
                earlier,
                {letter: tip[letter] for letter in letters if letter in tip},
                self._moves.axis(row) if turned else None,
            )
            self._note_turn(index)

    def _pieces(self, block: ReadBlock, rows: range) -> list[Piece]:
        times = self._inverse_times(block, rows)
        return [
            Piece(self._moves.tip(row), self._moves.axis(row), number / len(rows), time)
            for number, (row, time) in enumerate(zip(rows, times, strict=True), 1)
        ]

    def _inverse_times(self, block: ReadBlock, rows: range) -> list[float]:
        """Return F of each piece under G93, so that the speed along the path stays; 0 if F means something else."""
        word = block.word("F")
        if word is None or not block.after.inverse_time or block.after.mode == 0.0:
            return [0.0] * len(rows)
        stated, start = float(word.number), block.before.position
        old_row = self._rows[9 * block.before.moves : 9 * block.before.moves + 9]
        straight = block.after.mode == 1.0
        still = straight and (None in start or math.dist(old_row[:3], [c or 0.0 for c in start]) == 0.0)
        times = []
        for row in rows:
            length = math.dist(self._moves.tip(row), self._moves.tip(row - 1)) if row else 0.0
            times.append(stated * len(rows) if still or length == 0.0 else old_row[6] / length)
        return times

    def _note(self, index: int, rows: range, missed: Sequence[float]) -> None:
        for row, miss in zip(rows, missed, strict=True):
            if miss:
                self.written_axes[row] = False
                self._worst_miss_deg = max(self._worst_miss_deg, miss)
        self._note_turn(index)

    def _note_turn(self, index: int) -> None:
        if self._orientation.further_deg > FURTHER_DEG:
            detail = f"by {self._orientation.further_deg:.0f} in line {index + 1}"
            self.tally.note(Notice.ROTARY_TURNS_FURTHER, index + 1, detail)

    def _note_misses(self) -> None:
        notice = Notice.AXIS_NOT_IN_FORCE if self._orientation.is_stated else Notice.AXIS_NOT_WRITTEN
        count = int((~self.written_axes).sum())
        self.tally.note(notice, 0, f"{self._worst_miss_deg:.4f}", count)


def _stated(lines: Sequence[str]) -> frozenset[str]:
    """Return the letters of the orientation words that a program has anywhere."""
    found: set[str] = set()
    for line in lines:
        found.update(letter.upper() for letter in _STATED.findall(_REMARK.sub("", line)))
    return frozenset(found)
