"""The unit of length of a STEP file, and whether it is known for all of its shapes.

The kernel takes what it cannot understand for millimetres, so the shapes of a damaged file may come 25.4 times too
small. Runs in the child process only: it works on the CAD kernel's model of the file.
"""

from __future__ import annotations

import re
from typing import Any

from OCP.TColStd import TColStd_SequenceOfAsciiString

from sicp_cam.errors import UnitError
from sicp_formats.cad.notes import Notes
from sicp_formats.cad.shape import UNIT_UNREADABLE, Order, failures, one_unit

__all__ = ["length_unit"]

_UNIT_NAMES = (
    {"millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm"}
    | dict.fromkeys(("metre", "meter"), "m")
    | dict.fromkeys(("inch", "inches", "in"), "inch")
)
_OF_SHAPES = re.compile(r"Step\w+_\w*(?:Brep|Surface|Csg|Tessellated)\w*Representation$")
_LENGTH = re.compile(r"StepBasic_\w*LengthUnit")
_UNIT_ENTITY = re.compile(rb"=\s*\(([^;]*\b(?:LENGTH_UNIT|CONVERSION_BASED_UNIT|METRE)\b[^;]*)\)\s*;")
_MILLIMETRE = re.compile(rb"SI_UNIT\s*\(\s*\.MILLI\.\s*,\s*\.METRE\.\s*\)")


def length_unit(reader: Any, order: Order, notes: Notes) -> tuple[str, bool]:
    """Return the unit that a file states, and whether it states one; the kernel brings it to mm by itself.

    Millimetres are assumed only of a whole file of which the one unit of length is the millimetre, though it is not
    said that it is the unit of the shapes.

    Raises
    ------
    UnitError
        If the unit of any shape is missing or not understood and the user states none, or states another one.
    """
    names = _stated(reader)
    if names and not (names == [order.units] == ["mm"]) and _some_unreadable(reader):
        known = " and ".join(names)
        raise UnitError(f"the unit of length of some shapes cannot be read, that of others is {known}; export it again")
    # A file that is damaged may have lost the definition of another unit.
    if not names and order.units is None and (order.recover or not _only_millimetres(order.file.read_bytes())):
        raise UnitError(UNIT_UNREADABLE)
    return one_unit(names, order.units, notes)


def _stated(reader: Any) -> list[str]:
    lengths, angles, solid_angles = (TColStd_SequenceOfAsciiString() for _ in range(3))
    reader.FileUnits(lengths, angles, solid_angles)
    raw = [lengths.Value(i).ToCString().strip().lower() for i in range(1, lengths.Length() + 1)]
    return sorted({_UNIT_NAMES.get(name, name) for name in raw if name})


def _some_unreadable(reader: Any) -> bool:
    """Say whether a unit of length, or that of a shape, is missing or not understood."""
    model = reader.WS().Model()
    # Exponents of dimension that are left out, as some exporters do, change nothing.
    failed = (
        n for n, whys in failures(reader.WS().ModelCheckList(False)) if not all("(dimensions)" in w for w in whys)
    )
    if any(_LENGTH.match(model.Value(number).DynamicType().Name()) for number in failed if number > 0):
        return True
    entities = (model.Value(number) for number in range(1, model.NbEntities() + 1))
    return any(_OF_SHAPES.match(entity.DynamicType().Name()) and not _has_length(entity) for entity in entities)


def _has_length(representation: Any) -> bool:
    """Say whether the context of a shape names a unit of length."""
    context = representation.ContextOfItems()
    if context is not None and hasattr(context, "GlobalUnitAssignedContext"):
        context = context.GlobalUnitAssignedContext()
    if context is None or not hasattr(context, "NbUnits"):
        return False
    units = (context.UnitsValue(i) for i in range(1, context.NbUnits() + 1))
    return any(unit is not None and _LENGTH.match(unit.DynamicType().Name()) for unit in units)


def _only_millimetres(content: bytes) -> bool:
    """Say whether the file defines the millimetre and no other unit of length; units of angle do not count."""
    entities = [entity[1] for entity in _UNIT_ENTITY.finditer(content) if b"PLANE_ANGLE_UNIT" not in entity[1]]
    return bool(entities) and all(_MILLIMETRE.search(e) and b"CONVERSION" not in e for e in entities)
