"""The five numbers by which a residual is told, and the share of it that keeps a tolerance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.result import RegisteredContour, Residuals

__all__ = ["Summary", "all_contours", "both", "residual_summary", "share_within", "summary"]

Summary = dict[str, float]
"""mean, sd, rms, p95 and max, in the unit of the values."""


def summary(values: npt.ArrayLike) -> Summary | None:
    """Return mean, sd, rms, p95 and max of some residuals.

    Mean and standard deviation keep the sign (and sd divides by n, so that rms^2 = mean^2 + sd^2); p95 (95th
    percentile, linear between samples) and max are of the absolute value. NaN means "not measured" and is left out.

    Parameters
    ----------
    values
        (n,) residuals; None is returned if none of them is a number.

    Raises
    ------
    ValueError
        If a value is infinite.

    >>> summary([3.0, -4.0, float("nan")])["max"]
    4.0
    >>> summary([]) is None
    True
    """
    numbers = np.asarray(values, dtype=np.float64).ravel()
    numbers = numbers[~np.isnan(numbers)]
    if np.isinf(numbers).any():
        raise ValueError("an infinite residual has no statistics")
    if len(numbers) == 0:
        return None
    size = np.abs(numbers)
    return {
        "mean": float(numbers.mean()),
        "sd": float(numbers.std()),
        "rms": float(np.sqrt(np.mean(numbers**2))),
        "p95": float(np.percentile(size, 95)),
        "max": float(size.max()),
    }


def both(residuals: Residuals) -> FloatArray:
    """Return (k,) the distance across the contour, hypot(normal, out); NaN where either is not known."""
    across: FloatArray = np.hypot(residuals.normal_mm, residuals.out_mm)
    return across


def residual_summary(residuals: Residuals, covered: BoolArray) -> dict[str, Summary | None]:
    """Return the summaries of `normal`, `out` and `both` over the covered stations, mm.

    Parameters
    ----------
    residuals
        At k stations.
    covered
        (k,) True where the scan shows the edge; the others do not count.
    """
    return {
        "normal": summary(residuals.normal_mm[covered]),
        "out": summary(residuals.out_mm[covered]),
        "both": summary(both(residuals)[covered]),
    }


def all_contours(contours: Sequence[RegisteredContour]) -> tuple[Residuals, Residuals, BoolArray]:
    """Return the residuals `before` and `after` and the mask `covered` of all contours one after the other."""

    def joined(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([np.zeros(0), *parts])

    before = Residuals(joined([c.before.normal_mm for c in contours]), joined([c.before.out_mm for c in contours]))
    after = Residuals(joined([c.after.normal_mm for c in contours]), joined([c.after.out_mm for c in contours]))
    return before, after, np.concatenate([np.zeros(0, np.bool_), *(c.covered for c in contours)])


def share_within(values: npt.ArrayLike, tolerance_mm: float) -> float | None:
    """Return the fraction of the values whose size is at most the tolerance; NaN ignored, None if nothing is left.

    >>> share_within([0.1, -0.2, 0.9, float("nan")], 0.5) == 2 / 3
    True
    """
    numbers = np.asarray(values, dtype=np.float64).ravel()
    numbers = numbers[~np.isnan(numbers)]
    return float(np.mean(np.abs(numbers) <= tolerance_mm)) if len(numbers) else None
