"""The points of a scan from columns of any number types: put together block by block, checked, or repaired.

Scans of millions of points are mostly memory to move. Each block is converted and looked at while it is in the cache.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.surfaces.checks import (
    Code,
    Place,
    check_coordinates,
    count_at_origin,
    rows_not_unit,
    unit_normals,
)
from sicp_formats.surfaces.row_blocks import BLOCK_ROWS, ColumnsInMemory, RowBlocks, Scalars

__all__ = ["OR_REPAIR", "PointNames", "PointRows", "locked", "point_names", "point_rows", "where"]

OR_REPAIR = ", or repair it with --recover"
"""Ends the message of an error that a repair would cure."""

_AXES = ("x", "y", "z")
_WORKERS = 2
_PARTS = 8
"""Parts that the rows are split into: few, since to begin one costs time; enough for both workers to end at about the
same time, and to use the rows up in about their order."""
_LEAST_BLOCKS = 8
"""Blocks of the smallest part."""


@dataclass(frozen=True, slots=True)
class PointNames:
    """Which names of a file are the coordinates and the normal, in order of x, y, z; None for those it does not have.

    `further` are all others, in file order.
    """

    xyz: tuple[str | None, ...]
    normal: tuple[str | None, ...]
    further: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class PointRows:
    """Points in mm with what the file says of each, all of them finite and locked; further columns may hold anything.

    Parameters
    ----------
    points_mm, normals, columns
        As in `Scan`.
    kept
        (m,) rows of the file that these are, None for all.
    low_mm, high_mm
        Smallest and largest coordinate.
    at_origin
        How many lie at exactly 0 0 0.
    """

    points_mm: FloatArray
    normals: FloatArray | None
    columns: Mapping[str, FloatArray]
    kept: IntArray | None
    low_mm: float
    high_mm: float
    at_origin: int


@dataclass(frozen=True, slots=True, eq=False)
class _Arrays:
    """Points in mm, normals and columns as the file has them, to be filled."""

    points: FloatArray
    normals: FloatArray | None
    columns: Mapping[str, FloatArray]


@dataclass(frozen=True, slots=True)
class _Seen:
    """What was seen of some rows: extremes, nan if one is nan; points at 0 0 0; rows of normals that are not unit."""

    low: float
    high: float
    at_origin: int
    not_unit: IntArray


def point_names(names: Sequence[str]) -> PointNames:
    """Tell coordinates, normals and further columns apart by their names.

    >>> point_names(["X", "Y", "Z", "normal_x", "red"])
    PointNames(xyz=('X', 'Y', 'Z'), normal=('normal_x', None, None), further=('red',))
    """
    xyz = _first_known(names, [_AXES, tuple("XYZ")])
    normal = _first_known(names, [tuple(f"{before}{axis}" for axis in _AXES) for before in ("n", "normal_")])
    return PointNames(xyz, normal, tuple(name for name in names if name not in xyz + normal))


def _first_known(names: Sequence[str], spellings: Sequence[tuple[str, ...]]) -> tuple[str | None, ...]:
    for spelling in spellings:
        if any(name in names for name in spelling):
            return tuple(name if name in names else None for name in spelling)
    return (None, None, None)


def point_rows(
    path: Path,
    scalars: Scalars | RowBlocks,
    names: PointNames,
    place: Place,
    mm: float,
    limits: Limits,
    *,
    recover: bool,
    no_return: bool = False,
) -> tuple[PointRows, tuple[Finding, ...]]:
    """Put points, normals and further columns together.

    Parameters
    ----------
    path, place
        The file, and where its rows stand in it, for messages.
    scalars
        (n,) numbers by name, all that `names` names; or the rows of them.
    names
        All three coordinates; all three of the normal, or none that counts.
    mm
        Millimetres in the unit of the coordinates.
    limits
        Caps on the coordinates.
    recover
        True to drop points that are not finite and to blank such normals, instead of refusing them.
    no_return
        True if points that are no number stand for rays that came back from nowhere.

    Raises
    ------
    FormatError
        If a coordinate or a normal is not finite, or a coordinate beyond `limits.coordinate_mm`.
    """
    arrays, seen = _converted(ColumnsInMemory(scalars) if isinstance(scalars, Mapping) else scalars, names, mm)
    points, normals, columns, not_unit = arrays.points, arrays.normals, arrays.columns, seen.not_unit
    low, high = seen.low, seen.high
    findings: tuple[Finding, ...] = ()
    kept: IntArray | None = None
    if not (np.isfinite(low) and np.isfinite(high)):
        kept, findings = _finite_rows(path, points, place, recover=recover, no_return=no_return)
        points, place = points[kept], _places_of(kept, place)
        normals = None if normals is None else normals[kept]
        columns = {name: values[kept] for name, values in columns.items()}
        not_unit = not_unit if normals is None else rows_not_unit(normals)
        low, high = points.min(initial=np.inf), points.max(initial=-np.inf)
    if len(points) and not -limits.coordinate_mm <= low <= high <= limits.coordinate_mm:
        check_coordinates(path, points, place, limits)
    if normals is not None:
        normals, found = _normals(path, normals, not_unit, place, recover=recover)
        normals, findings = locked(normals), findings + found
    columns = {name: locked(values) for name, values in columns.items()}
    return PointRows(locked(points), normals, columns, kept, float(low), float(high), seen.at_origin), findings


def where(path: Path, place: Mapping[str, int]) -> str:
    """Return a place in a file as findings name it.

    >>> where(Path("a.ply"), {"line": 9})
    'a.ply, line 9'
    """
    return ", ".join([str(path), *(f"{kind} {number}" for kind, number in place.items())])


def locked(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return an array that a Scan takes without a copy: locked, and no view of another one."""
    if values.base is not None:
        values = values.copy()
    values.setflags(write=False)
    return values


def _converted(rows: RowBlocks, names: PointNames, mm: float) -> tuple[_Arrays, _Seen]:
    """Return all rows as doubles, the points in mm, and what was seen of them on the way."""
    count = len(rows)
    normals = None if None in names.normal else np.empty((count, 3))
    arrays = _Arrays(np.empty((count, 3)), normals, {name: np.empty(count) for name in names.further})
    bounds = [*range(0, count, max(_LEAST_BLOCKS * BLOCK_ROWS, -(-count // _PARTS))), count]
    with ThreadPoolExecutor(_WORKERS) as pool:  # NumPy's conversions do not hold the interpreter
        parts = [pool.submit(_convert, rows, begin, end, names, mm, arrays) for begin, end in pairwise(bounds)]
        seen = [part.result() for part in parts]
    return arrays, _together(seen)


def _convert(rows: RowBlocks, begin: int, end: int, names: PointNames, mm: float, arrays: _Arrays) -> _Seen:
    """Convert the rows from `begin` to `end`, and look at each block while it is in the cache."""
    seen = []
    with np.errstate(invalid="ignore", over="ignore"):  # a signalling nan; whoever calls tells its place
        for block in rows.blocks(begin, end):
            points = _fill(arrays.points[begin:end], block, names.xyz)
            if mm != 1.0:
                points *= mm
            not_unit = np.zeros(0, np.int64)
            if arrays.normals is not None:
                not_unit = begin + rows_not_unit(_fill(arrays.normals[begin:end], block, names.normal))
            for name, values in arrays.columns.items():
                values[begin : begin + len(points)] = block[name]
            seen.append(_Seen(points.min(), points.max(), count_at_origin(points), not_unit))
            begin += len(points)
    return _together(seen)


def _fill(target: FloatArray, block: Scalars, names: Sequence[str | None]) -> FloatArray:
    """Put columns side by side at the beginning of an array, and return the rows that were filled."""
    for index, name in enumerate(names):
        if name is not None:
            target = target[: len(block[name])]
            target[:, index] = block[name]
    return target


def _together(seen: Sequence[_Seen]) -> _Seen:
    low = np.min([each.low for each in seen], initial=np.inf)
    high = np.max([each.high for each in seen], initial=-np.inf)
    not_unit = np.concatenate([np.zeros(0, np.int64), *(each.not_unit for each in seen)])
    return _Seen(float(low), float(high), sum(each.at_origin for each in seen), not_unit)


def _finite_rows(
    path: Path, points: FloatArray, place: Place, *, recover: bool, no_return: bool
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Return the rows to keep, and what is said of the others."""
    finite = np.asarray(np.isfinite(points).all(axis=1))
    absent = np.asarray(np.isnan(points).any(axis=1)) if no_return else np.zeros(len(points), np.bool_)
    findings = []
    if absent.any():
        message = f"{absent.sum()} of {len(points)} points are rays without return and were left out"
        findings.append(Finding(Code.NO_RETURN, Level.INFO, message, _first(path, absent, place)))
    broken = ~(finite | absent)
    if broken.any():
        row = int(np.argmax(broken))
        if not recover:
            shown = " ".join(f"{value:g}" for value in points[row])
            what = f"the point {shown} is not finite; remove it in the scanner's software and export again{OR_REPAIR}"
            raise FormatError(path, what, **place(row))
        message = f"{broken.sum()} of {len(points)} points are not finite and were dropped"
        findings.append(Finding(Code.POINTS_DROPPED, Level.WARN, message, _first(path, broken, place)))
    return np.flatnonzero(finite), tuple(findings)


def _normals(
    path: Path, normals: FloatArray, not_unit: IntArray, place: Place, *, recover: bool
) -> tuple[FloatArray, tuple[Finding, ...]]:
    findings: tuple[Finding, ...] = ()
    broken = not_unit[~np.isfinite(normals[not_unit]).all(axis=1)]
    if recover and len(broken):
        normals[broken] = 0.0
        message = f"{len(broken)} of {len(normals)} normals are not finite and count as not given"
        findings = (Finding(Code.NORMALS_BLANKED, Level.WARN, message, where(path, place(int(broken[0])))),)
    try:
        normals, found = unit_normals(path, normals, place, not_unit)
    except FormatError as error:
        raise FormatError(path, f"{error.what}{OR_REPAIR}", line=error.line, byte=error.byte) from None
    return normals, findings + found


def _places_of(kept: IntArray, place: Place) -> Place:
    return lambda row: place(int(kept[row]))


def _first(path: Path, rows: BoolArray, place: Place) -> str:
    return where(path, place(int(np.argmax(rows))))
