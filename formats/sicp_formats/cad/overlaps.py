"""Find loose faces that lie on each other: copies of one face, and stacks of skins thinner than the sewing tolerance.

Sewn together they would be a solid of no thickness, with an outward side that no one has stated. Runs in the child
process only: it works on the CAD kernel's shapes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepTools import BRepTools
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_ShapeEnum, TopAbs_State
from OCP.TopoDS import TopoDS

from sicp_cam.model import FloatArray
from sicp_formats.cad.faces import distinct

__all__ = ["Overlaps", "overlaps"]

SAME_MM = 1e-3
"""Faces that are no further apart than this, with their boundaries, are one face written twice."""
SAMPLES = 9
GRIDS = (5, 15, 40)
"""Samples in each direction of a surface, until enough of them lie within the face."""
MARGIN = 0.1
"""A face may rise above its samples by this share of its size."""
SHARE = 0.5
"""Faces overlap where this share of the samples of one lies on the other; a fold as thin as that is a stack."""


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Faces that are copies of an earlier one, and faces that lie on another that is not the same."""

    copies: tuple[Any, ...]
    stacked: tuple[Any, ...]


def overlaps(faces: Sequence[Any], distance_mm: float) -> Overlaps:
    """Return which faces lie on others of the list.

    Parameters
    ----------
    faces
        The kernel's faces.
    distance_mm
        Faces that are no further apart are a stack.
    """
    known = [_Sampled(TopoDS.Face_s(face)) for face in faces if BRep_Tool.Surface_s(TopoDS.Face_s(face)) is not None]
    copies: set[int] = set()
    stacked: set[int] = set()
    for a, b in _near(known, distance_mm):
        if a in copies or b in copies:
            continue
        if known[b].lies_on(known[a], SAME_MM, 1.0) and known[a].is_bounded_as(known[b]):
            copies.add(b)
        elif known[a].lies_on(known[b], distance_mm, SHARE) or known[b].lies_on(known[a], distance_mm, SHARE):
            stacked |= {a, b}
    return Overlaps(
        tuple(known[i].shape for i in sorted(copies)), tuple(known[i].shape for i in sorted(stacked - copies))
    )


class _Sampled:
    """A face with some points within it."""

    def __init__(self, shape: Any) -> None:
        self.shape = shape

    @cached_property
    def box(self) -> FloatArray:
        """(6,) lower and upper corner: around the samples, and no more than the kernel's box of all the surface."""
        box = Bnd_Box()
        BRepBndLib.Add_s(self.shape, box, False)
        places = _coordinates([*self.points, *(point for edge in _edges(self.shape) for point in _along(edge))])
        if box.IsVoid() or not len(places):
            return np.repeat([np.inf, -np.inf], 3)
        outer = np.array(box.Get())
        low, high = places.min(axis=0), places.max(axis=0)
        margin = MARGIN * float(np.linalg.norm(high - low))
        return np.concatenate([np.maximum(low - margin, outer[:3]), np.minimum(high + margin, outer[3:])])

    @cached_property
    def _surface(self) -> Any:
        return ShapeAnalysis_Surface(BRep_Tool.Surface_s(self.shape))

    @cached_property
    def _domain(self) -> Any:
        return BRepTopAdaptor_FClass2d(self.shape, 1e-9)

    @cached_property
    def points(self) -> list[gp_Pnt]:
        """Points within the face, spread over it; none of a face that is too narrow for the finest grid."""
        u1, u2, v1, v2 = BRepTools.UVBounds_s(self.shape)
        for count in GRIDS:
            ticks = (np.arange(count) + 0.5) / count
            spread = [gp_Pnt2d(u1 + (u2 - u1) * u, v1 + (v2 - v1) * v) for u in ticks.tolist() for v in ticks.tolist()]
            inside = [uv for uv in spread if self._domain.Perform(uv) == TopAbs_State.TopAbs_IN]
            if len(inside) >= SAMPLES:
                break
        chosen = np.unique(np.linspace(0, len(inside) - 1, SAMPLES).astype(int)).tolist() if inside else []
        return [self._surface.Value(inside[i]) for i in chosen]

    def lies_on(self, other: _Sampled, distance_mm: float, share: float) -> bool:
        """Say whether this share of the points lies within another face, as seen along its normal."""
        missed = 0
        for point in self.points:
            missed += not other.holds(point, distance_mm)
            if missed > (1.0 - share) * len(self.points):
                return False
        return bool(self.points)

    def holds(self, point: gp_Pnt, distance_mm: float) -> bool:
        """Say whether a point lies within the face."""
        (place,) = _coordinates([point])
        if (place < self.box[:3] - distance_mm).any() or (place > self.box[3:] + distance_mm).any():
            return False
        uv = self._surface.ValueOfUV(point, 1e-7)
        near = self._surface.Value(uv).Distance(point) <= distance_mm
        return bool(near and self._domain.Perform(uv) == TopAbs_State.TopAbs_IN)

    def is_bounded_as(self, other: _Sampled) -> bool:
        """Say whether the edges of both faces run along those of the other."""
        return _run_along(self.shape, other.shape) and _run_along(other.shape, self.shape)


def _near(faces: Sequence[_Sampled], distance_mm: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs of faces of which the boxes meet."""
    boxes: FloatArray = np.array([face.box for face in faces]).reshape(-1, 6)
    for a in range(len(boxes)):
        after = boxes[a + 1 :]
        apart = (after[:, :3] > boxes[a, 3:] + distance_mm) | (after[:, 3:] < boxes[a, :3] - distance_mm)
        for b in np.flatnonzero(~apart.any(axis=1)).tolist():
            yield a, a + 1 + b


def _run_along(face: Any, other: Any) -> bool:
    """Say whether some points of each edge of a face lie on the edges of another."""
    edges = _edges(other)
    for point in (point for edge in _edges(face) for point in _along(edge)):
        vertex = BRepBuilderAPI_MakeVertex(point).Vertex()
        if not any(BRepExtrema_DistShapeShape(vertex, edge).Value() <= SAME_MM for edge in edges):
            return False
    return True


def _edges(face: Any) -> list[Any]:
    edges = (TopoDS.Edge_s(edge) for edge in distinct(face, TopAbs_ShapeEnum.TopAbs_EDGE))
    return [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]


def _along(edge: Any) -> list[gp_Pnt]:
    curve = BRepAdaptor_Curve(edge)
    return [curve.Value(t) for t in np.linspace(curve.FirstParameter(), curve.LastParameter(), 5).tolist()]


def _coordinates(points: Sequence[gp_Pnt]) -> FloatArray:
    return np.array([(point.X(), point.Y(), point.Z()) for point in points]).reshape(-1, 3)
