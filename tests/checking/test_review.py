"""What is told of a path that was read back, whatever its format."""

import numpy as np
import pytest

from sicp_cam.checking.facts import path_facts
from sicp_cam.checking.review import ReviewLimits, review
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind, ToolPath

UP = [0.0, 0.0, 1.0]


def path(n=6, *, axes=UP, feeds=900.0, rapid=(0,), events=(), step=5.0):
    fast = np.isin(np.arange(n), rapid)
    tips = np.column_stack([step * np.arange(n), np.zeros(n), np.zeros(n)])
    speeds = np.where(fast, 0.0, np.broadcast_to(feeds, n))
    return ToolPath(tips, np.broadcast_to(axes, (n, 3)), speeds, fast, np.arange(n) + 11, tuple(events))


def told(made, **limits):
    return [(f.code, f.level, f.where) for f in review(made, ReviewLimits(**limits), "a.nc")]


def tilted(degrees):
    angle = np.radians(degrees)
    return [0.0, np.sin(angle), np.cos(angle)]


def test_a_good_path_is_left_alone():
    spindle = [Event(0, EventKind.TOOL, 3), Event(0, EventKind.SPINDLE, 9000.0), Event(6, EventKind.SPINDLE, 0.0)]
    assert told(path(events=spindle)) == []


def test_a_path_of_rapid_moves_cuts_nothing():
    assert told(path(rapid=range(6))) == [(890, Level.WARN, "a.nc")]


@pytest.mark.parametrize("feed", [130_000.0, 0.5])
def test_a_feed_that_cannot_be_is_told_with_the_first_move(feed):
    feeds = [900.0, 900.0, feed, 900.0, feed, 0.0]
    (finding,) = review(path(feeds=feeds), ReviewLimits(), "a.nc")
    assert (finding.code, finding.level, finding.where) == (891, Level.WARN, "a.nc, move 2, line 13")
    assert finding.message.startswith("2 moves with a feed")
    assert told(path(feeds=feeds), feed_max_mm_min=2e5, feed_min_mm_min=0.1) == []


def test_a_turn_on_the_spot_is_told_and_one_along_the_way_is_not():
    axes = [UP, UP, tilted(40.0), tilted(40.0), tilted(40.0), tilted(40.0)]
    assert told(path(axes=axes)) == [(892, Level.WARN, "a.nc, move 2, line 13")]
    assert told(path(axes=axes), axis_jump_deg=45.0) == []
    assert told(path(axes=axes, step=50.0)) == []
    assert told(path(axes=axes, rapid=(0, 2))) == []


def test_a_tool_that_turns_over_must_not_run_in_a_cut():
    axes = [UP, UP, tilted(170.0), tilted(170.0), UP, UP]
    assert told(path(axes=axes, step=50.0, rapid=(0, 4))) == [
        (893, Level.FAIL, "a.nc, move 2, line 13"),
        (893, Level.WARN, "a.nc, move 4, line 15"),
    ]


def test_cuts_with_the_spindle_off_are_told():
    on, off = (Event(1, EventKind.SPINDLE, 9000.0, line=12), Event(4, EventKind.SPINDLE, 0.0, line=15))
    assert told(path(events=(on, off))) == [(894, Level.FAIL, "a.nc, move 4, line 15")]
    assert told(path(events=(Event(3, EventKind.SPINDLE, 9000.0),))) == [(894, Level.WARN, "a.nc, move 1, line 12")]
    assert told(path()) == []


def test_a_retract_with_the_spindle_off_is_no_cut():
    made = path(events=(Event(1, EventKind.SPINDLE, 9000.0), Event(5, EventKind.SPINDLE, 0.0)), axes=[1.0, 0.0, 0.0])
    assert told(made) == []


def test_a_tool_change_while_the_spindle_turns_is_told_at_its_line():
    events = (
        Event(0, EventKind.TOOL, 3, line=4),
        Event(1, EventKind.SPINDLE, 9000.0, line=5),
        Event(3, EventKind.TOOL, 4, line=9),
    )
    assert told(path(events=events)) == [(895, Level.WARN, "a.nc, line 9")]


@pytest.mark.parametrize("step", [0.01, 50_000.0])
def test_a_size_that_no_part_has_is_told(step):
    assert (896, Level.WARN, "a.nc") in told(path(step=step))


def test_the_facts_of_a_path():
    events = (Event(0, EventKind.TOOL, 3), Event(2, EventKind.TOOL, 4), Event(4, EventKind.TOOL, 3))
    facts = path_facts(path(events=events, axes=tilted(30.0), feeds=[0, 900, 900, 600, 600, 600]))
    assert (facts["moves"], facts["cuts"], facts["rapids"]) == (6, 5, 1)
    assert (facts["length_mm"], facts["cut_length_mm"]) == (25.0, 25.0)
    assert (facts["feeds_mm_min"], facts["tools"]) == ([600.0, 900.0], [3, 4])
    assert facts["bounds"] == {"min_mm": [0.0, 0.0, 0.0], "max_mm": [25.0, 0.0, 0.0]}
    assert facts["axis_range"] == {"min": [0.0, 0.5, 0.866025], "max": [0.0, 0.5, 0.866025], "largest_tilt_deg": 30.0}
    assert facts["events"] == {"tool": 3} and facts["format"] == "memory"
