"""Evenly spaced stations along a curve, and the Gaussian windows in arc length around them."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import FloatArray

__all__ = ["even_stations", "interpolated", "windows"]

CUT = 3.0
"""Windows end at this many standard deviations."""


def even_stations(curve: FramedCurve, spacing_mm: float) -> FloatArray:
    """Return (k,) evenly spaced arc lengths about one spacing apart; an open curve has one at each end."""
    count = max(16, round(curve.length_mm / spacing_mm))
    return np.linspace(0.0, curve.length_mm, count, endpoint=not curve.closed)


def windows(
    s_mm: FloatArray, stations: FloatArray, curve: FramedCurve, width_mm: float, powers: int = 1
) -> list[sparse.csr_array]:
    """Return the Gaussian weights of points at stations, times powers of their distance along the curve.

    Parameters
    ----------
    s_mm
        (n,) arc lengths of the points.
    stations
        (k,) evenly spaced arc lengths.
    curve
        Tells whether the arc length is periodic.
    width_mm
        Standard deviation of the window.
    powers
        Number of matrices wanted.

    Returns
    -------
    list of (k, n) sparse arrays; number p holds exp(-d^2 / 2) d^p, d being the distance in widths.
    """
    k = len(stations)
    step = stations[1] - stations[0]
    half = int(np.ceil(CUT * width_mm / step))
    column = np.round(s_mm / step).astype(np.int64)[:, None] + np.arange(-half, half + 1)
    d = (s_mm[:, None] - column * step) / width_mm
    inside = np.abs(d) <= CUT
    if curve.closed:
        column %= k
    else:
        inside &= (column >= 0) & (column < k)
    point = np.broadcast_to(np.arange(len(s_mm))[:, None], column.shape)[inside]
    row, d = column[inside], d[inside]
    weight = np.exp(-0.5 * d * d)
    return [sparse.csr_array((weight * d**p, (row, point)), shape=(k, len(s_mm))) for p in range(powers)]


def interpolated(values: FloatArray, stations: FloatArray, s_mm: FloatArray, curve: FramedCurve) -> FloatArray:
    """Interpolate (k,) or (k, c) values of evenly spaced stations linearly at other arc lengths."""
    k = len(stations)
    position = s_mm / (stations[1] - stations[0])
    left = np.floor(position).astype(np.int64)
    t = position - left
    if curve.closed:
        low, high = left % k, (left + 1) % k
    else:
        low, high = np.clip(left, 0, k - 1), np.clip(left + 1, 0, k - 1)
    if values.ndim == 2:
        t = t[:, None]
    mixed: FloatArray = values[low] * (1.0 - t) + values[high] * t
    return mixed
