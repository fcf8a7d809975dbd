"""Give a curve the frames of the scanned surface: T along it, N the normal of the surface."""

from __future__ import annotations

import numpy as np

from sicp_cam.contour.frames import FramedCurve, orthonormal
from sicp_cam.model import FloatArray
from sicp_cam.registration.edge import EdgeMeasurement, on_curve

__all__ = ["displaced", "tilted"]


def displaced(rigid: FramedCurve, points_mm: FloatArray, across: FloatArray) -> FramedCurve:
    """Return the curve through points that a bent part carried its rigidly registered stations to.

    Parameters
    ----------
    rigid
        The curve before, k stations.
    points_mm
        (k, 3) where they are; the displacement is smooth, so that T gains its derivative even at a sharp corner.
    across
        (k, 3) a direction in the scanned surface that points into the material: N is normal to T and to it.
    """
    T = rigid.tangents + _derivative(points_mm - rigid.points_mm, rigid)
    T, B, N = orthonormal(T, np.cross(T, across))
    return FramedCurve(rigid.s_mm, points_mm, T, B, N, rigid.length_mm, rigid.closed)


def tilted(curve: FramedCurve, measured: EdgeMeasurement) -> FramedCurve:
    """Return the curve with B and N tilted about T by the slope of the scan surface.

    Where the scan shows no surface the tilt is carried over from both sides of the gap.

    Parameters
    ----------
    curve
        A curve in the scan frame.
    measured
        What `edge.measure` found from that very curve.
    """
    slope = on_curve(measured.slope, measured, curve)[:, None]
    T, B, N = orthonormal(curve.tangents, curve.outward - slope * curve.inward)
    return FramedCurve(curve.s_mm, curve.points_mm, T, B, N, curve.length_mm, curve.closed)


def _derivative(values: FloatArray, curve: FramedCurve) -> FloatArray:
    """Return the derivative of (k, 3) values by arc length, by central differences."""
    if not curve.closed:
        return np.asarray(np.gradient(values, curve.s_mm, axis=0))
    s = np.concatenate([[curve.s_mm[-1] - curve.length_mm], curve.s_mm, [curve.s_mm[0] + curve.length_mm]])
    return np.asarray(np.gradient(np.vstack([values[-1:], values, values[:1]]), s, axis=0)[1:-1])
