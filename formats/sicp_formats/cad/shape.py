"""A shape of the CAD kernel in millimetres, and what is asked of it whatever file it came from.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS_Iterator
from OCP.TopTools import TopTools_IndexedMapOfShape

from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_cam.units import MM_PER_UNIT
from sicp_formats.cad.faces import explored
from sicp_formats.cad.notes import Code, Notes

__all__ = [
    "UNIT_UNREADABLE",
    "Loaded",
    "Named",
    "Order",
    "check_extent",
    "failures",
    "in_mm",
    "nameless",
    "names_of_copy",
    "nothing_in",
    "one_unit",
    "syntax_error",
]

UNIT_UNREADABLE = "the unit of length cannot be read; state it with --cad-units"
SMALLEST_MM, LARGEST_MM = 1e-3, 1e5
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_SYNTAX = re.compile(r"^ERR StepFile\s*:\s*")


@dataclass(frozen=True, slots=True)
class Order:
    """What the parent process asks for.

    Parameters
    ----------
    file, chatter
        The file, and where this process's own output goes: the kernel tells some errors only there.
    units
        The unit that the user states, or None.
    coordinate_mm
        Largest coordinate that is believed.
    recover
        True to go on without what cannot be read.
    """

    file: Path
    chatter: Path
    units: str | None
    coordinate_mm: float
    recover: bool


@dataclass(frozen=True, slots=True)
class Named:
    """What a file calls a shape: as a part of an assembly, None if it is none, and as a solid or surface of its own."""

    product: str | None = None
    label: str = ""


def nameless(shape: Any) -> Named:
    """Return the names of a shape from a file that has none."""
    return Named()


@dataclass(frozen=True, slots=True, eq=False)
class Loaded:
    """The kernel's shape in mm, the name of the file's own unit, and whether the file or the user stated it.

    `naming` tells what the file calls a part of the shape.
    """

    shape: Any
    unit: str
    unit_stated: bool
    naming: Callable[[Any], Named] = nameless


def one_unit(names: list[str], wanted: str | None, notes: Notes) -> tuple[str, bool]:
    """Return the unit of a file and whether it is stated, from the sorted names that the file states.

    Raises
    ------
    UnitError
        If the user states another one.
    """
    if not names:
        if wanted is None:
            notes.add(Code.UNIT_ASSUMED, Level.WARN, "the file states no length unit; mm is assumed")
        return "mm", False
    if wanted is not None and names != [wanted]:
        raise UnitError(f"the file states {' and '.join(names)}, not {wanted}; leave the units option out")
    if len(names) > 1:
        notes.add(Code.UNITS_MIXED, Level.INFO, f"the file has shapes in {' and '.join(names)}; each is brought to mm")
    return "+".join(names), True


def in_mm(shape: Any, unit: str, read_as: str = "mm") -> Any:
    """Return a shape of which the numbers are in `unit` in mm, where the kernel has taken them for `read_as`."""
    scaling = gp_Trsf()
    scaling.SetScale(gp_Pnt(0.0, 0.0, 0.0), MM_PER_UNIT[unit] / MM_PER_UNIT[read_as])
    return BRepBuilderAPI_Transform(shape, scaling, True).Shape()


def names_of_copy(original: Any, copy: Any, naming: Callable[[Any], Named]) -> Callable[[Any], Named]:
    """Return what tells of the parts of a copy what `naming` tells of those of its original."""
    pairs, place = [(copy, original)], TopTools_IndexedMapOfShape()
    originals: list[Any] = []
    for copied, part in pairs:  # grows as it goes, down to the faces
        if place.Add(copied) > len(originals):
            originals.append(part)
        if part.ShapeType() != TopAbs_ShapeEnum.TopAbs_FACE:
            pairs += zip(_parts(copied), _parts(part), strict=True)

    def of_copy(shape: Any) -> Named:
        index = place.FindIndex(shape)
        return naming(originals[index - 1]) if index else Named()

    return of_copy


def _parts(shape: Any) -> list[Any]:
    found, parts = [], TopoDS_Iterator(shape)
    while parts.More():
        found.append(parts.Value())
        parts.Next()
    return found


def check_extent(shape: Any, coordinate_mm: float) -> None:
    """Refuse a shape that is too small or too large to be a part, or too far away.

    Raises
    ------
    CadError
        Naming its size.
    """
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    if box.IsVoid():
        BRepBndLib.Add_s(shape, box, True)  # triangles only
    if box.IsVoid():
        raise CadError("its shape has no extent at all; export it again")
    corners = np.array(box.Get())
    size = float(np.linalg.norm(corners[3:] - corners[:3]))
    if not SMALLEST_MM <= size <= LARGEST_MM or not np.abs(corners).max() <= coordinate_mm:
        raise CadError(
            f"its shape would be {size:.3g} mm in size, reaching {np.abs(corners).max():.3g} mm from the origin;"
            f" {SMALLEST_MM:g} to {LARGEST_MM:g} mm are believed, check units and export"
        )


def nothing_in(shape: Any) -> str:
    """Say what a shape without faces holds instead."""
    kinds = (TopAbs_ShapeEnum.TopAbs_EDGE, "curves"), (TopAbs_ShapeEnum.TopAbs_VERTEX, "points")
    for kind, name in kinds:
        count = sum(1 for _ in explored(shape, kind))
        if count:
            return f"holds no faces, only {count} {name}; export the solid or its faces"
    return "holds no faces, nor anything else; export the solid or its faces"


def failures(checks: Any) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of each entity that the kernel failed on, with its reasons."""
    checks.Start()
    while checks.More():
        check = checks.Value()
        if check.NbFails():
            yield checks.Number(), [check.CFail(i, True).strip() for i in range(1, check.NbFails() + 1)]
        checks.Next()


def syntax_error(chatter: Path) -> str:
    """Return the kernel's last complaint about the syntax, without colours and stars."""
    text = chatter.read_text(encoding="utf-8", errors="replace") if chatter.exists() else ""
    lines = [_COLOUR.sub("", line).strip(" *") for line in text.splitlines() if "ERR StepFile" in line]
    return _SYNTAX.sub("", lines[-1]) if lines else ""
