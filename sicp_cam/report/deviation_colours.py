"""Colours for signed deviations: one neutral colour within the tolerance, blue below it, red above it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.colors import to_rgb

from sicp_cam.model import FloatArray
from sicp_cam.report.lettering import ColourBar

__all__ = ["deviation_bar", "deviation_colours"]

_NEUTRAL = "#a9d3a0"
_BELOW = ("#08306b", "#1c63a8", "#4a97c9", "#92c5e8", "#c6def0")
_ABOVE = ("#fbd0b0", "#f79a6b", "#e2593f", "#b81a26", "#67000d")


def deviation_bar(deviation_mm: FloatArray, tolerance_mm: float) -> ColourBar:
    """Return the colour steps for some deviations.

    Four steps on either side lead from the tolerance to a round number near the 99th percentile of the deviations; what
    lies beyond has the darkest colour.

    Parameters
    ----------
    deviation_mm
        (n,) deviations; NaN ignored.
    tolerance_mm
        Half the width of the neutral band, positive.

    >>> deviation_bar(np.array([0.1, -4.4]), 0.5).limits
    (-4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5)
    """
    size = np.abs(deviation_mm[np.isfinite(deviation_mm)])
    largest = float(np.percentile(size, 99)) if len(size) else 0.0
    step = _round_up(max(largest - tolerance_mm, 0.4 * tolerance_mm) / 4)
    upper = [round(tolerance_mm + n * step, 9) for n in range(5)]
    limits = (*(-value for value in reversed(upper)), *upper)
    return ColourBar(
        limits,
        (*_BELOW[1:], _NEUTRAL, *_ABOVE[:-1]),
        _BELOW[0],
        _ABOVE[-1],
        "out (of the surface) / mm, + outward",
    )


def deviation_colours(deviation_mm: FloatArray, bar: ColourBar) -> npt.NDArray[np.uint8]:
    """Return (n, 3) red, green, blue of 0..255 for (n,) finite deviations."""
    table = np.array([to_rgb(colour) for colour in (bar.below, *bar.colours, bar.above)])
    limits = np.array(bar.limits)
    middle = len(limits) // 2
    within = np.abs(deviation_mm) <= limits[middle]
    step = np.where(within, middle, np.searchsorted(limits, deviation_mm))
    return np.round(255.0 * table[step]).astype(np.uint8)


def _round_up(value: float) -> float:
    """Return the next 1, 2, 2.5 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= value * (1 - 1e-9)))
