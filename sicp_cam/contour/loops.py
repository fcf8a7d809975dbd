"""Order scan rims into loops, as candidates for the start of a registration."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import Rim, mesh_boundary_edges
from sicp_cam.model import FloatArray, IntArray

__all__ = ["mesh_loops", "resampled", "rim_loops"]

MARCH_SPACINGS = 4.0
OPPOSED = -0.1
SIDEWAYS = -0.35
"""Cosine of the largest turn of a walk."""


def mesh_loops(faces: IntArray) -> list[tuple[IntArray, bool]]:
    """Chain the boundary edges of a mesh into loops, with the faces on the left.

    Returns
    -------
    list of (vertex indices, closed), longest first; a closed loop does not repeat its first vertex.
    """
    edges = mesh_boundary_edges(faces)
    onward: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        onward.setdefault(a, []).append(b)
    arrivals = set(edges[:, 1].tolist())
    loops = []
    # Chains that begin at a vertex without an incoming edge are open; they are walked first, then the rings.
    for start in [a for a in onward if a not in arrivals] + list(onward):
        while onward.get(start):
            chain = [start]
            while onward.get(chain[-1]):
                chain.append(onward[chain[-1]].pop())
                if chain[-1] == start:
                    break
            closed = len(chain) > 2 and chain[-1] == start
            loops.append((np.array(chain[:-1] if closed else chain, dtype=np.int64), closed))
    return sorted(loops, key=lambda loop: -len(loop[0]))


def rim_loops(rim: Rim, spacing_mm: float, least_length_mm: float) -> list[FloatArray]:
    """Walk along the rim of a cloud and return each closed walk as an ordered loop of points.

    From a rim point the walk goes on to the rim point within reach that lies furthest ahead, ahead being square to
    the open side; it ends where it comes back to its start. Gaps narrower than the reach are stepped over.

    Parameters
    ----------
    rim
        Rim points of the cloud.
    spacing_mm
        Point spacing of the cloud; the reach is four times that.
    least_length_mm
        Shorter loops are dropped.

    Returns
    -------
    list of (n, 3) closed loops, longest first, of either sense of travel.
    """
    tree = cKDTree(rim.points_mm)
    reach = MARCH_SPACINGS * spacing_mm
    free = np.ones(len(rim.points_mm), dtype=bool)
    loops = []
    for seed in range(len(rim.points_mm)):
        if not free[seed]:
            continue
        walk, closed = _walk(rim, tree, seed, reach)
        for near in tree.query_ball_point(rim.points_mm[walk], reach):
            free[near] = False
        loop = rim.points_mm[walk]
        if closed and np.linalg.norm(np.diff(loop, axis=0), axis=1).sum() >= least_length_mm:
            loops.append(loop)
    return sorted(loops, key=lambda loop: -float(np.linalg.norm(np.diff(loop, axis=0), axis=1).sum()))


def _walk(rim: Rim, tree: cKDTree, seed: int, reach: float) -> tuple[list[int], bool]:
    """Walk from a seed until nothing lies ahead; closed if that is back at the seed."""
    points = rim.points_mm
    walk, visited, heading = [seed], {seed}, np.zeros(3)
    while True:
        here = points[walk[-1]]
        around = np.array([i for i in tree.query_ball_point(here, reach) if i not in visited], np.int64)
        chosen = _next(rim, walk[-1], around, heading)
        if chosen is None:
            return walk, len(walk) > 8 and bool(np.linalg.norm(here - points[seed]) < 2.0 * reach)
        step = points[chosen] - here
        passed = (points[around] - here) @ step <= step @ step
        visited.update(around[passed].tolist())
        walk.append(chosen)
        tail = points[walk[-1]] - points[walk[max(0, len(walk) - 3)]]
        heading = tail / max(float(np.linalg.norm(tail)), 1e-12)


def _next(rim: Rim, here: int, around: IntArray, heading: FloatArray) -> int | None:
    """Return the rim point to go on to, None if there is none ahead.

    Far and straight ahead is best; around the corner of a gap, up to 110 degrees aside, is good enough.
    """
    if not len(around):
        return None
    step = rim.points_mm[around] - rim.points_mm[here]
    if not heading.any():
        # Ahead is square to the open side, in whichever sense the furthest neighbour lies.
        square = step - np.outer(step @ rim.open_directions[here], rim.open_directions[here])
        heading = square[np.argmax(np.linalg.norm(square, axis=1))]
        heading = heading / max(float(np.linalg.norm(heading)), 1e-12)
    length = np.linalg.norm(step, axis=1)
    cosine = (step @ heading) / np.maximum(length, 1e-12)
    # The open directions turn slowly along a rim, by a right angle at a corner; across a narrow strip they oppose.
    alike = rim.open_directions[around] @ rim.open_directions[here] > OPPOSED
    score = np.where(alike & (cosine > SIDEWAYS), length * (cosine - SIDEWAYS) ** 2, -np.inf)
    best = int(np.argmax(score))
    return int(around[best]) if np.isfinite(score[best]) else None


def resampled(points_mm: FloatArray, count: int) -> tuple[FloatArray, float]:
    """Return `count` points at equal arc lengths along a closed loop of (n, 3) points, and the loop's length."""
    ring = np.vstack([points_mm, points_mm[:1]])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
    wanted = np.arange(count) * s[-1] / count
    return np.stack([np.interp(wanted, s, ring[:, axis]) for axis in range(3)], axis=1), float(s[-1])
