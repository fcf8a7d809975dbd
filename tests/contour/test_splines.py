import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import framed
from sicp_cam.contour.splines import LEAST_INTERVALS, CurveSplines, LocalRows, splines_along

LENGTH = 300.0


@pytest.fixture(scope="module", params=[True, False], ids=["closed", "open"])
def splines(request):
    return CurveSplines(24, LENGTH, request.param)


def fitted(splines, function):
    """Return the coefficients of the spline that lies closest to a function of arc length."""
    s = np.linspace(0.0, LENGTH, 4000, endpoint=not splines.closed)
    return np.linalg.lstsq(splines.at(s).dense(), function(s), rcond=None)[0]


def test_the_splines_sum_to_one_everywhere_and_none_is_negative(splines):
    rows = splines.at(np.linspace(0.0, LENGTH, 1001))
    assert rows.values.shape == (1001, 4)
    assert rows.values.min() >= 0.0
    np.testing.assert_allclose(rows.values.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(rows.times(np.ones(len(splines))), 1.0, atol=1e-12)


def test_a_periodic_basis_has_no_seam():
    splines = CurveSplines(24, LENGTH, True)
    s = np.linspace(-LENGTH, 2.0 * LENGTH, 301)
    np.testing.assert_allclose(splines.at(s).dense(), splines.at(np.mod(s, LENGTH)).dense(), atol=1e-9)
    c = np.random.default_rng(0).normal(size=len(splines))
    h = 1e-3
    before, at_seam, after = splines.at(np.array([LENGTH - h, 0.0, h])).times(c)
    assert before + after == pytest.approx(2.0 * at_seam, abs=1e-6)  # no kink: 1e-6 is h^2 times the curvature


def test_an_open_basis_holds_its_ends():
    splines = CurveSplines(24, LENGTH, False)
    beyond = splines.at(np.array([-50.0, LENGTH + 50.0])).dense()
    np.testing.assert_allclose(beyond, splines.at(np.array([0.0, LENGTH])).dense(), atol=1e-9)
    assert len(splines) == 27
    assert (splines.at(np.array([0.0, LENGTH])).columns[:, [0, -1]] == [[0, 3], [23, 26]]).all()


def test_each_spline_is_largest_at_its_centre(splines):
    inside = (splines.centres_mm >= 0.0) & (splines.centres_mm <= LENGTH)
    dense = splines.at(np.linspace(0.0, LENGTH, 2401)).dense()
    at_centre = splines.at(splines.centres_mm[inside]).dense()[:, inside]
    np.testing.assert_allclose(np.diag(at_centre), dense.max(axis=0)[inside], atol=1e-9)
    np.testing.assert_allclose(np.diag(at_centre), 2.0 / 3.0, atol=1e-9)


def test_a_cubic_is_a_spline():
    splines = CurveSplines(24, LENGTH, False)
    c = fitted(splines, lambda s: (s / 100.0) ** 3 - s / 50.0)
    s = np.linspace(0.0, LENGTH, 97)
    np.testing.assert_allclose(splines.at(s).times(c), (s / 100.0) ** 3 - s / 50.0, atol=1e-9)


def test_a_straight_line_is_not_rough():
    splines = CurveSplines(24, LENGTH, False)
    D = splines.second_differences()
    assert D.shape == (25, 27)
    np.testing.assert_allclose(D @ fitted(splines, lambda s: 3.0 - 0.2 * s), 0.0, atol=1e-9)
    np.testing.assert_allclose(CurveSplines(24, LENGTH, True).second_differences() @ np.ones(24), 0.0, atol=1e-15)


@pytest.mark.parametrize("waves", [1, 2, 3])
def test_second_differences_integrate_the_squared_curvature(splines, waves):
    """The integral of (a sin(k s))''^2 over whole waves is a^2 k^4 length / 2; steps of h add (k h)^2 / 6."""
    k = 2.0 * np.pi * waves / LENGTH
    D = splines.second_differences()
    c = fitted(splines, lambda s: 1.5 * np.sin(k * s))
    second_order = 1.0 + (k * splines.step_mm) ** 2 / 6.0
    assert c @ D.T @ D @ c == pytest.approx(second_order * 1.5**2 * k**4 * LENGTH / 2.0, rel=0.015)


def test_second_differences_do_not_depend_on_the_number_of_knots():
    k = 2.0 * np.pi / LENGTH
    for intervals in (24, 48, 96):
        splines = CurveSplines(intervals, LENGTH, True)
        D, c = splines.second_differences(), fitted(splines, lambda s: np.cos(k * s))
        assert c @ D.T @ D @ c == pytest.approx(k**4 * LENGTH / 2.0, rel=0.015)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 60), closed=st.booleans())
def test_local_rows_reckon_as_their_dense_matrix_does(seed, count, closed):
    rng = np.random.default_rng(seed)
    splines = CurveSplines(int(rng.integers(8, 30)), LENGTH, closed)
    rows = splines.at(rng.uniform(0.0, LENGTH, count))
    A = rows.dense()
    c, C, w = rng.normal(size=rows.size), rng.normal(size=(rows.size, 3)), rng.uniform(0.0, 2.0, count)
    some = rng.random(count) < 0.5
    np.testing.assert_allclose(rows.times(c), A @ c, atol=1e-12)
    np.testing.assert_allclose(rows.times(C), A @ C, atol=1e-12)
    np.testing.assert_allclose(rows.summed(w), A.T @ w, atol=1e-12)
    np.testing.assert_allclose(rows.gram(w), A.T @ (w[:, None] * A), atol=1e-12)
    np.testing.assert_array_equal(rows.taken(some).dense(), A[some])


def test_rows_of_two_blocks_reckon_as_their_dense_matrix_does():
    """The first column of a row tells all others, over the seam of a periodic basis too."""
    splines, rng = CurveSplines(12, LENGTH, True), np.random.default_rng(2)
    near = splines.at(rng.uniform(0.0, LENGTH, 200))
    rows = LocalRows(
        np.concatenate([near.columns, near.columns + 12], axis=1),
        np.concatenate([near.values, rng.normal(size=(200, 1)) * near.values], axis=1),
        24,
    )
    w = rng.uniform(0.0, 1.0, 200)
    np.testing.assert_allclose(rows.gram(w), rows.dense().T @ (w[:, None] * rows.dense()), atol=1e-12)


def test_knots_are_as_far_apart_as_asked_within_their_bounds(synthetic):
    curve = framed(synthetic.contour(synthetic.circle(80.0), rings_mm=()))
    assert splines_along(curve, 10.0, 200).step_mm == pytest.approx(10.0, rel=0.02)
    assert splines_along(curve, 1.0, 96).intervals == 96
    assert splines_along(curve, 1e3, 96).intervals == LEAST_INTERVALS
    assert splines_along(curve, 10.0, 200).closed
