"""The comparison of two programs of one path against differences that are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sicp_cam.checking.comparison import compared
from sicp_cam.findings import Finding, Level
from sicp_cam.model import ToolPath
from sicp_cam.rigid_motion import apply, from_parts


def ring(n=40):
    angle = np.linspace(0.0, 2.0 * np.pi, n)
    tips = np.column_stack([100.0 * np.cos(angle), 100.0 * np.sin(angle), np.zeros(n)])
    axes = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(n, np.sqrt(0.91))])
    rapid = np.isin(np.arange(n), [0, n - 1])
    return ToolPath(tips, axes, np.where(rapid, 0.0, 900.0), rapid, np.arange(n) + 5)


REFERENCE = ring()


def changed(**arrays):
    return replace(REFERENCE, **arrays)


def moves(index):
    """Return the moves of the reference with these indices."""
    return ToolPath(
        *(getattr(REFERENCE, name)[index] for name in ("tips_mm", "axes", "feeds_mm_min", "rapid", "lines"))
    )


def failures(comparison):
    return [(f.code, f.where) for f in comparison.findings if f.level is Level.FAIL]


def divided(path, times=4):
    """Return a path with every move divided into equal pieces, and the index that each old move now has."""
    n = len(path)
    at = np.minimum(np.arange((n - 1) * times + 1) / times, n - 1)
    low = np.minimum(at.astype(int), n - 2)
    share = (at - low)[:, None]
    axes = (1.0 - share) * path.axes[low] + share * path.axes[low + 1]
    end = np.ceil(at).astype(int)
    tips = (1.0 - share) * path.tips_mm[low] + share * path.tips_mm[low + 1]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return ToolPath(tips, axes, path.feeds_mm_min[end], path.rapid[end], path.lines[end])


def test_the_same_path_has_no_difference():
    found = compared(ring(), REFERENCE, "a.nc")
    assert found.findings == ()
    assert found.facts == {
        "reference": "memory", "moves": 40, "added_moves": 0, "max_mm": 0.0, "max_axis_deg": 0.0, "max_feed_share": 0.0
    }  # fmt: skip


def test_tips_are_compared_to_their_tolerance():
    tips = REFERENCE.tips_mm.copy()
    tips[7, 2] += 0.0015
    assert failures(compared(changed(tips_mm=tips), REFERENCE, "a.nc")) == []
    assert compared(changed(tips_mm=tips), REFERENCE, "a.nc").facts["max_mm"] == 0.0015
    tips[9, 0] -= 0.25
    found = compared(changed(tips_mm=tips), REFERENCE, "a.nc")
    assert failures(found) == [(897, "a.nc, move 9, line 14")]
    assert (
        "1 of 40 tips are off by more than 0.002 mm, this one by 0.25 (memory, move 9" not in found.findings[0].message
    )
    assert "1 of 40 tips are off by more than 0.002 mm, this one by 0.25" in found.findings[0].message
    assert failures(compared(changed(tips_mm=tips), REFERENCE, "a.nc", tolerance_mm=0.3)) == []


def test_axes_are_compared_to_their_tolerance():
    axes = REFERENCE.axes.copy()
    axes[5] = Rotation.from_rotvec([0.0, 0.0, np.radians(1.0)]).apply(axes[5])
    found = compared(changed(axes=axes), REFERENCE, "a.nc")
    assert failures(found) == [(897, "a.nc, move 5, line 10")]
    turned = np.degrees(np.arccos(axes[5] @ REFERENCE.axes[5]))
    assert found.facts["max_axis_deg"] == pytest.approx(turned, rel=1e-4)


def test_axes_that_nobody_stated_are_not_compared():
    flat = np.tile([0.0, 0.0, 1.0], (40, 1))
    assumed = (Finding(303, Level.WARN, "no tool axis"),)
    found = compared(changed(axes=flat, findings=assumed), REFERENCE, "a.dxf")
    assert failures(found) == [] and found.facts["max_axis_deg"] is None
    assert [f.code for f in found.findings] == [898]


def test_another_frame_is_recognised():
    T = from_parts(Rotation.from_rotvec([0.0, 0.0, np.radians(30.0)]).as_matrix(), [10.0, 0.0, 0.0])
    found = compared(changed(tips_mm=apply(T, REFERENCE.tips_mm)), REFERENCE, "a.nc")
    assert "one rigid motion of 10 mm and 30 degrees: are both in one frame?" in found.findings[0].message


def test_moves_may_be_added_on_the_way_and_not_beside_it():
    found = compared(divided(REFERENCE), REFERENCE, "a.nc")
    assert found.findings == () and found.facts["added_moves"] == 3 * 39
    made = divided(REFERENCE)
    tips = made.tips_mm.copy()
    tips[10, 2] = 0.5
    found = compared(replace(made, tips_mm=tips), REFERENCE, "a.nc")
    assert failures(found) == [(897, f"a.nc, move 10, line {made.lines[10]}")]
    assert "lies 0.5 mm beside the way" in found.findings[0].message


def test_the_axis_of_an_added_move_must_lie_between_those_of_the_reference():
    made = divided(REFERENCE)
    for angle, wrong in ((0.02, False), (1.0, True), (27.0, True)):
        axes = made.axes.copy()
        axes[10] = Rotation.from_rotvec(np.radians(angle) * np.array([0.0, 1.0, 0.0])).apply(axes[10])
        found = compared(replace(made, axes=axes), REFERENCE, "a.nc")
        assert failures(found) == ([(897, f"a.nc, move 10, line {made.lines[10]}")] if wrong else [])
        if wrong:
            assert "the tool axis of an added move makes the turn of the reference" in found.findings[0].message
    flat = np.tile([0.0, 0.0, 1.0], (40, 1))
    unstated = replace(REFERENCE, axes=flat, findings=(Finding(303, Level.WARN, "no tool axis"),))
    assert failures(compared(replace(made, axes=axes), unstated, "a.nc")) == []


def test_an_added_move_is_rapid_only_as_part_of_a_rapid_move():
    made = divided(REFERENCE)
    rapid = made.rapid.copy()
    assert rapid[-3:].all()  # parts of the rapid move at the end
    rapid[9:11] = True
    found = compared(replace(made, rapid=rapid), REFERENCE, "a.nc")
    assert failures(found) == [(897, f"a.nc, move 9, line {made.lines[9]}")]
    assert found.findings[0].message == "2 added moves are rapid amid cuts of the reference"


def test_a_move_that_is_missing_is_named():
    kept = np.delete(np.arange(40), 17)
    found = compared(moves(kept), REFERENCE, "a.nc")
    assert [f.code for f in found.findings] == [897]
    assert "39 moves, the reference has 40, and its reference, move 17, line 22, is not among them" in (
        found.findings[0].message
    )
    assert found.facts["max_mm"] is None


def test_moves_before_the_first_and_after_the_last_are_told():
    more = ToolPath(
        np.vstack([[[0, 0, 90]], REFERENCE.tips_mm, [[0, 0, 90]]]),
        np.vstack([REFERENCE.axes[:1], REFERENCE.axes, REFERENCE.axes[-1:]]),
        np.r_[0.0, REFERENCE.feeds_mm_min, 0.0],
        np.r_[True, REFERENCE.rapid, True],
        np.arange(42),
    )
    assert failures(compared(more, REFERENCE, "a.nc")) == [(897, "a.nc, move 0")]


def test_a_repeated_move_of_the_reference_needs_no_second_one():
    twice = np.sort(np.r_[np.arange(40), 20])
    assert compared(REFERENCE, moves(twice), "a.nc").findings == ()


def test_cuts_that_became_rapid_must_not_run_and_straight_rapids_may():
    rapid = REFERENCE.rapid.copy()
    rapid[12] = True
    assert failures(compared(changed(rapid=rapid), REFERENCE, "a.nc")) == [(897, "a.nc, move 12, line 17")]
    found = compared(changed(rapid=np.zeros(40, bool), feeds_mm_min=np.full(40, 900.0)), REFERENCE, "a.nc")
    assert [(f.code, f.level) for f in found.findings] == [(898, Level.INFO)]


def test_the_first_move_may_be_any_since_nobody_knows_where_it_comes_from():
    rapid = np.arange(40) == 0
    again = changed(rapid=rapid, feeds_mm_min=np.where(rapid, 0.0, 900.0))
    wanted = changed(rapid=np.zeros(40, bool), feeds_mm_min=np.full(40, 900.0))
    assert failures(compared(again, wanted, "a.nc")) == []


def test_feeds_are_compared_to_one_percent():
    feeds = REFERENCE.feeds_mm_min.copy()
    feeds[3] *= 1.005
    assert compared(changed(feeds_mm_min=feeds), REFERENCE, "a.nc").findings == ()
    feeds[4] *= 0.5
    found = compared(changed(feeds_mm_min=feeds), REFERENCE, "a.nc")
    assert [(f.code, f.level, f.where) for f in found.findings] == [(898, Level.WARN, "a.nc, move 4, line 9")]
    assert found.facts["max_feed_share"] == 0.5
