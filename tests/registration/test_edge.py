import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve, framed
from sicp_cam.contour.projection import coordinates
from sicp_cam.registration.axes import tilted
from sicp_cam.registration.edge import gaps, measure, on_curve
from sicp_cam.registration.rigid import facing_rim
from sicp_cam.registration.scan_surface import prepared

SPACING = 2.0
REACH = 25.0
SAMPLINGS = ["random", "jittered", "mesh"]


def surface_of(synthetic, outlines, sheet=None, *, sampling="jittered", seed=0, gaps_mm=(), **scanned):
    uv = synthetic.material(
        outlines, sampling="jittered" if sampling == "mesh" else sampling, spacing_mm=SPACING, depth_mm=30.0, seed=seed
    )
    uv = synthetic.without_gaps(uv, outlines[0], gaps_mm)
    faces = synthetic.triangles(uv, SPACING, outlines) if sampling == "mesh" else None
    return prepared(synthetic.scan(uv, sheet or synthetic.plane, faces=faces, seed=seed, **scanned))


def shifted(curve, depth_mm=0.0, height_mm=0.0):
    points = curve.points_mm + depth_mm * curve.inward + height_mm * curve.outward
    return FramedCurve(curve.s_mm, points, curve.tangents, curve.inward, curve.outward, curve.length_mm, curve.closed)


@pytest.fixture(scope="module")
def hole(synthetic):
    return synthetic.oval(100.0, 75.0)


@pytest.fixture(scope="module")
def sheet(synthetic):
    return synthetic.dome(1500.0, 2500.0)


@pytest.fixture(scope="module")
def curve(synthetic, hole, sheet):
    return framed(synthetic.contour(hole, sheet, rings_mm=()))


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_the_edge_is_found_without_the_bias_of_the_rim(synthetic, hole, sheet, curve, sampling):
    biases, rim_biases = [], []
    for seed in range(3):
        surface = surface_of(synthetic, [hole], sheet, sampling=sampling, seed=seed, outliers=0.005)
        found = measure(curve, surface, reach_mm=REACH)
        chosen, _ = facing_rim(surface.rim, curve, REACH)
        assert found.covered.mean() > 0.95
        biases.append(found.depth_mm[found.covered].mean())
        rim_biases.append(np.median(coordinates(surface.rim.points_mm[chosen], curve).inward_mm))
    assert np.abs(np.mean(biases)) < 0.06 * SPACING
    assert np.abs(biases).max() < 0.15 * SPACING
    assert np.mean(rim_biases) > 0.22 * SPACING
    assert np.mean(rim_biases) > 4.0 * np.abs(np.mean(biases))


def test_thinning_by_voxels_does_not_shift_the_edge(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, sampling="voxels"), reach_mm=REACH)
    assert abs(found.depth_mm[found.covered].mean()) < 0.1 * SPACING


@pytest.mark.parametrize(("sampling", "limit"), [("random", 0.25), ("jittered", 0.15), ("mesh", 0.15)])
def test_the_edge_of_single_stations_scatters_by_a_fraction_of_the_spacing(
    synthetic, hole, sheet, curve, sampling, limit
):
    found = measure(curve, surface_of(synthetic, [hole], sheet, sampling=sampling, seed=9), reach_mm=REACH)
    assert found.depth_mm[found.covered].std() < limit * SPACING


@pytest.mark.parametrize("shape", ["outer circle", "small hole", "outer rectangle", "open edge"])
def test_the_bias_is_small_for_every_curvature(synthetic, shape):
    outline = {
        "outer circle": synthetic.circle(60.0, hole=False),
        "small hole": synthetic.circle(20.0),
        "outer rectangle": synthetic.rounded_rectangle(200.0, 140.0, 15.0),
        "open edge": synthetic.wavy_edge(300.0),
    }[shape]
    curve = framed(synthetic.contour(outline, rings_mm=()))
    found = [
        measure(curve, surface_of(synthetic, [outline], sampling="random", seed=seed), reach_mm=REACH)
        for seed in range(4)
    ]
    bias = np.mean([one.depth_mm[one.covered].mean() for one in found])
    assert abs(bias) < 0.08 * SPACING
    assert np.mean([one.covered.mean() for one in found]) > 0.9


@pytest.mark.parametrize(("depth", "height"), [(3.0, -2.0), (-4.0, 1.0), (0.0, 6.0)])
def test_a_curve_beside_the_edge_sees_it_where_it_is(synthetic, hole, sheet, curve, depth, height):
    surface = surface_of(synthetic, [hole], sheet, seed=2)
    found = measure(shifted(curve, -depth, -height), surface, reach_mm=REACH)
    exact = measure(curve, surface, reach_mm=REACH)
    both = found.covered & exact.covered
    assert both.mean() > 0.9
    assert found.depth_mm[both].mean() == pytest.approx(depth + exact.depth_mm[both].mean(), abs=0.15)
    assert found.height_mm[both].mean() == pytest.approx(height, abs=0.05)


def test_height_slope_and_noise_are_those_of_the_surface(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, seed=3), reach_mm=REACH)
    assert np.abs(found.height_mm[found.covered]).mean() < 0.015
    assert np.abs(found.slope[found.covered]).mean() < 0.005
    assert found.noise_mm == pytest.approx(0.05, rel=0.15)


def test_the_frame_is_tilted_by_the_slope_of_the_surface(synthetic, hole):
    curve = framed(synthetic.contour(hole, rings_mm=()))
    incline = np.radians(4.0)
    tilted_sheet = synthetic.bent(synthetic.plane, lambda u, w: np.tan(incline) * u)
    surface = surface_of(synthetic, [hole], tilted_sheet, seed=4)
    found = tilted(curve, measure(curve, surface, reach_mm=40.0))
    true = np.array([-np.sin(incline), 0.0, np.cos(incline)])
    across = np.abs(curve.inward[:, 0]) > 0.99  # only there does the slope lie wholly across the contour
    lean = np.degrees(np.arccos(np.clip(found.outward[across] @ true, -1.0, 1.0)))
    assert lean.mean() < 0.5
    np.testing.assert_allclose(np.sum(found.outward * curve.tangents, axis=1), 0.0, atol=1e-12)


def test_a_gap_is_found_where_it_is_and_nowhere_else(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, gaps_mm=[(200.0, 240.0)], seed=5), reach_mm=REACH)
    in_gap = (found.s_mm > 204.0) & (found.s_mm < 236.0)
    well_away = (found.s_mm < 188.0) | (found.s_mm > 252.0)
    assert not found.covered[in_gap].any()
    assert found.covered[well_away].all()
    ((start, end),) = gaps(found, curve)
    assert start == pytest.approx(200.0, abs=10.0)
    assert end == pytest.approx(240.0, abs=10.0)
    beside = found.covered & (np.abs(found.s_mm - 220.0) < 40.0)
    assert np.abs(found.depth_mm[beside]).max() < 1.0


def test_values_are_carried_over_gaps_only_where_asked(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, gaps_mm=[(200.0, 240.0)], seed=5), reach_mm=REACH)
    values = np.where(found.covered, found.s_mm, np.nan)
    there = (curve.s_mm > 215.0) & (curve.s_mm < 225.0)
    assert np.isnan(on_curve(values, found, curve)[there]).all()
    np.testing.assert_allclose(on_curve(values, found, curve, bridge=True)[there], curve.s_mm[there], atol=1e-6)
    assert (on_curve(np.full(len(found.s_mm), np.nan), found, curve, bridge=True) == 0.0).all()


def test_a_neighbouring_edge_that_opens_to_the_other_side_is_not_taken(synthetic):
    outlines = [synthetic.circle(60.0), synthetic.circle(78.0, hole=False)]
    surface = surface_of(synthetic, outlines, seed=6)
    curve = framed(synthetic.contour(outlines[0], rings_mm=()))
    chosen, _ = facing_rim(surface.rim, curve, REACH)
    assert np.linalg.norm(surface.rim.points_mm[chosen], axis=1).max() < 66.0


def test_a_scan_without_an_edge_near_the_curve_covers_nothing(synthetic):
    solid = surface_of(synthetic, [synthetic.rounded_rectangle(300.0, 300.0, 20.0)])
    far_from_its_edge = framed(synthetic.contour(synthetic.circle(30.0, centre=(0.0, 500.0)), rings_mm=()))
    assert not measure(far_from_its_edge, solid, reach_mm=REACH).covered.any()


def flange(synthetic, width):
    outlines = [synthetic.circle(100.0, hole=False), synthetic.circle(100.0 - width)]
    curve = framed(synthetic.contour(outlines[0], rings_mm=()))
    return measure(curve, surface_of(synthetic, outlines, seed=7), reach_mm=REACH)


def test_the_edge_of_a_flange_of_ten_spacings_has_no_bias(synthetic):
    found = flange(synthetic, 20.0)
    assert abs(found.depth_mm[found.covered].mean()) < 0.08 * SPACING


def test_the_edge_of_a_narrow_flange_is_right_or_not_called_covered(synthetic):
    found = flange(synthetic, 10.0)
    assert np.abs(found.depth_mm[found.covered]).mean() < 0.4
