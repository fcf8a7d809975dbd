"""Load an IGES file into the CAD kernel's shape in millimetres.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

import re
from typing import Any

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IGESControl import IGESControl_Controller, IGESControl_Reader

from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_cam.units import MM_PER_UNIT
from sicp_formats.cad.notes import Code, Notes
from sicp_formats.cad.shape import UNIT_UNREADABLE, Loaded, Order, check_extent, failures, in_mm, one_unit

__all__ = ["load"]

_UNIT_NAMES = {1: "inch", 2: "mm", 4: "ft", 5: "mile", 6: "m", 7: "km", 8: "mil", 9: "um", 10: "cm", 11: "microinch"}
_BY_NAME = (
    dict.fromkeys(("IN", "INCH", "INCHES"), "inch")
    | dict.fromkeys(("MM", "MILLIMETER", "MILLIMETRE", "MILLIMETERS", "MILLIMETRES"), "mm")
    | dict.fromkeys(("CM", "CENTIMETER", "CENTIMETRE"), "cm")
    | dict.fromkeys(("M", "METER", "METRE", "METERS", "METRES"), "m")
    | {"FT": "ft", "FEET": "ft", "MI": "mile", "KM": "km", "MIL": "mil", "UM": "um", "UIN": "microinch"}
)
_BY_NAME_ONLY = 3
_SHAPE = re.compile(r"IGES(Geom|Solid)_")
_REMEDY = "export it again, or repair it with --recover"


def load(order: Order, notes: Notes) -> Loaded:
    """Load all surfaces and solids of an IGES file; parameters and errors are those of `step_loading.load`."""
    IGESControl_Controller.Init_s()
    reader = IGESControl_Reader()
    if reader.ReadFile(str(order.file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise CadError("the CAD kernel cannot read it; export it again")
    model = reader.IGESModel()
    unit, read_as = _unit(model.GlobalSection(), order, notes)
    if reader.NbRootsForTransfer() == 0:
        raise CadError("holds no shapes; export the solid or its faces")
    _refuse_half_read(reader, model, order.recover, notes)
    reader.TransferRoots()
    _refuse_half_built(reader, order.recover, notes)
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise CadError("holds no shapes that the CAD kernel can build; export the solid or its faces")
    if unit != read_as:
        shape = in_mm(shape, unit, read_as)
    check_extent(shape, order.coordinate_mm)
    return Loaded(shape, unit, True)


def _unit(section: Any, order: Order, notes: Notes) -> tuple[str, str]:
    """Return the unit of the file's numbers, and the one by which the kernel brings them to mm.

    Raises
    ------
    UnitError
        If the file's unit cannot be read or its flag and its name contradict each other, and the user does not say
        which it is; or if the user states another one than the file.
    """
    flag, text = int(section.UnitFlag()), section.UnitName()
    name = _BY_NAME.get(text.ToCString().strip().upper(), "") if text is not None else ""
    # By name alone: a flag that is still 3 is one of which the kernel does not know the name, and it goes on with mm.
    by_flag = name if flag == _BY_NAME_ONLY and name == "mm" else _UNIT_NAMES.get(flag, "")
    if not by_flag:
        if order.units is None:
            raise UnitError(UNIT_UNREADABLE)
        return order.units, "mm"
    if name and name != by_flag:
        if order.units == name and by_flag in MM_PER_UNIT:
            return name, by_flag
        if order.units != by_flag:
            both = f"the unit flag {flag} says {by_flag}, the unit name says {name}"
            raise UnitError(f"{both}; state which it is with --cad-units")
    unit, _ = one_unit([by_flag], order.units, notes)
    return unit, unit


def _refuse_half_read(reader: Any, model: Any, recover: bool, notes: Notes) -> None:
    """Refuse a file of which curves or surfaces could not be understood; note other failures."""
    for number, messages in failures(reader.WS().ModelCheckList(False)):
        kind = model.Value(number).DynamicType().Name() if number > 0 else "file"
        line = f"entity {number} ({kind}): {'; '.join(messages)}"
        shape = _SHAPE.match(kind) or "UndefinedEntity" in kind or "FreeFormat" in kind
        if shape and not recover:
            raise CadError(f"is damaged, {line}; {_REMEDY}")
        if shape:
            notes.add(Code.ENTITY_LEFT_OUT, Level.WARN, f"left out, with what it belongs to: {line}")
        else:
            notes.add(Code.NOT_UNDERSTOOD, Level.INFO, f"the CAD kernel did not understand {line}")


def _refuse_half_built(reader: Any, recover: bool, notes: Notes) -> None:
    failed = failures(reader.WS().TransferReader().LastCheckList())
    problems = dict.fromkeys(f"entity {number}: {line}" for number, lines in failed for line in lines)
    if not problems:
        return
    first, *others = problems
    what = f"({first}{f'; and {len(others)} more' if others else ''})"
    if not recover:
        raise CadError(f"cannot be turned into a shape {what}; {_REMEDY}")
    notes.add(Code.SHAPE_LEFT_OUT, Level.WARN, f"what cannot be turned into a shape is left out {what}")
