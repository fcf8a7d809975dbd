"""Joints of an arm along a path: at every move and between moves, without jumps, and within the limits where that goes.

Moves are straight in the tip, and turn the tool about one axis at an even rate; so places in between are checked too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_postprocessors.arm.kinematics import Configuration, Solution, inverse
from sicp_postprocessors.arm.model import Arm

__all__ = ["JointPath", "Places", "follow", "places_along"]

Value = TypeVar("Value", np.float64, np.bool_)

_LIMIT_TOLERANCE_DEG = 1e-6
_MOST_BETWEEN = 300_000
"""Places between the ends of moves, at most; where there would be more, they stand further apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Poses of the flange along a path of n moves, m of them, in the controller's world.

    Parameters
    ----------
    move
        (m,) index of the move that each place lies on; the last place of a move is its end.
    R, places_mm
        (m, 3, 3) rotations and (m, 3) positions of the flange.
    seconds
        (m,) time from the place before at the speed of the move; NaN where that is not known, or the tip stands still.
    starts
        (n,) row of the first place of each move.
    apart_mm, apart_deg
        Largest distance, and turn, from one place to the next within a move.
    """

    move: IntArray
    R: FloatArray
    places_mm: FloatArray
    seconds: FloatArray
    starts: IntArray
    apart_mm: float
    apart_deg: float

    def worst(self, values: npt.NDArray[Value]) -> npt.NDArray[Value]:
        """Return the largest of the values (m, ...) on each move (n, ...), or whether any is true."""
        largest: npt.NDArray[Value] = np.maximum.reduceat(values, self.starts, axis=0)
        return largest


def places_along(
    tips_mm: FloatArray,
    R: FloatArray,
    speeds_mm_s: FloatArray,
    joint_moves: BoolArray,
    T_flange_tool: FloatArray,
    *,
    step_mm: float,
    step_deg: float,
) -> Places:
    """Return the poses of the flange at the end of each move, and between the ends where a move is long or turns far.

    Parameters
    ----------
    tips_mm, R
        (n, 3) tips and (n, 3, 3) rotations of the tool in the controller's world.
    speeds_mm_s
        (n,) speed of the tip on each move; 0 where it is not known.
    joint_moves
        (n,) True where only the end of a move matters; the first move always is one.
    T_flange_tool
        (4, 4) pose of the tool in the flange.
    step_mm, step_deg
        How far apart places are, at most, unless there would be too many of them.
    """
    lengths = np.zeros(len(tips_mm))
    lengths[1:] = np.linalg.norm(np.diff(tips_mm, axis=0), axis=1)
    turns = np.zeros(len(tips_mm))
    chords = np.linalg.norm(np.diff(R, axis=0), axis=(1, 2)) / (2.0 * math.sqrt(2.0))
    turns[1:] = np.degrees(2.0 * np.arcsin(np.minimum(chords, 1.0)))
    straight = ~joint_moves
    straight[:1] = False
    ratio = np.where(straight, np.maximum(lengths / step_mm, turns / step_deg), 0.0)
    ratio *= min(1.0, _MOST_BETWEEN / max(float(ratio.sum()), 1.0))
    counts = np.maximum(np.ceil(ratio), 1.0).astype(np.int64)
    starts = np.cumsum(counts) - counts
    move = np.repeat(np.arange(len(tips_mm)), counts)
    part = (np.arange(len(move)) - starts[move] + 1) / counts[move]
    with np.errstate(divide="ignore", invalid="ignore"):
        seconds = np.where(straight & (lengths > 1e-6) & (speeds_mm_s > 0), lengths / counts / speeds_mm_s, np.nan)
    between = np.flatnonzero(part < 1.0)
    tips, turned = tips_mm[move], R[move]
    if len(between):
        i, t = move[between], part[between]
        tips[between] = tips_mm[i - 1] + t[:, None] * (tips_mm[i] - tips_mm[i - 1])
        spans = Rotation.from_matrix(np.swapaxes(R[i - 1], 1, 2) @ R[i]).as_rotvec()
        turned[between] = R[i - 1] @ Rotation.from_rotvec(t[:, None] * spans).as_matrix()
    R_flange = turned @ T_flange_tool[:3, :3].T
    return Places(
        move,
        R_flange,
        tips - R_flange @ T_flange_tool[:3, 3],
        seconds[move],
        starts,
        float(np.max(np.where(straight, lengths, 0.0) / counts)),
        float(np.max(np.where(straight, turns, 0.0) / counts)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Joints along m places in one configuration.

    Parameters
    ----------
    configuration
        Which one.
    joints_deg
        (m, 6) joints without jumps, in the turns in which the path breaks their limits least.
    beyond_deg
        (m, 6) how far each joint is beyond its limits; 0 within, or where the place is out of reach.
    solution
        What the inverse kinematics found.
    margin_deg
        How near any joint comes to a limit; negative beyond.
    bad_starts_deg
        For each joint, the counts that it may have at the first place, but that lead beyond its limits later.
    """

    configuration: Configuration
    joints_deg: FloatArray
    beyond_deg: FloatArray
    solution: Solution
    margin_deg: float
    bad_starts_deg: tuple[tuple[float, ...], ...]

    @property
    def broken(self) -> BoolArray:
        """Where a place is out of reach, or a joint beyond its limits (m,)."""
        broken: BoolArray = ~self.solution.reachable | (self.beyond_deg > 0.0).any(axis=1)
        return broken


def follow(arm: Arm, places: Places, configuration: Configuration) -> JointPath:
    """Return the joints along the places in one configuration."""
    solution = inverse(arm, places.R, places.places_mm, configuration)
    joints = solution.joints_deg.copy()
    within = np.flatnonzero(solution.reachable)
    bad_starts: list[tuple[float, ...]] = []
    for number, joint in enumerate(arm.joints):
        column = np.unwrap(joints[within, number], period=360.0)
        turns, bad = (0, ()) if joint.unlimited else _turns(column, joint.lowest_deg, joint.highest_deg)
        joints[within, number] = column + 360.0 * turns
        bad_starts.append(bad)
    low, high = arm.limits_deg
    margins = np.minimum(joints - low, high - joints)
    beyond = np.where((margins < -_LIMIT_TOLERANCE_DEG) & solution.reachable[:, None], -margins, 0.0)
    nearest = float(margins[within].min(initial=math.inf))
    return JointPath(configuration, joints, beyond, solution, nearest, tuple(bad_starts))


def _turns(column: FloatArray, low: float, high: float) -> tuple[int, tuple[float, ...]]:
    """Return by how many whole turns a joint is to start elsewhere, and the counts at which it must not start.

    >>> _turns(np.array([170.0, 300.0]), -270.0, 270.0)
    (-1, (170.0,))
    """
    if not len(column):
        return 0, ()
    low, high, start = low - _LIMIT_TOLERANCE_DEG, high + _LIMIT_TOLERANCE_DEG, float(column[0])
    starts = range(math.ceil((low - start) / 360.0), math.floor((high - start) / 360.0) + 1)
    if not starts:
        return round((low + high - 2.0 * start) / 720.0), ()
    broken = {k: int(np.count_nonzero((column + 360.0 * k < low) | (column + 360.0 * k > high))) for k in starts}
    best = min(starts, key=lambda k: (broken[k], abs(start + 360.0 * k)))
    if broken[best]:
        return best, ()
    return best, tuple(start + 360.0 * k for k in starts if broken[k])
