"""The scan as a surface: its k-d tree, its spacing, its rim, and the local plane at any place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import Rim, cloud_rim, mesh_rim, surface_normals
from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import FloatArray, IntArray, Scan

__all__ = ["ScanSurface", "cropped", "distances_along_normal", "prepared", "without_copies"]

PLANE_NEIGHBOURS = 12


@dataclass(frozen=True, slots=True, eq=False)
class ScanSurface:
    """A scan made ready for registration.

    Parameters
    ----------
    points_mm
        (n, 3) points in the scan frame.
    tree
        Their k-d tree.
    rim
        The points at which the scan ends.
    spacing_mm
        Point spacing: the side of the square that one point stands for.
    normals
        (n, 3) outward normals where the scan file gives them.
    faces
        (m, 3) triangles of a mesh; None for a cloud.
    """

    points_mm: FloatArray
    tree: cKDTree
    rim: Rim
    spacing_mm: float
    normals: FloatArray | None = None
    faces: IntArray | None = None


def prepared(scan: Scan) -> ScanSurface:
    """Return a scan without copies of points, see `without_copies`, with its k-d tree, spacing and rim."""
    tree = cKDTree(scan.points_mm)
    rim = cloud_rim(scan.points_mm, tree) if scan.faces is None else mesh_rim(scan.points_mm, scan.faces)
    return ScanSurface(scan.points_mm, tree, rim, _spacing_mm(scan.points_mm, tree), scan.normals, scan.faces)


def without_copies(scan: Scan) -> Scan:
    """Return a scan with every point once; copies would take the places of a point's neighbours. A mesh stays."""
    if scan.faces is not None:
        return scan
    _, first = np.unique(scan.points_mm, axis=0, return_index=True)
    if len(first) == len(scan.points_mm):
        return scan
    first = np.sort(first)
    return Scan(scan.points_mm[first], None if scan.normals is None else scan.normals[first], None, scan.source)


def _spacing_mm(points_mm: FloatArray, tree: cKDTree) -> float:
    """Return the spacing from the distance r of the 4th neighbour, pi r^2 holding four points: r sqrt(pi / 4)."""
    some = points_mm[:: max(1, len(points_mm) // 5000)]
    distance, _ = tree.query(some, k=5)
    return float(np.median(distance[:, 4]) * np.sqrt(np.pi / 4.0))


def cropped(scan: Scan, curves: Sequence[FramedCurve], reach_mm: float) -> Scan:
    """Return the part of a scan within reach of curves in the scan frame, triangles and normals with it.

    A cropped mesh gets a new rim where it is cut, which lies at the reach and so outside of every smaller one.
    """
    keep = np.zeros(len(scan.points_mm), dtype=bool)
    margin_mm = 1.1 * reach_mm  # the curve is looked at every tenth of the reach only
    for curve in curves:
        low, high = curve.points_mm.min(axis=0) - margin_mm, curve.points_mm.max(axis=0) + margin_mm
        boxed = np.flatnonzero(((scan.points_mm >= low) & (scan.points_mm <= high)).all(axis=1))
        step = max(1, int(0.1 * reach_mm * len(curve) / curve.length_mm))
        tree = cKDTree(curve.points_mm[::step])
        distance, _ = tree.query(scan.points_mm[boxed], distance_upper_bound=margin_mm)
        keep[boxed[np.isfinite(distance)]] = True
    number = np.cumsum(keep) - 1
    faces = None if scan.faces is None else number[scan.faces[keep[scan.faces].all(axis=1)]]
    normals = None if scan.normals is None else scan.normals[keep]
    return Scan(scan.points_mm[keep], normals, faces, scan.source)


def distances_along_normal(
    surface: ScanSurface, points_mm: FloatArray, normals: FloatArray, reach_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Measure how far the scan lies from points along their normals, by the local plane of the scan.

    Parameters
    ----------
    surface
        The scan.
    points_mm, normals
        (q, 3) points near the scan, and the outward unit normals that they should have.
    reach_mm
        Points with no scan point this near give NaN.

    Returns
    -------
    distances, planes
        (q,) signed distance from each point to the scan's plane, positive outward, NaN where the scan has no surface
        there or its normal is more than 45 degrees off; (q, 3) unit normal of that plane, on the outward side.
    """
    wanted = min(PLANE_NEIGHBOURS, len(surface.points_mm))
    distance, index = surface.tree.query(points_mm, k=wanted, distance_upper_bound=2.0 * reach_mm)
    found = np.isfinite(distance).all(axis=1)
    index = np.where(found[:, None], index, 0)
    N, centres = surface_normals(surface.points_mm[index])
    agreement = np.sum(N * normals, axis=1)
    N = N * np.sign(agreement)[:, None]
    out = np.sum((centres - points_mm) * N, axis=1)
    # The plane must lie beside the point, not end before it: its centre may be off in the plane by its own radius.
    radius = np.max(np.linalg.norm(surface.points_mm[index] - centres[:, None], axis=2), axis=1)
    sideways = np.linalg.norm(centres - points_mm - out[:, None] * N, axis=1)
    usable = found & (distance[:, 0] <= reach_mm) & (np.abs(agreement) > np.sqrt(0.5)) & (sideways <= radius)
    return np.where(usable, out, np.nan), N
