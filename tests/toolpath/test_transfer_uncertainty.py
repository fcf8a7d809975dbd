"""The uncertainty of each move: that of the contour where the move meets it."""

from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.model import Status


def stating(made, nominal, normal_u_mm, out_u_mm=0.0, covered=None, number=1):
    k = len(nominal)
    u = {"normal_u_mm": np.broadcast_to(normal_u_mm, k) * 1.0, "out_u_mm": np.broadcast_to(out_u_mm, k) * 1.0}
    return replace(made.registered(nominal, nominal, covered, number), **u)


def along(x, beside=0.0):
    x = np.asarray(x, float)
    return np.stack([x, np.full_like(x, beside), 0 * x], 1)


def test_it_is_the_hypotenuse_of_both_parts_between_stations(made):
    nominal = made.straight(step_mm=2.0)
    contour = stating(made, nominal, 0.03 * nominal.s_mm, 0.04 * nominal.s_mm)
    x = np.array([0.0, 0.5, 37.3, 100.0, 199.9, 200.0])
    done = made.corrected(made.path(along(x, beside=-3.0)), [contour])
    np.testing.assert_allclose(done.u_mm[~done.added], 0.05 * x, atol=1e-12)
    assert len(done.u_mm) == len(done.corrected)


def test_added_points_have_their_own(made):
    """A move that must bend gets points in between; each has the uncertainty of its own place."""
    nominal = made.straight(step_mm=1.0)
    contour = replace(stating(made, nominal, 0.01 * nominal.s_mm), corrected=made.rolled(nominal, 300.0))
    done = made.corrected(made.path(along([10.0, 90.0])), [contour])
    assert done.added.sum() > 10
    np.testing.assert_allclose(done.u_mm, 0.01 * done.nominal.tips_mm[:, 0], atol=1e-12)


def test_over_the_seam_of_a_loop_it_runs_from_the_last_station_to_the_first(made):
    nominal = made.hole(100.0, count=40)
    u_mm = np.full(40, 0.1)
    u_mm[0] = 0.5
    seam = 0.25 * nominal.points_mm[-1] + 0.75 * nominal.points_mm[0]
    tips = np.stack([nominal.points_mm[0], seam, nominal.points_mm[-1], nominal.points_mm[20]])
    done = made.corrected(made.path(tips), [stating(made, nominal, u_mm)], step_mm=1e3)
    np.testing.assert_allclose(done.u_mm[~done.added], [0.5, 0.4, 0.1, 0.1], atol=1e-9)


def test_moves_off_the_contour_have_none(made):
    nominal = made.straight()
    tips = [[10.0, 0.0, 80.0], [10.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 0.0, 80.0]]
    done = made.corrected(
        made.path(tips, rapid=[0]), [stating(made, nominal, 0.3, 0.4)], distance_mm=[80.0, 0.0, 0.0, 80.0]
    )
    off = np.array([status is Status.APPROACH for status in done.status])
    assert off.tolist() == [True, False, False, True]
    np.testing.assert_array_equal(np.isnan(done.u_mm), off)
    np.testing.assert_allclose(done.u_mm[~off], 0.5)


def test_a_bridged_cut_has_that_of_the_gap(made):
    nominal = made.straight(step_mm=1.0)
    covered = np.abs(nominal.s_mm - 100.0) > 30.0
    done = made.corrected(
        made.path(along([20.0, 100.0, 180.0])), [stating(made, nominal, np.where(covered, 0.1, 0.7), covered=covered)]
    )
    assert [status.value for status in done.status] == ["covered", "bridged", "covered"]
    np.testing.assert_allclose(done.u_mm, [0.1, 0.7, 0.1])


def test_each_move_has_that_of_the_contour_it_follows_and_none_where_that_states_none(made):
    holes = [made.hole(20.0, centre=(0.0, 0.0)), made.hole(20.0, centre=(300.0, 0.0))]
    first = stating(made, holes[0], 0.2)
    tips = np.stack([holes[0].points_mm[0], holes[0].points_mm[1], holes[1].points_mm[0], holes[1].points_mm[1]])
    follows, tool_path = [0, 0, 1, 1], made.path(tips, rapid=[2])
    done = made.corrected(tool_path, [first, stating(made, holes[1], 0.6, number=2)], follows=follows)
    np.testing.assert_allclose(done.u_mm, [0.2, 0.2, np.nan, 0.6])
    done = made.corrected(tool_path, [first, made.registered(holes[1], holes[1], number=2)], follows=follows)
    np.testing.assert_allclose(done.u_mm, [0.2, 0.2, np.nan, np.nan])


def test_where_no_contour_states_one_there_is_no_column_at_all(made):
    nominal = made.straight()
    assert made.corrected(made.path(along([10.0, 20.0])), [made.registered(nominal, nominal)]).u_mm is None


@pytest.mark.parametrize("known", ["normal_u_mm", "out_u_mm"])
def test_half_a_statement_is_none(made, known):
    nominal = made.straight()
    contour = replace(made.registered(nominal, nominal), **{known: np.ones(len(nominal))})
    assert made.corrected(made.path(along([10.0, 20.0])), [contour]).u_mm is None
