"""Where the cuts of a path cross one another: places that are cut twice on different ways, which closing loops are not.

The cuts are sampled at equal steps; a tree finds samples that lie near to each other though they do not follow each
other, and only there are the strands of the path intersected, in the plane at right angles to the tool.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["Crossing", "crossings"]

_MOST_SAMPLES = 50_000
_SHORTEST_STEP_MM = 0.2
_MOST_PAIRS = 5_000_000
"""Pairs of near samples beyond which the cuts fill space rather than follow a contour."""
_MOST_CANDIDATES = 20_000
_GAP_MM = 0.05
"""Distance at which two strands touch; passes at different depths lie further apart."""
_SAME_PLACE_MM = 1e-3
"""Two ends of moves within this are one place, to which the path returns on purpose."""
_LEAST_ANGLE = np.sin(np.radians(10.0))
_WINDOW = np.linspace(-1.25, 1.25, 11)
"""Places of a strand around a sample, in steps."""
_BESIDE = 0.6
"""How far from a crossing strands must have parted, in steps."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Two moves that cross, and whether they belong to one unbroken cut."""

    earlier: int
    later: int
    same_cut: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Cuts:
    """The cutting moves of a path as one strand: arc lengths s of their ends, and the cut that each belongs to."""

    move: IntArray
    begin_mm: FloatArray
    end_mm: FloatArray
    s_mm: FloatArray
    cut: IntArray

    def at(self, s_mm: FloatArray, cut: IntArray) -> tuple[FloatArray, IntArray]:
        """Return points (..., 3) at arc lengths, held to the ends of their cuts, and the rows of their moves."""
        first, last = np.searchsorted(self.cut, cut), np.searchsorted(self.cut, cut, side="right") - 1
        held = np.clip(s_mm, self.s_mm[first], self.s_mm[last + 1])
        row = np.clip(np.searchsorted(self.s_mm, held, side="right") - 1, first, last)
        return self.on(row, held), row

    def on(self, row: IntArray, s_mm: FloatArray) -> FloatArray:
        """Return points (..., 3) at arc lengths on known moves."""
        t = (s_mm - self.s_mm[row]) / (self.s_mm[row + 1] - self.s_mm[row])
        begin = self.begin_mm[row]
        points: FloatArray = begin + t[..., None] * (self.end_mm[row] - begin)
        return points

    def vertex(self, s_mm: FloatArray, row: IntArray) -> FloatArray:
        """Return the nearer end (k, 3) of the moves at arc lengths."""
        to_begin = s_mm - self.s_mm[row] <= self.s_mm[row + 1] - s_mm
        return np.where(to_begin[:, None], self.begin_mm[row], self.end_mm[row])


def crossings(tips_mm: FloatArray, axes: FloatArray, rapid: BoolArray) -> list[Crossing] | None:
    """Return where cutting moves cross each other within 0.05 mm, in the order of the later move.

    None where the cuts lie so close together, at the step that they are looked at, that looking would take too long.

    Not counted are: strands that run along each other or part at less than 10 degrees, such as a second pass and the
    overlap of a closed contour; ends of cuts on another cut; places where both strands have the end of a move, to which
    the path returns on purpose; loops shorter than three steps. A step is 0.2 mm, or more where the cuts are longer
    than 10 m in all.

    Parameters
    ----------
    tips_mm, axes, rapid
        (n, 3) ends of the moves, (n, 3) tool axes, (n,) True where a move does not cut.

    >>> tips = np.array([[0, 0, 0], [10, 0, 0], [10, 5, 0], [4, 5, 0], [4, -5, 0.0]])
    >>> crossings(tips, np.tile([0.0, 0, 1], (5, 1)), np.array([True, False, False, False, False]))
    [Crossing(earlier=1, later=4, same_cut=True)]
    """
    cuts = _cuts(tips_mm, rapid)
    if cuts is None:
        return []
    total = float(cuts.s_mm[-1])
    step = max(total / _MOST_SAMPLES, _SHORTEST_STEP_MM)
    s = np.arange(0.0, total, step)
    row = np.clip(np.searchsorted(cuts.s_mm, s, side="right") - 1, 0, len(cuts.move) - 1)
    pairs = _near_pairs(cuts.on(row, s), s, cuts.cut[row], step)
    if pairs is None:
        return None
    if not len(pairs):
        return []
    i, j = pairs.T
    normals = axes[cuts.move[row[i]]] + axes[cuts.move[row[j]]]
    return _intersected(cuts, s[i], s[j], cuts.cut[row[i]], cuts.cut[row[j]], normals, step)


def _cuts(tips_mm: FloatArray, rapid: BoolArray) -> _Cuts | None:
    lengths = np.linalg.norm(np.diff(tips_mm, axis=0), axis=1)
    cutting = ~rapid[1:]
    if not cutting.any():
        return None
    # A cut goes on until a rapid move; moves of no length are left out, and break nothing.
    number = np.cumsum(~cutting, dtype=np.int64)
    used = np.flatnonzero(cutting & (lengths > 1e-9))
    if len(used) < 2:
        return None
    s = np.concatenate([[0.0], np.cumsum(lengths[used])])
    return _Cuts(used + 1, tips_mm[used], tips_mm[used + 1], s, number[used])


def _near_pairs(points: FloatArray, s: FloatArray, cut: IntArray, step: float) -> IntArray | None:
    """Return pairs (k, 2) of samples that are near to each other, do not follow each other, and run across.

    None if there are too many near ones.
    """
    tree, near_mm = cKDTree(points, balanced_tree=False), step + _GAP_MM
    if tree.count_neighbors(tree, near_mm) > 2 * _MOST_PAIRS + len(points):
        return None
    pairs: IntArray = tree.query_pairs(near_mm, output_type="ndarray")
    i, j = pairs.T
    apart = (np.abs(s[i] - s[j]) > 3.0 * step) | (cut[i] != cut[j])
    pairs = pairs[apart]
    if not len(pairs):
        return pairs
    ways = np.zeros_like(points)
    ways[1:-1] = points[2:] - points[:-2]
    ways[0], ways[-1] = points[1] - points[0], points[-1] - points[-2]
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    i, j = pairs.T
    across = np.linalg.norm(np.cross(ways[i], ways[j]), axis=1) > _LEAST_ANGLE
    # At a corner or an end the sample's own direction says little: those are looked at too.
    corner = np.ones(len(points), np.bool_)
    corner[1:-1] = np.einsum("ni,ni->n", ways[:-2], ways[2:]) < 0.94
    pairs = pairs[across | corner[i] | corner[j]]
    first: IntArray = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))[:_MOST_CANDIDATES]]
    return first


def _intersected(
    cuts: _Cuts,
    s_a: FloatArray,
    s_b: FloatArray,
    cut_a: IntArray,
    cut_b: IntArray,
    normals: FloatArray,
    step: float,
) -> list[Crossing]:
    window = step * _WINDOW
    strand_a, row_a = cuts.at(s_a[:, None] + window, np.repeat(cut_a[:, None], len(window), 1))
    strand_b, row_b = cuts.at(s_b[:, None] + window, np.repeat(cut_b[:, None], len(window), 1))
    found, t_a, t_b = _plane_crossings(strand_a, strand_b, normals)
    which, k_a, k_b = np.nonzero(found)
    if not len(which):
        return []
    spacing = window[1] - window[0]
    at_a = s_a[which] + window[k_a] + spacing * t_a[which, k_a, k_b]
    at_b = s_b[which] + window[k_b] + spacing * t_b[which, k_a, k_b]
    place_a, row_a = cuts.at(at_a, cut_a[which])
    place_b, row_b = cuts.at(at_b, cut_b[which])
    same_vertex = np.linalg.norm(cuts.vertex(at_a, row_a) - cuts.vertex(at_b, row_b), axis=1) <= _SAME_PLACE_MM
    real = ~same_vertex & (np.linalg.norm(place_a - place_b, axis=1) <= _GAP_MM)
    for other, at, cut in ((strand_b, at_a, cut_a), (strand_a, at_b, cut_b)):
        for beside in (-_BESIDE, _BESIDE):
            aside, _ = cuts.at(at + beside * step, cut[which])
            real &= _distances(aside, other[which]) > 0.15 * _BESIDE * step
    told = {
        (int(max(cuts.move[a], cuts.move[b])), int(min(cuts.move[a], cuts.move[b])), bool(x == y))
        for a, b, x, y in zip(row_a[real], row_b[real], cut_a[which][real], cut_b[which][real], strict=True)
    }
    return [Crossing(earlier, later, same) for later, earlier, same in sorted(told)]


def _plane_crossings(a: FloatArray, b: FloatArray, normals: FloatArray) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return which pieces (k, m, m) of strands (k, m + 1, 3) cross, seen along the normals, and where along each."""
    n = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    d_a, d_b = np.diff(a, axis=1), np.diff(b, axis=1)
    between = b[:, None, :-1] - a[:, :-1, None]
    # Seen along n, the area of two vectors is n . (u x v).
    across = np.einsum("ki,kpqi->kpq", n, np.cross(d_a[:, :, None], d_b[:, None]))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t_a = np.einsum("ki,kpqi->kpq", n, np.cross(between, d_b[:, None])) / across
        t_b = np.einsum("ki,kpqi->kpq", n, np.cross(between, d_a[:, :, None])) / across
    lengths = np.linalg.norm(d_a, axis=2)[:, :, None] * np.linalg.norm(d_b, axis=2)[:, None]
    found = (np.abs(across) > _LEAST_ANGLE * lengths) & (t_a >= 0) & (t_a < 1) & (t_b >= 0) & (t_b < 1)
    return found, t_a, t_b


def _distances(points: FloatArray, strands: FloatArray) -> FloatArray:
    """Return the distances (k,) of points (k, 3) to strands (k, m, 3)."""
    begin, way = strands[:, :-1], np.diff(strands, axis=1)
    square = np.maximum(np.einsum("kmi,kmi->km", way, way), 1e-30)
    t = np.clip(np.einsum("kmi,kmi->km", points[:, None] - begin, way) / square, 0.0, 1.0)
    nearest: FloatArray = np.linalg.norm(points[:, None] - begin - t[..., None] * way, axis=2).min(axis=1)
    return nearest
