import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.registration.gauss_newton import Rows, freedoms, motion_step, motion_steps, stacked, tukey
from sicp_cam.rigid_motion import apply, exponential, from_parts

UP = np.array([0.0, 0.0, 1.0])


def rows_to(points, targets, weights=None):
    """Return equations for all three components of each point."""
    w = np.ones(len(points)) if weights is None else weights
    return stacked(*(Rows(points, np.tile(axis, (len(points), 1)), (targets - points) @ axis, w) for axis in np.eye(3)))


def plane_rows(points, heights):
    return Rows(points, np.tile(UP, (len(points), 1)), heights, np.ones(len(points)))


def circle_rows(radius=50.0, count=200):
    """Return the two components across the travel of a circle about z."""
    a = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radial = np.stack([np.cos(a), np.sin(a), np.zeros(count)], axis=1)
    nothing, one = np.zeros(count), np.ones(count)
    upright = np.tile(UP, (count, 1))
    return stacked(Rows(radius * radial, radial, nothing, one), Rows(radius * radial, upright, nothing, one))


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    turn=st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    shift=st.tuples(*[st.floats(-5, 5)] * 3),
)
def test_a_motion_is_recovered_to_rounding(seed, turn, shift):
    points = np.random.default_rng(seed).uniform(-100.0, 100.0, (30, 3)) + 500.0
    wanted = exponential(np.array([*turn, *shift]), points.mean(axis=0))
    targets, T = apply(wanted, points), np.eye(4)
    for _ in range(8):
        T = motion_step(rows_to(apply(T, points), targets), 0.0) @ T
    np.testing.assert_allclose(apply(T, points), targets, atol=1e-9)
    np.testing.assert_allclose(T, wanted, atol=1e-9)


def test_weights_decide_which_of_two_truths_is_followed():
    points = np.random.default_rng(0).uniform(-100.0, 100.0, (40, 3))
    right, wrong = points + np.array([1.0, 2.0, 3.0]), points + 50.0
    rows = stacked(rows_to(points, right), rows_to(points, wrong, np.zeros(len(points))))
    np.testing.assert_allclose(motion_step(rows, 0.0), from_parts(np.eye(3), [1.0, 2.0, 3.0]), atol=1e-9)


def test_equations_without_a_residual_do_no_harm_if_they_weigh_nothing():
    points = np.random.default_rng(1).uniform(-100.0, 100.0, (40, 3))
    unseen = Rows(points, np.tile(UP, (40, 1)), np.full(40, np.nan), np.zeros(40))
    step = motion_step(stacked(rows_to(points, points + UP), unseen), 1e-6)
    np.testing.assert_allclose(step[:3, 3], UP, atol=1e-4)


def test_the_prior_holds_the_freedoms_that_the_equations_leave_open():
    points = np.column_stack([np.random.default_rng(2).uniform(-100, 100, (60, 2)), np.zeros(60)])
    step = motion_step(plane_rows(points, np.full(60, 2.0)), 1e-6)
    np.testing.assert_allclose(step, from_parts(np.eye(3), [0.0, 0.0, 2.0]), atol=1e-5)


def test_the_prior_draws_the_open_freedoms_to_where_it_wants_them_and_no_other():
    points = np.column_stack([np.random.default_rng(3).uniform(-100, 100, (60, 2)), np.zeros(60)])
    wanted = from_parts(Rotation.from_rotvec([0.0, 0.0, 0.02]).as_matrix(), [3.0, -4.0, 7.0])
    (step,) = motion_steps(plane_rows(points, np.full(60, 2.0)), np.zeros(60, dtype=int), 1e-6, wanted[None])
    centre = points.mean(axis=0)
    np.testing.assert_allclose(step @ [*centre, 1.0], [*(wanted @ [*centre, 1.0])[:2], 2.0, 1.0], atol=1e-3)
    np.testing.assert_allclose(Rotation.from_matrix(step[:3, :3]).as_rotvec(), [0.0, 0.0, 0.02], atol=1e-6)


def test_the_groups_of_a_stack_are_solved_each_for_itself():
    rng, parts, group, towards = np.random.default_rng(4), [], [], []
    for i in range(5):
        points = rng.uniform(-50.0, 50.0, (20 + i, 3)) + 100.0 * i
        wanted = exponential(rng.normal(0.0, [0.01] * 3 + [1.0] * 3), points.mean(axis=0))
        parts.append(rows_to(points, apply(wanted, points), rng.uniform(0.5, 1.0, len(points))))
        group.append(np.full(3 * len(points), i))
        towards.append(exponential(rng.normal(0.0, [0.01] * 3 + [1.0] * 3), points.mean(axis=0)))
    shuffled = rng.permutation(sum(len(g) for g in group))
    rows, of = stacked(*parts), np.concatenate(group)[shuffled]
    mixed = Rows(*(getattr(rows, name)[shuffled] for name in Rows.__slots__))
    together = motion_steps(mixed, of, 0.1, np.stack(towards))
    for i, (part, T) in enumerate(zip(parts, towards, strict=True)):
        (alone,) = motion_steps(part, np.zeros(len(part.weights), dtype=int), 0.1, T[None])
        np.testing.assert_allclose(together[i], alone, atol=1e-9)


def test_a_group_without_weight_stays_where_it_is_whatever_the_prior_wants():
    points = np.random.default_rng(5).uniform(-50.0, 50.0, (20, 3))
    rows = stacked(rows_to(points, points + UP), rows_to(points, points + UP, np.zeros(20)))
    away = np.tile(from_parts(np.eye(3), [9.0, 0.0, 0.0]), (2, 1, 1))
    steps = motion_steps(rows, np.repeat([0, 1], 60), 0.1, away)
    np.testing.assert_array_equal(steps[1], np.eye(4))
    assert steps[0][0, 3] > 0.5


def test_a_circle_leaves_the_rotation_about_its_axis_open():
    values, twists = freedoms(circle_rows())
    assert values[-1] < 1e-6
    assert values[-2] > 0.3
    assert abs(twists[-1][2]) == pytest.approx(1.0, abs=1e-6)
    assert (np.diff(values) <= 0.0).all()


def test_a_plane_leaves_three_freedoms_open_and_a_solid_none():
    grid = np.stack(np.meshgrid([-50.0, 0, 50], [-50.0, 0, 50]), axis=-1).reshape(-1, 2)
    flat, _ = freedoms(plane_rows(np.column_stack([grid, np.zeros(9)]), np.zeros(9)))
    assert (flat < 1e-6).sum() == 3
    cube = np.stack(np.meshgrid([-50.0, 50], [-50.0, 50], [-50.0, 50]), axis=-1).reshape(-1, 3)
    solid, twists = freedoms(rows_to(cube, cube))
    assert solid.min() > 0.4
    assert solid.max() <= 1.0
    np.testing.assert_allclose(twists @ twists.T, np.eye(6), atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(scale=st.floats(1e-3, 1e3), shift=st.floats(-1e4, 1e4))
def test_freedoms_depend_on_neither_size_nor_place_nor_weight(scale, shift):
    rows = circle_rows()
    other = Rows(rows.points_mm * scale + shift, rows.directions, rows.residuals_mm, rows.weights * 7.0)
    np.testing.assert_allclose(freedoms(other)[0], freedoms(rows)[0], atol=1e-4)


def test_tukey_gives_one_in_the_middle_and_nothing_beyond_the_scale():
    residuals = np.array([0.0, 1.0, -1.0, 2.0, -2.5, np.nan, np.inf])
    np.testing.assert_allclose(tukey(residuals, 2.0), [1.0, 0.5625, 0.5625, 0.0, 0.0, 0.0, 0.0])
