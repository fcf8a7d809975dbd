"""The search for the stiffness of a smooth fit that makes the data most likely."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["most_likely"]

COARSE, FINE = 10.0**1.5, 10.0**0.5
MOST = 1e10


def most_likely(
    evidence: Callable[[float], float], *, start: float | None = None, least: float = 1.0, unit: float = 1.0
) -> float:
    """Return the stiffness of largest evidence.

    Parameters
    ----------
    evidence
        Logarithm of the marginal likelihood of a stiffness.
    start
        Where to begin; None looks at coarse steps from `MOST` down to `least` first, for there may be several maxima.
    least
        Least stiffness that is tried, in units.
    unit
        What stiffnesses are counted in: a part twice as large has its stiffness twice as large.
    """
    tried: dict[float, float] = {}

    def value(stiffness: float) -> float:
        if stiffness not in tried:
            tried[stiffness] = evidence(stiffness)
        return tried[stiffness]

    steps = [unit * MOST / COARSE**k for k in range(20) if MOST / COARSE**k >= least] or [unit * least]
    best = start if start is not None else max(steps, key=value)
    for factor in (FINE, 1.0 / FINE):
        while least <= best * factor / unit <= MOST * 1.001 and value(best * factor) > value(best):
            best *= factor
    return best
