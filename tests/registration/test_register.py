import numpy as np
import pytest

from sicp_cam.errors import RegistrationError
from sicp_cam.findings import Level
from sicp_cam.model import Scan
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.rigid_motion import apply, is_rigid

NEAR = RegistrationSettings(reach_mm=25.0)
SIXTEEN = RegistrationSettings(reach_mm=25.0, segments=16)


@pytest.fixture(scope="module")
def plate(synthetic):
    """A bent plate with two openings and its outer edge, all in one scan: outlines, sheets, scan and pose."""
    outlines = {
        2: synthetic.circle(30.0, centre=(-60.0, 5.0)),
        3: synthetic.oval(40.0, 28.0, centre=(55.0, -5.0)),
        7: synthetic.rounded_rectangle(260.0, 150.0, 25.0),
    }
    bent = synthetic.bent(synthetic.plane, lambda u, w: 2e-4 * u * u)
    pose = synthetic.random_pose(31)
    uv = synthetic.material(list(outlines.values()), depth_mm=100.0, seed=31)
    return outlines, bent, synthetic.scan(uv, bent, pose=pose, outliers=0.003), pose


def test_every_one_of_several_contours_is_corrected_under_its_number(synthetic, plate):
    outlines, bent, scan, pose = plate
    contours = {n: synthetic.contour(outline) for n, outline in outlines.items()}
    found = register_contours(contours, scan, synthetic.disturbed(pose, 31, shift_mm=3.0), settings=SIXTEEN)
    assert [contour.number for contour in found.contours] == [2, 3, 7]
    for contour in found.contours:
        error = synthetic.errors(contour.corrected, outlines[contour.number], bent, pose)
        assert contour.covered.mean() > 0.95
        assert np.abs(error.out[contour.covered]).mean() < 0.027
        assert np.abs(error.normal[contour.covered]).mean() < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_the_result_tells_what_was_measured(registered, method):
    found, _ = registered(method)
    assert found.method == method
    assert is_rigid(found.T_scan_part)
    assert found.spacing_mm == pytest.approx(2.0, rel=0.12)
    assert found.noise_mm == pytest.approx(0.05, rel=0.3 if method == "paper" else 0.1)
    assert found.freedoms.shape == (6,)
    assert found.symmetry is None  # the start was given
    assert bool(found.contours[0].segments) == (method in ("sicp", "paper"))


def test_without_a_start_the_pose_is_found_from_the_geometry(synthetic):
    egg, nominal = synthetic.egg(70.0), synthetic.dome(300.0, 500.0)
    bent = synthetic.bent(nominal, lambda u, w: 2e-4 * u * u)
    pose = synthetic.random_pose(32)
    scan = synthetic.scan(synthetic.material([egg], depth_mm=40.0, seed=32), bent, pose=pose, outliers=0.003)
    found = register_contours({1: synthetic.contour(egg, nominal)}, scan, None, settings=SIXTEEN)
    error = synthetic.errors(found.contours[0].corrected, egg, bent, pose)
    assert found.symmetry > 1.5
    assert np.abs(error.out).mean() < 0.012
    assert np.abs(error.normal).mean() < 0.12


def test_a_triangle_mesh_is_registered_like_a_cloud(synthetic, sagging):
    faces = synthetic.triangles(sagging.uv, 2.0, [sagging.outline])
    cloud = synthetic.scan(sagging.uv, sagging.bent, pose=sagging.pose)
    mesh = Scan(cloud.points_mm, faces=faces)
    places = [
        register_contours({1: sagging.contour}, scan, sagging.start, settings=SIXTEEN).contours[0]
        for scan in (cloud, mesh)
    ]
    both = places[0].covered & places[1].covered
    apart = (places[0].corrected.points_mm - places[1].corrected.points_mm)[both]
    for axis in (places[0].corrected.inward[both], places[0].corrected.outward[both]):
        assert np.abs(np.sum(apart * axis, axis=1)).mean() < 0.05
    assert both.mean() > 0.9


def test_twice_the_spacing_still_follows_the_part(synthetic, sagging):
    uv = synthetic.material([sagging.outline], spacing_mm=4.0, depth_mm=60.0, seed=33)
    scan = synthetic.scan(uv, sagging.bent, pose=sagging.pose)
    found = register_contours({1: sagging.contour}, scan, sagging.start, settings=NEAR)
    error = synthetic.errors(found.contours[0].corrected, sagging.outline, sagging.bent, sagging.pose)
    assert found.spacing_mm == pytest.approx(4.0, rel=0.12)
    assert np.abs(error.out).mean() < 0.02
    assert np.abs(error.normal).mean() < 0.35


def test_the_inputs_are_left_alone(sagging):
    before = sagging.scan.points_mm.copy(), sagging.contour.points_mm.copy(), sagging.start.copy()
    register_contours({1: sagging.contour}, sagging.scan, sagging.start, method="rigid", settings=NEAR)
    for old, new in zip(before, (sagging.scan.points_mm, sagging.contour.points_mm, sagging.start), strict=True):
        np.testing.assert_array_equal(old, new)


def test_the_same_inputs_give_the_same_numbers(sagging, registered):
    again = register_contours({1: sagging.contour}, sagging.scan, sagging.start, settings=NEAR)
    np.testing.assert_array_equal(
        again.contours[0].corrected.points_mm, registered("sicp")[0].contours[0].corrected.points_mm
    )


def test_a_circle_in_a_flat_sheet_is_told_to_hold_no_rotation(synthetic):
    circle, pose = synthetic.circle(60.0), synthetic.random_pose(34)
    scan = synthetic.scan(synthetic.material([circle], depth_mm=40.0), synthetic.plane, pose=pose)
    found = register_contours({1: synthetic.contour(circle)}, scan, pose, method="rigid", settings=NEAR)
    assert any(finding.code == 401 and "rotation" in finding.message for finding in found.findings)


def test_a_scan_far_from_the_contour_is_refused(synthetic, sagging):
    away = np.eye(4)
    away[:3, 3] = 5000.0
    with pytest.raises(RegistrationError, match=r"only 0 scan points lie within .* of the contour"):
        register_contours({1: sagging.contour}, sagging.scan, away @ sagging.start, settings=NEAR)


@pytest.mark.parametrize("count", [0, 1, 49])
@pytest.mark.parametrize("given", [True, False])
def test_too_few_points_are_refused(sagging, count, given):
    few = Scan(sagging.scan.points_mm[:count])
    with pytest.raises(RegistrationError, match="scan points"):
        register_contours({1: sagging.contour}, few, sagging.start if given else None, settings=NEAR)


@pytest.mark.parametrize("points", ["on one line", "all the same", "a cloud of dust"])
@pytest.mark.parametrize("given", [True, False])
def test_points_that_are_no_surface_are_refused(sagging, points, given):
    rng = np.random.default_rng(0)
    some = {
        "on one line": np.column_stack([np.linspace(-100.0, 100.0, 300), np.full(300, 75.0), np.zeros(300)]),
        "all the same": np.tile([[0.0, 75.0, 0.0]], (300, 1)),
        "a cloud of dust": rng.uniform(-130.0, 130.0, (3000, 3)),
    }[points]
    with pytest.raises(RegistrationError, match="--align"):
        register_contours({1: sagging.contour}, Scan(some), np.eye(4) if given else None, settings=NEAR)


@pytest.fixture(scope="module")
def uncut(synthetic, sagging):
    """The sagging part before its opening is cut: the material goes on beyond the contour on both sides."""
    uv = synthetic.material([synthetic.rounded_rectangle(320.0, 260.0, 20.0)], depth_mm=200.0)
    return synthetic.scan(uv, sagging.bent, pose=sagging.pose)


@pytest.mark.parametrize("method", ["paper", "projection"])
def test_a_method_that_needs_the_edge_refuses_a_part_that_is_not_cut_yet(sagging, uncut, method):
    with pytest.raises(RegistrationError, match=r"contour 1 is not cut yet, .* use --method sicp or rigid"):
        register_contours({1: sagging.contour}, uncut, sagging.pose, method=method, settings=NEAR)


def test_a_part_that_is_not_cut_yet_is_followed_out_of_the_surface_and_stays_in_it(synthetic, sagging, uncut):
    found = register_contours({1: sagging.contour}, uncut, sagging.pose, settings=NEAR)
    (contour,) = found.contours
    error = synthetic.errors(contour.corrected, sagging.outline, sagging.bent, sagging.pose)
    assert contour.uncut
    assert any(finding.code == 406 and finding.level is Level.WARN for finding in found.findings)
    assert contour.normal_u_mm is None  # nothing is known of it
    assert np.abs(error.out).mean() < 0.012
    exact = synthetic.contour(sagging.outline, sagging.nominal).points_mm
    aside = np.sum((contour.corrected.points_mm - apply(sagging.pose, exact)) * contour.corrected.inward, axis=1)
    assert np.abs(aside).max() < 0.9


def test_the_scan_of_another_part_is_refused_or_its_misfit_told(synthetic, sagging):
    other = synthetic.rounded_rectangle(240.0, 180.0, 15.0, hole=True)
    scan = synthetic.scan(synthetic.material([other], depth_mm=40.0), sagging.nominal, pose=sagging.pose)
    try:
        found = register_contours({1: sagging.contour}, scan, sagging.start, method="rigid", settings=NEAR)
    except RegistrationError as error:
        assert "check that scan and part belong together" in str(error)
    else:
        (contour,) = found.contours
        misfit = np.nanmean(np.abs(contour.before.normal_mm))
        assert misfit > 3.0 or contour.covered.mean() < 0.7


def test_a_loop_of_another_length_is_refused(synthetic, sagging):
    other = synthetic.circle(40.0)
    scan = synthetic.scan(synthetic.material([other], depth_mm=25.0), sagging.nominal)
    with pytest.raises(RegistrationError, match=r"no closed edge of the scan is about 55\d mm long"):
        register_contours({1: sagging.contour}, scan, None, settings=NEAR)


def test_an_unknown_method_is_named(sagging):
    with pytest.raises(ValueError, match="unknown method 'best'; use one of sicp"):
        register_contours({1: sagging.contour}, sagging.scan, sagging.start, method="best")


def test_a_narrow_gap_at_the_seam_is_bridged_like_any_other(synthetic, sagging):
    """The start of the contour is where no operator looks for a gap."""
    worst = []
    for gap in ((-12.0, 12.0), (288.0, 312.0)):
        uv = synthetic.without_gaps(sagging.whole, sagging.outline, [gap])
        scan = synthetic.scan(uv, sagging.bent, pose=sagging.pose)
        found = register_contours({1: sagging.contour}, scan, sagging.start, settings=NEAR)
        (contour,) = found.contours
        error = synthetic.errors(contour.corrected, sagging.outline, sagging.bent, sagging.pose)
        assert not contour.covered.all()
        worst.append(error.both[~contour.covered].max())
    assert max(worst) < 0.2


def test_stability_points_are_not_needed_where_the_edge_holds_all(synthetic, sagging):
    bare = synthetic.contour(sagging.outline, sagging.nominal, rings_mm=())
    found = register_contours({1: bare}, sagging.scan, sagging.start, settings=SIXTEEN)
    error = synthetic.errors(found.contours[0].corrected, sagging.outline, sagging.bent, sagging.pose)
    covered = found.contours[0].covered
    assert np.abs(error.out[covered]).mean() < 0.02
    assert found.contours[0].stability_scan_mm.shape == (0, 3)


def test_the_rigid_curve_is_the_nominal_one_moved(registered):
    found, _ = registered("rigid")
    (contour,) = found.contours
    np.testing.assert_allclose(contour.rigid.points_mm, apply(found.T_scan_part, contour.nominal.points_mm), atol=1e-9)
    np.testing.assert_array_equal(contour.corrected.points_mm, contour.rigid.points_mm)
