"""The better of two solutions for each move, chosen over the path as a whole: a shortest path in two states."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["Changes", "best_changes", "followed"]

Changes = BoolArray
"""(2, n - 1): whether to change to the other solution behind each move, for either solution there."""

_EQUAL = 1e-9


def best_changes(way: FloatArray, price: FloatArray) -> tuple[Changes, tuple[float, float]]:
    """Return where to change between the solutions so that the whole way is shortest, and its length from either start.

    Dynamic programming from the end: what is left of the way from a solution of a move is its price and the lesser of
    the ways on to the two solutions of the next move.

    Parameters
    ----------
    way
        (2, 2, n - 1) from solution i of each move to solution j of the next.
    price
        (2, n) of taking a solution at all, such as one beyond the travel of an axis.

    >>> way = np.array([[[1.0, 9.0], [5.0, 0.5]], [[5.0, 5.0], [1.0, 1.0]]])
    >>> changes, lengths = best_changes(way, np.zeros((2, 3)))
    >>> changes.tolist(), lengths
    ([[False, True], [False, False]], (1.5, 2.0))
    """
    stay_0, stay_1, leave_0, leave_1 = way[0, 0], way[1, 1], way[0, 1], way[1, 0]
    alike = np.abs(stay_0 - stay_1) <= _EQUAL
    if not price.any() and (alike & (leave_0 >= stay_0) & (leave_1 >= stay_0)).all():
        return np.zeros((2, way.shape[2]), np.bool_), (float(stay_0.sum()), float(stay_1.sum()))
    changes = np.zeros((2, way.shape[2]), np.bool_)
    left_0, left_1 = float(price[0, -1]), float(price[1, -1])
    leaves_0, leaves_1 = [], []
    columns = (stay_0, stay_1, leave_0, leave_1, price[0, :-1], price[1, :-1])
    for s0, s1, l0, l1, p0, p1 in zip(*(column[::-1].tolist() for column in columns), strict=True):
        on_0, on_1, over_0, over_1 = s0 + left_0, s1 + left_1, l0 + left_1, l1 + left_0
        leaves_0.append(over_0 < on_0 - _EQUAL)
        leaves_1.append(over_1 < on_1 - _EQUAL)
        left_0, left_1 = p0 + (over_0 if leaves_0[-1] else on_0), p1 + (over_1 if leaves_1[-1] else on_1)
    changes[0], changes[1] = leaves_0[::-1], leaves_1[::-1]
    return changes, (left_0, left_1)


def followed(changes: Changes, start: int, restarts: IntArray) -> npt.NDArray[np.intp]:
    """Return the solution (n,) of each move that follows from the changes, if the path begins with solution `start`.

    `restarts` are moves at which it begins with that solution again.
    """
    solution = np.empty(changes.shape[1] + 1, np.intp)
    bounds = [*sorted({0, *restarts.tolist()}), len(solution)]
    places = np.flatnonzero(changes.any(axis=0)).tolist()
    place = 0
    for begin, end in pairwise(bounds):
        now, done = start, begin
        while place < len(places) and places[place] < end - 1:
            if places[place] >= begin and changes[now, places[place]]:
                solution[done : places[place] + 1] = now
                now, done = 1 - now, places[place] + 1
            place += 1
        solution[done:end] = now
    return solution
