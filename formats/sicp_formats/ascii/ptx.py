"""Scans of Leica instruments with their grids: .ptx.

Each scan of a file begins with ten lines: columns and rows of its grid, position and axes of the scanner, and the
matrix that brings its points into the common frame. It multiplies row vectors, p' = p M, so that the translation stands
in its last row. A ray that came back from nowhere is the point 0 0 0. Position and axes repeat the matrix, or what it
was before a registration, and are not used.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.ascii.rows import COUNT, all_rows
from sicp_formats.ascii.table import Table, places
from sicp_formats.surfaces.checks import Code, check_registrable
from sicp_formats.surfaces.point_rows import point_rows
from sicp_formats.tables.blocks import quick_numbers
from sicp_formats.tables.rows import Row, cells, numbers
from sicp_formats.tables.stream import Block, TextStream, open_text

__all__ = ["read_scan"]

_FURTHER = {
    3: (),
    4: ("intensity",),
    6: ("red", "green", "blue"),
    7: ("intensity", "red", "green", "blue"),
}
_RIGID_TOLERANCE = 1e-3
# Matrices are written with six decimals or so; what is off by more is a scale or a shear, and told.
_ROUNDED_TOLERANCE = 1e-5
_HEADER_WIDTHS = (3, 3, 3, 3, 4, 4, 4, 4)


@dataclass(frozen=True, slots=True)
class _Grid:
    """The header of one scan: the size of its grid, its (4, 4) matrix, and the line that it begins in."""

    columns: int
    rows: int
    matrix: FloatArray
    line: int

    @property
    def size(self) -> int:
        """Number of rays, and of lines that follow."""
        return self.columns * self.rows


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read all scans of a PTX file into one, in their common frame.

    Parameters
    ----------
    path
        The file, perhaps packed as .gz.
    units
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`; metres if left out, as is the custom, with a
        finding that says so.
    limits
        Caps on what the file may ask for.
    recover
        True to take a last scan that is cut short; a finding tells how much is missing.

    Returns
    -------
    Scan
        Points in file order without the rays that did not return, with the columns intensity, red, green and blue
        where the file has them.

    Raises
    ------
    FormatError
        If a header or a row is damaged, a matrix is no rigid motion, the number of rows is not that of the grid, scans
        differ in their columns, or the points cannot register. With the line.
    UnitError
        If the unit is unknown.
    """
    unit = "m" if units is None else units
    mm = mm_per_unit(unit)
    with open_text(path, limits) as stream:
        reader = _Reader(path, stream, limits, recover)
        reader.read()
        table = reader.table
        if table is None or not len(table):
            raise FormatError(path, "no ray returned; export the scan again", line=1)
        names = _FURTHER[table.width]
        rows, found = point_rows(
            path,
            table.emptied(),
            places((0, 1, 2), (), range(3, table.width)),
            lambda row: {"line": table.line(row)},
            mm,
            limits,
            recover=recover,
        )
        check_registrable(path, rows.points_mm)
        source = stream.source(format="PTX", unit=unit, unit_stated=units is not None)
    columns = {name: rows.columns[str(at)] for at, name in enumerate(names, 3)}
    return Scan(rows.points_mm, None, None, source, reader.findings(units) + found, columns)


class _Reader:
    """Takes the scans from a stream, one after another."""

    def __init__(self, path: Path, stream: TextStream, limits: Limits, recover: bool) -> None:
        self.path, self.stream, self.limits, self.recover = path, stream, limits, recover
        self.table: Table | None = None
        self.scans = self.rays = 0
        self._cut = ""
        self._not_rigid: tuple[int, float] | None = None

    def read(self) -> None:
        """Read all scans."""
        while (grid := self._header()) is not None:
            self.scans += 1
            self._points(grid)

    def findings(self, units: str | None) -> tuple[Finding, ...]:
        """Return what is worth saying."""
        found = []
        if units is None:
            message = "a PTX file states no unit; metres are assumed, as is the custom: state the unit if it is another"
            found.append(Finding(Code.UNIT_BY_CONVENTION_M, Level.WARN, message, str(self.path)))
        if self.scans > 1:
            message = f"{self.scans} scans were brought into one frame by their matrices"
            found.append(Finding(Code.SCANS_JOINED, Level.INFO, message, str(self.path)))
        lost = self.rays - (len(self.table) if self.table is not None else 0)
        if lost:
            message = f"{lost} of {self.rays} rays did not return (0 0 0) and were dropped"
            found.append(Finding(Code.NO_RETURN, Level.INFO, message, str(self.path)))
        if self._not_rigid:
            line, off = self._not_rigid
            message = (
                f"the axes of a matrix are off from a rotation by {off:.1e}, as by a scale; the nearest rotation was "
                "taken: check the registration of the scans"
            )
            found.append(Finding(Code.MATRIX_NOT_RIGID, Level.WARN, message, f"{self.path}, line {line}"))
        if self._cut:
            found.append(Finding(Code.SCAN_CUT, Level.WARN, self._cut, str(self.path)))
        return tuple(found)

    def _header(self) -> _Grid | None:
        first = self._line()
        if first is None:
            return None
        if not COUNT.fullmatch(first[1]):
            shown = first[1][:60].decode("latin-1")
            what = f"{shown!r} is not the number of columns that begins a scan; is it a PTX file, or are there more "
            raise FormatError(self.path, f"{what}rows than the header says? export it again", line=first[0])
        second = self._line()
        if second is None or not COUNT.fullmatch(second[1]):
            what = "the number of rows of the grid is missing; is it a PTX file?"
            raise FormatError(self.path, what, line=second[0] if second else first[0])
        lines = [self._header_row(width, first[0]) for width in _HEADER_WIDTHS]
        matrix = np.vstack([values for _, values in lines[4:]])
        off = _off_rigid(matrix)
        if off > _RIGID_TOLERANCE:
            what = "the 4 x 4 matrix is no rigid motion with its translation in the last row; export the scan again"
            raise FormatError(self.path, what, line=lines[4][0])
        if off > _ROUNDED_TOLERANCE:
            self._not_rigid = self._not_rigid or (lines[4][0], off)
            matrix[:3, :3] = _nearest_rotation(matrix[:3, :3])
        grid = _Grid(int(first[1]), int(second[1]), matrix, first[0])
        if grid.size > self.limits.points:
            what = (
                f"a grid of {grid.columns} x {grid.rows}, more than the limit points = {self.limits.points}; raise it"
            )
            raise FormatError(self.path, what, line=first[0])
        return grid

    def _header_row(self, width: int, begin: int) -> tuple[int, FloatArray]:
        row = self._line()
        if row is None:
            what = "the file ends in the header of a scan; it is cut short"
            raise FormatError(self.path, what, line=begin)
        values, _ = numbers(self.path, [row], width, finite=range(width))
        return row[0], values

    def _line(self) -> Row | None:
        """Take the next line that is not blank."""
        while (block := self.stream.take(1)) is not None:
            for row in all_rows(self.path, block, self.limits):
                return row
        return None

    def _points(self, grid: _Grid) -> None:
        left = grid.size
        while left:
            block = self.stream.take(left)
            if block is None:
                self._end_early(grid, left)
                return
            values, lines = self._numbers(block, grid, grid.size - left)
            left -= len(values)
            self._keep(values, lines, grid.matrix)

    def _numbers(self, block: Block, grid: _Grid, present: int) -> tuple[FloatArray, int | IntArray]:
        """Return the rows of a block, and their lines."""
        values = quick_numbers(block.text, self.table.width) if self.table is not None else None
        if values is not None and len(values) == block.lines:
            return values, block.line
        rows = list(all_rows(self.path, block, self.limits))
        for at, row in enumerate(rows):
            # A number alone begins the next scan, unless it is the rest of a last row.
            if COUNT.fullmatch(row[1]) and (at < len(rows) - 1 or self._more()):
                what = f"{grid.size} rows are declared by the grid, {present + at} present; export the scan again"
                raise FormatError(self.path, what, line=grid.line)
        if self.table is None and rows:
            self.table = Table(self._width(rows[0]))
        width = self.table.width if self.table is not None else 3
        try:
            return numbers(self.path, rows, width, finite=range(width))
        except FormatError as error:
            if rows and error.line == rows[-1][0] and not self._more():
                return self._without_last(rows, width, error)
            raise

    def _width(self, row: Row) -> int:
        width = len(cells(row[1], None))
        if width not in _FURTHER:
            what = f"the row has {width} columns; x y z, and perhaps an intensity and red green blue, are known"
            raise FormatError(self.path, f"{what}: export it in this way", line=row[0])
        return width

    def _more(self) -> bool:
        return self._line() is not None

    def _without_last(self, rows: list[Row], width: int, error: FormatError) -> tuple[FloatArray, IntArray]:
        if not self.recover:
            raise FormatError(self.path, f"{error.what}; or repair it with --recover", line=error.line) from None
        return numbers(self.path, rows[:-1], width, finite=range(width))

    def _keep(self, values: FloatArray, lines: int | IntArray, matrix: FloatArray) -> None:
        self.rays += len(values)
        if self.table is None or not len(values):
            return
        returned = (values[:, :3] != 0.0).any(axis=1)
        if not returned.all():
            values = values[returned]
            at = np.flatnonzero(returned)
            lines = at + lines if isinstance(lines, int) else lines[at]
        with np.errstate(over="ignore", invalid="ignore"):  # the check of the coordinates tells the line
            moved = values[:, :3] @ matrix[:3, :3] + matrix[3, :3]
        self.table.append([*moved.T, *values[:, 3:].T], lines)
        if len(self.table) > self.limits.points:
            what = f"more points than the limit points = {self.limits.points}; raise it"
            raise FormatError(self.path, what, line=self.table.line(self.limits.points))

    def _end_early(self, grid: _Grid, left: int) -> None:
        what = f"{grid.size} rows are declared by the grid, {grid.size - left} present"
        if not self.recover:
            what += "; the file is cut short: export it again, or repair it with --recover"
            raise FormatError(self.path, what, line=grid.line)
        self._cut = f"the last scan is cut short: {what}"


def _off_rigid(matrix: FloatArray) -> float:
    """Return how far a matrix is from a rigid motion: 0 for one, infinity for what is none at all."""
    axes = matrix[:3, :3]
    if np.abs(axes).max() > 2.0 or not np.linalg.det(axes) > 0.0:  # the first keeps products from overflowing
        return np.inf
    last_column = np.abs(matrix[:, 3] - (0.0, 0.0, 0.0, 1.0)).max()
    return float(max(last_column, np.abs(axes @ axes.T - np.eye(3)).max()))


def _nearest_rotation(axes: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(axes)
    nearest: FloatArray = left @ right
    return nearest
