"""The one way numbers become text: finite, fixed decimals, a dot, never an exponent, never minus zero."""

from __future__ import annotations

import numpy as np

from sicp_cam.errors import PathError
from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import FloatArray

__all__ = ["LARGEST", "fixed", "rounded", "trimmed"]

LARGEST = DEFAULT_LIMITS.coordinate_mm
"""No number larger than this is written: a controller would read a mistake, not a position."""


def fixed(value: float, decimals: int) -> str:
    """Format a number with a fixed count of decimals.

    Raises
    ------
    PathError
        If the number is not finite or larger than `LARGEST`.

    >>> fixed(-0.0004, 3), fixed(2, 3), fixed(1e-9, 4)
    ('0.000', '2.000', '0.0000')
    """
    if not abs(value) <= LARGEST:
        raise PathError(f"the number {value!r} cannot be written into a program; correct the path that it comes from")
    text = f"{value:.{decimals}f}"
    return text[1:] if text[0] == "-" and not text.strip("-0.") else text


def trimmed(value: float, decimals: int) -> str:
    """Format a number like `fixed`, without zeros at its end.

    >>> trimmed(12000, 3), trimmed(0.25, 3)
    ('12000', '0.25')
    """
    text = fixed(value, decimals)
    return text.rstrip("0").rstrip(".") if "." in text else text


def rounded(values: FloatArray, decimals: int) -> FloatArray:
    """Round an array of any shape for printing in one go, with the rules of `fixed`.

    Raises
    ------
    PathError
        If a number is not finite or larger than `LARGEST`.
    """
    bad = ~(np.abs(values) <= LARGEST)
    if bad.any():
        raise PathError(
            f"the number {float(values[bad][0])!r} cannot be written into a program; "
            "correct the path that it comes from"
        )
    result: FloatArray = np.round(values, decimals) + 0.0
    return result
