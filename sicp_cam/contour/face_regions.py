"""The faces of a closed mesh, as a CAD system would tell them apart: they end where the surface turns sharply."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sicp_cam.model import BoolArray, FloatArray, IntArray, TriangleMesh

__all__ = ["Region", "face_regions"]

SHARP = np.radians(30.0)
"""Turn of the normal from which an edge bounds a face; facets of a bore turn by less, the bore from its plate by 90."""
SLIVER = 1e-6
"""Height of a triangle, over the largest coordinate, below which rounding decides which way its normal points."""
ROUGH_REGIONS = 50
"""More regions than this of which most are single triangles tell of a rough surface, not of edges."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """One face of the part: its triangles with the vertices they use, and a unit normal for each triangle."""

    mesh: TriangleMesh
    normals: FloatArray


def face_regions(mesh: TriangleMesh) -> tuple[Region, ...]:
    """Return the regions of a closed mesh between edges at which it turns by more than 30 degrees.

    Returns
    -------
    tuple of Region
        Wound counter-clockwise from outside, even if the mesh is inside out. None if there is no such edge, or if most
        regions are single triangles, as noise makes them.
    """
    faces = mesh.faces[:, ::-1] if _signed_volume(mesh) < 0.0 else mesh.faces
    first, second = _neighbours(faces)
    normals = _normals(mesh.vertices_mm, faces, first, second)
    # arctan2 keeps angles apart that are near 0 or 180 degrees
    sine = np.linalg.norm(np.cross(normals[first], normals[second]), axis=1)
    sharp = np.arctan2(sine, np.sum(normals[first] * normals[second], axis=1)) > SHARP
    label = _joined(len(faces), first[~sharp], second[~sharp])
    sizes = np.bincount(label)
    if not sharp.any() or (len(sizes) > ROUGH_REGIONS and np.mean(sizes == 1) > 0.5):
        return ()
    order = np.argsort(label, kind="stable")
    cuts = np.flatnonzero(np.diff(label[order])) + 1
    return tuple(_region(mesh.vertices_mm, faces, normals, rows) for rows in np.split(order, cuts))


def _region(vertices_mm: FloatArray, faces: IntArray, normals: FloatArray, rows: IntArray) -> Region:
    used, corners = np.unique(faces[rows], return_inverse=True)
    return Region(TriangleMesh(vertices_mm[used], corners.reshape(-1, 3)), normals[rows])


def _signed_volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices_mm - mesh.vertices_mm.mean(axis=0))[mesh.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)))


def _neighbours(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of faces that share an edge, the edges of two faces only."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    new = np.concatenate([[True], (np.diff(edges[order], axis=0) != 0).any(axis=1)])
    starts = np.flatnonzero(new)
    pairs = starts[np.diff(np.append(starts, len(order))) == 2]
    return order[pairs] // 3, order[pairs + 1] // 3


def _normals(vertices_mm: FloatArray, faces: IntArray, first: IntArray, second: IntArray) -> FloatArray:
    """Return unit normals; a sliver, which has none of its own, takes that of the largest neighbour."""
    a, b, c = vertices_mm[faces].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    area = np.linalg.norm(across, axis=1)
    longest = np.sqrt(np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    unsure = area <= SLIVER * np.abs(vertices_mm).max() * longest
    normals: FloatArray = across / np.where(area > 0.0, area, 1.0)[:, None]
    while unsure.any():
        known = _known_neighbours(unsure, first, second)
        if not len(known):
            break  # nothing but slivers
        best = known[np.lexsort((area[known[:, 1]], known[:, 0]))]
        last = np.append(np.diff(best[:, 0]) != 0, True)
        sliver, neighbour = best[last].T
        normals[sliver], area[sliver] = normals[neighbour], area[neighbour]
        unsure[sliver] = False
    return normals


def _known_neighbours(unsure: BoolArray, first: IntArray, second: IntArray) -> IntArray:
    """Return (k, 2) pairs of a face without and its neighbour with a sure normal."""
    pairs = np.concatenate([np.stack([first, second], axis=1), np.stack([second, first], axis=1)])
    known: IntArray = pairs[unsure[pairs[:, 0]] & ~unsure[pairs[:, 1]]]
    return known


def _joined(count: int, first: IntArray, second: IntArray) -> IntArray:
    links = coo_array((np.ones(len(first), dtype=np.bool_), (first, second)), shape=(count, count))
    _, label = connected_components(links, directed=False)
    labels: IntArray = label.astype(np.int64)
    return labels
