from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.registration.result import LeaveOut, Residuals
from sicp_cam.report.statistics import (
    all_contours,
    both,
    leave_out_summary,
    residual_summary,
    share_within,
    summary,
    uncertainty_summary,
)

numbers = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=50)


def test_summary_of_known_values() -> None:
    assert summary([1.0, -3.0]) == pytest.approx({"mean": -1.0, "sd": 2.0, "rms": np.sqrt(5.0), "p95": 2.9, "max": 3.0})


def test_percentile_is_of_the_size_not_of_the_signed_value() -> None:
    found = summary(-np.arange(101.0))
    assert found is not None
    assert (found["p95"], found["max"], found["mean"]) == (95.0, 100.0, -50.0)


def test_nothing_measured_gives_none() -> None:
    assert summary([]) is None
    assert summary([np.nan, np.nan]) is None
    assert share_within([np.nan], 1.0) is None


def test_infinity_is_refused() -> None:
    with pytest.raises(ValueError, match="infinite"):
        summary([1.0, np.inf])


@settings(deadline=None, max_examples=60)
@given(numbers)
def test_rms_is_mean_and_sd_together_and_nan_does_not_count(values: list[float]) -> None:
    found = summary(values)
    assert found is not None
    assert found["rms"] ** 2 == pytest.approx(found["mean"] ** 2 + found["sd"] ** 2, rel=1e-9, abs=1e-9)
    assert found["p95"] <= found["max"]
    assert summary([np.nan, *reversed(values), np.nan]) == pytest.approx(found, rel=1e-9, abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(numbers)
def test_mirrored_residuals_change_the_sign_of_the_mean_only(values: list[float]) -> None:
    found, mirrored = summary(values), summary([-v for v in values])
    assert found is not None
    assert mirrored == pytest.approx(found | {"mean": -found["mean"]}, rel=1e-12, abs=1e-12)


def test_residuals_count_only_where_covered() -> None:
    residuals = Residuals(np.array([3.0, 99.0, np.nan]), np.array([-4.0, 99.0, 1.0]))
    found = residual_summary(residuals, np.array([True, False, True]))
    assert found["normal"] is not None
    assert found["out"] is not None
    assert found["both"] is not None
    assert (found["normal"]["mean"], found["out"]["mean"], found["both"]["max"]) == (3.0, -1.5, 5.0)


def test_both_is_the_distance_across() -> None:
    assert both(Residuals(np.array([3.0, np.nan]), np.array([-4.0, 0.0]))).tolist()[0] == 5.0


def test_contours_are_joined_in_order(job) -> None:
    other = job.with_contour(number=2, covered=~job.contour.covered)
    before, after, covered = all_contours((job.contour, other))
    count = len(job.contour.covered)
    assert len(before.normal_mm) == len(after.out_mm) == len(covered) == 2 * count
    assert covered[:count].tolist() == job.contour.covered.tolist()
    assert covered[count:].tolist() == (~job.contour.covered).tolist()


def test_no_contours_give_empty_arrays() -> None:
    before, _, covered = all_contours(())
    assert residual_summary(before, covered) == {"normal": None, "out": None, "both": None}


def stating(job, normal, out, covered=None, leave_out=None):
    """Return the contour of the job with an uncertainty at a few stations."""
    seen = np.ones(len(normal), bool) if covered is None else np.array(covered, bool)
    u = {"normal_u_mm": np.array(normal, float), "out_u_mm": np.array(out, float)}
    return job.with_contour(covered=seen, leave_out=leave_out, **u)


def spread(mean: float, largest: float) -> dict[str, float]:
    return pytest.approx({"mean_mm": mean, "max_mm": largest})


def test_the_uncertainty_is_told_where_the_scan_shows_the_edge_and_in_gaps(job) -> None:
    found = uncertainty_summary([stating(job, [3.0, 6.0, 30.0], [4.0, 8.0, 40.0], [1, 1, 0])])
    assert found is not None
    bridged = found.pop("bridged")
    parts = {"normal": spread(4.5, 6.0), "out": spread(6.0, 8.0)}
    assert {name: found.pop(name) for name in parts} == parts
    assert found == spread(7.5, 10.0)
    assert {name: bridged.pop(name) for name in parts} == {"normal": spread(30.0, 30.0), "out": spread(40.0, 40.0)}
    assert bridged == spread(50.0, 50.0)


def test_the_largest_uncertainty_is_that_of_one_place_not_of_two(job) -> None:
    found = uncertainty_summary([stating(job, [3.0, 4.0], [4.0, 3.0])])
    assert found is not None
    assert (found["max_mm"], found["bridged"]) == (pytest.approx(5.0), None)


def test_all_contours_count_for_the_uncertainty(job) -> None:
    one, other = stating(job, [1.0, 1.0], [0.0, 0.0], [1, 0]), stating(job, [2.0], [0.0])
    found = uncertainty_summary([one, other])
    assert found is not None
    assert (found["mean_mm"], found["max_mm"], found["bridged"]["max_mm"]) == (1.5, 2.0, 1.0)


def test_a_contour_that_states_none_leaves_all_without(job) -> None:
    silent = job.with_contour(normal_u_mm=None, out_u_mm=None, leave_out=None)
    assert uncertainty_summary([silent]) is None
    assert uncertainty_summary([job.contour, silent]) is None
    assert leave_out_summary([silent]) is None
    assert leave_out_summary([job.contour, silent]) is None
    assert uncertainty_summary([]) is None and leave_out_summary([]) is None


@pytest.mark.parametrize("unknown", [np.nan, np.inf])
def test_one_value_that_is_not_known_may_be_the_largest(job, unknown: float) -> None:
    found = uncertainty_summary([stating(job, [1.0, unknown], [1.0, 1.0])])
    assert found is not None
    assert (found["mean_mm"], found["max_mm"], found["normal"]["max_mm"], found["out"]["max_mm"]) == (
        None,
        None,
        None,
        1,
    )
    assert leave_out_summary([stating(job, [1.0], [1.0], leave_out=LeaveOut(unknown, 0.0))]) == dict.fromkeys(
        ("normal", "out", "both")
    )


def test_a_contour_that_the_scan_does_not_show_has_no_uncertainty_but_that_of_its_gap(job) -> None:
    found = uncertainty_summary([stating(job, [3.0], [4.0], [0])])
    assert found is not None
    assert (found["mean_mm"], found["max_mm"], found["bridged"]["max_mm"]) == (None, None, 5.0)


def test_leave_out_is_that_of_the_worst_contour(job) -> None:
    small, large = LeaveOut(0.5, 0.0), LeaveOut(0.3, 0.6)
    found = leave_out_summary([stating(job, [1.0], [1.0], leave_out=halves) for halves in (small, large, small)])
    assert found == {"normal": 0.3, "out": 0.6, "both": pytest.approx(np.hypot(0.3, 0.6))}
