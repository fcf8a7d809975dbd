"""Where the flange is for given joints, and which joints bring it there: closed, for arms with a spherical wrist.

Eight configurations reach a pose, named with VAL3's words:

- shoulder: `lefty` where the wrist is in front of axis 1, in the direction that joint 1 looks; `righty` behind it;
- elbow: `epositive` where joint 3 bends forward from the stretched arm, `enegative` backward;
- wrist: `wpositive` where joint 5 bends forward, `wnegative` backward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from sicp_cam.model import BoolArray, FloatArray
from sicp_postprocessors.arm.model import Arm

__all__ = ["CONFIGURATIONS", "Configuration", "Solution", "forward", "inverse", "wrist_centres"]


@dataclass(frozen=True, slots=True)
class Configuration:
    """One of the eight ways to reach a pose."""

    shoulder: str
    elbow: str
    wrist: str

    def __str__(self) -> str:
        """Return its three words."""
        return f"{self.shoulder}, {self.elbow}, {self.wrist}"


CONFIGURATIONS = tuple(
    Configuration(*words)
    for words in product(("lefty", "righty"), ("epositive", "enegative"), ("wpositive", "wnegative"))
)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Joints of n poses in one configuration.

    Parameters
    ----------
    joints_deg
        (n, 6) as the controller counts; each of the turns within 180 degrees of its straight-up count. Where a pose
        is out of reach, those of the nearest place within.
    beyond_mm
        (n,) how far the wrist is out of reach; 0 where it is within.
    shoulder_mm
        (n,) how far the wrist is in front of axis 1 (negative: behind); near 0 joint 1 may turn fast.
    elbow_deg, wrist_deg
        (n,) bend of the elbow and of the wrist; near 0 the arm or the wrist is straight.
    """

    joints_deg: FloatArray
    beyond_mm: FloatArray
    shoulder_mm: FloatArray
    elbow_deg: FloatArray
    wrist_deg: FloatArray

    @property
    def reachable(self) -> BoolArray:
        """Whether each pose is within reach (n,)."""
        return self.beyond_mm <= 0.0


def forward(arm: Arm, joints_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, 3, 3) and positions (n, 3) in mm of the flange in the controller's world.

    Parameters
    ----------
    arm
        The arm.
    joints_deg
        (n, 6) joints as the controller counts them.

    >>> from sicp_postprocessors.arm.files import load_arm
    >>> R, places_mm = forward(load_arm("tx2-90"), np.zeros((1, 6)))
    >>> places_mm.tolist()
    [[50.0, 50.0, 950.0]]
    """
    a1, a2, a3, a4, a5, a6 = np.radians(_model_deg(arm, joints_deg)).T
    a23 = a2 + a3
    R_base_forearm = _turn_z(a1) @ _turn_y(a23)
    R = R_base_forearm @ _turn_z(a4) @ _turn_y(a5) @ _turn_z(a6)
    ahead = (
        arm.shoulder_forward_mm
        + arm.upper_arm_mm * np.sin(a2)
        + arm.forearm_offset_mm * np.cos(a23)
        + arm.forearm_mm * np.sin(a23)
    )
    up = (
        arm.shoulder_in_world_mm
        + arm.upper_arm_mm * np.cos(a2)
        - arm.forearm_offset_mm * np.sin(a23)
        + arm.forearm_mm * np.cos(a23)
    )
    side = arm.elbow_side_mm
    wrist = np.column_stack([ahead * np.cos(a1) - side * np.sin(a1), ahead * np.sin(a1) + side * np.cos(a1), up])
    return R, wrist + arm.flange_mm * R[:, :, 2]


def wrist_centres(arm: Arm, R: FloatArray, places_mm: FloatArray) -> FloatArray:
    """Return where axis 5 must be (n, 3), from axis 1 at the height of axis 2, for poses of the flange."""
    centres: FloatArray = places_mm - arm.flange_mm * R[:, :, 2]
    centres[:, 2] -= arm.shoulder_in_world_mm
    return centres


def inverse(arm: Arm, R: FloatArray, places_mm: FloatArray, configuration: Configuration) -> Solution:
    """Return the joints that bring the flange to n poses in one configuration.

    Parameters
    ----------
    arm
        The arm.
    R, places_mm
        (n, 3, 3) rotations and (n, 3) positions of the flange in the controller's world.
    configuration
        Which of the eight ways.
    """
    front = 1.0 if configuration.shoulder == "lefty" else -1.0
    x, y, up = wrist_centres(arm, R, places_mm).T
    ahead_squared = x * x + y * y - arm.elbow_side_mm**2
    ahead = front * np.sqrt(np.maximum(ahead_squared, 0.0))
    a1 = np.arctan2(y, x) - np.arctan2(arm.elbow_side_mm, ahead)
    too_near_mm = np.where(ahead_squared < 0.0, abs(arm.elbow_side_mm) - np.hypot(x, y), 0.0)
    bend, a2, beyond_mm = _two_links(arm, ahead - arm.shoulder_forward_mm, up, configuration.elbow == "epositive")
    a3 = bend - math.atan2(arm.forearm_offset_mm, arm.forearm_mm)
    a4, a5, a6 = _wrist(R, a1, a2 + a3, configuration.wrist == "wpositive")
    model_deg = np.degrees(np.column_stack([a1, a2, a3, a4, a5, a6]))
    return Solution(
        _counted_deg(arm, model_deg),
        np.maximum(too_near_mm, beyond_mm),
        ahead,
        np.degrees(bend),
        model_deg[:, 4],
    )


def _two_links(
    arm: Arm, ahead: FloatArray, up: FloatArray, positive: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bend of the elbow, turn of axis 2, and how far the wrist is out of reach, for a wrist seen from axis 2."""
    upper, lower = arm.upper_arm_mm, math.hypot(arm.forearm_offset_mm, arm.forearm_mm)
    nearest, furthest = arm.wrist_reach_mm
    distance = np.hypot(ahead, up)
    # A micrometre of slack keeps rounding from calling a stretched arm too short.
    beyond = np.maximum(distance - furthest, nearest - distance)
    beyond = np.where(beyond > 1e-6, beyond, 0.0)
    d = np.clip(distance, nearest, furthest)
    # Factors instead of the cosine's square: exact also where the arm is almost stretched.
    twice = np.sqrt(np.maximum((furthest - d) * (furthest + d) * (d - nearest) * (d + nearest), 0.0))
    bend = np.arctan2(twice, d * d - upper * upper - lower * lower) * (1.0 if positive else -1.0)
    a2 = np.arctan2(ahead, up) - np.arctan2(lower * np.sin(bend), upper + lower * np.cos(bend))
    return bend, a2, beyond


def _wrist(R: FloatArray, a1: FloatArray, a23: FloatArray, positive: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a4, a5, a6 of R = Rz(a1) Ry(a23) Rz(a4) Ry(a5) Rz(a6)."""
    c1, s1, c23, s23 = np.cos(a1), np.sin(a1), np.cos(a23), np.sin(a23)
    sign = 1.0 if positive else -1.0
    # Rows of M = (Rz(a1) Ry(a23))^T R, which is Rz(a4) Ry(a5) Rz(a6).
    ahead = c1[:, None] * R[:, 0] + s1[:, None] * R[:, 1]
    M_0 = c23[:, None] * ahead - s23[:, None] * R[:, 2]
    M_1 = c1[:, None] * R[:, 1] - s1[:, None] * R[:, 0]
    M_22 = s23 * ahead[:, 2] + c23 * R[:, 2, 2]
    a5 = sign * np.arctan2(np.hypot(M_0[:, 2], M_1[:, 2]), M_22)
    a4 = np.arctan2(sign * M_1[:, 2], sign * M_0[:, 2])
    # From the rotation that a4 leaves: exact also where the wrist is straight and a4 is whatever it is.
    c4, s4 = np.cos(a4), np.sin(a4)
    a6 = np.arctan2(c4 * M_1[:, 0] - s4 * M_0[:, 0], c4 * M_1[:, 1] - s4 * M_0[:, 1])
    return a4, a5, a6


def _model_deg(arm: Arm, joints_deg: FloatArray) -> FloatArray:
    return (joints_deg - [j.straight_up_deg for j in arm.joints]) * [float(j.sign) for j in arm.joints]


def _counted_deg(arm: Arm, model_deg: FloatArray) -> FloatArray:
    within = 180.0 - np.remainder(180.0 - model_deg, 360.0)
    counted: FloatArray = within * [float(j.sign) for j in arm.joints] + [j.straight_up_deg for j in arm.joints]
    return counted


def _turn_z(angles: FloatArray) -> FloatArray:
    c, s, zero, one = np.cos(angles), np.sin(angles), np.zeros_like(angles), np.ones_like(angles)
    return np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]), 2, 0)


def _turn_y(angles: FloatArray) -> FloatArray:
    c, s, zero, one = np.cos(angles), np.sin(angles), np.zeros_like(angles), np.ones_like(angles)
    return np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), 2, 0)
