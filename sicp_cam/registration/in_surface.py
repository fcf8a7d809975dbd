"""Smooth displacements of a contour within the scanned surface, as splines of vectors along it.

Vectors, not depths, are smooth: at a sharp corner of the contour, where B turns at once, the material on both sides
moves alike. The displacement is counted from the rigid pose, because that is what the bending of a part makes smooth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.splines import CurveSplines, LocalRows
from sicp_cam.model import FloatArray

__all__ = ["InSurface", "in_surface"]

MOTION_SHARE = 0.4
"""Least part of a rigid motion in the surface over the largest one's: what is mostly out of it is no freedom here."""


@dataclass(frozen=True, slots=True, eq=False)
class InSurface:
    """Displacements w(s) in the surface since the rigid pose: K splines times B, and K times T, of their knots.

    Parameters
    ----------
    splines
        Basis along the contour.
    curve, rigid
        Where the contour is now, and after the rigid registration; stations in common.
    axes
        (2 K, 3) B, then T, at the knots.
    rough
        (2 K, 2 K) integral of |w''|^2 as a quadratic form, in 1/mm^3, where w is free of rigid motions.
    slides
        (2 K,) 1 for the coefficients along T, 0 for those along B.
    moved
        (2 K,) coefficients of how far the curve lies from its rigid pose already.
    bends
        Rank of `rough`: number of ways to bend.
    """

    splines: CurveSplines
    curve: FramedCurve
    rigid: FramedCurve
    axes: FloatArray
    rough: FloatArray
    slides: FloatArray
    moved: FloatArray
    bends: int

    def rows(self, s_mm: FloatArray) -> LocalRows:
        """Return the part of each of the 2 K coefficients in w . B at n arc lengths."""
        near, inward, K = self.splines.at(s_mm), at(self.curve, s_mm).inward, len(self.splines)
        along = [np.einsum("npi,ni->np", self.axes[near.columns + first], inward) for first in (0, K)]
        columns = np.concatenate([near.columns, near.columns + K], axis=1)
        return LocalRows(columns, np.concatenate([near.values * part for part in along], axis=1), 2 * K)

    def moved_inward_mm(self, s_mm: FloatArray) -> FloatArray:
        """Return (n,) how far the curve lies from its rigid pose already, along B."""
        now = at(self.curve, s_mm)
        return np.asarray(np.sum((now.points_mm - at(self.rigid, s_mm).points_mm) * now.inward, axis=1))

    def shift_mm(self, s_mm: FloatArray, coefficients: FloatArray) -> FloatArray:
        """Return the (n, 3) displacement that remains from the curve, in the surface."""
        now, K = at(self.curve, s_mm), len(self.splines)
        vectors = coefficients[:K, None] * self.axes[:K] + coefficients[K:, None] * self.axes[K:]
        rest = self.splines.at(s_mm).times(vectors) - (now.points_mm - at(self.rigid, s_mm).points_mm)
        aside: FloatArray = rest - np.sum(rest * now.outward, axis=1, keepdims=True) * now.outward
        return aside


def in_surface(splines: CurveSplines, curve: FramedCurve, rigid: FramedCurve) -> InSurface:
    """Return the displacements of a curve.

    Second differences of the vectors are taken in the surface only: their part along N belongs to its curvature.
    """
    knots = at(curve, splines.centres_mm)
    axes = np.concatenate([knots.inward, knots.tangents])
    D = splines.second_differences()
    middle = knots.outward if splines.closed else knots.outward[1:-1]
    bend = np.hstack([D, D])[:, :, None] * axes  # (m, 2 K, 3)
    bend -= np.einsum("mki,mi->mk", bend, middle)[:, :, None] * middle[:, None, :]
    flat = bend.transpose(0, 2, 1).reshape(-1, len(axes))
    # The outermost knots of an open curve lie beyond its ends, on its tangent.
    beyond = 0.0 if splines.closed else splines.centres_mm - np.clip(splines.centres_mm, 0.0, splines.length_mm)
    places = knots.points_mm + np.multiply(beyond, knots.tangents.T).T
    motions = _rigid_motions(np.tile(places, (2, 1)), axes)
    flat = flat - (flat @ motions) @ motions.T
    slides = np.repeat([0.0, 1.0], len(splines))
    change = np.tile(knots.points_mm - at(rigid, splines.centres_mm).points_mm, (2, 1))
    moved = np.sum(change * axes, axis=1)
    return InSurface(splines, curve, rigid, axes, flat.T @ flat, slides, moved, len(axes) - motions.shape[1])


def _rigid_motions(points_mm: FloatArray, axes: FloatArray) -> FloatArray:
    """Return an orthonormal basis, (2 K, at most 6), of the displacements along axes that leave the shape as it is.

    The primary pose is not exact: what it lacks must cost nothing.
    """
    arms = points_mm - points_mm.mean(axis=0)
    size = max(float(np.sqrt(np.mean(np.sum(arms * arms, axis=1)))), 1e-9)
    U, values, _ = np.linalg.svd(np.hstack([axes, np.cross(arms, axes) / size]), full_matrices=False)
    return np.asarray(U[:, values > MOTION_SHARE * values[0]])
