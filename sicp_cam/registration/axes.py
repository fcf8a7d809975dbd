"""Turn the frames of a corrected curve so that N is the normal of the scanned surface."""

from __future__ import annotations

import numpy as np

from sicp_cam.contour.frames import FramedCurve, orthonormal
from sicp_cam.registration.edge import EdgeMeasurement, on_curve

__all__ = ["tilted"]


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
    slope = on_curve(np.where(measured.covered, measured.slope, np.nan), measured, curve, bridge=True)[:, None]
    T, B, N = orthonormal(curve.tangents, curve.outward - slope * curve.inward)
    return FramedCurve(curve.s_mm, curve.points_mm, T, B, N, curve.length_mm, curve.closed)
