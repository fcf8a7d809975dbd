import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import at, framed, moved, orthonormal
from sicp_cam.model import Contour
from sicp_cam.rigid_motion import apply, rotate


@pytest.fixture(scope="module")
def ring(synthetic):
    return framed(synthetic.contour(synthetic.circle(100.0)))


@pytest.fixture(scope="module")
def saddle(synthetic):
    return framed(synthetic.contour(synthetic.oval(150.0, 100.0), synthetic.dome(800.0, -1200.0)))


def assert_orthonormal(curve):
    axes = np.stack([curve.tangents, curve.inward, curve.outward], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.tile(np.eye(3), (len(axes), 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=1e-12)


@pytest.mark.parametrize("name", ["oval", "circle", "egg"])
def test_frames_are_orthonormal_right_handed_and_look_into_the_material(synthetic, name):
    size = (120.0, 90.0) if name == "oval" else (100.0,)
    contour = synthetic.contour(getattr(synthetic, name)(*size), synthetic.dome(900.0, 1500.0), rings_mm=(10.0,))
    curve = framed(contour)
    assert_orthonormal(curve)
    for point in contour.ring_points_mm:
        offset = point - curve.points_mm
        nearest = np.argmin(np.linalg.norm(offset, axis=1))
        assert offset[nearest] @ curve.inward[nearest] > 9.5


def test_frames_of_a_circle_are_those_of_the_formula(ring):
    angle = -ring.s_mm / 100.0  # a hole runs clockwise
    radial = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(ring))], axis=1)
    np.testing.assert_allclose(ring.points_mm, 100.0 * radial, atol=2e-2)  # arc length is counted along chords
    np.testing.assert_allclose(ring.inward, radial, atol=1e-3)  # the material is outside of the hole
    np.testing.assert_allclose(ring.outward, np.tile([0.0, 0.0, 1.0], (len(ring), 1)), atol=1e-12)
    assert ring.length_mm == pytest.approx(2 * np.pi * 100.0, rel=1e-5)


def test_the_frame_at_a_station_is_that_station(saddle):
    same = at(saddle, saddle.s_mm)
    for name in ("points_mm", "tangents", "inward", "outward"):
        np.testing.assert_allclose(getattr(same, name), getattr(saddle, name), atol=1e-12)


@settings(deadline=None, max_examples=40)
@given(s_mm=st.floats(-2000.0, 2000.0), turns=st.integers(-3, 3))
def test_a_closed_curve_is_periodic_and_its_frames_stay_orthonormal(saddle, s_mm, turns):
    here = at(saddle, np.array([s_mm]))
    again = at(saddle, np.array([s_mm + turns * saddle.length_mm]))
    assert_orthonormal(here)
    for name in ("points_mm", "tangents", "inward", "outward"):
        np.testing.assert_allclose(getattr(again, name), getattr(here, name), atol=1e-9)


def test_a_closed_curve_has_no_jump_at_its_seam(saddle):
    s = np.array([-1e-6, 0.0, 1e-6, saddle.length_mm - 1e-6, saddle.length_mm])
    assert np.ptp(at(saddle, s).points_mm, axis=0).max() < 1e-5


def test_between_stations_the_curve_is_the_analytic_one_within_the_chord_error(synthetic, ring):
    s = np.random.default_rng(0).uniform(0.0, ring.length_mm, 500)
    between = at(ring, s)
    radius = np.linalg.norm(between.points_mm, axis=1)
    assert np.abs(radius - 100.0).max() < 1.1 * 1.0**2 / (8.0 * 100.0)
    np.testing.assert_allclose(np.sum(between.inward * between.points_mm, axis=1), radius, atol=1e-3)


def test_an_open_curve_is_held_at_its_ends(synthetic):
    curve = framed(synthetic.contour(synthetic.wavy_edge(300.0)))
    ends = at(curve, np.array([-50.0, curve.length_mm + 50.0]))
    np.testing.assert_allclose(ends.points_mm, curve.points_mm[[0, -1]], atol=1e-12)
    assert ends.s_mm.tolist() == pytest.approx([0.0, curve.s_mm[-1]])


def test_a_moved_curve_keeps_its_parameter_and_turns_its_frames(synthetic, saddle):
    T = synthetic.random_pose(3)
    there = moved(saddle, T)
    np.testing.assert_allclose(there.points_mm, apply(T, saddle.points_mm), atol=1e-9)
    np.testing.assert_allclose(there.inward, rotate(T, saddle.inward), atol=1e-12)
    assert_orthonormal(there)
    assert np.array_equal(there.s_mm, saddle.s_mm)
    assert (there.length_mm, there.closed) == (saddle.length_mm, saddle.closed)


def test_orthonormal_keeps_the_normal_and_turns_the_tangent():
    T, B, N = orthonormal(np.array([[2.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 3.0]]))
    np.testing.assert_allclose([T[0], B[0], N[0]], np.eye(3), atol=1e-15)


def test_the_seam_segment_of_a_closed_contour_counts_for_its_length():
    square = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    tangents = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    closed, opened = (framed(Contour(square, tangents, normals, closed=c)) for c in (True, False))
    assert (closed.length_mm, opened.length_mm) == (40.0, 30.0)
    np.testing.assert_allclose(at(closed, np.array([35.0])).points_mm, [[0.0, 5.0, 0.0]])
