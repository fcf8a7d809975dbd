"""Divide a contour: at its bends, and into about equal arcs between them; and the overlapping weights of the pieces.

The paper's H1 (bends) and H2 (equal arcs) with what the printed formulas leave out: a point belongs to H1 where the
radius of curvature is *below* the threshold, and the overlap weights are normalised over all pieces that cover a point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.model import BoolArray, FloatArray

__all__ = ["Subdivision", "bends", "subdivide", "weights"]

CURVATURE_WINDOW_MM = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Subdivision:
    """Arc lengths at which a contour is divided, and how far neighbouring pieces overlap.

    Parameters
    ----------
    splits_mm
        (p,) rising arc lengths. Closed: piece i runs from split i to split i + 1, the last one back to the first.
        Open: the two ends are the first and the last split.
    overlaps_mm
        (p,) length of the overlap centred on each split; 0 at the ends of an open contour.
    """

    splits_mm: FloatArray
    overlaps_mm: FloatArray
    length_mm: float
    closed: bool

    def ranges_mm(self) -> FloatArray:
        """Return the (m, 2) start and end of each piece, overlaps included; they may pass 0 and the length."""
        starts, ends, first, last = self._pieces()
        return np.stack([starts - 0.5 * first, ends + 0.5 * last], axis=1)

    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        if not self.closed:
            return self.splits_mm[:-1], self.splits_mm[1:], self.overlaps_mm[:-1], self.overlaps_mm[1:]
        ends = np.append(self.splits_mm[1:], self.splits_mm[0] + self.length_mm)
        return self.splits_mm, ends, self.overlaps_mm, np.roll(self.overlaps_mm, -1)


def bends(curve: FramedCurve, radius_mm: float) -> FloatArray:
    """Return the arc lengths where the contour bends most, each with a radius of curvature below the limit.

    The curvature is the turn of the tangent over a window of arc length, not the circle through three neighbours,
    which is infinite on lines and noise on samples.
    """
    window = min(CURVATURE_WINDOW_MM, 0.05 * curve.length_mm)
    step = 0.25 * window
    s = np.arange(0.0, curve.length_mm, step)
    ahead, behind = at(curve, s + 0.5 * window).tangents, at(curve, s - 0.5 * window).tangents
    turn = np.arccos(np.clip(np.sum(ahead * behind, axis=1), -1.0, 1.0)) / window
    sharp = turn > 1.0 / radius_mm
    runs = np.split(np.arange(len(s)), np.flatnonzero(np.diff(sharp.astype(int))) + 1)
    found = [float(s[run[np.argmax(turn[run])]]) for run in runs if sharp[run[0]]]
    near_seam = curve.closed and len(found) > 1 and found[0] + curve.length_mm - found[-1] < window
    return np.array(found[:-1] if near_seam else found)


def subdivide(
    curve: FramedCurve, pieces: int, overlap: float, bends_mm: FloatArray, unseen_mm: FloatArray | None = None
) -> Subdivision:
    """Divide a contour at its bends and into arcs between them that hold about equal lengths of *seen* contour.

    Lengths are counted where the scan shows the edge, so that a gap in the scan always lies within a piece that is
    held on both sides of it.

    Parameters
    ----------
    curve
        The contour.
    pieces
        Number of pieces to come near to; every bend gets its split even where that makes more.
    overlap
        Overlap at a split over the mean length of its two pieces, 0.2 to 0.4.
    bends_mm
        Arc lengths that must be splits.
    unseen_mm
        (g, 2) start and end of each gap of the scan, apart from one another, within 0 and the length; None for none.
    """
    gaps = np.zeros((0, 2)) if unseen_mm is None else unseen_mm
    bends_mm = bends_mm[~_within(bends_mm, gaps)]
    longest = (curve.length_mm - float(np.sum(gaps[:, 1] - gaps[:, 0]))) / pieces
    fixed = _spread(bends_mm, 0.5 * longest, curve, gaps)
    ends = np.append(fixed[1:], fixed[0] + curve.length_mm) if curve.closed else fixed[1:]
    arcs = [_equal_arcs(a, b, longest, gaps, curve.length_mm) for a, b in zip(fixed, ends, strict=False)]
    splits = np.concatenate(arcs) if curve.closed else np.append(np.concatenate(arcs), curve.length_mm)
    splits = np.sort(np.mod(splits, curve.length_mm)) if curve.closed else splits
    lengths = np.diff(np.append(splits, splits[0] + curve.length_mm)) if curve.closed else np.diff(splits)
    if curve.closed:
        return Subdivision(splits, overlap * 0.5 * (lengths + np.roll(lengths, 1)), curve.length_mm, True)
    inner = overlap * 0.5 * (lengths[1:] + lengths[:-1])
    return Subdivision(splits, np.concatenate([[0.0], inner, [0.0]]), curve.length_mm, False)


def _equal_arcs(start: float, end: float, longest: float, gaps: FloatArray, length_mm: float) -> FloatArray:
    """Return the start of each piece between two fixed splits; `end` may pass the length of a closed contour."""
    knots = np.unique(np.clip(np.concatenate([[start, end], gaps.ravel(), gaps.ravel() + length_mm]), start, end))
    middle = np.mod(0.5 * (knots[1:] + knots[:-1]), length_mm)
    hidden = _within(middle, gaps)
    seen = np.concatenate([[0.0], np.cumsum(np.where(hidden, 0.0, np.diff(knots)))])
    count = max(1, int(np.ceil(seen[-1] / longest - 1e-9)))
    wanted = np.arange(1, count) * seen[-1] / count
    return np.concatenate([[start], np.interp(wanted, seen, knots)])


def _within(s_mm: FloatArray, gaps: FloatArray) -> BoolArray:
    """Say which arc lengths lie in a gap, ends included."""
    inside = (s_mm[:, None] >= gaps[:, 0]) & (s_mm[:, None] <= gaps[:, 1])
    return np.asarray(inside.any(axis=1), dtype=np.bool_)


def _seen_start(curve: FramedCurve, gaps: FloatArray) -> float:
    """Return the arc length furthest from all gaps, where a closed contour without bends is first divided."""
    if not len(gaps) or not _within(np.zeros(1), gaps)[0]:
        return 0.0
    ends = np.append(gaps[1:, 0], gaps[0, 0] + curve.length_mm)
    widest = int(np.argmax(ends - gaps[:, 1]))
    return float(np.mod(0.5 * (gaps[widest, 1] + ends[widest]), curve.length_mm))


def _spread(bends_mm: FloatArray, apart_mm: float, curve: FramedCurve, gaps: FloatArray) -> FloatArray:
    """Return the fixed splits: the bends that lie far enough apart, or one start, or the ends of an open curve."""
    kept: list[float] = [] if curve.closed else [0.0]
    for s in np.sort(bends_mm):
        if not kept or s - kept[-1] >= apart_mm:
            kept.append(float(s))
    if not curve.closed:
        return np.array([s for s in kept if curve.length_mm - s >= apart_mm or s == 0.0] + [curve.length_mm])
    if len(kept) > 1 and kept[0] + curve.length_mm - kept[-1] < apart_mm:
        kept.pop()
    return np.array(kept or [_seen_start(curve, gaps)])


def weights(subdivision: Subdivision, s_mm: FloatArray) -> FloatArray:
    """Return the (n, m) weight of each of m pieces at n arc lengths; each row sums to one.

    Through an overlap the weight goes as cos^2(pi t / 2) and sin^2(pi t / 2), t being the fraction of the overlap.
    """
    starts, ends, first, last = subdivision._pieces()
    s = np.asarray(s_mm, dtype=np.float64)[:, None]
    if subdivision.closed:
        middle = 0.5 * (starts + ends)
        s = (
            middle
            + np.mod(s - middle + 0.5 * subdivision.length_mm, subdivision.length_mm)
            - 0.5 * subdivision.length_mm
        )
    rising = _ramp(s - starts, first)
    falling = _ramp(ends - s, last)
    g = rising * falling
    normalised: FloatArray = g / g.sum(axis=1, keepdims=True)
    return normalised


def _ramp(distance: FloatArray, width: FloatArray) -> FloatArray:
    """Return sin^2 from 0 to 1 while the distance runs from -width/2 to +width/2; a step where the width is 0."""
    safe = np.where(width > 0.0, width, 1.0)
    t = np.where(width > 0.0, np.clip(distance / safe + 0.5, 0.0, 1.0), distance >= 0.0)
    return np.asarray(np.sin(0.5 * np.pi * t) ** 2)
