"""The primary registration: one rigid motion for the whole contour.

Scan rim points are brought onto the nominal contour (the two components across its travel), and the stability points
onto the scan surface (along their normals), by Gauss-Newton with robust weights. The number of iterations is bounded
and the loop ends when the pose no longer changes; there is no threshold on the error itself, which a deformed part
would never reach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.contour.boundary import Rim
from sicp_cam.contour.frames import FramedCurve, at, moved
from sicp_cam.contour.projection import nearest
from sicp_cam.errors import RegistrationError
from sicp_cam.model import FloatArray, IntArray
from sicp_cam.registration.gauss_newton import Rows, freedoms, motion_step, stacked, tukey
from sicp_cam.registration.scan_surface import ScanSurface, distances_along_normal
from sicp_cam.rigid_motion import apply, rotate

__all__ = ["NominalContour", "RigidPose", "facing_rim", "register_rigidly", "thinned"]

MAX_ITERATIONS = 60
CONVERGED_MM = 1e-3
PRIOR = 1e-3
RING_SHARE = 0.5
"""Weight of all stability points together over the weight of all rim points together."""
OWN_WIDTHS, OWN_SPACINGS = 2.0 / 3.0, 3.0
FACING = 0.3
"""Least cosine between a rim point's open side and the contour's own open side."""
MIN_RIM_POINTS = 20
COARSE_POINTS = 300
OUT_REACHES = 2.0
"""Robust scale out of the surface, in reaches: a twisted part lies far out everywhere, not only where it is wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class NominalContour:
    """A contour to be registered: its curve and its stability points, in the part frame."""

    curve: FramedCurve
    ring_points_mm: FloatArray
    ring_normals: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RigidPose:
    """The primary registration.

    Parameters
    ----------
    T_scan_part
        (4, 4) pose.
    freedoms, twists
        Singular values and directions of the last step, see `gauss_newton.freedoms`.
    rms_mm
        Robust root mean square of the rim's distance from the contour.
    """

    T_scan_part: FloatArray
    freedoms: FloatArray
    twists: FloatArray
    rms_mm: float


def facing_rim(rim: Rim, curve: FramedCurve, reach_mm: float) -> tuple[IntArray, FloatArray]:
    """Select the rim points that can belong to a curve in the scan frame: within reach, open to the same side.

    Returns
    -------
    indices, s_mm
        (m,) indices into the rim, and the arc length of the nearest place on the curve.
    """
    s_mm, distance = nearest(rim.points_mm, curve, reach_mm=reach_mm)
    facing = -np.sum(rim.open_directions * at(curve, s_mm).inward, axis=1)
    chosen = np.flatnonzero((distance <= reach_mm) & (facing >= FACING))
    return chosen, s_mm[chosen]


def thinned(contours: Sequence[NominalContour], surface: ScanSurface) -> tuple[list[NominalContour], ScanSurface]:
    """Return contours and scan with few enough rim and stability points for a pose that need not be exact yet."""
    rim, rings = surface.rim, max(len(contour.ring_points_mm) for contour in contours)
    step, ring_step = max(1, len(rim.indices) // COARSE_POINTS), max(1, rings // COARSE_POINTS)
    few = Rim(rim.indices[::step], rim.points_mm[::step], rim.open_directions[::step])
    coarse = [NominalContour(c.curve, c.ring_points_mm[::ring_step], c.ring_normals[::ring_step]) for c in contours]
    return coarse, replace(surface, rim=few)


def register_rigidly(
    contours: Sequence[NominalContour],
    surface: ScanSurface,
    T_start: FloatArray,
    *,
    reach_mm: float,
    iterations: int = MAX_ITERATIONS,
) -> RigidPose:
    """Find the rigid pose of the part in the scan, from a start that is nearly right.

    Parameters
    ----------
    contours
        The contours, in the part frame.
    surface
        The scan.
    T_start
        (4, 4) first guess of T_scan_part.
    reach_mm
        Largest distance between a rim point and its place on the contour.
    iterations
        Most steps that are taken.

    Raises
    ------
    RegistrationError
        If fewer than 50 rim points lie near the contours.
    """
    T, scale_mm = _descended(*thinned(contours, surface), T_start, reach_mm, reach_mm, iterations)
    T, scale_mm = _descended(contours, surface, T, reach_mm, scale_mm, iterations)
    rows, _ = _equations(contours, surface, T, reach_mm, scale_mm)
    used = rows.weights > 0.0
    rms = float(np.sqrt(np.average(rows.residuals_mm[used] ** 2, weights=rows.weights[used])))
    values, twists = freedoms(rows)
    return RigidPose(T, values, twists, rms)


def _descended(
    contours: Sequence[NominalContour],
    surface: ScanSurface,
    T: FloatArray,
    reach_mm: float,
    scale_mm: float,
    iterations: int,
) -> tuple[FloatArray, float]:
    """Return the pose after Gauss-Newton from a start, and the robust scale that it came down to."""
    for _ in range(iterations):
        rows, inward_mm = _equations(contours, surface, T, reach_mm, scale_mm)
        step = motion_step(rows, PRIOR)
        T = step @ T
        floor_mm = max(3.0 * surface.spacing_mm, 3.0 * _robust_deviation(inward_mm))
        moved_mm = np.abs(apply(step, rows.points_mm[::50]) - rows.points_mm[::50]).max()
        if moved_mm < CONVERGED_MM and scale_mm <= floor_mm:
            break
        scale_mm = max(0.5 * scale_mm, floor_mm)
    return T, scale_mm


def _equations(
    contours: Sequence[NominalContour],
    surface: ScanSurface,
    T: FloatArray,
    reach_mm: float,
    scale_mm: float,
) -> tuple[Rows, FloatArray]:
    rows: list[Rows] = []
    deviations: list[FloatArray] = []
    for contour in contours:
        curve = moved(contour.curve, T)
        chosen, s_mm = facing_rim(surface.rim, curve, min(reach_mm, _own_reach_mm(contour.curve, surface.spacing_mm)))
        if len(chosen):
            rows.extend(_rim_rows(surface.rim.points_mm[chosen], at(curve, s_mm), scale_mm, reach_mm))
            deviations.append(rows[-2].residuals_mm)
        if len(contour.ring_points_mm):
            rows.append(_ring_rows(contour, surface, T, reach_mm))
    found = sum(len(d) for d in deviations)
    if found < MIN_RIM_POINTS:
        raise RegistrationError(
            f"only {found} points of the scan's rim lie within {reach_mm:g} mm of the contour;"
            " check that scan and part belong together and that the start pose (--align) is right"
        )
    return stacked(*rows), np.concatenate(deviations)


def _own_reach_mm(curve: FramedCurve, spacing_mm: float) -> float:
    """Return how far from a closed contour its rim may lie: beyond two thirds of its own width other holes begin."""
    if not curve.closed:
        return np.inf
    centred = curve.points_mm - curve.points_mm.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return max(OWN_WIDTHS * float(np.ptp(centred @ axes[1])), OWN_SPACINGS * spacing_mm)


def _rim_rows(points_mm: FloatArray, foot: FramedCurve, scale_mm: float, reach_mm: float) -> list[Rows]:
    offset = points_mm - foot.points_mm
    inward, outward = np.sum(offset * foot.inward, axis=1), np.sum(offset * foot.outward, axis=1)
    # In the surface the rim is sharp and its outliers are many; out of it the deformation itself is large.
    trust = tukey(inward, scale_mm) * tukey(outward, OUT_REACHES * reach_mm) / len(points_mm)
    return [
        Rows(foot.points_mm, foot.inward, inward, trust),
        Rows(foot.points_mm, foot.outward, outward, trust),
    ]


def _ring_rows(contour: NominalContour, surface: ScanSurface, T: FloatArray, reach_mm: float) -> Rows:
    points, normals = apply(T, contour.ring_points_mm), rotate(T, contour.ring_normals)
    distances, planes = distances_along_normal(surface, points, normals, reach_mm)
    trust = RING_SHARE * tukey(distances, OUT_REACHES * reach_mm) / len(points)
    return Rows(points, planes, np.nan_to_num(distances), trust)


def _robust_deviation(values: FloatArray) -> float:
    """Return 1.4826 times the median absolute value."""
    return float(1.4826 * np.median(np.abs(values)))
