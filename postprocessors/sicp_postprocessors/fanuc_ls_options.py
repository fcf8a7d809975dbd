"""Options of the post of Fanuc listings."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.ranges import Between
from sicp_postprocessors.controllers import ControllerOptions

__all__ = ["FanucLsOptions"]

_CONFIGURATION = re.compile(r"[FN] [UD] [TB], ?-?[0-9], ?-?[0-9], ?-?[0-9]")


@dataclass(frozen=True, slots=True)
class FanucLsOptions(ControllerOptions):
    """Options of the post `ls`. Outputs are DO numbers, or RO3; `pose_angles` = own: W, P, R."""

    pose_angles: Literal["xyz", "own"] = "xyz"
    """How `tool` and `cell` are turned: R = Rx Ry Rz, or `own`: W, P, R, R = Rz(R) Ry(P) Rx(W)."""
    utool: Annotated[int, Between(1, 29)] = 1
    """Number of the tool frame UTOOL."""
    uframe: Annotated[int, Between(0, 61)] = 1
    """Number of the user frame UFRAME; 0 is the world, which on most arms lies at the height of axis 2."""
    frame_register: Annotated[int | None, Between(1, 4000)] = None
    """Position register by which the program itself sets UFRAME and UTOOL; without it they must be set before."""
    payload_schedule: Annotated[int | None, Between(1, 10)] = None
    """PAYLOAD schedule to choose; it is set up on the controller."""
    configuration: str = "N U T, 0, 0, 0"
    """CONFIG of all points: wrist F or N, elbow U or D, shoulder T or B, turns of axes 4 (1), 5, 6."""
    rounding: Literal["CNT", "CD"] = "CNT"
    """Run through points by CNT, which rounds them by speed, or by CD, a distance, where the controller has it."""
    cnt: Annotated[int, Between(0, 100)] = 50
    """CNT of points that are run through; 100 is fastest and farthest off."""
    speed_unit: Literal["auto", "mm/sec", "cm/min"] = "auto"
    """Unit of speeds, which are whole numbers: auto takes mm/sec where it is exact, else cm/min."""
    longest_name: Annotated[int, Between(8, 36)] = 36
    """Letters that a program's name may have: 8 on old controllers."""
    angle_decimals: Annotated[int, Between(3, 6)] = 4
    """Decimals of angles in degrees."""

    signal = re.compile(r"(?:[DR]O)?[1-9][0-9]{0,4}")
    signal_words = "the number of a digital output, such as 7, DO7 or RO3"
    analog = re.compile(r"(?:[AG]O)?[1-9][0-9]{0,3}")
    analog_words = "the number of an analog or group output, such as AO1 or GO2"

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = ControllerOptions.problems(self)
        if not _CONFIGURATION.fullmatch(self.configuration):
            problems.append("option 'configuration' must look like N U T, 0, 0, 0")
        if self.frame_register is not None and (self.tool is None or self.cell is None or self.uframe == 0):
            problems.append(
                "option 'frame_register' sets both frames; give 'tool', 'cell' and a 'uframe' from 1 on too"
            )
        if self.payload is not None:
            problems.append("option 'payload' has no words here; choose a schedule with 'payload_schedule'")
        return problems

    @property
    def cell_is_known(self) -> bool:
        """Say that the controller has the frame, one way or the other."""
        return True

    @property
    def tool_is_known(self) -> bool:
        """Say that the controller has the tool, one way or the other."""
        return True
