"""Contours whose deformation is known in closed form, and paths along them."""

from types import SimpleNamespace

import numpy as np
import pytest

from sicp_cam.contour.choice import Assignment
from sicp_cam.contour.frames import FramedCurve, moved, orthonormal
from sicp_cam.contour.projection import nearest
from sicp_cam.model import ToolPath
from sicp_cam.registration.result import RegisteredContour, Residuals
from sicp_cam.toolpath.settings import ToolPathSettings
from sicp_cam.toolpath.steps import divided, feed_steps
from sicp_cam.toolpath.transfer import correct_path

NONE = np.zeros((0, 3))


def curve(points, tangents, normals, closed=False):
    points = np.asarray(points, dtype=float)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    length = s[-1] + (np.linalg.norm(points[0] - points[-1]) if closed else 0.0)
    return FramedCurve(s, points, *orthonormal(np.asarray(tangents, float), np.asarray(normals, float)), length, closed)


def straight(length_mm=200.0, step_mm=0.5):
    """Return an edge along x, the material on its +y side, outside +z."""
    x = np.linspace(0.0, length_mm, round(length_mm / step_mm) + 1)
    zero, one = np.zeros_like(x), np.ones_like(x)
    return curve(np.stack([x, zero, zero], 1), np.stack([one, zero, zero], 1), np.stack([zero, zero, one], 1))


def rolled(nominal, radius_mm):
    """Roll a curve in the plane z = 0 about an axis along y: an isometry, so that lengths stay."""
    x, y, _ = nominal.points_mm.T
    a = x / radius_mm
    ex = np.stack([np.cos(a), np.zeros_like(a), -np.sin(a)], 1)
    ey = np.broadcast_to([0.0, 1.0, 0.0], ex.shape)
    normals = np.stack([np.sin(a), np.zeros_like(a), np.cos(a)], 1)
    points = np.stack([radius_mm * np.sin(a), y, radius_mm * np.cos(a) - radius_mm], 1)
    tangents = nominal.tangents[:, :1] * ex + nominal.tangents[:, 1:2] * ey
    T, B, N = orthonormal(tangents, normals)
    return FramedCurve(nominal.s_mm, points, T, B, N, nominal.length_mm, nominal.closed)


def hole(radius_mm=100.0, centre=(0.0, 0.0), count=1200):
    """Return a round hole in the plane: travel clockwise, so that the material lies to its left."""
    a = -2.0 * np.pi * np.arange(count) / count
    c, s, zero = np.cos(a), np.sin(a), np.zeros(count)
    points = np.stack([radius_mm * c + centre[0], radius_mm * s + centre[1], zero], 1)
    return curve(points, np.stack([s, -c, zero], 1), np.stack([zero, zero, zero + 1.0], 1), closed=True)


def registered(nominal, corrected, covered=None, number=1, rigid=None):
    k = len(nominal)
    unknown = Residuals(np.zeros(k), np.zeros(k))
    seen = np.ones(k, dtype=bool) if covered is None else np.asarray(covered, dtype=bool)
    rigid = nominal if rigid is None else rigid
    return RegisteredContour(
        number, nominal, rigid, corrected, seen, NONE, unknown, unknown, (), np.zeros(0), NONE, NONE
    )  # fmt: skip


def path(tips, axes=(0.0, 0.0, 1.0), *, rapid=(), feeds=1500.0, events=(), **more):
    tips = np.asarray(tips, dtype=float)
    n = len(tips)
    fast = np.zeros(n, dtype=bool)
    fast[list(rapid)] = True
    feed = np.where(fast, 0.0, feeds)
    axes = np.broadcast_to(np.asarray(axes, float), (n, 3))
    return ToolPath(tips, axes, feed, fast, np.arange(n) + 10, tuple(events), **more)


def corrected(tool_path, contours, T=None, *, follows=None, distance_mm=None, on_contour_mm=20.0, **settings):
    """Correct a path; each move follows the first contour, at its true distance, if nothing else is said."""
    n = len(tool_path)
    which = np.zeros(n, dtype=np.int64) if follows is None else np.asarray(follows, dtype=np.int64)
    settings = ToolPathSettings(**settings)
    steps = divided(tool_path, feed_steps(tool_path, settings.step_mm))
    follows = which[steps.source]
    if distance_mm is None:
        distances = np.stack([nearest(steps.tips_mm, contour.nominal)[1] for contour in contours])
        distance = distances[follows, np.arange(len(follows))]
    else:
        distance = np.asarray(distance_mm, dtype=float)[steps.source]
    assignment = Assignment(follows, distance, tuple(range(len(contours))))
    T = np.eye(4) if T is None else T
    return correct_path(tool_path, steps, assignment, contours, T, settings, on_contour_mm)


@pytest.fixture(scope="session")
def made():
    """Give the builders of this module to the tests."""
    return SimpleNamespace(
        curve=curve, straight=straight, rolled=rolled, hole=hole, moved=moved, registered=registered, path=path,
        corrected=corrected,
    )  # fmt: skip
