"""What a six-axis arm with a spherical wrist is: lengths, joints with their limits, and how its controller counts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray

__all__ = ["Arm", "Joint"]


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint as the controller counts it, in degrees. What is not known is infinite, and not checked.

    Parameters
    ----------
    lowest_deg, highest_deg
        Limits of the joint, both allowed.
    fastest_deg_s
        Highest speed, either way.
    sign, straight_up_deg
        The model counts sign * (q - straight_up_deg): 0 where the arm stands straight up, and positive as `Arm` says.
    spindle
        True for a spindle that is built in as joint 6: it turns as it likes, and is not checked.
    """

    lowest_deg: float = -math.inf
    highest_deg: float = math.inf
    fastest_deg_s: float = math.inf
    sign: int = 1
    straight_up_deg: float = 0.0
    spindle: bool = False

    @property
    def unlimited(self) -> bool:
        """Whether there are no limits to check."""
        return self.spindle or math.isinf(self.lowest_deg)


@dataclass(frozen=True, slots=True)
class Arm:
    """Lengths in mm and six joints.

    Straight up, all links point along +z of the base, and the flange has the axes of the base. Joints 1, 4 and 6 turn
    about +z then, 2, 3 and 5 about +y: a positive turn of 2, 3 or 5 bends the arm forward, along +x.

    Parameters
    ----------
    name
        As the operator knows it.
    world
        Where the controller's world has its origin: on axis 1 at the height of axis 2, or on the base plate.
    shoulder_height_mm
        Axis 2 above the base plate.
    shoulder_forward_mm
        Axis 2 in front of axis 1.
    elbow_side_mm
        Axis 4 beside axis 1, along +y.
    upper_arm_mm
        From axis 2 to axis 3.
    forearm_offset_mm
        Axis 4 in front of axis 3, while the arm stands straight up.
    forearm_mm
        From axis 3 to axis 5, along axis 4.
    flange_mm
        From axis 5 to the face of the flange, along axis 6.
    joints
        Joints 1 to 6.
    sources
        Where the numbers are from, by subject.
    remark
        What the operator should know about the numbers; may be empty.

    Notes
    -----
    The kind of arm that has a closed solution: Brandstoetter, Angerer, Hofbaur, "An analytical solution of the inverse
    kinematics problem of industrial serial manipulators with an ortho-parallel basis and a spherical wrist" (2014).
    """

    name: str
    world: str
    shoulder_height_mm: float
    shoulder_forward_mm: float
    elbow_side_mm: float
    upper_arm_mm: float
    forearm_offset_mm: float
    forearm_mm: float
    flange_mm: float
    joints: tuple[Joint, ...]
    sources: tuple[tuple[str, str], ...] = ()
    remark: str = ""

    @property
    def shoulder_in_world_mm(self) -> float:
        """Height of axis 2 in the controller's world."""
        return 0.0 if self.world == "shoulder" else self.shoulder_height_mm

    @property
    def wrist_reach_mm(self) -> tuple[float, float]:
        """Least and largest distance of the wrist (axis 5) from axis 2, measured at right angles to axis 2.

        >>> from sicp_postprocessors.arm.files import load_arm
        >>> load_arm("tx2-90").wrist_reach_mm
        (0.0, 850.0)
        """
        forearm = math.hypot(self.forearm_offset_mm, self.forearm_mm)
        return abs(self.upper_arm_mm - forearm), self.upper_arm_mm + forearm

    @property
    def limits_deg(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest counts (6,) of the joints; infinite where there are none to check."""
        low = [-math.inf if j.unlimited else j.lowest_deg for j in self.joints]
        return np.array(low), np.array([math.inf if j.unlimited else j.highest_deg for j in self.joints])

    @property
    def speeds_deg_s(self) -> FloatArray:
        """Highest speeds (6,) of the joints; infinite where there are none to check."""
        return np.array([math.inf if j.spindle else j.fastest_deg_s for j in self.joints])

    def unknown(self) -> list[str]:
        """Return what is not known, and so not checked, in words."""
        told = []
        for number, joint in enumerate(self.joints, 1):
            if joint.spindle:
                told.append(f"joint {number}, which is the spindle")
                continue
            if math.isinf(joint.lowest_deg):
                told.append(f"the limits of joint {number}")
            if math.isinf(joint.fastest_deg_s):
                told.append(f"the speed of joint {number}")
        return told
