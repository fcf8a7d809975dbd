"""The numbers by which a run is told: residuals, the uncertainty of the contour, the difference of two half scans."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.result import RegisteredContour, Residuals

__all__ = [
    "BAND",
    "Summary",
    "all_contours",
    "both",
    "leave_out_summary",
    "residual_summary",
    "share_within",
    "summary",
    "uncertainty_summary",
]

BAND = 1.96
"""Standard uncertainties to either side within which 95 % of normally distributed deviations lie."""

Summary = dict[str, float]
"""mean, sd, rms, p95 and max, in the unit of the values."""

Spread = dict[str, float | None]
"""mean_mm and max_mm; None where there is none, or a value is not finite."""


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


def uncertainty_summary(contours: Sequence[RegisteredContour]) -> dict[str, Any] | None:
    """Return the stated standard uncertainty (1 sigma) of the corrected contours, mean and largest, mm.

    `mean_mm` and `max_mm` are those of hypot(normal, out), the uncertainty of the distance across the contour, over the
    stations that the scan shows; `normal` and `out` hold those of its parts. `bridged` holds all of them over the other
    stations, and is None where there are none.

    Parameters
    ----------
    contours
        Registered contours, taken together; None is returned where one of them states no uncertainty.
    """
    parts = [(c.normal_u_mm, c.out_u_mm) for c in contours if c.normal_u_mm is not None and c.out_u_mm is not None]
    if not parts or len(parts) < len(contours):
        return None
    normal, out = (np.concatenate(values) for values in zip(*parts, strict=True))
    covered = np.concatenate([contour.covered for contour in contours])
    bridged = None if covered.all() else _spreads(normal[~covered], out[~covered])
    return {**_spreads(normal[covered], out[covered]), "bridged": bridged}


def _spreads(normal_u_mm: FloatArray, out_u_mm: FloatArray) -> dict[str, Any]:
    both_u_mm = np.hypot(normal_u_mm, out_u_mm)
    return {**_spread(both_u_mm), "normal": _spread(normal_u_mm), "out": _spread(out_u_mm)}


def _spread(u_mm: FloatArray) -> Spread:
    """Return mean and largest; one value that is not known leaves both unknown, for it may be the largest."""
    known = len(u_mm) > 0 and bool(np.isfinite(u_mm).all())
    return {"mean_mm": float(u_mm.mean()) if known else None, "max_mm": float(u_mm.max()) if known else None}


def leave_out_summary(contours: Sequence[RegisteredContour]) -> dict[str, float | None] | None:
    """Return the RMS difference of the contours found from two halves of the scan, mm: that of the worst contour.

    `normal`, `out`, and `both`, their hypotenuse, which says which contour is the worst; None each where a contour's is
    not finite.

    Parameters
    ----------
    contours
        Registered contours; None is returned where one of them was not looked at in halves.
    """
    found = [(c.leave_out.normal_mm, c.leave_out.out_mm) for c in contours if c.leave_out is not None]
    if not found or len(found) < len(contours):
        return None
    sizes = np.hypot(*np.array(found).T)
    if not np.isfinite(sizes).all():
        return {"normal": None, "out": None, "both": None}
    worst = int(np.argmax(sizes))
    return {"normal": float(found[worst][0]), "out": float(found[worst][1]), "both": float(sizes[worst])}
