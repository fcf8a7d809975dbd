"""Tessellate a CAD shape for pictures and coarse distances, with exact vertex normals.

The kernel's linear tolerance alone does not bound the sag; on gently curved faces the angular one decides. So the sag
is measured, and where it is too large the mesh is made again, finer. Contours never come from here.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from sicp_cam.model import FloatArray, IntArray
from sicp_formats.cad.faces import Body, Face, distinct, outward_normals

__all__ = ["FaceMesh", "joined", "signed_volume", "stored", "tessellate"]

LINEAR_MM = 0.4
ANGULAR_RAD = 0.3
LARGEST_SAG_MM = 0.5
MOST_TRIANGLES = 60_000
"""The mesh is not refined where it would get many more triangles than this."""
LEAST_GAIN, PATIENCE = 0.9, 4
"""Nor where making it finer so many times has left more than this share of the sag."""
SAG_SAMPLES = 200
SAME_VERTEX_MM = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class FaceMesh:
    """Triangles of one face, turned outward.

    Parameters
    ----------
    vertices_mm, normals, uv
        (n, 3), (n, 3) and (n, 2): on the exact surface, with its normals; nan where the surface has none (a pole).
    triangles
        (m, 3) indices into the vertices, counter-clockwise as seen from outside.
    """

    vertices_mm: FloatArray
    normals: FloatArray
    uv: FloatArray
    triangles: IntArray

    def turned(self) -> FaceMesh:
        """Return the mesh with its other side outward."""
        return FaceMesh(self.vertices_mm, -self.normals, self.uv, self.triangles[:, ::-1])


def tessellate(shape: Any, bodies: list[Body]) -> tuple[list[list[FaceMesh | None]], float]:
    """Return a mesh for each face of each body, and the largest sag that was measured, in mm.

    A face that the kernel cannot tessellate has None.
    """
    angular = ANGULAR_RAD
    sags = [np.inf] * PATIENCE
    while True:
        BRepMesh_IncrementalMesh(shape, LINEAR_MM, False, angular, False)
        meshes = [[_face_mesh(face) for face in body.faces] for body in bodies]
        sag = max(
            (
                _sag(f, m)
                for body, row in zip(bodies, meshes, strict=True)
                for f, m in zip(body.faces, row, strict=True)
                if m
            ),
            default=0.0,
        )
        finer = angular * np.sqrt(0.7 * LARGEST_SAG_MM / max(sag, 1e-12))
        triangles = sum(len(mesh.triangles) for row in meshes for mesh in row if mesh)
        # On a damaged face the sag stays, however fine the mesh.
        hopeless = sag > LEAST_GAIN * sags[-PATIENCE] or triangles * angular / finer > MOST_TRIANGLES
        if sag <= LARGEST_SAG_MM or hopeless:
            return meshes, sag
        angular = float(finer)
        sags.append(sag)
        BRepTools.Clean_s(shape)


def signed_volume(meshes: Iterable[FaceMesh]) -> float:
    """Return the volume that closed, outward triangles enclose, in mm^3; negative if they face inward."""
    total = 0.0
    for mesh in meshes:
        a, b, c = np.moveaxis(mesh.vertices_mm[mesh.triangles], 1, 0)
        total += float(np.sum(a * np.cross(b, c)) / 6.0)
    return total


def joined(skins: Iterable[list[FaceMesh]]) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return vertices (n, 3), triangles (m, 3) and unit normals (n, 3) of all skins as one mesh.

    Vertices are shared within a skin and not between skins, so that sharp edges stay sharp and the open edges of the
    mesh are the boundaries of the skins.
    """
    vertices: list[FloatArray] = [np.zeros((0, 3))]
    normals: list[FloatArray] = [np.zeros((0, 3))]
    triangles: list[IntArray] = [np.zeros((0, 3), dtype=np.int64)]
    count = 0
    for meshes in skins:
        skin_vertices, skin_triangles, skin_normals = _welded(meshes)
        vertices.append(skin_vertices)
        normals.append(skin_normals)
        triangles.append(skin_triangles + count)
        count += len(skin_vertices)
    return np.vstack(vertices), np.vstack(triangles), np.vstack(normals)


def stored(shape: Any) -> list[FaceMesh]:
    """Return the triangles of the faces that have triangles only, and no surface."""
    faces = (TopoDS.Face_s(face) for face in distinct(shape, TopAbs_ShapeEnum.TopAbs_FACE))
    meshes = []
    for face in faces:
        location = TopLoc_Location()
        known = BRep_Tool.Triangulation_s(face, location) if BRep_Tool.Surface_s(face) is None else None
        if known is not None and known.NbTriangles():
            side = -1 if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else 1
            vertices, triangles = _triangles(known, location, side)
            meshes.append(FaceMesh(vertices, np.full_like(vertices, np.nan), np.zeros((len(vertices), 2)), triangles))
    return meshes


def _face_mesh(face: Face) -> FaceMesh | None:
    location = TopLoc_Location()
    known = BRep_Tool.Triangulation_s(face.shape, location)
    if known is None or not known.HasUVNodes():
        return None
    uv = np.array([(p.X(), p.Y()) for p in map(known.UVNode, range(1, known.NbNodes() + 1))]).reshape(-1, 2)
    vertices, triangles = _triangles(known, location, face.side)
    return FaceMesh(vertices, outward_normals(face, uv), uv, triangles)


def _triangles(known: Any, location: Any, side: int) -> tuple[FloatArray, IntArray]:
    """Return the vertices (n, 3) of a triangulation where they are, and its triangles (m, 3) turned outward."""
    nodes = np.array([(p.X(), p.Y(), p.Z()) for p in map(known.Node, range(1, known.NbNodes() + 1))]).reshape(-1, 3)
    numbers = [known.Triangle(i).Get() for i in range(1, known.NbTriangles() + 1)]
    triangles = np.array(numbers, dtype=np.int64).reshape(-1, 3)[:, ::side] - 1
    motion = location.Transformation()
    matrix = np.array([[motion.Value(i, j) for j in range(1, 5)] for i in range(1, 4)])
    return nodes @ matrix[:, :3].T + matrix[:, 3], triangles


def _sag(face: Face, mesh: FaceMesh) -> float:
    """Return the largest distance of the surface from the triangles, at the middle of a sample of them."""
    chosen = mesh.triangles[:: max(1, len(mesh.triangles) // SAG_SAMPLES)]
    a, b, c = np.moveaxis(mesh.vertices_mm[chosen], 1, 0)
    across = np.cross(b - a, c - a)
    size = np.linalg.norm(across, axis=1)
    flat = size > 0.0
    middles = mesh.uv[chosen].mean(axis=1)[flat]
    on_surface = [face.surface.Value(u, v) for u, v in middles.tolist()]
    points = np.array([(p.X(), p.Y(), p.Z()) for p in on_surface]).reshape(-1, 3)
    distances = np.abs(np.sum((points - a[flat]) * across[flat], axis=1)) / size[flat]
    return float(distances.max(initial=0.0))


def _welded(meshes: list[FaceMesh]) -> tuple[FloatArray, IntArray, FloatArray]:
    starts = np.cumsum([0, *(len(mesh.vertices_mm) for mesh in meshes)])
    vertices = np.vstack([mesh.vertices_mm for mesh in meshes])
    triangles = np.vstack([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)])
    keys = np.round(vertices / SAME_VERTEX_MM).astype(np.int64)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    triangles = group.reshape(-1)[triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    sums = np.zeros((len(first), 3))
    np.add.at(sums, group.reshape(-1), np.nan_to_num(np.vstack([mesh.normals for mesh in meshes])))
    normals = _with_triangle_normals(sums, vertices[first], triangles)
    return vertices[first], triangles, normals


def _with_triangle_normals(sums: FloatArray, vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Scale normals to unit length; a vertex without one gets the mean of its triangles', or z if it has none."""
    size = np.linalg.norm(sums, axis=1, keepdims=True)
    if (size < 1e-6).any():
        a, b, c = np.moveaxis(vertices[triangles], 1, 0)
        areas = np.zeros_like(sums)
        np.add.at(areas, triangles.reshape(-1), np.repeat(np.cross(b - a, c - a), 3, axis=0))
        areas[~areas.any(axis=1)] = 0.0, 0.0, 1.0
        sums = np.where(size < 1e-6, areas, sums)
        size = np.linalg.norm(sums, axis=1, keepdims=True)
    unit: FloatArray = sums / size
    return unit
