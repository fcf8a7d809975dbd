"""Angles of two rotary axes in the head from tool axes, and back.

The turning axis C carries the tilting axis: the tool axis is Rz(C) Rx(A) e_z for the kinematics "AC" and
Rz(C) Ry(B) e_z for "BC". Both sets of a direction, (tilt, turn) and (-tilt, turn + 180), give the same axis. At tilt 0
the turn is free: near this pole it is held, so that the head does not spin for nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sicp_cam.model import BoolArray, FloatArray

__all__ = ["TURN_OF_TILT_DEG", "HeadAngles", "axes_from_angles", "axis_errors_deg", "head_angles"]

TURN_OF_TILT_DEG = {"AC": 90.0, "BC": 0.0}
"""Turn C minus the direction in x, y that a positive tilt leans to: C = atan2(i, -j) for AC, atan2(j, i) for BC."""


@dataclass(frozen=True, slots=True, eq=False)
class HeadAngles:
    """Continuous angles of a head along a path, in degrees; `held` marks moves near the pole whose turn was held."""

    tilt_deg: FloatArray
    turn_deg: FloatArray
    held: BoolArray


def head_angles(axes: FloatArray, kinematics: str, cone_deg: float) -> HeadAngles:
    """Solve the two angles for (n, 3) unit axes, as the nearest of all solutions to those of the move before.

    Parameters
    ----------
    axes
        Unit vectors from tip to holder.
    kinematics
        "AC" or "BC".
    cone_deg
        Within this angle of the pole the turn is held; the axis is then wrong by at most this angle.

    Notes
    -----
    Turns are unwrapped: they pass through 180 degrees and run on. The first move off the pole has positive tilt and a
    turn from -180 to 180; moves at the pole before it take that turn.
    """
    leaning = np.hypot(axes[:, 0], axes[:, 1])
    steep = np.degrees(np.arctan2(leaning, axes[:, 2]))
    heading = np.degrees(np.arctan2(axes[:, 1], axes[:, 0])) + TURN_OF_TILT_DEG[kinematics]
    at_pole = np.minimum(steep, 180.0 - steep) <= cone_deg
    free = np.flatnonzero(~at_pole)
    turn = math.remainder(float(heading[free[0]]), 360.0) if len(free) else 0.0
    tilt = float(steep[free[0]]) if len(free) else 0.0
    tilts, turns = np.empty(len(axes)), np.empty(len(axes))
    rows = zip(steep.tolist(), heading.tolist(), at_pole.tolist(), axes.tolist(), strict=True)
    for row, (steep_deg, heading_deg, held, axis) in enumerate(rows):
        if held:
            tilt = _tilt_at_pole(axis, turn - TURN_OF_TILT_DEG[kinematics], tilt)
        else:
            tilt, turn = _nearest(steep_deg, heading_deg, tilt, turn)
        tilts[row], turns[row] = tilt, turn
    return HeadAngles(tilts, turns, at_pole)


def axes_from_angles(tilt_deg: FloatArray, turn_deg: FloatArray, kinematics: str) -> FloatArray:
    """Return the (n, 3) tool axes of a head (forward kinematics).

    >>> axes_from_angles(np.array([30.0]), np.array([0.0]), "BC").round(6).tolist()
    [[0.5, 0.0, 0.866025]]
    """
    tilt, turn = np.radians(tilt_deg), np.radians(turn_deg)
    if kinematics == "AC":
        return np.column_stack([np.sin(turn) * np.sin(tilt), -np.cos(turn) * np.sin(tilt), np.cos(tilt)])
    return np.column_stack([np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt)])


def axis_errors_deg(axes: FloatArray, others: FloatArray) -> FloatArray:
    """Return the angles between pairs of unit vectors, exact for small angles, which the arc cosine is not."""
    chords = np.linalg.norm(axes - others, axis=1)
    errors: FloatArray = np.degrees(2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0)))
    return errors


def _nearest(steep: float, heading: float, tilt: float, turn: float) -> tuple[float, float]:
    """Return the solution nearest to the angles before; on a tie that with positive tilt."""
    candidates = [(steep, _unwrapped(heading, turn)), (-steep, _unwrapped(heading + 180.0, turn))]
    return min(candidates, key=lambda angles: abs(angles[0] - tilt) + abs(angles[1] - turn))


def _unwrapped(angle: float, near: float) -> float:
    return near + math.remainder(angle - near, 360.0)


def _tilt_at_pole(axis: list[float], lean_deg: float, tilt: float) -> float:
    """Return the tilt that comes nearest to an axis at the pole while the turn is held."""
    lean = math.radians(lean_deg)
    sideways = axis[0] * math.cos(lean) + axis[1] * math.sin(lean)
    steep = math.degrees(math.atan2(sideways, axis[2]))
    near = _unwrapped(steep, tilt)
    # An axis that turns round from one pole to the other comes from 180 degrees back to 0, not on to 360.
    return steep if abs(near) > 270.0 else max(-180.0, min(180.0, near))
