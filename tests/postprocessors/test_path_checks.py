"""What is told of a path whatever machine runs it; each limit is broken at one known move."""

import numpy as np
import pytest
from post_programs import path_of, program_of, straight_program

from sicp_cam.errors import PathError
from sicp_cam.findings import Level
from sicp_cam.rigid_motion import from_parts
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.path_checks import PreflightOptions, path_findings, stretches_told

WORLD = np.eye(4)


def checked(program, T=WORLD, **options):
    findings = path_findings(program, T, PreflightOptions(**options))
    assert findings[-1].code == 669
    assert findings[-1].message.startswith("collisions")
    return findings[:-1]


def tilted(degrees):
    turn = np.radians(degrees)
    return np.column_stack([np.sin(turn), 0.0 * turn, np.cos(turn)])


def leaning(degrees, spacing=1.0, feed=600.0, rapid=None):
    """A straight path along y whose axes lean by given degrees."""
    count = len(degrees)
    tips = np.column_stack([np.zeros(count), np.arange(count) * spacing, np.zeros(count)])
    rapid = np.arange(count) == 0 if rapid is None else rapid
    return program_of(path_of(tips, tilted(np.array(degrees, dtype=float)), feed, rapid))


def test_a_plain_path_has_nothing_but_what_is_not_checked():
    assert checked(straight_program(20), work_box_mm=(0, -1, 0, 19, 1, 0), max_feed_mm_min=600.0) == []


def test_each_stay_outside_the_work_box_is_a_failure_with_its_place():
    tips = np.zeros((9, 3))
    tips[:, 0] = [0, 5, 11, 12, 5, 0, -1, 0, 5]
    program = program_of(path_of(tips, [[0, 0, 1]] * 9, 600.0))
    options = {"work_box_mm": (10.0, 5.0, 5.0, 0.0, -5.0, -5.0)}
    findings = [f for f in checked(program, **options) if f.code == 660]
    assert [(f.level, f.where) for f in findings] == [
        (Level.FAIL, "moves 2 to 3, lines 12 to 13"),
        (Level.FAIL, "move 6, line 16"),
    ]
    assert findings[0].message.startswith("the tip leaves the work box by up to 2.000 mm, at x = 12.000 mm")


@pytest.mark.parametrize(("x_mm", "count"), [(10.0, 0), (10.001, 1)])
def test_the_work_box_holds_its_own_border(x_mm, count):
    program = program_of(path_of([[x_mm, 0, 0]], [[0, 0, 1]], 600.0))
    assert len(checked(program, work_box_mm=(0, 0, 0, 10, 1, 1))) == count


def test_the_work_box_stands_in_the_world():
    program = straight_program(3)
    T = from_parts([[0, -1, 0], [1, 0, 0], [0, 0, 1]], (100.0, 0.0, 0.0))
    assert checked(program, T, work_box_mm=(99, 0, -1, 101, 2, 1)) == []
    (finding,) = checked(program, T, work_box_mm=(99, 0, -1, 101, 1.5, 1))
    assert finding.where == "move 2, line 12"
    assert "y = 2.000 mm" in finding.message


def test_a_feed_above_the_limit_is_a_failure_and_a_rapid_move_has_none():
    program = program_of(
        path_of([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 1]] * 3, [9000.0, 2000.0, 2001.0], [True, False, False])
    )
    (finding,) = checked(program, max_feed_mm_min=2000.0)
    assert (finding.code, finding.level, finding.where) == (661, Level.FAIL, "move 2, line 12")
    assert finding.message == "the feed is 2001 mm/min, above max_feed_mm_min = 2000"


@pytest.mark.parametrize(("degrees", "warned"), [(4.99, False), (5.01, True)])
def test_turns_of_the_axis_are_counted_by_the_way(degrees, warned):
    findings = checked(leaning([0, 0, degrees, degrees]), max_axis_deg_s=1e6)
    assert [(f.code, f.level, f.where) for f in findings] == [(661, Level.WARN, "move 2, line 12")] * warned


@pytest.mark.parametrize(("feed", "warned"), [(5390.0, False), (5410.0, True)])
def test_turns_of_the_axis_are_counted_by_time(feed, warned):
    findings = checked(leaning([0, 0, 1, 1], feed=feed))
    assert [(f.code, f.where) for f in findings] == [(661, "move 2, line 12")] * warned
    assert all("degrees per second" in f.message for f in findings)


def test_a_turn_while_the_tip_stands_is_told():
    (finding,) = checked(leaning([0, 20], spacing=0.0))
    assert (finding.code, finding.level) == (661, Level.WARN)
    assert "20 degrees in one move" in finding.message


def test_a_turn_in_a_rapid_move_is_no_matter():
    assert checked(leaning([0, 60, 60], rapid=np.array([True, True, False]))) == []


def test_an_axis_that_flips_is_told():
    findings = checked(leaning([0, 0, 91, 91], spacing=100.0, feed=60.0))
    assert [(f.code, f.level, f.where) for f in findings] == [(662, Level.WARN, "move 2, line 12")]
    assert "turns 91 degrees" in findings[0].message


@pytest.mark.parametrize(("degrees", "warned"), [(149.0, False), (151.0, True), (180.0, True)])
def test_a_cut_that_goes_back_on_its_way_is_told(degrees, warned):
    turn = np.radians(degrees)
    tips = [[0, 0, 0], [10, 0, 0], [10 + 5 * np.cos(turn), 5 * np.sin(turn), 0]]
    findings = checked(program_of(path_of(tips, [[0, 0, 1]] * 3, 600.0)))
    assert [(f.code, f.where) for f in findings] == [(662, "move 2, line 12")] * warned


def test_out_of_a_hole_again_is_no_way_back():
    tips = [[0, 0, 5], [0, 0, -5], [0, 0, 5], [10, 0, 5]]
    assert checked(program_of(path_of(tips, [[0, 0, 1]] * 4, 600.0))) == []


def test_noise_is_no_way_back():
    tips = [[0, 0, 0], [10, 0, 0], [9.995, 0, 0], [20, 0, 0]]
    assert checked(program_of(path_of(tips, [[0, 0, 1]] * 4, 600.0))) == []


def test_moves_without_motion_are_counted():
    tips = [[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]]
    (finding,) = checked(program_of(path_of(tips, [[0, 0, 1]] * 5, 600.0)))
    assert (finding.code, finding.level, finding.where) == (662, Level.INFO, "move 2, line 12")
    assert finding.message == "2 cutting moves without motion, the first one here"


@pytest.mark.parametrize(("rapid", "level"), [(None, Level.WARN), ([1, 0, 1, 1, 0], Level.INFO)])
def test_a_crossing_of_one_cut_is_a_warning_and_of_two_a_remark(rapid, level):
    tips = [[0, 0, 0], [10, 0, 0], [10, 5, 0], [4, 5, 0], [4, -5, 0]]
    program = program_of(path_of(tips, [[0, 0, 1]] * 5, 600.0, rapid or np.arange(5) == 0))
    (finding,) = checked(program)
    assert (finding.code, finding.level, finding.where) == (663, level, "move 4, line 14")
    assert finding.message.endswith("move 1, line 11")
    assert checked(program, check_crossings=False) == []


def test_many_places_are_told_as_ten_and_a_number():
    path = straight_program(100).path
    where = np.arange(100) % 2 == 0
    findings = stretches_told(path, where, 660, Level.FAIL, lambda run: f"bad {run.start}")
    assert len(findings) == 10
    assert findings[-1].message == "bad 18; and 40 more such places"


@pytest.mark.parametrize("count", [0, 1, 2])
def test_short_paths_are_checked_without_stumbling(count):
    program = program_of(path_of(np.zeros((count, 3)), np.tile([0.0, 0, 1], (count, 1)), 600.0))
    findings = checked(program, work_box_mm=(-1, -1, -1, 1, 1, 1), max_feed_mm_min=1000.0)
    assert [f.code for f in findings] == [662] * (count == 2)


def test_g_code_takes_the_checks_as_options_of_its_own():
    post = GCode({"work_box_mm": "0,-1,-1,15,1,1", "max_feed_mm_min": "500"})
    failed = [f.code for f in post.preflight(straight_program(20)) if f.level is Level.FAIL]
    assert failed == [660, 661]
    with pytest.raises(
        PathError, match=r"moves 16 to 19, lines 26 to 29: the tip leaves the work box by up to 4.000 mm"
    ):
        post.write(straight_program(20))


def test_that_crossings_were_not_looked_for_is_told():
    tips = np.random.default_rng(0).uniform(-500.0, 500.0, (10_000, 3))
    findings = checked(program_of(path_of(tips, [[0, 0, 1]] * 10_000, 600.0)))
    assert [f.level for f in findings if f.code == 669] == [Level.INFO]
