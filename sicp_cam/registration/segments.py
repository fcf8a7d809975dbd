"""Subdivision-ICP: one rigid motion for each overlapping piece of the contour, and their smooth blend.

Each piece is moved by Gauss-Newton so that its stations meet their targets; the stability points near it are held on
the scan surface, which settles the rotations that a nearly straight piece leaves open, and a weak prior towards the
primary pose settles the rest (sliding along the contour).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at, moved, orthonormal
from sicp_cam.contour.projection import nearest
from sicp_cam.contour.subdivision import Subdivision, weights
from sicp_cam.model import FloatArray, IntArray
from sicp_cam.registration.gauss_newton import Rows, motion_steps, stacked, tukey
from sicp_cam.registration.result import Segment
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import ScanSurface, distances_along_normal
from sicp_cam.rigid_motion import apply, rotate

__all__ = ["Targets", "blended", "point_to_curve", "point_to_point", "register_segments"]

ITERATIONS = 12
CONVERGED_MM = 1e-4
PRIOR = 1e-4
RING_SHARE = 0.25
SLIDE_SHARE = 0.003
"""Weight that holds a piece against sliding along the contour, where its edge alone would let it go."""


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Where the stations of a contour should go.

    Parameters
    ----------
    s_mm
        (k,) arc lengths of the stations.
    points_scan_mm
        (k, 3) targets in the scan frame.
    weights
        (k,) trust in each; 0 where the scan shows nothing.
    """

    s_mm: FloatArray
    points_scan_mm: FloatArray
    weights: FloatArray


Correspondence: TypeAlias = Callable[[FramedCurve, IntArray], Rows]
"""Equations for some stations of the contour, given where they are now and which they are."""


def point_to_curve(targets: Targets) -> Correspondence:
    """Return the correspondence that leaves sliding along the contour free: the two components across its travel."""

    def rows(now: FramedCurve, stations: IntArray) -> Rows:
        offset = targets.points_scan_mm[stations] - now.points_mm
        across = np.sum(offset * now.inward, axis=1)
        out = np.sum(offset * now.outward, axis=1)
        trust = targets.weights[stations]
        return stacked(Rows(now.points_mm, now.inward, across, trust), Rows(now.points_mm, now.outward, out, trust))

    return rows


def point_to_point(closest: Callable[[FloatArray], FloatArray], reach_mm: float) -> Correspondence:
    """Return the paper's correspondence: each contour point goes to the closest scan edge point, in all three axes.

    Parameters
    ----------
    closest
        Gives the closest scan edge point of each of (n, 3) points.
    reach_mm
        Pairs further apart than this are left out.
    """

    def rows(now: FramedCurve, stations: IntArray) -> Rows:
        offset = closest(now.points_mm) - now.points_mm
        trust = (np.linalg.norm(offset, axis=1) <= reach_mm).astype(np.float64)
        return stacked(
            *(
                Rows(now.points_mm, np.broadcast_to(axis, offset.shape), offset[:, i], trust)
                for i, axis in enumerate(np.eye(3))
            )
        )

    return rows


def register_segments(
    contour: NominalContour,
    subdivision: Subdivision,
    s_mm: FloatArray,
    correspondence: Correspondence,
    surface: ScanSurface,
    T_primary: FloatArray,
    *,
    reach_mm: float,
) -> tuple[Segment, ...]:
    """Register every piece of a contour on its own.

    Parameters
    ----------
    contour
        The contour and its stability points, in the part frame.
    subdivision
        Its pieces.
    s_mm
        (k,) arc lengths of the stations that `correspondence` speaks of.
    correspondence
        Equations for stations, see `point_to_curve` and `point_to_point`.
    surface
        The scan.
    T_primary
        (4, 4) primary registration: the start, and the prior, of every piece.
    reach_mm
        Largest distance between a stability point and the scan.
    """
    T = np.tile(T_primary, (len(subdivision.ranges_mm()), 1, 1))
    stations, station_piece = _pairs(subdivision, s_mm)
    nominal = at(contour.curve, s_mm[stations])
    ring_s = nearest(contour.ring_points_mm, contour.curve)[0] if len(contour.ring_points_mm) else np.zeros(0)
    ring, ring_piece = _pairs(subdivision, ring_s)
    ring_points, ring_normals = contour.ring_points_mm[ring], contour.ring_normals[ring]
    ring_count = np.bincount(ring_piece, minlength=len(T))
    primary = moved(nominal, T_primary)
    for _ in range(ITERATIONS):
        now = _moved_each(nominal, T[station_piece])
        edge = correspondence(now, stations)
        edge_piece = np.tile(station_piece, len(edge.weights) // len(stations))
        total = np.bincount(edge_piece, weights=edge.weights, minlength=len(T))
        edge = replace(edge, weights=edge.weights / np.maximum(total, 1e-12)[edge_piece])
        parts, piece = [edge, _against_sliding(now, primary, station_piece)], [edge_piece, station_piece]
        if len(ring):
            points, normals = _points_each(T[ring_piece], ring_points), _directions_each(T[ring_piece], ring_normals)
            distances, planes = distances_along_normal(surface, points, normals, reach_mm)
            trust = RING_SHARE * tukey(distances, 0.75 * reach_mm) / ring_count[ring_piece]
            parts.append(Rows(points, planes, np.nan_to_num(distances), trust))
            piece.append(ring_piece)
        rows, group = stacked(*parts), np.concatenate(piece)
        # A piece of which nothing was scanned keeps the primary pose.
        rows = replace(rows, weights=rows.weights * (total > 0.0)[group])
        steps = motion_steps(rows, group, PRIOR, T_primary @ np.linalg.inv(T))
        T = steps @ T
        if np.abs(_points_each(steps[station_piece], now.points_mm) - now.points_mm).max() < CONVERGED_MM:
            break
    weight = np.maximum(np.bincount(group, weights=rows.weights, minlength=len(T)), 1e-300)
    rms = np.sqrt(np.bincount(group, weights=rows.weights * rows.residuals_mm**2, minlength=len(T)) / weight)
    return tuple(
        Segment(float(start), float(end), motion, float(residual))
        for (start, end), motion, residual in zip(subdivision.ranges_mm(), T, rms, strict=True)
    )


def _pairs(subdivision: Subdivision, s_mm: FloatArray) -> tuple[IntArray, IntArray]:
    """Return which arc lengths belong to which piece, as (n,) indices of each; some belong to two."""
    pairs = np.nonzero(weights(subdivision, s_mm) > 0.0)
    return pairs[0], pairs[1]


def _points_each(T: FloatArray, points_mm: FloatArray) -> FloatArray:
    """Move each of (n, 3) points by its own of (n, 4, 4) motions."""
    return _directions_each(T, points_mm) + T[:, :3, 3]


def _directions_each(T: FloatArray, directions: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nij,nj->ni", T[:, :3, :3], directions))


def _moved_each(curve: FramedCurve, T: FloatArray) -> FramedCurve:
    """Return stations moved each by its own of (k, 4, 4) motions."""
    T_axis, B, N = (_directions_each(T, axis) for axis in (curve.tangents, curve.inward, curve.outward))
    return replace(curve, points_mm=_points_each(T, curve.points_mm), tangents=T_axis, inward=B, outward=N)


def _against_sliding(now: FramedCurve, primary: FramedCurve, piece: IntArray) -> Rows:
    """Return equations that keep stations where the primary pose has them along the contour, and only along it."""
    back = np.sum((primary.points_mm - now.points_mm) * now.tangents, axis=1)
    return Rows(now.points_mm, now.tangents, back, SLIDE_SHARE / np.bincount(piece)[piece])


def blended(curve: FramedCurve, subdivision: Subdivision, segments: tuple[Segment, ...]) -> FramedCurve:
    """Return a part-frame curve carried to the scan by its segments' motions, blended through their overlaps.

    A station that several pieces cover goes to the weighted mean of where each would take it.
    """
    W = weights(subdivision, curve.s_mm)
    points = np.zeros_like(curve.points_mm)
    tangents, outward = np.zeros_like(points), np.zeros_like(points)
    for w, segment in zip(W.T, segments, strict=True):
        some = w > 0.0
        T, share = segment.T_scan_part, w[some, None]
        points[some] += share * apply(T, curve.points_mm[some])
        tangents[some] += share * rotate(T, curve.tangents[some])
        outward[some] += share * rotate(T, curve.outward[some])
    T_axis, B, N = orthonormal(tangents, outward)
    return FramedCurve(curve.s_mm, points, T_axis, B, N, curve.length_mm, curve.closed)
