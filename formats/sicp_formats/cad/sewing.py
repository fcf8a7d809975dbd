"""Sew the faces and shells of a part that only touch, so that a skin in several patches is one skin.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools_ReShape
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Compound
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape

from sicp_formats.cad.faces import distinct

__all__ = ["Sewn", "compound", "sewn", "without"]

_EDGE, _FACE = TopAbs_ShapeEnum.TopAbs_EDGE, TopAbs_ShapeEnum.TopAbs_FACE
_SHELL, _SOLID = TopAbs_ShapeEnum.TopAbs_SHELL, TopAbs_ShapeEnum.TopAbs_SOLID


@dataclass(frozen=True, slots=True, eq=False)
class Sewn:
    """A shape after sewing.

    Parameters
    ----------
    shape
        Its solids as they were, and shells of what was loose.
    seams
        How many edges became common to two faces.
    gap_mm
        How far the faces may have been apart there.
    turned, faces
        How many of the loose faces had the other side outward than most of their shell, by area.
    """

    shape: Any
    seams: int
    gap_mm: float
    turned: int
    faces: int


def sewn(shape: Any, tolerance_mm: float, left: Sequence[Any] = ()) -> Sewn | None:
    """Sew the faces and shells of a shape that are in no solid, but those that hold a face that is to be left.

    None if no two of them touch.
    """
    outside = [*distinct(shape, _SHELL, _SOLID), *distinct(shape, _FACE, _SHELL)]
    aside = [each for each in outside if any(face.IsSame(one) for face in distinct(each, _FACE) for one in left)]
    loose = [each for each in outside if not any(each is one for one in aside)]
    if len(loose) < 2 or not tolerance_mm > 0.0:
        return None
    before = compound(loose)
    sewing = BRepBuilderAPI_Sewing(tolerance_mm)
    sewing.Add(before)
    sewing.Perform()
    after = sewing.SewedShape()
    if after is None or after.IsNull():
        return None
    known = _common_edges(before)
    common = _common_edges(after)
    if len(common) <= len(known):
        return None
    shells, turned = _agreeing(after, sewing, list(distinct(before, _FACE)))
    alone = distinct(after, _FACE, _SHELL)
    whole = compound([*distinct(shape, _SOLID), *shells, *alone, *aside])
    faces = sum(1 for _ in distinct(before, _FACE))
    gap = max((BRep_Tool.Tolerance_s(TopoDS.Edge_s(edge)) for edge in common), default=0.0)
    return Sewn(whole, len(common) - len(known), gap, turned, faces)


def compound(shapes: Iterable[Any]) -> Any:
    """Return one shape of several."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def without(shape: Any, faces: Sequence[Any]) -> Any:
    """Return a shape without some of its faces."""
    if not faces:
        return shape
    change = BRepTools_ReShape()
    for face in faces:
        change.Remove(face)
    return change.Apply(shape)


def _common_edges(shape: Any) -> list[Any]:
    """Return the edges that two different faces have in common."""
    faces_of = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, _EDGE, _FACE, faces_of)
    found = []
    for index in range(1, faces_of.Extent() + 1):
        faces = list(faces_of.FindFromIndex(index))
        if any(not faces[0].IsSame(face) for face in faces[1:]):
            found.append(faces_of.FindKey(index))
    return found


def _agreeing(after: Any, sewing: Any, originals: list[Any]) -> tuple[list[Any], int]:
    """Return the sewn shells with the side outward that most of their area had, and how many faces had the other.

    Sewing turns the faces of a shell to the side of any one of them.
    """
    stated = [(_modified(sewing, face), face.Orientation()) for face in originals]
    shells, turned = [], 0
    for shell in distinct(after, _SHELL):
        areas, counts = {True: 0.0, False: 0.0}, {True: 0, False: 0}
        for face in distinct(shell, _FACE):
            side = next((side for new, side in stated if new.IsSame(face)), face.Orientation())
            kept = side == face.Orientation()
            areas[kept] += _area(face)
            counts[kept] += 1
        right = areas[True] >= areas[False]
        turned += counts[not right]
        shells.append(shell if right else shell.Reversed())
    return shells, turned


def _modified(sewing: Any, face: Any) -> Any:
    return sewing.ModifiedSubShape(face) if sewing.IsModifiedSubShape(face) else face


def _area(face: Any) -> float:
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return abs(float(properties.Mass()))
