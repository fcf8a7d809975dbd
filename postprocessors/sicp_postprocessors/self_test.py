"""A short program that shows by eye whether tool, frame and orientation are what the controller thinks they are.

It moves the tip to a known place and along the two axes of the program frame that lie across the tool, and then leans
the tool about its tip; before the first move and after each one it stops and asks what the operator sees. No step goes
towards the part. It is meant for manual mode at low speed.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from sicp_cam.model import Event, EventKind, FloatArray, Program, Status, ToolPath

__all__ = ["LEAN_DEG", "self_test_program"]

LEAN_DEG = 15.0
_FEED_MM_MIN = 600.0
_UPRIGHT = (0.0, 0.0, 1.0)


def self_test_program(program: Program, name: str, where: str, step_mm: float) -> Program:
    """Return the program of the self-test, in the frame of another program.

    Parameters
    ----------
    program
        Where the frame comes from.
    name
        Name of the self-test.
    where
        ``origin``: off the origin of the program frame, along its Z; ``start``: off the first point of the path, along
        the tool; by one step.
    step_mm
        Length of each step.
    """
    path = program.path
    at_start = where == "start"
    axis = path.axes[0] if at_start else np.array(_UPRIGHT)
    # Away from the part, along the tool: no step goes towards it.
    centre = (path.tips_mm[0] if at_start else np.zeros(3)) + step_mm * axis
    place = f"{step_mm:g} mm off the {'first point' if at_start else 'origin'}, along the tool"
    (u, towards_u), (v, towards_v) = _across(axis)
    steps = [
        (centre, axis, f"{place}?"),
        (centre + step_mm * u, axis, f"moved {step_mm:g} mm to {towards_u}?"),
        (centre, axis, "back?"),
        (centre + step_mm * v, axis, f"moved {step_mm:g} mm to {towards_v}?"),
        (centre, axis, "back?"),
        (centre, _leaning(axis, u), f"leans {LEAN_DEG:g} deg to {towards_u}, tip stays?"),
        (centre, axis, "back?"),
        (centre, _leaning(axis, v), f"leans {LEAN_DEG:g} deg to {towards_v}, tip stays?"),
        (centre, axis, "back?"),
    ]
    first = Event(0, EventKind.STOP, 0.0, f"goes {place}")
    events = (first, *(Event(after, EventKind.STOP, 0.0, told) for after, (_, _, told) in enumerate(steps, 1)))
    tips, axes = np.array([tip for tip, _, _ in steps]), np.array([axis for _, axis, _ in steps])
    count = len(steps)
    rapid = np.arange(count) == 0
    test = ToolPath(tips, axes, np.where(rapid, 0.0, _FEED_MM_MIN), rapid, np.zeros(count, np.int64), events)
    return replace(
        program,
        name=name,
        path=test,
        status=(Status.APPROACH,) * count,
        notes=("self-test: manual mode, low speed, finger on the stop", *program.notes),
        columns=MappingProxyType({}),
        source_moves=None,
    )


def _across(axis: FloatArray) -> list[tuple[FloatArray, str]]:
    """Return the two axes of the frame that lie most across a tool axis, made square to it, with their names."""
    across = sorted(range(3), key=lambda k: abs(float(axis[k])))[:2]
    directions = []
    for k in sorted(across):
        side = np.eye(3)[k] - axis[k] * axis
        directions.append((side / np.linalg.norm(side), f"+{'XYZ'[k]}"))
    return directions


def _leaning(axis: FloatArray, side: FloatArray) -> FloatArray:
    """Return a tool axis turned towards a direction across it."""
    lean = np.radians(LEAN_DEG)
    leaned: FloatArray = np.cos(lean) * axis + np.sin(lean) * side
    return leaned
