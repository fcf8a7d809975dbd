"""The scan's surface beside a curve: a robust quadratic in depth whose coefficients are smooth along the curve.

In the frames of the curve a point lies at arc length s, depth h into the material and height v out of the surface.
Near the rim, g = h - rim(s), the surface is

    v = a(s) + b(s) g + c(s) g^2,

a, b and c cubic splines of s. The coefficients minimise

    sum w (v - fit)^2 / noise^2 + stiffness * integral (a''^2 + b''^2 + c''^2) ds,

g in units of the band's depth; the weights w are Tukey's. The stiffness is the one of largest marginal
likelihood (Wahba 1985; Wood 2011): the data choose how far along the curve they are averaged.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from sicp_cam.contour.splines import CurveSplines, LocalRows
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.gauss_newton import tukey
from sicp_cam.registration.likelihood import most_likely

__all__ = ["LocalSurface", "band_depth_mm", "fit_surface"]

DEPTH_SPACINGS, LEAST_DEPTH_MM = 10.0, 6.0
"""Depth of the band of scan points that the surface is fitted to; of a fine scan it is as deep as its slope needs."""
OUTSIDE_SPACINGS = 2.0
ROUNDS = 3
ROBUST, FIRST_ROBUST = 4.7, 15.0
SHAPE_DOUBT = 0.1
"""Standard uncertainty that the quadratic itself adds, over the noise: a scan bends in more ways than it can follow."""
LEAST_NOISE_MM = 1e-4
RIDGE = 1e-6
"""Information added to every coefficient, far below that of one point: it only keeps empty stretches solvable."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalSurface:
    """Height of the scan surface over the curve beside its rim.

    Parameters
    ----------
    splines
        Basis along the curve, K functions.
    coefficients
        (3, K) of a in mm, b, and c in 1/mm.
    information
        (3 K, 3 K) inverse of their covariance, the coefficients scaled by powers of `band_mm`.
    band_mm
        Depth of the band.
    on_surface
        (n,) True for the scan points that lie on the fitted surface, within its noise.
    noise_mm
        Standard deviation of single points from it.
    stiffness
        What the data chose.
    halves_mm
        Root mean square difference at the rim between the fits to every other point and to the rest.
    """

    splines: CurveSplines
    coefficients: FloatArray
    information: FloatArray
    band_mm: float
    on_surface: BoolArray
    noise_mm: float
    stiffness: float
    halves_mm: float

    def height_and_slope(self, s_mm: FloatArray, g_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the height and dv/dh at n arc lengths and depths behind the rim."""
        a, b, c = self.splines.at(s_mm).times(self.coefficients.T).T
        return a + b * g_mm + c * g_mm**2, b + 2.0 * c * g_mm

    def uncertainty_mm(self, s_mm: FloatArray, g_mm: FloatArray) -> FloatArray:
        """Return the standard uncertainty of the height at n arc lengths and depths behind the rim."""
        rows = _rows(self.splines, s_mm, g_mm / self.band_mm).dense()
        spread = cho_solve(cho_factor(self.information), rows.T)
        return np.asarray(np.sqrt(np.einsum("ij,ji->i", rows, spread) + (SHAPE_DOUBT * self.noise_mm) ** 2))


def band_depth_mm(spacing_mm: float) -> float:
    """Return the depth of the band of scan points that a surface is fitted to."""
    return max(DEPTH_SPACINGS * spacing_mm, LEAST_DEPTH_MM)


def fit_surface(
    s_mm: FloatArray,
    g_mm: FloatArray,
    v_mm: FloatArray,
    splines: CurveSplines,
    spacing_mm: float,
    reach_mm: float,
) -> LocalSurface:
    """Fit the surface beside the rim.

    Parameters
    ----------
    s_mm, g_mm, v_mm
        (n,) arc length, depth behind the rim, and height of the scan points in the frames of the curve.
    splines
        Basis along the curve.
    spacing_mm
        Point spacing of the scan; the band scales with it.
    reach_mm
        Points further out of the surface than this are left out.
    """
    band_mm = band_depth_mm(spacing_mm)
    inside = np.flatnonzero((g_mm > -OUTSIDE_SPACINGS * spacing_mm) & (g_mm < band_mm) & (np.abs(v_mm) < reach_mm))
    v, g = v_mm[inside], g_mm[inside] / band_mm
    rows = _rows(splines, s_mm[inside], g)
    D = splines.second_differences()
    rough = np.array(np.kron(np.eye(3), D.T @ D), dtype=np.float64)
    free = 3 * len(D)
    # The wall of a cut-out, where it was scanned, stands at the rim: the first look is at what lies behind it.
    trust = (g * band_mm > spacing_mm).astype(np.float64)
    noise_mm = max(float(np.std(v)) if len(v) else 0.0, LEAST_NOISE_MM)
    stiffness = 1.0
    for turn in range(ROUNDS):
        weight = trust / noise_mm**2
        N, right = rows.gram(weight) + RIDGE * np.eye(rows.size), rows.summed(weight * v)
        if turn < ROUNDS - 1:
            evidence = partial(_evidence, N, right, rough, free)
            unit = splines.length_mm / 1e3
            stiffness = most_likely(evidence, start=stiffness if turn else None, unit=unit)
        A = N + stiffness * rough
        fit = np.asarray(cho_solve(cho_factor(A), right))
        residual = v - rows.times(fit)
        judged = residual[trust > 0.0] if turn == 0 else residual
        noise_mm = max(float(1.4826 * np.median(np.abs(judged))) if len(judged) else 0.0, LEAST_NOISE_MM)
        trust = tukey(residual, (FIRST_ROBUST if turn == 0 else ROBUST) * noise_mm)
    half = weight * (np.arange(len(v)) % 2)
    of_half = rows.gram(half) + 0.5 * RIDGE * np.eye(rows.size), rows.summed(half * v)
    of_rest = N - of_half[0], right - of_half[1]
    fits = [cho_solve(cho_factor(M + 0.5 * stiffness * rough), b)[: len(splines)] for M, b in (of_half, of_rest)]
    on_surface = np.zeros(len(s_mm), dtype=bool)
    on_surface[inside[np.abs(residual) < ROBUST * noise_mm]] = True
    coefficients = fit.reshape(3, -1) / band_mm ** np.arange(3)[:, None]
    halves_mm = float(np.sqrt(np.mean((fits[0] - fits[1]) ** 2)))
    return LocalSurface(splines, coefficients, A, band_mm, on_surface, noise_mm, stiffness, halves_mm)


def _rows(splines: CurveSplines, s_mm: FloatArray, g: FloatArray) -> LocalRows:
    """Return the rows of the quadratic: coefficients of 1, then g, then g^2."""
    near, K = splines.at(s_mm), len(splines)
    columns = np.concatenate([near.columns + power * K for power in range(3)], axis=1)
    values = np.concatenate([near.values * g[:, None] ** power for power in range(3)], axis=1)
    return LocalRows(columns, values, 3 * K)


def _evidence(N: FloatArray, right: FloatArray, rough: FloatArray, free: int, stiffness: float) -> float:
    """Return the logarithm of the marginal likelihood of a stiffness, up to a constant."""
    factor = cho_factor(N + stiffness * rough)
    fit = cho_solve(factor, right)
    return float(0.5 * right @ fit + 0.5 * free * np.log(stiffness) - np.log(np.diag(factor[0])).sum())
