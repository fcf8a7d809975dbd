from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.contour.frames import at, framed, moved
from sicp_cam.contour.splines import CurveSplines, splines_along
from sicp_cam.registration.in_surface import in_surface
from sicp_cam.rigid_motion import exponential

STEP = 6.0
RADIUS = 80.0


def displacements(curve, rigid=None):
    return in_surface(splines_along(curve, STEP, 96), curve, rigid or curve)


def coefficients_of(space, vectors):
    """Return the coefficients of a displacement that is given at the knots: along B, then along T."""
    return np.sum(np.tile(vectors, (2, 1)) * space.axes, axis=1)


def at_knots(space):
    return at(space.curve, space.splines.centres_mm).points_mm


def roughness(space, c):
    return float(c @ space.rough @ c)


def bulge(space, lobes):
    """Return the coefficients of a radial displacement of 1 mm cos(lobes * angle) on a circle about the origin."""
    knots = at_knots(space)
    radial = knots / np.linalg.norm(knots, axis=1, keepdims=True)
    return coefficients_of(space, np.cos(lobes * np.arctan2(knots[:, 1], knots[:, 0]))[:, None] * radial)


@pytest.fixture(scope="module")
def circle(synthetic):
    return displacements(framed(synthetic.contour(synthetic.circle(RADIUS), rings_mm=())))


@pytest.fixture(scope="module")
def sharp(synthetic):
    """A rectangular opening with sharp corners in a plane."""
    outline = synthetic.rounded_rectangle(160.0, 110.0, 1e-3, hole=True)
    return displacements(framed(synthetic.contour(outline, step_mm=0.5, rings_mm=())))


@pytest.mark.parametrize("twist", [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0.01, 0, 0, 0]])
@pytest.mark.parametrize("shape", ["circle", "sharp"])
def test_a_rigid_motion_in_the_surface_costs_nothing(request, twist, shape):
    space = request.getfixturevalue(shape)
    knots = at_knots(space)
    motion = np.cross(np.array(twist[:3], dtype=float), knots) + np.array(twist[3:], dtype=float)
    assert roughness(space, coefficients_of(space, motion)) < 1e-9 * roughness(space, bulge(space, 2))
    assert space.bends == 2 * len(space.splines) - 3


def test_on_a_curved_surface_too(synthetic):
    """A rigid motion of a dome lies in its surface but for its part along N, which is no displacement in it."""
    space = displacements(framed(synthetic.contour(synthetic.egg(70.0), synthetic.dome(300.0, 500.0), rings_mm=())))
    c = coefficients_of(space, np.tile([1.0, 0.5, 0.0], (len(space.splines), 1)))
    assert roughness(space, c) < 1e-3 * roughness(space, bulge(space, 2))


@pytest.mark.parametrize("lobes", [2, 3, 4])
def test_roughness_is_the_integral_of_the_squared_second_derivative_of_vectors(circle, lobes):
    """For cos(m a) e_r on a circle of radius R: 2 pi R ((m^2 + 1)^2 + 4 m^2) / (2 R^4)."""
    exact = np.pi / RADIUS**3 * ((lobes**2 + 1) ** 2 + 4 * lobes**2)
    assert roughness(circle, bulge(circle, lobes)) == pytest.approx(exact, rel=0.04)


def test_one_smooth_vector_serves_both_sides_of_a_sharp_corner(sharp):
    vector = np.array([0.7, -0.4, 0.0])
    c = coefficients_of(sharp, np.tile(vector, (len(sharp.splines), 1)))
    s = np.linspace(0.0, sharp.curve.length_mm, 500, endpoint=False)
    np.testing.assert_allclose(sharp.shift_mm(s, c), np.tile(vector, (500, 1)), atol=1e-9)
    np.testing.assert_allclose(sharp.rows(s).times(c), at(sharp.curve, s).inward @ vector, atol=1e-9)
    depth = sharp.rows(s).times(c)
    assert np.abs(np.diff(depth)).max() > 0.25  # the same vector, seen along B, jumps


def test_depths_that_are_smooth_along_a_corner_are_rough(sharp):
    """Pushing both sides of each corner outward by the same depth opens it: no rigid motion, so it costs."""
    K = len(sharp.splines)
    widened = np.concatenate([np.ones(K), np.zeros(K)])
    assert roughness(sharp, widened) > 10.0 * roughness(sharp, bulge(sharp, 2))


def test_rows_know_the_depth_of_the_vectors_and_shifts_lie_in_the_surface(synthetic):
    curve = framed(synthetic.contour(synthetic.egg(70.0), synthetic.dome(150.0, 250.0), rings_mm=()))
    space, s = displacements(curve), np.linspace(0.0, curve.length_mm, 300, endpoint=False)
    c = np.random.default_rng(0).normal(size=2 * len(space.splines))
    shift, here = space.shift_mm(s, c), at(curve, s)
    np.testing.assert_allclose(np.sum(shift * here.outward, axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(space.rows(s).times(c), np.sum(shift * here.inward, axis=1), atol=1e-12)
    np.testing.assert_array_equal(space.slides, np.repeat([0.0, 1.0], len(space.splines)))


def test_what_the_curve_has_moved_already_is_counted(circle):
    """A field that says what has been done leaves no shift; one that says nothing takes it back."""
    rigid = circle.curve
    angle = np.arctan2(rigid.points_mm[:, 1], rigid.points_mm[:, 0])
    step = np.cos(2.0 * angle)[:, None] * rigid.inward
    space = displacements(replace(rigid, points_mm=rigid.points_mm + step), rigid)
    s = np.linspace(0.0, rigid.length_mm, 200, endpoint=False)
    exact = np.interp(s, np.append(rigid.s_mm, rigid.length_mm), np.append(step, step[:1], axis=0)[:, 0])
    np.testing.assert_allclose(space.moved_inward_mm(s), space.rows(s).times(space.moved), atol=0.01)
    np.testing.assert_allclose(space.shift_mm(s, space.moved), 0.0, atol=0.01)
    np.testing.assert_allclose(-space.shift_mm(s, np.zeros(2 * len(space.splines)))[:, 0], exact, atol=1e-9)


def test_the_roughness_of_what_has_been_done_counts_too(circle):
    """The rigid pose is where the part was straight: a curve that a piece has kinked is no new beginning."""
    twist = exponential(np.array([0.0, 0.0, 0.004, 0.6, 0.0, 0.0]), np.zeros(3))
    turned = displacements(moved(circle.curve, twist), circle.curve)
    assert roughness(turned, turned.moved) < 1e-9
    angle = np.arctan2(circle.curve.points_mm[:, 1], circle.curve.points_mm[:, 0])
    points = circle.curve.points_mm + np.cos(5.0 * angle)[:, None] * circle.curve.inward
    waved = displacements(replace(circle.curve, points_mm=points), circle.curve)
    exact = np.pi / RADIUS**3 * (26.0**2 + 100.0)
    assert roughness(waved, waved.moved) == pytest.approx(exact, rel=0.05)


def test_a_turn_of_an_open_contour_costs_nothing_and_its_bow_what_it_is(synthetic):
    curve = framed(synthetic.contour(synthetic.wavy_edge(300.0, 1e-6), rings_mm=()))
    space = in_surface(CurveSplines(20, curve.length_mm, False), curve, curve)
    x = space.splines.centres_mm
    along_b = np.concatenate([0.01 * x, np.zeros(len(x))])  # a turn in the plane
    bow = np.concatenate([1e-4 * x**2, np.zeros(len(x))])
    assert roughness(space, along_b) < 1e-9 * roughness(space, bow)
    assert roughness(space, bow) == pytest.approx((2e-4) ** 2 * curve.length_mm, rel=0.15)
