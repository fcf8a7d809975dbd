"""Preflight as a robot's user meets it: options of the post, findings that forbid a program, others that only tell."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from post_programs import path_of, program_of

from sicp_cam import pipeline
from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_postprocessors.arm import arm_names, load_arm
from sicp_postprocessors.krl import Krl
from sicp_postprocessors.val3 import Val3

KNOWN = {"tool": "0,0,150,0,0,0", "cell": "550,0,-100,0,0,0"}
ASKED = {"shoulder": "lefty", "elbow": "epositive", "wrist": "wpositive"}


def loop(radius_mm=80.0, count=60):
    t = np.linspace(0.0, 2.0 * np.pi, count)
    tips = radius_mm * np.column_stack([np.cos(t), np.sin(t), 0.0 * t])
    path = path_of(tips, [[0, 0, 1.0]] * count, np.where(np.arange(count) > 0, 600.0, 0.0), np.arange(count) == 0)
    return program_of(path)


def told(options, program=None, codes=range(660, 670), post=Val3):
    return [f for f in post(KNOWN | options).preflight(program or loop()) if f.code in codes]


def test_without_a_model_of_the_robot_it_is_said_what_is_not_checked():
    findings = told({})
    assert [(f.code, f.level) for f in findings] == [(669, Level.INFO), (669, Level.INFO)]
    assert findings[0].message == "collisions of tool, holder, machine and part are not checked"
    assert findings[1].message == (
        "reach, joint limits and joint speeds are not checked; name the robot with --set post.val3.robot=NAME, or a "
        "file of it"
    )


def test_a_path_that_the_robot_can_run_is_written():
    post = Val3(KNOWN | ASKED | {"robot": "TX2-90"})
    assert post.write(loop())
    assert [f.level for f in told(ASKED | {"robot": "tx2-90"})] == [Level.INFO, Level.INFO]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tool": "0,0,150,0,0,0"}, r"depends on cell; give --set post\.val3\.cell=x,y,z,rx,ry,rz, or no robot"),
        ({"cell": "550,0,-100,0,0,0"}, r"depends on tool; give --set post\.val3\.tool="),
        ({}, r"depends on tool and cell; give --set post\.val3\.tool=.* and --set post\.val3\.cell="),
    ],
)
def test_a_robot_without_tool_and_cell_cannot_be_judged(options, words):
    for program in (loop(), replace(loop(), placed=False)):
        with pytest.raises(PathError, match=words):
            Val3(options | ASKED | {"robot": "tx2-90"}).write(program)


def test_a_path_out_of_reach_is_refused_with_the_moves():
    with pytest.raises(PathError, match=r"moves \d+ to \d+, lines .*: out of reach of the Staubli TX2-60 by up to"):
        Val3(KNOWN | ASKED | {"robot": "tx2-60"}).write(loop())


def test_the_configuration_is_asked_for_in_the_words_of_the_command_line():
    (finding,) = told({"robot": "tx2-90"}, codes=[666])
    assert finding.level is Level.WARN
    words = "--set post.val3.shoulder=lefty --set post.val3.elbow=epositive --set post.val3.wrist=wpositive"
    assert finding.message.endswith(f"or ask for it: {words}")
    (finding,) = told({"robot": "tx2-90"}, codes=[666], post=Krl)
    assert finding.message.endswith("or ask for it: lefty, epositive, wpositive")


def test_the_feed_that_the_joints_can_keep_is_told_and_keeps_them():
    program = loop(radius_mm=3.0)
    fast = replace(program, path=replace(program.path, feeds_mm_min=program.path.feeds_mm_min * 1000.0))
    options = ASKED | {"robot": "tx2-90", "max_axis_deg_s": "1e6"}
    (finding,) = told(options, fast, codes=[668])
    fits = float(re.search(r"; (\S+) mm/min would fit", finding.message)[1])
    slower = np.minimum(fast.path.feeds_mm_min, fits)
    assert not told(options, replace(fast, path=replace(fast.path, feeds_mm_min=slower)), codes=[668])
    slower = np.minimum(fast.path.feeds_mm_min, fits * 1.02)
    assert told(options, replace(fast, path=replace(fast.path, feeds_mm_min=slower)), codes=[668])


def test_rapid_moves_are_judged_at_their_own_speed():
    program = loop()
    rapid = replace(program, path=replace(program.path, rapid=np.ones(60, bool)))
    assert not told(ASKED | {"robot": "tx2-90"}, rapid, codes=[668])
    assert told(ASKED | {"robot": "tx2-90", "rapid_mm_s": "5000"}, rapid, codes=[668])
    assert not told(ASKED | {"robot": "tx2-90", "rapid_mm_s": "5000", "first_run": "true"}, rapid, codes=[668])


def test_the_world_is_that_of_the_controller_wherever_the_cell_was_measured():
    plate = {"world_origin": "base_plate", "shoulder_height_mm": "478", "cell": "550,0,378,0,0,0"}
    at_shoulder, at_plate = (told(ASKED | more | {"robot": "tx2-90"}) for more in ({}, plate))
    assert at_plate == at_shoulder
    wrong = told(ASKED | plate | {"shoulder_height_mm": "375", "robot": "tx2-90"}, codes=[669])
    assert [f.level for f in wrong].count(Level.WARN) == 1
    assert any("shoulder_height_mm is 375" in f.message for f in wrong)


def test_nothing_that_depends_on_its_place_is_judged_before_the_part_is_found():
    options = {"robot": "tx2-60", "work_box_mm": "0,0,0,1,1,1"}
    assert told(options, codes=[660, 664])
    assert told(options, replace(loop(), placed=False)) == []


def test_a_job_is_not_refused_for_where_its_nominal_path_would_lie():
    options = KNOWN | {"work_box_mm": "0,0,0,1,1,1"}
    job = SimpleNamespace(name="loop", post=("val3",), post_options={"val3": options})
    pipeline._check_posts(job, loop().path)
    with pytest.raises(PathError, match="feed 0"):
        pipeline._check_posts(job, replace(loop().path, feeds_mm_min=np.zeros(60)))


def test_the_work_box_stands_in_the_robot_s_world():
    assert not told({"work_box_mm": "470,-80,-100,630,80,-100"}, codes=[660])
    (finding,) = told({"work_box_mm": "471,-80,-100,630,80,-100"}, codes=[660])
    assert finding.level is Level.FAIL


def test_a_robot_that_is_not_known_and_a_broken_file_are_told_with_the_other_options(tmp_path):
    with pytest.raises(JobError) as caught:
        Val3({"robot": "tx3", "outputs": "AUXFUN"})
    assert any("robot 'tx3' is not known; known are " + ", ".join(arm_names()) in p for p in caught.value.problems)
    assert len(caught.value.problems) == 2
    file = tmp_path / "arm.toml"
    file.write_text('name = "x"\nworld = "shoulder"\n', encoding="utf-8")
    with pytest.raises(JobError) as caught:
        Val3({"robot": str(file)})
    assert [p.split(": ")[-1] for p in caught.value.problems] == [
        f"geometry_mm.{key} must be given"
        for key in ("shoulder_height", "shoulder_forward", "upper_arm", "forearm", "flange")
    ]


def test_a_users_own_arm_is_used(tmp_path):
    arm = load_arm("tx2-90")
    lengths = {
        name.removesuffix("_mm"): getattr(arm, name)
        for name in (
            "shoulder_height_mm",
            "shoulder_forward_mm",
            "elbow_side_mm",
            "upper_arm_mm",
            "forearm_mm",
            "flange_mm",
        )
    }
    folder = tmp_path / "Jörgs Zelle" / ("x" * 200)
    folder.mkdir(parents=True)
    file = folder / "arm.toml"
    lines = ['name = "Ours"', 'world = "shoulder"', "[geometry_mm]", *(f"{k} = {v}" for k, v in lengths.items())]
    file.write_text("\n".join([*lines, "[joint.3]", "lowest_deg = 0.0", "highest_deg = 60.0"]), encoding="utf-8")
    findings = told(ASKED | {"robot": str(file)})
    assert any(f.code == 665 and "joint 3 would come to" in f.message and "limit is 60" in f.message for f in findings)
    assert "the limits of joint 1" in findings[-1].message
