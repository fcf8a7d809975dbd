"""Zones: how far from a point a robot may leave its path to run through instead of coming to rest."""

from __future__ import annotations

import numpy as np

from sicp_cam.model import BoolArray, EventKind, FloatArray, ToolPath

__all__ = ["passed_points", "zones_mm"]

_SMALLEST_MM = 1e-3
_PASSED = (EventKind.COMMENT, EventKind.OTHER)
"""Events that the motion does not wait for."""


def passed_points(path: ToolPath) -> BoolArray:
    """Return where a move may run on into the next (n,): between two cutting moves, unless an event waits for its end.

    The first move never may, because it is a joint move; nor may the last.
    """
    cutting = ~path.rapid
    passed = np.zeros(len(path), np.bool_)
    passed[1:-1] = cutting[1:-1] & cutting[2:]
    passed[[e.before_move - 1 for e in path.events if e.before_move > 0 and e.kind not in _PASSED]] = False
    return passed


def zones_mm(path: ToolPath, passed: BoolArray, largest_mm: float, corner_mm: float) -> FloatArray:
    """Return the zone of each move (n,) in mm, zero where the tool must come to its point.

    Parameters
    ----------
    path
        The path.
    passed
        (n,) moves that may run on into the next, see `passed_points`.
    largest_mm
        Distance from its point at which a zone begins and ends, at most.
    corner_mm
        How far a corner may be cut, at most.

    Notes
    -----
    No zone is longer than half of the shorter neighbouring segment. The tool stays within the triangle of the point and
    the two places that lie the distance d before and behind it; where the path turns by t, the far side of that
    triangle passes the point at d sin(t / 2), and `corner_mm` holds that down. Distances are `largest_mm` or go down by
    halves, so that a path of uneven spacing does not need a zone of its own for every point; below a micrometre there
    is none.
    """
    zones = np.zeros(len(path))
    if len(path) < 3:
        return zones
    steps_mm = np.diff(path.tips_mm, axis=0)
    lengths = np.linalg.norm(steps_mm, axis=1)
    turns = np.diff(steps_mm / np.maximum(lengths, 1e-9)[:, None], axis=0)
    corner = corner_mm / np.maximum(np.linalg.norm(turns, axis=1) / 2.0, 1e-9)
    longest = np.minimum(np.minimum(lengths[:-1], lengths[1:]) / 2.0, corner)
    halvings = np.ceil(np.log2(largest_mm / np.maximum(longest, 1e-9)))
    zones[1:-1] = largest_mm / 2.0 ** np.maximum(halvings, 0.0)
    zones[~passed | (zones < _SMALLEST_MM)] = 0.0
    return zones
