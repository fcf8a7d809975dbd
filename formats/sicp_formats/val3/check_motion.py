"""The path that a VAL3 application makes: blends that do not fit their moves, orientations that jump."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.findings import Level
from sicp_cam.model import BoolArray, FloatArray
from sicp_formats.val3.check_files import Application
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.check_steps import Step
from sicp_formats.val3.check_walk import walk

__all__ = ["check_motion"]

_ROUNDING_MM = 2e-3
"""By how much the halves of moves may differ from blends for the decimals that points are written with."""
_JUMP_DEG = 30.0
_JUMP_DEG_MM = 5.0
_SMOOTH = 0.2
_NOWHERE = (np.nan,) * 6


def check_motion(application: Application, report: Report, most: int) -> None:
    """Walk along the application and check what its moves make together."""
    steps, stops = walk(application, report, most)
    if not steps:
        return
    poses = np.array([_NOWHERE if step.pose is None else step.pose for step in steps])
    joined = _joined(steps)
    lengths = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1)
    lengths[~joined] = np.nan
    _check_blends(steps, stops, lengths, report)
    _check_orientations(steps, poses, lengths, report)
    _tell_of_the_world(application, steps, report)


def _joined(steps: Sequence[Step]) -> BoolArray:
    """Return for each pair of neighbours (n - 1,) whether the second follows the first in the same frame."""
    return np.array(
        [not b.gap and a.father == b.father and a.father != "" for a, b in pairwise(steps)],
        np.bool_,
    )


def _check_blends(steps: Sequence[Step], stops: frozenset[int], lengths: FloatArray, report: Report) -> None:
    running = np.ones(len(steps), np.bool_)
    running[list(stops)] = False
    leaves, reaches = np.array([[step.leave, step.reach] for step in steps]).T * running
    before, behind = np.append(np.nan, lengths), np.append(lengths, np.nan)
    with np.errstate(invalid="ignore"):
        wrong: BoolArray = (leaves > before / 2.0 + _ROUNDING_MM) | (reaches > behind / 2.0 + _ROUNDING_MM)
    told: set[tuple[object, int]] = set()
    for index in np.flatnonzero(wrong).tolist():
        step = steps[index]
        if (step.file, step.line) not in told:
            told.add((step.file, step.line))
            short = np.nanmin([before[index], behind[index]])
            message = (
                f"the move blends over {max(step.leave, step.reach):g} mm, more than half of a neighbouring move of "
                f"{short:.4g} mm; blends overlap: make leave and reach smaller"
            )
            report.add(868, Level.WARN, message, step.file, step.line, kind="blend")


def _check_orientations(steps: Sequence[Step], poses: FloatArray, lengths: FloatArray, report: Report) -> None:
    linear = np.array([step.linear for step in steps[1:]], np.bool_)
    near = np.flatnonzero(linear & np.isfinite(lengths) & np.isfinite(poses[1:]).all(axis=1))
    if not len(near):
        return
    turns = _turns_deg("XYZ", poses[:, 3:], near)
    limit = np.maximum(_JUMP_DEG, _JUMP_DEG_MM * lengths[near])
    jumps = turns > limit
    if not jumps.any():
        return
    # The same numbers in the other order of the axes: where that path is smooth, the order is what is wrong.
    other = _turns_deg("ZYX", poses[:, [5, 4, 3]], near)
    smooth = bool((other[jumps] < _SMOOTH * turns[jumps]).all() and (other <= limit).all())
    told: set[tuple[object, int]] = set()
    for at in np.flatnonzero(jumps).tolist():
        step = steps[near[at] + 1]
        if (step.file, step.line) not in told:
            told.add((step.file, step.line))
            why = (
                "read as Rz Ry Rx the path is smooth, but VAL3 means Rx Ry Rz: the angles were written in a wrong order"
                if smooth
                else "is that meant?"
            )
            message = f"the tool turns by {turns[at]:.0f} degrees over {lengths[near[at]]:.4g} mm; {why}"
            report.add(858, Level.WARN, message, step.file, step.line, kind="jump")


def _turns_deg(order: str, angles_deg: FloatArray, pairs: np.ndarray[tuple[int], np.dtype[np.int64]]) -> FloatArray:
    first, second = (Rotation.from_euler(order, angles_deg[at], degrees=True) for at in (pairs, pairs + 1))
    turns: FloatArray = np.degrees((first.inv() * second).magnitude())
    return turns


def _tell_of_the_world(application: Application, steps: Sequence[Step], report: Report) -> None:
    first = next((step for step in steps if step.pose is not None), None)
    if first is not None:
        message = (
            "heights count from VAL3's world, which lies at the shoulder (axes 1 and 2) and not on the base plate: "
            "375 mm above it for a TX2-60, 478 mm for a TX2-90"
        )
        report.add(859, Level.INFO, message, first.file, first.line, kind="shoulder")
