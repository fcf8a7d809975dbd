"""Forward and inverse kinematics of arms against closed cases, a recorded pair, and another way to compute them."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_postprocessors.arm import CONFIGURATIONS, Configuration, arm_names, forward, inverse, load_arm
from sicp_postprocessors.orientations import rotation_matrices


def odd_arm():
    """An arm with an offset forearm whose controller counts the other way, from elsewhere, with its world below."""
    arm = load_arm("rx160")
    counts = zip(arm.joints, (-1, 1, 1, -1, 1, -1), (0.0, -90.0, 90.0, 0.0, 0.0, 180.0), strict=True)
    joints = tuple(dataclasses.replace(j, sign=s, straight_up_deg=zero) for j, s, zero in counts)
    return dataclasses.replace(
        arm, name="odd", forearm_offset_mm=-115.0, elbow_side_mm=30.0, world="base_plate", joints=joints
    )


ARMS = [*map(load_arm, arm_names()), odd_arm()]


def chained(arm, joints_deg):
    """Return the pose (4, 4) of the flange as a chain of frames, one joint after the other."""
    signs = [joint.sign for joint in arm.joints]
    model = np.radians((np.array(joints_deg) - [j.straight_up_deg for j in arm.joints]) * signs)
    origins = [
        (0, 0, arm.shoulder_in_world_mm),
        (arm.shoulder_forward_mm, 0, 0),
        (0, arm.elbow_side_mm, arm.upper_arm_mm),
        (arm.forearm_offset_mm, 0, 0),
        (0, 0, arm.forearm_mm),
        (0, 0, 0),
    ]
    pose = np.eye(4)
    for origin, axis, angle in zip(origins, "zyyzyz", model, strict=True):
        step = np.eye(4)
        step[:3, 3] = origin
        step[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
        pose = pose @ step
    pose[:3, 3] += arm.flange_mm * pose[:3, 2]
    return pose


@pytest.mark.parametrize(
    ("joints_deg", "place_mm", "flange_z"),
    [
        ((0, 0, 0, 0, 0, 0), (50, 50, 425 + 425 + 100), (0, 0, 1)),
        ((0, 90, 0, 0, 0, 0), (50 + 850 + 100, 50, 0), (1, 0, 0)),
        ((90, 90, 0, 0, 0, 0), (-50, 50 + 950, 0), (0, 1, 0)),
        ((0, 0, 90, 0, 0, 0), (50 + 425 + 100, 50, 425), (1, 0, 0)),
        ((0, 0, 90, 0, 90, 0), (50 + 425, 50, 425 - 100), (0, 0, -1)),
        ((0, 0, 90, 90, 90, 0), (50 + 425, 50 + 100, 425), (0, 1, 0)),
    ],
)
def test_the_flange_is_where_the_links_add_up(joints_deg, place_mm, flange_z):
    R, places = forward(load_arm("tx2-90"), np.array([joints_deg], dtype=float))
    np.testing.assert_allclose(places[0], place_mm, atol=1e-9)
    np.testing.assert_allclose(R[0, :, 2], flange_z, atol=1e-12)


def test_a_joint_and_a_point_recorded_for_one_place_of_a_tx90_agree():
    # github.com/ThenesVara/Checkers_Staubli, AA_Chessie.dtx: jCaseNoire, pCaseNoire[0], tTool
    joints = [-7.236149, 83.896154, 110.243942, 0.0, -14.140096, 172.763851]
    tool_mm = np.array([2.67332365613152, 0.0823457375943404, 50.1043771229301])
    R, places = forward(load_arm("tx90"), np.array([joints]))
    np.testing.assert_allclose(places[0] + R[0] @ tool_mm, [374.8, 3.07, -517.036829], atol=1e-4)
    np.testing.assert_allclose(R[0], rotation_matrices(np.array([[-180.0, 0.0, 0.0]]))[0], atol=1e-7)


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_the_flange_is_where_a_chain_of_frames_puts_it(arm):
    joints = np.random.default_rng(3).uniform(-180, 180, (20, 6))
    R, places = forward(arm, joints)
    for row, joint in enumerate(joints):
        pose = chained(arm, joint)
        np.testing.assert_allclose(places[row], pose[:3, 3], atol=1e-9)
        np.testing.assert_allclose(R[row], pose[:3, :3], atol=1e-12)


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_joints_found_in_each_configuration_bring_the_flange_back(arm):
    joints = np.random.default_rng(7).uniform(-180, 180, (4000, 6))
    R, places = forward(arm, joints)
    found = np.zeros(len(joints), int)
    for configuration in CONFIGURATIONS:
        solution = inverse(arm, R, places, configuration)
        reached = solution.reachable
        R_back, places_back = forward(arm, solution.joints_deg[reached])
        assert np.abs(places_back - places[reached]).max() <= 1e-9
        assert np.abs(R_back - R[reached]).max() <= 1e-12
        assert ((solution.shoulder_mm[reached] >= 0) == (configuration.shoulder == "lefty")).all()
        assert ((solution.elbow_deg[reached] >= 0) == (configuration.elbow == "epositive")).all()
        assert ((solution.wrist_deg[reached] >= 0) == (configuration.wrist == "wpositive")).all()
        found += np.abs(np.remainder(solution.joints_deg - joints + 180.0, 360.0) - 180.0).max(axis=1) < 1e-5
    assert (found == 1).all(), "each pose is reached by the joints it was made from, in one configuration"


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(ARMS),
    st.sampled_from(CONFIGURATIONS),
    st.tuples(*[st.sampled_from([-180.0, -90.0, 0.0, 30.0, 90.0, 180.0])] * 6),
)
def test_singular_poses_are_brought_back_too(arm, configuration, joints):
    R, places = forward(arm, np.array([joints]))
    solution = inverse(arm, R, places, configuration)
    if solution.reachable[0]:
        R_back, places_back = forward(arm, solution.joints_deg)
        np.testing.assert_allclose(places_back, places, atol=1e-6)
        np.testing.assert_allclose(R_back, R, atol=1e-9)


@pytest.mark.parametrize(
    ("joints_deg", "words"),
    [
        ((0, 30, 60, 0, 45, 0), ("lefty", "epositive", "wpositive")),
        ((0, 60, -30, 0, 45, 0), ("lefty", "enegative", "wpositive")),
        ((0, 30, 60, 0, -45, 0), ("lefty", "epositive", "wnegative")),
        ((180, -30, -60, 0, -45, 0), ("righty", "enegative", "wnegative")),
    ],
)
def test_configurations_are_called_as_val3_does(joints_deg, words):
    arm = load_arm("tx2-90")
    R, places = forward(arm, np.array([joints_deg], dtype=float))
    solution = inverse(arm, R, places, Configuration(*words))
    turns = np.remainder(solution.joints_deg[0] - joints_deg + 180.0, 360.0) - 180.0
    np.testing.assert_allclose(turns, 0.0, atol=1e-9)


@pytest.mark.parametrize(("over_mm", "reachable"), [(-0.001, True), (0.0, True), (0.5, False), (40.0, False)])
def test_the_reach_is_the_sum_of_the_links(over_mm, reachable):
    arm = load_arm("tx2-90")
    place = np.array([[50.0 + 850.0 + 100.0 + over_mm, 50.0, 0.0]])
    R = Rotation.from_euler("y", 90, degrees=True).as_matrix()[None]
    solution = inverse(arm, R, place, CONFIGURATIONS[0])
    assert solution.reachable[0] == reachable
    assert solution.beyond_mm[0] == pytest.approx(max(over_mm, 0.0), abs=1e-6)
    bend_deg = 2.0 * math.degrees(math.acos(min((850.0 + over_mm) / 850.0, 1.0)))
    assert solution.elbow_deg[0] == pytest.approx(bend_deg, abs=1e-6)


def test_the_reach_of_unequal_links_has_an_inner_end():
    arm = load_arm("rx160")
    assert arm.wrist_reach_mm == (200.0, 1450.0)
    inside = np.array([[150.0 + 199.0, 0.0, 110.0]])
    solution = inverse(arm, np.eye(3)[None], inside, CONFIGURATIONS[0])
    assert solution.beyond_mm[0] == pytest.approx(1.0)


def test_nothing_is_reached_nearer_to_axis_1_than_the_forearm_lies_beside_it():
    arm = load_arm("tx2-90")
    solution = inverse(arm, np.eye(3)[None], np.array([[30.0, 0.0, 300.0]]), CONFIGURATIONS[0])
    assert solution.beyond_mm[0] == pytest.approx(20.0)


def test_a_world_on_the_base_plate_lies_lower():
    arm = dataclasses.replace(load_arm("tx2-90"), world="base_plate")
    _, places = forward(arm, np.zeros((1, 6)))
    np.testing.assert_allclose(places[0], (50, 50, 478 + 950))


def test_joints_are_counted_from_where_and_which_way_the_controller_does():
    arm = odd_arm()
    counts = [joint.straight_up_deg for joint in arm.joints]
    R, places = forward(arm, np.array([counts]))
    np.testing.assert_allclose(R[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(places[0], (150 - 115, 30, 550 + 825 + 625 + 110))
    turned = np.array(counts)
    turned[0] += 90.0  # counts the other way
    _, places = forward(arm, turned[None])
    np.testing.assert_allclose(places[0, :2], (30, -35), atol=1e-9)
    assert math.isclose(inverse(arm, R, places, CONFIGURATIONS[0]).joints_deg[0, 0], 90.0, abs_tol=1e-9)
