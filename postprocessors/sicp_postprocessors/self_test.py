"""A short program that shows by eye whether tool, frame and orientation are what the controller thinks they are.

It moves the tip to a known place and along X and Y of the program frame, and then leans the tool about its tip; before
each step it stops and says what the operator must see. It is meant for manual mode at low speed.
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
        ``origin``: above the origin of the program frame by the step; ``start``: at the first point of the path.
    step_mm
        Length of each step along X and Y.
    """
    path = program.path
    at_start = where == "start"
    place = "the first point of the path" if at_start else f"{step_mm:g} mm above the origin of the frame, along its Z"
    centre = path.tips_mm[0] if at_start else np.array([0.0, 0.0, step_mm])
    axis = path.axes[0] if at_start else np.array(_UPRIGHT)
    steps = [
        (centre, axis, f"the tip is at {place}"),
        (centre + step_mm * np.eye(3)[0], axis, f"the tip has moved {step_mm:g} mm along +X of the frame"),
        (centre, axis, "the tip is back"),
        (centre + step_mm * np.eye(3)[1], axis, f"the tip has moved {step_mm:g} mm along +Y of the frame"),
        (centre, axis, "the tip is back"),
        (centre, _leaning(axis, 0), f"the holder leans {LEAN_DEG:g} degrees towards +X, the tip has not moved"),
        (centre, axis, "the holder is back"),
        (centre, _leaning(axis, 1), f"the holder leans {LEAN_DEG:g} degrees towards +Y, the tip has not moved"),
        (centre, axis, "the holder is back"),
    ]
    events = tuple(Event(after, EventKind.STOP, 0.0, f"see that {told}") for after, (_, _, told) in enumerate(steps, 1))
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


def _leaning(axis: FloatArray, towards: int) -> FloatArray:
    """Return a tool axis turned towards an axis of the frame, or away from it where it lies along that one."""
    goal = np.eye(3)[towards]
    side = goal - (goal @ axis) * axis
    if np.linalg.norm(side) < 1e-6:
        side = np.eye(3)[2] - axis[2] * axis
    lean = np.radians(LEAN_DEG)
    leaned: FloatArray = np.cos(lean) * axis + np.sin(lean) * side / np.linalg.norm(side)
    return leaned
