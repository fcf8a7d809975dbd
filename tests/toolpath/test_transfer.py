"""The transfer of a path, against deformations whose result is known in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sicp_cam.model import Status
from sicp_cam.rigid_motion import apply, from_parts, rotate
from sicp_cam.toolpath.settings import ToolPathSettings
from sicp_cam.toolpath.transfer import carried

RADIUS = 900.0
TURN = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()
POSE = from_parts(TURN, [400.0, -80.0, 300.0])


def unit(vectors):
    vectors = np.asarray(vectors, dtype=float)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def follow(tips, axes, contours, T=None, **settings):
    follows = np.zeros(len(tips), dtype=np.int64)
    return carried(tips, axes, follows, contours, np.eye(4) if T is None else T, ToolPathSettings(**settings))


def test_the_identity_leaves_every_move_where_it_was(made):
    nominal = made.hole()
    rng = np.random.default_rng(3)
    tips = rng.uniform(-160.0, 160.0, (400, 3)) * [1.0, 1.0, 0.2]
    axis = unit([0.1, -0.2, 1.0])
    done = made.corrected(made.path(tips, axis), [made.registered(nominal, nominal)])
    assert len(done.corrected) == 400
    np.testing.assert_allclose(done.corrected.tips_mm, tips, atol=1e-11)
    np.testing.assert_allclose(done.corrected.axes, np.tile(axis, (400, 1)), atol=1e-14)
    assert not done.added.any()


def test_tips_and_axes_keep_their_place_in_the_frame_of_a_bent_edge(made):
    """A straight edge rolled to a radius: tip and axis follow from the frame there, offset 3 mm beside and 7 above."""
    nominal = made.straight()
    bent = made.rolled(nominal, RADIUS)
    x = nominal.s_mm[40:360:16]
    beside, above = -3.0, 7.0
    tips = np.stack([x, np.full_like(x, beside), np.full_like(x, above)], 1)
    lead, tilt = 0.12, -0.2
    axis = unit([lead, tilt, 1.0])
    moved_tips, moved_axes = follow(tips, np.tile(axis, (len(x), 1)), [made.registered(nominal, bent)])
    a = x / RADIUS
    T = np.stack([np.cos(a), 0.0 * a, -np.sin(a)], 1)
    N = np.stack([np.sin(a), 0.0 * a, np.cos(a)], 1)
    true = (RADIUS + above) * N - [0.0, 0.0, RADIUS] + [0.0, beside, 0.0]
    np.testing.assert_allclose(moved_tips, true, atol=1e-9)
    np.testing.assert_allclose(moved_axes, axis[0] * T + axis[1] * np.array([0.0, 1.0, 0.0]) + axis[2] * N, atol=1e-12)


def test_between_stations_the_curve_is_met_within_its_chord(made):
    nominal = made.straight(step_mm=1.0)
    x = np.linspace(3.1, 190.3, 57)
    tips = np.stack([x, np.zeros_like(x), np.zeros_like(x)], 1)
    moved_tips, axes = follow(
        tips, np.tile([0.0, 0, 1], (57, 1)), [made.registered(nominal, made.rolled(nominal, RADIUS))]
    )
    a = x / RADIUS
    true = np.stack([RADIUS * np.sin(a), 0 * a, RADIUS * np.cos(a) - RADIUS], 1)
    assert np.linalg.norm(moved_tips - true, axis=1).max() <= 1.0**2 / (8.0 * RADIUS) * 1.01
    assert (
        np.degrees(np.arccos(np.clip((axes * np.stack([np.sin(a), 0 * a, np.cos(a)], 1)).sum(1), -1, 1))).max() < 1e-3
    )


def test_a_round_hole_rolled_to_a_cylinder(made):
    nominal = made.hole(100.0)
    bent = made.rolled(nominal, RADIUS)
    x, y, _ = nominal.points_mm[::30].T
    moved_tips, axes = follow(nominal.points_mm[::30], np.tile([0.0, 0, 1], (40, 1)), [made.registered(nominal, bent)])
    a = x / RADIUS
    np.testing.assert_allclose(moved_tips, np.stack([RADIUS * np.sin(a), y, RADIUS * np.cos(a) - RADIUS], 1), atol=1e-9)
    np.testing.assert_allclose(axes, np.stack([np.sin(a), 0 * a, np.cos(a)], 1), atol=1e-12)


def test_a_rigid_deformation_moves_near_moves_with_it_and_far_ones_with_the_pose(made):
    nominal = made.hole()
    shift = from_parts(Rotation.from_rotvec([0.01, 0.02, -0.01]).as_matrix(), [1.0, 2.0, -3.0]) @ POSE
    contours = [made.registered(nominal, made.moved(nominal, shift), rigid=made.moved(nominal, POSE))]
    rng = np.random.default_rng(5)
    near = nominal.points_mm[::7] + rng.uniform(-10.0, 10.0, (len(nominal.points_mm[::7]), 3))
    far = near + np.array([0.0, 0.0, 150.0])
    axes = unit([0.0, 0.0, 1.0] + 0.2 * rng.normal(size=near.shape))
    tips, turned = follow(near, axes, contours, POSE)
    np.testing.assert_allclose(tips, apply(shift, near), atol=1e-9)
    np.testing.assert_allclose(turned, rotate(shift, axes), atol=1e-12)
    tips, turned = follow(far, axes, contours, POSE)
    np.testing.assert_allclose(tips, apply(POSE, far), atol=1e-9)
    np.testing.assert_allclose(turned, rotate(POSE, axes), atol=1e-12)


def test_far_moves_pass_to_the_rigid_pose_without_a_step_in_value_slope_or_curvature(made):
    nominal = made.straight()
    contours = [made.registered(nominal, made.moved(nominal, from_parts(np.eye(3), [0.0, 0.0, -2.0])))]
    band, blend, h = 30.0, 60.0, 0.05
    height = np.arange(0.0, 120.0, h)
    tips = np.stack([np.full_like(height, 100.0), 0 * height, height], 1)
    moved_tips, axes = follow(tips, np.tile([0.0, 0, 1], (len(tips), 1)), contours, band_mm=band, blend_mm=blend)
    weight = (tips - moved_tips)[:, 2] / 2.0
    np.testing.assert_allclose(weight[height <= band], 1.0, atol=1e-12)
    np.testing.assert_allclose(weight[height >= band + blend], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.interp(band + 0.5 * blend, height, weight), 0.5, atol=1e-9)
    slope, curvature = np.gradient(weight, h), np.gradient(np.gradient(weight, h), h)
    assert slope.max() < 1e-9, "the weight must fall steadily"
    # A C2 weight has a third derivative of at most 60 / blend^3: the curvature makes no step larger than that times h.
    assert np.abs(np.diff(curvature)).max() <= 60.0 / blend**3 * h * 1.05
    np.testing.assert_allclose(axes, np.tile([0.0, 0, 1], (len(tips), 1)), atol=1e-15)


def test_the_axis_turns_over_to_the_rigid_pose_with_the_tip_and_stays_of_unit_length(made):
    nominal = made.straight()
    turn = Rotation.from_rotvec([0.0, 0.1, 0.0]).as_matrix()
    contours = [made.registered(nominal, made.moved(nominal, from_parts(turn, [0.0, 0.0, 0.0])))]
    height = np.linspace(0.0, 120.0, 241)
    tips = np.stack([np.full_like(height, 100.0), 0 * height, height], 1)
    _, axes = follow(tips, np.tile([0.0, 0, 1], (len(tips), 1)), contours)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)
    angle = np.arctan2(axes[:, 0], axes[:, 2])
    np.testing.assert_allclose(angle[height <= 30.0], 0.1, atol=1e-12)
    np.testing.assert_allclose(angle[height >= 90.0], 0.0, atol=1e-12)
    assert (np.diff(angle) <= 1e-12).all()


def test_approach_and_retract_within_the_band_are_carried_with_the_edge(made):
    nominal = made.straight()
    bent = made.rolled(nominal, RADIUS)
    tips = [[100.0, 0.0, 25.0], [100.0, 0.0, 0.0], [102.0, 0.0, 0.0], [102.0, 0.0, 25.0]]
    done = made.corrected(
        made.path(tips, rapid=[0]), [made.registered(nominal, bent)], distance_mm=[25.0, 0.0, 0.0, 25.0]
    )
    a = np.array([100.0, 100.0, 102.0, 102.0]) / RADIUS
    reach = RADIUS + np.array([25.0, 0.0, 0.0, 25.0])
    true = np.stack([reach * np.sin(a), 0 * a, reach * np.cos(a) - RADIUS], 1)
    np.testing.assert_allclose(done.corrected.tips_mm, true, atol=1e-9)
    assert done.status == (Status.APPROACH, Status.COVERED, Status.COVERED, Status.APPROACH)
    assert done.corrected.rapid.tolist() == [True, False, False, False]


def test_rigid_is_the_path_by_the_pose_alone(made):
    nominal = made.straight()
    contours = [made.registered(nominal, made.moved(made.rolled(nominal, RADIUS), POSE))]
    tool_path = made.path([[10.0, 0.0, 0.0], [11.0, 0.0, 0.0]])
    done = made.corrected(tool_path, contours, POSE)
    np.testing.assert_allclose(done.rigid.tips_mm, apply(POSE, tool_path.tips_mm), atol=1e-12)
    np.testing.assert_allclose(done.rigid.axes, rotate(POSE, tool_path.axes), atol=1e-15)
    np.testing.assert_array_equal(done.nominal.tips_mm, tool_path.tips_mm)


def test_each_move_follows_its_own_contour(made):
    holes = [made.hole(20.0, centre=(0.0, 0.0)), made.hole(20.0, centre=(300.0, 0.0))]
    shifts = [np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.0, -2.0])]
    contours = [
        made.registered(h, made.moved(h, from_parts(np.eye(3), d)), number=n)
        for n, (h, d) in enumerate(zip(holes, shifts, strict=True), 1)
    ]
    tips = np.concatenate([h.points_mm[::60] for h in holes])
    follows = np.repeat([0, 1], 20)
    done = made.corrected(made.path(tips, rapid=[20]), contours, follows=follows)
    kept = ~done.added
    assert done.added.sum() == 0, "a shift bends nothing, and a rapid move between two contours is not divided"
    np.testing.assert_allclose(done.corrected.tips_mm[kept], tips + np.repeat(shifts, 20, axis=0), atol=1e-9)


def test_status_words_name_seen_and_bridged_cuts_and_all_else(made):
    nominal = made.straight(step_mm=1.0)
    covered = np.ones(len(nominal), dtype=bool)
    covered[80:121] = False
    x = np.array([10.0, 78.5, 79.5, 100.0, 120.5, 121.5, 190.0])
    tips = np.stack([x, 0 * x, 0 * x], 1)
    tool_path = made.path(np.vstack([[0.0, 0.0, 80.0], tips, [190.0, 0.0, 80.0]]), rapid=[0])
    done = made.corrected(
        tool_path, [made.registered(nominal, nominal, covered)], distance_mm=[80.0, *([0.0] * 7), 80.0]
    )
    words = [status.value for status in done.status]
    seen, gap, off = "covered", "bridged", "approach"
    assert words == [off, seen, seen, gap, gap, gap, seen, seen, off]


@pytest.mark.parametrize("closed", [True, False])
def test_the_last_stretch_of_a_contour_is_judged_by_its_own_ends(made, closed):
    nominal = made.hole(50.0, count=100) if closed else made.straight(100.0, 1.0)
    covered = np.ones(len(nominal), dtype=bool)
    covered[0] = False
    end = nominal.points_mm[-1:]
    tips = 0.5 * (end + nominal.points_mm[:1]) if closed else end
    done = made.corrected(made.path(np.vstack([tips, tips])), [made.registered(nominal, nominal, covered)])
    # Behind the last station of a loop comes its first one; behind the last one of an open edge comes nothing.
    assert set(done.status) == {Status.BRIDGED if closed else Status.COVERED}


def test_a_feed_move_off_the_contour_is_no_cut(made):
    nominal = made.straight()
    tips = [[10.0, 0.0, 0.0], [10.0, 0.0, 20.0], [10.0, 0.0, 20.1]]
    done = made.corrected(
        made.path(tips), [made.registered(nominal, nominal)], distance_mm=[0.0, 20.0, 20.1], on_contour_mm=20.0
    )
    assert [status.value for status in done.status] == ["covered", "covered", "approach"]


def test_the_input_is_not_changed(made):
    nominal = made.straight()
    tool_path = made.path([[10.0, 0.0, 0.0], [150.0, 0.0, 0.0]])
    before = tool_path.tips_mm.copy(), tool_path.axes.copy()
    made.corrected(tool_path, [made.registered(nominal, made.rolled(nominal, RADIUS))])
    np.testing.assert_array_equal(tool_path.tips_mm, before[0])
    np.testing.assert_array_equal(tool_path.axes, before[1])
