from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.report.camera import looking_at, pixels

coordinate = st.floats(-2000, 2000)
vector = st.tuples(coordinate, coordinate, coordinate)


@settings(deadline=None, max_examples=60)
@given(st.lists(vector, min_size=1, max_size=20), vector.filter(lambda v: np.linalg.norm(v) > 1.0), st.floats(0, 60))
def test_all_points_are_in_view_and_the_camera_is_square(points, outward, tilt) -> None:
    camera = looking_at(np.array(points), np.array(outward), tilt_deg=tilt)
    placed = pixels(camera, np.array(points))
    assert (placed >= -0.01).all()
    assert (placed <= np.array([1600, 900]) + 0.01).all()
    frame = np.stack([camera.right, camera.up, camera.towards_eye])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-9)
    cosine = camera.towards_eye @ np.array(outward) / np.linalg.norm(outward)
    assert cosine == pytest.approx(np.cos(np.radians(tilt)), abs=1e-9)


def test_the_longer_side_runs_to_the_right() -> None:
    tall = np.array([[0.0, 0, 0], [10, 100, 0]])
    camera = looking_at(tall, np.array([0.0, 0, 1]), tilt_deg=0)
    assert camera.right.tolist() == [0, 1, 0]


def test_axes_of_a_turned_part_give_the_same_picture_as_the_part_itself() -> None:
    points = np.random.default_rng(1).normal(0, [100, 40, 5], (30, 3))
    angle = 0.7
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    plain = looking_at(points, np.array([0.0, 0.2, 1]))
    turned = looking_at(points @ R.T, R @ np.array([0.0, 0.2, 1]), axes=R)
    assert pixels(turned, points @ R.T) == pytest.approx(pixels(plain, points), abs=1e-6)
