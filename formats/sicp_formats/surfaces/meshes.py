"""Triangles made fit for use: equal vertices merged, collapsed triangles dropped."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.surfaces.checks import Code

__all__ = ["drop_collapsed", "equal_points", "keep_points", "merge_mesh", "merge_vertices"]

_HASHED_FROM = 100_000
"""Points from which a hash table is worth loading pandas for."""
_BLOCK = 1 << 16
"""Rows worked on at once, so that what is in between stays in the cache."""


def merge_vertices(
    path: Path, points: FloatArray, normals: FloatArray | None, faces: IntArray
) -> tuple[FloatArray, FloatArray | None, IntArray, tuple[Finding, ...]]:
    """Merge the exactly equal vertices of a mesh, and average their normals.

    Writers repeat a vertex for each triangle, or along creases where normals jump; every such seam would otherwise
    seem to be a rim of the part.

    Returns
    -------
    points, normals, faces, findings
        As given where all vertices differ.
    """
    points, normals, faces, _, findings = merge_mesh(path, points, normals, faces, {})
    return points, normals, faces, findings


def merge_mesh(
    path: Path, points: FloatArray, normals: FloatArray | None, faces: IntArray, columns: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray | None, IntArray, Mapping[str, FloatArray], tuple[Finding, ...]]:
    """Merge vertices as `merge_vertices` does; of further columns, the number of the first of equal vertices stays."""
    first, merged = equal_points(points)
    if len(first) == len(points):
        return points, normals, faces, columns, ()
    if normals is not None:
        sums = np.column_stack([np.bincount(merged, column, len(first)) for column in normals.T])
        lengths = np.linalg.norm(sums, axis=1)
        # Opposite normals at one point cancel; no normal is told then.
        normals = np.where(lengths[:, None] > 1e-6, sums / np.maximum(lengths, 1e-6)[:, None], 0.0)
    message = f"{len(points)} vertices were merged into {len(first)} that differ"
    finding = Finding(Code.VERTICES_MERGED, Level.INFO, message, str(path))
    kept = {name: values[first] for name, values in columns.items()}
    return points[first], normals, merged[faces], kept, (finding,)


def equal_points(points: npt.NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Find points that are exactly equal.

    Parameters
    ----------
    points
        (n, 3) finite coordinates, float64 or float32.

    Returns
    -------
    first, merged
        (m,) index of the first point of each kind, in file order; (n,) the kind that each point is of, so that
        `points[first][merged]` equals `points`.

    >>> first, merged = equal_points(np.array([[1.0, 0, 0], [2, 0, 0], [1, -0.0, 0]]))
    >>> first.tolist(), merged.tolist()
    ([0, 1], [0, 1, 0])
    """
    keys = _mixed(points)
    if len(keys) >= _HASHED_FROM:
        first, merged = _hashed(keys)
    else:
        first, merged = _sorted(keys)
    if not _same(points, first, merged):
        first, merged = _sorted(points + 0.0)
    return first, merged


def _mixed(points: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    """Return one 64-bit mix of each point's three words; that equal mixes mean equal points is verified afterwards."""
    kind = np.uint32 if points.dtype == np.float32 else np.uint64
    keys = np.empty(len(points), np.uint64)
    for start in range(0, len(points), _BLOCK):
        block = points[start : start + _BLOCK] + points.dtype.type(0)  # turns -0.0 into 0.0, which compares equal
        x, y, z = np.ascontiguousarray(block.view(kind).T, dtype=np.uint64)
        x *= np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(29)) ^ y) * np.uint64(0xBF58476D1CE4E5B9)
        keys[start : start + _BLOCK] = (x ^ (x >> np.uint64(32)) ^ z) * np.uint64(0x94D049BB133111EB)
    return keys


def _hashed(keys: npt.NDArray[np.uint64]) -> tuple[IntArray, IntArray]:
    import pandas  # its hash table takes a quarter of the time of sorting; slow to load

    merged, kinds = pandas.factorize(keys)
    first = np.empty(len(kinds), np.int64)
    first[merged[::-1]] = np.arange(len(merged) - 1, -1, -1)  # the last one written is the first in the file
    return first, merged.astype(np.int64, copy=False)


def _sorted(keys: npt.NDArray[Any]) -> tuple[IntArray, IntArray]:
    _, first, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order].astype(np.int64), rank[merged.reshape(-1)].astype(np.int64)


def _same(points: npt.NDArray[Any], first: IntArray, merged: IntArray) -> bool:
    kinds = points[first]
    return all(
        np.array_equal(kinds[merged[start : start + _BLOCK]], points[start : start + _BLOCK])
        for start in range(0, len(points), _BLOCK)
    )


def keep_points(kept: BoolArray, faces: IntArray | None) -> tuple[IntArray | None, int]:
    """Renumber the corners of triangles for the points that are kept.

    Returns
    -------
    faces, dropped
        The triangles whose corners are all kept, and how many had to go with a point.

    >>> keep_points(np.array([True, False, True, True]), np.array([[0, 2, 3], [0, 1, 2]]))
    (array([[0, 1, 2]]), 1)
    """
    if faces is None:
        return None, 0
    whole = kept[faces].all(axis=1)
    number: IntArray = np.cumsum(kept) - 1
    return number[faces[whole]], int((~whole).sum())


def drop_collapsed(path: Path, vertices_mm: FloatArray, faces: IntArray) -> tuple[IntArray, tuple[Finding, ...]]:
    """Drop triangles that name a vertex twice, and refuse a mesh without any area.

    Triangles of three different vertices on one line stay: without them their neighbours would no longer be joined,
    and an edge of the part would seem to run there.

    Raises
    ------
    FormatError
        If no triangle has an area.
    """
    a, b, c = faces.T
    kept = faces[(a != b) & (b != c) & (c != a)]
    slivers = sum(_flat(vertices_mm[kept[start : start + _BLOCK]]) for start in range(0, len(kept), _BLOCK))
    if slivers == len(kept):
        raise FormatError(path, f"none of the {len(faces)} triangles has an area; export the mesh again")
    dropped = len(faces) - len(kept)
    findings = []
    if dropped:
        message = f"{dropped} of {len(faces)} triangles name one corner twice and were dropped"
        findings.append(Finding(Code.DEGENERATE_FACES, Level.INFO, message, str(path)))
    if slivers:
        message = f"{slivers} of {len(faces)} triangles have no area; they were kept, since they join their neighbours"
        findings.append(Finding(Code.DEGENERATE_FACES, Level.INFO, message, str(path)))
    return kept, tuple(findings)


def _flat(corners: FloatArray) -> int:
    """Count triangles (n, 3, 3) without any area."""
    x, y, z = (corners[:, 1:] - corners[:, :1]).transpose(2, 1, 0)
    area = (y[0] * z[1] != z[0] * y[1]) | (z[0] * x[1] != x[0] * z[1]) | (x[0] * y[1] != y[0] * x[1])
    return int((~area).sum())
