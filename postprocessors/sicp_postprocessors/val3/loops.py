"""The loop style: stretches of a path as counted loops over its points, so that the code of a long path is short."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray, IntArray

__all__ = ["COUNTER", "Run", "runs_of"]

COUNTER = "nMove"
"""The variable that counts in loops."""

_FEWEST = 3


@dataclass(frozen=True, slots=True)
class Run:
    """Moves `start` to `stop` (not included) that a loop can make, or that are too few for one.

    `varies` says that they have several speeds, which an array then names for each point.
    """

    start: int
    stop: int
    varies: bool

    @property
    def loops(self) -> bool:
        """Whether there are enough of them for a loop."""
        return self.stop - self.start >= _FEWEST


def runs_of(groups: IntArray | FloatArray, speeds: IntArray) -> list[Run]:
    """Cut n moves into runs within which all columns of `groups` (n, k) stay the same.

    Parameters
    ----------
    groups
        What must not change within a loop: array of points, tool, stretch between events, array of speeds, rapid.
    speeds
        (n,) number of the speed.

    >>> runs_of(np.array([[0], [0], [0], [1]]), np.array([5, 5, 6, 6]))
    [Run(start=0, stop=3, varies=True), Run(start=3, stop=4, varies=False)]
    """
    if not len(groups):
        return []
    cuts = np.flatnonzero((groups[1:] != groups[:-1]).any(axis=1)) + 1
    bounds = np.concatenate([[0], cuts, [len(groups)]])
    changes = np.concatenate([[0], np.cumsum(speeds[1:] != speeds[:-1])])
    varies = changes[bounds[1:] - 1] > changes[bounds[:-1]]
    rows = zip(bounds[:-1].tolist(), bounds[1:].tolist(), varies.tolist(), strict=True)
    return [Run(start, stop, differs) for start, stop, differs in rows]
