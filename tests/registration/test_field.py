"""The edge from points whose density and edge are known exactly: no scan, no frames to be found, only the estimator."""

from __future__ import annotations

import numpy as np
import pytest

from sicp_cam.contour.frames import framed, moved
from sicp_cam.contour.splines import splines_along
from sicp_cam.registration.field import CAP, LEAST_DECAY_NOISE, EdgePoints, fit_to_edge, moment
from sicp_cam.registration.in_surface import in_surface
from sicp_cam.registration.stations import even_stations
from sicp_cam.rigid_motion import exponential

SPACING = 2.0
NOISE = 0.05
DEPTH = 8.0
PER_MM2 = 1.0 / SPACING**2
SEEDS = range(6)
C20, S20 = np.cos(np.radians(20.0)), np.sin(np.radians(20.0))
TURN = np.array([[C20, S20], [-S20, C20]])


@pytest.fixture(scope="module")
def space(synthetic):
    curve = framed(synthetic.contour(synthetic.egg(65.0), rings_mm=()))
    return in_surface(splines_along(curve, 6.0 * SPACING, 96), curve, curve)


def wave(space, s, waves=2, amplitude=0.3):
    return 0.1 + amplitude * np.sin(2.0 * np.pi * waves * s / space.curve.length_mm)


def at_random(length, rng, per_mm2=PER_MM2):
    low, high = -2.0, DEPTH + 2.0
    count = rng.poisson(per_mm2 * length * (high - low))
    return np.stack([rng.uniform(0.0, length, count), rng.uniform(low, high, count)], axis=1)


def on_a_grid(length, rng):
    """Return a jittered grid that lies at 20 degrees to the edge, so that no row runs along it."""
    reach = np.arange(-length, length, SPACING)
    grid = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    grid = grid + rng.uniform(0.0, SPACING, 2) + rng.uniform(-0.4, 0.4, grid.shape) * SPACING
    places = grid @ TURN
    return places[(np.abs(places[:, 1] - 4.0) < 6.0) & (places[:, 0] > 0.0) & (places[:, 0] < length)]


def edge_points(space, sampling, seed, *, edge=wave, noise=NOISE, strays=0.0, hidden=(0.0, 0.0)):
    """Return the points behind an edge at depth edge(space, s), every point blurred by the noise.

    `strays` outside of the edge within 3 mm, as a share of the points; none and no density between `hidden` lengths.
    """
    rng, length = np.random.default_rng(seed), space.curve.length_mm
    if sampling == "voxels":
        fine = at_random(length, rng, 9.0 * PER_MM2)
        s, h = _thinned(fine[fine[:, 1] > edge(space, fine[:, 0])], rng).T
    else:
        s, h = {"random": at_random, "jittered": on_a_grid}[sampling](length, rng).T
        s, h = s[h > edge(space, s)], h[h > edge(space, s)]
    wild = rng.uniform(0.0, length, round(strays * len(s)))
    s = np.concatenate([s, wild])
    h = np.concatenate([h + rng.normal(0.0, noise, len(h)), edge(space, wild) - rng.uniform(0.0, 3.0, len(wild))])
    stations = even_stations(space.curve, SPACING)
    counted = (stations < hidden[0]) | (stations > hidden[1])
    keep = (h < DEPTH) & ((s < hidden[0]) | (s > hidden[1]))
    order = np.flatnonzero(keep)[np.argsort(s[keep])]
    per_mm = PER_MM2 * (stations[1] - stations[0]) * counted
    rim = edge(space, s[order]) + 0.5 * SPACING
    return EdgePoints(s[order], h[order], rim, stations, per_mm, SPACING, noise)


def _thinned(places, rng):
    """Replace the points in each cell of a grid at 20 degrees to the edge by their mean."""
    column, row = np.floor(places @ TURN / SPACING + rng.random(2)).astype(int).T
    _, cell, count = np.unique(column * 100_000 + row, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(cell, weights=axis) / count for axis in places.T], axis=1)


def errors(space, sampling, seeds=SEEDS, **options):
    """Return the fits, and the (seeds, stations) error of each along B; positive: too deep in the material."""
    fits = [fit_to_edge(space, edge_points(space, sampling, seed, **options)) for seed in seeds]
    s = even_stations(space.curve, SPACING)
    edge = options.get("edge", wave)(space, s)
    return fits, np.array([space.rows(s).times(fit.coefficients) - edge for fit in fits])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_the_moment_is_exponential_and_held_outside():
    x = np.array([-100.0, -0.15 * CAP, -0.1, 0.0, 0.1, 3.0])
    exact = np.exp([CAP, CAP, 0.1 / 0.15, 0.0, -0.1 / 0.15, -3.0 / 0.15])
    np.testing.assert_allclose(moment(x, 0.15), exact)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2])
def test_the_moments_of_points_at_random_sum_to_what_the_edge_says(space, noise):
    """The estimator rests on it: sum psi = tau per_mm2 length exp(sigma^2 / (2 tau^2)) at the true edge."""
    tau, total = 0.6, 0.0
    for seed in range(40):
        points = edge_points(space, "random", seed, noise=noise)
        total += moment(points.depth_mm - wave(space, points.s_mm), tau).sum()
    exact = tau * PER_MM2 * space.curve.length_mm * np.exp(0.5 * (noise / tau) ** 2)
    assert total / 40 == pytest.approx(exact, rel=0.04)


@pytest.mark.parametrize(("sampling", "limit"), [("random", 0.17), ("jittered", 0.15), ("voxels", 0.13)])
@pytest.mark.parametrize("amplitude", [0.3, 2.0])
def test_a_displaced_edge_is_found_however_it_was_sampled(space, sampling, limit, amplitude):
    _, error = errors(space, sampling, edge=lambda space, s: wave(space, s, amplitude=amplitude))
    assert rms(error) < limit
    assert abs(error.mean()) < 0.08


def test_the_density_at_the_rim_is_told_from_that_of_the_interior(space):
    ratio = {kind: np.mean([fit.rim_density for fit in errors(space, kind)[0]]) for kind in ("random", "voxels")}
    assert ratio["random"] == pytest.approx(1.0, abs=0.2)
    assert ratio["voxels"] > 1.3 * ratio["random"]


def test_noise_blurs_the_edge_and_does_not_move_it(space):
    fits, error = errors(space, "random", noise=0.3)
    assert {fit.decay_mm for fit in fits} == {LEAST_DECAY_NOISE * 0.3}
    assert abs(error.mean()) < 0.06
    assert rms(error) < 0.25


@pytest.mark.parametrize("share", [0.005, 0.01, 0.02])
def test_strays_outside_of_the_edge_are_taken_off(space, share):
    _, clean = errors(space, "jittered")
    _, error = errors(space, "jittered", strays=share)
    assert abs(error.mean() - clean.mean()) < 0.08
    assert rms(error) < 0.24


def test_the_data_choose_how_stiff_the_field_is_and_a_stiff_one_knows_the_edge_better(space):
    rows = space.rows(even_stations(space.curve, SPACING))
    calm, _ = errors(space, "jittered", edge=lambda space, s: np.full(len(s), 0.2))
    lively, error = errors(space, "jittered", edge=lambda space, s: wave(space, s, waves=4, amplitude=0.8))
    assert rms(error) < 0.2
    assert np.median([fit.stiffness for fit in calm]) > 30.0 * np.median([fit.stiffness for fit in lively])
    calm_mm, lively_mm = (np.mean([fit.uncertainty_mm(rows).mean() for fit in fits]) for fits in (calm, lively))
    assert calm_mm < 0.75 * lively_mm


def test_two_halves_of_the_points_differ_by_more_than_the_whole_errs(space):
    fits, error = errors(space, "random", seeds=range(12))
    rows = space.rows(even_stations(space.curve, SPACING))
    apart = rms([rows.times(fit.halves[0] - fit.halves[1]) for fit in fits])
    assert 1.0 < apart / rms(error) < 2.5


def test_across_a_gap_the_field_goes_on_and_knows_that_it_guesses(space):
    gap = (100.0, 150.0)
    fits, error = errors(space, "jittered", hidden=gap)
    s = even_stations(space.curve, SPACING)
    inside = (s > gap[0] + 10.0) & (s < gap[1] - 10.0)
    u = np.mean([fit.uncertainty_mm(space.rows(s)) for fit in fits], axis=0)
    assert rms(error[:, inside]) < 0.2
    assert rms(error[:, (s < gap[0] - 10.0) | (s > gap[1] + 10.0)]) < 0.15
    assert u[inside].mean() > 1.15 * np.median(u)


@pytest.mark.parametrize("slid_mm", [0.0, 1.5])
def test_a_circle_does_not_slide_along_itself(synthetic, slid_mm):
    """Its edge says nothing about that, nor does its bending: it stays where the pieces have left it."""
    rigid = framed(synthetic.contour(synthetic.circle(65.0), rings_mm=()))
    turn = exponential(np.array([0.0, 0.0, -slid_mm / 65.0, 0.0, 0.0, 0.0]), np.zeros(3))  # a hole runs clockwise
    space = in_surface(splines_along(rigid, 6.0 * SPACING, 96), moved(rigid, turn), rigid)
    K = len(space.splines)
    fit = fit_to_edge(space, edge_points(space, "jittered", 1, edge=lambda space, s: np.full(len(s), 0.2)))
    assert space.moved[K:].mean() == pytest.approx(slid_mm, abs=1e-3)
    assert fit.coefficients[K:].mean() == pytest.approx(slid_mm, abs=0.02)
    assert fit.coefficients[:K].mean() == pytest.approx(0.2, abs=0.15)


def test_no_points_leave_the_contour_where_it_is(space):
    stations = even_stations(space.curve, SPACING)
    nothing = EdgePoints(*(np.zeros(0),) * 3, stations, np.zeros(len(stations)), SPACING, NOISE)
    fit = fit_to_edge(space, nothing)
    assert np.abs(fit.coefficients).max() < 1e-6
    assert fit.uncertainty_mm(space.rows(stations)).min() > 1.0
