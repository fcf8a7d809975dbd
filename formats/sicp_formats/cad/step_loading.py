"""Load a STEP file into the CAD kernel's shape in millimetres, and refuse what the kernel only half understood.

The kernel drops what it cannot read and goes on: a file cut in half still gives a solid with faces missing. So its
own lists of failures are read, the faces are counted, and the extent is checked.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Standard import Standard_OutOfRange
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopLoc import TopLoc_Location
from OCP.TopTools import TopTools_IndexedMapOfShape

from sicp_cam.errors import CadError
from sicp_cam.findings import Level
from sicp_formats.cad.faces import explored
from sicp_formats.cad.notes import Code, Notes
from sicp_formats.cad.shape import Loaded, Named, Order, check_extent, failures, in_mm, names_of_copy, syntax_error
from sicp_formats.cad.step_units import length_unit

__all__ = ["check_faces", "load"]

_FACE = TopAbs_ShapeEnum.TopAbs_FACE
_TOPOLOGY = re.compile(r"StepShape_\w*(Face|Edge|Loop|Vertex|Shell|Brep)")
_FACE_ENTITY = re.compile(rb"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(")
_INSTANCE, _PRODUCT = "StepRepr_NextAssemblyUsageOccurrence", "StepBasic_ProductDefinition"
_LABELLED = ("StepShape_ManifoldSolidBrep", "StepShape_BrepWithVoids", "StepShape_ShellBasedSurfaceModel")
_MADE_UP = re.compile(
    r"open cascade .*|=>.*|(?:(?:open[ _]?)?shell|face|surface|compound|none|unnamed|untitled)?[ _.:#-]*[\d.]*",
    re.IGNORECASE,
)
_ANY_RESULT = -1
_REMEDY = "export it again, or repair it with --recover"


def load(order: Order, notes: Notes) -> Loaded:
    """Load all shapes of a STEP file.

    Parameters
    ----------
    order
        The file and how to read it.
    notes
        Receives what the user should know.

    Raises
    ------
    CadError
        If the file cannot be read whole, holds no shape, or the shape has no sensible extent.
    UnitError
        If the unit of length cannot be read and the user states none, or states another one than the file.
    """
    reader = STEPControl_Reader()
    if reader.ReadFile(str(order.file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        reason = syntax_error(order.chatter) or "no reason given"
        raise CadError(f"the CAD kernel cannot read it ({reason}); export it again")
    if reader.NbRootsForTransfer() == 0:
        raise CadError("holds no shapes; export the solid or its faces")
    _refuse_half_read(reader, order, notes)
    unit, stated = length_unit(reader, order, notes)
    roots = _transfer(reader, order.recover, notes)
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise CadError("holds no shapes that the CAD kernel can build; export the solid or its faces")
    naming: Callable[[Any], Named] = partial(_named, reader, roots)
    if order.units is not None and not stated:
        read, shape = shape, in_mm(shape, order.units)
        naming = names_of_copy(read, shape, naming)
        unit, stated = order.units, True
    check_extent(shape, order.coordinate_mm)
    return Loaded(shape, unit, stated, naming)


def check_faces(content: bytes, shape: Any, notes: Notes) -> None:
    """Note if fewer faces were built than the file has entities for; instances in assemblies count once."""
    distinct = TopTools_IndexedMapOfShape()
    for face in explored(shape, _FACE):
        distinct.Add(face.Located(TopLoc_Location()))
    stated, built = len(_FACE_ENTITY.findall(content)), distinct.Extent()
    if built < stated:
        line = f"{stated} faces in the file, {built} built; compare the contours with the drawing"
        notes.add(Code.FACES_MISSING, Level.WARN, line)


def _refuse_half_read(reader: Any, order: Order, notes: Notes) -> None:
    """Refuse a file of which entities are missing or topology is broken; note other failures."""
    syntax = syntax_error(order.chatter)
    if syntax and not order.recover:
        raise CadError(f"the CAD kernel finds wrong syntax ({syntax}); {_REMEDY}")
    if syntax:
        notes.add(Code.ENTITY_LEFT_OUT, Level.WARN, f"what the CAD kernel finds wrong syntax in is left out: {syntax}")
    model = reader.WS().Model()
    for number, messages in failures(reader.WS().ModelCheckList(False)):
        kind = model.Value(number).DynamicType().Name() if number > 0 else "file"
        line = f"entity {number} ({kind}): {'; '.join(messages)}"
        damaged = any("unresolved" in message for message in messages) or _TOPOLOGY.match(kind)
        if damaged and not order.recover:
            raise CadError(f"is damaged, {line}; {_REMEDY}")
        if damaged:
            notes.add(Code.ENTITY_LEFT_OUT, Level.WARN, f"left out, with what it belongs to: {line}")
        else:
            notes.add(Code.NOT_UNDERSTOOD, Level.INFO, f"the CAD kernel did not understand {line}")


def _transfer(reader: Any, recover: bool, notes: Notes) -> list[tuple[Any, str]]:
    """Build all shapes; return those that are products and in no assembly, with their names."""
    roots, products = reader.NbRootsForTransfer(), []
    for root in range(1, roots + 1):
        known = reader.NbShapes()
        built = reader.TransferRoot(root)
        entity = reader.RootForTransfer(root)
        if entity.DynamicType().Name() == _PRODUCT:
            name = _product_name(entity)
            products += [(reader.Shape(i), name) for i in range(known + 1, reader.NbShapes() + 1)]
        problems = dict.fromkeys(
            line for _, lines in failures(reader.WS().TransferReader().LastCheckList()) for line in lines
        )
        if built and not problems:
            continue
        what = f"({'; '.join(problems)})" if problems else f"(root {root} of {roots})"
        if not recover:
            raise CadError(f"cannot be turned into a shape {what}; {_REMEDY}")
        notes.add(Code.SHAPE_LEFT_OUT, Level.WARN, f"what cannot be turned into a shape is left out {what}")
    return products


def _named(reader: Any, roots: list[tuple[Any, str]], shape: Any) -> Named:
    """Return what the file calls a shape: as a product, and as a solid or surface."""
    # The kernel forgets of which product a root is that has but one shape.
    product, label = next((name for root, name in roots if root.IsSame(shape)), None), ""
    for placed in (shape, shape.Located(TopLoc_Location())):
        try:
            entity = reader.WS().TransferReader().EntityFromShapeResult(placed, _ANY_RESULT)
        except Standard_OutOfRange:  # the kernel looks for shapes of a kind that it has made none of
            continue
        kind = entity.DynamicType().Name() if entity is not None else ""
        if kind == _INSTANCE and product is None:
            product = _product_name(entity.RelatedProductDefinition())
        elif kind == _PRODUCT and product is None:
            product = _product_name(entity)
        elif kind in _LABELLED:
            label = _text(entity)
    return Named(product, label)


def _product_name(definition: Any) -> str:
    """Return the name of a product as its author gave it; empty if the exporter made it up."""
    name = _text(definition.Formation().OfProduct())
    return "" if _MADE_UP.fullmatch(name) else name


def _text(entity: Any) -> str:
    try:
        return str(entity.Name().ToCString()).strip()
    except (AttributeError, UnicodeDecodeError):  # no name, or not in any known encoding
        return ""
