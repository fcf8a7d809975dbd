"""Orientations as VAL3 writes them: R = Rx(rx) Ry(ry) Rz(rz), in degrees.

The tool's Z axis is (sin ry, -sin rx cos ry, cos rx cos ry): it fixes rx and ry, and leaves rz as free spin. Where Z
lies along X of the frame (ry = +-90), rx is free too: there it is held, so that the flange does not turn for nothing.
"""

from __future__ import annotations

import math

import numpy as np

from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import from_parts
from sicp_postprocessors.rotary import head_angles

__all__ = [
    "angles_from_axes",
    "euler_angles",
    "flange_turns_deg",
    "pose_from_six",
    "rotation_matrices",
    "six_from_pose",
]

_GIMBAL_CONE_DEG = 1e-4


def angles_from_axes(axes: FloatArray, spin_deg: float, transport: bool) -> FloatArray:
    """Return rx, ry, rz (n, 3) in degrees for tool axes from tip to holder; the tool's Z points the other way.

    Parameters
    ----------
    axes
        (n, 3) unit vectors from tip to holder.
    spin_deg
        rz of the first move.
    transport
        False: the spin stays the same along the path, so that equal axes have equal orientations. True: the tool turns
        no more than its axis does from one move to the next, and the spin is what comes of it.

    Notes
    -----
    rx and ry are those of a head that turns about X and tilts about Y, so they follow the path through ry = 90 without
    a jump of the tool. Results have ry in [-90, 90], rx and rz in (-180, 180].

    >>> angles_from_axes(np.array([[0.0, 0.0, -1.0]]), 0.0, False).tolist()
    [[0.0, 0.0, 0.0]]
    """
    z = -axes
    head = head_angles(np.column_stack([z[:, 2], -z[:, 1], z[:, 0]]), "BC", _GIMBAL_CONE_DEG)
    angles = np.column_stack([head.turn_deg, 90.0 - head.tilt_deg, np.full(len(z), spin_deg)])
    if transport:
        angles[:, 2] = _transported_spins(rotation_matrices(angles)) + spin_deg
    return _canonical(angles)


def rotation_matrices(angles_deg: FloatArray) -> FloatArray:
    """Return Rx(rx) Ry(ry) Rz(rz) (n, 3, 3) of angles (n, 3) in degrees."""
    (a, b, c), (d, e, f) = np.cos(np.radians(angles_deg)).T, np.sin(np.radians(angles_deg)).T
    rows = [
        [b * c, -b * f, e],
        [a * f + d * e * c, a * c - d * e * f, -d * b],
        [d * f - a * e * c, d * c + a * e * f, a * b],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def euler_angles(R: FloatArray) -> tuple[float, float, float]:
    """Return rx, ry, rz in degrees of a rotation (3, 3); where ry is +-90, rx is 0 and rz holds the rest."""
    ry = math.atan2(R[0, 2], math.hypot(R[0, 0], R[0, 1]))
    if math.hypot(R[0, 0], R[0, 1]) < 1e-9:
        return 0.0, math.degrees(ry), math.degrees(math.atan2(R[1, 0], R[1, 1]))
    rx, rz = math.atan2(-R[1, 2], R[2, 2]), math.atan2(-R[0, 1], R[0, 0])
    return math.degrees(rx), math.degrees(ry), math.degrees(rz)


def pose_from_six(six: tuple[float, ...]) -> FloatArray:
    """Return the (4, 4) pose of x, y, z in mm and rx, ry, rz in degrees."""
    return from_parts(rotation_matrices(np.array([six[3:]]))[0], six[:3])


def six_from_pose(pose: FloatArray) -> tuple[float, ...]:
    """Return x, y, z in mm and rx, ry, rz in degrees of a (4, 4) pose."""
    return (*pose[:3, 3].tolist(), *euler_angles(pose[:3, :3]))


def flange_turns_deg(angles_deg: FloatArray) -> FloatArray:
    """Return how far the tool turns about its own axis in each move (n,), beyond what its axis demands; first 0."""
    turns: FloatArray = np.abs(np.diff(_transported_spins(rotation_matrices(angles_deg)), prepend=0.0))
    return turns


def _transported_spins(R: FloatArray) -> FloatArray:
    """Return the spins (n,) in degrees that undo all turning about the tool axis from each rotation to the next."""
    z = R[:, :, 2]
    swing, cosine = np.cross(z[:-1], z[1:]), np.einsum("ni,ni->n", z[:-1], z[1:])
    # Rodrigues' formula for the smallest rotation from one Z to the next; an axis that reverses has none.
    x, scale = R[:-1, :, 0], 1.0 / np.maximum(1.0 + cosine, 1e-12)
    carried = cosine[:, None] * x + np.cross(swing, x) + (np.einsum("ni,ni->n", swing, x) * scale)[:, None] * swing
    steps = np.arctan2(np.einsum("ni,ni->n", carried, R[1:, :, 1]), np.einsum("ni,ni->n", carried, R[1:, :, 0]))
    spins: FloatArray = np.degrees(np.concatenate([[0.0], np.cumsum(steps)]))
    return spins


def _canonical(angles_deg: FloatArray) -> FloatArray:
    """Return the same rotations with ry in [-90, 90], rx and rz in (-180, 180]."""
    rx, ry, rz = angles_deg.T
    over = np.cos(np.radians(ry)) < -1e-12
    flip = np.where(over, 180.0, 0.0)
    ry = np.where(over, 180.0 - ry, ry)
    wrapped = [180.0 - np.remainder(180.0 - angle, 360.0) for angle in (rx + flip, ry, rz + flip)]
    return np.column_stack(wrapped)
