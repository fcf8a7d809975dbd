"""Find the faces of a CAD shape that are invalid, and heal them.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

from typing import Any

from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.ShapeFix import ShapeFix_Shape
from OCP.TopAbs import TopAbs_ShapeEnum

from sicp_cam.findings import Level
from sicp_formats.cad.faces import distinct
from sicp_formats.cad.mesh import stored
from sicp_formats.cad.notes import Code, Notes

__all__ = ["checked"]

LARGEST_TOLERANCE_MM = 0.5


def checked(shape: Any, recover: bool, notes: Notes) -> Any:
    """Return a shape as it is, with a note if the kernel finds it invalid; or healed, with a note of what was done."""
    if stored(shape) or BRepCheck_Analyzer(shape).IsValid():  # a face without a surface is never valid
        return shape
    if recover:
        healed = _healed(shape)
        before, after = _invalid_faces(shape), _invalid_faces(healed)
        line = f"an invalid shape was healed: {len(before)} invalid faces before, {len(after)} after{_at(before)}"
        notes.add(Code.HEALED, Level.WARN, line)
        return healed
    bad = _invalid_faces(shape)
    what = f"{len(bad)} faces are invalid{_at(bad)}" if bad else "its faces do not fit together"
    line = f"the CAD kernel finds the shape invalid: {what}; compare the contours there, or repair it with --recover"
    notes.add(Code.FACES_INVALID, Level.WARN, line)
    return shape


def _healed(shape: Any) -> Any:
    fix = ShapeFix_Shape(shape)
    fix.SetMaxTolerance(LARGEST_TOLERANCE_MM)
    fix.Perform()
    healed = fix.Shape()
    return shape if healed is None or healed.IsNull() else healed


def _invalid_faces(shape: Any) -> list[Any]:
    faces = distinct(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    return [face for face in faces if not BRepCheck_Analyzer(face).IsValid()]


def _at(faces: list[Any]) -> str:
    if not faces:
        return ""
    box = Bnd_Box()
    BRepBndLib.Add_s(faces[0], box, False)
    if box.IsVoid():
        return ""
    low_high = box.Get()
    middle = [(low_high[i] + low_high[i + 3]) / 2 for i in range(3)]
    return ", the first near ({:.1f}, {:.1f}, {:.1f})".format(*middle)
