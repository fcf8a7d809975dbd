"""Curves with a frame (T, B, N) at every station: the form in which every contour is registered and corrected.

T is the travel, N the outward surface normal, B = N x T the direction in the surface that points into the material.
A station is named by its arc length on the *nominal* contour, on the deformed curve too, so that a nominal curve and
all its corrected forms share their parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import Contour, FloatArray
from sicp_cam.rigid_motion import apply, rotate

__all__ = ["FramedCurve", "at", "framed", "moved", "orthonormal"]


@dataclass(frozen=True, slots=True, eq=False)
class FramedCurve:
    """Stations of a curve, each with an orthonormal frame; linear between stations.

    Parameters
    ----------
    s_mm
        (k,) arc length on the nominal contour, rising from 0.
    points_mm, tangents, inward, outward
        (k, 3) position and the unit vectors T, B and N.
    length_mm
        Arc length of the whole nominal contour; the period where it is closed.
    closed
        True if the last station is followed by the first.
    """

    s_mm: FloatArray
    points_mm: FloatArray
    tangents: FloatArray
    inward: FloatArray
    outward: FloatArray
    length_mm: float
    closed: bool

    def __len__(self) -> int:
        return len(self.s_mm)


def orthonormal(tangents: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit T, B, N with N kept in direction and T turned into the plane across N; (n, 3) each."""
    N = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    T = tangents - np.sum(tangents * N, axis=1, keepdims=True) * N
    T = T / np.linalg.norm(T, axis=1, keepdims=True)
    return T, np.cross(N, T), N


def framed(contour: Contour) -> FramedCurve:
    """Return a nominal contour as a framed curve, one station per sample."""
    points = contour.points_mm
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    T, B, N = orthonormal(contour.tangents, contour.normals)
    s_mm = np.concatenate([[0.0], np.cumsum(steps)])
    closing = float(np.linalg.norm(points[0] - points[-1])) if contour.closed else 0.0
    return FramedCurve(s_mm, points, T, B, N, float(s_mm[-1]) + closing, contour.closed)


def moved(curve: FramedCurve, T_to_from: FloatArray) -> FramedCurve:
    """Return the curve carried along by a rigid (4, 4) motion."""
    return FramedCurve(
        curve.s_mm,
        apply(T_to_from, curve.points_mm),
        rotate(T_to_from, curve.tangents),
        rotate(T_to_from, curve.inward),
        rotate(T_to_from, curve.outward),
        curve.length_mm,
        curve.closed,
    )


def at(curve: FramedCurve, s_mm: FloatArray) -> FramedCurve:
    """Return the curve's frames at other arc lengths, by interpolation between stations.

    Parameters
    ----------
    curve
        k stations.
    s_mm
        (m,) arc lengths; taken modulo the length where the curve is closed, held at the ends where it is not.
    """
    wanted = np.mod(s_mm, curve.length_mm) if curve.closed else np.clip(s_mm, curve.s_mm[0], curve.s_mm[-1])
    knots = np.append(curve.s_mm, curve.length_mm) if curve.closed else curve.s_mm
    left = np.clip(np.searchsorted(knots, wanted, side="right") - 1, 0, len(knots) - 2)
    right = (left + 1) % len(curve)
    t = ((wanted - knots[left]) / (knots[left + 1] - knots[left]))[:, None]

    def between(values: FloatArray) -> FloatArray:
        mixed: FloatArray = values[left] * (1.0 - t) + values[right] * t
        return mixed

    T, B, N = orthonormal(between(curve.tangents), between(curve.outward))
    return FramedCurve(wanted, between(curve.points_mm), T, B, N, curve.length_mm, curve.closed)
