"""How far scan points lie out of a tessellated nominal surface, for the picture of the deviations.

Only the skin that faces outward counts: a thin part has a second skin a few millimetres below, and a sagging scan can
lie nearer to that one. Between the vertices the surface is curved as their normals say, else the sag of the triangles
would show as a deviation of the scan.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.model import FloatArray, IntArray, TriangleMesh

__all__ = ["out_of_surface"]

_CANDIDATES = 16
_SLACK = 0.15


def out_of_surface(
    points_mm: FloatArray,
    mesh: TriangleMesh,
    station_points_mm: FloatArray,
    station_outward: FloatArray,
    *,
    reach_mm: float = 60.0,
    piece_mm: float = 8.0,
) -> FloatArray:
    """Return the signed distance of each point out of the surface, along the normal of the triangle that it is over.

    Triangles are cut into pieces no longer than `piece_mm` to find the one that a point projects into. With vertex
    normals the surface over a triangle is Phong tessellation with alpha = 1/2 (Boubekeur and Alexa 2008), which is
    exact for quadratic surfaces; without them the triangles are taken as they are.

    Parameters
    ----------
    points_mm
        (n, 3) scan points, in the frame of the mesh.
    mesh
        Triangles wound so that their normals point outward.
    station_points_mm, station_outward
        (k, 3) stations of the contours and the outward normals there: they say which skin is the outer one.
    reach_mm
        Largest distance that still counts.

    Returns
    -------
    FloatArray
        (n,) millimetres, positive outward; NaN for points with no outer skin under them.

    >>> square = TriangleMesh(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]), [[0, 1, 2], [0, 2, 3]])
    >>> up = np.array([[0.0, 0, 1]])
    >>> out_of_surface(np.array([[5.0, 5, 0.5]]), square, square.vertices_mm[:1], up).round(6).tolist()
    [0.5]
    """
    out = np.full(len(points_mm), np.nan)
    if len(points_mm) == 0 or len(mesh.faces) == 0 or len(station_points_mm) == 0:
        return out
    faces = _facing_out(mesh, station_points_mm, station_outward)
    corners = mesh.vertices_mm[faces]
    normals = None if mesh.normals is None else mesh.normals[faces]
    pieces, parents = _pieces_near(corners, cKDTree(points_mm), reach_mm, piece_mm)
    if len(pieces) == 0:
        return out
    count = min(_CANDIDATES, len(pieces))
    near = cKDTree(pieces.mean(axis=1)).query(points_mm, k=count)[1].reshape(len(points_mm), count)
    height = np.full(near.shape, np.inf)
    for column in range(count):
        piece = near[:, column]
        inside = np.flatnonzero(_barycentric(points_mm, pieces[piece]).min(axis=1) >= -_SLACK)
        parent = parents[piece[inside]]
        bend = None if normals is None else normals[parent]
        height[inside, column] = _height(points_mm[inside], corners[parent], bend)
    chosen = height[np.arange(len(height)), np.argmin(np.abs(height), axis=1)]
    found = np.abs(chosen) <= reach_mm
    out[found] = chosen[found]
    return out


def _facing_out(mesh: TriangleMesh, stations: FloatArray, outward: FloatArray) -> IntArray:
    """Return the faces, if they have an area, that look to the same side as the nearest station."""
    corners = mesh.vertices_mm[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    _, nearest = cKDTree(stations).query(corners.mean(axis=1))
    facing: IntArray = mesh.faces[(np.sum(across * outward[nearest], axis=1) > 0.3 * area) & (area > 1e-9)]
    return facing


def _pieces_near(
    triangles: FloatArray, points: cKDTree, reach_mm: float, piece_mm: float
) -> tuple[FloatArray, IntArray]:
    """Halve triangles at their longest edges until they are small, keeping pieces within reach of a point.

    Returns the (p, 3, 3) pieces and the (p,) triangles that they are part of.
    """
    done, owners = [triangles[:0]], [np.zeros(0, np.int64)]
    left, parents = triangles, np.arange(len(triangles))
    while len(left):
        edges = np.linalg.norm(np.roll(left, -1, axis=1) - left, axis=2)
        longest = edges.max(axis=1)
        distance, _ = points.query(left.mean(axis=1))
        kept = distance <= reach_mm + longest
        small = longest <= piece_mm
        done.append(left[kept & small])
        owners.append(parents[kept & small])
        left, parents = _halved(left[kept & ~small], edges[kept & ~small]), np.tile(parents[kept & ~small], 2)
    return np.concatenate(done), np.concatenate(owners)


def _halved(triangles: FloatArray, edges: FloatArray) -> FloatArray:
    first = np.argmax(edges, axis=1)
    row = np.arange(len(triangles))
    a, b, c = (triangles[row, (first + turn) % 3] for turn in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _barycentric(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return (n, 3) barycentric coordinates of each point projected on the plane of its triangle."""
    u, v, w = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], points - triangles[:, 0]
    across: FloatArray = np.cross(u, v)
    square = np.sum(across**2, axis=1)
    beta = np.sum(np.cross(w, v) * across, axis=1) / square
    gamma = np.sum(np.cross(u, w) * across, axis=1) / square
    return np.stack([1.0 - beta - gamma, beta, gamma], axis=1)


def _height(points: FloatArray, triangles: FloatArray, normals: FloatArray | None) -> FloatArray:
    """Return (n,) heights over the surface that the triangles stand for, along the normals of their planes."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    across = across / np.linalg.norm(across, axis=1, keepdims=True)
    height: FloatArray = np.sum((points - triangles[:, 0]) * across, axis=1)
    if normals is None:
        return height
    weights = _barycentric(points, triangles)
    foot = points - height[:, None] * across
    to_tangent_plane = np.sum((triangles - foot[:, None]) * normals, axis=2)
    bulge = 0.5 * np.sum(weights * to_tangent_plane * np.sum(normals * across[:, None], axis=2), axis=1)
    lowered: FloatArray = height - bulge
    return lowered
