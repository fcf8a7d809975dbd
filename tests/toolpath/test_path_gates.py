"""Every gate of the corrected path, just inside of its limit and just outside; and paths that must not pass."""

import math
import time

import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import Status
from sicp_cam.toolpath.gates import GATE_NAMES
from sicp_cam.toolpath.path_gates import path_gates
from sicp_cam.toolpath.settings import GateLimits
from sicp_cam.toolpath.transfer import CorrectedPath

LIMITS = GateLimits()
UP = np.array([0.0, 0.0, 1.0])


def gate(gates, name):
    (found,) = [gate for gate in gates if gate.name == name]
    return found


def judged(done, distance_mm=(0.0,), limits=LIMITS):
    return path_gates(done, np.asarray(distance_mm, float), limits)


def failed(done):
    return [gate.name for gate in judged(done) if gate.state == "fail"]


def before_and_after(made, *, change=(), axes=None, status=None, spacing=1.0):
    """A path along x whose correction at each move is `change` along z."""
    n = max(len(change), 1 if axes is None else len(axes))
    change = np.zeros(n) if not len(change) else np.asarray(change, float)
    tips = np.stack([spacing * np.arange(n), np.zeros(n), np.zeros(n)], 1)
    return carried(made, tips, tips + change[:, None] * UP, axes, status)


def carried(made, tips, after, axes=None, status=None):
    """The path from `tips` to `after`, its axes upright before; all of it cut."""
    rigid = made.path(tips)
    words = (Status.COVERED,) * len(tips) if status is None else tuple(status)
    moved = made.path(after, UP if axes is None else axes)
    return CorrectedPath(rigid, rigid, moved, words, np.arange(len(tips)), np.zeros(len(tips), dtype=bool))


def tilted(degrees):
    a = np.radians(np.asarray(degrees, float))
    return np.stack([np.sin(a), np.zeros_like(a), np.cos(a)], 1)


def circle(radius=100.0, count=629, turns=1.0):
    a = np.linspace(0.0, 2.0 * np.pi * turns, count)
    return np.stack([radius * np.cos(a), radius * np.sin(a), np.zeros(count)], 1)


def test_a_path_that_is_not_corrected_passes_every_gate(made):
    gates = judged(before_and_after(made))
    assert tuple(gate.name for gate in gates) == GATE_NAMES[GATE_NAMES.index("path_distance_mm") :]
    assert all(gate.state == "ok" and gate.text and gate.limit == getattr(LIMITS, gate.name) for gate in gates)


@pytest.mark.parametrize(("distance", "state"), [(19.99, "ok"), (20.01, "fail")])
def test_path_distance_is_the_median(made, distance, state):
    found = gate(judged(before_and_after(made), [0.0, distance, 1e4]), "path_distance_mm")
    assert (found.value, found.state) == (distance, state)


@pytest.mark.parametrize(("distances", "value"), [([], math.inf), ([0.0, np.nan], math.nan)])
def test_a_path_distance_that_is_not_known_does_not_pass(made, distances, value):
    found = gate(judged(before_and_after(made), distances), "path_distance_mm")
    assert (found.value, found.state) == (pytest.approx(value, nan_ok=True), "fail")


@pytest.mark.parametrize(("size", "state"), [(29.99, "ok"), (30.01, "fail"), (-30.01, "fail")])
def test_correction_is_the_largest_one_of_all_moves(made, size, state):
    found = gate(judged(before_and_after(made, change=[0.0, size, 1.0])), "correction_mm")
    assert found.value == pytest.approx(abs(size))
    assert found.state == state


@pytest.mark.parametrize(("degrees", "state"), [(14.99, "ok"), (15.01, "fail"), (180.0, "fail")])
def test_axis_turn(made, degrees, state):
    found = gate(judged(before_and_after(made, axes=tilted([0.0, degrees, 0.0]))), "axis_deg")
    assert found.value == pytest.approx(degrees, abs=1e-6)
    assert found.state == state


# ---- jumps ----


@pytest.mark.parametrize(("step", "state"), [(0.599, "ok"), (0.601, "fail"), (-0.601, "fail")])
def test_jump_beyond_what_the_distance_explains(made, step, state):
    """Points 1 mm apart explain 0.1 mm; with the limit of 0.5 a step of 0.6 mm is allowed."""
    found = gate(judged(before_and_after(made, change=[0.0, 0.0, step])), "jump_mm")
    assert found.value == pytest.approx(abs(step) - 0.1)
    assert found.state == state


def test_a_long_way_explains_a_larger_step(made):
    found = gate(judged(before_and_after(made, change=[0.0, 4.0], spacing=50.0)), "jump_mm")
    assert (found.value, found.state) == (0.0, "ok")


@pytest.mark.parametrize("where", [0, 1])
def test_no_jump_is_seen_where_one_of_both_moves_does_not_cut(made, where):
    status = [Status.COVERED, Status.BRIDGED]
    status[where] = Status.APPROACH
    done = before_and_after(made, change=[0.0, 5.0], status=status)
    assert {gate(judged(done), name).value for name in ("jump_mm", "slope")} == {0.0}


def test_a_jump_into_a_bridged_stretch_counts(made):
    done = before_and_after(made, change=[0.0, 5.0], status=(Status.COVERED, Status.BRIDGED))
    assert gate(judged(done), "jump_mm").state == "fail"


@pytest.mark.parametrize(("gape", "state"), [(0.499, "ok"), (0.501, "fail")])
def test_a_loop_that_was_closed_must_close(made, gape, state):
    """The correction grows evenly round the loop: no two neighbours jump, but the ends come apart."""
    tips = circle()
    found = gate(judged(carried(made, tips, tips + np.linspace(0.0, gape, len(tips))[:, None] * UP)), "jump_mm")
    assert (found.value, found.state) == (pytest.approx(gape), state)


def test_a_second_round_is_corrected_as_the_first(made):
    tips = np.vstack([circle(), circle()])
    lift = np.repeat([0.0, 0.3], len(tips) // 2)
    # Between the rounds the path stays where it is, and the second one lies 0.3 mm above the first.
    assert gate(judged(carried(made, tips, tips + lift[:, None] * UP)), "jump_mm").value == pytest.approx(0.3)


# ---- slopes ----


@pytest.mark.parametrize(("slope", "state"), [(0.299, "ok"), (0.301, "fail"), (-0.301, "fail")])
@pytest.mark.parametrize("spacing", [0.1, 1.0, 2.5, 40.0])
def test_slope_of_the_correction_whatever_the_spacing(made, slope, state, spacing):
    x = spacing * np.arange(round(200.0 / spacing) + 1)
    found = gate(
        judged(before_and_after(made, change=np.clip(slope * (x - 80.0), -14.0, 14.0), spacing=spacing)), "slope"
    )
    assert found.value == pytest.approx(abs(slope), rel=1e-6)
    assert found.state == state


def test_a_steep_rise_in_small_steps_is_no_jump_but_a_slope(made):
    done = before_and_after(made, change=np.clip(0.4 * np.arange(60), 0.0, 16.0))
    assert gate(judged(done), "jump_mm").state == "ok"
    assert failed(done) == ["slope"]


def test_noise_of_the_correction_is_no_slope(made):
    noise = np.random.default_rng(0).normal(0.0, 0.05, 4000)
    assert failed(before_and_after(made, change=noise, spacing=0.1)) == []


@pytest.mark.parametrize(("per_mm", "state"), [(0.499, "ok"), (0.501, "fail")])
def test_turn_of_the_axis_per_millimetre(made, per_mm, state):
    degrees = np.clip(per_mm * (np.arange(61.0) - 30.0), -5.5, 5.5)
    found = gate(judged(before_and_after(made, axes=tilted(degrees))), "axis_slope")
    assert found.value == pytest.approx(per_mm, rel=2e-3)
    assert found.state == state


def test_an_axis_that_flips_between_two_points_is_seen_twice(made):
    assert failed(before_and_after(made, axes=[UP] * 5 + [-UP] * 5)) == ["axis_deg", "axis_slope"]


def test_a_turn_that_the_nominal_axis_makes_too_is_none(made):
    turned = tilted(np.linspace(0.0, 90.0, 31))
    tips = np.stack([np.arange(31.0), np.zeros(31), np.zeros(31)], 1)
    path = made.path(tips, turned)
    done = CorrectedPath(path, path, path, (Status.COVERED,) * 31, np.arange(31), np.zeros(31, bool))
    assert gate(judged(done), "axis_slope").value == 0.0


# ---- the way of the cut ----


@pytest.mark.parametrize(("kept", "state"), [(1.0, "ok"), (0.251, "ok"), (0.249, "fail"), (-0.1, "fail")])
def test_a_step_that_shrinks_or_runs_backwards(made, kept, state):
    tips = np.stack([np.arange(20.0), np.zeros(20), np.zeros(20)], 1)
    after = tips.copy()
    after[10:, 0] -= 1.0 - kept
    found = gate(judged(carried(made, tips, after)), "travel")
    assert (found.value, found.state) == (pytest.approx(kept), state)


def test_moves_that_turn_the_axis_in_place_have_no_travel(made):
    tips = np.repeat(np.stack([np.arange(5.0), np.zeros(5), np.zeros(5)], 1), 3, axis=0)
    assert failed(carried(made, tips, tips + 1e-9 * np.random.default_rng(1).normal(size=tips.shape))) == []


def lobes(waist):
    """A closed cut round two lobes, with a waist `waist` mm wide between them."""
    a = np.linspace(0.0, 2.0 * np.pi, 800)
    y = np.sin(a) * (30.0 * np.sin(a) ** 2 * np.cos(a) ** 2 * 4.0 + 0.5 * waist)
    return np.stack([100.0 * np.cos(a), y, np.zeros_like(a)], 1)


def test_a_cut_that_crosses_itself_where_the_nominal_one_does_not(made):
    """Each side of a waist of 8 mm is moved by 6 mm over the other, evenly along 100 mm: nothing else can tell."""
    tips = lobes(8.0)
    squeeze = -6.0 * np.sign(tips[:, 1]) * np.exp(-((tips[:, 0] / 25.0) ** 2)) * (np.abs(tips[:, 0]) < 90.0)
    done = carried(made, tips, tips + squeeze[:, None] * [0.0, 1.0, 0.0])
    found = gate(judged(done), "crossing_mm")
    assert found.state == "fail" and 3.0 < found.value < 60.0
    assert gate(judged(done), "jump_mm").state == "ok"
    lifted = carried(made, tips, tips + np.abs(squeeze)[:, None] * UP)
    assert gate(judged(lifted), "crossing_mm").state == "ok"


@pytest.mark.parametrize("angle", [10.0, 45.0, 90.0])
@pytest.mark.parametrize("shift", [0.0, 0.31, 0.5, 0.77])
def test_no_crossing_slips_through_between_the_samples(made, angle, shift):
    a = np.radians(angle)
    one = np.stack([np.linspace(-40.0, 40.0, 3) + shift, np.zeros(3), np.zeros(3)], 1)
    other = np.linspace(-41.0, 41.0, 4)[:, None] * [np.cos(a), np.sin(a), 0.0]
    tips = np.vstack([one, other + 8.0 * UP])
    status = [Status.COVERED] * 3 + [Status.APPROACH] + [Status.COVERED] * 3
    assert gate(judged(carried(made, tips, tips, status=status)), "crossing_mm").state == "ok"
    assert gate(judged(carried(made, tips, np.vstack([one, other]), status=status)), "crossing_mm").value >= 8.0


@pytest.mark.parametrize("rounds", [1, 2, 60])
def test_what_crosses_or_repeats_itself_in_the_nominal_path_is_allowed(made, rounds):
    eight = lobes(0.0)
    done = carried(made, np.tile(eight, (rounds, 1)), np.tile(eight + UP, (rounds, 1)))
    assert gate(judged(done), "crossing_mm").state == "ok"


def test_a_path_that_collapses_is_judged_in_bounded_memory_and_time(made):
    tips = np.cumsum(np.tile([[0.1, 0.0, 0.0]], (300_000, 1)), axis=0)
    start = time.perf_counter()
    assert {"travel", "crossing_mm"} <= set(failed(carried(made, tips, np.zeros_like(tips))))
    assert time.perf_counter() - start < 10.0


def test_an_offset_larger_than_the_radius_of_a_corner_that_got_tighter(made):
    """A concave corner of radius 12 is cut 10 mm beside its edge; where it is measured with radius 6, the cut folds."""

    def arc(radius, count=200):
        a = np.linspace(0.0, 0.5 * np.pi, count)
        unit = np.stack([np.cos(a), np.sin(a), 0.0 * a], 1)
        along = np.stack([-np.sin(a), np.cos(a), 0.0 * a], 1)
        # The material lies outside of the arc: the inward direction points away from its centre.
        return radius * unit, -along, np.tile(UP, (count, 1)), unit

    points, tangents, normals, outward = arc(12.0)
    nominal = made.curve(points, tangents, normals)
    tight = arc(6.0)[0]
    corrected = FramedCurve(
        nominal.s_mm, tight, nominal.tangents, nominal.inward, nominal.outward, nominal.length_mm, False
    )
    done = made.corrected(made.path(points - 10.0 * outward), [made.registered(nominal, corrected)], step_mm=0.5)
    assert gate(judged(done), "travel").value < 0.0
    assert "travel" in failed(done)


def test_a_path_without_cutting_moves_is_judged(made):
    done = before_and_after(made, change=[0.0, 5.0, 0.0], status=[Status.APPROACH] * 3)
    assert failed(done) == []
