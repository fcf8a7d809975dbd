"""Every gate of the registration, just inside of its limit and just outside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.registration.register import register_contours
from sicp_cam.registration.result import LeaveOut, Registration, Residuals
from sicp_cam.rigid_motion import exponential
from sicp_cam.toolpath.gates import GATE_NAMES
from sicp_cam.toolpath.registration_gates import freedom_mm, registration_gates
from sicp_cam.toolpath.settings import GateLimits

LIMITS = GateLimits()
STATIONS = 200


def gate(gates, name):
    (found,) = [gate for gate in gates if gate.name == name]
    return found


def named(gates):
    return [gate.name for gate in gates]


def judged(contours, limits=LIMITS, T_start=None, **more):
    registration = Registration("sicp", np.eye(4), tuple(contours), 2.0, 0.05, np.ones(6), **more)
    return registration_gates(registration, limits, T_start)


def stretched(curve, factor):
    return replace(curve, points_mm=curve.points_mm * factor)


def measured(made, *, covered=None, normal=0.0, out=0.0, stretch=1.0, **more):
    nominal = made.hole(count=STATIONS)
    contour = made.registered(nominal, stretched(nominal, stretch), covered)
    return replace(contour, after=Residuals(np.full(STATIONS, normal), np.full(STATIONS, out)), **more)


def sure(made, normal_u=0.05, out_u=0.01, **more):
    stated = {"normal_u_mm": np.full(STATIONS, normal_u), "out_u_mm": np.full(STATIONS, out_u)}
    return measured(made, **{"leave_out": LeaveOut(0.1, 0.02), **stated, **more})


def test_a_good_registration_passes_every_gate(made):
    given = judged([sure(made)], T_start=np.eye(4), side=0.3)
    found = judged([sure(made)], symmetry=4.0)
    assert all(gate.state == "ok" and gate.text for gate in (*given, *found))
    assert {*named(given), *named(found)} == set(GATE_NAMES[: GATE_NAMES.index("path_distance_mm")])
    for gates in (given, found):
        assert named(gates) == [name for name in GATE_NAMES if name in named(gates)]
        assert all(gate.limit == getattr(LIMITS, gate.name) for gate in gates)


def test_what_a_method_and_a_start_do_not_state_has_no_gate(made):
    absent = {"leave_out_mm", "uncertainty_mm", "symmetry", "side", "pose_mm", "pose_deg"}
    assert absent.isdisjoint(named(judged([measured(made)])))


@pytest.mark.parametrize(("seen", "state"), [(100, "ok"), (99, "fail")])
def test_coverage(made, seen, state):
    found = gate(judged([measured(made, covered=np.arange(STATIONS) < seen)]), "coverage")
    assert (found.value, found.state) == (seen / STATIONS, state)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("name", "residual", "inside", "outside"),
    [("residual_mm", "out", 0.499, 0.501), ("edge_residual_mm", "normal", 2.999, 3.001)],
)
def test_residuals_of_either_sign(made, name, residual, inside, outside, sign):
    for value, state in ((inside, "ok"), (outside, "fail")):
        found = gate(judged([measured(made, **{residual: sign * value})]), name)
        assert found.state == state
        assert found.value == pytest.approx(value)


def test_residuals_that_cancel_do_not_hide(made):
    contour = measured(made)
    contour = replace(contour, after=Residuals(np.zeros(STATIONS), np.where(np.arange(STATIONS) % 2, 0.6, -0.6)))
    assert gate(judged([contour]), "residual_mm").state == "fail"


def test_residuals_are_those_of_the_stations_that_the_scan_shows(made):
    contour = measured(made)
    out = np.full(STATIONS, np.nan)
    out[:20] = 0.3
    contour = replace(contour, after=Residuals(np.zeros(STATIONS), out))
    assert gate(judged([contour]), "residual_mm").value == pytest.approx(0.3)


@pytest.mark.parametrize(("method", "state"), [("rigid", "warn"), ("sicp", "fail"), ("paper", "fail")])
def test_the_rigid_pose_may_miss_a_bent_part_with_a_warning(made, method, state):
    registration = Registration(method, np.eye(4), (measured(made, out=1.8),), 2.0, 0.05, np.ones(6))
    assert gate(registration_gates(registration, LIMITS), "residual_mm").state == state


@pytest.mark.parametrize(("factor", "state"), [(1.0199, "ok"), (1.0201, "fail"), (0.9801, "ok"), (0.9799, "fail")])
def test_stretch_of_either_sign(made, factor, state):
    found = gate(judged([measured(made, stretch=factor)]), "stretch")
    assert found.state == state
    assert found.value == pytest.approx(abs(factor - 1.0))


@pytest.mark.parametrize(("radius", "state"), [(105.99, "ok"), (106.01, "fail"), (94.01, "ok"), (93.99, "fail")])
def test_an_edge_that_moved_within_its_surface(made, radius, state):
    """A hole of radius 100 whose corrected edge is a concentric circle: every station moves by the difference."""
    found = gate(judged([measured(made, stretch=radius / 100.0)]), "in_surface_mm")
    assert found.value == pytest.approx(abs(radius - 100.0))
    assert found.state == state


def test_an_edge_that_moved_out_of_its_surface_only(made):
    contour = measured(made)
    lifted = replace(contour.corrected, points_mm=contour.corrected.points_mm + np.array([0.0, 0.0, 9.0]))
    assert gate(judged([replace(contour, corrected=lifted)]), "in_surface_mm").value == pytest.approx(0.0)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("coverage", {"covered": np.arange(STATIONS) < 20}),
        ("residual_mm", {"out": 0.7}),
        ("edge_residual_mm", {"normal": 4.0}),
        ("stretch", {"stretch": 1.05}),
        ("leave_out_mm", {"leave_out": LeaveOut(0.7, 0.0)}),
        ("uncertainty_mm", {"normal_u": 1.5}),
    ],
)
def test_the_worst_contour_decides(made, name, bad, order):
    gates = judged([sure(made), sure(made, **bad)][::order], T_start=np.eye(4))
    assert [gate.name for gate in gates if gate.state == "fail"] == [name]


# ---- how sure the contour is ----


@pytest.mark.parametrize(("normal", "state"), [(0.5999, "ok"), (0.6001, "fail"), (math.nan, "fail")])
def test_the_two_halves_of_a_scan_must_agree(made, normal, state):
    assert gate(judged([measured(made, leave_out=LeaveOut(normal, 0.0))]), "leave_out_mm").state == state


def test_the_two_halves_differ_in_both_directions_together(made):
    assert gate(judged([measured(made, leave_out=LeaveOut(0.3, 0.4))]), "leave_out_mm").value == pytest.approx(0.5)


@pytest.mark.parametrize("direction", ["normal_u_mm", "out_u_mm"])
@pytest.mark.parametrize(("u", "state"), [(0.999, "ok"), (1.001, "fail"), (math.nan, "fail"), (math.inf, "fail")])
def test_one_uncertain_station_that_the_scan_shows_counts(made, direction, u, state):
    values = np.full(STATIONS, 0.05)
    values[7] = u
    assert gate(judged([sure(made, **{direction: values})]), "uncertainty_mm").state == state


def test_an_uncertain_station_in_a_gap_does_not_count(made):
    values = np.where(np.arange(STATIONS) < 10, 9.0, 0.05)
    contour = sure(made, normal_u_mm=values, covered=np.arange(STATIONS) >= 10)
    assert gate(judged([contour]), "uncertainty_mm").value == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("name", "lost"),
    [("leave_out_mm", {"leave_out": None}), ("uncertainty_mm", {"normal_u_mm": None, "out_u_mm": None}),
     ("uncertainty_mm", {"out_u_mm": None})],
)  # fmt: skip
@pytest.mark.parametrize("order", [1, -1])
def test_a_contour_that_was_left_out_does_not_pass_with_the_others(made, name, lost, order):
    found = gate(judged([sure(made), replace(sure(made), **lost)][::order]), name)
    assert (found.value, found.state) == (math.inf, "fail")


# ---- what holds the pose ----


def rectangle(made, a=300.0, b=50.0, step=1.0):
    """An outer edge of 2a by 2b with sharp corners, counter-clockwise: the material lies to its left."""
    corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
    sides = [
        start + (end - start) * np.linspace(0.0, 1.0, round(np.abs(end - start).max() / step), endpoint=False)[:, None]
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    travel = np.repeat([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]], [len(side) for side in sides], axis=0)
    points = np.hstack([np.concatenate(sides), np.zeros((len(travel), 1))])
    return made.curve(points, travel, np.tile([0.0, 0.0, 1.0], (len(travel), 1)), closed=True)


def long_sides(curve):
    return np.abs(curve.tangents[:, 0]) > 0.5


def seen(made, curve, where, surface=None):
    hidden = np.where(where, 0.0, np.nan)
    after = Residuals(hidden, hidden if surface is None else np.where(surface, 0.0, np.nan))
    return replace(made.registered(curve, curve, where), after=after)


def every(curve):
    return np.ones(len(curve), dtype=bool)


def test_a_contour_that_is_seen_whole_is_held(made):
    """A circle turns about its axis and a straight edge slides along itself: neither moves across itself."""
    for curve in (made.hole(), made.straight(), rectangle(made)):
        assert freedom_mm([seen(made, curve, every(curve))]) == pytest.approx(0.1, rel=1e-3)


def test_the_long_sides_alone_leave_the_sliding_open(made):
    """The ends are 1/7 of the contour and slide by 10 mm: 10 sqrt(1/7) mm RMS, while coverage says 86 %."""
    curve = rectangle(made)
    contour = seen(made, curve, long_sides(curve))
    assert contour.covered.mean() > 0.85
    found = gate(judged([contour]), "freedom_mm")
    assert found.value == pytest.approx(10.0 * np.sqrt(1.0 / 7.0), rel=0.02)
    assert found.state == "fail"


def test_a_short_look_at_one_end_closes_it(made):
    curve = rectangle(made)
    x, y, _ = curve.points_mm.T
    contour = seen(made, curve, long_sides(curve) | ((x > 299.0) & (np.abs(y) < 15.0)))
    assert gate(judged([contour]), "freedom_mm").value < 0.6


def test_another_contour_of_the_part_holds_what_one_leaves_open(made):
    curve = rectangle(made)
    open_one = seen(made, curve, long_sides(curve))
    hole = made.hole(radius_mm=30.0)
    assert freedom_mm([open_one]) > 3.0
    assert freedom_mm([open_one, seen(made, hole, every(hole))]) < 0.6


@pytest.mark.parametrize(("share", "most"), [(0.75, 0.2), (0.5, 0.4), (0.25, 1.5)])
def test_the_less_of_a_circle_is_seen_the_less_it_is_held(made, share, most):
    curve = made.hole()
    value = freedom_mm([seen(made, curve, np.arange(len(curve)) < share * len(curve))])
    assert 0.5 * most < value < most


def test_a_surface_alone_does_not_hold_a_contour_in_it(made):
    """An edge that is not cut yet: the surface is seen everywhere, the edge nowhere."""
    curve = made.hole()
    contour = seen(made, curve, ~every(curve), surface=every(curve))
    # A shift of 10 mm along x moves the stations across themselves by 10 |cos|, which is 10 / sqrt(2) RMS.
    assert freedom_mm([contour]) == pytest.approx(10.0 / np.sqrt(2.0), rel=1e-3)


def test_a_contour_of_which_nothing_is_seen_is_not_held(made):
    curve = made.hole()
    assert freedom_mm([seen(made, curve, ~every(curve))]) > 5.0


def test_freedom_does_not_depend_on_the_place_of_the_part(made):
    curve = rectangle(made)
    where = long_sides(curve)
    away = made.moved(curve, exponential(np.array([0.4, -0.7, 1.1, 9e3, -4e3, 2e3]), np.zeros(3)))
    there = replace(seen(made, curve, where), rigid=away)
    assert freedom_mm([there]) == pytest.approx(freedom_mm([seen(made, curve, where)]), rel=1e-6)


def registered_slot(synthetic, hide_ends):
    """A long outer edge, bent, its start 8 mm off along it; the scan shows all of it, or its long sides only.

    The border of the lesser scan is further from the ends of the part than the registration reaches.
    """
    outline, sheet = synthetic.rounded_rectangle(400.0, 100.0, 8.0), synthetic.cylinder(2500.0)
    uv = synthetic.material([outline], spacing_mm=3.0)
    if hide_ends:
        uv = uv[np.abs(uv[:, 0]) < 145.0]
    start = exponential(np.array([0.0, 0.0, 0.0, 8.0, 1.0, -2.0]), np.zeros(3))
    return register_contours({1: synthetic.contour(outline)}, synthetic.scan(uv, sheet), start, method="rigid")


def test_a_registration_that_may_have_slid_along_its_edge_is_refused(synthetic):
    slid = registered_slot(synthetic, hide_ends=True)
    gates = registration_gates(slid, LIMITS)
    assert gate(gates, "coverage").state == gate(gates, "edge_residual_mm").state == "ok"
    assert gate(gates, "freedom_mm").state == "fail"
    # It has: the part was scanned where it was designed to be.
    assert abs(slid.T_scan_part[0, 3]) > 1.0


def test_the_same_part_seen_whole_is_not(synthetic):
    held = registered_slot(synthetic, hide_ends=False)
    assert gate(registration_gates(held, LIMITS), "freedom_mm").value < 0.2
    assert abs(held.T_scan_part[0, 3]) < 0.5


@pytest.mark.parametrize(("ratio", "state"), [(1.5, "ok"), (4.0, "ok"), (1.499, "fail"), (math.nan, "fail")])
def test_a_start_that_another_pose_fits_nearly_as_well(made, ratio, state):
    assert gate(judged([measured(made)], symmetry=ratio), "symmetry").state == state


@pytest.mark.parametrize(("side", "state"), [(0.1, "ok"), (1.99, "ok"), (2.01, "fail"), (math.nan, "fail")])
def test_a_given_pose_that_fits_the_other_side_better(made, side, state):
    assert gate(judged([measured(made)], side=side), "side").state == state


@pytest.mark.parametrize(("shift", "state"), [(24.9, "ok"), (25.1, "fail")])
def test_the_pose_must_stay_near_the_given_start(made, shift, state):
    T_start = exponential(np.array([0.0, 0.0, 0.0, 0.6 * shift, 0.0, -0.8 * shift]), np.zeros(3))
    gates = judged([measured(made)], T_start=T_start)
    assert gate(gates, "pose_mm").value == pytest.approx(shift, rel=1e-3)
    assert (gate(gates, "pose_mm").state, gate(gates, "pose_deg").value) == (state, pytest.approx(0.0, abs=1e-6))


@pytest.mark.parametrize(("degrees", "state"), [(1e-3, "ok"), (7.99, "ok"), (8.01, "fail"), (-8.01, "fail")])
def test_the_pose_must_not_tilt_far_from_the_given_start(made, degrees, state):
    centre = np.array([5000.0, 0.0, 0.0])
    nominal = made.hole(centre=centre[:2], count=STATIONS)
    contour = replace(measured(made), nominal=nominal, rigid=nominal, corrected=nominal)
    twist = np.append(np.radians(degrees) * np.array([0.6, 0.8, 0.0]), np.zeros(3))
    gates = judged([contour], T_start=exponential(twist, centre))
    assert gate(gates, "pose_deg").value == pytest.approx(abs(degrees), rel=1e-3)
    assert gate(gates, "pose_mm").value == pytest.approx(200.0 * np.sin(np.radians(0.5 * abs(degrees))), rel=2e-3)
    assert gate(gates, "pose_deg").state == state


def test_a_pose_turned_over_is_half_a_turn(made):
    gates = judged([measured(made)], T_start=np.diag([1.0, -1.0, -1.0, 1.0]))
    assert gate(gates, "pose_deg").value == pytest.approx(180.0)


@pytest.mark.parametrize("degrees", [3.0, 30.0, 180.0])
def test_a_circle_that_turned_about_its_axis_went_nowhere(made, degrees):
    T_start = exponential(np.array([0.0, 0.0, np.radians(degrees), 0.0, 0.0, 0.0]), np.zeros(3))
    gates = judged([measured(made)], T_start=T_start)
    assert gate(gates, "pose_mm").value < 0.02 and gate(gates, "pose_deg").value < 1e-5


def test_an_edge_that_slid_along_itself_went_nowhere_but_a_closed_one_did(made):
    T_start = exponential(np.array([0.0, 0.0, 0.0, 26.0, 0.0, 0.0]), np.zeros(3))
    straight, closed = made.straight(), rectangle(made)
    slid = judged([seen(made, straight, every(straight))], T_start=T_start)
    assert gate(slid, "pose_mm").value == pytest.approx(0.0, abs=1e-9)
    pulled = judged([seen(made, closed, every(closed))], T_start=T_start)
    assert gate(pulled, "pose_mm").value == pytest.approx(26.0)


# ---- what cannot be measured never passes ----


@pytest.mark.parametrize(("name", "residual"), [("residual_mm", "out"), ("edge_residual_mm", "normal")])
def test_residuals_that_are_not_known_do_not_pass(made, name, residual):
    found = gate(judged([measured(made, **{residual: np.nan})]), name)
    assert (found.value, found.state) == (math.inf, "fail")


@pytest.mark.parametrize("order", [1, -1])
def test_a_curve_that_is_no_number_does_not_pass(made, order):
    contour = measured(made)
    lost = replace(contour, corrected=stretched(contour.nominal, np.nan), rigid=stretched(contour.nominal, np.nan))
    gates = judged([lost, contour][::order])
    assert {gate(gates, name).state for name in ("stretch", "in_surface_mm", "freedom_mm")} == {"fail"}
