import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import framed
from sicp_cam.errors import AmbiguousPoseError, RegistrationError
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import prepared
from sicp_cam.registration.start import find_start, is_circular, scan_loops, signature_poses
from sicp_cam.rigid_motion import apply, rotate

REACH = 25.0


def nominal(contour):
    return NominalContour(framed(contour), contour.ring_points_mm, contour.ring_normals)


def surface_of(synthetic, outlines, sheet, *, seed=0, gaps=(), **options):
    uv = synthetic.without_gaps(synthetic.material(outlines, depth_mm=40.0, seed=seed), outlines[0], gaps)
    return prepared(synthetic.scan(uv, sheet, **options))


@pytest.fixture(scope="module")
def dome(synthetic):
    return synthetic.dome(300.0, 500.0)


@settings(deadline=None, max_examples=25)
@given(shift=st.integers(0, 255), reverse=st.booleans(), seed=st.integers(0, 2**32 - 1))
def test_the_signature_finds_pose_shift_and_sense_of_a_loop(synthetic, dome, shift, reverse, seed):
    loop = synthetic.contour(synthetic.egg(70.0), dome, step_mm=synthetic.egg(70.0).length_mm / 256).points_mm
    pose = synthetic.random_pose(seed)
    measured = np.roll(apply(pose, loop), shift, axis=0)
    misfit, found = signature_poses(loop, measured[::-1] if reverse else measured)[0]
    assert misfit < 1e-4
    np.testing.assert_allclose(apply(found, loop), apply(pose, loop), atol=1e-3)


def test_every_fold_of_a_symmetric_loop_is_offered(synthetic):
    outline = synthetic.rounded_rectangle(120.0, 120.0, 20.0)
    loop = synthetic.contour(outline, step_mm=outline.length_mm / 256).points_mm
    poses = [pose for misfit, pose in signature_poses(loop, loop) if misfit < 0.1]
    assert len(poses) == 8  # four turns, and each of them with the other side up
    angles = {round(float(np.degrees(np.arctan2(T[1, 0], T[0, 0])))) % 360 for T in poses if T[2, 2] > 0.0}
    assert angles == {0, 90, 180, 270}


def test_only_a_circle_is_circular(synthetic):
    def loop(outline, sheet=synthetic.plane):
        return synthetic.contour(outline, sheet, step_mm=outline.length_mm / 256).points_mm

    assert is_circular(loop(synthetic.circle(80.0)))
    assert is_circular(loop(synthetic.circle(80.0), synthetic.dome(400.0, 400.0)))
    assert not is_circular(loop(synthetic.oval(80.0, 76.0)))
    assert not is_circular(loop(synthetic.rounded_rectangle(100.0, 100.0, 30.0)))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("hole", [True, False])
def test_an_asymmetric_contour_is_found_from_any_pose(synthetic, dome, seed, hole):
    egg, pose = synthetic.egg(70.0, hole=hole), synthetic.random_pose(seed)
    contour = nominal(synthetic.contour(egg, dome))
    surface = surface_of(synthetic, [egg], dome, seed=seed, pose=pose, outliers=0.003)
    found = find_start([contour], surface, reach_mm=REACH)
    offset = apply(found.T_scan_part, contour.curve.points_mm) - apply(pose, contour.curve.points_mm)
    assert np.linalg.norm(offset, axis=1).max() < 1.2
    assert found.misfit_mm < 1.5  # the rim is made of points 2 mm apart: their nearest distance has a floor
    assert found.symmetry > 1.5


def test_a_deformed_part_is_found_too(synthetic, dome):
    egg, pose = synthetic.egg(70.0), synthetic.random_pose(21)
    bent = synthetic.bent(dome, lambda u, w: 3e-4 * u * u)
    contour = nominal(synthetic.contour(egg, dome))
    found = find_start([contour], surface_of(synthetic, [egg], bent, pose=pose), reach_mm=REACH)
    offset = apply(found.T_scan_part, contour.curve.points_mm) - apply(pose, contour.curve.points_mm)
    assert np.linalg.norm(offset, axis=1).max() < 2.5


def test_an_oval_that_fits_both_ways_round_is_refused(synthetic, dome):
    oval = synthetic.oval(100.0, 75.0)
    surface = surface_of(synthetic, [oval], dome, pose=synthetic.random_pose(1), normals=True)
    with pytest.raises(AmbiguousPoseError, match=r"path moved or turned by 1\d\d mm.*--align FILE"):
        find_start([nominal(synthetic.contour(oval, dome))], surface, reach_mm=REACH)


def test_another_opening_tells_which_way_round_the_oval_lies(synthetic, dome):
    outlines = [synthetic.oval(100.0, 75.0), synthetic.circle(20.0, centre=(150.0, 20.0))]
    pose = synthetic.random_pose(2)
    contours = [nominal(synthetic.contour(outline, dome)) for outline in outlines]
    uv = synthetic.material([*outlines, synthetic.rounded_rectangle(420.0, 280.0, 20.0)], depth_mm=80.0)
    found = find_start(contours, prepared(synthetic.scan(uv, dome, pose=pose)), reach_mm=REACH)
    offset = apply(found.T_scan_part, contours[0].curve.points_mm) - apply(pose, contours[0].curve.points_mm)
    assert np.linalg.norm(offset, axis=1).max() < 2.0


def test_without_normals_a_circle_in_a_flat_sheet_has_two_sides(synthetic):
    circle = synthetic.circle(80.0)
    surface = surface_of(synthetic, [circle], synthetic.plane, pose=synthetic.random_pose(3))
    with pytest.raises(AmbiguousPoseError, match="other side outward"):
        find_start([nominal(synthetic.contour(circle))], surface, reach_mm=REACH)


@pytest.mark.parametrize("flipped", [False, True])
def test_normals_of_the_scan_decide_the_side_and_a_turned_circle_is_harmless(synthetic, flipped):
    circle, pose = synthetic.circle(80.0), synthetic.random_pose(3)
    contour = nominal(synthetic.contour(circle))
    if flipped:  # the scan shows the part from the other side: the same points, all normals turned
        pose = pose @ np.diag([1.0, -1.0, -1.0, 1.0])
    surface = surface_of(synthetic, [circle], synthetic.plane, pose=pose, normals=True)
    found = find_start([contour], surface, reach_mm=REACH)
    outward = rotate(found.T_scan_part, contour.curve.outward)
    assert (outward @ pose[:3, 2]).min() > 0.999
    there = apply(np.linalg.inv(pose) @ found.T_scan_part, contour.curve.points_mm)
    np.testing.assert_allclose(np.linalg.norm(there[:, :2], axis=1), 80.0, atol=0.15)
    assert np.abs(there[:, 2]).max() < 0.02


def test_the_dish_of_a_dome_decides_the_side_of_its_circle(synthetic):
    circle, sphere, pose = synthetic.circle(80.0), synthetic.dome(400.0, 400.0), synthetic.random_pose(4)
    contour = nominal(synthetic.contour(circle, sphere))
    found = find_start([contour], surface_of(synthetic, [circle], sphere, pose=pose), reach_mm=REACH)
    axis = rotate(found.T_scan_part, np.array([[0.0, 0.0, 1.0]]))[0]
    assert axis @ pose[:3, 2] > 0.999


def test_a_scan_without_a_loop_of_that_length_is_refused(synthetic, dome):
    egg = synthetic.egg(70.0)
    surface = surface_of(synthetic, [synthetic.circle(140.0)], synthetic.plane)
    with pytest.raises(RegistrationError, match=r"no closed edge of the scan is about 45\d mm long.*--align FILE"):
        find_start([nominal(synthetic.contour(egg, dome))], surface, reach_mm=REACH)


def test_an_open_contour_asks_for_a_pose(synthetic):
    edge = synthetic.wavy_edge(300.0)
    surface = surface_of(synthetic, [edge], synthetic.plane)
    with pytest.raises(RegistrationError, match="--align FILE"):
        find_start([nominal(synthetic.contour(edge))], surface, reach_mm=REACH)


def test_loops_come_best_match_first(synthetic):
    outlines = [synthetic.circle(50.0, centre=(-70.0, 0.0)), synthetic.circle(46.0, centre=(50.0, 0.0))]
    uv = synthetic.material([*outlines, synthetic.rounded_rectangle(320.0, 200.0, 10.0)], depth_mm=200.0)
    surface = prepared(synthetic.scan(uv, synthetic.plane))
    centres = [loop.mean(axis=0)[0] for loop in scan_loops(surface, outlines[1].length_mm * 1.02)]
    assert centres == pytest.approx([50.0, -70.0], abs=2.0)


def test_one_gap_of_the_scan_does_not_hide_the_loop(synthetic, dome):
    egg = synthetic.egg(70.0)
    found = 0
    for seed in range(6):
        uv = synthetic.material([egg], depth_mm=60.0, seed=seed)
        uv = synthetic.without_gaps(uv, egg, [(50.0, 80.0)], depth_mm=15.0)
        found += bool(scan_loops(prepared(synthetic.scan(uv, dome)), egg.length_mm))
    assert found == 6
