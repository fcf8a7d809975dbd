"""Length units: names, and exact factors to the millimetre."""

from __future__ import annotations

from sicp_cam.errors import UnitError

__all__ = ["MM_PER_UNIT", "mm_per_unit"]

MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
"""Millimetres in one unit; the inch is exactly 25.4 mm by definition."""


def mm_per_unit(unit: str) -> float:
    """Return how many millimetres one unit has.

    Raises
    ------
    UnitError
        If the unit is not one of `MM_PER_UNIT`.

    >>> mm_per_unit("inch")
    25.4
    """
    try:
        return MM_PER_UNIT[unit]
    except KeyError:
        raise UnitError(f"unknown unit {unit!r}; use one of {', '.join(MM_PER_UNIT)}") from None
