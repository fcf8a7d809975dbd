"""Choose the contours that a tool path follows, among all contours of a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.projection import nearest
from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["Assignment", "assign"]

AXIS_PENALTY_MM = 10.0
"""What a tool axis square to a contour's outward normal counts for, in mm of distance.

The edges of both skins of a thin part lie closer together than a path may run beside its edge; only the tool axis,
which leaves the part on the outer side, tells them apart.
"""
LEAST_SHARE = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """Which contour each move follows.

    Parameters
    ----------
    contour
        (n,) index of the contour of each move.
    distance_mm
        (n,) distance of each move from its contour.
    used
        Indices of the contours that cutting moves follow, most used first.
    """

    contour: IntArray
    distance_mm: FloatArray
    used: tuple[int, ...]


def assign(tips_mm: FloatArray, axes: FloatArray, cutting: BoolArray, contours: Sequence[FramedCurve]) -> Assignment:
    """Assign every move of a path to the contour that it follows.

    Parameters
    ----------
    tips_mm, axes
        (n, 3) tips and unit tool axes, part frame.
    cutting
        (n,) True for moves that cut; only they decide which contours are used.
    contours
        At least one contour, part frame.
    """
    distance = np.empty((len(tips_mm), len(contours)))
    score = np.empty_like(distance)
    for i, curve in enumerate(contours):
        s_mm, distance[:, i] = nearest(tips_mm, curve)
        agreement = np.sum(at(curve, s_mm).outward * axes, axis=1)
        score[:, i] = distance[:, i] + AXIS_PENALTY_MM * (1.0 - agreement)
    wins = np.bincount(np.argmin(score[cutting], axis=1), minlength=len(contours))
    used = tuple(int(i) for i in np.argsort(-wins, kind="stable") if wins[i] >= max(1.0, LEAST_SHARE * cutting.sum()))
    chosen = np.array(used)[np.argmin(score[:, used], axis=1)]
    return Assignment(chosen, distance[np.arange(len(tips_mm)), chosen], used)
