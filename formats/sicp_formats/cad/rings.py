"""Find stability points: exact points of a skin some way inside the material from a loop.

Runs in the child process only: it evaluates the CAD kernel's surfaces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.TopAbs import TopAbs_State

from sicp_cam.model import FloatArray, IntArray
from sicp_formats.cad.faces import Body, Face
from sicp_formats.cad.mesh import FaceMesh
from sicp_formats.cad.sampling import SampledLoop, unit
from sicp_formats.cad.skins import Skin

__all__ = ["RINGS_MM", "SkinSurface", "ring_points", "skin_surface"]

RINGS_MM = (10.0, 30.0)
STATION_MM = 4.0
BENT_AWAY = 1.0 / 3.0
"""A ring point is left out where the surface bends away from the tangent plane by more than this part of the ring."""
SAME_SIDE = 0.5
"""Least cosine between the normals of a ring point and of its place on the loop; the other skin is no candidate."""
FOOT_MM = 1e-7
ITERATIONS = 30
HINTS = 400
"""At most this many mesh vertices of a face serve as places to start from."""
_INSIDE = (TopAbs_State.TopAbs_IN, TopAbs_State.TopAbs_ON)


@dataclass(frozen=True, slots=True, eq=False)
class SkinSurface:
    """The faces of a skin with what projection to them needs.

    Parameters
    ----------
    faces, insides
        Each face by its index in the body, and the kernel's test whether a (u, v) lies within its wires.
    hints
        Places from where to look for a foot: mesh vertices with their normals, uv and faces; and for each of the
        faces its index and the corners of its box. None for a skin of one face, which needs none.
    """

    faces: Mapping[int, Face]
    insides: Mapping[int, Any]
    hints: _Hints | None


@dataclass(frozen=True, slots=True, eq=False)
class _Hints:
    points: FloatArray
    normals: FloatArray
    uv: FloatArray
    face: IntArray
    box_face: IntArray
    box_low: FloatArray
    box_high: FloatArray


def skin_surface(body: Body, skin: Skin, meshes: list[FaceMesh | None]) -> SkinSurface:
    """Prepare a skin for `ring_points`."""
    faces = {index: body.faces[index] for index in skin.faces}
    insides = {index: BRepTopAdaptor_FClass2d(face.shape, 1e-9) for index, face in faces.items()}
    return SkinSurface(faces, insides, _hints(skin.faces, meshes))


def ring_points(loop: SampledLoop, surface: SkinSurface) -> tuple[FloatArray, FloatArray]:
    """Return stability points (q, 3) on the exact skin, and their outward normals (q, 3).

    From stations about `STATION_MM` apart, a point each of `RINGS_MM` inside the material in the tangent plane is
    projected to the nearest point of the skin. Points whose foot is not within a face of the same skin are left out,
    and so are those where the surface bends away (see `BENT_AWAY`).
    """
    stations = _stations(loop)
    inward = unit(np.cross(loop.normals[stations], loop.tangents[stations]))
    points, normals = [], []
    for ring in RINGS_MM:
        for station, target in zip(stations, loop.points_mm[stations] + ring * inward, strict=True):
            start = int(loop.face[station]), loop.uv[station]
            foot = _foot_on_skin(surface, target, loop.normals[station], start, BENT_AWAY * ring)
            if foot is not None:
                points.append(foot[0])
                normals.append(foot[1])
    return np.array(points).reshape(-1, 3), np.array(normals).reshape(-1, 3)


def _stations(loop: SampledLoop) -> Any:
    """Return indices of samples that are about `STATION_MM` apart along the loop."""
    around = np.vstack([loop.points_mm, loop.points_mm[:1]]) if loop.closed else loop.points_mm
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(around, axis=0), axis=1))])
    count = max(1, round(arc[-1] / STATION_MM))
    wanted = np.linspace(0.0, arc[-1], count, endpoint=False)
    return np.unique(np.searchsorted(arc[: len(loop.points_mm)], wanted).clip(max=len(loop.points_mm) - 1))


def _foot_on_skin(
    surface: SkinSurface, target: FloatArray, normal: FloatArray, start: tuple[int, FloatArray], reach: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return the foot of a target within `reach` on the skin, and the normal there.

    The face of the loop is tried first, from the loop itself; then the others, from a mesh vertex near the target.
    """
    for index, uv in [start, *_other_starts(surface.hints, target, normal, start[0], reach)]:
        face = surface.faces[index]
        found = _foot(face, uv, target)
        if found is None:
            continue
        foot, foot_normal, foot_uv = found
        near = np.linalg.norm(foot - target) <= reach and foot_normal @ normal >= SAME_SIDE
        if near and surface.insides[index].Perform(gp_Pnt2d(*foot_uv)) in _INSIDE:
            return foot, foot_normal
    return None


def _hints(members: tuple[int, ...], meshes: list[FaceMesh | None]) -> _Hints | None:
    known = [(index, mesh) for index in members if (mesh := meshes[index]) is not None and len(mesh.vertices_mm)]
    if len(members) < 2 or not known:
        return None
    thinned = [(i, mesh, slice(None, None, max(1, len(mesh.vertices_mm) // HINTS))) for i, mesh in known]
    return _Hints(
        points=np.vstack([mesh.vertices_mm[some] for _, mesh, some in thinned]),
        normals=np.vstack([mesh.normals[some] for _, mesh, some in thinned]),
        uv=np.vstack([mesh.uv[some] for _, mesh, some in thinned]),
        face=np.concatenate([np.full(len(mesh.uv[some]), index) for index, mesh, some in thinned]),
        box_face=np.array([index for index, _ in known]),
        box_low=np.array([mesh.vertices_mm.min(axis=0) for _, mesh in known]),
        box_high=np.array([mesh.vertices_mm.max(axis=0) for _, mesh in known]),
    )


def _other_starts(
    hints: _Hints | None, target: FloatArray, normal: FloatArray, own: int, reach: float
) -> Iterator[tuple[int, FloatArray]]:
    """Yield faces that the target may lie on with a place to start from, nearest first."""
    if hints is None:
        return
    within = ((hints.box_low - reach <= target) & (target <= hints.box_high + reach)).all(axis=1)
    candidates = np.setdiff1d(hints.box_face[within], [own])
    if not len(candidates):
        return
    usable = np.flatnonzero(np.isin(hints.face, candidates) & (hints.normals @ normal >= SAME_SIDE))
    usable = usable[np.argsort(np.linalg.norm(hints.points[usable] - target, axis=1), kind="stable")]
    _, nearest = np.unique(hints.face[usable], return_index=True)
    for place in usable[np.sort(nearest)]:
        yield int(hints.face[place]), hints.uv[place]


def _foot(face: Face, uv: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, tuple[float, float]] | None:
    """Return the point of a face's surface nearest to a target, with its normal and uv, by Gauss-Newton from a start.

    None where the iteration comes to rest on the border of the face's parameter range, or not at all: the nearest
    point is then off the face.
    """
    surface, (u, v), (x, y, z) = face.surface, uv.tolist(), target.tolist()
    range_u = surface.FirstUParameter(), surface.LastUParameter(), surface.IsUPeriodic(), surface.IsUClosed()
    range_v = surface.FirstVParameter(), surface.LastVParameter(), surface.IsVPeriodic(), surface.IsVClosed()
    point, along_u, along_v = gp_Pnt(), gp_Vec(), gp_Vec()
    for _ in range(ITERATIONS):
        surface.D1(u, v, point, along_u, along_v)
        ux, uy, uz = along_u.X(), along_u.Y(), along_u.Z()
        vx, vy, vz = along_v.X(), along_v.Y(), along_v.Z()
        rx, ry, rz = x - point.X(), y - point.Y(), z - point.Z()
        a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
        determinant = a * c - b * b
        if not determinant > 1e-12 * a * c:
            return None
        e, f = ux * rx + uy * ry + uz * rz, vx * rx + vy * ry + vz * rz
        du, dv = (e * c - f * b) / determinant, (a * f - b * e) / determinant
        if a * du * du + c * dv * dv < FOOT_MM**2:
            normal = face.side * np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
            return np.array([point.X(), point.Y(), point.Z()]), normal / np.sqrt(determinant), (u, v)
        next_u, next_v = _in_range(u + du, *range_u), _in_range(v + dv, *range_v)
        if a * (next_u - u) ** 2 + c * (next_v - v) ** 2 < FOOT_MM**2:
            return None
        u, v = next_u, next_v
    return None


def _in_range(value: float, low: float, high: float, periodic: bool, closed: bool) -> float:
    """Bring a parameter back into a range: around where the surface closes, to the border where it ends."""
    if low <= value <= high or periodic:
        return value
    return low + (value - low) % (high - low) if closed else min(max(value, low), high)
