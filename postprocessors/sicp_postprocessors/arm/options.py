"""Options of posts for arms: which robot, and how near to a singular place it may come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from sicp_cam.errors import JobError
from sicp_cam.ranges import Between
from sicp_postprocessors.arm.files import load_arm
from sicp_postprocessors.arm.model import Arm
from sicp_postprocessors.path_checks import PreflightOptions

__all__ = ["ArmOptions"]


@dataclass(frozen=True, slots=True)
class ArmOptions(PreflightOptions):
    """What the path of an arm is checked for."""

    robot: str = ""
    """Arm to check reach, joint limits and speeds with, such as tx2-90, or FILE.toml; none: not checked."""
    singular_deg: Annotated[float, Between(0.01, 45.0)] = 2.0
    """Bend of wrist or elbow below which the arm is told to be near a singular place."""

    def arm(self) -> Arm | None:
        """Return the arm of the option `robot`, None where there is none.

        Raises
        ------
        JobError
            If it is not known, or with every problem of its file.
        """
        return load_arm(self.robot) if self.robot else None

    def arm_problems(self) -> list[str]:
        """Return what is wrong with the robot's name or file."""
        try:
            self.arm()
        except JobError as error:
            return list(error.problems)
        return []
