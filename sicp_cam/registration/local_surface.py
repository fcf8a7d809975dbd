"""The scan's surface beside a curve: a robust local polynomial at every station.

In the frames of the curve a point lies at depth h into the material, height v out of the surface, and distance d along
the curve from a station. Each station fits v = a + b h + c h^2 + e d + f d^2 + g d h by weighted least squares,
Gaussian in d. The terms in d keep the fit unbiased beside gaps and where the curve does not yet follow the bend.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.contour.projection import CurveCoordinates
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.gauss_newton import tukey
from sicp_cam.registration.stations import interpolated, windows

__all__ = ["LocalSurface", "fit_surface"]

DEPTH_SPACINGS = 10.0
"""Depth of the band of scan points that the surface is fitted to, in point spacings."""
WIDTH_SPACINGS = 4.0
"""Standard deviation of the window along the contour, in point spacings."""
ROUNDS = 3
LEAST_POINTS = 20.0
POWERS_D = np.array([0, 0, 0, 1, 2, 1])
POWERS_H = np.array([0, 1, 2, 0, 0, 1])


@dataclass(frozen=True, slots=True, eq=False)
class LocalSurface:
    """Height of the scan surface over the curve, v = a + b h + c h^2, at each of k stations.

    Parameters
    ----------
    coefficients
        (k, 3) a in mm, b, c in 1/mm; NaN where too few points are near.
    on_surface
        (n,) True for the scan points that lie on the fitted surface, within its noise.
    noise_mm
        Standard deviation of single points from it.
    """

    coefficients: FloatArray
    on_surface: BoolArray
    noise_mm: float

    def height_mm(self, depth_mm: FloatArray) -> FloatArray:
        """Return the height at a depth for each station."""
        a, b, c = self.coefficients.T
        height: FloatArray = a + b * depth_mm + c * depth_mm**2
        return height

    def slope(self, depth_mm: FloatArray) -> FloatArray:
        """Return dv/dh at a depth for each station."""
        slope: FloatArray = self.coefficients[:, 1] + 2.0 * self.coefficients[:, 2] * depth_mm
        return slope


def fit_surface(
    seen: CurveCoordinates, stations: FloatArray, curve: FramedCurve, spacing_mm: float, reach_mm: float
) -> LocalSurface:
    """Fit the local surface at every station.

    Parameters
    ----------
    seen
        (n,) scan points in the frames of the curve.
    stations
        (k,) evenly spaced arc lengths.
    curve
        The curve.
    spacing_mm
        Point spacing of the scan; the windows scale with it.
    reach_mm
        Points further out of the surface than this are left out.
    """
    band_mm = DEPTH_SPACINGS * spacing_mm
    inside = (seen.inward_mm > -2.0 * spacing_mm) & (seen.inward_mm < band_mm) & (np.abs(seen.outward_mm) < reach_mm)
    s, h, v = seen.s_mm[inside], seen.inward_mm[inside] / band_mm, seen.outward_mm[inside]
    G = windows(s, stations, curve, WIDTH_SPACINGS * spacing_mm, powers=5)
    trust = np.ones(len(s))
    fit = np.full((len(stations), 6), np.nan)
    noise, residual = 0.0, np.zeros(len(s))
    for _ in range(ROUNDS):
        powers = trust[:, None] * h[:, None] ** np.arange(5)
        moments = np.stack([g @ powers for g in G])  # [p, k, q] = sum w d^p h^q
        right = np.stack([g @ (powers[:, :3] * v[:, None]) for g in G[:3]])
        A = moments[POWERS_D[:, None] + POWERS_D, :, POWERS_H[:, None] + POWERS_H].transpose(2, 0, 1)
        b = right[POWERS_D, :, POWERS_H].T
        enough = moments[0, :, 0] > LEAST_POINTS
        # The ridge is far below the noise; it only keeps a window with all its points on one side solvable.
        ridge = 1e-5 * moments[0, :, 0][:, None, None] * np.eye(6)
        fit[enough] = np.linalg.solve((A + ridge)[enough], b[enough][..., None])[..., 0]
        fit[~enough] = np.nan
        near = interpolated(fit[:, :3], stations, s, curve)
        residual = v - (near[:, 0] + near[:, 1] * h + near[:, 2] * h * h)
        known = np.isfinite(residual)
        noise = float(1.4826 * np.median(np.abs(residual[known]))) if known.any() else 0.0
        trust = tukey(residual, max(4.7 * noise, 1e-6))
    on_surface = np.zeros(len(seen.s_mm), dtype=bool)
    on_surface[np.flatnonzero(inside)[np.abs(residual) < max(4.7 * noise, 1e-6)]] = True
    return LocalSurface(fit[:, :3] / band_mm ** np.arange(3), on_surface, noise)
