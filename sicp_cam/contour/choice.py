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
NARROW_PENALTY_MM = 5.0
"""What a face too narrow for stability points, such as the wall of a thin part, counts for, in mm of distance."""
SAME_EDGE_MM = 1.0
"""Contours that lie this close to a move are edges of the same place: two skins' corners, a skin and its wall."""


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


def assign(
    tips_mm: FloatArray,
    axes: FloatArray,
    cutting: BoolArray,
    contours: Sequence[FramedCurve],
    on_contour_mm: float,
    narrow: Sequence[bool] | None = None,
) -> Assignment:
    """Assign every move of a path to the contour that it follows.

    Contours are taken one by one, the one that most of the remaining cutting moves prefer first; with it go all moves
    that run along the same edge, so that a tilted tool does not fall to and fro between a skin and its wall.

    Parameters
    ----------
    tips_mm, axes
        (n, 3) tips and unit tool axes, part frame.
    cutting
        (n,) True for feed moves; those near a contour decide which contours are used.
    contours
        At least one contour, part frame.
    on_contour_mm
        Feed moves further than this from every contour approach or retract, and do not decide.
    narrow
        For each contour, True if its face is too narrow to be the skin that is machined.
    """
    distance = np.empty((len(tips_mm), len(contours)))
    agreement = np.empty_like(distance)
    for i, curve in enumerate(contours):
        s_mm, distance[:, i] = nearest(tips_mm, curve)
        agreement[:, i] = np.sum(at(curve, s_mm).outward * axes, axis=1)
    score = distance + AXIS_PENALTY_MM * (1.0 - agreement)
    if narrow is not None:
        score += NARROW_PENALTY_MM * np.array(narrow, dtype=np.float64)
    best = np.argmin(score, axis=1)
    rows = np.arange(len(tips_mm))
    voting = cutting & (distance[rows, best] <= on_contour_mm)
    if not voting.any():
        voting = cutting if cutting.any() else np.ones(len(tips_mm), dtype=bool)
    used = _most_wanted(best, voting, (distance <= distance[rows, best, None] + SAME_EDGE_MM) & (agreement > 0.0))
    chosen = np.array(used)[np.argmin(score[:, used], axis=1)]
    return Assignment(chosen, distance[rows, chosen], used)


def _most_wanted(best: IntArray, voting: BoolArray, alongside: BoolArray) -> tuple[int, ...]:
    """Return the contours taken one by one until every voting move has one alongside."""
    used: list[int] = []
    left = voting.copy()
    while left.any():
        taken = int(np.argmax(np.bincount(best[left], minlength=alongside.shape[1])))
        used.append(taken)
        left &= ~alongside[:, taken] & (best != taken)
    return tuple(used)
