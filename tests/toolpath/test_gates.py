"""What holds for all gates: their names and limits, overrides, and how a broken one is told."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from sicp_cam.toolpath.gates import GATE_NAMES, Gate, at_least, at_most, largest, overridden, value_and_limit
from sicp_cam.toolpath.settings import GateLimits

BROKEN = (Gate("coverage", 0.2, 0.5, "fail", ""), Gate("residual_mm", 0.1, 0.5, "ok", ""),
          Gate("jump_mm", 2.0, 0.5, "fail", ""))  # fmt: skip


def test_every_gate_has_a_limit_and_every_limit_a_gate():
    assert sorted(GATE_NAMES) == sorted(field.name for field in fields(GateLimits))


@pytest.mark.parametrize(("value", "most", "least"), [(0.5, "ok", "ok"), (0.4, "ok", "fail"), (0.6, "fail", "ok")])
def test_a_limit_itself_passes(value, most, least):
    assert (at_most("a", value, 0.5, "").state, at_least("a", value, 0.5, "").state) == (most, least)


@pytest.mark.parametrize(("value", "limit"), [(math.nan, 0.5), (0.5, math.nan), (math.nan, math.nan)])
def test_what_is_no_number_lets_nothing_pass(value, limit):
    assert at_most("a", value, limit, "").state == at_least("a", value, limit, "").state == "fail"


@pytest.mark.parametrize("values", [[math.nan, 1.0], [1.0, math.nan]])
def test_the_largest_of_values_is_not_known_if_one_is_not(values):
    assert math.isnan(largest(values))


def test_only_the_named_gates_that_failed_are_overridden():
    states = [gate.state for gate in overridden(BROKEN, ["coverage", "residual_mm"])]
    assert states == ["overridden", "ok", "fail"]
    assert [gate.state for gate in overridden(BROKEN, [])] == ["fail", "ok", "fail"]
    assert overridden(BROKEN, ["coverage"])[0] == replace(BROKEN[0], state="overridden")


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.23456, "1.235, limit 0.5"), (np.inf, "could not be measured, limit 0.5"),
     (np.nan, "could not be measured, limit 0.5")],
)  # fmt: skip
def test_a_value_that_could_not_be_measured_is_told_as_that(value, text):
    assert value_and_limit(at_most("jump_mm", value, 0.5, "")) == text
