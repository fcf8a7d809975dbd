"""The points of a scan from columns of any number types: put together block by block, checked, or repaired.

Scans of millions of points are mostly memory to move. Each block is converted and looked at while it is in the cache.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.surfaces.checks import Code, Place, check_coordinates, unit_normals

__all__ = ["OR_REPAIR", "PointNames", "PointRows", "locked", "point_names", "point_rows", "where"]

Scalars: TypeAlias = Mapping[str, npt.NDArray[Any]]

OR_REPAIR = ", or repair it with --recover"
"""Ends the message of an error that a repair would cure."""

_AXES = ("x", "y", "z")
_BLOCK_ROWS = 16384


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
    """

    points_mm: FloatArray
    normals: FloatArray | None
    columns: Mapping[str, FloatArray]
    kept: IntArray | None
    low_mm: float
    high_mm: float


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
    scalars: Scalars,
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
        (n,) numbers by name, all that `names` names.
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
    with ThreadPoolExecutor(1) as beside:  # NumPy's conversions do not hold the interpreter
        stacked = None if None in names.normal else beside.submit(_stacked, scalars, names.normal, 1.0)
        points, low, high = _stacked(scalars, names.xyz, mm)
    findings: tuple[Finding, ...] = ()
    kept: IntArray | None = None
    if not (np.isfinite(low) and np.isfinite(high)):
        kept, findings = _finite_rows(path, points, place, recover=recover, no_return=no_return)
        points, place = points[kept], _places_of(kept, place)
        low, high = points.min(initial=np.inf), points.max(initial=-np.inf)
    if len(points) and not -limits.coordinate_mm <= low <= high <= limits.coordinate_mm:
        check_coordinates(path, points, place, limits)
    normals = None
    if stacked is not None:
        normals, found = _normals(path, _rows(stacked.result()[0], kept), place, recover=recover)
        normals, findings = locked(normals), findings + found
    with np.errstate(invalid="ignore"):
        columns = {name: locked(_rows(scalars[name], kept).astype(np.float64)) for name in names.further}
    return PointRows(locked(points), normals, columns, kept, float(low), float(high)), findings


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


def _stacked(scalars: Scalars, names: Sequence[str | None], factor: float) -> tuple[FloatArray, float, float]:
    """Return columns side by side as doubles, times a factor; and the smallest and largest, nan if one is nan."""
    columns = [scalars[name] for name in names if name is not None]
    values = np.empty((len(columns[0]), len(columns)))
    lows, highs = [np.inf], [-np.inf]
    with np.errstate(invalid="ignore", over="ignore"):  # a signalling nan; whoever calls tells its place
        for first in range(0, len(values), _BLOCK_ROWS):
            block = values[first : first + _BLOCK_ROWS]
            for index, column in enumerate(columns):
                block[:, index] = column[first : first + _BLOCK_ROWS]
            if factor != 1.0:
                block *= factor
            lows.append(block.min())
            highs.append(block.max())
    return values, float(np.min(lows)), float(np.max(highs))


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


def _normals(path: Path, normals: FloatArray, place: Place, *, recover: bool) -> tuple[FloatArray, tuple[Finding, ...]]:
    findings: tuple[Finding, ...] = ()
    if recover:
        broken = ~np.asarray(np.isfinite(normals).all(axis=1))
        if broken.any():
            normals[broken] = 0.0
            message = f"{broken.sum()} of {len(normals)} normals are not finite and count as not given"
            findings = (Finding(Code.NORMALS_BLANKED, Level.WARN, message, _first(path, broken, place)),)
    try:
        normals, found = unit_normals(path, normals, place)
    except FormatError as error:
        raise FormatError(path, f"{error.what}{OR_REPAIR}", line=error.line, byte=error.byte) from None
    return normals, findings + found


def _rows(values: npt.NDArray[Any], kept: IntArray | None) -> npt.NDArray[Any]:
    return values if kept is None else values[kept]


def _places_of(kept: IntArray, place: Place) -> Place:
    return lambda row: place(int(kept[row]))


def _first(path: Path, rows: BoolArray, place: Place) -> str:
    return where(path, place(int(np.argmax(rows))))
