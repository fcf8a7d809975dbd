"""Closed-form inverse kinematics of two rotary axes: both pairs of angles that bring the tool axis to a direction.

The first axis a, the second b and the home axis h of the tool fix a spherical triangle with the corners a, b and v,
where v = R_b h is the tool axis before the first axis turns it to n: its sides are the angles between a and n, b and h,
a and b. The angle of the triangle at b gives the second axis, the headings of n and v about a the first; the mirror
image of the triangle gives the other solution. Half-angle formulas keep full accuracy near the poles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray
from sicp_postprocessors.gcode.forward import turned
from sicp_postprocessors.gcode.machine import Machine

__all__ = ["Solutions", "second_for_held_first", "solve"]


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Both solutions for n directions, in degrees, any turn.

    Parameters
    ----------
    first_deg, second_deg
        (2, n) angles of the first and second rotary axis; row 0 is the solution with the larger second angle.
    pole_deg
        (n,) how far each direction is from the line of the first axis, where that only spins the tool.
    beyond_deg
        (n,) how far each direction is out of reach of the machine; 0 where it is reached.
    """

    first_deg: FloatArray
    second_deg: FloatArray
    pole_deg: FloatArray
    beyond_deg: FloatArray


def solve(machine: Machine, axes: FloatArray) -> Solutions:
    """Return the angles for unit vectors (n, 3) from tip to holder in the part frame.

    >>> from sicp_postprocessors.gcode.machines import load_machine
    >>> found = solve(load_machine("head-ac"), np.array([[0.5, 0.0, 0.75**0.5]]))
    >>> found.first_deg.ravel().round(6).tolist(), found.second_deg.ravel().round(6).tolist()
    ([90.0, -90.0], [30.0, -30.0])
    """
    a, b = machine.rotaries[0].tool_direction, machine.rotaries[1].tool_direction
    home = np.array(machine.home_axis)
    across = _unit(b - (a @ b) * a)
    third = np.cross(a, across)
    along, x, y = axes @ a, axes @ across, axes @ third
    leaning = np.hypot(x, y)
    pole = np.arctan2(leaning, along)
    side_h, side_b = _angle(b, home), _angle(a, b)
    half = (pole + side_h + side_b) / 2.0
    opposite = np.sin(half - side_h) * np.sin(half - side_b)
    beside = np.sin(half) * np.sin(half - pole)
    bend = 2.0 * np.arctan2(np.sqrt(np.maximum(opposite, 0.0)), np.sqrt(np.maximum(beside, 0.0)))
    middle = _turn_between(b, home, a)
    # The tool axis v in the mirror plane of a and b, and how the second axis turns it out of that plane.
    level = (b @ home) * b
    swing = turned((home - level)[None], b, np.array([np.degrees(middle)]))[0]
    cosine, sine, aside = np.cos(bend), np.sin(bend), np.cross(b, swing)
    v_x = level @ across + (swing @ across) * cosine + (aside @ across) * sine
    v_y = level @ third + (swing @ third) * cosine + (aside @ third) * sine
    heading, lead = np.arctan2(y, x), np.arctan2(v_y, v_x)
    most = min(side_h + side_b, 2.0 * np.pi - side_h - side_b)
    beyond = np.maximum(np.maximum(abs(side_h - side_b) - pole, pole - most), 0.0)
    return Solutions(
        np.degrees(np.stack([heading - lead, heading + lead])),
        np.degrees(np.stack([middle + bend, middle - bend])),
        np.degrees(np.minimum(pole, np.pi - pole)),
        np.degrees(beyond),
    )


def second_for_held_first(machine: Machine, axes: FloatArray, first_deg: FloatArray) -> FloatArray:
    """Return the second angle (n,) that comes nearest to directions (n, 3) while the first axis stands at `first_deg`.

    The direction is turned back by the first axis; the second axis then brings the home axis to the same heading.
    """
    a, b = machine.rotaries[0].tool_direction, machine.rotaries[1].tool_direction
    home = np.array(machine.home_axis)
    start = _unit(home - (b @ home) * b)
    back = turned(axes, a, -first_deg)
    angles: FloatArray = np.degrees(np.arctan2(back @ np.cross(b, start), back @ start))
    return angles


def _unit(vector: FloatArray) -> FloatArray:
    result: FloatArray = vector / np.linalg.norm(vector)
    return result


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def _turn_between(about: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the angle about a unit vector that brings one vector to the heading of another."""
    return float(np.arctan2(about @ np.cross(start, end), start @ end - (about @ start) * (about @ end)))
