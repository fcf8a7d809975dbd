"""Evenly spaced stations along a curve; sums over the points around them, and values between them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import FloatArray, IntArray

__all__ = ["even_stations", "interpolated", "nearest_station", "smoothed", "sums"]


def even_stations(curve: FramedCurve, spacing_mm: float) -> FloatArray:
    """Return (k,) evenly spaced arc lengths about one spacing apart; an open curve has one at each end."""
    count = max(16, round(curve.length_mm / spacing_mm))
    return np.linspace(0.0, curve.length_mm, count, endpoint=not curve.closed)


def nearest_station(s_mm: FloatArray, stations: FloatArray, curve: FramedCurve) -> IntArray:
    """Return the index of the station nearest to each of (n,) arc lengths."""
    index = np.round(s_mm / (stations[1] - stations[0])).astype(np.int64)
    return np.asarray(np.mod(index, len(stations)) if curve.closed else np.clip(index, 0, len(stations) - 1))


def sums(s_mm: FloatArray, stations: FloatArray, curve: FramedCurve, values: FloatArray | None = None) -> FloatArray:
    """Return the number of points nearest to each station, or the sum of their values, (k,)."""
    index = nearest_station(s_mm, stations, curve)
    return np.bincount(index, weights=values, minlength=len(stations)).astype(np.float64)


def smoothed(values: FloatArray, stations: FloatArray, curve: FramedCurve, width_mm: float) -> FloatArray:
    """Average values of the stations under a Gaussian window along the curve; zeros lie beyond open ends.

    Parameters
    ----------
    values
        (k,) or (k, c).
    width_mm
        Standard deviation of the window.
    """
    width = width_mm / (stations[1] - stations[0])
    mode = "wrap" if curve.closed else "constant"
    return np.asarray(gaussian_filter1d(values, width, axis=0, mode=mode, truncate=3.0))


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
