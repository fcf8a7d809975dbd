"""Gauss-Newton on SE(3): the one linear step that the rigid and the segment registration share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import exponential

__all__ = ["Rows", "freedoms", "motion_step", "stacked", "tukey"]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Linear equations for a small motion: the point should move by `residual` along `direction`.

    Parameters
    ----------
    points_mm, directions
        (n, 3) current points in the scan frame, and unit vectors.
    residuals_mm
        (n,) wanted move along the direction.
    weights
        (n,) non-negative.
    """

    points_mm: FloatArray
    directions: FloatArray
    residuals_mm: FloatArray
    weights: FloatArray


def stacked(*parts: Rows) -> Rows:
    """Return several sets of equations as one."""
    return Rows(
        np.concatenate([part.points_mm for part in parts]),
        np.concatenate([part.directions for part in parts]),
        np.concatenate([part.residuals_mm for part in parts]),
        np.concatenate([part.weights for part in parts]),
    )


def tukey(residuals: FloatArray, scale: float) -> FloatArray:
    """Return Tukey's biweight (1 - (r / c)^2)^2, 0 beyond c; also 0 where the residual is NaN."""
    u = np.where(np.isfinite(residuals), residuals / scale, np.inf)
    weight: FloatArray = np.where(np.abs(u) < 1.0, (1.0 - np.minimum(u * u, 1.0)) ** 2, 0.0)
    return weight


def motion_step(rows: Rows, prior: float, towards: FloatArray | None = None) -> FloatArray:
    """Solve for the small motion that meets the equations best, about their centroid.

    Minimises sum w (J xi - r)^2 + prior * sum w * |xi - towards|^2, the rotation part of xi scaled by the radius of
    gyration, so that a freedom that the equations leave open stays where the prior has it.

    Parameters
    ----------
    rows
        At least one equation of positive weight.
    prior
        Weight of the prior relative to the equations.
    towards
        (4, 4) motion of the current points to the place that the prior wants them; None for staying.

    Returns
    -------
    (4, 4) motion to be applied on the left.
    """
    centre, radius, A, b = _normal_equations(rows)
    wanted = np.zeros(6) if towards is None else _twist(towards, centre) * np.repeat([radius, 1.0], 3)
    xi = np.linalg.solve(A + prior * np.eye(6), b + prior * wanted)
    return exponential(xi / np.repeat([radius, 1.0], 3), centre)


def freedoms(rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Return how firmly the equations hold each of the six freedoms.

    Returns
    -------
    values
        (6,) singular values of the weighted Jacobian with lengths in radii of gyration, largest first; the weights
        sum to one, so each lies between 0 (open) and 1.
    twists
        (6, 6) rows: rotation vector and translation of the freedom that belongs to each value.
    """
    _, _, A, _ = _normal_equations(rows)
    values, vectors = np.linalg.eigh(A)
    return np.sqrt(np.maximum(values[::-1], 0.0)), vectors.T[::-1]


def _normal_equations(rows: Rows) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    w = rows.weights / rows.weights.sum()
    centre = w @ rows.points_mm
    arms = rows.points_mm - centre
    radius = max(float(np.sqrt(w @ np.sum(arms * arms, axis=1))), 1e-6)
    J = np.concatenate([np.cross(arms, rows.directions) / radius, rows.directions], axis=1)
    Jw = J * w[:, None]
    return centre, radius, Jw.T @ J, Jw.T @ np.where(rows.weights > 0.0, rows.residuals_mm, 0.0)


def _twist(T: FloatArray, centre: FloatArray) -> FloatArray:
    """Return (rotation vector, translation of the centre) of a motion."""
    turned = Rotation.from_matrix(T[:3, :3]).as_rotvec()
    return np.concatenate([turned, T[:3, :3] @ centre + T[:3, 3] - centre])
