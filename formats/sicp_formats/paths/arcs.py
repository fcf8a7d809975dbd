"""Circular arcs and helices of tool paths: their geometry, and the points that stand for them.

An arc runs counter-clockwise about its normal (right-hand rule); whoever reads a clockwise one turns the normal round.
Plain floats throughout: programs hold many short arcs, for which arrays would cost more than they save.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

__all__ = ["Arc", "Vector", "arc_between", "centre_for_radius", "cross", "dot", "minus", "norm", "unit"]

Vector: TypeAlias = tuple[float, float, float]

_SAME_POINT_MM = 1e-6
_LARGEST_STEP_RAD = math.pi / 4.0


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def norm(a: Vector) -> float:
    """Return the length of a vector."""
    return math.hypot(a[0], a[1], a[2])


def unit(a: Vector) -> Vector | None:
    """Return a vector scaled to length one, or None if it has no direction.

    >>> unit((0.0, 3.0, 4.0))
    (0.0, 0.6, 0.8)
    """
    length = norm(a)
    if not math.isfinite(length) or length < 1e-9:
        return None
    return (a[0] / length, a[1] / length, a[2] / length)


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc, or a helix if start and end differ along the normal; lengths in mm.

    Parameters
    ----------
    foot
        Centre, moved along the normal to the height of the start.
    end
        Met exactly: a small difference of the two radii is spread evenly over the arc.
    u, v, normal
        Unit vectors: from the foot to the start, along the travel there, and about which the arc turns.
    radius_start, radius_end
        Distances of start and end from the line through the foot along the normal.
    sweep
        Angle turned, in (0, 2 pi]; a full turn if start and end coincide as seen along the normal.
    rise_mm
        Travel along the normal.
    """

    foot: Vector
    end: Vector
    u: Vector
    v: Vector
    normal: Vector
    radius_start: float
    radius_end: float
    sweep: float
    rise_mm: float

    @property
    def length_mm(self) -> float:
        """Length of the way along the arc."""
        return math.hypot(self.sweep * max(self.radius_start, self.radius_end), self.rise_mm)

    @property
    def end_direction(self) -> Vector:
        """Unit tangent at the end, as seen along the normal."""
        c, s = math.cos(self.sweep), math.sin(self.sweep)
        u, v = self.u, self.v
        return (v[0] * c - u[0] * s, v[1] * c - u[1] * s, v[2] * c - u[2] * s)

    def steps(self, chord_mm: float, step_mm: float) -> int:
        """Return into how many straight pieces the arc must be cut, at least 1.

        No piece may lie farther than `chord_mm` from the arc (sagitta 2 r sin^2(a / 4)) or be longer than `step_mm`.
        """
        radius = max(self.radius_start, self.radius_end)
        largest = 4.0 * math.asin(math.sqrt(min(chord_mm / (2.0 * radius), 1.0)))
        pieces = max(self.sweep / min(largest, _LARGEST_STEP_RAD), self.length_mm / step_mm)
        return max(1, math.ceil(pieces - 1e-9))

    def points(self, steps: int) -> list[Vector]:
        """Return the ends of that many equal pieces: the start is left out, the last one is the end itself."""
        points = [self._at(piece / steps) for piece in range(1, steps)]
        points.append(self.end)
        return points

    def _at(self, share: float) -> Vector:
        radius = self.radius_start + share * (self.radius_end - self.radius_start)
        c, s = radius * math.cos(share * self.sweep), radius * math.sin(share * self.sweep)
        rise = share * self.rise_mm
        f, u, v, n = self.foot, self.u, self.v, self.normal
        return (
            f[0] + c * u[0] + s * v[0] + rise * n[0],
            f[1] + c * u[1] + s * v[1] + rise * n[1],
            f[2] + c * u[2] + s * v[2] + rise * n[2],
        )


def arc_between(start: Vector, end: Vector, centre: Vector, normal: Vector) -> Arc | None:
    """Return the arc from start to end about a centre, counter-clockwise about a unit normal; all in mm.

    Returns None where start or end lie on the centre, so that there is no arc. Whether the two radii agree well
    enough is for the caller to judge.

    >>> arc = arc_between((10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    >>> round(arc.length_mm, 3), arc.steps(0.005, 2.0)
    (15.708, 25)
    """
    from_start, from_end = minus(start, centre), minus(end, centre)
    height_start, height_end = dot(from_start, normal), dot(from_end, normal)
    flat_start, flat_end = _flattened(from_start, normal, height_start), _flattened(from_end, normal, height_end)
    radius_start, radius_end = norm(flat_start), norm(flat_end)
    if min(radius_start, radius_end) < _SAME_POINT_MM:
        return None
    u = (flat_start[0] / radius_start, flat_start[1] / radius_start, flat_start[2] / radius_start)
    v = cross(normal, u)
    sweep = math.atan2(dot(flat_end, v), dot(flat_end, u)) % math.tau
    if norm(minus(flat_end, flat_start)) <= _SAME_POINT_MM or sweep == 0.0:
        sweep = math.tau
    foot = (
        centre[0] + height_start * normal[0],
        centre[1] + height_start * normal[1],
        centre[2] + height_start * normal[2],
    )
    return Arc(foot, end, u, v, normal, radius_start, radius_end, sweep, height_end - height_start)


def centre_for_radius(start: Vector, end: Vector, normal: Vector, radius: float, tolerance_mm: float) -> Vector | None:
    """Return the centre of a counter-clockwise arc that is given by its radius; all in mm.

    Parameters
    ----------
    start, end
        Ends of the arc; their difference along the normal does not matter.
    normal
        Unit vector that the arc turns about.
    radius
        Positive for the arc up to half a turn, negative for the longer one.
    tolerance_mm
        By how much the ends may be farther apart than the diameter.

    Returns
    -------
    tuple or None
        The centre at the height of the start; None if start and end coincide or no circle of that radius joins them.
    """
    chord = minus(end, start)
    chord = _flattened(chord, normal, dot(chord, normal))
    half = norm(chord) / 2.0
    if half <= _SAME_POINT_MM or half > abs(radius) + tolerance_mm / 2.0:
        return None
    to_centre = math.sqrt(max(radius * radius - half * half, 0.0))
    side = cross(normal, chord)
    share = math.copysign(to_centre, radius) / (2.0 * half)
    return (
        start[0] + chord[0] / 2.0 + share * side[0],
        start[1] + chord[1] / 2.0 + share * side[1],
        start[2] + chord[2] / 2.0 + share * side[2],
    )


def _flattened(a: Vector, normal: Vector, height: float) -> Vector:
    return (a[0] - height * normal[0], a[1] - height * normal[1], a[2] - height * normal[2])
