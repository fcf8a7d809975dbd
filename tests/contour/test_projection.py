import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import framed, moved
from sicp_cam.contour.projection import coordinates, nearest
from sicp_cam.model import Contour
from sicp_cam.rigid_motion import apply

RADIUS = 100.0
SAG_MM = 1.0**2 / (8.0 * RADIUS)


@pytest.fixture(scope="module")
def hole(synthetic):
    return framed(synthetic.contour(synthetic.circle(RADIUS)))


@settings(deadline=None, max_examples=60)
@given(angle=st.floats(0.0, 6.28), depth=st.floats(-60.0, 200.0), height=st.floats(-30.0, 30.0))
def test_a_point_beside_a_circle_has_the_coordinates_of_the_formula(hole, angle, depth, height):
    r = RADIUS + depth
    point = np.array([[r * np.cos(-angle), r * np.sin(-angle), height]])
    seen = coordinates(point, hole)
    around = (seen.s_mm[0] - RADIUS * angle + 0.5 * hole.length_mm) % hole.length_mm - 0.5 * hole.length_mm
    half_turn = 0.006 * abs(depth) + 0.01  # of two stations: outside of a polygon its corners collect the feet
    assert abs(around) < half_turn
    assert seen.inward_mm[0] == pytest.approx(depth, abs=2.0 * SAG_MM)
    assert seen.outward_mm[0] == pytest.approx(height, abs=1e-9)
    assert abs(seen.along_mm[0]) < half_turn
    assert nearest(point, hole)[1][0] == pytest.approx(np.hypot(depth, height), abs=2.0 * SAG_MM)


def test_coordinates_do_not_depend_on_where_curve_and_points_stand(synthetic, hole):
    points = np.random.default_rng(0).uniform(-150, 150, (200, 3)) * [1, 1, 0.1]
    T = synthetic.random_pose(5)
    here, there = coordinates(points, hole), coordinates(apply(T, points), moved(hole, T))
    for name in ("s_mm", "along_mm", "inward_mm", "outward_mm"):
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), atol=1e-6)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), closed=st.booleans())
def test_the_nearest_place_is_that_of_a_search_over_every_segment(synthetic, seed, closed):
    rng = np.random.default_rng(seed)
    outline = synthetic.egg(60.0) if closed else synthetic.wavy_edge(300.0)
    curve = framed(synthetic.contour(outline, synthetic.dome(400.0, 700.0), rings_mm=()))
    points = curve.points_mm[rng.integers(0, len(curve), 20)] + rng.uniform(-15.0, 15.0, (20, 3))
    ring = np.vstack([curve.points_mm, curve.points_mm[:1]]) if closed else curve.points_mm
    start, step = ring[:-1], np.diff(ring, axis=0)
    t = np.clip(np.sum((points[:, None] - start) * step, axis=2) / np.sum(step * step, axis=1), 0.0, 1.0)
    every = np.linalg.norm(start + t[..., None] * step - points[:, None], axis=2)
    s_mm, distance = nearest(points, curve)
    np.testing.assert_allclose(distance, every.min(axis=1), atol=1e-9)
    assert ((s_mm >= 0.0) & (s_mm <= curve.length_mm + 1e-9)).all()


def test_beyond_the_ends_of_an_open_curve_the_offset_along_is_told():
    x = np.arange(0.0, 101.0)
    line = np.column_stack([x, np.zeros((101, 2))])
    frame = np.tile([1.0, 0, 0], (101, 1)), np.tile([0.0, 0, 1], (101, 1))
    curve = framed(Contour(line, *frame, closed=False))
    seen = coordinates(np.array([[-7.0, 3.0, 1.0], [108.0, -2.0, 0.0], [40.25, 5.0, 0.0]]), curve)
    np.testing.assert_allclose(seen.s_mm, [0.0, 100.0, 40.25], atol=1e-12)
    np.testing.assert_allclose(seen.along_mm, [-7.0, 8.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(seen.inward_mm, [3.0, -2.0, 5.0], atol=1e-12)
