"""Laws of the transfer and the gates that hold for every path and every deformation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.contour.choice import Assignment
from sicp_cam.contour.frames import FramedCurve, moved, orthonormal
from sicp_cam.model import Event, EventKind, ToolPath
from sicp_cam.registration.result import RegisteredContour, Residuals
from sicp_cam.rigid_motion import apply, from_parts, rotate
from sicp_cam.toolpath.path_gates import path_gates
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings
from sicp_cam.toolpath.steps import divided, feed_steps
from sicp_cam.toolpath.transfer import correct_path

FEW = settings(max_examples=40, deadline=None)
NONE = np.zeros((0, 3))
seeds = st.integers(0, 2**32 - 1)


def loop(seed, count=180):
    """A smooth closed contour in space with outward normals that turn along it."""
    rng = np.random.default_rng(seed)
    a = -2.0 * np.pi * np.arange(count) / count
    r = 80.0 + 10.0 * rng.uniform(-1, 1) * np.cos(2 * a + rng.uniform(0, 6)) + 5.0 * rng.uniform(-1, 1) * np.sin(3 * a)
    z = 12.0 * rng.uniform(-1, 1) * np.cos(2 * a) + 6.0 * rng.uniform(-1, 1) * np.sin(a)
    points = np.stack([r * np.cos(a), r * np.sin(a), z], 1)
    tangents = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normals = np.array([0.0, 0.0, 1.0]) + 0.3 * np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    T, B, N = orthonormal(tangents, normals)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    return FramedCurve(s[:-1], points, T, B, N, float(s[-1]), True)


def deformed(curve, seed):
    """The contour pushed about and twisted by a few millimetres and degrees, smoothly."""
    rng = np.random.default_rng(seed)
    a = 2.0 * np.pi * curve.s_mm / curve.length_mm
    wave = sum(
        np.outer(np.cos(k * a + rng.uniform(0, 6)), rng.uniform(-3, 3, 3))
        + np.outer(np.sin(k * a), rng.uniform(-3, 3, 3))
        for k in (1, 2, 3)
    )
    turn = Rotation.from_rotvec(0.03 * wave / 3.0)
    return replace(
        curve, points_mm=curve.points_mm + wave,
        tangents=turn.apply(curve.tangents), inward=turn.apply(curve.inward), outward=turn.apply(curve.outward),
    )  # fmt: skip


def registered(nominal, corrected, number=1):
    k = len(nominal)
    unknown = Residuals(np.zeros(k), np.zeros(k))
    return RegisteredContour(
        number, nominal, nominal, corrected, np.ones(k, bool), NONE, unknown, unknown, (), np.zeros(0), NONE, NONE
    )  # fmt: skip


def any_path(curve, seed, moves=30):
    """A path along the contour with offsets, jumps off it, rapids, events and every kind of feed."""
    rng = np.random.default_rng(seed)
    start = rng.integers(0, len(curve))
    at = (start + np.cumsum(rng.integers(0, 9, moves))) % len(curve)
    tips = curve.points_mm[at] + rng.uniform(-6, 6) * curve.inward[at] + rng.uniform(-3, 3) * curve.outward[at]
    rapid = rng.random(moves) < 0.15
    tips[rapid] += rng.uniform(0, 200) * curve.outward[at[rapid]]
    axes = curve.outward[at] + 0.2 * rng.normal(size=3)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    places = sorted(rng.integers(0, moves + 1, 5).tolist())
    events = tuple(Event(place, EventKind.COMMENT, 0.0, str(n), n) for n, place in enumerate(places))
    return ToolPath(tips, axes, np.where(rapid, 0.0, rng.uniform(100, 3000, moves)), rapid, np.arange(moves), events)


def random_pose(seed):
    rng = np.random.default_rng(seed)
    return from_parts(Rotation.random(rng=rng).as_matrix(), rng.uniform(-2000, 2000, 3))


def corrected(path, contour, T, **options):
    settings = ToolPathSettings(**options)
    steps = divided(path, feed_steps(path, settings.step_mm))
    rapid = path.rapid[steps.source]
    assignment = Assignment(np.zeros(len(rapid), np.int64), np.where(rapid, 100.0, 5.0), (0,))
    return correct_path(path, steps, assignment, [contour], T, settings, 20.0)


@given(seeds, seeds, seeds)
@FEW
def test_every_move_feed_line_and_event_of_the_source_is_there_in_its_order(shape, bend, way):
    curve = loop(shape)
    path = any_path(curve, way)
    done = corrected(path, registered(curve, deformed(curve, bend)), np.eye(4))
    kept = np.flatnonzero(~done.added)
    assert len(kept) == len(path)
    np.testing.assert_array_equal(done.nominal.tips_mm[kept], path.tips_mm)
    np.testing.assert_array_equal(done.corrected.feeds_mm_min[kept], path.feeds_mm_min)
    np.testing.assert_array_equal(done.corrected.rapid[kept], path.rapid)
    np.testing.assert_array_equal(done.corrected.lines[kept], path.lines)
    assert [event.text for event in done.corrected.events] == [event.text for event in path.events]
    # What was added belongs to the next move of the source: same line, feed and kind.
    owner = np.searchsorted(kept, np.arange(len(done.corrected)))
    np.testing.assert_array_equal(done.corrected.lines, path.lines[owner])
    np.testing.assert_array_equal(done.corrected.feeds_mm_min, path.feeds_mm_min[owner])
    assert not done.corrected.rapid[done.added].any()
    firsts = np.append(np.concatenate([[0], kept[:-1] + 1]), len(done.corrected))
    assert [event.before_move for event in done.corrected.events] == [int(firsts[e.before_move]) for e in path.events]


@given(seeds, seeds, seeds)
@FEW
def test_axes_stay_unit_vectors_and_numbers_finite(shape, bend, way):
    curve = loop(shape)
    done = corrected(any_path(curve, way), registered(curve, deformed(curve, bend)), random_pose(way))
    for path in (done.nominal, done.rigid, done.corrected):
        np.testing.assert_allclose(np.linalg.norm(path.axes, axis=1), 1.0, atol=1e-12)
    assert len(done.status) == len(done.corrected) == len(done.rigid) == len(done.nominal) == len(done.added)


@given(seeds, seeds, seeds, seeds)
@FEW
def test_the_correction_moves_with_the_scan(shape, bend, way, pose):
    """Clamp the same part elsewhere: the same points move along, and nothing else changes."""
    curve, G = loop(shape), random_pose(pose)
    path, bent = any_path(curve, way), deformed(loop(shape), bend)
    here = corrected(path, registered(curve, bent), np.eye(4))
    there = corrected(path, registered(curve, moved(bent, G)), G)
    np.testing.assert_allclose(there.corrected.tips_mm, apply(G, here.corrected.tips_mm), atol=1e-8)
    np.testing.assert_allclose(there.corrected.axes, rotate(G, here.corrected.axes), atol=1e-11)
    assert there.status == here.status


@given(seeds, seeds, seeds, seeds)
@FEW
def test_the_correction_does_not_depend_on_the_frame_of_the_part(shape, bend, way, pose):
    curve, G = loop(shape), random_pose(pose)
    path, bent = any_path(curve, way), deformed(loop(shape), bend)
    here = corrected(path, registered(curve, bent), np.eye(4))
    elsewhere = replace(path, tips_mm=apply(G, path.tips_mm), axes=rotate(G, path.axes))
    back = from_parts(G[:3, :3].T, -G[:3, :3].T @ G[:3, 3])
    there = corrected(elsewhere, registered(moved(curve, G), bent), back)
    assert len(there.corrected) == len(here.corrected)
    np.testing.assert_allclose(there.corrected.tips_mm, here.corrected.tips_mm, atol=1e-6)


@given(seeds, seeds)
@FEW
def test_a_part_that_is_not_bent_leaves_the_offsets_in_the_frame_alone(shape, way):
    curve = loop(shape)
    path = any_path(curve, way)
    done = corrected(path, registered(curve, curve), np.eye(4))
    np.testing.assert_allclose(done.corrected.tips_mm, done.nominal.tips_mm, atol=1e-10)
    np.testing.assert_allclose(done.corrected.axes, done.nominal.axes, atol=1e-12)
    gates = {gate.name: gate for gate in path_gates(done, np.zeros(3), GateLimits())}
    assert gates["correction_mm"].value < 1e-9
    assert gates["jump_mm"].value == 0.0
    assert all(gate.state == "ok" for gate in gates.values())


@given(seeds, seeds, st.floats(0.1, 20.0))
@FEW
def test_steps_are_never_longer_than_asked_where_a_cut_is_divided(shape, bend, step):
    curve = loop(shape)
    path = any_path(curve, bend)
    done = corrected(path, registered(curve, deformed(curve, bend)), np.eye(4), step_mm=step)
    length = np.linalg.norm(np.diff(done.nominal.tips_mm, axis=0), axis=1)
    divided = done.added[:-1]
    assert (length[divided] <= step * (1.0 + 1e-9)).all()


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=12), st.sampled_from(["correction_mm", "jump_mm"]))
@FEW
def test_a_gate_passes_exactly_what_its_limit_allows(changes, name):
    n = len(changes)
    tips = np.stack([np.arange(n, dtype=float), np.zeros(n), np.zeros(n)], 1)
    flat = ToolPath(tips, np.tile([0.0, 0, 1], (n, 1)), np.ones(n), np.zeros(n, bool), np.zeros(n))
    shifted = replace(flat, tips_mm=tips + np.outer(changes, [0.0, 0.0, 1.0]))
    curve = FramedCurve(
        tips[:, 0], tips, np.tile([1.0, 0, 0], (n, 1)), np.tile([0.0, 1, 0], (n, 1)), np.tile([0.0, 0, 1], (n, 1)),
        float(n - 1), False,
    )  # fmt: skip
    done = replace(corrected(flat, registered(curve, curve), np.eye(4)), corrected=shifted)
    value = {gate.name: gate for gate in path_gates(done, np.zeros(1), GateLimits())}[name].value
    steps = np.abs(np.diff(changes)) - 0.1
    expected = np.abs(changes).max() if name == "correction_mm" else max(0.0, steps.max())
    assert value == pytest.approx(expected, abs=1e-9)
    for limit, state in ((value, "ok"), (np.nextafter(value, -1.0), "fail")):
        gates = path_gates(done, np.zeros(1), replace(GateLimits(), **{name: float(limit)}))
        assert {gate.name: gate.state for gate in gates}[name] == state
