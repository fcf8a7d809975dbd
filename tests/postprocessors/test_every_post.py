"""What all posts must do alike: golden files, nasty text, numbers that are none, same bytes again."""

import dataclasses
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from post_programs import NASTY, nasty_program, path_of, program_of, simple_program, straight_program
from post_reread import load_val3

from sicp_cam.errors import JobError, PathError
from sicp_cam.model import Event, EventKind
from sicp_cam.rigid_motion import exponential
from sicp_postprocessors.apt import Apt
from sicp_postprocessors.fanuc_ls import FanucLs
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.krl import Krl
from sicp_postprocessors.path_csv import PathCsv
from sicp_postprocessors.rapid import Rapid
from sicp_postprocessors.robodk_csv import RoboDkCsv
from sicp_postprocessors.urscript import UrScript
from sicp_postprocessors.val3 import Val3

GOLDEN = Path(__file__).parents[1] / "golden" / "posts"
POSE = exponential(np.array([0.1, -0.2, 0.3, 100.0, -50.0, 25.0]), np.zeros(3))
LINKED = {
    "tool": "0,0,150,0,0,0",
    "cell": "500,0,200,0,0,90",
    "world_origin": "base_plate",
    "shoulder_height_mm": "478",
    "blend": "true",
    "max_points_per_array": "4",
    "max_moves_per_program": "3",
    "spindle_output": "BasicIO-1\\%Q0",
    "coolant_output": "BasicIO-1\\%Q1",
    "continue_input": "BasicIO-1\\%I0",
    "spindle_speed": "num",
    "log_messages": "true",
    "shoulder": "lefty",
}
LINKED_S6 = {
    "dialect": "s6",
    "spindle_output": "bOut0",
    "coolant_output": "bOut1",
    "continue_input": "bIn0",
    "outputs": "INSERT/X=bOut2:on",
}
CELL = {"tool": "0,0,150,0,0,0", "cell": "500,0,200,0,0,90", "self_test": "origin"}
PARTS = CELL | {"max_moves_per_program": "3", "split_cuts": "true"}
UNCERTAINTY = np.ma.array(np.arange(6) / 70.0, mask=[True, False, False, False, False, True])
TRUNNION = Path(__file__).parent / "machines" / "trunnion.toml"
PLAIN = {"dialect": "plain", "machine": str(TRUNNION), "part_zero_mm": "100,50,20", "tool_length_mm": 120}
CASES = {
    "apt": lambda: Apt().write(simple_program()),
    "apt-inch": lambda: Apt({"units": "inch", "wrap": True}).write(simple_program(T_scan_program=POSE)),
    "apt-nasty": lambda: Apt().write(nasty_program()),
    "csv": lambda: PathCsv().write(simple_program(columns={"u_mm": UNCERTAINTY})),
    "csv-nasty": lambda: PathCsv().write(nasty_program()),
    "gcode-vector": lambda: GCode().write(simple_program()),
    "gcode-rotary-ac": lambda: GCode({"orientation": "rotary", "line_numbers": 10}).write(simple_program()),
    "gcode-rotary-bc-inch": lambda: GCode(
        {"orientation": "rotary", "kinematics": "BC", "units": "inch", "program_number": 12, "work_offset": "G54"}
    ).write(simple_program()),
    "gcode-siemens": lambda: GCode({"orientation": "siemens"}).write(simple_program(T_scan_program=POSE)),
    "gcode-siemens-rotary": lambda: GCode(
        {"dialect": "siemens", "orientation": "rotary", "machine": "table-ab", "line_numbers": 5}
    ).write(simple_program()),
    "gcode-heidenhain": lambda: GCode({"dialect": "heidenhain", "machine": "table-bc", "wrap": "0..360"}).write(
        simple_program()
    ),
    "gcode-heidenhain-vector": lambda: GCode({"dialect": "heidenhain", "orientation": "vector"}).write(
        simple_program(T_scan_program=POSE)
    ),
    "gcode-haas": lambda: GCode({"dialect": "haas", "machine": "mixed-ac", "units": "inch"}).write(simple_program()),
    "gcode-linuxcnc": lambda: GCode({"dialect": "linuxcnc", "tcp_on": "M428", "tcp_off": "M429"}).write(
        simple_program()
    ),
    "gcode-linuxcnc-inverse": lambda: GCode(
        {"dialect": "linuxcnc", "inverse_time": True, "units": "inch", "max_axis_step_deg": 6, "work_offset": "G55"}
    ).write(simple_program()),
    "gcode-plain": lambda: GCode(PLAIN).write(simple_program()),
    "gcode-nasty": lambda: GCode().write(nasty_program()),
    "gcode-heidenhain-nasty": lambda: GCode({"dialect": "heidenhain"}).write(nasty_program()),
    "gcode-linuxcnc-nasty": lambda: GCode({"dialect": "linuxcnc"}).write(nasty_program()),
    "gcode-siemens-nasty": lambda: GCode({"orientation": "siemens"}).write(nasty_program()),
    "krl": lambda: Krl().write(simple_program()),
    "krl-parts": lambda: Krl(
        PARTS
        | {"spindle_output": "1", "coolant_output": "2", "outputs": "INSERT/X=7:on", "payload": "8.5,0,2,90"}
        | {"split": "files"}
    ).write(simple_program(T_scan_program=POSE)),
    "krl-subprograms": lambda: Krl(
        {"max_moves_per_program": "3", "split_cuts": "true", "split": "subprograms", "tool_number": 2, "base_number": 1}
        | {"status": 2, "turn": 35, "accel_m_s2": 1.5, "first_run": True}
    ).write(simple_program()),
    "krl-nasty": lambda: Krl().write(nasty_program()),
    "ls": lambda: FanucLs().write(simple_program()),
    "ls-parts": lambda: FanucLs(
        PARTS | {"spindle_output": "1", "coolant_output": "RO2", "frame_register": 99, "payload_schedule": 2}
    ).write(simple_program(T_scan_program=POSE)),
    "ls-nasty": lambda: FanucLs({"longest_name": 8, "rounding": "CD"}).write(nasty_program()),
    "rapid": lambda: Rapid().write(simple_program()),
    "rapid-modules": lambda: Rapid(
        PARTS | {"split": "modules", "spindle_output": "doSpindle", "coolant_output": "doCool", "payload": "8.5,0,2,90"}
    ).write(simple_program(T_scan_program=POSE)),
    "rapid-procedures": lambda: Rapid(
        {
            "max_moves_per_program": "3",
            "split_cuts": "true",
            "tool_name": "tSpindle",
            "wobj_name": "wFix",
            "entry": "run",
        }
        | {"configuration": "0,-1,0,1"}
    ).write(simple_program()),
    "rapid-nasty": lambda: Rapid().write(nasty_program()),
    "robodk": lambda: RoboDkCsv().write(simple_program()),
    "robodk-nasty": lambda: RoboDkCsv().write(nasty_program()),
    "ur": lambda: UrScript().write(simple_program()),
    "ur-parts": lambda: UrScript(
        PARTS
        | {"spindle_output": "1", "coolant_output": "tool_0", "payload": "1.5,0,2,60"}
        | {"spindle_speed": "aio", "spindle_speed_output": "0", "spindle_speed_scale": "0.00005"}
    ).write(simple_program(T_scan_program=POSE)),
    "ur-base": lambda: UrScript({"points": "base", "cell": "500,0,200,0,0,90", "installation_tcp": True}).write(
        simple_program(T_scan_program=POSE)
    ),
    "ur-nasty": lambda: UrScript().write(nasty_program()),
    "val3": lambda: Val3().write(simple_program()),
    "val3-linked": lambda: Val3(LINKED).write(simple_program(T_scan_program=POSE)),
    "val3-nasty": lambda: Val3().write(nasty_program()),
    "val3-per-move": lambda: Val3({"style": "per-move", "payload": "8.5,0,2,90"}).write(row_program()),
    "val3-loop": lambda: Val3({"style": "loop", "max_points_per_array": 9}).write(row_program()),
    "val3-s6": lambda: Val3(LINKED | LINKED_S6).write(simple_program(T_scan_program=POSE)),
    "val3-s6-loop": lambda: Val3({"dialect": "s6", "style": "loop", "first_run": True}).write(row_program()),
}
GCODE = [GCode(), GCode({"orientation": "rotary"}), GCode({"orientation": "siemens"})]
TABLES = [PathCsv(), RoboDkCsv()]
PROGRAMS = [*GCODE, Val3(), Apt(), Krl(), Rapid(), FanucLs(), UrScript()]
POSTS = [*TABLES, *PROGRAMS]
# Lines that hold text of the user: comments, messages, the name of the program, and files named after it.
TEXT = (
    *("(", ";", "//", "$$", "! ", "!", "# ", "PPRINT/", "PARTNO/", "<Data file=", "TPWrite", "MESSAGE[", "popup("),
    *("DEF ", "DEFDAT ", "MODULE ", "def ", "/PROG", "COMMENT ", "LINE_COUNT"),
)
NUMBERED = re.compile(r"^ *[0-9]+:")
NOTE = re.compile(r",[^,]*$")
EACH_POST = pytest.mark.parametrize("post", POSTS, ids=lambda p: f"{p.name}-{getattr(p.options, 'orientation', '')}")


def row_program():
    """Fourteen moves in a row, two of them a retract, with a pause: what loops are made of."""
    rapid = [move in (7, 8) for move in range(14)]
    feed = [600.0 if move < 4 else 900.0 for move in range(14)]
    return straight_program(14, feed=feed, rapid=rapid, spacing=5.0, events=(Event(11, EventKind.DWELL, 0.25),))


@pytest.mark.parametrize("case", CASES)
def test_golden_files(case):
    """Set SICP_REGENERATE_GOLDEN=1 to write them anew, and read the difference before you believe it."""
    files, folder = CASES[case](), GOLDEN / case
    if os.environ.get("SICP_REGENERATE_GOLDEN") == "1":
        shutil.rmtree(folder, ignore_errors=True)
        for file, content in files.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(content)
    golden = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert sorted(files) == sorted(golden)
    for file, content in files.items():
        assert content == golden[file], file


@EACH_POST
def test_same_program_same_bytes_and_nothing_is_changed(post):
    program = simple_program()
    before = program.path.tips_mm.copy()
    assert post.write(program) == type(post)(dataclasses.asdict(post.options)).write(simple_program())
    assert np.array_equal(before, program.path.tips_mm)


@EACH_POST
def test_nasty_text_changes_no_line_but_its_own(post):
    nasty = nasty_program()
    plain_events = tuple(dataclasses.replace(event, text="x") for event in nasty.path.events)
    plain = dataclasses.replace(
        nasty, name="x", notes=("x", "x", "x"), path=dataclasses.replace(nasty.path, events=plain_events)
    )
    nasty_files, plain_files = post.write(nasty), post.write(plain)

    def statements(files):
        by_kind = sorted(files.items(), key=lambda item: (item[0].rsplit(".", 1)[1], item[0]))
        lines = [line for _, content in by_kind for line in content.decode("utf-8-sig").splitlines()]
        if post.name == "robodk":
            return [NOTE.sub("", x) for x in lines]
        plain_lines = [NUMBERED.sub("", x).strip() for x in lines]
        return [x for x in plain_lines if not x.startswith(TEXT)]

    assert statements(nasty_files) == statements(plain_files)


@EACH_POST
def test_nasty_text_is_plain_in_every_file(post):
    for file, content in post.write(nasty_program()).items():
        text = content.decode("utf-8-sig")
        assert text.isascii() and "\x1b" not in text and "\x07" not in text
        assert not {"/../", "\\", ":", "\n"} & set(file)
        if post.name == "gcode":
            for line in text.splitlines():
                body = line.strip("%")
                assert body.count("(") == body.count(")") <= 1 and "%" not in body
                assert not line.lower().startswith("(msg")


def test_nasty_text_leaves_val3_well_formed():
    app = load_val3(Val3().write(nasty_program()))
    assert app.name == "HelloRobotsNext"
    assert sum("Hello" in line for line in app.code["start"]) == 5
    assert all(line.startswith("//") for line in app.code["start"] if "Hello" in line)


@pytest.mark.parametrize("post", PROGRAMS, ids=lambda p: f"{p.name}-{getattr(p.options, 'orientation', '')}")
def test_every_program_says_once_what_made_it_and_that_it_is_no_safety_function(post):
    text = b"".join(post.write(simple_program()).values()).decode("utf-8-sig")
    assert re.search(r"^\s*(\(|;|//|\$\$|!|#| *[0-9]+:  !) ?porthole( ;)?\)?\r?$", text, re.MULTILINE)
    assert text.count("not a safety function") == text.count("corrected by sicp_cam") == 1


@EACH_POST
def test_the_changed_name_is_told(post):
    told = [f for f in post.preflight(nasty_program()) if f.code == 609]
    assert len(told) == 1 and "\n" not in told[0].message


@EACH_POST
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_none_are_refused(post, bad):
    for program in (
        straight_program(3, feed=[600, bad, 600]),
        straight_program(3, events=(Event(1, EventKind.DWELL, bad),)),
        straight_program(3, events=(Event(1, EventKind.SPINDLE, bad),)),
        straight_program(3, columns={"u": np.array([0, bad, 0])}),
    ):
        with pytest.raises(PathError, match=f"post {post.name} refuses 'porthole': "):
            post.write(program)


@EACH_POST
@pytest.mark.parametrize(("array", "bad"), [("tips_mm", np.nan), ("tips_mm", 1e22), ("axes", np.nan), ("axes", np.inf)])
def test_numbers_that_slip_past_the_model_are_refused(post, array, bad):
    program = straight_program(3)
    broken = getattr(program.path, array).copy()
    broken[1] = bad
    object.__setattr__(program.path, array, broken)
    with np.errstate(invalid="ignore"), pytest.raises(PathError, match="move 1, line 11"):
        post.write(program)


@EACH_POST
def test_tiny_numbers_have_no_sign_and_no_exponent(post):
    axes = [[-1e-9, 1e-12, 1.0], [0.0, -1e-9, 1.0]]
    program = program_of(path_of([[-0.00004, 1e-9, -0.0], [1e-7, -1e-7, 0.0]], axes, 600.0, [True, False]))
    for content in post.write(program).values():
        text = content.decode("utf-8-sig")
        assert "-0.0000" not in text.replace("-0.00001", "") and "e-" not in text.lower()


@EACH_POST
def test_empty_paths_are_refused(post):
    with pytest.raises(PathError, match="no moves"):
        post.write(program_of(path_of(np.zeros((0, 3)), np.zeros((0, 3)))))


@EACH_POST
def test_one_move_is_a_program(post):
    assert post.write(program_of(path_of([[1, 2, 3]], [[0, 0, 1]], 100.0)))


@EACH_POST
def test_unknown_options_are_job_errors(post):
    with pytest.raises(JobError, match=f"post {post.name} has no option 'blnd'"):
        type(post)({"blnd": 1})


@pytest.mark.parametrize("post", PROGRAMS, ids=lambda p: f"{p.name}-{getattr(p.options, 'orientation', '')}")
def test_a_cut_without_feed_is_refused_with_its_line_and_remedy(post):
    with pytest.raises(PathError, match=r"move 2, line 12: cutting move with feed 0; .*--set path\.feed_mm_min="):
        post.write(straight_program(4, feed=[0, 600, 0, 600]))


@pytest.mark.parametrize("post", PROGRAMS, ids=lambda p: f"{p.name}-{getattr(p.options, 'orientation', '')}")
def test_words_of_another_dialect_are_told_and_not_written(post):
    told = [f for f in post.preflight(simple_program()) if f.code == 610]
    assert len(told) == 1 and "INSERT/X" in told[0].message and told[0].where == "before move 5, line 13"
    assert not any(b"INSERT" in content for content in post.write(simple_program()).values())


def test_the_nasty_text_is_the_one_meant():
    assert "\n" in NASTY and "]]>" in NASTY


@pytest.mark.parametrize("before", [0, 2])
@pytest.mark.parametrize("post", [GCode(), Val3()], ids=lambda post: post.name)
def test_a_tool_change_that_leaves_the_spindle_off_in_a_cut_is_refused(post, before):
    on, change = Event(0, EventKind.SPINDLE, 9000.0, line=2), Event(before, EventKind.TOOL, 3.0, line=3)
    again = Event(before, EventKind.SPINDLE, 9000.0, line=4)
    by_hand = post.name == "val3" and before == 0  # the tool that the path begins with is in the hand of the robot
    if not by_hand:
        with pytest.raises(PathError, match=f"before move {before}, line 3: cuts with the spindle off after a tool"):
            post.write(straight_program(4, events=(on, change)))
    assert post.write(straight_program(4, events=(on, change, again)))
    assert post.write(straight_program(4, events=(change,)))
    after = Event(4, EventKind.TOOL, 3.0, line=3)
    assert post.write(straight_program(4, events=(on, after)))
