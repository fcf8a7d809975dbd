"""The machine, and how program and tool are set up in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray
from sicp_postprocessors.gcode.forward import linear_positions, tips_of
from sicp_postprocessors.gcode.machine import Machine

__all__ = ["Setting"]


@dataclass(frozen=True, slots=True)
class Setting:
    """The machine, the length of the tool, and the zero of the program in the machine."""

    machine: Machine
    tool_length_mm: float = 0.0
    zero_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def linear(self, deg: FloatArray, tips_mm: FloatArray) -> FloatArray:
        """Return the linear axes (n, 3), as programmed, for tips (n, 3) at angles (n, 2)."""
        return linear_positions(self.machine, deg, tips_mm, self.tool_length_mm, np.array(self.zero_mm))

    def tips(self, deg: FloatArray, linear_mm: FloatArray) -> FloatArray:
        """Return the tips (n, 3) at programmed linear axes (n, 3) and angles (n, 2), by forward kinematics."""
        return tips_of(self.machine, deg, linear_mm, self.tool_length_mm, np.array(self.zero_mm))
