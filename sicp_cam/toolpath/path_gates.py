"""Judge a corrected path: how far its moves and axes were carried, how evenly, and that it runs as the nominal one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.model import BoolArray, FloatArray, IntArray, Status
from sicp_cam.toolpath.gates import Gate, at_least, at_most
from sicp_cam.toolpath.settings import GateLimits
from sicp_cam.toolpath.transfer import CorrectedPath

__all__ = ["path_gates"]

SLOPE = 0.1
"""Change of the correction per millimetre of path that a bent part explains."""
WINDOW_MM = 10.0
"""Length of path over which slopes are taken."""
SAME_PLACE_MM = 1e-3
"""Distance within which two nominal tips are one place, to which the path returns."""
SHORTEST_STEP_MM = 0.01
"""Nominal steps below this have no direction of travel."""
SAMPLE_MM = 0.7
TOUCHING_MM = 1.5
"""Distance of two samples at which a path touches itself: where two lines cross, samples are never further apart."""
CELL_MM = 0.2
"""Samples this near to each other stand for one another."""
NEIGHBOURS = 32
CHUNK = 20_000
"""Samples looked at in one go, which bounds the memory."""


def path_gates(corrected: CorrectedPath, distance_mm: FloatArray, limits: GateLimits) -> tuple[Gate, ...]:
    """Judge a corrected path.

    Parameters
    ----------
    corrected
        The path before and after.
    distance_mm
        (m,) distance of the steps of all feed moves from the contour that they follow.
    limits
        The limits.
    """
    return (*_size_gates(corrected, distance_mm, limits), *_evenness_gates(corrected, limits))


def _size_gates(corrected: CorrectedPath, distance_mm: FloatArray, limits: GateLimits) -> tuple[Gate, ...]:
    size_mm = np.linalg.norm(corrected.corrected.tips_mm - corrected.rigid.tips_mm, axis=1)
    cosine = np.clip(np.sum(corrected.corrected.axes * corrected.rigid.axes, axis=1), -1.0, 1.0)
    median = float(np.median(distance_mm)) if len(distance_mm) else np.inf
    covered = "fraction of the cut length along which the scan shows the edge"
    turn = "largest turn of the tool axis beyond the rigid pose, degrees"
    return (
        at_most("path_distance_mm", median, limits.path_distance_mm, "median distance of feed travel and contour, mm"),
        at_least("path_coverage", _covered_share(corrected), limits.path_coverage, covered),
        at_most(
            "correction_mm", float(size_mm.max()), limits.correction_mm, "largest correction beyond the rigid pose, mm"
        ),
        at_most("axis_deg", float(np.degrees(np.arccos(cosine)).max()), limits.axis_deg, turn),
    )


def _evenness_gates(corrected: CorrectedPath, limits: GateLimits) -> tuple[Gate, ...]:
    cuts = np.array([status is not Status.APPROACH for status in corrected.status], dtype=bool)
    rigid, after = corrected.rigid, corrected.corrected
    change_mm, turn = after.tips_mm - rigid.tips_mm, after.axes - rigid.axes
    windows = _windows(rigid.tips_mm, cuts)
    jump = max(_largest_jump(change_mm, rigid.tips_mm, cuts), _largest_gape(change_mm, corrected.nominal.tips_mm, cuts))
    return (
        at_most(
            "jump_mm",
            jump,
            limits.jump_mm,
            f"largest step of the correction between neighbouring points beyond {SLOPE:g} mm per mm of path, mm",
        ),
        at_most(
            "slope",
            _largest_slope(change_mm, *windows),
            limits.slope,
            f"largest change of the correction over {WINDOW_MM:g} mm of path, mm per mm",
        ),
        at_most(
            "axis_slope",
            float(np.degrees(_largest_slope(turn, *windows))),
            limits.axis_slope,
            f"largest turn of the tool axis over {WINDOW_MM:g} mm of path beyond the rigid pose, degrees per mm",
        ),
        at_least(
            "travel",
            _least_travel(rigid.tips_mm, after.tips_mm, cuts),
            limits.travel,
            "least way of a corrected cut along its nominal direction over the nominal way; below 0 it runs backwards",
        ),
        at_most(
            "crossing_mm",
            _brought_together_mm(rigid.tips_mm, after.tips_mm, cuts),
            limits.crossing_mm,
            f"largest nominal distance of places of the cut that now touch (within {TOUCHING_MM:g} mm), mm",
        ),
    )


def _covered_share(corrected: CorrectedPath) -> float:
    """Return the length of the covered cutting moves over that of all cutting moves."""
    tips = corrected.nominal.tips_mm
    length = np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1)
    cut, covered = (
        float(sum(step for step, status in zip(length, corrected.status, strict=True) if status in wanted))
        for wanted in ({Status.COVERED, Status.BRIDGED}, {Status.COVERED})
    )
    if cut > 0.0:
        return covered / cut
    return 1.0 if Status.BRIDGED not in corrected.status else 0.0


def _largest_jump(change_mm: FloatArray, tips_mm: FloatArray, cuts: BoolArray) -> float:
    step = np.linalg.norm(np.diff(change_mm, axis=0), axis=1) - SLOPE * _lengths(tips_mm)
    return float(np.max(step[cuts[1:] & cuts[:-1]], initial=0.0))


def _largest_gape(change_mm: FloatArray, nominal_mm: FloatArray, cuts: BoolArray) -> float:
    """Return the largest difference of the corrections of one place at which the path cuts more than once.

    A loop that no longer closes shows here: its two ends are no neighbours.
    """
    change = change_mm[cuts]
    first, place = _places(nominal_mm[cuts], SAME_PLACE_MM)
    return float(np.max(np.linalg.norm(change - change[first[place]], axis=1), initial=0.0))


def _places(points_mm: FloatArray, cell_mm: float) -> tuple[IntArray, IntArray]:
    """Return the index of the first point of each cell of space that holds points, and the (n,) cell of each point."""
    _, first, place = np.unique(np.round(points_mm / cell_mm), axis=0, return_index=True, return_inverse=True)
    return first, place.reshape(-1)


def _windows(tips_mm: FloatArray, cuts: BoolArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return first and last index of stretches of cut of a window's length, one from each point, and their lengths.

    A stretch ends where the cut does; its length counts as no less than the window.
    """
    runs = list(_runs(cuts))
    start = np.concatenate([np.arange(first, last) for first, last in runs]) if runs else np.zeros(0, np.int64)
    ends = np.concatenate([np.full(last - first, last) for first, last in runs]) if runs else np.zeros(0, np.int64)
    s_mm = np.concatenate([[0.0], np.cumsum(_lengths(tips_mm))])
    end = np.minimum(np.searchsorted(s_mm, s_mm[start] + WINDOW_MM), ends)
    return start, end, np.maximum(s_mm[end] - s_mm[start], WINDOW_MM)


def _runs(cuts: BoolArray) -> Iterator[tuple[int, int]]:
    """Yield first and last index of each unbroken cut."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], cuts, [False]]).astype(np.int8)))
    yield from ((int(first), int(end) - 1) for first, end in edges.reshape(-1, 2))


def _largest_slope(values: FloatArray, start: IntArray, end: IntArray, length_mm: FloatArray) -> float:
    return float(np.max(np.linalg.norm(values[end] - values[start], axis=1) / length_mm, initial=0.0))


def _least_travel(rigid_mm: FloatArray, after_mm: FloatArray, cuts: BoolArray) -> float:
    nominal, way = np.diff(rigid_mm, axis=0), np.diff(after_mm, axis=0)
    square = np.sum(nominal * nominal, axis=1)
    judged = cuts[1:] & cuts[:-1] & (square > SHORTEST_STEP_MM**2)
    return float(np.min(np.sum(way * nominal, axis=1)[judged] / square[judged], initial=1.0))


def _brought_together_mm(rigid_mm: FloatArray, after_mm: FloatArray, cuts: BoolArray) -> float:
    """Return how far apart on the nominal cut the furthest two places are that touch on the corrected one."""
    before, after = _sampled(rigid_mm, after_mm, cuts)
    if not len(after):
        return 0.0
    first, place = _places(after, CELL_MM)
    furthest = float(np.linalg.norm(before - before[first[place]], axis=1).max())
    before, after = before[first], after[first]
    tree = cKDTree(after)
    for start in range(0, len(after), CHUNK):
        rows = slice(start, start + CHUNK)
        distance, index = tree.query(after[rows], k=NEIGHBOURS, distance_upper_bound=TOUCHING_MM)
        row, column = np.nonzero(np.isfinite(distance))
        apart = np.linalg.norm(before[rows][row] - before[index[row, column]], axis=1)
        furthest = max(furthest, float(apart.max(initial=0.0)))
    return furthest


def _sampled(rigid_mm: FloatArray, after_mm: FloatArray, cuts: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the cut at equal steps of nominal length, before and after."""
    move = np.flatnonzero(cuts[1:] & cuts[:-1])
    length = _lengths(rigid_mm)[move]
    move, length = move[length > 0.0], length[length > 0.0]
    s_mm = np.concatenate([[0.0], np.cumsum(length)])
    wanted = np.arange(0.0, s_mm[-1], SAMPLE_MM)
    i = np.minimum(np.searchsorted(s_mm, wanted, side="right") - 1, len(length) - 1)
    t = ((wanted - s_mm[i]) / length[i])[:, None]
    before, after = (tips[move[i]] + t * (tips[move[i] + 1] - tips[move[i]]) for tips in (rigid_mm, after_mm))
    return before, after


def _lengths(tips_mm: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.diff(tips_mm, axis=0), axis=1))
