"""What is told of paths that are too much for an arm: each built from joints, so that the truth is known."""

import dataclasses
import math

import numpy as np
import pytest
from arm_paths import FORWARD, TOOL, findings_of, poses_of, told
from hypothesis import given, settings
from hypothesis import strategies as st
from post_programs import path_of
from scipy.spatial.transform import Rotation

from sicp_cam.findings import Level
from sicp_postprocessors.arm import arm_findings, load_arm
from sicp_postprocessors.arm.along import places_along
from sicp_postprocessors.orientations import pose_from_six

ARM = load_arm("tx2-90")
REST = np.array([10.0, 40.0, 80.0, 5.0, 50.0, 0.0])


def moved(*steps):
    """Return joints: the rest pose with single joints set, one dict {joint: degrees} a move."""
    joints = np.tile(REST, (len(steps), 1))
    for row, step in zip(joints, steps, strict=True):
        for number, degrees in step.items():
            row[number - 1] = degrees
    return joints


def test_a_path_within_everything_is_told_where_and_how_it_was_checked():
    findings = findings_of(ARM, moved({}, {1: 12}, {1: 14}), asked=FORWARD)
    (summary,) = findings
    assert (summary.code, summary.level) == (669, Level.INFO)
    assert summary.message.startswith("checked with a model of the Staubli TX2-90 at ")
    assert summary.message.endswith(
        "in the configuration lefty, epositive, wpositive, 65.0 degrees from the nearest joint limit"
    )


@pytest.mark.parametrize("number", range(1, 7))
@pytest.mark.parametrize("end", ["lowest_deg", "highest_deg"])
def test_each_joint_may_come_to_its_limit_and_not_beyond(number, end):
    joint = ARM.joints[number - 1]
    limit = getattr(joint, end)
    rest = moved({})[0]
    rest[number - 1] = limit / 2.0 if number in (4, 6) else limit - math.copysign(1.0, limit)
    rest[2] = -abs(rest[2]) if number == 2 and limit > 0 else rest[2]
    at, beyond = np.vstack([rest, rest, rest]), np.vstack([rest, rest, rest])
    # From 0 on, so that no other turn of joint 4 or 6 does.
    at[0, number - 1] = beyond[0, number - 1] = 0.0 if number in (4, 6) else limit - math.copysign(2.0, limit)
    at[2, number - 1] = limit
    beyond[2, number - 1] = limit + math.copysign(0.01, limit)
    words = tuple(_words(at[2]))
    assert not told(findings_of(ARM, at, asked=words), 665)
    findings = findings_of(ARM, beyond, asked=words)
    (finding,) = told(findings, 665)
    assert finding.level is Level.FAIL
    assert finding.where == "move 2, line 12"
    assert finding.message.startswith(f"joint {number} would come to {limit + math.copysign(0.01, limit):.3f} degrees")
    assert f"its limit is {limit:g}" in finding.message


def _words(joints_deg):
    a2, a23 = math.radians(joints_deg[1]), math.radians(joints_deg[1] + joints_deg[2])
    yield "lefty" if ARM.shoulder_forward_mm + 425 * (math.sin(a2) + math.sin(a23)) >= 0 else "righty"
    yield "epositive" if joints_deg[2] >= 0 else "enegative"
    yield "wpositive" if joints_deg[4] >= 0 else "wnegative"


def test_a_limit_that_only_the_way_between_two_moves_breaks_is_found():
    # The tip goes 600 mm straight past axis 1, in front of it: between its ends joint 3 must bend far.
    tips = np.array([[250.0, 300.0, -150.0], [250.0, -300.0, -150.0]])
    R = np.tile(np.diag([1.0, -1.0, -1.0]), (2, 1, 1))
    path = path_of(tips, [[0, 0, 1.0]] * 2, [0.0, 600.0], [True, False])
    T = pose_from_six((0.0, 0.0, 50.0, 0.0, 0.0, 0.0))
    findings = arm_findings(path, tips, R, np.full(2, 10.0), T, ARM, asked=FORWARD)
    assert [f.where for f in told(findings, 665)] == ["move 1, line 11"]
    for end in (0, 1):
        still = path_of(tips[[end]], [[0, 0, 1.0]], [0.0], [True])
        assert not told(arm_findings(still, tips[[end]], R[[end]], np.full(1, 10.0), T, ARM, asked=FORWARD), 665)


def test_a_place_out_of_reach_is_told_with_how_far():
    joints = moved({2: 90, 3: 0.5, 4: 0, 5: 60}, {2: 90, 3: 0.4, 4: 0, 5: 60})
    tips, R = poses_of(ARM, joints)
    tips[1] += [30.0, 0.0, 0.0]
    path = path_of(tips, -R[:, :, 2], [0.0, 600.0], [True, False])
    findings = arm_findings(path, tips, R, np.full(2, 10.0), TOOL, ARM, asked=FORWARD)
    (finding,) = told(findings, 664)
    assert (finding.level, finding.where) == (Level.FAIL, "move 1, line 11")
    # 30 mm along x; joint 1 looks 10 degrees aside, the forearm lies 50 mm beside
    assert 28.0 < float(finding.message.split(" by up to ")[1].split(" mm")[0]) < 30.0
    assert not told(findings, 665)


LEAN = math.degrees(math.asin(27.3 / 425.0))
"""Joint 2 back by this, and the forearm upright: the wrist is 50 - 27.3 mm in front of axis 1."""


@pytest.mark.parametrize(
    ("steps", "what"),
    [
        (({4: 0, 5: 20}, {4: 0, 5: 1.0}), "the wrist is nearly straight: joint 5 bends 1 degrees"),
        (({3: 20}, {3: 1.5}), "the arm is nearly stretched: the elbow bends 1.5 degrees"),
        (({2: 0, 3: 30}, {2: -LEAN, 3: LEAN}), "the wrist is nearly above or below axis 1: 22.7 mm from it"),
    ],
)
def test_a_singular_place_is_told_by_its_kind(steps, what):
    near = told(findings_of(ARM, moved(*steps), asked=FORWARD), 667)
    assert [(f.level, f.where) for f in near if f.message.startswith(what)] == [(Level.WARN, "move 1, line 11")]
    assert not told(findings_of(ARM, moved(*steps), asked=FORWARD, singular_deg=0.1), 667)


def test_a_rapid_move_near_a_singular_place_is_no_warning():
    findings = findings_of(ARM, moved({4: 0, 5: 20}, {4: 0, 5: 1.0}), rapid=[True, True], asked=FORWARD)
    assert [f.level for f in told(findings, 667)] == [Level.INFO]


def test_a_joint_speed_is_that_of_the_tip_over_its_arm():
    # Joint 1 alone carries the tip around its axis: v / r.
    degrees = np.arange(0.0, 30.0, 0.5)
    joints = np.tile(REST, (len(degrees), 1))
    joints[:, 0] = degrees
    tips, _ = poses_of(ARM, joints)
    radius = math.hypot(*tips[0, :2])
    limit = ARM.joints[0].fastest_deg_s
    fits = math.radians(limit) * radius
    assert not told(findings_of(ARM, joints, feed_mm_s=0.99 * fits, asked=FORWARD), 668)
    (finding,) = told(findings_of(ARM, joints, feed_mm_s=2.0 * fits, asked=FORWARD), 668)
    assert (finding.level, finding.where) == (
        Level.WARN,
        f"moves 1 to {len(degrees) - 1}, lines 11 to {len(degrees) + 9}",
    )
    assert finding.message.startswith("joint 1 would have to turn 530")
    told_fit = float(finding.message.split("; ")[1].split(" mm/min")[0])
    assert told_fit <= fits * 60.0
    assert told_fit == pytest.approx(fits * 60.0, rel=0.01)


def test_a_fast_joint_is_told_for_its_move_only():
    joints = moved({}, {1: 10.2}, {1: 10.4}, {1: 10.6})
    tips, R = poses_of(ARM, joints)
    path = path_of(tips, -R[:, :, 2], [0.0, 600.0, 600.0, 600.0], [True, False, False, False])
    speeds = np.array([10.0, 10.0, 5000.0, 10.0])
    (finding,) = told(arm_findings(path, tips, R, speeds, TOOL, ARM, asked=FORWARD), 668)
    assert finding.where == "move 2, line 12"


def test_a_turn_in_place_has_no_tip_speed_and_no_joint_speed():
    assert not told(findings_of(ARM, moved({}, {6: 170}), feed_mm_s=1e6, asked=FORWARD), 668)


def test_the_configuration_to_start_in_is_told_if_none_was_asked_for():
    (finding,) = told(findings_of(ARM, moved({}, {1: 12}), ask=lambda c: f"ask {c}"), 666)
    assert (finding.level, finding.where) == (Level.WARN, "move 0, line 10")
    assert finding.message.endswith("or ask for it: ask lefty, epositive, wpositive")


def test_a_configuration_that_cannot_follow_is_told_with_one_that_can():
    findings = findings_of(ARM, moved({}, {1: 12}), asked=("lefty", "enegative", "wnegative"))
    (finding,) = told(findings, 666)
    assert finding.level is Level.FAIL
    assert "cannot follow the path, but these can: lefty, epositive, wpositive" in finding.message
    assert told(findings, 665), "and why"


def test_a_start_that_leads_beyond_a_limit_later_is_told():
    joints = moved({6: -200}, {6: -140}, {6: -80}, {6: 0}, {6: 80})
    (finding,) = told(findings_of(ARM, joints, asked=FORWARD), 666)
    assert finding.level is Level.WARN
    assert finding.message.startswith("bring joint 6 near -200.0 degrees before the start: from 160.0 degrees it would")
    assert not told(findings_of(ARM, joints, asked=FORWARD), 665)


def test_a_joint_that_turns_on_and_on_passes_its_limit_at_one_move():
    joints = moved({6: -260}, {6: -160}, {6: 0}, {6: 140}, {6: 265}, {6: 300})
    (finding,) = told(findings_of(ARM, joints, asked=FORWARD), 665)
    assert finding.where == "move 5, line 15"
    assert "joint 6 would come to 300.000 degrees, its limit is 270" in finding.message


def circled(centre_mm, radius_mm, count=80):
    t = np.linspace(0.0, 2.0 * np.pi, count)
    return np.array(centre_mm) + radius_mm * np.column_stack([np.cos(t), np.sin(t), 0.0 * t])


def downward(tips, rapid, arm=ARM, **more):
    R = np.tile(np.diag([1.0, -1.0, -1.0]), (len(tips), 1, 1))
    path = path_of(tips, [[0, 0, 1.0]] * len(tips), np.where(rapid, 0.0, 600.0), rapid)
    return arm_findings(path, tips, R, np.full(len(tips), 10.0), TOOL, arm, **more)


def test_a_cut_around_the_robot_needs_another_configuration_within_it():
    tips = circled((0.0, 0.0, -250.0), 450.0)
    rapid = np.arange(len(tips)) == 0
    findings = downward(tips, rapid)
    changes = [f for f in told(findings, 666) if "would have to change its configuration within this cut" in f.message]
    assert [(f.level, f.where) for f in changes] == [(Level.FAIL, "moves 1 to 79, lines 11 to 89")]


def test_cuts_that_need_different_configurations_are_divided_at_retracts():
    arm = dataclasses.replace(
        ARM, joints=(dataclasses.replace(ARM.joints[0], lowest_deg=-60.0, highest_deg=60.0), *ARM.joints[1:])
    )
    front = circled((500.0, 0.0, -150.0), 40.0, 20)
    behind = circled((-500.0, 0.0, -150.0), 40.0, 20)
    tips = np.vstack([front, behind])
    rapid = np.isin(np.arange(40), (0, 20))
    findings = downward(tips, rapid, arm)
    (finding,) = told(findings, 666)
    assert finding.level is Level.FAIL
    assert "moves 1 to 19, lines 11 to 29: lefty" in finding.message
    assert "moves 21 to 39, lines 31 to 49: righty" in finding.message


def test_a_place_that_no_configuration_comes_to_is_told_as_such():
    arm = dataclasses.replace(
        ARM,
        joints=(*ARM.joints[:4], dataclasses.replace(ARM.joints[4], lowest_deg=-20.0, highest_deg=20.0), ARM.joints[5]),
    )
    findings = downward(circled((500.0, 0.0, -150.0), 40.0, 20), np.arange(20) == 0, arm)
    assert any(
        "no configuration of the arm comes here within its joint limits" in f.message for f in told(findings, 666)
    )


def test_a_built_in_spindle_is_not_checked_but_its_tool_must_lie_on_it():
    arm = load_arm("rx170")
    joints = moved({6: 0}, {6: 200}, {6: 400})
    findings = findings_of(arm, joints, asked=FORWARD)
    assert not told(findings, 665)
    assert "not checked: joint 6, which is the spindle; sources differ on joints 3 to 5" in findings[-1].message
    (limit,) = told(findings_of(arm, moved({3: 129}, {3: 131}), asked=FORWARD), 665)
    assert limit.message.endswith("give those of your robot in a file")
    tilted = pose_from_six((0.0, 0.0, 150.0, 0.0, 30.0, 0.0))
    (finding,) = told(findings_of(arm, joints, asked=FORWARD, tool=tilted), 666)
    assert finding.level is Level.FAIL
    assert "is its spindle" in finding.message


def test_unknown_limits_are_told_and_not_checked():
    arm = dataclasses.replace(
        ARM,
        joints=(*ARM.joints[:5], dataclasses.replace(ARM.joints[5], lowest_deg=-math.inf, highest_deg=math.inf)),
    )
    findings = findings_of(arm, moved({6: -260}, {6: -100}, {6: 70}, {6: 240}, {6: 400}), asked=FORWARD)
    assert not told(findings, 665)
    assert findings[-1].message.endswith("not checked: the limits of joint 6")


def test_places_between_lie_on_the_straight_way_and_turn_evenly():
    tips = np.array([[0.0, 0, 0], [100.0, 0, 0]])
    R = np.array([np.eye(3), [[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]])
    places = places_along(tips, R, np.array([0.0, 50.0]), np.zeros(2, bool), np.eye(4), step_mm=20.0, step_deg=9.0)
    assert places.move.tolist() == [0] + [1] * 10
    np.testing.assert_allclose(places.places_mm[1:, 0], np.arange(1, 11) * 10.0)
    angles = np.degrees(np.arctan2(places.R[:, 1, 0], places.R[:, 0, 0]))
    np.testing.assert_allclose(angles, np.arange(11) * 9.0, atol=1e-9)
    np.testing.assert_allclose(places.seconds[1:], 10.0 / 50.0)
    assert np.isnan(places.seconds[0])


def test_there_are_never_too_many_places():
    tips = np.zeros((1001, 3))
    tips[1::2, 0] = 1e5
    places = places_along(
        tips,
        np.tile(np.eye(3), (1001, 1, 1)),
        np.ones(1001),
        np.zeros(1001, bool),
        np.eye(4),
        step_mm=1.0,
        step_deg=1.0,
    )
    assert len(places.move) < 400_000
    assert places.apart_mm > 100.0, "told to the operator"


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 12),
    st.sampled_from(["rx170", "tx2-60", "tx90xl"]),
    st.sampled_from([(), FORWARD, ("righty",)]),
)
def test_any_path_is_judged_without_stumbling(seed, count, name, asked):
    rng = np.random.default_rng(seed)
    tips = rng.uniform(-900.0, 900.0, (count, 3)) * rng.choice([0.0, 0.1, 1.0])
    R = Rotation.random(count, rng=rng).as_matrix()
    rapid = rng.random(count) < 0.3
    path = path_of(tips, -R[:, :, 2], np.where(rapid, 0.0, 600.0), rapid)
    findings = arm_findings(path, tips, R, rng.uniform(0.0, 50.0, count), TOOL, load_arm(name), asked=asked)
    failed = {f.code for f in findings if f.level is Level.FAIL}
    assert (664 in failed or 665 in failed) <= (666 in failed or 664 in failed), "what fails is explained"
    assert all("nan" not in f.message and "inf" not in f.message.split() for f in findings)
