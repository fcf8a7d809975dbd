"""Clouds whose points are much denser one way than the other: rows of a line scanner, thinned to an even spacing.

The rim of such a cloud is not found by the angle that a point's neighbours leave open, because they all lie in its row,
and the density behind an edge means nothing where the rows run along it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.model import BoolArray, FloatArray, IntArray, Scan

__all__ = ["evened", "evenness"]

NEIGHBOURS = 8
LEAST_POINTS = 50
"""Fewer show no rows, and could be thinned to nothing."""
SAMPLE = 500
EVEN = 0.35
"""Least evenness of a cloud that is left as it is; jittered grids and points at random have 0.6 to 0.8."""
EVENED = 0.55
WIDER = 2.0**0.25
MOST_ROUNDS = 24


def evenness(points_mm: FloatArray) -> float:
    """Return the extent of a point's neighbours across their longest axis in the surface over that along it.

    The median over a sample of the (n, 3) points: 1 for a cloud that looks alike in all directions, near 0 for rows.
    """
    some = points_mm[:: max(1, len(points_mm) // SAMPLE)]
    _, near = cKDTree(points_mm).query(some, k=min(NEIGHBOURS + 1, len(points_mm)))
    away = points_mm[near] - points_mm[near].mean(axis=1, keepdims=True)
    extents = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", away, away))
    return float(np.sqrt(np.median(np.maximum(extents[:, 1], 0.0) / np.maximum(extents[:, 2], 1e-300))))


def evened(scan: Scan) -> Scan:
    """Return a cloud with some of its points left out so that it is about as dense along its rows as across them.

    Points closer to a kept one than a radius go; the radius grows until the cloud is even. A mesh, and a cloud that is
    even already, stay as they are.
    """
    if scan.faces is not None or len(scan.points_mm) < LEAST_POINTS or evenness(scan.points_mm) >= EVEN:
        return scan
    tree = cKDTree(scan.points_mm)
    distance, _ = tree.query(scan.points_mm[:: max(1, len(scan.points_mm) // SAMPLE)], k=2)
    radius_mm = 2.0 * float(np.median(distance[:, 1]))
    kept = np.ones(len(scan.points_mm), dtype=bool)
    for _ in range(MOST_ROUNDS):
        fewer = _apart(len(scan.points_mm), tree.query_pairs(radius_mm, output_type="ndarray"))
        if fewer.sum() < LEAST_POINTS:
            break  # points on a line never get even
        kept = fewer
        if evenness(scan.points_mm[kept]) >= EVENED:
            break
        radius_mm *= WIDER
    return Scan(scan.points_mm[kept], None if scan.normals is None else scan.normals[kept], None, scan.source)


def _apart(count: int, pairs: IntArray) -> BoolArray:
    """Return a largest set of points of which no two are a pair: in rounds, those that come first among their partners.

    The order is shuffled, always in the same way, so that no direction is preferred and a run can be repeated.
    """
    order = np.random.default_rng(0).permutation(count)
    kept, left = np.zeros(count, dtype=bool), np.ones(count, dtype=bool)
    while left.any():
        later = np.where(order[pairs[:, 0]] < order[pairs[:, 1]], pairs[:, 1], pairs[:, 0])
        chosen = left.copy()
        chosen[later] = False
        kept |= chosen
        left &= ~chosen
        touching = chosen[pairs]
        left[pairs[touching.any(axis=1)].ravel()] = False
        pairs = pairs[left[pairs].all(axis=1)]
    return kept
