"""The faces of a CAD shape by body, and how each face uses its edges.

A *body* is a solid, a shell without solid, or all the faces that stand alone. A *use* is an edge as the border of one
face, run so that the material lies on its left as seen from outside: with the travel T and the outward normal N,
N x T points into the material. An edge between two faces has two uses, in opposite directions.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.TopTools import TopTools_IndexedMapOfShape

from sicp_cam.model import FloatArray

__all__ = ["Body", "EdgeUse", "Face", "bodies", "distinct", "edge_uses", "explored", "outward_normals"]

_EDGE, _WIRE, _FACE = TopAbs_ShapeEnum.TopAbs_EDGE, TopAbs_ShapeEnum.TopAbs_WIRE, TopAbs_ShapeEnum.TopAbs_FACE
_SHELL, _SOLID, _ANY = TopAbs_ShapeEnum.TopAbs_SHELL, TopAbs_ShapeEnum.TopAbs_SOLID, TopAbs_ShapeEnum.TopAbs_SHAPE
_FORWARD, _REVERSED = TopAbs_Orientation.TopAbs_FORWARD, TopAbs_Orientation.TopAbs_REVERSED


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """The kernel's face (taken forward), its surface, and the outward side of `dS/du x dS/dv`: +1 or -1."""

    shape: Any
    surface: Any
    side: int


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Faces that belong together; `solid` if they enclose a volume, which then tells their outward side.

    `name` is that of the file, or empty.
    """

    faces: tuple[Face, ...]
    solid: bool
    name: str = ""

    def turned(self) -> Body:
        """Return the body with the other side of every face outward."""
        return replace(self, faces=tuple(replace(face, side=-face.side) for face in self.faces))


@dataclass(frozen=True, slots=True, eq=False)
class EdgeUse:
    """One use of an edge by a face.

    Parameters
    ----------
    face, wire, edge, start, end
        Identities within the body: the face's index, its wire, the edge, and the vertices in the order of travel.
    curve, trace
        The edge in space and in the (u, v) plane of the face, on one common parameter.
    first, last
        The range of that parameter, first < last.
    forward
        True if the travel follows the parameter.
    degenerate
        True for an edge that is one point in space, such as a pole.
    """

    face: int
    wire: int
    edge: int
    start: int
    end: int
    curve: Any
    trace: Any
    first: float
    last: float
    forward: bool
    degenerate: bool

    def uv(self, parameters: FloatArray) -> FloatArray:
        """Return the surface parameters (n, 2) of the face at curve parameters (n,)."""
        points = (self.trace.Value(t) for t in parameters.tolist())
        return np.array([(point.X(), point.Y()) for point in points]).reshape(-1, 2)

    def uv_end(self, at_end: bool) -> FloatArray:
        """Return the (2,) surface parameters where the travel starts or ends."""
        parameter = self.last if at_end == self.forward else self.first
        point: FloatArray = self.uv(np.array([parameter]))[0]
        return point


def bodies(shape: Any, name: str = "") -> list[Body]:
    """Return the bodies of a shape: each solid, each shell outside of solids, and all single faces as one body.

    Faces that have triangles and no surface are left out, see `sicp_formats.cad.mesh.stored`.
    """
    found = [Body(_faces(solid), solid=True, name=name) for solid in distinct(shape, _SOLID)]
    shells = distinct(shape, _SHELL, outside=_SOLID)
    found += [Body(_faces(shell), solid=bool(BRep_Tool.IsClosed_s(shell)), name=name) for shell in shells]
    found.append(Body(_faces(shape, outside=_SHELL), solid=False, name=name))
    return [body for body in found if body.faces]


def edge_uses(body: Body) -> list[EdgeUse]:
    """Return every use of an edge by a face of the body, face by face and wire by wire."""
    edges, vertices = TopTools_IndexedMapOfShape(), TopTools_IndexedMapOfShape()
    uses = []
    wires = 0
    for index, face in enumerate(body.faces):
        for wire in explored(face.shape, _WIRE):
            wires += 1
            # Edges of another orientation lie within the face and bound nothing.
            bounding = [edge for edge in explored(wire, _EDGE) if edge.Orientation() in (_FORWARD, _REVERSED)]
            uses += [_use(TopoDS.Edge_s(edge), face, index, wires, edges, vertices) for edge in bounding]
    return uses


def outward_normals(face: Face, uv: FloatArray) -> FloatArray:
    """Return the outward unit normals (n, 3) at surface parameters (n, 2); nan where the surface has none (a pole)."""
    point, along_u, along_v = gp_Pnt(), gp_Vec(), gp_Vec()
    slopes = np.empty((len(uv), 6))
    for row, (u, v) in enumerate(uv.tolist()):
        face.surface.D1(u, v, point, along_u, along_v)
        slopes[row] = along_u.X(), along_u.Y(), along_u.Z(), along_v.X(), along_v.Y(), along_v.Z()
    normals = face.side * np.cross(slopes[:, :3], slopes[:, 3:])
    size = np.linalg.norm(normals, axis=1)
    scale = np.linalg.norm(slopes[:, :3], axis=1) * np.linalg.norm(slopes[:, 3:], axis=1)
    size[~(size > 1e-9 * scale)] = np.nan
    unit: FloatArray = normals / size[:, None]
    return unit


def explored(shape: Any, kind: Any, outside: Any = _ANY) -> Iterator[Any]:
    """Yield the parts of a kind in a shape, but those within parts of another kind; as often as they are used."""
    explorer = TopExp_Explorer(shape, kind, outside)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def distinct(shape: Any, kind: Any, outside: Any = _ANY) -> Iterator[Any]:
    """Yield what `explored` does, each part once."""
    seen = TopTools_IndexedMapOfShape()
    for part in explored(shape, kind, outside):
        if not seen.Contains(part):
            seen.Add(part)
            yield part


def _faces(shape: Any, outside: Any = _ANY) -> tuple[Face, ...]:
    faces = distinct(shape, _FACE, outside)
    return tuple(_face(face) for face in faces if BRep_Tool.Surface_s(TopoDS.Face_s(face)) is not None)


def _face(shape: Any) -> Face:
    # Edges and their traces are only consistent with the surface on the face taken forward; `side` keeps the rest.
    forward = TopoDS.Face_s(shape.Oriented(_FORWARD))
    return Face(forward, BRepAdaptor_Surface(forward), -1 if shape.Orientation() == _REVERSED else 1)


def _use(edge: Any, face: Face, index: int, wire: int, edges: Any, vertices: Any) -> EdgeUse:
    forward = (edge.Orientation() == _FORWARD) == (face.side > 0)
    ends = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
    start, end = (_identity(vertex, vertices) for vertex in (ends if forward else ends[::-1]))
    trace = BRepAdaptor_Curve2d(edge, face.shape)
    degenerate = BRep_Tool.Degenerated_s(edge)
    return EdgeUse(
        face=index,
        wire=wire,
        edge=_identity(edge, edges),
        start=start,
        end=end,
        curve=None if degenerate else BRepAdaptor_Curve(edge),
        trace=trace,
        first=trace.FirstParameter(),
        last=trace.LastParameter(),
        forward=forward,
        degenerate=degenerate,
    )


def _identity(part: Any, known: Any) -> int:
    return int(known.Add(part)) if not part.IsNull() else 0
