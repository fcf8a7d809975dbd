"""Length units: names, exact factors to the millimetre, and the check of a ratio."""

from __future__ import annotations

from sicp_cam.errors import UnitError

__all__ = ["MM_PER_UNIT", "likely_unit_mistake", "mm_per_unit"]

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


def likely_unit_mistake(ratio: float, tolerance: float = 0.25) -> str | None:
    """Name the unit mix-up that would explain a size ratio between two objects that should be equal in size.

    Parameters
    ----------
    ratio
        Size of the doubtful object over the size of the trusted one, both read as millimetres.
    tolerance
        Relative width of each match.

    Returns
    -------
    str or None
        The unit that the doubtful object is probably in, or None where no mix-up explains the ratio.

    >>> likely_unit_mistake(1 / 25.4)
    'inch'
    >>> likely_unit_mistake(1.1) is None
    True
    """
    for unit, factor in MM_PER_UNIT.items():
        if unit != "mm" and abs(ratio * factor - 1.0) <= tolerance:
            return unit
    return None
