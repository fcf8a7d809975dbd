"""Tool axis from the orientation words of G-code, vector components or two rotary angles, and the angles back."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sicp_formats.gcode.words import GCodeError
from sicp_formats.paths.arcs import Vector, cross, dot

__all__ = ["ROTARY_CHOICES", "angles_near", "axis_from_angles", "axis_from_vector"]

ROTARY_CHOICES = ("AC", "BC", "AB", "BA")
_UNIT: dict[str, Vector] = {"A": (1.0, 0.0, 0.0), "B": (0.0, 1.0, 0.0), "C": (0.0, 0.0, 1.0)}
_POLE = 2e-6  # sine of the tilt below which the second axis does nothing but turn the tool about itself


def axis_from_angles(rotary: str, angles_deg: Mapping[str, float]) -> Vector:
    """Return the unit axis (tip to holder) of a head-head machine at the given angles.

    The first letter of `rotary` tilts the tool, the second turns that about its own axis: n = R_second R_first z,
    right-handed, zero at +Z. For ``AC`` that is (sin A sin C, -sin A cos C, cos A), so A = acos k, C = atan2(i, -j);
    for ``BC`` (sin B cos C, sin B sin C, cos B), so B = acos k, C = atan2(j, i).

    >>> [round(c, 6) + 0.0 for c in axis_from_angles("BC", {"B": 90.0, "C": 90.0})]
    [0.0, 1.0, 0.0]
    """
    first, second = rotary[0], rotary[1]
    tilted = _tilted(first, math.radians(math.fmod(angles_deg[first], 360.0)))
    return _turned(tilted, second, math.radians(math.fmod(angles_deg[second], 360.0)))


def angles_near(rotary: str, axis: Vector, near_deg: Mapping[str, float]) -> dict[str, float]:
    """Return the two angles that give a unit axis, of all solutions the one nearest to given angles.

    n = R_second R_first z: the component of n along the second rotary axis does not change when that turns, which
    gives the first angle; the second brings the tilted tool round to n. Where the second axis turns the tool about
    itself it stays as given. Axes out of reach (``AB`` and ``BA`` reach all, to rounding) come as near as they can.

    >>> angles_near("BC", (0.0, 0.0, 1.0), {"B": 5.0, "C": 40.0})
    {'B': 0.0, 'C': 40.0}
    >>> {k: round(v, 6) for k, v in angles_near("AC", (0.5, 0.0, 0.75**0.5), {"A": -20.0, "C": 300.0}).items()}
    {'A': -30.0, 'C': 270.0}
    """
    first, second = rotary[0], rotary[1]
    found = []
    for tilt in _first_angles(first, second, axis):
        tilted = _tilted(first, tilt)
        turn = _turn_between(tilted, axis, _UNIT[second])
        angles = {
            first: _nearest(math.degrees(tilt), near_deg[first]),
            second: near_deg[second] if turn is None else _nearest(math.degrees(turn), near_deg[second]),
        }
        found.append((sum(abs(angles[letter] - near_deg[letter]) for letter in rotary), angles))
    return min(found, key=lambda pair: pair[0])[1]


def axis_from_vector(words: Mapping[str, str], letters: tuple[str, str, str]) -> Vector | None:
    """Return the vector of the three words, a missing one being 0; None if all are missing.

    >>> axis_from_vector({"A3": "1.", "C3": "2"}, ("A3", "B3", "C3"))
    (1.0, 0.0, 2.0)
    """
    if not any(letter in words for letter in letters):
        return None
    i, j, k = (float(words.get(letter, "0")) for letter in letters)
    return (i, j, k)


def _first_angles(first: str, second: str, axis: Vector) -> tuple[float, float]:
    """Return the two angles of the first rotary axis for which the tool has the right part along the second one."""
    along = max(-1.0, min(1.0, dot(axis, _UNIT[second])))
    if second == "C":  # cos(angle) = n_z, from the sine too, as the arc cosine is inexact near the pole
        steep = math.atan2(math.hypot(axis[0], axis[1]), axis[2])
        return (steep, -steep)
    # A tilts z to (0, -sin A, cos A), B to (sin B, 0, cos B): see `_tilted`.
    sine = -along if first == "A" else along
    rest = math.sqrt(max(0.0, 1.0 - sine * sine))
    return (math.atan2(sine, rest), math.atan2(sine, -rest))


def _turn_between(start: Vector, end: Vector, about: Vector) -> float | None:
    """Return the angle about an axis that brings one vector over another, None if either lies along the axis."""
    u, v = cross(about, start), cross(about, end)
    if min(math.hypot(*u), math.hypot(*v)) < _POLE:
        return None
    return math.atan2(dot(about, cross(u, v)), dot(u, v))


def _nearest(angle: float, near: float) -> float:
    return near + math.remainder(angle - near, 360.0)


def _tilted(letter: str, angle: float) -> Vector:
    """Return what becomes of the axis z."""
    s, c = math.sin(angle), math.cos(angle)
    return (0.0, -s, c) if letter == "A" else (s, 0.0, c)


def _turned(a: Vector, letter: str, angle: float) -> Vector:
    c, s = math.cos(angle), math.sin(angle)
    if letter == "A":
        return (a[0], c * a[1] - s * a[2], s * a[1] + c * a[2])
    if letter == "B":
        return (c * a[0] + s * a[2], a[1], c * a[2] - s * a[0])
    if letter == "C":
        return (c * a[0] - s * a[1], s * a[0] + c * a[1], a[2])
    raise GCodeError(f"no rotary axis {letter}; use A, B or C")
