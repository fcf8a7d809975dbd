"""Parallel cameras: chosen from the contour alone, and simple enough to place labels without a renderer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray

__all__ = ["Camera", "looking_at", "pixels"]


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A parallel projection: what lies at `focus_mm` is in the middle of the picture.

    Parameters
    ----------
    focus_mm
        (3,) middle of the picture.
    right, up
        (3,) unit vectors along the picture's edges; the eye is on the side of right x up.
    width_px, height_px
        Size of the picture.
    mm_per_px
        Scale.
    """

    focus_mm: FloatArray
    right: FloatArray
    up: FloatArray
    width_px: int
    height_px: int
    mm_per_px: float

    @property
    def towards_eye(self) -> FloatArray:
        """Return the (3,) unit vector from the scene to the eye."""
        return np.cross(self.right, self.up)


def looking_at(
    points_mm: FloatArray,
    outward: FloatArray,
    *,
    tilt_deg: float = 20.0,
    axes: FloatArray | None = None,
    width_px: int = 1600,
    height_px: int = 900,
    margin: float = 0.07,
) -> Camera:
    """Return the camera that looks along -outward, tilted a little, with all points in view.

    Parameters
    ----------
    points_mm
        (n, 3) points that must be seen, n >= 1.
    outward
        (3,) direction to the eye before the tilt, any length.
    tilt_deg
        How far the eye is lowered towards the viewer's side; 0 looks straight on.
    axes
        (3, 3) whose columns are the axes of the part: the one that fills the picture best runs to the right, so that
        pictures of the same part look alike. The axes of the coordinates if left out.
    margin
        Free border as a fraction of the picture, on every side.

    >>> camera = looking_at(np.array([[0.0, 0, 0], [100, 50, 0]]), np.array([0.0, 0, 1]), tilt_deg=0)
    >>> camera.right.tolist(), camera.focus_mm.tolist()
    ([1.0, 0.0, 0.0], [50.0, 25.0, 0.0])
    """
    out = outward / np.linalg.norm(outward)
    tilt = np.radians(tilt_deg)
    best: Camera | None = None
    for axis in (np.eye(3) if axes is None else axes).T:
        right = axis - (axis @ out) * out
        if np.linalg.norm(right) < 0.6:
            continue
        right = right / np.linalg.norm(right)
        level = np.cross(out, right)
        up = np.cos(tilt) * level + np.sin(tilt) * out
        camera = _framing(points_mm, right, up, width_px, height_px, margin)
        if best is None or camera.mm_per_px < best.mm_per_px * 0.999:
            best = camera
    assert best is not None  # of three orthogonal axes at least two are far from any direction
    return best


def pixels(camera: Camera, points_mm: FloatArray) -> FloatArray:
    """Return (n, 2) positions of points in the picture: px from its left and from its lower edge."""
    offset = points_mm - camera.focus_mm
    across = np.stack([offset @ camera.right, offset @ camera.up], axis=1) / camera.mm_per_px
    placed: FloatArray = across + 0.5 * np.array([camera.width_px, camera.height_px])
    return placed


def _framing(
    points: FloatArray, right: FloatArray, up: FloatArray, width_px: int, height_px: int, margin: float
) -> Camera:
    across = np.stack([points @ right, points @ up], axis=1)
    low, high = across.min(axis=0), across.max(axis=0)
    room = (1.0 - 2.0 * margin) * np.array([width_px, height_px])
    scale = max(float(np.max((high - low) / room)), 1e-6)
    middle = 0.5 * (low + high)
    towards = np.cross(right, up)
    depth = towards @ points.mean(axis=0)
    focus = middle[0] * right + middle[1] * up + depth * towards
    return Camera(focus, right, up, width_px, height_px, scale)
