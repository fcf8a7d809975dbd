from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.contour.frames import framed, moved
from sicp_cam.registration.edge import measure
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.scan_surface import prepared
from sicp_cam.registration.settings import RegistrationSettings


def mean(values, rows):
    return float(np.abs(values[rows]).mean())


def test_the_edge_of_a_sagging_part_is_followed_out_of_the_surface(registered):
    found, error = registered("sicp")
    covered = found.contours[0].covered
    assert mean(error.out, covered) <= 0.015
    assert np.percentile(np.abs(error.out[covered]), 95) <= 0.035
    assert mean(error.axis_deg, covered) < 0.2


def test_the_edge_of_a_sagging_part_is_followed_in_the_surface_without_bias(registered):
    found, error = registered("sicp")
    covered = found.contours[0].covered
    assert mean(error.normal, covered) < 0.1
    assert abs(error.normal[covered].mean()) < 0.07


def test_sicp_is_twenty_times_as_good_as_rigid_and_eight_times_as_the_paper(registered):
    found, sicp = registered("sicp")
    _, rigid = registered("rigid")
    _, paper = registered("paper")
    covered = found.contours[0].covered
    assert mean(rigid.out, covered) > 1.0  # the part is bent by far more than the tolerance
    assert mean(sicp.both, covered) < mean(rigid.both, covered) / 20.0
    assert mean(sicp.both, covered) < mean(paper.both, covered) / 8.0


def test_the_papers_method_lies_inside_the_material_by_the_bias_of_the_rim(registered):
    _, paper = registered("paper")
    assert 0.5 < paper.normal.mean() < 1.4
    assert mean(paper.out, slice(None)) < 0.3


def test_a_gap_is_bridged_and_told(sagging, registered):
    found, error = registered("sicp")
    (contour,) = found.contours
    gap = (contour.nominal.s_mm > 105.0) & (contour.nominal.s_mm < 125.0)
    far = (contour.nominal.s_mm < 85.0) | (contour.nominal.s_mm > 145.0)
    assert not contour.covered[gap].any()
    assert contour.covered[far].all()
    assert error.both[gap].max() < 0.25
    assert any("carried over from both sides" in finding.message for finding in found.findings)


def in_two_pieces(synthetic, sagging, *, field):
    """Return the errors of the covered stations, registered in two pieces with or without the field."""
    two = replace(sagging.settings, segments=2, field=field)
    (contour,) = register_contours({1: sagging.contour}, sagging.scan, sagging.start, settings=two).contours
    error = synthetic.errors(contour.corrected, sagging.outline, sagging.bent, sagging.pose)
    return mean(error.out, contour.covered), mean(error.normal, contour.covered)


def test_too_few_pieces_cannot_follow_the_part_and_the_field_makes_up_for_it(synthetic, sagging, registered):
    found, exact = registered("sicp")
    covered = found.contours[0].covered
    out, _ = in_two_pieces(synthetic, sagging, field=False)
    assert out > 5.0 * mean(exact.out, covered)
    out, normal = in_two_pieces(synthetic, sagging, field=True)
    assert out < 2.0 * mean(exact.out, covered)
    assert normal < 0.12


def test_enough_pieces_follow_the_part_without_the_field_too(synthetic, sagging):
    alone = replace(sagging.settings, field=False)
    (contour,) = register_contours({1: sagging.contour}, sagging.scan, sagging.start, settings=alone).contours
    error = synthetic.errors(contour.corrected, sagging.outline, sagging.bent, sagging.pose)
    assert mean(error.out, contour.covered) < 0.04
    assert mean(error.normal, contour.covered) < 0.15
    assert contour.normal_u_mm is None  # stated for the field only


def test_the_number_of_pieces_is_the_operators_if_he_states_it(registered, sagging):
    assert len(registered("sicp")[0].contours[0].segments) > 8
    twelve = RegistrationSettings(reach_mm=sagging.settings.reach_mm, segments=12)
    stated = register_contours({1: sagging.contour}, sagging.scan, sagging.start, settings=twelve)
    assert len(stated.contours[0].segments) == 12
    assert len(stated.contours[0].split_s_mm) == 12


def test_an_undeformed_part_is_left_in_its_rigid_pose(synthetic, sagging):
    scan = synthetic.scan(sagging.whole, sagging.nominal, pose=sagging.pose)
    found = register_contours({1: sagging.contour}, scan, sagging.start, settings=sagging.settings)
    (contour,) = found.contours
    error = synthetic.errors(contour.corrected, sagging.outline, sagging.nominal, sagging.pose)
    assert contour.covered.mean() > 0.98
    assert np.abs(error.out).mean() < 0.006
    assert np.abs(error.normal).mean() < 0.06
    assert error.axis_deg.mean() < 0.1


@pytest.mark.parametrize("method", ["sicp", "paper", "projection"])
def test_the_corrected_curve_has_no_jump(registered, method):
    (contour,) = registered(method)[0].contours
    move = contour.corrected.points_mm - contour.rigid.points_mm
    steps = np.linalg.norm(np.diff(np.vstack([move, move[:1]]), axis=0), axis=1)
    assert steps.max() < 0.2  # stations stand 1 mm apart
    turn = np.sum(contour.corrected.outward * np.roll(contour.corrected.outward, 1, axis=0), axis=1)
    assert np.degrees(np.arccos(np.clip(turn, -1.0, 1.0))).max() < 0.6


@pytest.mark.parametrize("method", ["sicp", "paper", "rigid", "projection"])
def test_frames_of_the_result_are_orthonormal_and_curves_share_their_stations(registered, sagging, method):
    (contour,) = registered(method)[0].contours
    for curve in (contour.nominal, contour.rigid, contour.corrected):
        axes = np.stack([curve.tangents, curve.inward, curve.outward], axis=1)
        np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=1e-9)
        assert np.array_equal(curve.s_mm, contour.nominal.s_mm)
    assert contour.covered.shape == contour.before.normal_mm.shape == contour.after.out_mm.shape
    assert contour.stability_part_mm.shape == contour.stability_scan_mm.shape == sagging.contour.ring_points_mm.shape


def test_stability_points_are_carried_onto_the_scanned_surface(synthetic, sagging, registered):
    (contour,) = registered("sicp")[0].contours
    surface = synthetic.scan(sagging.whole, sagging.bent, pose=sagging.pose, noise_mm=0.0).points_mm
    offset = contour.stability_scan_mm[:, None] - surface
    assert np.median(np.linalg.norm(offset, axis=2).min(axis=1)) < 2.0


def test_residuals_after_are_small_and_before_are_the_sag(registered, sagging):
    found, _ = registered("sicp")
    (contour,) = found.contours
    assert np.nanmean(np.abs(contour.before.out_mm)) > 1.0
    assert np.nanmean(np.abs(contour.after.out_mm)) < 0.02
    assert np.isfinite(contour.after.out_mm[np.isfinite(contour.after.normal_mm)]).all()
    assert np.isfinite(contour.after.normal_mm).mean() > 0.8
    exact = moved(framed(sagging.contour), sagging.pose)
    seen = measure(exact, prepared(sagging.scan), reach_mm=sagging.settings.reach_mm)
    assert found.noise_mm == pytest.approx(0.05, rel=0.2)
    assert seen.covered.mean() > 0.8


def test_an_open_edge_is_followed_to_its_ends(synthetic):
    edge, nominal = synthetic.wavy_edge(300.0), synthetic.dome(1500.0, 2500.0)
    bent = synthetic.bent(nominal, lambda u, w: 4e-4 * u * u)
    pose = synthetic.random_pose(12)
    uv = synthetic.material([edge], depth_mm=40.0, seed=12)
    scan = synthetic.scan(uv, bent, pose=pose, outliers=0.003)
    found = register_contours(
        {1: synthetic.contour(edge, nominal)},
        scan,
        synthetic.disturbed(pose, 12, shift_mm=3.0),
        settings=RegistrationSettings(reach_mm=25.0),
    )
    (contour,) = found.contours
    error = synthetic.errors(contour.corrected, edge, bent, pose)
    inner = (contour.nominal.s_mm > 15.0) & (contour.nominal.s_mm < edge.length_mm - 15.0)
    assert not contour.corrected.closed
    assert np.abs(error.out[inner]).mean() < 0.02
    assert np.abs(error.normal[inner]).mean() < 0.1
    assert error.both.max() < 0.3
    assert contour.covered[inner].mean() > 0.95


@pytest.mark.parametrize("offset_mm", [0.4, -0.3])
def test_the_edge_offset_moves_the_contour_out_of_the_material(synthetic, sagging, registered, offset_mm):
    """A scanner that rounds the edge off shows too little material: the edge lies that much further outside."""
    settings = replace(sagging.settings, edge_offset_mm=offset_mm)
    found = register_contours({1: sagging.contour}, sagging.scan, sagging.start, settings=settings)
    error = synthetic.errors(found.contours[0].corrected, sagging.outline, sagging.bent, sagging.pose)
    without = registered("sicp")[1]
    assert np.mean(error.normal - without.normal) == pytest.approx(-offset_mm, abs=0.02)
    assert np.abs(error.out).mean() < np.abs(without.out).mean() + 0.005
