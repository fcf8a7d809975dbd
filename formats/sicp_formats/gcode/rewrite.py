"""Write a G-code program again with other coordinates: its own words, and nothing else, changed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, UnitError
from sicp_cam.model import BoolArray, FloatArray, IntArray, Rewritten, ToolPath
from sicp_formats.gcode.program import GCodeOptions, GCodeReader, execute
from sicp_formats.gcode.rewriting import NewMoves, Rewriting
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["GCodeOriginal"]

_TIP_MM = 2e-4
_AXIS = 2e-5
_SAME = 1e-12


@dataclass(frozen=True, slots=True)
class GCodeOriginal:
    """A G-code program as it was read: its file, its bytes (unpacked), and how it was read.

    Only when it is asked for, it is read a second time with an eye on the place of every word.
    """

    path: Path
    content: bytes
    options: GCodeOptions

    @property
    def suffix(self) -> str:
        """Suffix of the file without that of its packing."""
        plain = self.path.with_suffix("") if self.path.suffix.lower() == ".gz" else self.path
        return plain.suffix

    def rewritten(self, path: ToolPath, source_moves: IntArray) -> Rewritten:
        """Return the program with the moves of a path, see `Original`.

        Numbers stay as they are written where they are right to 0.05 um, 5e-8 (vectors) or 5e-6 degrees. Arcs of which
        any point has changed become straight blocks. What is written is read again and compared with the path.
        """
        reader = execute(self.path, self.content, self.options)
        tips, axes = _table(reader)
        problem = _mapping_problem(len(tips), path, source_moves)
        if problem:
            return self._refused(problem)
        moves = NewMoves.of(path, source_moves, tips, axes)
        if moves.is_as_read(_SAME):
            return Rewritten(self.content)
        for keep_arcs in (True, False):
            rewriting = Rewriting(self.path, self.content, self.options, reader, moves, keep_arcs=keep_arcs)
            content = rewriting.content()
            problem = self._disagreement(content, path, rewriting.written_axes)
            if not problem:
                return Rewritten(content, rewriting.tally.findings(self.path))
        return self._refused(problem)

    def _disagreement(self, content: bytes, path: ToolPath, written_axes: BoolArray) -> str:
        """Read what was written; return what of it is not the path, empty if it is."""
        try:
            reader = execute(self.path, content, self.options)
        except (FormatError, UnitError) as error:
            return f"the program as written cannot be read ({error})"
        tips, axes = _table(reader)
        limits = self.options.limits
        if len(path) > limits.path_points or np.abs(path.tips_mm).max() > limits.coordinate_mm:
            return "it is beyond the limits path_points or coordinate_mm"
        if len(tips) != len(path):
            return f"it has {len(tips)} moves where the path has {len(path)}"
        off = np.abs(tips - path.tips_mm).max(axis=1) > _TIP_MM
        turned = (np.abs(axes - path.axes).max(axis=1) > _AXIS) & written_axes
        rapid = np.frombuffer(reader.moves.rows).reshape(-1, 9)[:, 7] != 0.0
        wrong = np.flatnonzero(off | turned | (rapid != path.rapid))
        return f"line {path.lines[wrong[0]]} cannot say where the tool goes" if len(wrong) else ""

    def _refused(self, problem: str) -> Rewritten:
        tally = Tally()
        tally.note(Notice.NOT_REWRITTEN, 0, problem)
        return Rewritten(b"", tally.findings(self.path))


def _table(reader: GCodeReader) -> tuple[FloatArray, FloatArray]:
    """Return tips in mm and unit axes of all moves that were read."""
    table = np.array(reader.moves.rows, dtype=np.float64).reshape(-1, 9)
    axes = table[:, 3:6] / np.abs(table[:, 3:6]).max(axis=1, keepdims=True)
    return table[:, :3], axes / np.linalg.norm(axes, axis=1, keepdims=True)


def _mapping_problem(moves: int, path: ToolPath, source_moves: IntArray) -> str:
    if len(source_moves) != len(path):
        return f"{len(source_moves)} source moves are given for {len(path)} moves"
    if not np.array_equal(np.unique(source_moves), np.arange(moves)) or (np.diff(source_moves) < 0).any():
        return f"the path does not have the {moves} moves of the program in their order"
    return ""
