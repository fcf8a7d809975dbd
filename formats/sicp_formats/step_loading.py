"""Load a STEP file into the CAD kernel's shape in millimetres, and refuse what the kernel only half understood.

The kernel drops what it cannot read and goes on: a file cut in half still gives a solid with faces missing. So its
own lists of failures are read, the faces are counted, and the extent is checked.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPControl import STEPControl_Reader
from OCP.TColStd import TColStd_SequenceOfAsciiString
from OCP.TopLoc import TopLoc_Location
from OCP.TopTools import TopTools_IndexedMapOfShape

from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_cam.units import MM_PER_UNIT
from sicp_formats.step_faces import Body
from sicp_formats.step_notes import Notes

__all__ = ["Loaded", "check_faces", "load"]

SMALLEST_MM, LARGEST_MM = 1e-3, 1e5
_UNIT_NAMES = (
    {"millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm"}
    | dict.fromkeys(("metre", "meter"), "m")
    | dict.fromkeys(("inch", "inches", "in"), "inch")
)
_TOPOLOGY = re.compile(r"StepShape_\w*(Face|Edge|Loop|Vertex|Shell|Brep)")
_FACE_ENTITY = re.compile(rb"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True, slots=True, eq=False)
class Loaded:
    """The kernel's shape in mm, the name of the file's own unit, and whether the file or the user stated it."""

    shape: Any
    unit: str
    unit_stated: bool


def load(file: Path, chatter: Path, units: str | None, coordinate_mm: float, notes: Notes) -> Loaded:
    """Load all shapes of a STEP file.

    Parameters
    ----------
    file
        The STEP file.
    chatter
        Where this process's own output goes: the kernel tells the line of a syntax error only there.
    units
        The unit that the user states, or None.
    coordinate_mm
        Largest coordinate that is believed.
    notes
        Receives what the user should know.

    Raises
    ------
    CadError
        If the file cannot be read whole, holds no shape, or the shape has no sensible extent.
    UnitError
        If the file states another unit than the user.
    """
    reader = STEPControl_Reader()
    if reader.ReadFile(str(file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise CadError(
            f"the CAD kernel cannot read it ({_syntax_error(chatter) or 'no reason given'}); export it again"
        )
    if reader.NbRootsForTransfer() == 0:
        raise CadError("holds no shapes; export the solid or its faces")
    _refuse_half_read(reader, chatter, notes)
    unit, stated = _unit(reader, units, notes)
    _transfer(reader)
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise CadError("holds no shapes that the CAD kernel can build; export the solid or its faces")
    if units is not None and not stated:
        shape = _scaled(shape, MM_PER_UNIT[units])
        unit, stated = units, True
    _check_extent(shape, coordinate_mm)
    return Loaded(shape, unit, stated)


def check_faces(content: bytes, found: list[Body], notes: Notes) -> None:
    """Note if fewer faces were built than the file has entities for; instances in assemblies count once."""
    distinct = TopTools_IndexedMapOfShape()
    for body in found:
        for face in body.faces:
            distinct.Add(face.shape.Located(TopLoc_Location()))
    stated, built = len(_FACE_ENTITY.findall(content)), distinct.Extent()
    if built < stated:
        notes.add(205, Level.WARN, f"{stated} faces in the file, {built} built; compare the contours with the drawing")


def _syntax_error(chatter: Path) -> str:
    """Return the kernel's last complaint about the syntax, without colours and stars."""
    text = chatter.read_text(encoding="utf-8", errors="replace") if chatter.exists() else ""
    lines = [_COLOUR.sub("", line).strip(" *") for line in text.splitlines() if "ERR StepFile" in line]
    return re.sub(r"^ERR StepFile\s*:\s*", "", lines[-1]) if lines else ""


def _refuse_half_read(reader: Any, chatter: Path, notes: Notes) -> None:
    """Refuse a file of which entities are missing or topology is broken; note other failures."""
    syntax = _syntax_error(chatter)
    if syntax:
        raise CadError(f"the CAD kernel finds wrong syntax ({syntax}); export the file again")
    model = reader.WS().Model()
    for number, messages in _failures(reader.WS().ModelCheckList(False)):
        kind = model.Value(number).DynamicType().Name() if number > 0 else "file"
        line = f"entity {number} ({kind}): {'; '.join(messages)}"
        if any("unresolved" in message for message in messages) or _TOPOLOGY.match(kind):
            raise CadError(f"is damaged, {line}; export it again")
        notes.add(204, Level.INFO, f"the CAD kernel did not understand {line}")


def _failures(checks: Any) -> Iterator[tuple[int, list[str]]]:
    checks.Start()
    while checks.More():
        check = checks.Value()
        if check.NbFails():
            yield checks.Number(), [check.CFail(i, True).strip() for i in range(1, check.NbFails() + 1)]
        checks.Next()


def _unit(reader: Any, wanted: str | None, notes: Notes) -> tuple[str, bool]:
    """Return the file's unit and whether it states one; the kernel brings stated units to mm by itself."""
    lengths, angles, solid_angles = (TColStd_SequenceOfAsciiString() for _ in range(3))
    reader.FileUnits(lengths, angles, solid_angles)
    raw = [lengths.Value(i).ToCString().strip().lower() for i in range(1, lengths.Length() + 1)]
    names = sorted({_UNIT_NAMES.get(name, name) for name in raw if name})
    if not names:
        if wanted is None:
            notes.add(201, Level.WARN, "the file states no length unit; mm is assumed")
        return "mm", False
    if wanted is not None and names != [wanted]:
        raise UnitError(f"the file states {' and '.join(names)}, not {wanted}; leave the units option out")
    if len(names) > 1:
        notes.add(202, Level.INFO, f"the file has shapes in {' and '.join(names)}; each is brought to mm")
    return "+".join(names), True


def _transfer(reader: Any) -> None:
    for root in range(1, reader.NbRootsForTransfer() + 1):
        if not reader.TransferRoot(root):
            raise CadError(
                f"root {root} of {reader.NbRootsForTransfer()} cannot be turned into a shape; export it again"
            )
        for _, messages in _failures(reader.WS().TransferReader().LastCheckList()):
            raise CadError(f"cannot be turned into a shape ({'; '.join(dict.fromkeys(messages))}); export it again")


def _scaled(shape: Any, factor: float) -> Any:
    scaling = gp_Trsf()
    scaling.SetScale(gp_Pnt(0.0, 0.0, 0.0), factor)
    return BRepBuilderAPI_Transform(shape, scaling, True).Shape()


def _check_extent(shape: Any, coordinate_mm: float) -> None:
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    if box.IsVoid():
        raise CadError("its shape has no extent at all; export it again")
    corners = np.array(box.Get())
    size = float(np.linalg.norm(corners[3:] - corners[:3]))
    if not SMALLEST_MM <= size <= LARGEST_MM or not np.abs(corners).max() <= coordinate_mm:
        raise CadError(
            f"its shape would be {size:.3g} mm in size, reaching {np.abs(corners).max():.3g} mm from the origin;"
            f" {SMALLEST_MM:g} to {LARGEST_MM:g} mm are believed, check units and export"
        )
