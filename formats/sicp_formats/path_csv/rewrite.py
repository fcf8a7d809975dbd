"""Write a CSV table again with other coordinates: every cell that need not change stays as it is."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.errors import InputError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, IntArray, Rewritten, ToolPath
from sicp_formats.path_csv.columns import NUMBER_CELL, Columns
from sicp_formats.path_csv.rows import cell_places, without_remark
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["CsvOriginal"]

_AXES_NOT_WRITTEN = 340
_ANGLES_NOT_WRITTEN = 341
_LINES = re.compile(r"[^\r\n]*(?:\r\n|\r|\n|$)")
_END = re.compile(r"[\r\n]*\Z")
_TIP_DECIMALS, _AXIS_DECIMALS = 4, 7
_SAME_AXIS_DEG = 1e-3
_TIP_MM, _AXIS = 2e-4, 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class CsvOriginal:
    """A table that a path was read from, see `sicp_cam.model.Original`.

    Parameters
    ----------
    file, content
        The file and its bytes.
    delimiter, decimal, columns
        Its layout: the mark between cells, the decimal mark, and what the columns hold.
    read
        The path as it was read.
    mm
        Millimetres in one unit of the table.
    read_back
        Reads the bytes of a table as this one was read.
    """

    file: Path
    content: bytes
    delimiter: str | None
    decimal: str
    columns: Columns
    read: ToolPath
    mm: float
    read_back: Callable[[bytes], ToolPath]

    @property
    def suffix(self) -> str:
        """Suffix of the file."""
        return ".csv"

    def rewritten(self, path: ToolPath, source_moves: IntArray) -> Rewritten:
        """Return the table with the moves of a path; an added row copies all other cells of the row behind it.

        The result is read again and compared with the path before it is given out.
        """
        findings = self._orientation_findings(path, source_moves)
        if any(finding.level is Level.FAIL for finding in findings):
            return Rewritten(b"", findings)
        encoding, text = _decoded(self.content)
        lines = _LINES.findall(text)
        rows: dict[int, list[str]] = {line: [] for line in self.read.lines.tolist()}
        before: FloatArray | None = None
        for move, source in enumerate(source_moves.tolist()):
            line = int(self.read.lines[source])
            tip, axis = path.tips_mm[move], path.axes[move]
            rows[line].append(self._row(lines[line - 1], source, tip, axis, before))
            before = axis
        end = next((found for line in lines if (found := _line_end(line))), "\n")
        content = "".join(_replaced(lines, rows, end)).encode(encoding)
        if problem := self._disagreement(content, path):
            tally = Tally()
            tally.note(Notice.NOT_REWRITTEN, 0, problem)
            return Rewritten(b"", tally.findings(self.file))
        return Rewritten(content, findings)

    def _disagreement(self, content: bytes, path: ToolPath) -> str:
        """Read what was written; return what of it is not the path, empty if it is."""
        try:
            found = self.read_back(content)
        except InputError as error:
            return f"the table as written cannot be read ({error})"
        if len(found) != len(path):
            return f"it has {len(found)} moves where the path has {len(path)}"
        wrong = ~(np.abs(found.tips_mm - path.tips_mm).max(axis=1) <= _TIP_MM)
        if self.columns.orientation and self.columns.kind == "axis":
            wrong |= ~(np.abs(found.axes - path.axes).max(axis=1) <= _AXIS)
        wrong |= (found.rapid != path.rapid) | ~np.isclose(found.feeds_mm_min, path.feeds_mm_min)
        return f"move {int(np.flatnonzero(wrong)[0])} reads back as another one" if wrong.any() else ""

    def _orientation_findings(self, path: ToolPath, source_moves: IntArray) -> tuple[Finding, ...]:
        """Tell of axes that the table has no place for, or that it holds as angles."""
        if self.columns.orientation and self.columns.kind == "axis":
            return ()
        cosines = np.einsum("ni,ni->n", path.axes, self.read.axes[source_moves])
        largest = math.degrees(math.acos(min(1.0, max(-1.0, float(cosines.min())))))
        if largest <= _SAME_AXIS_DEG:
            return ()
        if self.columns.orientation:
            what = (
                "the table holds orientations as angles or quaternions, which are not written again; use another post"
            )
            return (Finding(_ANGLES_NOT_WRITTEN, Level.FAIL, what),)
        what = f"the table has no columns for the tool axis; changes up to {largest:.3g} degrees were not written"
        return (Finding(_AXES_NOT_WRITTEN, Level.WARN, what),)

    def _row(self, line: str, source: int, tip: FloatArray, axis: FloatArray, before: FloatArray | None) -> str:
        """Return a row with the tip and axis of a move."""
        text, _ = without_remark(line)
        places = cell_places(text.rstrip("\r\n"), self.delimiter)
        changes = {}
        for column, value, was in zip(self.columns.tip, tip, self.read.tips_mm[source], strict=True):
            if value != was:
                changes[column] = (
                    float(value) / self.mm,
                    _TIP_DECIMALS + math.ceil(math.log10(self.mm)),
                    5e-5 / self.mm,
                )
        if self.columns.orientation and not self._keeps_axis(line, places, source, axis, before):
            for column, value in zip(self.columns.orientation, axis, strict=True):
                changes[column] = (float(value), _AXIS_DECIMALS, 5e-8)
        for column, (value, decimals, tolerance) in sorted(changes.items(), reverse=True):
            start, end = places[column]
            line = (
                line[:start] + _rewritten_cell(line[start:end], value, decimals, tolerance, self.decimal) + line[end:]
            )
        return line

    def _keeps_axis(
        self, line: str, places: list[tuple[int, int]], source: int, axis: FloatArray, before: FloatArray | None
    ) -> bool:
        """Say whether the cells of the axis hold as they stand: zeros stand for the axis of the row before."""
        cells = [line[slice(*places[column])] for column in self.columns.orientation]
        if all(not cell.strip(" \t\"'+-0.,") for cell in cells):
            return before is not None and bool((axis == before).all())
        return bool((axis == self.read.axes[source]).all())


def _rewritten_cell(cell: str, value: float, decimals: int, tolerance: float, mark: str) -> str:
    """Return a cell with another number, in the way that it is written, or as it is where the number rounds to it."""
    found = NUMBER_CELL.search(cell)
    number = found[0] if found else "0"
    written = float(number.replace(",", "."))
    fraction = re.search(r"[.,]([0-9]*)", number)
    has_exponent = "e" in number.lower()
    places = max(decimals, len(fraction[1]) if fraction and not has_exponent else 0)
    if abs(value - written) < min(tolerance, 0.5 * 10.0**-places):
        return cell
    text = f"{value:.{places}f}"
    if not text.strip("-0."):
        text = text.lstrip("-")
    return cell.replace(number, text.replace(".", fraction[0][0] if fraction else mark), 1)


def _replaced(lines: list[str], rows: dict[int, list[str]], end: str) -> Iterator[str]:
    """Yield the lines of the file, rows replaced by those of the path."""
    for number, line in enumerate(lines, 1):
        new = rows.get(number, [line])
        for row in new[:-1]:
            yield row if _line_end(row) else row + end
        yield from new[-1:]


def _line_end(line: str) -> str:
    found = _END.search(line)
    return found[0] if found else ""


def _decoded(content: bytes) -> tuple[str, str]:
    """Return an encoding, and the text with its byte order mark, so that the one written in the other is the same."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding = "utf-16-le" if content[:2] == b"\xff\xfe" else "utf-16-be"
        return encoding, content.decode(encoding)
    try:
        return "utf-8", content.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1", content.decode("latin-1")
