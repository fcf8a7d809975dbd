"""Run other libraries on the cases, each in a child process of their own environment, told by files.

Nothing of them is imported here. A peer that is not installed, fails, or takes longer than its limit is listed as not
measured, with the reason.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from cases import Case
from scipy import sparse
from scipy.spatial import cKDTree
from truth import error

from sicp_cam.contour.frames import framed, moved
from sicp_cam.contour.projection import coordinates, nearest
from sicp_cam.model import Contour
from sicp_cam.registration.rigid import facing_rim
from sicp_cam.registration.scan_surface import cropped, prepared
from sicp_cam.rigid_motion import apply

__all__ = ["LIMIT_S", "PEERS", "NotMeasuredError", "measured", "problem"]

ROOT = Path(__file__).resolve().parent.parent
PYTHON = ROOT / ".peers" / "bin" / "python"
CHILD = ROOT / "benchmarks" / "peers" / "register.py"
LIMIT_S = 120.0
"""Wall-clock time for one peer on one case, its start included."""
REACH_MM = 40.0
LINKED_SPACINGS = 3.0
SPECK = 0.05
"""Pieces of rim with a smaller share of its points are no part of the edge."""
ROWS_MM = np.arange(0.0, 31.0, 2.5)
"""Depths of the nominal surface that a peer is given, from the edge into the material."""

PEERS = (
    "Open3D point-to-point, edge to rim",
    "Open3D point-to-point, surface",
    "Open3D point-to-plane, surface",
    "small_gicp point-to-point, edge to rim",
    "small_gicp point-to-plane, surface",
    "small_gicp GICP, surface",
    "trimesh icp, edge to rim",
    "trimesh nricp_amberg, surface",
    "trimesh nricp_sumner, surface",
    "pycpd rigid, edge to rim",
    "pycpd affine, edge to rim",
    "pycpd deformable, edge to rim",
    "CloudCompare ICP, edge to rim",
    "CloudCompare ICP, surface",
)
"""Their names, as `peers/register.py` has them."""


class NotMeasuredError(Exception):
    """A peer gave no result, and why."""


def problem(case: Case) -> dict[str, np.ndarray]:
    """Return what every peer is given of a case, see `peers/register.py`: the start pose is applied already."""
    curve = moved(framed(case.contour), case.T_start)
    near = prepared(cropped(case.scan, [curve], 1.5 * REACH_MM))
    chosen, _ = facing_rim(near.rim, curve, REACH_MM)
    surface, faces = _strip(case.contour, case.truth.path_part_mm)
    return {
        "path": apply(case.T_start, case.truth.path_part_mm),
        "surface": apply(case.T_start, surface),
        "faces": faces,
        "rim": _without_specks(near.rim.points_mm[chosen], LINKED_SPACINGS * near.spacing_mm),
        "scan": near.points_mm[nearest(near.points_mm, curve)[1] <= REACH_MM],
        "spacing": np.array(near.spacing_mm),
    }


def _without_specks(points_mm: np.ndarray, link_mm: float) -> np.ndarray:
    """Return the rim points of long pieces of rim, without those around outliers and chance holes of the scan."""
    pairs = cKDTree(points_mm).query_pairs(link_mm, output_type="ndarray")
    links = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points_mm), len(points_mm)))
    _, piece = sparse.csgraph.connected_components(links, directed=False)
    return points_mm[np.bincount(piece)[piece] >= SPECK * len(points_mm)]


def _strip(contour: Contour, path_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles of the nominal surface along a path: rows through the two rings of the contour."""
    curve = framed(contour)
    s_mm, _ = nearest(path_mm, curve)
    ring = coordinates(contour.ring_points_mm, curve)
    size = np.hypot(ring.inward_mm, ring.outward_mm)
    nodes = [(np.zeros(len(path_mm)), path_mm)]
    for rows in (size < 20.0, size >= 20.0):
        order = np.flatnonzero(rows)[np.argsort(ring.s_mm[rows])]
        known = np.column_stack([contour.ring_points_mm, size])[order]
        period = curve.length_mm if curve.closed else None
        at_path = np.stack([np.interp(s_mm, ring.s_mm[order], axis, period=period) for axis in known.T], axis=1)
        nodes.append((at_path[:, 3], at_path[:, :3]))
    vertices = np.concatenate([_parabola(nodes, depth) for depth in ROWS_MM])
    return vertices, _faces(len(path_mm), len(ROWS_MM), contour.closed)


def _parabola(nodes: list[tuple[np.ndarray, np.ndarray]], depth: float) -> np.ndarray:
    """Return the points at a depth on the parabolas through three points each (Lagrange)."""
    total = np.zeros_like(nodes[0][1])
    for i, (own, points) in enumerate(nodes):
        weight = np.ones(len(points))
        for other, _ in nodes[:i] + nodes[i + 1 :]:
            weight = weight * (depth - other) / (own - other)
        total += weight[:, None] * points
    return total


def _faces(columns: int, rows: int, closed: bool) -> np.ndarray:
    column, row = np.meshgrid(np.arange(columns if closed else columns - 1), np.arange(rows - 1))
    a, b = row * columns + column, row * columns + (column + 1) % columns
    quads = np.stack([a, b, b + columns, a + columns], axis=-1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def measured(peer: str, given: dict[str, np.ndarray], case: Case) -> dict[str, float | str]:
    """Run one peer on one case and measure its path; `seconds` of its registration alone, and its `version`.

    Raises
    ------
    NotMeasuredError
        If there is no result.
    """
    if not PYTHON.exists():
        raise NotMeasuredError("not installed; run make peers")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "in.npz", Path(folder) / "out.npz"
        np.savez(source, **given)
        try:
            done = subprocess.run(
                [PYTHON, CHILD, peer, source, target],
                capture_output=True,
                text=True,
                timeout=LIMIT_S,
                check=False,
                env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
            )
        except subprocess.TimeoutExpired:
            raise NotMeasuredError(f"no result within {LIMIT_S:g} s") from None
        if done.returncode or not target.exists():
            last = (done.stderr.strip().splitlines() or [f"ended with code {done.returncode}"])[-1]
            raise NotMeasuredError(last[:160])
        with np.load(target) as found:
            path, seconds, version = found["path"], float(found["seconds"]), str(found["version"])
    if not np.isfinite(path).all():
        raise NotMeasuredError("its result is not finite")
    return error(path, None, case.truth) | {"seconds": seconds, "version": version}
