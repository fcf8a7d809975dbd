"""Load an IGES file into the CAD kernel's shape in millimetres.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

import re
from typing import Any

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IGESControl import IGESControl_Controller, IGESControl_Reader

from sicp_cam.errors import CadError
from sicp_cam.findings import Level
from sicp_formats.cad.notes import Code, Notes
from sicp_formats.cad.shape import Loaded, Order, check_extent, failures, in_mm, one_unit

__all__ = ["load"]

_UNIT_NAMES = {1: "inch", 2: "mm", 4: "ft", 5: "mile", 6: "m", 7: "km", 8: "mil", 9: "um", 10: "cm", 11: "microinch"}
_BY_NAME = {"IN": "inch", "INCH": "inch", "MM": "mm", "M": "m", "CM": "cm"}
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
    unit, stated = one_unit(_unit(model.GlobalSection()), order.units, notes)
    if reader.NbRootsForTransfer() == 0:
        raise CadError("holds no shapes; export the solid or its faces")
    _refuse_half_read(reader, model, order.recover, notes)
    reader.TransferRoots()
    _refuse_half_built(reader, order.recover, notes)
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise CadError("holds no shapes that the CAD kernel can build; export the solid or its faces")
    if order.units is not None and not stated:
        shape, unit, stated = in_mm(shape, order.units), order.units, True
    check_extent(shape, order.coordinate_mm)
    return Loaded(shape, unit, stated)


def _unit(section: Any) -> list[str]:
    """Return the unit of the global section; the kernel brings it to mm by itself."""
    flag = int(section.UnitFlag())
    if flag != _BY_NAME_ONLY:
        return [_UNIT_NAMES[flag]] if flag in _UNIT_NAMES else []
    name = section.UnitName()
    text = name.ToCString().strip().upper() if name is not None else ""
    return [_BY_NAME.get(text, text.lower())] if text else []


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
