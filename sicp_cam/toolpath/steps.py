"""Divide feed moves into short steps: what a path touches is judged along its moves, not at their ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray, ToolPath

__all__ = ["Steps", "any_of", "divided", "feed_steps"]


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Moves divided into equal steps.

    Parameters
    ----------
    tips_mm, axes
        (m, 3) end of each step; tips linear between the ends of the move, axes too, made unit again.
    source
        (m,) index of the move that each step is part of.
    fraction
        (m,) how far along its move each step ends; 1 at the move's own end.
    """

    tips_mm: FloatArray
    axes: FloatArray
    source: IntArray
    fraction: FloatArray


def feed_steps(path: ToolPath, step_mm: float) -> IntArray:
    """Return the (n,) number of steps no longer than a limit for each move; rapid moves and the first get one."""
    length = np.linalg.norm(np.diff(path.tips_mm, axis=0, prepend=path.tips_mm[:1]), axis=1)
    counts = np.where(path.rapid, 1, np.maximum(1, np.ceil(length / step_mm - 1e-6))).astype(np.int64)
    counts[:1] = 1
    return counts


def divided(path: ToolPath, counts: IntArray) -> Steps:
    """Return the moves of a path, each as the given number of equal steps."""
    source = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(source)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    fraction = number / counts[source]
    start, t, ends = np.maximum(source - 1, 0), fraction[:, None], fraction[:, None] == 1.0
    tips = np.where(ends, path.tips_mm[source], _between(path.tips_mm, start, source, t))
    mixed = _between(path.axes, start, source, t)
    axes = np.where(ends, path.axes[source], mixed / np.linalg.norm(mixed, axis=1, keepdims=True))
    return Steps(tips, axes, source, fraction)


def _between(values: FloatArray, start: IntArray, end: IntArray, t: FloatArray) -> FloatArray:
    mixed: FloatArray = values[start] + t * (values[end] - values[start])
    return mixed


def any_of(flags: BoolArray, source: IntArray, moves: int) -> BoolArray:
    """Return for each of n moves whether one of its steps is flagged."""
    return np.asarray(np.bincount(source, weights=flags, minlength=moves) > 0)
