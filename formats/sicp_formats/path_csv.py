"""Read tool paths from CSV tables: one move a row, columns named by a header or x,y,z[,i,j,k] in order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.arcs import Vector, norm
from sicp_formats.moves import MoveList, check_options
from sicp_formats.path_findings import Notice
from sicp_formats.program_text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?", re.ASCII)
_NAME = re.compile(r"([a-z]+)[\s_]*[(\[]?(mm/min|mm_min|mm|cm|m|inch|in)?[)\]]?", re.ASCII)
_UNITS = {"mm": "mm", "cm": "cm", "m": "m", "inch": "inch", "in": "inch"}
_FLAGS = {"0": False, "1": True, "0.0": False, "1.0": True, "false": False, "true": True}
_TIP, _AXIS = ("x", "y", "z"), ("i", "j", "k")
# What this package itself writes; its unit is settled to be the millimetre.
_OWN_HEADER = ("x", "y", "z", "i", "j", "k", "feed", "rapid", "status")
_NOT_UNIT_AT_ALL = 0.02


@dataclass(frozen=True, slots=True)
class _Table:
    """How the rows of one file are laid out."""

    delimiter: str | None
    width: int
    tip: tuple[int, int, int]
    axis: tuple[int, int, int] | None
    feed: int | None
    feed_in_mm: bool
    rapid: int | None
    named: bool


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
) -> ToolPath:
    """Read a CSV table into a path in mm, mm/min and unit axes (tip to holder).

    The delimiter is a semicolon, a tab or a comma, or blanks where there is none of these; decimals may have commas
    unless the comma is the delimiter. A header names at least x, y and z; it may name i, j, k, feed and rapid, and the
    unit (``x [mm]``, ``x_mm``). Lines that begin with ``#`` are comments. Without a header there are 3 or 6 columns.

    Parameters
    ----------
    path
        The file.
    units
        Unit of a table that states none; must not contradict one that does. Feeds are in that unit per minute.
    limits
        Caps on the file and the path.
    feed_mm_min
        Feed for cutting moves that the table gives none.
    chord_mm, step_mm
        As for other path formats; a table holds no arcs.

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
    content = read_bytes(path, limits)
    moves = MoveList(path, limits, units)
    rows = [(number, line) for number, line in enumerate(program_lines(path, content, limits), 1) if line.strip()]
    for number, line in rows:
        if line.lstrip().startswith("#"):
            moves.event(EventKind.COMMENT, number, 0.0, line.strip().lstrip("#").strip())
    rows = [row for row in rows if not row[1].lstrip().startswith("#")]
    if rows:
        table = _layout(moves, rows[0][1], rows[0][0])
        _read_rows(moves, table, rows[1:] if table.named else rows)
    return moves.build(content, format="CSV", feed_mm_min=feed_mm_min)


def _cells(line: str, delimiter: str | None) -> list[str]:
    return [cell.strip().strip("\"'").strip() for cell in line.split(delimiter)]


def _layout(moves: MoveList, first: str, line: int) -> _Table:
    delimiter = next((mark for mark in ";\t," if mark in first), None)
    cells = _cells(first, delimiter)
    if any(_NUMBER.fullmatch(cell) for cell in cells):
        return _plain_layout(moves, delimiter, cells, line)
    return _named_layout(moves, delimiter, cells, line)


def _plain_layout(moves: MoveList, delimiter: str | None, cells: list[str], line: int) -> _Table:
    if len(cells) not in (3, 6):
        raise moves.error(
            f"{len(cells)} columns without a header; add one that names x,y,z,i,j,k, or give 3 or 6 columns", line
        )
    if len(cells) == 3:
        moves.note(Notice.AXIS_ASSUMED, 0)
    axis = (3, 4, 5) if len(cells) == 6 else None
    return _Table(delimiter, len(cells), (0, 1, 2), axis, None, False, None, False)


def _named_layout(moves: MoveList, delimiter: str | None, cells: list[str], line: int) -> _Table:
    found = [_NAME.fullmatch(cell.lower()) for cell in cells]
    names = [match[1] if match else cell.lower() for match, cell in zip(found, cells, strict=True)]
    wanted = {*_TIP, *_AXIS, "feed", "rapid"}
    if twice := sorted({name for name in names if name in wanted and names.count(name) > 1}):
        raise moves.error(f"the header names {', '.join(twice)} more than once; rename the columns", line)
    if missing := [name for name in _TIP if name not in names]:
        raise moves.error(f"the header does not name {', '.join(missing)}; it needs x,y,z and should have i,j,k", line)
    if 0 < sum(name in names for name in _AXIS) < 3:
        raise moves.error("the header names only part of i,j,k; name all three or none", line)
    if _AXIS[0] not in names:
        moves.note(Notice.AXIS_ASSUMED, 0)
    units = {_UNITS.get(match[2]) for match, name in zip(found, names, strict=True) if match and name in _TIP}
    if len(units) > 1:
        raise moves.error("the header gives x, y and z different units; use one", line)
    unit = units.pop() or ("mm" if tuple(names[: len(_OWN_HEADER)]) == _OWN_HEADER else None)
    if unit is not None:
        moves.state_unit(unit, line)
    for name, cell in zip(names, cells, strict=True):
        if name not in wanted:
            moves.note(Notice.COLUMN_UNUSED, line, printable(cell, 40) or "(no name)")
    feed = names.index("feed") if "feed" in names else None
    feed_match = None if feed is None else found[feed]
    feed_in_mm = feed_match is not None and feed_match[2] in ("mm/min", "mm_min")
    return _Table(
        delimiter,
        len(cells),
        (names.index("x"), names.index("y"), names.index("z")),
        (names.index("i"), names.index("j"), names.index("k")) if "i" in names else None,
        feed,
        feed_in_mm,
        names.index("rapid") if "rapid" in names else None,
        True,
    )


def _read_rows(moves: MoveList, table: _Table, rows: list[tuple[int, str]]) -> None:
    axis: Vector = (0.0, 0.0, 1.0)
    axis_stated = False
    mm = moves.mm
    feed_mm = 1.0 if table.feed_in_mm else mm
    points_seen = commas_seen = False
    for line, text in rows:
        cells = _cells(text, table.delimiter)
        if len(cells) != table.width:
            hint = "; are there decimal commas?" if table.delimiter == "," else "; complete the row"
            raise moves.error(f"{len(cells)} cells where {table.width} are expected{hint}", line)
        x, y, z = _numbers(moves, cells, table.tip, line)
        coordinates = "".join([cells[column] for column in table.tip])
        points_seen, commas_seen = points_seen or "." in coordinates, commas_seen or "," in coordinates
        if points_seen and commas_seen:
            raise moves.error("decimal points and decimal commas in one table; use one of them", line)
        if table.axis is not None:
            i, j, k = _numbers(moves, cells, table.axis, line)
            axis, axis_stated = _next_axis(moves, table, (axis, (i, j, k)), axis_stated, line)
        feed = 0.0 if table.feed is None else _numbers(moves, cells, (table.feed,), line)[0] * feed_mm
        if feed < 0.0:
            raise moves.error("negative feed; correct the row", line)
        moves.move((x * mm, y * mm, z * mm), axis, feed, _flag(moves, cells, table.rapid, line), line)


def _next_axis(
    moves: MoveList, table: _Table, before_and_now: tuple[Vector, Vector], stated: bool, line: int
) -> tuple[Vector, bool]:
    before, now = before_and_now
    if now == (0.0, 0.0, 0.0):
        if not stated:
            raise moves.error("the tool axis is (0, 0, 0) and none was stated before; state one", line)
        moves.note(Notice.AXIS_ZERO, line)
        return before, True
    if not table.named and abs(norm(now) - 1.0) > _NOT_UNIT_AT_ALL:
        raise moves.error(
            "columns 4 to 6 are no unit vectors; angles or decimal commas? Add a header that names the columns", line
        )
    return now, True


def _numbers(moves: MoveList, cells: list[str], columns: Sequence[int], line: int) -> list[float]:
    values = []
    for column in columns:
        cell = cells[column]
        if not _NUMBER.fullmatch(cell):
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
