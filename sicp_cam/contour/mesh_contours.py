"""Contours of a part that is known as triangles only: where its mesh is open, or where a closed one has edges."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import mesh_boundary_edges
from sicp_cam.contour.face_regions import face_regions
from sicp_cam.contour.frames import orthonormal
from sicp_cam.contour.loops import mesh_loops
from sicp_cam.model import Contour, FloatArray, IntArray, TriangleMesh

__all__ = ["mesh_contours"]

STEP_MM = 1.0
CORNER = np.radians(20.0)
RING_DEPTHS_MM = (10.0, 30.0)
RING_STEP_MM = 4.0
PIECE_MM = 8.0
CANDIDATES = 12
OFF_SURFACE_MM = 2.0
WELD_ULPS = 4.0
"""How far apart equal vertices may lie, in units of the last place of the largest coordinate as a 32-bit number."""
LEAST_LOOP_MM = 3.0
"""Shorter loops on a closed mesh are roughness; no tool goes around them."""


def mesh_contours(mesh: TriangleMesh) -> tuple[Contour, ...]:
    """Return the boundary loops of a mesh as contours, longest first.

    An open mesh ends at its open edges. A watertight one is taken apart where its surface turns by more than 30
    degrees, and each of these regions ends at its own edges: a plate with a hole gives the outline and the hole on
    either skin, and the edges of the walls between them, each with the normals of its own region.

    The sides of the polygon are followed exactly and sampled at steps of at most 1 mm; a tangent is smoothed over its
    neighbours except at corners. Normals are those of the faces at the boundary.

    Parameters
    ----------
    mesh
        Faces wound counter-clockwise as seen from outside, equal vertices merged. Boundary vertices that only the
        rounding of 32-bit numbers keeps apart count as equal. A watertight mesh may be inside out; it has no contour
        if it has no sharp edge.
    """
    mesh = _welded(mesh)
    face_normals = _face_normals(mesh)
    loops = [(index, closed) for index, closed in mesh_loops(mesh.faces) if len(index) >= 3]
    contours = [_contour(mesh, face_normals, index, closed) for index, closed in loops]
    if not contours and len(mesh.faces):
        return _region_contours(mesh)
    return tuple(sorted(contours, key=lambda contour: -contour.length_mm))


def _welded(mesh: TriangleMesh) -> TriangleMesh:
    """Close seams along which the vertices of two faces differ by rounding: they would seem to be open edges."""
    rim = np.unique(mesh_boundary_edges(mesh.faces))
    if not len(rim):
        return mesh
    points = mesh.vertices_mm[rim]
    reach = WELD_ULPS * float(np.spacing(np.float32(np.abs(mesh.vertices_mm).max())))
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    if not len(pairs):
        return mesh
    same = coo_array((np.ones(len(pairs), dtype=np.bool_), pairs.T), shape=(len(rim), len(rim)))
    _, label = connected_components(same, directed=False)
    _, first = np.unique(label, return_index=True)
    number = np.arange(len(mesh.vertices_mm))
    number[rim] = rim[first[label]]
    faces = number[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return TriangleMesh(mesh.vertices_mm, faces[whole], mesh.normals)


def _region_contours(mesh: TriangleMesh) -> tuple[Contour, ...]:
    contours = [
        _contour(region.mesh, region.normals, index, closed)
        for region in face_regions(mesh)
        for index, closed in mesh_loops(region.mesh.faces)
        if len(index) >= 3 and _way_around_mm(region.mesh, index) >= LEAST_LOOP_MM
    ]
    return tuple(sorted(contours, key=_order))


def _way_around_mm(mesh: TriangleMesh, index: IntArray) -> float:
    points = mesh.vertices_mm[index]
    return float(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum())


def _order(contour: Contour) -> tuple[float, ...]:
    """Return the sort key: longest first, then by position, rounded so that equal loops keep their order."""
    points = contour.points_mm
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    normal = contour.normals.mean(axis=0)
    return (-round(contour.length_mm, 3), *np.round(middle, 3).tolist(), *np.round(normal, 3).tolist())


def _contour(mesh: TriangleMesh, face_normals: FloatArray, index: IntArray, closed: bool) -> Contour:
    corners_mm = mesh.vertices_mm[index]
    vertex_normals = _vertex_normals(mesh, face_normals, index)
    ends = np.roll(np.arange(len(index)), -1) if closed else np.arange(1, len(index))
    starts = np.arange(len(ends))
    sides = corners_mm[ends] - corners_mm[starts]
    lengths = np.linalg.norm(sides, axis=1)
    counts = np.maximum(1, np.ceil(lengths / STEP_MM).astype(np.int64))
    side = np.repeat(starts, counts)
    t = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
    points = corners_mm[side] + t[:, None] * sides[side]
    normals = vertex_normals[side] * (1.0 - t[:, None]) + vertex_normals[ends[side]] * t[:, None]
    tangents, corners = _tangents(sides / lengths[:, None], side, t, closed)
    if not closed:
        points = np.vstack([points, corners_mm[-1:]])
        normals = np.vstack([normals, vertex_normals[-1:]])
        tangents = np.vstack([tangents, tangents[-1:]])
    T, B, N = orthonormal(tangents, normals)
    ring_points, ring_normals = _rings(mesh, face_normals, points, B, N)
    return Contour(points, T, N, closed, corners, ring_points, ring_normals)


def _tangents(directions: FloatArray, side: IntArray, t: FloatArray, closed: bool) -> tuple[FloatArray, IntArray]:
    """Return the tangent at each sample, turning evenly from mid-side to mid-side, and the corners."""
    before, after = np.roll(directions, 1, axis=0), np.roll(directions, -1, axis=0)
    if not closed:
        before[0], after[-1] = directions[0], directions[-1]
    sharp = np.arccos(np.clip(np.sum(before * directions, axis=1), -1.0, 1.0)) > CORNER
    before = np.where(sharp[:, None], directions, before)
    after = np.where(np.roll(sharp, -1)[:, None], directions, after)
    t = t[:, None]
    towards = np.where(t < 0.5, (0.5 - t) * before[side], (t - 0.5) * after[side])
    tangents = towards + np.where(t < 0.5, 0.5 + t, 1.5 - t) * directions[side]
    corners = np.flatnonzero(sharp[side] & (t[:, 0] == 0.0))
    bisectors = np.roll(directions, 1, axis=0)[side[corners]] + directions[side[corners]]
    tangents[corners] = bisectors
    return tangents, corners


def _face_normals(mesh: TriangleMesh) -> FloatArray:
    a, b, c = (mesh.vertices_mm[mesh.faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    normals: FloatArray = across / np.where(length > 0.0, length, 1.0)
    return normals


def _vertex_normals(mesh: TriangleMesh, face_normals: FloatArray, index: IntArray) -> FloatArray:
    """Return the mean normal of the faces around each of the given vertices."""
    total = np.zeros_like(mesh.vertices_mm)
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], face_normals)
    chosen = total[index]
    normals: FloatArray = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return normals


def _rings(
    mesh: TriangleMesh, face_normals: FloatArray, points: FloatArray, B: FloatArray, N: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return points of the mesh about 10 and 30 mm inside the material, and the normals of their faces."""
    import trimesh  # slow to load, and only parts without exact contours need it

    every = max(1, round(RING_STEP_MM / STEP_MM))
    wanted = np.concatenate([points[::every] + depth * B[::every] for depth in RING_DEPTHS_MM])
    outward = np.concatenate([N[::every]] * len(RING_DEPTHS_MM))
    low, high = wanted.min(axis=0) - PIECE_MM, wanted.max(axis=0) + PIECE_MM
    corners = mesh.vertices_mm[mesh.faces]
    near = np.flatnonzero(((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1))
    if not len(near):
        return np.zeros((0, 3)), np.zeros((0, 3))
    vertices, faces, owner = trimesh.remesh.subdivide_to_size(
        mesh.vertices_mm, mesh.faces[near], PIECE_MM, max_iter=40, return_index=True
    )
    pieces, owner = vertices[faces], near[owner]
    count = min(CANDIDATES, len(pieces))
    _, candidate = cKDTree(pieces.mean(axis=1)).query(wanted, k=count)
    candidate = candidate.reshape(len(wanted), count)
    feet = trimesh.triangles.closest_point(pieces[candidate.ravel()], np.repeat(wanted, count, axis=0))
    feet = feet.reshape(len(wanted), count, 3)
    best = np.argmin(np.linalg.norm(feet - wanted[:, None], axis=2), axis=1)
    rows = np.arange(len(wanted))
    foot, normal = feet[rows, best], face_normals[owner[candidate[rows, best]]]
    # Beyond the far edge of a narrow strip the nearest place is an edge, not the surface under the point.
    aside = foot - wanted - np.sum((foot - wanted) * normal, axis=1, keepdims=True) * normal
    kept = (np.linalg.norm(aside, axis=1) < OFF_SURFACE_MM) & (np.sum(normal * outward, axis=1) > 0.5)
    return foot[kept], normal[kept]
