from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.registration.result import Residuals
from sicp_cam.report.statistics import all_contours, both, residual_summary, share_within, summary

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
