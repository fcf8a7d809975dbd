"""Every gate, just inside of its limit and just outside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import Status
from sicp_cam.registration.result import Registration, Residuals
from sicp_cam.toolpath.gates import GATE_NAMES, Gate, overridden, path_gates, registration_gates
from sicp_cam.toolpath.settings import GateLimits
from sicp_cam.toolpath.transfer import CorrectedPath

LIMITS = GateLimits()


def gate(gates, name):
    (found,) = [gate for gate in gates if gate.name == name]
    return found


def judged(contours, limits, side=None):
    registration = Registration("sicp", np.eye(4), tuple(contours), 2.0, 0.05, np.ones(6), side=side)
    return registration_gates(registration, limits)


def stretched(curve, factor):
    return FramedCurve(
        curve.s_mm, curve.points_mm * factor, curve.tangents, curve.inward, curve.outward, curve.length_mm, curve.closed
    )


def measured(made, *, covered=None, normal=0.0, out=0.0, stretch=1.0):
    nominal = made.hole(count=200)
    contour = made.registered(nominal, stretched(nominal, stretch), covered)
    return replace(contour, after=Residuals(np.full(200, normal), np.full(200, out)))


def before_and_after(made, *, change=(), axes=None, status=None, spacing=1.0):
    """A path along x whose correction at each move is `change` along z."""
    n = max(len(change), 1 if axes is None else len(axes))
    change = np.zeros(n) if not len(change) else np.asarray(change, float)
    tips = np.stack([spacing * np.arange(n), np.zeros(n), np.zeros(n)], 1)
    rigid = made.path(tips)
    moved = made.path(tips + change[:, None] * [0.0, 0.0, 1.0], (0, 0, 1.0) if axes is None else axes)
    words = (Status.COVERED,) * n if status is None else status
    return CorrectedPath(rigid, rigid, moved, words, np.zeros(n, dtype=bool))


def test_every_gate_has_a_name_a_limit_and_an_override(made):
    gates = judged([measured(made)], LIMITS) + path_gates(before_and_after(made), np.zeros(1), LIMITS)
    assert tuple(gate.name for gate in gates) == GATE_NAMES
    assert {name: gate(gates, name).limit for name in GATE_NAMES} == {n: getattr(LIMITS, n) for n in GATE_NAMES}
    assert all(gate.state == "ok" and gate.text for gate in gates)


@pytest.mark.parametrize(("seen", "state"), [(100, "ok"), (99, "fail")])
def test_coverage(made, seen, state):
    found = gate(judged([measured(made, covered=np.arange(200) < seen)], LIMITS), "coverage")
    assert (found.value, found.state) == (seen / 200, state)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("name", "residual", "inside", "outside"),
    [("residual_mm", "out", 0.499, 0.501), ("edge_residual_mm", "normal", 2.999, 3.001)],
)
def test_residuals_of_either_sign(made, name, residual, inside, outside, sign):
    for value, state in ((inside, "ok"), (outside, "fail")):
        found = gate(judged([measured(made, **{residual: sign * value})], LIMITS), name)
        assert found.state == state
        assert found.value == pytest.approx(value)


def test_residuals_that_cancel_do_not_hide(made):
    contour = measured(made)
    contour = replace(contour, after=Residuals(np.zeros(200), np.where(np.arange(200) % 2, 0.6, -0.6)))
    assert gate(judged([contour], LIMITS), "residual_mm").state == "fail"


def test_residuals_are_those_of_the_stations_that_the_scan_shows(made):
    contour = measured(made)
    out = np.full(200, np.nan)
    out[:20] = 0.3
    contour = replace(contour, after=Residuals(np.zeros(200), out))
    assert gate(judged([contour], LIMITS), "residual_mm").value == pytest.approx(0.3)


@pytest.mark.parametrize(("factor", "state"), [(1.0199, "ok"), (1.0201, "fail"), (0.9801, "ok"), (0.9799, "fail")])
def test_stretch_of_either_sign(made, factor, state):
    found = gate(judged([measured(made, stretch=factor)], LIMITS), "stretch")
    assert found.state == state
    assert found.value == pytest.approx(abs(factor - 1.0))


@pytest.mark.parametrize(
    ("side", "state"), [(None, "ok"), (0.1, "ok"), (1.99, "ok"), (2.01, "fail"), (math.nan, "fail")]
)
def test_a_given_pose_that_fits_the_other_side_better(made, side, state):
    assert gate(judged([measured(made)], LIMITS, side), "side").state == state


@pytest.mark.parametrize(("radius", "state"), [(105.99, "ok"), (106.01, "fail"), (94.01, "ok"), (93.99, "fail")])
def test_an_edge_that_moved_within_its_surface(made, radius, state):
    """A hole of radius 100 whose corrected edge is a concentric circle: every station moves by the difference."""
    found = gate(judged([measured(made, stretch=radius / 100.0)], LIMITS), "in_surface_mm")
    assert found.value == pytest.approx(abs(radius - 100.0))
    assert found.state == state


def test_an_edge_that_moved_out_of_its_surface_only(made):
    contour = measured(made)
    lifted = replace(contour.corrected, points_mm=contour.corrected.points_mm + np.array([0.0, 0.0, 9.0]))
    assert gate(judged([replace(contour, corrected=lifted)], LIMITS), "in_surface_mm").value == pytest.approx(0.0)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("coverage", {"covered": np.arange(200) < 20}),
        ("residual_mm", {"out": 0.7}),
        ("edge_residual_mm", {"normal": 4.0}),
        ("stretch", {"stretch": 1.05}),
    ],
)
def test_the_worst_contour_decides(made, name, bad, order):
    contours = [measured(made), measured(made, **bad)][::order]
    gates = judged(contours, LIMITS)
    assert [gate.name for gate in gates if gate.state == "fail"] == [name]


@pytest.mark.parametrize(("distance", "state"), [(19.99, "ok"), (20.01, "fail")])
def test_path_distance_is_the_median(made, distance, state):
    distances = np.array([0.0, distance, 1e4])
    found = gate(path_gates(before_and_after(made), distances, LIMITS), "path_distance_mm")
    assert (found.value, found.state) == (distance, state)


def test_a_path_without_feed_moves_does_not_pass(made):
    found = gate(path_gates(before_and_after(made), np.zeros(0), LIMITS), "path_distance_mm")
    assert (found.value, found.state) == (math.inf, "fail")


@pytest.mark.parametrize(("size", "state"), [(29.99, "ok"), (30.01, "fail"), (-30.01, "fail")])
def test_correction_is_the_largest_one_of_all_moves(made, size, state):
    found = gate(path_gates(before_and_after(made, change=[0.0, size, 1.0]), np.zeros(1), LIMITS), "correction_mm")
    assert found.value == pytest.approx(abs(size))
    assert found.state == state


@pytest.mark.parametrize(("degrees", "state"), [(14.99, "ok"), (15.01, "fail"), (180.0, "fail")])
def test_axis_turn(made, degrees, state):
    a = np.radians(degrees)
    axes = [[0.0, 0.0, 1.0], [np.sin(a), 0.0, np.cos(a)], [0.0, 0.0, 1.0]]
    found = gate(path_gates(before_and_after(made, axes=axes), np.zeros(1), LIMITS), "axis_deg")
    assert found.value == pytest.approx(degrees, abs=1e-6)
    assert found.state == state


@pytest.mark.parametrize(("step", "state"), [(0.599, "ok"), (0.601, "fail"), (-0.601, "fail")])
def test_jump_beyond_what_the_distance_explains(made, step, state):
    """Points 1 mm apart explain 0.1 mm; with the limit of 0.5 a step of 0.6 mm is allowed."""
    found = gate(path_gates(before_and_after(made, change=[0.0, 0.0, step]), np.zeros(1), LIMITS), "jump_mm")
    assert found.value == pytest.approx(abs(step) - 0.1)
    assert found.state == state


def test_a_long_way_explains_a_larger_step(made):
    found = gate(path_gates(before_and_after(made, change=[0.0, 4.0], spacing=50.0), np.zeros(1), LIMITS), "jump_mm")
    assert (found.value, found.state) == (0.0, "ok")


@pytest.mark.parametrize("where", [0, 1])
def test_no_jump_is_seen_where_one_of_both_moves_does_not_cut(made, where):
    status = [Status.COVERED, Status.BRIDGED]
    status[where] = Status.APPROACH
    done = before_and_after(made, change=[0.0, 5.0], status=tuple(status))
    assert gate(path_gates(done, np.zeros(1), LIMITS), "jump_mm").value == 0.0


def test_a_jump_into_a_bridged_stretch_counts(made):
    done = before_and_after(made, change=[0.0, 5.0], status=(Status.COVERED, Status.BRIDGED))
    assert gate(path_gates(done, np.zeros(1), LIMITS), "jump_mm").state == "fail"


# ---- what cannot be measured never passes ----


@pytest.mark.parametrize(("name", "residual"), [("residual_mm", "out"), ("edge_residual_mm", "normal")])
def test_residuals_that_are_not_known_do_not_pass(made, name, residual):
    found = gate(judged([measured(made, **{residual: np.nan})], LIMITS), name)
    assert (found.value, found.state) == (math.inf, "fail")


def nan_curve(made):
    contour = measured(made)
    return replace(contour, corrected=stretched(contour.nominal, np.nan))


def test_a_length_that_is_no_number_does_not_pass(made):
    assert gate(judged([nan_curve(made)], LIMITS), "stretch").state == "fail"
    assert gate(judged([nan_curve(made), measured(made)], LIMITS), "stretch").state == "fail"


def test_a_length_that_is_no_number_does_not_pass_behind_a_good_one(made):
    assert gate(judged([measured(made), nan_curve(made)], LIMITS), "stretch").state == "fail"


def test_a_path_distance_that_is_no_number_does_not_pass(made):
    found = gate(path_gates(before_and_after(made), np.array([0.0, np.nan]), LIMITS), "path_distance_mm")
    assert found.state == "fail"


@pytest.mark.parametrize("name", ["coverage", "residual_mm", "stretch"])
def test_a_limit_that_is_no_number_lets_nothing_pass(made, name):
    found = gate(judged([measured(made)], replace(LIMITS, **{name: math.nan})), name)
    assert found.state == "fail"


# ---- override ----


def test_only_the_named_gates_that_failed_are_overridden():
    gates = (
        Gate("coverage", 0.2, 0.5, "fail", ""), Gate("residual_mm", 0.1, 0.5, "ok", ""),
        Gate("jump_mm", 2.0, 0.5, "fail", ""),
    )  # fmt: skip
    assert [g.state for g in overridden(gates, ["coverage", "residual_mm"])] == ["overridden", "ok", "fail"]
    assert [g.state for g in overridden(gates, [])] == ["fail", "ok", "fail"]
    assert overridden(gates, ["coverage"])[0] == replace(gates[0], state="overridden")
