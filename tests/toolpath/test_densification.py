"""Long straight moves that must bend get points in between; everything else about the path stays in its place."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sicp_cam.model import Event, EventKind
from sicp_cam.toolpath.settings import ToolPathSettings
from sicp_cam.toolpath.transfer import carried

RADIUS = 900.0


@pytest.fixture
def bent(made):
    nominal = made.straight()
    return made.registered(nominal, made.rolled(nominal, RADIUS))


def departure(done, source, contours, **settings):
    """Return how far the corrected polyline leaves the corrected curve, carried at every 0.02 mm of the source."""
    tips = source.tips_mm
    t = np.linspace(0.0, 1.0, round(np.linalg.norm(tips[1] - tips[0]) / 0.02) + 1)[:, None]
    fine = tips[0] + t * (tips[1] - tips[0])
    follows = np.zeros(len(fine), dtype=np.int64)
    curve, _ = carried(
        fine, np.tile(source.axes[0], (len(fine), 1)), follows, contours, np.eye(4), ToolPathSettings(**settings)
    )
    line = done.corrected.tips_mm
    _, left = cKDTree(line).query(curve)
    best = np.full(len(curve), np.inf)
    for start in (np.clip(left - 1, 0, len(line) - 2), np.clip(left, 0, len(line) - 2)):
        step = line[start + 1] - line[start]
        u = np.clip(np.sum((curve - line[start]) * step, 1) / np.sum(step * step, 1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(line[start] + u[:, None] * step - curve, axis=1))
    return float(best.max())


@pytest.mark.parametrize(("length", "step", "count"), [(100.0, 2.0, 50), (99.0, 2.0, 50), (100.0, 2.5, 40)])
def test_a_long_cut_along_a_bent_edge_gets_equal_steps(made, bent, length, step, count):
    source = made.path([[20.0, 0.0, 0.0], [20.0 + length, 0.0, 0.0]])
    done = made.corrected(source, [bent], step_mm=step)
    assert len(done.nominal) == len(done.rigid) == len(done.corrected) == len(done.status) == 1 + count
    np.testing.assert_allclose(np.diff(done.nominal.tips_mm[:, 0]), length / count, rtol=1e-12)
    np.testing.assert_array_equal(done.nominal.tips_mm[-1], source.tips_mm[-1])
    assert done.added.tolist() == [False, *([True] * (count - 1)), False]


def test_a_straight_cut_that_stays_straight_stays_one_move(made):
    nominal = made.straight()
    done = made.corrected(made.path([[20.0, 0.0, 0.0], [120.0, 0.0, 0.0]]), [made.registered(nominal, nominal)])
    assert len(done.corrected) == 2


def test_an_axis_that_turns_within_a_cut_does_not_divide_it_where_nothing_is_deformed(made):
    nominal = made.straight()
    source = made.path([[20.0, 0.0, 0.0], [120.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [0.0, np.sin(0.3), np.cos(0.3)]])
    assert len(made.corrected(source, [made.registered(nominal, nominal)]).corrected) == 2


@pytest.mark.parametrize(("radius", "expected"), [(1e6, 2), (1e4, 51)])
def test_only_a_cut_that_bends_by_more_than_the_chord_is_divided(made, radius, expected):
    """100 mm bent to a radius: the arrow is L^2/8R, 0.00125 and 0.125 mm against a chord of 0.01."""
    nominal = made.straight()
    contour = made.registered(nominal, made.rolled(nominal, radius))
    assert len(made.corrected(made.path([[20.0, 0, 0], [120.0, 0, 0]]), [contour]).corrected) == expected


def test_an_axis_that_turns_unevenly_divides_a_cut_that_stays_straight(made):
    """The edge stays straight and twists by 2 degrees in its middle: the tip on it moves nowhere, the axis does."""
    nominal = made.straight()
    angle = np.radians(2.0) * np.exp(-(((nominal.s_mm - 100.0) / 20.0) ** 2))
    normals = np.stack([0 * angle, np.sin(angle), np.cos(angle)], 1)
    twisted = made.curve(nominal.points_mm, nominal.tangents, normals)
    source = made.path([[40.0, 0.0, 0.0], [160.0, 0.0, 0.0]])
    done = made.corrected(source, [made.registered(nominal, twisted)])
    assert len(done.corrected) == 61
    middle = done.corrected.axes[30]
    np.testing.assert_allclose(np.degrees(np.arctan2(middle[1], middle[2])), 2.0, atol=1e-6)


@pytest.mark.parametrize("length", [100.0, 7.0, 160.0])
def test_the_corrected_polyline_keeps_to_the_corrected_curve(made, bent, length):
    source = made.path([[20.0, 0.0, 0.0], [20.0 + length, 0.0, 0.0]])
    done = made.corrected(source, [bent])
    assert departure(done, source, [bent]) <= 0.01


@pytest.mark.xfail(strict=True, reason="steps of step_mm are taken however much the curve bends within one of them")
def test_the_chord_is_kept_where_the_steps_are_long(made, bent):
    """A job may set step_mm up to 1000; the arrow of 50 mm on a radius of 900 is 0.35 mm, and chord_mm says 0.01."""
    source = made.path([[20.0, 0.0, 0.0], [120.0, 0.0, 0.0]])
    done = made.corrected(source, [bent], step_mm=50.0)
    assert departure(done, source, [bent], step_mm=50.0) <= 0.01


@pytest.mark.xfail(
    strict=True, reason="a cut no longer than step_mm is never divided, so chord_mm does not hold for it"
)
def test_the_chord_is_kept_within_a_cut_of_one_step(made):
    """An edge with a bump of 0.3 mm, 8 mm long, met by a cut of 10 mm that step_mm lets be one piece."""
    nominal = made.straight()
    rise = 0.3 * np.exp(-(((nominal.s_mm - 100.0) / 2.0) ** 2))
    points = nominal.points_mm + rise[:, None] * [0.0, 0.0, 1.0]
    contour = made.registered(nominal, made.curve(points, nominal.tangents, nominal.outward))
    source = made.path([[95.0, 0.0, 0.0], [105.0, 0.0, 0.0]])
    done = made.corrected(source, [contour], step_mm=10.0)
    assert departure(done, source, [contour], step_mm=10.0) <= 0.01


def test_feeds_lines_and_rapids_belong_to_the_moves_they_came_with(made, bent):
    tips = [[20.0, 0.0, 30.0], [20.0, 0.0, 0.0], [60.0, 0.0, 0.0], [61.0, 0.0, 0.0], [101.0, 0.0, 0.0]]
    source = made.path(tips, rapid=[0], feeds=[0.0, 300.0, 1500.0, 700.0, 900.0])
    done = made.corrected(source, [bent], distance_mm=[30.0, 0.0, 0.0, 0.0, 0.0])
    counts = [1, 1, 20, 1, 20]
    np.testing.assert_array_equal(done.corrected.feeds_mm_min, np.repeat(source.feeds_mm_min, counts))
    np.testing.assert_array_equal(done.corrected.lines, np.repeat(source.lines, counts))
    np.testing.assert_array_equal(done.corrected.rapid, np.repeat(source.rapid, counts))
    ends = np.cumsum(counts) - 1
    np.testing.assert_array_equal(done.nominal.tips_mm[ends], source.tips_mm)
    assert not done.added[ends].any()
    assert done.added.sum() == 38


def test_events_stay_before_the_move_that_they_preceded(made, bent):
    tips = [[20.0, 0.0, 0.0], [60.0, 0.0, 0.0], [100.0, 0.0, 0.0]]
    events = [
        Event(0, EventKind.TOOL, 3.0, "LOADTL/3", 4),
        Event(1, EventKind.SPINDLE, 18000.0, "SPINDL/18000", 5),
        Event(2, EventKind.COMMENT, 0.0, "second half", 6),
        Event(3, EventKind.STOP, 0.0, "STOP", 7),
    ]
    source = made.path(tips, events=events, name="TRIM")
    done = made.corrected(source, [bent])
    assert [event.before_move for event in done.corrected.events] == [0, 1, 21, 41]
    assert len(done.corrected) == 41
    # Each event still comes right behind the last step of the move before it and before the first of its own.
    for old, new in zip(events, done.corrected.events, strict=True):
        assert (new.kind, new.value, new.text, new.line) == (old.kind, old.value, old.text, old.line)
        if new.before_move < 41:
            assert done.corrected.lines[new.before_move] == source.lines[old.before_move]
        if new.before_move > 0:
            assert done.corrected.lines[new.before_move - 1] == source.lines[old.before_move - 1]
    assert done.corrected.name == "TRIM"


def test_neither_rapid_nor_approach_moves_are_divided(made, bent):
    tips = [[20.0, 0.0, 60.0], [20.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 0.0, 60.0], [20.0, 0.0, 60.0]]
    source = made.path(tips, rapid=[0, 4])
    done = made.corrected(source, [bent])
    assert np.bincount(done.corrected.lines - 10).tolist() == [1, 1, 40, 1, 1]


def test_a_cut_that_begins_where_the_tool_came_down_is_divided_but_the_way_down_is_not(made, bent):
    tips = [[20.0, 0.0, 60.0], [20.0, 0.0, 0.0], [100.0, 0.0, 0.0]]
    done = made.corrected(made.path(tips), [bent])
    assert np.bincount(done.corrected.lines - 10).tolist() == [1, 1, 40]


def test_moves_without_length_stay_single(made, bent):
    tips = [[20.0, 0.0, 0.0], [20.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    done = made.corrected(made.path(tips), [bent])
    assert len(done.corrected) == 3
    assert len(np.unique(done.corrected.tips_mm, axis=0)) == 1


def test_the_axis_between_two_points_is_of_unit_length(made, bent):
    source = made.path([[20.0, 0.0, 0.0], [120.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [0.0, np.sin(0.6), np.cos(0.6)]])
    done = made.corrected(source, [bent])
    np.testing.assert_allclose(np.linalg.norm(done.nominal.axes, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(done.corrected.axes, axis=1), 1.0, atol=1e-14)
    turn = np.arctan2(done.nominal.axes[:, 1], done.nominal.axes[:, 2])
    assert (np.diff(turn) > 0.0).all()


def test_a_circle_of_few_chords_keeps_its_corners_and_follows_the_cylinder(made):
    """A polygon of 24 sides in a round hole: every corner of it is a move of the source and keeps its exact place."""
    nominal = made.hole(100.0)
    contour = made.registered(nominal, made.rolled(nominal, RADIUS))
    corners = np.vstack([nominal.points_mm[::50], nominal.points_mm[:1]])
    done = made.corrected(made.path(corners), [contour])
    kept = done.corrected.tips_mm[~done.added]
    a = corners[:, 0] / RADIUS
    true = np.stack([RADIUS * np.sin(a), corners[:, 1], RADIUS * np.cos(a) - RADIUS], 1)
    np.testing.assert_allclose(kept, true, atol=1e-9)
    np.testing.assert_array_equal(done.corrected.tips_mm[0], done.corrected.tips_mm[-1])
    assert done.added.sum() > 200
