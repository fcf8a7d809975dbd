"""Project points on a framed curve: where along it they lie, and how far into the material and out of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.model import FloatArray

__all__ = ["CurveCoordinates", "coordinates", "nearest"]

MANY_POINTS = 5000
"""Points from which on looking them up on several processors pays."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveCoordinates:
    """Points seen from a curve, (n,) each, in mm.

    Parameters
    ----------
    s_mm
        Arc length of the nearest place on the curve.
    along_mm, inward_mm, outward_mm
        Offset from that place along T, B and N; `along_mm` is about zero except beyond the ends of an open curve and
        around corners.
    """

    s_mm: FloatArray
    along_mm: FloatArray
    inward_mm: FloatArray
    outward_mm: FloatArray


def nearest(points_mm: FloatArray, curve: FramedCurve, *, reach_mm: float = np.inf) -> tuple[FloatArray, FloatArray]:
    """Return the arc length of the nearest place on the curve's polyline, and the distance, for (n, 3) points.

    The nearest station is found first; the foot then lies on one of its two segments. This is exact where the
    stations are dense against the curve's radius of curvature. Points with no station within reach get 0 and infinity.
    """
    k = len(curve)
    tree = cKDTree(curve.points_mm, balanced_tree=False, compact_nodes=False)
    workers = -1 if len(points_mm) > MANY_POINTS else 1
    far, station = tree.query(points_mm, distance_upper_bound=reach_mm, workers=workers)
    s_mm, distance = np.zeros(len(points_mm)), np.full(len(points_mm), np.inf)
    near = np.isfinite(far)
    points, station = points_mm[near], station[near]
    s_end = np.append(curve.s_mm, curve.length_mm)
    best_s = curve.s_mm[station]
    best_d2 = np.sum((points - curve.points_mm[station]) ** 2, axis=1)
    for left in (station - 1, station):
        exists = np.ones(len(left), dtype=bool) if curve.closed else (left >= 0) & (left < k - 1)
        left = np.mod(left, k)
        start = curve.points_mm[left]
        step = curve.points_mm[(left + 1) % k] - start
        t = np.clip(np.sum((points - start) * step, axis=1) / np.sum(step * step, axis=1), 0.0, 1.0)
        d2 = np.sum((start + t[:, None] * step - points) ** 2, axis=1)
        better = exists & (d2 < best_d2)
        best_d2 = np.where(better, d2, best_d2)
        best_s = np.where(better, s_end[left] + t * (s_end[left + 1] - s_end[left]), best_s)
    s_mm[near], distance[near] = best_s, np.sqrt(best_d2)
    return s_mm, distance


def coordinates(points_mm: FloatArray, curve: FramedCurve) -> CurveCoordinates:
    """Return (n, 3) points in the frames of the curve at their nearest places."""
    s_mm, _ = nearest(points_mm, curve)
    frame = at(curve, s_mm)
    offset = points_mm - frame.points_mm
    along, inward, outward = (np.sum(offset * axis, axis=1) for axis in (frame.tangents, frame.inward, frame.outward))
    return CurveCoordinates(s_mm, along, inward, outward)
