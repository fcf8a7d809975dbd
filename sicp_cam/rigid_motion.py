"""Rigid motions as 4x4 matrices T_to_from, and the small algebra on them.

`T_scan_part` maps coordinates of the part frame to the scan frame: x_scan = R x_part + t.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from sicp_cam.model import FloatArray

__all__ = ["apply", "best_fit", "exponential", "from_parts", "inverse", "is_rigid", "rotate"]


def from_parts(rotation: npt.ArrayLike, translation: npt.ArrayLike) -> FloatArray:
    """Return the (4, 4) motion with the given (3, 3) rotation and (3,) translation."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def apply(T: FloatArray, points: FloatArray) -> FloatArray:
    """Move (n, 3) points by a (4, 4) motion.

    >>> apply(from_parts(np.eye(3), [1, 0, 0]), np.zeros((1, 3))).tolist()
    [[1.0, 0.0, 0.0]]
    """
    moved: FloatArray = points @ T[:3, :3].T + T[:3, 3]
    return moved


def rotate(T: FloatArray, vectors: FloatArray) -> FloatArray:
    """Turn (n, 3) direction vectors by the rotation of a (4, 4) motion."""
    turned: FloatArray = vectors @ T[:3, :3].T
    return turned


def inverse(T: FloatArray) -> FloatArray:
    """Return the inverse of a rigid (4, 4) motion."""
    return from_parts(T[:3, :3].T, -T[:3, :3].T @ T[:3, 3])


def exponential(twist: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the motion of a small twist (rotation vector, translation) about a centre.

    x -> R(w) (x - c) + c + t, the update step of Gauss-Newton on SE(3) about the centroid.
    """
    R = Rotation.from_rotvec(twist[:3]).as_matrix()
    return from_parts(R, centre - R @ centre + twist[3:])


def best_fit(source: FloatArray, target: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """Return the rigid motion that brings source points nearest to their target points in the least squares sense.

    Kabsch's algorithm: the singular value decomposition of the cross-covariance, with the determinant held at +1.

    Parameters
    ----------
    source, target
        (n, 3) pairs, n >= 3, not all on one line.
    weights
        (n,) non-negative weights; all one if left out.

    >>> pose = best_fit(np.eye(3), np.eye(3) + [0, 0, 5])
    >>> np.round(pose[:3, 3], 9).tolist()
    [0.0, 0.0, 5.0]
    """
    w = np.ones(len(source)) if weights is None else weights
    w = w / w.sum()
    source_centre, target_centre = w @ source, w @ target
    U, _, Vt = np.linalg.svd((source - source_centre).T @ ((target - target_centre) * w[:, None]))
    R = Vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return from_parts(R, target_centre - R @ source_centre)


def is_rigid(T: FloatArray, tolerance: float = 1e-6) -> bool:
    """Say whether a (4, 4) matrix is a proper rigid motion: orthonormal, determinant +1, last row 0 0 0 1."""
    return bool(
        T.shape == (4, 4)
        and np.isfinite(T).all()
        and np.allclose(T[3], [0, 0, 0, 1], rtol=0.0, atol=tolerance)
        and np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), rtol=0.0, atol=tolerance)
        and np.linalg.det(T[:3, :3]) > 0
    )
