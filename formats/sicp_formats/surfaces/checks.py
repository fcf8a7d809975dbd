"""What every scan and mesh reader demands of its points and normals before they become a Scan or a Part.

The finding codes of the readers stand here side by side, so that each number is given once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import IntEnum
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray

__all__ = [
    "Code",
    "Place",
    "check_coordinates",
    "check_registrable",
    "coarse_singles",
    "count_at_origin",
    "no_return_points",
    "origin_points",
    "rows_not_unit",
    "unit_normals",
]

Place = Callable[[int], Mapping[str, int]]
"""Tells where a row stands in its file: `{"line": n}` or `{"byte": n}`, as `FormatError` takes them."""

_UNIT_TOLERANCE = 1e-6
_DOUBTFUL_LENGTH = 0.05
_COARSE_MM = 0.005
_BLOCK_ROWS = 16384
"""Rows looked at once, so that what is in between stays in the cache."""


class Code(IntEnum):
    """Findings of the scan and mesh readers."""

    TRAILING_BYTES = 101
    NORMALS_NOT_UNIT = 102
    POLYGONS_SPLIT = 103
    ELEMENT_NOT_READ = 104
    COARSE_SINGLES = 105
    DEGENERATE_FACES = 106
    VERTICES_MERGED = 107
    ORIGIN_POINTS = 108
    NORMALS_AGAINST_WINDING = 109
    COLUMNS_NOT_USED = 110
    LINES_SKIPPED = 111
    COLUMNS_PROVEN = 120
    SENSOR_POSE_NOT_APPLIED = 130
    NO_RETURN = 131
    UNIT_UNKNOWN = 132
    FACET_ATTRIBUTES = 135
    FREE_FORM_NOT_READ = 136
    INVALID_POINTS = 137
    UNIT_BY_CONVENTION_M = 138
    WEIGHTS_NOT_USED = 139
    NORMALS_NOT_USED = 140
    SCANS_JOINED = 141
    ROWS_DROPPED = 150
    COUNT_REPLACED = 151
    SCAN_CUT = 152
    LAST_LINE_CUT = 153
    MARKS_MAY_BE_THOUSANDS = 154
    NORMALS_BLANKED = 155
    MATRIX_NOT_RIGID = 156
    FACETS_MISCOUNTED = 160
    FACETS_CUT = 161
    FACETS_DROPPED = 162
    ROWS_MISSING = 163
    POINTS_DROPPED = 164
    FACES_DROPPED = 165
    NORMALS_DROPPED = 166


def check_coordinates(path: Path, points_mm: FloatArray, place: Place, limits: Limits) -> None:
    """Refuse coordinates that are not finite or lie beyond `limits.coordinate_mm`, naming the first row's place."""
    if points_mm.max(initial=0.0) <= limits.coordinate_mm and points_mm.min(initial=0.0) >= -limits.coordinate_mm:
        return  # nan does not pass either
    row = int(np.argmin((np.abs(points_mm) <= limits.coordinate_mm).all(axis=1)))
    shown = " ".join(f"{value:g}" for value in points_mm[row])
    if np.isfinite(points_mm[row]).all():
        what = f"the point {shown} mm lies beyond the limit coordinate_mm = {limits.coordinate_mm:g}; check the unit"
    else:
        what = f"the point {shown} is not finite; remove it in the scanner's software and export again"
    raise FormatError(path, what, **place(row))


def check_registrable(path: Path, points_mm: FloatArray) -> None:
    """Refuse points that no rigid motion can be found from: fewer than three, all equal, or all on one line."""
    if len(points_mm) < 3:
        raise FormatError(path, f"{len(points_mm)} points cannot register; at least 3 are needed")
    # A sample that spans an area settles the matter for nearly every scan.
    if _on_one_line(points_mm[:: max(1, len(points_mm) // 1000)]) and _on_one_line(points_mm):
        kind = "equal" if (points_mm == points_mm[0]).all() else "on one line"
        raise FormatError(path, f"all {len(points_mm)} points are {kind} and cannot register; export the whole scan")


def unit_normals(
    path: Path, normals: FloatArray, place: Place, rows: IntArray | None = None
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Scale normals to length one; those of length zero stay zero, those already of length one stay as they are.

    Parameters
    ----------
    path, normals, place
        The file, the normals (n, 3), and where they stand in it.
    rows
        What `rows_not_unit` tells of them, if that is known.

    Raises
    ------
    FormatError
        If a normal is not finite.
    """
    rows = rows_not_unit(normals) if rows is None else rows
    finite = np.isfinite(normals[rows]).all(axis=1)
    if not finite.all():
        what = "the normal is not finite; remove it in the scanner's software and export again"
        raise FormatError(path, what, **place(int(rows[np.argmin(finite)])))
    if len(rows) == 0:
        return normals, ()
    largest = np.abs(normals[rows]).max(axis=1)
    rows, largest = rows[largest > 0.0], largest[largest > 0.0]
    scaled = normals[rows] / largest[:, None]  # keeps the square of 1e200 finite
    lengths = np.linalg.norm(scaled, axis=1)
    normals = normals.copy()
    normals[rows] = scaled / lengths[:, None]
    with np.errstate(over="ignore"):
        doubtful = int((np.abs(lengths * largest - 1.0) > _DOUBTFUL_LENGTH).sum())
    if not doubtful:
        return normals, ()
    message = f"{doubtful} normals were not of length 1 and have been scaled"
    return normals, (Finding(Code.NORMALS_NOT_UNIT, Level.INFO, message, str(path)),)


def rows_not_unit(normals: FloatArray) -> IntArray:
    """Return the rows of normals (n, 3) whose length is not one, or no number.

    >>> rows_not_unit(np.array([[0.0, 1, 0], [0, 2, 0], [np.nan, 1, 0]])).tolist()
    [1, 2]
    """
    found = [np.zeros(0, np.int64)]
    for first in range(0, len(normals), _BLOCK_ROWS):
        x, y, z = normals[first : first + _BLOCK_ROWS].T
        with np.errstate(over="ignore", invalid="ignore"):
            squares = x * x
            squares += y * y
            squares += z * z
            if not 1.0 - 2 * _UNIT_TOLERANCE <= squares.min() <= squares.max() <= 1.0 + 2 * _UNIT_TOLERANCE:
                found.append(first + np.flatnonzero(~(np.abs(squares - 1.0) <= 2 * _UNIT_TOLERANCE)))
    return np.concatenate(found)


def coarse_singles(path: Path, points_mm: FloatArray, mm_per_unit: float) -> tuple[Finding, ...]:
    """Warn where coordinates stored as 32-bit floats are so large that their rounding matters."""
    largest = max(points_mm.max(), -points_mm.min())
    step_mm = float(np.spacing(np.float32(largest / mm_per_unit))) * mm_per_unit
    if step_mm <= _COARSE_MM:
        return ()
    message = f"32-bit coordinates near {largest:.0f} mm come in steps of {step_mm:.3g} mm; move the origin to the part"
    return (Finding(Code.COARSE_SINGLES, Level.WARN, message, str(path)),)


def origin_points(path: Path, points_mm: FloatArray) -> tuple[Finding, ...]:
    """Warn of several points at exactly 0 0 0, which many scanners write for a ray that came back from nowhere."""
    return no_return_points(path, count_at_origin(points_mm))


def count_at_origin(points_mm: FloatArray) -> int:
    """Return how many points lie at exactly 0 0 0."""
    candidates = np.flatnonzero(points_mm[:, 0] == 0.0)
    return int((points_mm[candidates] == 0.0).all(axis=1).sum())


def no_return_points(path: Path, count: int) -> tuple[Finding, ...]:
    """Warn, as `origin_points` does, of so many points at exactly 0 0 0."""
    if count < 2:
        return ()
    message = f"{count} points lie at exactly 0 0 0, as scanners write them for 'no return'; remove them if they are"
    return (Finding(Code.ORIGIN_POINTS, Level.WARN, message, str(path)),)


def _on_one_line(points: FloatArray) -> bool:
    offsets = points - points[0]
    squares = np.einsum("ij,ij->i", offsets, offsets)
    far = offsets[int(np.argmax(squares))]
    length = float(np.linalg.norm(far))
    if length == 0.0:
        return True
    across = np.linalg.norm(np.cross(offsets, far / length), axis=1).max()
    # Rounding of the coordinates themselves may lift points off a line by some units in the last place.
    return bool(across <= 1e-9 * length + 8 * np.spacing(np.abs(points).max()))
