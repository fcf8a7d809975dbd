import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve, at, framed
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
    assert np.abs(np.mean(biases)) < 0.03 * SPACING
    assert np.abs(biases).max() < 0.05 * SPACING
    assert np.mean(rim_biases) > 0.28 * SPACING
    assert np.mean(rim_biases) > 20.0 * np.abs(np.mean(biases))


def test_thinning_by_voxels_does_not_shift_the_edge(synthetic, hole, sheet, curve):
    found = [
        measure(curve, surface_of(synthetic, [hole], sheet, sampling="voxels", seed=seed), reach_mm=REACH)
        for seed in range(2)
    ]
    assert abs(np.mean([one.depth_mm[one.covered].mean() for one in found])) < 0.03 * SPACING


@pytest.mark.parametrize(("sampling", "limit"), [("random", 0.1), ("jittered", 0.05), ("mesh", 0.05)])
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
    assert abs(bias) < 0.04 * SPACING
    assert np.mean([one.covered.mean() for one in found]) > 0.96


@pytest.mark.parametrize(("depth", "height"), [(3.0, -2.0), (-4.0, 1.0), (0.0, 6.0)])
def test_a_curve_beside_the_edge_sees_it_where_it_is(synthetic, hole, sheet, curve, depth, height):
    surface = surface_of(synthetic, [hole], sheet, seed=2)
    found = measure(shifted(curve, -depth, -height), surface, reach_mm=REACH)
    exact = measure(curve, surface, reach_mm=REACH)
    both = found.covered & exact.covered & np.isfinite(found.depth_mm + exact.depth_mm)
    assert both.mean() > 0.99
    assert found.depth_mm[both].mean() == pytest.approx(depth + exact.depth_mm[both].mean(), abs=0.07)
    assert found.height_mm[both].mean() == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize("moved_mm", [0.0, 3.0])
def test_shift_and_lift_carry_the_curve_to_the_edge_and_lie_in_and_out_of_the_surface(
    synthetic, hole, sheet, curve, moved_mm
):
    here = shifted(curve, -moved_mm, 0.5 * moved_mm)
    found = measure(here, surface_of(synthetic, [hole], sheet, seed=2), reach_mm=REACH, rigid=curve)
    foot = at(here, found.s_mm)
    carried = foot.points_mm + found.shift_mm + found.lift_mm[:, None] * foot.outward
    there = at(curve, found.s_mm)
    for axis, limit in ((there.inward, 0.06), (there.outward, 0.01)):
        assert np.sqrt(np.mean(np.sum((carried - there.points_mm) * axis, axis=1) ** 2)) < limit
    np.testing.assert_allclose(np.sum(found.shift_mm * foot.outward, axis=1), 0.0, atol=1e-9)


def test_two_halves_of_the_scan_and_the_stated_uncertainty_are_told(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, seed=3), reach_mm=REACH)
    for u, apart in ((found.normal_u_mm, found.leave_out.normal_mm), (found.out_u_mm, found.leave_out.out_mm)):
        assert u.shape == found.s_mm.shape
        assert 0.5 < apart / np.sqrt(np.mean(u**2)) < 4.0  # about 2, were both halves no more than independent


def test_height_slope_and_noise_are_those_of_the_surface(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, seed=3), reach_mm=REACH)
    assert np.abs(found.height_mm[found.covered]).mean() < 0.01
    assert np.abs(found.slope[found.covered]).mean() < 0.0015
    assert found.noise_mm == pytest.approx(0.05, rel=0.05)


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
    assert start == pytest.approx(200.0, abs=4.0)
    assert end == pytest.approx(240.0, abs=4.0)
    beside = found.covered & (np.abs(found.s_mm - 220.0) < 40.0)
    assert np.nanmax(np.abs(found.depth_mm[beside])) < 0.35


def test_over_a_gap_the_smooth_displacement_goes_on_and_what_the_scan_shows_does_not(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, gaps_mm=[(200.0, 240.0)], seed=5), reach_mm=REACH)
    gap = (found.s_mm > 206.0) & (found.s_mm < 234.0)
    assert np.isnan(found.depth_mm[gap]).all()
    assert np.isnan(found.height_mm[gap]).all()
    assert np.linalg.norm(found.shift_mm[gap], axis=1).max() < 0.2
    assert np.abs(found.lift_mm[gap]).max() < 0.01
    assert np.abs(found.slope[gap]).max() < 0.003
    for u in (found.normal_u_mm, found.out_u_mm):
        assert u[gap].max() > 1.1 * np.median(u)


def test_values_of_stations_are_found_on_the_curve_and_nothing_is_made_up_in_a_gap(synthetic, hole, sheet, curve):
    found = measure(curve, surface_of(synthetic, [hole], sheet, gaps_mm=[(200.0, 240.0)], seed=5), reach_mm=REACH)
    hidden = np.isnan(on_curve(np.where(found.covered, 1.0, np.nan), found, curve))
    assert hidden[(curve.s_mm > 206.0) & (curve.s_mm < 234.0)].all()
    assert not hidden[(curve.s_mm < 190.0) | (curve.s_mm > 250.0)].any()
    away = (curve.s_mm > 10.0) & (curve.s_mm < curve.length_mm - 10.0)
    np.testing.assert_allclose(on_curve(found.s_mm, found, curve)[away], curve.s_mm[away], atol=1e-9)


@pytest.mark.parametrize("at_mm", [-15.0, 0.0])
def test_a_gap_over_the_seam_is_stated_in_two_parts(synthetic, hole, sheet, curve, at_mm):
    found = measure(
        curve, surface_of(synthetic, [hole], sheet, gaps_mm=[(at_mm, at_mm + 30.0)], seed=5), reach_mm=REACH
    )
    runs = gaps(found, curve)
    total = np.diff(runs, axis=1).sum()
    assert total == pytest.approx(30.0, abs=6.0)
    assert (runs >= 0.0).all()
    assert (runs <= curve.length_mm).all()


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
    assert abs(found.depth_mm[found.covered].mean()) < 0.03 * SPACING


def test_the_edge_of_a_narrow_flange_is_right_or_not_called_covered(synthetic):
    found = flange(synthetic, 10.0)
    assert np.abs(found.depth_mm[found.covered]).mean() < 0.15
    assert found.covered.mean() > 0.5
