"""Kinematics files: those of the package, and what is said of a user's own."""

import pytest

from sicp_cam.errors import JobError
from sicp_postprocessors.arm import arm_from_text, arm_names, load_arm

GOOD = """
name = "My arm"
world = "base_plate"
[geometry_mm]
shoulder_height = 400
shoulder_forward = 50.0
upper_arm = 300.0
forearm = 310.0
flange = 80.0
[joint.1]
lowest_deg = -170
highest_deg = 170
[joint.2]
fastest_deg_s = 200
sign = -1
straight_up_deg = 90.0
"""


def problems_of(text):
    with pytest.raises(JobError) as caught:
        arm_from_text(text, "my.toml")
    assert all(problem.startswith("robot file my.toml: ") for problem in caught.value.problems)
    return [problem.removeprefix("robot file my.toml: ") for problem in caught.value.problems]


@pytest.mark.parametrize("name", arm_names())
def test_every_number_of_our_arms_has_a_source(name):
    arm = load_arm(name)
    assert {subject for subject, _ in arm.sources} == {"geometry", "limits", "speeds", "world", "signs"}
    assert all(len(text) > 20 for _, text in arm.sources)
    assert arm.name.isascii()
    assert arm.world == "shoulder"


def test_the_arms_of_the_issue_are_there():
    assert {"rx170", "rx160", "tx2-90"} <= set(arm_names())
    assert load_arm("TX2-90L").forearm_mm == 550.0


def test_what_a_file_leaves_out_is_not_checked_and_told():
    arm = arm_from_text(GOOD, "my.toml")
    assert arm.elbow_side_mm == arm.forearm_offset_mm == 0.0
    assert arm.joints[1].sign == -1
    assert arm.unknown()[:3] == ["the speed of joint 1", "the limits of joint 2", "the limits of joint 3"]
    assert load_arm("tx2-90").unknown() == []
    assert load_arm("rx170").unknown() == ["joint 6, which is the spindle"]


def test_every_problem_of_a_file_is_told_at_once():
    text = """
name = "ü"
world = "floor"
colour = "red"
remark = 7
[geometry_mm]
shoulder_height = "high"
shoulder_forward = nan
upper_arm = -3
reach = 4
forearm = 2e9
[joint.1]
lowest_deg = 10
highest_deg = -10
[joint.2]
lowest_deg = -10
[joint.3]
fastest_deg_s = 0
spindle = true
[joint.4]
sign = 2
lowst_deg = 3
[joint.7]
[sources]
geometry = 3
"""
    assert problems_of(text) == [
        "colour is not known; known are name, world, remark, geometry_mm, joint, sources",
        "name must be a text of printable ASCII",
        "remark must be a text of printable ASCII, on one line",
        "world must be shoulder or base_plate",
        "geometry_mm.reach is not known; known are shoulder_height, shoulder_forward, elbow_side, upper_arm, "
        "forearm_offset, forearm, flange",
        "geometry_mm.shoulder_height must be a number",
        "geometry_mm.shoulder_forward must be a number",
        "geometry_mm.upper_arm must be larger than 0",
        "geometry_mm.forearm must lie within 100000",
        "geometry_mm.flange must be given",
        "joint.7 is not known; known are 1, 2, 3, 4, 5, 6",
        "joint.1.lowest_deg must be less than joint.1.highest_deg",
        "joint.2.lowest_deg and joint.2.highest_deg belong together; give both or neither",
        "joint.3.spindle must be false, or true for joint 6",
        "joint.3.fastest_deg_s must be larger than 0",
        "joint.4.lowst_deg is not known; known are lowest_deg, highest_deg, fastest_deg_s, sign, straight_up_deg, "
        "spindle",
        "joint.4.sign must be 1 or -1",
        "sources.geometry must be a text",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("name = ", "Invalid value (at end of document)"),
        (GOOD.replace("-170", "9" * 400), "joint.1.lowest_deg must lie within 36000"),
        (GOOD.replace("-170", "-inf"), "joint.1.lowest_deg must lie within 36000"),
        (GOOD + "[joint.1]", "Cannot declare"),
        (GOOD.partition("[joint.1]")[0] + "joint = 3", "geometry_mm.joint is not known"),
        ("joint = 3\n" + GOOD.partition("[joint.1]")[0], "joint must be a table"),
    ],
)
def test_what_is_no_table_is_told(text, problem):
    assert any(problem in told for told in problems_of(text))


def test_an_unknown_robot_is_answered_with_the_known_ones():
    with pytest.raises(JobError, match=r"robot 'rx999' is not known; known are rx160, .*, or give a file NAME.toml"):
        load_arm("rx999")


def test_a_file_is_read_beside_the_job(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("﻿" + GOOD, encoding="utf-8")
    assert load_arm(str(file)).name == "My arm"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file"),
        (b"\xff\xfe", "byte 0: it is not UTF-8"),
        (b"#" * 70_000, "has more than 65536 bytes"),
        (b"name = " + b"[" * 60_000, "nested too deeply"),
        (b"name = " + b"9" * 60_000, "Exceeds the limit"),
        (b'name = "x"\nworld = oops\n', "Invalid value .at line 2"),
    ],
)
def test_a_file_that_cannot_be_one_is_told(tmp_path, content, words):
    file = tmp_path / "mine.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(JobError, match=words):
        load_arm(str(file))


@pytest.mark.parametrize("name", ["\0.toml", ".toml", "x\n.toml"])
def test_a_strange_file_name_is_told_on_one_line(name):
    with pytest.raises(JobError) as caught:
        load_arm(name)
    assert "\n" not in str(caught.value)
