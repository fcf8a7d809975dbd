"""The scan as a surface: its k-d tree, its spacing, its rim, and the local plane at any place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import LocalPlanes, Rim, cloud_rim, local_planes, mesh_rim, without
from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import BoolArray, FloatArray, IntArray, Scan
from sicp_cam.registration.evenness import evened

__all__ = ["ScanSurface", "cropped", "distances_along_normal", "prepared", "without_copies"]

NEAR = 4
SAMPLE, COPY, COPIES_SHARE = 2000, 0.02, 0.02
"""Points nearer than this share of the distance of their 8th neighbours are copies, if as many of a sample have one."""
APART = 1.8
"""How much further than those of its neighbours the 4th neighbour of a stray point is."""


@dataclass(frozen=True, slots=True, eq=False)
class ScanSurface:
    """A scan made ready for registration.

    Parameters
    ----------
    points_mm
        (n, 3) points in the scan frame, without strays.
    tree
        Their k-d tree.
    planes
        The plane of each point and its neighbours.
    rim
        The points at which the scan ends.
    spacing_mm
        Point spacing: the side of the square that one point stands for.
    normals
        (n, 3) outward normals where the scan file gives them.
    faces
        (m, 3) triangles of a mesh; None for a cloud.
    strays_mm
        (q, 3) points that lie apart from all others, as where a beam meets the edge of a part and what is behind it.
    in_rows
        True if the points lay in rows, much denser along them than across, and were thinned to an even spacing.
    """

    points_mm: FloatArray
    tree: cKDTree
    planes: LocalPlanes
    rim: Rim
    spacing_mm: float
    normals: FloatArray | None = None
    faces: IntArray | None = None
    strays_mm: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    in_rows: bool = False


def prepared(scan: Scan) -> ScanSurface:
    """Return a scan without copies of points, see `without_copies`, with its k-d tree, planes, spacing and rim."""
    before, scan = len(scan.points_mm), evened(scan)
    tree = cKDTree(scan.points_mm)
    planes = local_planes(scan.points_mm, tree)
    if scan.faces is not None:
        rim = mesh_rim(scan.points_mm, scan.faces)
        return ScanSurface(scan.points_mm, tree, planes, rim, _spacing_mm(planes), scan.normals, scan.faces)
    apart = _apart(planes)
    points, normals = scan.points_mm[~apart], None if scan.normals is None else scan.normals[~apart]
    if apart.any():
        tree = cKDTree(points)
        planes = without(planes, points, tree, apart)
    rim = cloud_rim(points, planes)
    strays, in_rows = scan.points_mm[apart], before > len(scan.points_mm)
    return ScanSurface(points, tree, planes, rim, _spacing_mm(planes), normals, None, strays, in_rows)


def _apart(planes: LocalPlanes) -> BoolArray:
    """Say which points lie further from their neighbours than those do from theirs (after Breunig et al. 2000)."""
    own = planes.distances_mm[:, min(NEAR, planes.distances_mm.shape[1] - 1)]
    return np.asarray(own > APART * np.median(own[planes.neighbours[:, 1 : 2 * NEAR + 1]], axis=1))


def without_copies(scan: Scan) -> Scan:
    """Return a scan with every point once; copies would take the places of a point's neighbours. A mesh stays.

    Points a small part of their spacing apart are copies too: exports of one scan that were merged differ by rounding.
    """
    if scan.faces is not None or len(scan.points_mm) <= 2 * NEAR:
        return scan
    _, first = np.unique(scan.points_mm, axis=0, return_index=True)
    kept = np.zeros(len(scan.points_mm), dtype=bool)
    kept[first] = True
    points = scan.points_mm[kept]
    tree = cKDTree(points)
    distance, _ = tree.query(points[:: max(1, len(points) // SAMPLE)], k=2 * NEAR + 1)
    close_mm = COPY * float(np.median(distance[:, 2 * NEAR]))
    if (distance[:, 1] < close_mm).mean() > COPIES_SHARE:
        pairs = tree.query_pairs(close_mm, output_type="ndarray")
        kept[np.flatnonzero(kept)[pairs.max(axis=1)]] = False
    if kept.all():
        return scan
    return Scan(scan.points_mm[kept], None if scan.normals is None else scan.normals[kept], None, scan.source)


def _spacing_mm(planes: LocalPlanes) -> float:
    """Return the spacing from the distance r of the 4th neighbour, pi r^2 holding four points: r sqrt(pi / 4)."""
    return float(np.median(planes.distances_mm[:, min(NEAR, planes.distances_mm.shape[1] - 1)]) * np.sqrt(np.pi / NEAR))


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
    distance, index = surface.tree.query(points_mm, distance_upper_bound=reach_mm)
    found = np.isfinite(distance)
    index = np.where(found, index, 0)
    N, centres = surface.planes.normals[index], surface.planes.centres_mm[index]
    agreement = np.sum(N * normals, axis=1)
    N = N * np.where(agreement < 0.0, -1.0, 1.0)[:, None]
    out = np.sum((centres - points_mm) * N, axis=1)
    # The plane must lie beside the point, not end before it: its centre may be off in the plane by its own radius.
    sideways = np.linalg.norm(centres - points_mm - out[:, None] * N, axis=1)
    usable = found & (np.abs(agreement) > np.sqrt(0.5)) & (sideways <= surface.planes.radii_mm[index])
    return np.where(usable, out, np.nan), N
