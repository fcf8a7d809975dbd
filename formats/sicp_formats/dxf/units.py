"""The unit of a drawing: what its header variable $INSUNITS says, and nothing else.

$MEASUREMENT only chooses hatch patterns, and the library fills in metres where a drawing has no header: neither counts.
"""

from __future__ import annotations

from sicp_cam.errors import UnitError, printable
from sicp_formats.dxf.tags import Tags
from sicp_formats.paths.moves import MoveList

__all__ = ["state_unit"]

_UNITS = {1: "inch", 4: "mm", 5: "cm", 6: "m"}
_OTHERS = {2: "feet", 3: "miles", 7: "km", 8: "microinches", 9: "mils", 10: "yards", 13: "micrometres", 14: "dm"}


def state_unit(moves: MoveList, tags: Tags) -> None:
    """Take the unit of a drawing for its path.

    Raises
    ------
    UnitError
        If the drawing states none and the user neither, if both do and differ, or if it is one that no path is in.
    """
    stated = tags.insunits()
    if stated is None or stated[0] == 0:
        if moves.unit_option is None:
            raise UnitError(
                f"{printable(str(moves.path))}: the drawing states no unit ($INSUNITS); state it with --path-units"
            )
        return
    number, line = stated
    name = _UNITS.get(number) or _OTHERS.get(number) or f"unit {number}"
    where = printable(str(moves.path)) + (f", line {line}" if line else "")
    if moves.unit_option not in (None, name):
        raise UnitError(
            f"{where}: the drawing states {name}, the job {moves.unit_option}; correct or drop --path-units"
        )
    if number not in _UNITS:
        raise UnitError(f"{where}: the drawing is in {name} ($INSUNITS = {number}); save it in mm, cm, m or inch")
    moves.state_unit(name, line)
