"""Gauss-Newton on SE(3): the linear steps that the rigid and the segment registration share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.model import FloatArray, IntArray

__all__ = ["Rows", "freedoms", "motion_step", "motion_steps", "stacked", "tukey"]


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


def motion_step(rows: Rows, prior: float) -> FloatArray:
    """Solve for the small motion that meets the equations best, about their centroid.

    Minimises sum w (J xi - r)^2 + prior * sum w * |xi|^2, the rotation part of xi scaled by the radius of gyration, so
    that a freedom that the equations leave open stays as it is.

    Parameters
    ----------
    rows
        At least one equation of positive weight.
    prior
        Weight of the prior relative to the equations.

    Returns
    -------
    (4, 4) motion to be applied on the left.
    """
    return np.asarray(motion_steps(rows, np.zeros(len(rows.weights), dtype=np.int64), prior, np.eye(4)[None])[0])


def motion_steps(rows: Rows, group: IntArray, prior: float, towards: FloatArray) -> FloatArray:
    """Solve for one small motion for each group of equations, see `motion_step`.

    Parameters
    ----------
    rows
        The equations of all groups.
    group
        (n,) which group each belongs to.
    prior
        Weight of the prior relative to the equations.
    towards
        (g, 4, 4) motion of each group's points to the place that the prior wants them.

    Returns
    -------
    (g, 4, 4) motions to be applied on the left; the identity where a group has no weight.
    """
    groups = len(towards)
    centre, radius, A, b = _normal_equations(rows, group, groups)
    scale = np.repeat(np.stack([radius, np.ones(groups)], axis=1), 3, axis=1)
    wanted = _twists(towards, centre) * scale
    xi = np.linalg.solve(A + prior * np.eye(6), (b + prior * wanted)[..., None])[..., 0]
    xi[np.bincount(group, weights=rows.weights, minlength=groups) <= 0.0] = 0.0
    steps = np.tile(np.eye(4), (groups, 1, 1))
    steps[:, :3, :3] = Rotation.from_rotvec(xi[:, :3] / scale[:, :3]).as_matrix()
    steps[:, :3, 3] = centre - np.einsum("gij,gj->gi", steps[:, :3, :3], centre) + xi[:, 3:]
    return steps


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
    _, _, A, _ = _normal_equations(rows, np.zeros(len(rows.weights), dtype=np.int64), 1)
    values, vectors = np.linalg.eigh(A[0])
    return np.sqrt(np.maximum(values[::-1], 0.0)), vectors.T[::-1]


def _normal_equations(
    rows: Rows, group: IntArray, groups: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the centres (g, 3), radii (g,), matrices (g, 6, 6) and right sides (g, 6); weights of a group sum to 1."""

    def total(values: FloatArray) -> FloatArray:
        return np.bincount(group, weights=values, minlength=groups).astype(np.float64)

    w = rows.weights / np.maximum(total(rows.weights), 1e-300)[group]
    centre = np.stack([total(w * x) for x in rows.points_mm.T], axis=1)
    arms = rows.points_mm - centre[group]
    radius = np.maximum(np.sqrt(total(w * np.sum(arms * arms, axis=1))), 1e-6)
    J = np.concatenate([np.cross(arms, rows.directions) / radius[group, None], rows.directions], axis=1)
    A = np.empty((groups, 6, 6))
    for i in range(6):
        for j in range(i, 6):
            A[:, i, j] = A[:, j, i] = total(w * J[:, i] * J[:, j])
    residuals = np.where(rows.weights > 0.0, rows.residuals_mm, 0.0)
    return centre, radius, A, np.stack([total(w * residuals * x) for x in J.T], axis=1)


def _twists(T: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the (g, 6) rotation vector and translation of the centre of each motion."""
    moved = np.einsum("gij,gj->gi", T[:, :3, :3], centre) + T[:, :3, 3] - centre
    return np.concatenate([Rotation.from_matrix(T[:, :3, :3]).as_rotvec(), moved], axis=1)
