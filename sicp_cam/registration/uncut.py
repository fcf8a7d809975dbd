"""Contours that are not cut yet: the scan goes on beyond them, and there is no edge to find.

The path of such a contour trims the part. In the surface it lies where the start pose has it, which the fixture or the
datums gave; out of the surface the scan decides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sicp_cam.contour.frames import FramedCurve, moved
from sicp_cam.model import FloatArray
from sicp_cam.registration.gauss_newton import Rows, freedoms, stacked, tukey
from sicp_cam.registration.rigid import NominalContour, RigidPose
from sicp_cam.registration.scan_surface import ScanSurface, distances_along_normal
from sicp_cam.rigid_motion import apply, exponential, rotate

__all__ = ["is_uncut", "register_to_surface"]

BESIDE_MM, BESIDE_SPACINGS, BESIDE_SIZE = 15.0, 5.0, 0.25
"""How far on both sides of the contour the surface is looked for: beyond the error of a start pose, but never further
than a quarter of the contour's size, where an opening has another side."""
STEPS = (-1.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Where, in shares of that: the last four in equal steps, so that a parabola through three tells the fourth."""
THERE_SPACINGS, LEVEL_SPACINGS, LEVEL_SHARE = 1.5, 0.5, 0.9
UNCUT_SHARE = 0.8
"""Share of the stations that must have the surface on both sides."""
ITERATIONS = 30
CONVERGED_MM = 1e-4


def is_uncut(contour: NominalContour, surface: ScanSurface, T_scan_part: FloatArray, reach_mm: float) -> bool:
    """Say whether the scan goes on beyond a contour, on its open side as on the side of the material."""
    curve = moved(contour.curve, T_scan_part)
    beside_mm = min(max(BESIDE_MM, BESIDE_SPACINGS * surface.spacing_mm), BESIDE_SIZE * _size_mm(curve))
    there, heights = np.ones(len(curve), dtype=bool), []
    for depth in STEPS:
        places = curve.points_mm + depth * beside_mm * curve.inward
        out, planes = distances_along_normal(surface, places, curve.outward, reach_mm)
        places = places + np.nan_to_num(out)[:, None] * planes
        near, _ = surface.tree.query(places, distance_upper_bound=THERE_SPACINGS * surface.spacing_mm)
        there &= np.isfinite(out) & np.isfinite(near)
        heights.append(out)
    if float(there.mean()) <= UNCUT_SHARE:
        return False
    beyond, first, second, third = (height[there] for height in heights[-4:])
    # What is seen through an opening, as a table, does not carry on the parabola through the material.
    step = beyond - (6.0 * first - 8.0 * second + 3.0 * third)
    return float((np.abs(step) < LEVEL_SPACINGS * surface.spacing_mm).mean()) > LEVEL_SHARE


def _size_mm(curve: FramedCurve) -> float:
    """Return the extent of a curve across its longest axis in the plane that it lies in best."""
    centred = curve.points_mm - curve.points_mm.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return float(np.ptp(centred @ axes[1])) if curve.closed else curve.length_mm


def register_to_surface(
    contours: Sequence[NominalContour], surface: ScanSurface, T_start: FloatArray, *, reach_mm: float
) -> RigidPose:
    """Move the part onto the scanned surface by its height and two tilts; the other three freedoms stay as given.

    A surface alone would let a gently curved part slide by a hundred millimetres.
    """
    T = T_start
    curves = [moved(contour.curve, T_start) for contour in contours]
    centre = np.concatenate([curve.points_mm for curve in curves]).mean(axis=0)
    normal = np.concatenate([curve.outward for curve in curves]).mean(axis=0)
    first, second, up = np.linalg.svd(normal[None])[2][[1, 2, 0]]
    twists = np.zeros((3, 6))
    twists[0, :3], twists[1, :3], twists[2, 3:] = first, second, up
    for _ in range(ITERATIONS):
        rows = _equations(contours, surface, T, reach_mm)
        arms = rows.points_mm - centre
        J = np.concatenate([np.cross(arms, rows.directions), rows.directions], axis=1) @ twists.T
        weighted = J * rows.weights[:, None]
        amounts = np.linalg.lstsq(weighted.T @ J, weighted.T @ rows.residuals_mm, rcond=None)[0]
        T = exponential(amounts @ twists, centre) @ T
        if np.abs(J @ amounts).max() < CONVERGED_MM:
            break
    rows = _equations(contours, surface, T, reach_mm)
    values, open_twists = freedoms(rows)
    rms = float(np.sqrt(np.average(rows.residuals_mm**2, weights=np.maximum(rows.weights, 1e-12))))
    return RigidPose(T, values, open_twists, rms)


def _equations(contours: Sequence[NominalContour], surface: ScanSurface, T: FloatArray, reach_mm: float) -> Rows:
    parts = []
    for contour in contours:
        points = np.concatenate([contour.curve.points_mm, contour.ring_points_mm])
        normals = rotate(T, np.concatenate([contour.curve.outward, contour.ring_normals]))
        points = apply(T, points)
        out, planes = distances_along_normal(surface, points, normals, reach_mm)
        parts.append(Rows(points, planes, np.nan_to_num(out), tukey(out, 0.75 * reach_mm) / len(points)))
    return stacked(*parts)
