"""The error of a corrected path against the known truth: one measure for every method, case and peer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Truth", "error"]


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A nominal path and the edge of the bent part that it should have followed.

    Parameters
    ----------
    path_part_mm, axis_part
        (n, 3) the nominal path and its outward axes, in the part frame.
    edge_scan_mm, inward, outward
        (m, 3) the true edge, and the true directions into the material and out of the surface, in the scan frame.
    covered
        (m,) True where the scan shows the edge.
    closed
        True if the path ends where it begins.
    """

    path_part_mm: np.ndarray
    axis_part: np.ndarray
    edge_scan_mm: np.ndarray
    inward: np.ndarray
    outward: np.ndarray
    covered: np.ndarray
    closed: bool = True


def error(tips_mm: np.ndarray, axes: np.ndarray | None, truth: Truth) -> dict[str, float]:
    """Measure (k, 3) tips of a corrected path in the scan frame, and its (k, 3) axes where there are any.

    From each covered point of the true edge to the nearest place on the path. Sliding along the edge is not an error:
    it does not change the part.

    Returns
    -------
    By name, in mm and degrees: of hypot(normal, out) the mean `both`, `p95` and `max`; of the part across the edge in
    the surface the mean size `normal` and the signed mean `bias`, positive into the material; of the part out of the
    surface the mean size `out`; the mean angle `axis`, NaN without axes.
    """
    if truth.closed and np.linalg.norm(tips_mm[0] - tips_mm[-1]) > 1e-6:
        tips_mm = np.vstack([tips_mm, tips_mm[:1]])
        axes = None if axes is None else np.vstack([axes, axes[:1]])
    points = truth.edge_scan_mm[truth.covered]
    inward, outward = truth.inward[truth.covered], truth.outward[truth.covered]
    best, t = _nearest(points, tips_mm)
    off = tips_mm[best] + t * (tips_mm[best + 1] - tips_mm[best]) - points
    normal, out = np.sum(off * inward, axis=1), np.sum(off * outward, axis=1)
    both = np.hypot(normal, out)
    return {
        "both": float(both.mean()),
        "p95": float(np.percentile(both, 95)),
        "max": float(both.max()),
        "normal": float(np.abs(normal).mean()),
        "bias": float(normal.mean()),
        "out": float(np.abs(out).mean()),
        "axis": float("nan") if axes is None else _angle_deg(axes[best] + t * (axes[best + 1] - axes[best]), outward),
    }


def _nearest(points: np.ndarray, tips: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the segment of the polyline that is nearest to each point, and the (m, 1) fraction on it."""
    start, step = tips[:-1], np.diff(tips, axis=0)
    length2 = np.maximum(np.sum(step * step, axis=1), 1e-18)
    best, fraction = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 1))
    for row, point in enumerate(points):
        t = np.clip(np.sum((point - start) * step, axis=1) / length2, 0.0, 1.0)
        best[row] = np.argmin(np.sum((start + t[:, None] * step - point) ** 2, axis=1))
        fraction[row] = t[best[row]]
    return best, fraction


def _angle_deg(axes: np.ndarray, outward: np.ndarray) -> float:
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(np.sum(axes * outward, axis=1), -1.0, 1.0))).mean())
