"""Read tool paths from CSV tables: one move a row, columns named by a header or the user, or x,y,z[,i,j,k]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from sicp_cam.errors import JobError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Event, EventKind, IntArray, ToolPath
from sicp_formats.path_csv.columns import (
    NUMBER_CELL,
    Columns,
    HeaderError,
    columns_of_names,
    columns_of_width,
    names_of_option,
)
from sicp_formats.path_csv.rewrite import CsvOriginal
from sicp_formats.path_csv.rows import cells_of, delimiter_of, without_remark
from sicp_formats.paths.arcs import Vector, norm
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.motion import pose_of_quaternion, pose_xyz, pose_zyx, tool_side
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_FLAGS = {"0": False, "1": True, "0.0": False, "1.0": True, "false": False, "true": True}
_EULER = ("xyz", "zyx")
_NOT_UNIT_AT_ALL = 0.02
_SHORTEST_AXIS, _LONGEST_AXIS = 0.5, 2.0
_LARGEST_ANGLE_DEG = 1e6


@dataclass(frozen=True, slots=True)
class _Options:
    """How a file is to be read: the options of `read_path`, with the column and sign of the tool axis as `side`."""

    path: Path
    limits: Limits
    units: str | None
    feed_mm_min: float | None
    columns: str | None
    euler: str | None
    side: tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Table:
    """How the rows of one file are laid out, and how their orientations are to be understood."""

    delimiter: str | None
    columns: Columns
    side: tuple[int, int]
    euler: str | None


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    columns: str | None = None,
    euler: str | None = None,
    tool_axis: str = "-z",
) -> ToolPath:
    """Read a CSV table into a path in mm, mm/min and unit axes (tip to holder).

    The delimiter is a semicolon, a tab or a comma, or blanks where there is none of these; decimals may have commas
    unless the comma is the delimiter. A header names at least x, y and z; it may name an orientation - a vector i,j,k
    (nx,ny,nz; ux,uy,uz), a quaternion qw,qx,qy,qz, angles rx,ry,rz or w,p,r -, feed, rapid, and units (``x [mm]``,
    ``x_mm``, ``speed [mm/s]``). What stands behind ``#`` or ``//`` is a comment. Without names there are 3 or 6
    columns.

    Parameters
    ----------
    path
        The file.
    units
        Unit of a table that states none; must not contradict one that does. Feeds are in that unit per minute.
    limits
        Caps on the file and the path.
    recover
        Takes no effect: every row moves the tool, so none is ever left out.
    feed_mm_min
        Feed for cutting moves that the table gives none.
    chord_mm, step_mm
        As for other path formats; a table holds no arcs.
    columns
        Names of the columns, separated by commas, instead of a header; ``-`` for one that is not read.
    euler
        How angles in degrees make an orientation: ``xyz`` for R = Rx Ry Rz, ``zyx`` for R = Rz Ry Rx (W P R of
        Fanuc, C B A of KUKA: with it columns a,b,c are angles about z, y and x).
    tool_axis
        Axis of the tool frame that points from the tip to the holder, for angles and quaternions.

    Raises
    ------
    FormatError
        With the line, if a row or the header is not what it should be.
    UnitError
        If `units` is unknown or contradicts the header.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if euler is not None and euler not in _EULER:
        raise JobError(f"path.euler = {euler!r} must be one of {', '.join(_EULER)}")
    side = tool_side(tool_axis)
    options = _Options(path, limits, units, feed_mm_min, columns, euler, side)
    return _path_of(options, read_bytes(path, limits))


def _path_of(options: _Options, content: bytes) -> ToolPath:
    """Return the path that the bytes of a table hold."""
    path, limits = options.path, options.limits
    moves = MoveList(path, limits, options.units)
    rows = _rows(moves, program_lines(path, content, limits))
    if not rows:
        return moves.build(content, format="CSV")
    table = _layout(moves, rows, options)
    mark = _read_rows(moves, table, rows)
    built = moves.build(content, format="CSV", feed_mm_min=options.feed_mm_min)
    read_back = partial(_path_of, options)
    original = CsvOriginal(path, content, table.delimiter, mark, table.columns, built, moves.mm, read_back)
    return replace(built, events=_in_place(built.events, built.lines), original=original)


def _rows(moves: MoveList, lines: list[str]) -> list[tuple[int, str]]:
    """Return the lines that hold cells; what stands in others or behind the cells becomes comments."""
    rows = []
    for number, line in enumerate(lines, 1):
        text, remark = without_remark(line)
        if text.strip():
            rows.append((number, text))
        if remark:
            moves.events.append(Event(0, EventKind.COMMENT, 0.0, remark, number))
    return rows


def _in_place(events: tuple[Event, ...], lines: IntArray) -> tuple[Event, ...]:
    """Put comments before the move of their line, or the first one behind it."""
    places = np.searchsorted(lines, [event.line for event in events]).tolist()
    return tuple(replace(event, before_move=place) for event, place in zip(events, places, strict=True))


def _layout(moves: MoveList, rows: list[tuple[int, str]], options: _Options) -> _Table:
    """Find out the layout from the first lines, and take the header off the rows."""
    names, euler = options.columns, options.euler
    line, first = rows[0]
    delimiter = delimiter_of(first)
    if first.strip().lower().startswith("sep=") and len(rows) > 1:
        rows.pop(0)
        line, first = rows[0]
    cells = cells_of(first, delimiter)
    has_numbers = any(NUMBER_CELL.fullmatch(cell) for cell in cells)
    try:
        if names is not None:
            columns = columns_of_names(names_of_option(names), euler)
        else:
            columns = columns_of_width(len(cells)) if has_numbers else columns_of_names(cells, euler)
    except HeaderError as problem:
        if names is not None:
            raise JobError(f"path.columns: {problem}") from None
        raise moves.error(str(problem), line) from None
    if not has_numbers:
        rows.pop(0)
        if names is not None:
            moves.events.append(Event(0, EventKind.COMMENT, 0.0, first.strip(), line))
    _judge(moves, columns, line, euler)
    return _Table(delimiter, columns, options.side, euler)


def _judge(moves: MoveList, columns: Columns, line: int, euler: str | None) -> None:
    if columns.unit is not None:
        moves.state_unit(columns.unit, line)
    if not columns.orientation:
        moves.note(Notice.AXIS_ASSUMED, 0)
    if columns.kind == "angles" and euler is None:
        what = "the angles of the orientation can be meant in several ways; say how with --set path.euler=xyz or zyx"
        raise moves.error(what, line)
    if columns.kind != "angles" and euler is not None:
        what = (
            f"path.euler = {euler}, but no orientation is read from angles; name the columns of the angles "
            "(rx,ry,rz or w,p,r, and a,b,c where they are meant as zyx), or leave the option out"
        )
        raise moves.error(what, line)
    for name in columns.unused:
        moves.note(Notice.COLUMN_UNUSED, line, name)


def _read_rows(moves: MoveList, table: _Table, rows: list[tuple[int, str]]) -> str:
    """Append the moves of the rows; return the decimal mark of the table."""
    axis: Vector | None = None
    decimals: set[str] = set()
    others = table.columns.orientation + (() if table.columns.feed is None else (table.columns.feed,))
    marks_of_others: set[str] = set()
    feed_mm = table.columns.mm_min_per_feed or moves.mm
    for line, text in rows:
        cells, tip, turn = _row(moves, table, text, line)
        decimals |= _marks(cells, table.columns.tip)
        marks_of_others |= _marks(cells, others)
        if len(decimals) > 1:
            raise moves.error("decimal points and decimal commas in one table; use one of them", line)
        axis = _axis(moves, table, turn, axis, line)
        feed = 0.0 if table.columns.feed is None else _numbers(moves, cells, (table.columns.feed,), line)[0] * feed_mm
        if feed < 0.0:
            raise moves.error("negative feed; correct the row", line)
        x, y, z = (value * moves.mm for value in tip)
        moves.move((x, y, z), axis, feed, _flag(moves, cells, table.columns.rapid, line), line)
    return "," if "," in (decimals or marks_of_others) else "."


def _marks(cells: list[str], columns: Sequence[int]) -> set[str]:
    return {mark for column in columns for mark in ".," if mark in cells[column]}


def _row(moves: MoveList, table: _Table, text: str, line: int) -> tuple[list[str], list[float], list[float]]:
    """Return cells, tip and orientation of a row."""
    cells = cells_of(text, table.delimiter)
    columns = table.columns
    if len(cells) != columns.width:
        hint = (
            "; are there decimal commas?"
            if table.delimiter == "," and len(cells) > columns.width
            else "; complete the row"
        )
        raise moves.error(f"{len(cells)} cells where {columns.width} are expected{hint}", line)
    return cells, _numbers(moves, cells, columns.tip, line), _numbers(moves, cells, columns.orientation, line)


def _axis(moves: MoveList, table: _Table, turn: list[float], before: Vector | None, line: int) -> Vector:
    """Return the axis from tip to holder that a row states, or the one before where it states none."""
    if not turn:
        return (0.0, 0.0, 1.0)
    if table.columns.kind == "axis":
        return _vector(moves, table, (turn[0], turn[1], turn[2]), before, line)
    if table.columns.kind == "quaternion":
        pose = pose_of_quaternion((0.0, 0.0, 0.0), turn[0], turn[1], turn[2], turn[3])
        if pose is None:
            raise moves.error("the quaternion is not of length 1; correct the row", line)
    else:
        rx, ry, rz = turn
        if max(abs(rx), abs(ry), abs(rz)) > _LARGEST_ANGLE_DEG:
            raise moves.error("an angle of the orientation is too large to be one; correct the row", line)
        pose = pose_xyz(0.0, 0.0, 0.0, rx, ry, rz) if table.euler == "xyz" else pose_zyx(0.0, 0.0, 0.0, rz, ry, rx)
    column, sign = table.side
    i, j, k = (sign * pose[:3, column] + 0.0).tolist()
    return (i, j, k)


def _vector(moves: MoveList, table: _Table, now: Vector, before: Vector | None, line: int) -> Vector:
    if now == (0.0, 0.0, 0.0):
        if before is None:
            raise moves.error("the tool axis is (0, 0, 0) and none was stated before; state one", line)
        moves.note(Notice.AXIS_ZERO, line)
        return before
    if not table.columns.named and abs(norm(now) - 1.0) > _NOT_UNIT_AT_ALL:
        what = (
            "columns 4 to 6 are no unit vectors; angles or decimal commas? Add a header that names the columns, or "
            "--set path.columns=x,y,z,rx,ry,rz with path.euler=xyz or zyx"
        )
        raise moves.error(what, line)
    if not _SHORTEST_AXIS <= norm(now) <= _LONGEST_AXIS:
        what = (
            f"the tool axis has the length {norm(now):.4g}, so it is no direction; if these are angles, name the "
            "columns rx,ry,rz or w,p,r and say how they turn with --set path.euler=xyz or zyx"
        )
        raise moves.error(what, line)
    return now


def _numbers(moves: MoveList, cells: list[str], columns: Sequence[int], line: int) -> list[float]:
    values = []
    for column in columns:
        cell = cells[column]
        if not NUMBER_CELL.fullmatch(cell):
            raise moves.error(
                f"column {column + 1} holds {printable(cell, 40)!r}, which is no number; correct it", line
            )
        values.append(float(cell.replace(",", ".")))
    return values


def _flag(moves: MoveList, cells: list[str], column: int | None, line: int) -> bool:
    if column is None:
        return False
    flag = _FLAGS.get(cells[column].lower())
    if flag is None:
        raise moves.error(f"rapid must be 0 or 1, not {printable(cells[column], 40)!r}; correct it", line)
    return flag
