import numpy as np
import pytest

from sicp_cam.contour.frames import framed
from sicp_cam.contour.projection import CurveCoordinates
from sicp_cam.registration.local_surface import DEPTH_SPACINGS, fit_surface
from sicp_cam.registration.stations import even_stations, interpolated, windows

SPACING = 2.0
REACH = 40.0


@pytest.fixture(scope="module")
def curve(synthetic):
    return framed(synthetic.contour(synthetic.circle(80.0), rings_mm=()))


def points_on(curve, surface, count=20_000, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    s, h = rng.uniform(0.0, curve.length_mm, count), rng.uniform(0.0, 24.0, count)
    return CurveCoordinates(
        s, np.zeros(count), h, surface(s, h) + rng.normal(0.0, noise, count) if noise else surface(s, h)
    )


def test_a_polynomial_surface_is_recovered_but_for_the_ridge(curve):
    seen = points_on(curve, lambda s, h: 1.5 - 0.04 * h + 0.003 * h * h)
    stations = even_stations(curve, SPACING)
    fit = fit_surface(seen, stations, curve, SPACING, REACH)
    np.testing.assert_allclose(fit.coefficients, np.tile([1.5, -0.04, 0.003], (len(stations), 1)), rtol=1e-2)
    depth = np.linspace(0.0, 10.0, len(stations))
    np.testing.assert_allclose(fit.height_mm(depth), 1.5 - 0.04 * depth + 0.003 * depth**2, atol=2e-3)
    np.testing.assert_allclose(fit.slope(depth), -0.04 + 0.006 * depth, atol=5e-4)


def test_a_surface_that_bends_along_the_curve_is_not_flattened(curve):
    wave = 2.0 * np.pi / curve.length_mm
    seen = points_on(curve, lambda s, h: 4.0 * np.sin(3.0 * wave * s) + 0.05 * h * np.cos(wave * s))
    stations = even_stations(curve, SPACING)
    height = fit_surface(seen, stations, curve, SPACING, REACH).height_mm(np.zeros(len(stations)))
    np.testing.assert_allclose(height, 4.0 * np.sin(3.0 * wave * stations), atol=0.01)


def test_noise_and_outliers_are_told_apart_from_the_surface(curve):
    rng = np.random.default_rng(1)
    seen = points_on(curve, lambda s, h: 0.02 * h, noise=0.05)
    wild = rng.random(len(seen.s_mm)) < 0.02
    lifted = np.where(wild, seen.outward_mm + rng.choice([-1.0, 1.0], len(wild)) * 5.0, seen.outward_mm)
    stations = even_stations(curve, SPACING)
    with_outliers = CurveCoordinates(seen.s_mm, seen.along_mm, seen.inward_mm, lifted)
    fit = fit_surface(with_outliers, stations, curve, SPACING, REACH)
    assert fit.noise_mm == pytest.approx(0.05, rel=0.1)
    assert not fit.on_surface[wild].any()
    in_band = seen.inward_mm < DEPTH_SPACINGS * SPACING
    assert fit.on_surface[~wild & in_band].mean() > 0.99
    assert not fit.on_surface[~in_band].any()
    assert np.abs(fit.height_mm(np.zeros(len(stations)))).max() < 0.05


def test_beside_a_gap_the_surface_is_not_bent_by_what_is_missing(curve):
    def surface(s, h):
        return 0.02 * (s - 200.0) + 0.01 * h

    seen = points_on(curve, surface)
    keep = (seen.s_mm < 200.0) | (seen.s_mm > 260.0)
    part = CurveCoordinates(*(values[keep] for values in (seen.s_mm, seen.along_mm, seen.inward_mm, seen.outward_mm)))
    stations = even_stations(curve, SPACING)
    fit = fit_surface(part, stations, curve, SPACING, REACH)
    height = fit.height_mm(np.zeros(len(stations)))
    beside = (stations > 150.0) & (stations < 203.0)
    np.testing.assert_allclose(height[beside], 0.02 * (stations[beside] - 200.0), atol=5e-3)
    assert np.isnan(height[(stations > 220.0) & (stations < 240.0)]).all()


def test_points_far_out_of_the_surface_are_left_out(curve):
    near = points_on(curve, lambda s, h: np.zeros(len(s)))
    other_skin = points_on(curve, lambda s, h: np.full(len(s), 45.0), seed=2)
    both = CurveCoordinates(
        *(np.concatenate([getattr(part, name) for part in (near, other_skin)]) for name in CurveCoordinates.__slots__)
    )
    stations = even_stations(curve, SPACING)
    fit = fit_surface(both, stations, curve, SPACING, REACH)
    assert np.abs(fit.height_mm(np.zeros(len(stations)))).max() < 1e-6


def test_stations_are_even_and_an_open_curve_has_one_at_each_end(synthetic, curve):
    closed = even_stations(curve, SPACING)
    assert closed[-1] + closed[1] == pytest.approx(curve.length_mm)
    edge = framed(synthetic.contour(synthetic.wavy_edge(300.0), rings_mm=()))
    opened = even_stations(edge, SPACING)
    assert (opened[0], opened[-1]) == (0.0, edge.length_mm)
    assert np.ptp(np.diff(opened)) < 1e-9


def test_windows_are_gaussians_that_pass_the_seam(curve):
    stations = even_stations(curve, SPACING)
    s = np.array([1.0, 250.0, curve.length_mm - 1.0])
    G, first, second = (g.toarray() for g in windows(s, stations, curve, 10.0, powers=3))
    apart = s - stations[:, None]
    apart -= curve.length_mm * np.round(apart / curve.length_mm)
    d = apart / 10.0
    expected = np.where(np.abs(d) <= 3.0, np.exp(-0.5 * d * d), 0.0)
    np.testing.assert_allclose(G, expected, atol=1e-12)
    np.testing.assert_allclose(first, expected * d, atol=1e-12)
    np.testing.assert_allclose(second, expected * d * d, atol=1e-12)


def test_values_of_stations_are_interpolated_linearly_and_around_the_seam(synthetic, curve):
    stations = even_stations(curve, SPACING)
    values = np.cos(2.0 * np.pi * stations / curve.length_mm)
    s = np.array([0.0, 123.4, curve.length_mm - 0.3])
    np.testing.assert_allclose(
        interpolated(values, stations, s, curve), np.cos(2.0 * np.pi * s / curve.length_mm), atol=1e-3
    )
    pairs = interpolated(np.stack([values, -values], axis=1), stations, s, curve)
    np.testing.assert_allclose(pairs[:, 0], -pairs[:, 1])
