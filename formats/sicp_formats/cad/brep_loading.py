"""Load a BRep file into the CAD kernel's shape in millimetres.

Runs in the child process only: it imports the CAD kernel.
"""

from __future__ import annotations

from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS_Shape

from sicp_cam.errors import CadError
from sicp_formats.cad.notes import Notes
from sicp_formats.cad.shape import Loaded, Order, check_extent, in_mm

__all__ = ["load"]


def load(order: Order, notes: Notes) -> Loaded:
    """Load the shape of a BRep file, which states no unit; parameters and errors are those of `step_loading.load`."""
    shape = TopoDS_Shape()
    if not BRepTools.Read_s(shape, str(order.file), BRep_Builder()) or shape.IsNull():
        raise CadError("the CAD kernel cannot read it; export it again")
    if order.units is not None:
        shape = in_mm(shape, order.units)
    check_extent(shape, order.coordinate_mm)
    return Loaded(shape, order.units or "mm", order.units is not None)
