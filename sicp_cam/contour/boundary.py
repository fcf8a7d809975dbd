"""Where a scan ends: boundary edges of a mesh, and the points of a cloud that lie at its rim."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = [
    "LocalPlanes",
    "Rim",
    "cloud_rim",
    "local_planes",
    "mesh_boundary_edges",
    "mesh_rim",
    "surface_normals",
    "without",
]

Array = TypeVar("Array", FloatArray, IntArray)

NEIGHBOURS = 16
OPEN_ANGLE = np.radians(120.0)
"""A point whose neighbours leave a sector wider than this open lies at the rim."""


@dataclass(frozen=True, slots=True, eq=False)
class Rim:
    """Points at the rim of a scan.

    Parameters
    ----------
    indices
        (m,) indices into the scan's points.
    points_mm
        (m, 3) the points.
    open_directions
        (m, 3) unit vectors in the surface towards the side that holds no points.
    """

    indices: IntArray
    points_mm: FloatArray
    open_directions: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LocalPlanes:
    """The plane of each of n points and its neighbours.

    Parameters
    ----------
    neighbours, distances_mm
        (n, k) indices, the point itself first, and how far they are.
    normals, centres_mm
        (n, 3) unit normals of arbitrary side, and centroids.
    radii_mm
        (n,) distance of the furthest neighbour from the centroid.
    """

    neighbours: IntArray
    distances_mm: FloatArray
    normals: FloatArray
    centres_mm: FloatArray
    radii_mm: FloatArray


def mesh_boundary_edges(faces: IntArray) -> IntArray:
    """Return the (e, 2) directed edges that only one face has, with that face on the left.

    >>> mesh_boundary_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [[0, 1], [1, 3], [2, 0], [3, 2]]
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    key = low * (int(edges.max(initial=0)) + 1) + high
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    single: IntArray = edges[first[count == 1]]
    return single[np.lexsort((single[:, 1], single[:, 0]))]


def mesh_rim(vertices_mm: FloatArray, faces: IntArray) -> Rim:
    """Return the vertices on the boundary of a mesh; the open side of each lies away from its faces."""
    edges = mesh_boundary_edges(faces)
    indices = np.unique(edges)
    outward = np.zeros_like(vertices_mm)
    rim_faces = faces[np.isin(faces, indices).any(axis=1)]
    centres = vertices_mm[rim_faces].mean(axis=1)
    for corner in range(3):
        np.add.at(outward, rim_faces[:, corner], vertices_mm[rim_faces[:, corner]] - centres)
    along = np.zeros_like(vertices_mm)
    step = vertices_mm[edges[:, 1]] - vertices_mm[edges[:, 0]]
    np.add.at(along, edges[:, 0], step)
    np.add.at(along, edges[:, 1], step)
    T = _unit(along[indices])
    away = outward[indices]
    return Rim(indices, vertices_mm[indices], _unit(away - np.sum(away * T, axis=1, keepdims=True) * T))


def surface_normals(neighbours_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit a plane to each of n groups of k neighbouring points, given as (n, k, 3).

    Returns
    -------
    normals, centres
        (n, 3) unit normals of arbitrary side, and (n, 3) centroids.
    """
    centres = neighbours_mm.mean(axis=1)
    spread = neighbours_mm - centres[:, None]
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", spread, spread))
    return vectors[:, :, 0], centres


def local_planes(points_mm: FloatArray, tree: cKDTree) -> LocalPlanes:
    """Fit a plane to each of (n, 3) points and its neighbours."""
    distances, near = tree.query(points_mm, k=min(NEIGHBOURS + 1, len(points_mm)), workers=-1)
    return _planes(points_mm, near, distances)


def without(planes: LocalPlanes, points_mm: FloatArray, tree: cKDTree, dropped: BoolArray) -> LocalPlanes:
    """Return the planes of the points that are not dropped, as if the dropped ones had never been there.

    Parameters
    ----------
    planes
        Of all n points.
    points_mm, tree
        (m, 3) points that are left, and their k-d tree.
    dropped
        (n,) True for the others.
    """
    if len(points_mm) < planes.neighbours.shape[1]:
        return local_planes(points_mm, tree)  # so few that each has fewer neighbours now
    number = np.cumsum(~dropped) - 1
    touched = np.any(dropped[planes.neighbours[~dropped]], axis=1)
    distances, near = tree.query(points_mm[touched], k=min(planes.neighbours.shape[1], len(points_mm)))
    anew = _planes(points_mm, near, distances)

    def renewed(values: Array, new: Array) -> Array:
        kept: Array = values[~dropped]
        kept[touched] = new
        return kept

    return LocalPlanes(
        renewed(number[planes.neighbours], anew.neighbours),
        renewed(planes.distances_mm, anew.distances_mm),
        renewed(planes.normals, anew.normals),
        renewed(planes.centres_mm, anew.centres_mm),
        renewed(planes.radii_mm, anew.radii_mm),
    )


def _planes(points_mm: FloatArray, near: IntArray, distances_mm: FloatArray) -> LocalPlanes:
    groups = points_mm[near]
    normals, centres = surface_normals(groups)
    away = groups - centres[:, None]
    radii = np.sqrt(np.einsum("nki,nki->nk", away, away).max(axis=1, initial=0.0))
    return LocalPlanes(near, distances_mm, normals, centres, radii)


def cloud_rim(points_mm: FloatArray, planes: LocalPlanes) -> Rim:
    """Find the rim of an (n, 3) cloud by the open angle that a point's neighbours leave in its tangent plane.

    No two points may be equal: copies would take the places of neighbours and have no direction.
    """
    offsets = points_mm[planes.neighbours[:, 1:]] - points_mm[:, None]
    N = planes.normals
    first = _unit(np.cross(N, _least_aligned_axis(N)))
    second = np.cross(N, first)
    angle = np.sort(
        np.arctan2(np.einsum("nki,ni->nk", offsets, second), np.einsum("nki,ni->nk", offsets, first)), axis=1
    )
    gaps = np.diff(np.concatenate([angle, angle[:, :1] + 2.0 * np.pi], axis=1), axis=1)
    widest = np.argmax(gaps, axis=1)
    rows = np.arange(len(points_mm))
    middle = angle[rows, widest] + 0.5 * gaps[rows, widest]
    open_side = np.cos(middle)[:, None] * first + np.sin(middle)[:, None] * second
    rim = gaps[rows, widest] > OPEN_ANGLE
    return Rim(np.flatnonzero(rim), points_mm[rim], open_side[rim])


def _least_aligned_axis(N: FloatArray) -> FloatArray:
    axes: FloatArray = np.eye(3)[np.argmin(np.abs(N), axis=1)]
    return axes


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: FloatArray = vectors / np.where(length > 0.0, length, 1.0)
    return unit
