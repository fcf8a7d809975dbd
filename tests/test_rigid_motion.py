import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam import rigid_motion

ANGLES = st.floats(-3.0, 3.0)
SHIFTS = st.floats(-1e4, 1e4)
MOTIONS = st.builds(
    lambda turn, shift: rigid_motion.from_parts(Rotation.from_rotvec(turn).as_matrix(), shift),
    st.tuples(ANGLES, ANGLES, ANGLES),
    st.tuples(SHIFTS, SHIFTS, SHIFTS),
)
SEEDS = st.integers(0, 2**32 - 1)


def cloud(seed, count=30):
    return np.random.default_rng(seed).uniform(-500, 500, (count, 3))


@settings(deadline=None, max_examples=60)
@given(MOTIONS, SEEDS)
def test_the_inverse_undoes_a_motion_of_points_and_of_directions(T, seed):
    points = cloud(seed)
    back = rigid_motion.inverse(T)
    np.testing.assert_allclose(rigid_motion.apply(back, rigid_motion.apply(T, points)), points, atol=1e-8)
    np.testing.assert_allclose(rigid_motion.rotate(back, rigid_motion.rotate(T, points)), points, atol=1e-9)


@settings(deadline=None, max_examples=60)
@given(MOTIONS, MOTIONS, SEEDS)
def test_the_product_of_two_motions_is_one_after_the_other(T_c_b, T_b_a, seed):
    points = cloud(seed)
    in_two_steps = rigid_motion.apply(T_c_b, rigid_motion.apply(T_b_a, points))
    np.testing.assert_allclose(rigid_motion.apply(T_c_b @ T_b_a, points), in_two_steps, atol=1e-7)


@settings(deadline=None, max_examples=60)
@given(MOTIONS, SEEDS)
def test_the_best_fit_of_moved_points_is_their_motion(T, seed):
    points = cloud(seed)
    np.testing.assert_allclose(rigid_motion.best_fit(points, rigid_motion.apply(T, points)), T, atol=1e-7)


def test_the_best_fit_of_mirrored_points_is_no_mirror():
    points = cloud(1)
    fit = rigid_motion.best_fit(points, points * [1, 1, -1])
    assert rigid_motion.is_rigid(fit)


def test_points_of_no_weight_do_not_count():
    T = rigid_motion.from_parts(np.eye(3), [1.0, 2.0, 3.0])
    points = cloud(2)
    target = rigid_motion.apply(T, points)
    target[0] += 1000.0
    weights = np.ones(len(points))
    weights[0] = 0.0
    np.testing.assert_allclose(rigid_motion.best_fit(points, target, weights), T, atol=1e-9)


def test_the_best_fit_of_points_in_one_plane_is_found_too():
    points = cloud(3) * [1, 1, 0]
    T = rigid_motion.from_parts(Rotation.from_euler("xyz", [0.3, -0.2, 2.0]).as_matrix(), [5, 6, 7])
    np.testing.assert_allclose(rigid_motion.best_fit(points, rigid_motion.apply(T, points)), T, atol=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.tuples(ANGLES, ANGLES, ANGLES), st.tuples(SHIFTS, SHIFTS, SHIFTS), SEEDS)
def test_a_twist_turns_about_its_centre_and_then_shifts(turn, shift, seed):
    centre = cloud(seed, 1)[0]
    T = rigid_motion.exponential(np.array([*turn, *shift]), centre)
    assert rigid_motion.is_rigid(T)
    np.testing.assert_allclose(rigid_motion.apply(T, centre[None])[0], centre + shift, atol=1e-7)
    np.testing.assert_allclose(T[:3, :3], Rotation.from_rotvec(turn).as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([2.0, 2.0, 2.0, 1.0]),
        np.diag([1.0, 1.0, 1.0, 2.0]),
        np.full((4, 4), np.nan),
        np.eye(3),
        np.eye(4) + np.eye(4, k=1) * 1e-3,
    ],
    ids=["mirror", "scale", "last row", "nan", "shape", "shear"],
)
def test_what_is_no_rigid_motion_is_told(wrong):
    assert not rigid_motion.is_rigid(wrong)
    assert rigid_motion.is_rigid(np.eye(4))
