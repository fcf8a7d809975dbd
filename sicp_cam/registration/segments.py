"""Subdivision-ICP: one rigid motion for each overlapping piece of the contour, and their smooth blend.

Each piece is moved by Gauss-Newton so that its stations meet their targets; the stability points near it are held on
the scan surface, which settles the rotations that a nearly straight piece leaves open, and a weak prior towards the
primary pose settles the rest (sliding along the contour).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at, moved, orthonormal
from sicp_cam.contour.projection import nearest
from sicp_cam.contour.subdivision import Subdivision, weights
from sicp_cam.model import FloatArray, IntArray
from sicp_cam.registration.gauss_newton import Rows, motion_step, stacked, tukey
from sicp_cam.registration.result import Segment
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import ScanSurface, distances_along_normal
from sicp_cam.rigid_motion import apply, inverse, rotate

__all__ = ["Targets", "blended", "point_to_curve", "point_to_point", "register_segments"]

ITERATIONS = 12
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
    edge_weights, surface_weights
        (k,) trust in each, in the surface across the contour and out of it; 0 where the scan shows nothing.
    """

    s_mm: FloatArray
    points_scan_mm: FloatArray
    edge_weights: FloatArray
    surface_weights: FloatArray


Correspondence: TypeAlias = Callable[[FramedCurve, IntArray], Rows]
"""Equations for some stations of the contour, given where they are now and which they are."""


def point_to_curve(targets: Targets) -> Correspondence:
    """Return the correspondence that leaves sliding along the contour free: the two components across its travel."""

    def rows(now: FramedCurve, stations: IntArray) -> Rows:
        offset = targets.points_scan_mm[stations] - now.points_mm
        across = np.sum(offset * now.inward, axis=1)
        out = np.sum(offset * now.outward, axis=1)
        return stacked(
            Rows(now.points_mm, now.inward, across, targets.edge_weights[stations]),
            Rows(now.points_mm, now.outward, out, targets.surface_weights[stations]),
        )

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
    stations = at(contour.curve, s_mm)
    ring_s, _ = nearest(contour.ring_points_mm, contour.curve) if len(contour.ring_points_mm) else (np.zeros(0), None)
    at_stations, at_ring = weights(subdivision, s_mm), weights(subdivision, ring_s)
    segments = []
    for piece, (start_mm, end_mm) in enumerate(subdivision.ranges_mm()):
        chosen = np.flatnonzero(at_stations[:, piece] > 0.0)
        ring = np.flatnonzero(at_ring[:, piece] > 0.0)
        T, rms = _register_piece(
            contour, _taken(stations, chosen), chosen, ring, correspondence, surface, T_primary, reach_mm
        )
        segments.append(Segment(float(start_mm), float(end_mm), T, rms))
    return tuple(segments)


def _register_piece(
    contour: NominalContour,
    nominal: FramedCurve,
    stations: IntArray,
    ring: IntArray,
    correspondence: Correspondence,
    surface: ScanSurface,
    T_primary: FloatArray,
    reach_mm: float,
) -> tuple[FloatArray, float]:
    T = T_primary
    rms = 0.0
    for _ in range(ITERATIONS):
        edge = correspondence(moved(nominal, T), stations)
        total = edge.weights.sum()
        parts = [Rows(edge.points_mm, edge.directions, edge.residuals_mm, edge.weights / max(total, 1e-12))]
        parts.append(_against_sliding(moved(nominal, T), moved(nominal, T_primary)))
        if len(ring):
            points, normals = apply(T, contour.ring_points_mm[ring]), rotate(T, contour.ring_normals[ring])
            distances, planes = distances_along_normal(surface, points, normals, reach_mm)
            trust = RING_SHARE * tukey(distances, 0.75 * reach_mm) / len(ring)
            parts.append(Rows(points, planes, np.nan_to_num(distances), trust))
        rows = stacked(*parts)
        if total <= 0.0:
            return T_primary, 0.0  # nothing of this piece was scanned: it keeps the primary pose
        step = motion_step(rows, PRIOR, T_primary @ inverse(T))
        T = step @ T
        rms = float(np.sqrt(np.average(rows.residuals_mm**2, weights=rows.weights)))
        if np.abs(apply(step, rows.points_mm[:1]) - rows.points_mm[:1]).max() < 1e-4:
            break
    return T, rms


def _against_sliding(now: FramedCurve, primary: FramedCurve) -> Rows:
    """Return equations that keep stations where the primary pose has them along the contour, and only along it."""
    back = np.sum((primary.points_mm - now.points_mm) * now.tangents, axis=1)
    return Rows(now.points_mm, now.tangents, back, np.full(len(back), SLIDE_SHARE / len(back)))


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


def _taken(curve: FramedCurve, rows: IntArray) -> FramedCurve:
    return FramedCurve(
        curve.s_mm[rows],
        curve.points_mm[rows],
        curve.tangents[rows],
        curve.inward[rows],
        curve.outward[rows],
        curve.length_mm,
        curve.closed,
    )
