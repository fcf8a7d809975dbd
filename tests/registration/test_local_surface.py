import numpy as np
import pytest

from sicp_cam.contour.frames import framed
from sicp_cam.contour.splines import splines_along
from sicp_cam.registration.local_surface import SHAPE_DOUBT, band_depth_mm, fit_surface

SPACING = 2.0
REACH = 40.0
NOISE = 0.05


@pytest.fixture(scope="module")
def curve(synthetic):
    return framed(synthetic.contour(synthetic.circle(80.0), rings_mm=()))


@pytest.fixture(scope="module")
def splines(curve):
    return splines_along(curve, 8.0 * SPACING, 200)


def points_on(curve, surface, count=4000, noise=NOISE, seed=0):
    """Return arc length, depth and height of points at random on v = surface(s, g), somewhat deeper than the band."""
    rng = np.random.default_rng(seed)
    s, g = rng.uniform(0.0, curve.length_mm, count), rng.uniform(0.0, 24.0, count)
    return s, g, surface(s, g) + rng.normal(0.0, noise, count)


def fitted(points, splines, spacing=SPACING):
    return fit_surface(*points, splines, spacing, REACH)


def along(curve, count=400):
    return np.linspace(0.0, curve.length_mm, count, endpoint=False)


def test_a_quadratic_in_depth_is_recovered(curve, splines):
    fit = fitted(points_on(curve, lambda s, g: 1.5 - 0.04 * g + 0.003 * g * g, noise=0.0), splines)
    s = along(curve)
    for depth in (0.0, 3.0, 12.0):
        height, slope = fit.height_and_slope(s, np.full(len(s), depth))
        np.testing.assert_allclose(height, 1.5 - 0.04 * depth + 0.003 * depth**2, atol=1e-9)
        np.testing.assert_allclose(slope, -0.04 + 0.006 * depth, atol=1e-9)


def test_a_surface_that_bends_along_the_curve_is_not_flattened(curve, splines):
    k = 2.0 * np.pi / curve.length_mm
    fit = fitted(points_on(curve, lambda s, g: 4.0 * np.sin(3.0 * k * s) + 0.05 * g * np.cos(k * s)), splines)
    s = along(curve)
    height, slope = fit.height_and_slope(s, np.zeros(len(s)))
    assert np.sqrt(np.mean((height - 4.0 * np.sin(3.0 * k * s)) ** 2)) < 0.02
    assert np.sqrt(np.mean((slope - 0.05 * np.cos(k * s)) ** 2)) < 0.01


def test_the_data_choose_over_what_length_they_are_averaged(curve, splines):
    """What bends little is averaged over all of the contour, and is known better for it."""
    k = 2.0 * np.pi / curve.length_mm
    calm = fitted(points_on(curve, lambda s, g: np.cos(k * s)), splines)
    lively = fitted(points_on(curve, lambda s, g: np.cos(7.0 * k * s)), splines)
    assert calm.stiffness > 100.0 * lively.stiffness
    s, edge = along(curve), np.zeros(400)
    assert calm.uncertainty_mm(s, edge).mean() < 0.7 * lively.uncertainty_mm(s, edge).mean()


def test_noise_and_outliers_are_told_apart_from_the_surface(curve, splines):
    rng = np.random.default_rng(1)
    s, g, v = points_on(curve, lambda s, g: 0.02 * g, count=20_000)
    wild = rng.random(len(s)) < 0.02
    fit = fitted((s, g, v + np.where(wild, rng.choice([-5.0, 5.0], len(s)), 0.0)), splines)
    in_band = g < band_depth_mm(SPACING)
    assert fit.noise_mm == pytest.approx(NOISE, rel=0.03)
    assert not fit.on_surface[wild].any()
    assert fit.on_surface[~wild & in_band].mean() > 0.999
    assert not fit.on_surface[~in_band].any()
    assert np.abs(fit.height_and_slope(along(curve), np.zeros(400))[0]).max() < 0.005


def test_across_a_gap_the_surface_goes_on_smoothly(curve, splines):
    k = 2.0 * np.pi / curve.length_mm
    s, g, v = points_on(curve, lambda s, g: 2.0 * np.sin(k * s) + 0.01 * g)
    keep = (s < 200.0) | (s > 260.0)
    fit = fitted((s[keep], g[keep], v[keep]), splines)
    here = np.linspace(150.0, 310.0, 161)
    error = fit.height_and_slope(here, np.zeros(161))[0] - 2.0 * np.sin(k * here)
    gap = (here > 200.0) & (here < 260.0)
    assert np.abs(error[~gap]).max() < 0.02
    assert np.abs(error[gap]).max() < 0.03
    u = fit.uncertainty_mm(here, np.zeros(161))
    assert u[gap].max() > 2.0 * np.median(u[~gap])  # and says so


def test_points_far_out_of_the_surface_are_left_out(curve, splines):
    near = points_on(curve, lambda s, g: np.zeros(len(s)))
    other_skin = points_on(curve, lambda s, g: np.full(len(s), REACH + 5.0), seed=2)
    both = fitted(tuple(np.concatenate(pair) for pair in zip(near, other_skin, strict=True)), splines)
    alone = fitted(near, splines)
    np.testing.assert_allclose(both.coefficients, alone.coefficients, atol=1e-9)
    assert not both.on_surface[len(near[0]) :].any()


def test_the_stated_uncertainty_and_that_from_halves_are_those_of_the_height(curve, splines):
    """Half of the points knows the height with twice the variance, so that two halves differ by twice the error."""
    k = 2.0 * np.pi / curve.length_mm
    s, edge, error, stated, halves, noise = along(curve), np.zeros(400), [], [], [], []
    for seed in range(12):
        fit = fitted(points_on(curve, lambda s, g: np.cos(2.0 * k * s) + 0.01 * g, seed=seed), splines)
        error.append(fit.height_and_slope(s, edge)[0] - np.cos(2.0 * k * s))
        stated.append(fit.uncertainty_mm(s, edge))
        halves.append(fit.halves_mm)
        noise.append(fit.noise_mm)
    true, said, split = (np.sqrt(np.mean(np.square(values))) for values in (error, stated, halves))
    assert 0.65 < true / said < 1.25
    assert 1.5 < split / true < 2.6
    # This surface is a quadratic: nothing is in doubt but what the points leave open.
    posterior = np.sqrt(np.square(stated) - (SHAPE_DOUBT * np.array(noise)[:, None]) ** 2)
    assert 0.9 < np.mean(np.abs(error) <= 1.96 * posterior) < 0.99


def test_the_band_scales_with_the_spacing_but_is_deep_enough_for_a_slope(curve):
    assert band_depth_mm(3.0) == 30.0
    assert band_depth_mm(0.2) == 6.0
    s, g, v = points_on(curve, lambda s, g: np.where(g < 6.0, 0.0, 30.0), noise=0.0)
    fit = fitted((s, g, v), splines_along(curve, 4.0, 200), spacing=0.2)
    assert np.abs(fit.height_and_slope(along(curve), np.full(400, 3.0))[0]).max() < 1e-6


def test_no_points_at_all_are_no_bug(splines):
    fit = fitted((np.zeros(0), np.zeros(0), np.zeros(0)), splines)
    assert fit.on_surface.shape == (0,)
    assert np.isfinite(fit.height_and_slope(np.array([1.0, 2.0]), np.zeros(2))).all()
    assert fit.uncertainty_mm(np.array([1.0]), np.zeros(1))[0] > 100.0
