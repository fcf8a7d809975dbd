"""Tool axis from the orientation words of G-code: vector components or two rotary angles."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sicp_formats.arcs import Vector
from sicp_formats.gcode_words import GCodeError

__all__ = ["ROTARY_CHOICES", "axis_from_angles", "axis_from_vector"]

ROTARY_CHOICES = ("AC", "BC", "AB", "BA")


def axis_from_angles(rotary: str, angles_deg: Mapping[str, float]) -> Vector:
    """Return the unit axis (tip to holder) of a head-head machine at the given angles.

    The first letter of `rotary` tilts the tool, the second turns that about its own axis: n = R_second R_first z,
    right-handed, zero at +Z. For ``AC`` that is (sin A sin C, -sin A cos C, cos A), so A = acos k, C = atan2(i, -j);
    for ``BC`` (sin B cos C, sin B sin C, cos B), so B = acos k, C = atan2(j, i).

    >>> [round(c, 6) + 0.0 for c in axis_from_angles("BC", {"B": 90.0, "C": 90.0})]
    [0.0, 1.0, 0.0]
    """
    axis: Vector = (0.0, 0.0, 1.0)
    for letter in rotary:
        axis = _turned(axis, letter, math.radians(math.fmod(angles_deg[letter], 360.0)))
    return axis


def axis_from_vector(words: Mapping[str, str], letters: tuple[str, str, str]) -> Vector | None:
    """Return the vector of the three words, a missing one being 0; None if all are missing.

    >>> axis_from_vector({"A3": "1.", "C3": "2"}, ("A3", "B3", "C3"))
    (1.0, 0.0, 2.0)
    """
    if not any(letter in words for letter in letters):
        return None
    i, j, k = (float(words.get(letter, "0")) for letter in letters)
    return (i, j, k)


def _turned(a: Vector, letter: str, angle: float) -> Vector:
    c, s = math.cos(angle), math.sin(angle)
    if letter == "A":
        return (a[0], c * a[1] - s * a[2], s * a[1] + c * a[2])
    if letter == "B":
        return (c * a[0] + s * a[2], a[1], c * a[2] - s * a[0])
    if letter == "C":
        return (c * a[0] - s * a[1], s * a[0] + c * a[1], a[2])
    raise GCodeError(f"no rotary axis {letter}; use A, B or C")
