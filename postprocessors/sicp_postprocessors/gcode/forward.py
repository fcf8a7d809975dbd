"""Forward kinematics of a five-axis machine: where tip and tool axis are in the part at given positions of the axes.

Rotations about lines, one after the other along the chain from the tool to the part; nothing here knows how the
positions were found, so that what is written can be proved by it.
"""

from __future__ import annotations

import numpy as np

from sicp_cam.model import FloatArray
from sicp_postprocessors.gcode.machine import Machine, RotaryAxis

__all__ = ["axes_of", "linear_positions", "tips_of", "turned"]


def axes_of(machine: Machine, angles_deg: FloatArray) -> FloatArray:
    """Return the tool axes (n, 3) in the part frame at angles (n, 2) of the first and second rotary axis.

    >>> from sicp_postprocessors.gcode.machines import load_machine
    >>> (axes_of(load_machine("head-bc"), np.array([[90.0, 30.0]])).round(6) + 0.0).tolist()
    [[0.0, 0.5, 0.866025]]
    """
    axes = np.broadcast_to(np.array(machine.home_axis), (len(angles_deg), 3))
    for which in (1, 0):
        axes = turned(axes, machine.rotaries[which].tool_direction, angles_deg[:, which])
    return axes


def tips_of(
    machine: Machine,
    angles_deg: FloatArray,
    linear_mm: FloatArray,
    tool_length_mm: float,
    zero_mm: FloatArray,
) -> FloatArray:
    """Return the tips (n, 3) in the part frame for programmed X, Y, Z (n, 3) of a control without tip control.

    Parameters
    ----------
    machine
        With the points of both rotary axes.
    angles_deg
        (n, 2) angles of the first and second rotary axis.
    linear_mm
        (n, 3) programmed positions: where the tip is at zero of the rotary axes.
    tool_length_mm
        From the gauge point to the tip.
    zero_mm
        (3,) origin of the program in the machine frame, at zero of the rotary axes.
    """
    home_tip = -tool_length_mm * np.array(machine.home_axis)
    points = np.broadcast_to(home_tip, (len(angles_deg), 3))
    gauge = linear_mm + zero_mm - home_tip
    second, first = machine.rotaries[1], machine.rotaries[0]
    if second.on == "head":
        points = _about(points, second, angles_deg[:, 1])
    if first.on == "head":
        points = _about(points, first, angles_deg[:, 0])
    points = points + gauge
    if second.on == "table":
        points = _about(points, second, angles_deg[:, 1])
    if first.on == "table":
        points = _about(points, first, angles_deg[:, 0])
    tips: FloatArray = points - zero_mm
    return tips


def linear_positions(
    machine: Machine,
    angles_deg: FloatArray,
    tips_mm: FloatArray,
    tool_length_mm: float,
    zero_mm: FloatArray,
) -> FloatArray:
    """Return the programmed X, Y, Z (n, 3) that bring the tip to `tips_mm` (n, 3); the inverse of `tips_of`.

    The part is carried by its tables to where it stands in the machine; the heads carry the tip away from the gauge
    point; what is left between the two is the way of the linear axes.
    """
    home_tip = -tool_length_mm * np.array(machine.home_axis)
    part = tips_mm + zero_mm
    for which, axis in enumerate(machine.rotaries):
        if axis.on == "table":
            part = _about(part, axis, -angles_deg[:, which])
    tool = np.broadcast_to(home_tip, part.shape)
    for which in (1, 0):
        if machine.rotaries[which].on == "head":
            tool = _about(tool, machine.rotaries[which], angles_deg[:, which])
    linear: FloatArray = part - tool + home_tip - zero_mm
    return linear


def turned(vectors: FloatArray, direction: FloatArray, angles_deg: FloatArray) -> FloatArray:
    """Return vectors (n, 3) turned right-handed about a unit vector (3,) by angles (n,), by Rodrigues' formula."""
    angles = np.radians(angles_deg)
    cosine, sine = np.cos(angles), np.sin(angles)
    # Column by column, which is several times faster than rows of three.
    x, y, z = (np.ascontiguousarray(column) for column in vectors.T)
    i, j, k = direction.tolist()
    along = (i * x + j * y + k * z) * (1.0 - cosine)
    result: FloatArray = np.empty((len(angles), 3))
    result[:, 0] = x * cosine + (j * z - k * y) * sine + along * i
    result[:, 1] = y * cosine + (k * x - i * z) * sine + along * j
    result[:, 2] = z * cosine + (i * y - j * x) * sine + along * k
    return result


def _about(points: FloatArray, axis: RotaryAxis, angles_deg: FloatArray) -> FloatArray:
    """Return points turned about the line of an axis, as the tool turns relative to the part."""
    if axis.point_mm is None:
        raise ValueError(f"the machine has no point for its axis {axis.letter}")
    centre = np.array(axis.point_mm)
    about: FloatArray = turned(points - centre, axis.tool_direction, angles_deg) + centre
    return about
