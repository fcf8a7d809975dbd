import numpy as np
import pytest

from sicp_cam.contour.frames import framed
from sicp_cam.registration.stations import even_stations, interpolated, nearest_station, smoothed, sums

SPACING = 2.0


@pytest.fixture(scope="module")
def curve(synthetic):
    return framed(synthetic.contour(synthetic.circle(80.0), rings_mm=()))


@pytest.fixture(scope="module")
def edge(synthetic):
    return framed(synthetic.contour(synthetic.wavy_edge(300.0), rings_mm=()))


def test_stations_are_even_and_an_open_curve_has_one_at_each_end(curve, edge):
    closed, opened = even_stations(curve, SPACING), even_stations(edge, SPACING)
    assert closed[-1] + closed[1] == pytest.approx(curve.length_mm)
    assert (opened[0], opened[-1]) == (0.0, edge.length_mm)
    assert np.ptp(np.diff(opened)) < 1e-9
    assert len(even_stations(curve, 1e3)) == 16


def test_the_nearest_station_of_a_closed_curve_is_found_over_its_seam(curve, edge):
    for line in (curve, edge):
        stations = even_stations(line, SPACING)
        s = np.random.default_rng(0).uniform(0.0, line.length_mm, 500)
        apart = np.abs(s[:, None] - stations)
        apart = np.minimum(apart, line.length_mm - apart) if line.closed else apart
        np.testing.assert_array_equal(nearest_station(s, stations, line), np.argmin(apart, axis=1))


def test_sums_hold_every_point_once(curve):
    stations, rng = even_stations(curve, SPACING), np.random.default_rng(1)
    s, values = rng.uniform(0.0, curve.length_mm, 3000), rng.normal(size=3000)
    assert sums(s, stations, curve).sum() == 3000
    at_five = values[nearest_station(s, stations, curve) == 5].sum()
    assert sums(s, stations, curve, values)[5] == pytest.approx(at_five)


def test_the_window_is_a_gaussian_that_passes_the_seam(curve):
    stations = even_stations(curve, SPACING)
    impulse = np.zeros(len(stations))
    impulse[1] = 1.0
    found = smoothed(impulse, stations, curve, 10.0)
    apart = stations - stations[1]
    apart -= curve.length_mm * np.round(apart / curve.length_mm)
    gaussian = np.where(np.abs(apart) <= 30.0, np.exp(-0.5 * (apart / 10.0) ** 2), 0.0)
    np.testing.assert_allclose(found, gaussian / gaussian.sum(), atol=0.02 * found.max())
    assert found.sum() == pytest.approx(1.0)


def test_nothing_lies_beyond_the_ends_of_an_open_curve(edge):
    stations = even_stations(edge, SPACING)
    found = smoothed(np.ones(len(stations)), stations, edge, 10.0)
    assert found[[0, -1]] == pytest.approx(0.5, abs=0.05)
    assert found[len(found) // 2] == pytest.approx(1.0)


def test_values_of_stations_are_interpolated_linearly_and_around_the_seam(curve):
    stations = even_stations(curve, SPACING)
    values = np.cos(2.0 * np.pi * stations / curve.length_mm)
    s = np.array([0.0, 123.4, curve.length_mm - 0.3])
    exact = np.cos(2.0 * np.pi * s / curve.length_mm)
    np.testing.assert_allclose(interpolated(values, stations, s, curve), exact, atol=1e-3)
    pairs = interpolated(np.stack([values, -values], axis=1), stations, s, curve)
    np.testing.assert_allclose(pairs, np.stack([exact, -exact], axis=1), atol=1e-3)


def test_values_beyond_the_ends_of_an_open_curve_are_those_of_its_ends(edge):
    stations = even_stations(edge, SPACING)
    np.testing.assert_allclose(
        interpolated(stations, stations, np.array([-5.0, 100.0, edge.length_mm + 5.0]), edge),
        [0.0, 100.0, edge.length_mm],
    )
