"""Stretches of a contour: from a mark at every station to intervals of arc length, round the seam of a loop too."""

from __future__ import annotations

import numpy as np

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.result import Segment

__all__ = ["clipped", "covered_twice", "marked"]

Stretch = tuple[float, float]
"""Start and end in mm; the end exceeds the length of a loop where the stretch runs over its seam."""


def marked(curve: FramedCurve, mask: BoolArray) -> list[Stretch]:
    """Return the stretches where the mask is true, each to halfway to the next station that is not marked.

    Parameters
    ----------
    curve
        k stations.
    mask
        (k,) marks.
    """
    if not mask.any():
        return []
    if mask.all():
        return [(0.0, curve.length_mm)]
    left, right = _reach(curve)
    rises = np.flatnonzero(mask & ~np.roll(mask, 1)) if curve.closed else _rises(mask)
    found = []
    for start in rises.tolist():
        ahead = np.roll(mask, -start) if curve.closed else mask[start:]
        count = len(ahead) if ahead.all() else int(np.argmin(ahead))
        last = (start + count - 1) % len(mask)
        end = float(right[last])
        found.append((float(left[start]), end if last >= start else end + curve.length_mm))
    return found


def clipped(stretch: Stretch, length_mm: float) -> list[Stretch]:
    """Return the stretch as one or two pieces between 0 and the length.

    >>> clipped((90.0, 120.0), 100.0)
    [(90.0, 100.0), (0.0, 20.0)]
    """
    start, end = stretch
    pieces = [(start, min(end, length_mm)), (0.0, end - length_mm)]
    if start < 0.0:
        pieces = [(start + length_mm, length_mm), (0.0, end)]
    return [piece for piece in pieces if piece[1] > piece[0]]


def covered_twice(segments: tuple[Segment, ...], curve: FramedCurve, s_mm: FloatArray) -> BoolArray:
    """Say for each (m,) arc length whether at least two segments are used there."""
    count = np.zeros(len(s_mm), np.int64)
    for segment in segments:
        offset = s_mm - segment.start_mm
        if curve.closed:
            offset = np.mod(offset, curve.length_mm)
        count += (offset >= 0.0) & (offset <= segment.end_mm - segment.start_mm)
    twice: BoolArray = count >= 2
    return twice


def _rises(mask: BoolArray) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    before = np.concatenate([[False], mask[:-1]])
    return np.flatnonzero(mask & ~before)


def _reach(curve: FramedCurve) -> tuple[FloatArray, FloatArray]:
    """Return how far to the left and to the right each station stands for the curve."""
    s = curve.s_mm
    middles = 0.5 * (s[1:] + s[:-1])
    seam = 0.5 * (s[-1] + curve.length_mm) if curve.closed else curve.length_mm
    return np.concatenate([[seam - curve.length_mm if curve.closed else 0.0], middles]), np.append(middles, seam)
