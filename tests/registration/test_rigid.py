import numpy as np
import pytest

from sicp_cam.contour.frames import framed, moved
from sicp_cam.errors import RegistrationError
from sicp_cam.model import Scan
from sicp_cam.registration.rigid import NominalContour, facing_rim, register_rigidly
from sicp_cam.registration.scan_surface import cropped, distances_along_normal, prepared
from sicp_cam.rigid_motion import apply, inverse, is_rigid

REACH = 25.0


def nominal(contour):
    return NominalContour(framed(contour), contour.ring_points_mm, contour.ring_normals)


def pose_error(found, pose, curve):
    """Return the mean distance of the registered from the true contour across it and out of it, mm."""
    offset = apply(inverse(pose) @ found, curve.points_mm) - curve.points_mm
    across, out = (np.abs(np.sum(offset * axis, axis=1)).mean() for axis in (curve.inward, curve.outward))
    return across, out


def scanned(synthetic, outlines, sheet, *, seed=4, gaps=(), sampling="jittered", **options):
    uv = synthetic.material(outlines, sampling=sampling, depth_mm=40.0, seed=seed)
    uv = synthetic.without_gaps(uv, outlines[0], gaps)
    return synthetic.scan(uv, sheet, **options)


@pytest.fixture(scope="module")
def dome(synthetic):
    return synthetic.dome(300.0, 500.0)


@pytest.mark.parametrize("sampling", ["jittered", "random"])
@pytest.mark.parametrize("seed", [4, 5])
def test_the_pose_of_an_undeformed_part_is_found(synthetic, dome, sampling, seed):
    oval, pose = synthetic.oval(100.0, 75.0), synthetic.random_pose(seed)
    contour = nominal(synthetic.contour(oval, dome))
    scan = scanned(synthetic, [oval], dome, seed=seed, sampling=sampling, pose=pose)
    start = synthetic.disturbed(pose, seed, degrees=2.0, shift_mm=6.0)
    found = register_rigidly([contour], prepared(scan), start, reach_mm=REACH)
    across, out = pose_error(found.T_scan_part, pose, contour.curve)
    assert is_rigid(found.T_scan_part)
    assert across < 0.22
    assert out < 0.22
    assert found.rms_mm < 1.2  # the rim's own distance from the edge, not the error of the pose


def test_the_pose_holds_with_gaps_and_outliers(synthetic, dome):
    oval, pose = synthetic.oval(100.0, 75.0), synthetic.random_pose(6)
    contour = nominal(synthetic.contour(oval, dome))
    scan = scanned(synthetic, [oval], dome, gaps=[(100.0, 140.0), (300.0, 320.0)], pose=pose, outliers=0.02)
    start = synthetic.disturbed(pose, 6, degrees=2.0, shift_mm=6.0)
    found = register_rigidly([contour], prepared(scan), start, reach_mm=REACH)
    across, out = pose_error(found.T_scan_part, pose, contour.curve)
    assert across < 0.3
    assert out < 0.2


def test_the_start_does_not_decide_the_pose(synthetic, dome):
    oval, pose = synthetic.oval(100.0, 75.0), synthetic.random_pose(7)
    contour = nominal(synthetic.contour(oval, dome))
    surface = prepared(scanned(synthetic, [oval], dome, pose=pose, outliers=0.005))
    poses = [
        register_rigidly([contour], surface, synthetic.disturbed(pose, seed, shift_mm=5.0), reach_mm=REACH).T_scan_part
        for seed in range(4)
    ]
    places = np.array([apply(T, contour.curve.points_mm) for T in poses])
    assert np.ptp(places, axis=0).max() < 1e-3


def test_a_circle_in_a_plane_leaves_its_rotation_open_and_near_the_start(synthetic):
    circle, pose = synthetic.circle(80.0), synthetic.random_pose(8)
    contour = nominal(synthetic.contour(circle))
    surface = prepared(scanned(synthetic, [circle], synthetic.plane, pose=pose))
    found = register_rigidly([contour], surface, pose, reach_mm=REACH)
    assert found.freedoms[-1] < 0.05
    assert found.freedoms[-2] > 0.2
    axis = found.twists[-1][:3] / np.linalg.norm(found.twists[-1][:3])
    assert abs(axis @ pose[:3, 2]) > 0.99
    turned = inverse(pose) @ found.T_scan_part
    assert np.degrees(np.arctan2(turned[1, 0], turned[0, 0])) == pytest.approx(0.0, abs=0.5)


def test_several_contours_hold_each_other(synthetic):
    outlines = [synthetic.circle(40.0, centre=(-70.0, 0.0)), synthetic.circle(30.0, centre=(60.0, 20.0))]
    pose = synthetic.random_pose(9)
    contours = [nominal(synthetic.contour(outline)) for outline in outlines]
    uv = synthetic.material([*outlines, synthetic.rounded_rectangle(300.0, 180.0, 10.0)], depth_mm=60.0)
    surface = prepared(synthetic.scan(uv, synthetic.plane, pose=pose))
    found = register_rigidly(contours, surface, synthetic.disturbed(pose, 9), reach_mm=REACH)
    assert found.freedoms[-1] > 0.1
    for contour in contours:
        offset = apply(inverse(pose) @ found.T_scan_part, contour.curve.points_mm) - contour.curve.points_mm
        assert np.linalg.norm(offset, axis=1).max() < 0.25


def test_too_few_rim_points_near_the_contour_are_refused(synthetic, dome):
    oval = synthetic.oval(100.0, 75.0)
    contour = nominal(synthetic.contour(oval, dome))
    surface = prepared(scanned(synthetic, [oval], dome))
    away = np.eye(4)
    away[0, 3] = 900.0
    with pytest.raises(RegistrationError, match="only 0 points of the scan's rim lie within 25 mm of the contour"):
        register_rigidly([contour], surface, away, reach_mm=REACH)


def test_rim_points_that_open_to_the_other_side_do_not_belong_to_the_contour(synthetic):
    hole = synthetic.circle(60.0)
    curve = framed(synthetic.contour(hole))
    surface = prepared(synthetic.scan(synthetic.material([hole], depth_mm=15.0), synthetic.plane))
    chosen, s_mm = facing_rim(surface.rim, curve, REACH)
    radius = np.linalg.norm(surface.rim.points_mm[chosen], axis=1)
    assert radius.max() < 66.0  # the scan also ends at radius 75, within reach, but open outwards
    assert len(s_mm) == len(chosen) > 100


def test_distances_along_the_normal_are_signed_and_told_only_where_there_is_surface(synthetic):
    pose = synthetic.random_pose(10)
    hole = synthetic.circle(60.0)
    surface = prepared(synthetic.scan(synthetic.material([hole]), synthetic.plane, pose=pose))
    places = np.array([[80.0, 0.0, -1.5], [0.0, 90.0, 2.0], [0.0, 0.0, 0.0], [80.0, 0.0, 0.0]])
    normals = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]])
    out, planes = distances_along_normal(surface, apply(pose, places), normals @ pose[:3, :3].T, REACH)
    assert out[:2] == pytest.approx([1.5, -2.0], abs=0.06)
    np.testing.assert_allclose(planes[:2] @ pose[:3, 2], 1.0, atol=2e-3)
    assert np.isnan(out[2:]).all()  # the middle of the hole; a wall across the surface


def test_the_spacing_is_that_of_the_sampling(synthetic):
    hole = synthetic.circle(60.0)
    for spacing in (1.5, 3.0):
        for sampling in ("random", "jittered"):
            uv = synthetic.material([hole], sampling=sampling, spacing_mm=spacing, depth_mm=40.0)
            surface = prepared(synthetic.scan(uv, synthetic.plane))
            assert surface.spacing_mm == pytest.approx(spacing, rel=0.12)


def test_cropping_keeps_the_band_with_its_triangles_and_normals(synthetic):
    hole = synthetic.circle(60.0)
    pose = synthetic.random_pose(11)
    uv = synthetic.material([hole], depth_mm=60.0)
    faces = synthetic.triangles(uv, 2.0, [hole])
    scan = synthetic.scan(uv, synthetic.plane, pose=pose, normals=True, faces=faces, noise_mm=0.0)
    part = cropped(scan, [moved(framed(synthetic.contour(hole)), pose)], 20.0)
    depth, _ = hole.depth(apply(inverse(pose), part.points_mm)[:, :2])
    assert depth.max() < 23.0
    assert (hole.depth(uv)[0] < 20.0).sum() <= len(part.points_mm)
    whole = {tuple(np.round(row, 6)) for row in scan.points_mm[scan.faces].reshape(-1, 9)}
    assert {tuple(np.round(row, 6)) for row in part.points_mm[part.faces].reshape(-1, 9)} <= whole
    assert len(part.normals) == len(part.points_mm)
    assert len(part.faces) > 0.4 * len(scan.faces) * 20.0 / 60.0


def test_the_band_does_not_depend_on_how_the_scan_lies_to_the_axes(synthetic):
    hole = synthetic.circle(60.0)
    curve = framed(synthetic.contour(hole, synthetic.dome(150.0, 150.0)))
    scan = synthetic.scan(synthetic.material([hole]), synthetic.dome(150.0, 150.0))
    counts = {
        len(cropped(Scan(apply(T, scan.points_mm)), [moved(curve, T)], 20.0).points_mm)
        for T in (np.eye(4), synthetic.random_pose(1), synthetic.random_pose(2))
    }
    assert len(counts) == 1
