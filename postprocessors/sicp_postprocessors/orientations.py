"""Orientations of robot tools: a tool axis leaves the spin about itself free, and each controller writes turns anew.

All robots share one rule, so that a path turns the flange alike on each: R = Rx(rx) Ry(ry) Rz(rz), which is how VAL3
writes it. The tool's Z axis is (sin ry, -sin rx cos ry, cos rx cos ry): it fixes rx and ry, and leaves rz as free spin.
Where Z lies along X of the frame (ry = +-90), rx is free too: there it is held, so that the flange does not turn for
nothing.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import from_parts

__all__ = [
    "Six",
    "angles_from_axes",
    "axis_errors_deg",
    "euler_angles",
    "euler_zyx",
    "flange_turns_deg",
    "pose_from_six",
    "pose_from_zyx",
    "quaternions",
    "rotation_matrices",
    "rotation_vectors",
    "six_from_pose",
]

Six = tuple[float, float, float, float, float, float]
"""A pose as x, y, z in mm and rx, ry, rz in degrees."""

_GIMBAL_CONE_DEG = 1e-4
_GIMBAL_COSINE = 1e-7
_NO_TURN = 1e-12


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
    rx and ry follow the path through ry = 90 without a jump of the tool. Results have ry in [-90, 90], rx and rz in
    (-180, 180].

    >>> angles_from_axes(np.array([[0.0, 0.0, -1.0]]), 0.0, False).tolist()
    [[0.0, 0.0, 0.0]]
    """
    angles = np.column_stack([*_about_x(-axes), np.full(len(axes), spin_deg)])
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


def euler_zyx(R: FloatArray) -> FloatArray:
    """Return a, b, c (n, 3) in degrees of rotations (n, 3, 3) with R = Rz(a) Ry(b) Rx(c): KUKA's A B C, Fanuc's R P W.

    Where b is +-90 only a - c or a + c is fixed: there a stays what it was in the row before, 0 at first.

    >>> R = rotation_matrices(np.array([[0.0, 90.0, 0.0], [180.0, 0.0, 0.0]]))
    >>> (euler_zyx(R).round(6) + 0.0).tolist()
    [[0.0, 90.0, 0.0], [0.0, 0.0, 180.0]]
    """
    free = np.hypot(R[:, 0, 0], R[:, 1, 0]) > _GIMBAL_COSINE
    last = np.maximum.accumulate(np.where(free, np.arange(len(R)), -1))
    a = np.where(last >= 0, np.arctan2(R[last, 1, 0], R[last, 0, 0]), 0.0)
    # With a given, Rz(-a) R = Ry(b) Rx(c) tells b and c everywhere, and exactly where a was free to choose.
    cos_a, sin_a = np.cos(a), np.sin(a)
    b = np.arctan2(-R[:, 2, 0], cos_a * R[:, 0, 0] + sin_a * R[:, 1, 0])
    c = np.arctan2(sin_a * R[:, 0, 2] - cos_a * R[:, 1, 2], cos_a * R[:, 1, 1] - sin_a * R[:, 0, 1])
    return np.asarray(np.degrees(np.column_stack([a, b, c])))


def quaternions(R: FloatArray) -> FloatArray:
    """Return unit quaternions (n, 4), scalar first, of rotations (n, 3, 3): the first with its scalar from 0 on.

    Each later one has the sign that brings it nearer to the one before.

    >>> quaternions(rotation_matrices(np.array([[180.0, 0.0, 0.0]]))).round(6).tolist()
    [[0.0, 1.0, 0.0, 0.0]]
    """
    q = np.roll(Rotation.from_matrix(R).as_quat(), 1, axis=1)
    signs = np.ones(len(q))
    signs[:1] = np.where(q[:1, 0] < 0.0, -1.0, 1.0)
    signs[1:] = np.where(np.einsum("ni,ni->n", q[:-1], q[1:]) < 0.0, -1.0, 1.0)
    # +0.0: a product with -1 would leave zeros with a sign.
    continuous: FloatArray = q * np.cumprod(signs)[:, None] + 0.0
    return continuous


def rotation_vectors(R: FloatArray) -> FloatArray:
    """Return rotation vectors (n, 3) in radians of rotations (n, 3, 3), without a jump where the angle passes pi.

    >>> rotation_vectors(rotation_matrices(np.array([[180.0, 0.0, 0.0]]))).round(6).tolist()
    [[3.141593, 0.0, 0.0]]
    """
    q = quaternions(R)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(sine, q[:, 0])
    vectors: FloatArray = np.where(sine > _NO_TURN, angle / np.maximum(sine, _NO_TURN), 0.0)[:, None] * q[:, 1:]
    return vectors


def pose_from_six(six: tuple[float, ...]) -> FloatArray:
    """Return the (4, 4) pose of x, y, z in mm and rx, ry, rz in degrees."""
    return from_parts(rotation_matrices(np.array([six[3:]]))[0], six[:3])


def pose_from_zyx(six: tuple[float, ...]) -> FloatArray:
    """Return the (4, 4) pose of x, y, z in mm and a, b, c in degrees with R = Rz(a) Ry(b) Rx(c).

    >>> (pose_from_zyx((1.0, 2.0, 3.0, 90.0, 0.0, 90.0))[:3, 2].round(6) + 0.0).tolist()
    [1.0, 0.0, 0.0]
    """
    a, b, c = six[3:]
    turns = rotation_matrices(np.array([[0.0, 0.0, a], [0.0, b, 0.0], [c, 0.0, 0.0]]))
    return from_parts(turns[0] @ turns[1] @ turns[2], six[:3])


def six_from_pose(pose: FloatArray) -> tuple[float, ...]:
    """Return x, y, z in mm and rx, ry, rz in degrees of a (4, 4) pose."""
    return (*pose[:3, 3].tolist(), *euler_angles(pose[:3, :3]))


def flange_turns_deg(angles_deg: FloatArray) -> FloatArray:
    """Return how far the tool turns about its own axis in each move (n,), beyond what its axis demands; first 0."""
    turns: FloatArray = np.abs(np.diff(_transported_spins(rotation_matrices(angles_deg)), prepend=0.0))
    return turns


def axis_errors_deg(axes: FloatArray, others: FloatArray) -> FloatArray:
    """Return the angles between pairs of unit vectors, exact for small angles, which the arc cosine is not."""
    chords = np.linalg.norm(axes - others, axis=1)
    errors: FloatArray = np.degrees(2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0)))
    return errors


def _about_x(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rx and ry in degrees, unwrapped, that turn Z of a tool into the unit vectors z (n, 3).

    The angle from the X axis and the heading about it have a twin: the other sign, and half a turn further. From one
    vector to the next the nearer of both is taken; whether that changes sides does not depend on the side.
    """
    steep = np.arctan2(np.hypot(z[:, 1], z[:, 2]), z[:, 0])
    heading = np.arctan2(-z[:, 1], z[:, 2])
    cone = math.radians(_GIMBAL_CONE_DEG)
    free = np.flatnonzero((steep > cone) & (steep < math.pi - cone))
    if not len(free):
        return np.zeros(len(z)), 90.0 - np.degrees(steep)
    turned = np.diff(heading[free])
    same = np.abs(np.diff(steep[free])) + np.abs(_wrapped(turned))
    other = np.abs(steep[free][1:] + steep[free][:-1]) + np.abs(_wrapped(turned + math.pi))
    side = np.concatenate([[0], np.cumsum(other < same) % 2])
    last = np.maximum(np.searchsorted(free, np.arange(len(z)), side="right") - 1, 0)
    rx = np.unwrap(heading[free] + math.pi * side)[last]
    # On the X axis rx is held, and the angle from it is the one that comes nearest to z all the same.
    sideways = -z[:, 1] * np.sin(rx) + z[:, 2] * np.cos(rx)
    return np.degrees(rx), 90.0 - np.degrees(np.arctan2(sideways, z[:, 0]))


def _wrapped(angles: FloatArray) -> FloatArray:
    """Return angles in radians from -pi to pi."""
    return np.asarray(np.remainder(angles + math.pi, 2.0 * math.pi) - math.pi)


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
