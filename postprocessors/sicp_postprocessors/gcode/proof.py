"""The proof of a program before it is written: forward kinematics of its rounded words against the path."""

from __future__ import annotations

import numpy as np

from sicp_cam.errors import PathError
from sicp_cam.model import Program
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.checks import move_place
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions

__all__ = ["prove"]

_PRECISE_DEG = 1e-4
_VECTOR_DEG = 60.0
"""A unit vector whose components are off by half a decimal is off by less than this times the decimal, in degrees."""


def prove(program: Program, positions: Positions, options: GCodeOptions) -> None:
    """Compare what is written of each move with the path: within the decimals, and the cone of the pole.

    Raises
    ------
    PathError
        If a block misses tip or axis, with its move and line.
    """
    cone = np.zeros(len(positions.origin))
    precise = _VECTOR_DEG * 10.0**-options.axis_decimals
    if positions.angles is not None:
        precise = 10.0**-options.angle_decimals
        cone[positions.angles.held] = options.singular_cone_deg
    off_axis = ~(positions.axis_errors_deg <= max(_PRECISE_DEG, precise) + cone)
    off_tip = ~(positions.tip_errors_mm <= mm_per_unit(options.units) * 10.0**-options.position_decimals)
    wrong = off_axis | off_tip
    if not wrong.any():
        return
    block = int(np.argmax(wrong))
    missed = f"tip by {positions.tip_errors_mm[block]:.5f} mm"
    if off_axis[block]:
        missed = f"tool axis by {positions.axis_errors_deg[block]:.5f} degrees"
    place = move_place(program.path, int(positions.origin[block]))
    raise PathError(f"{place}: the words miss the {missed}, by forward kinematics; nothing was written: report this")
