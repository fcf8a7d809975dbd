import dataclasses

import numpy as np
import pytest
from post_programs import leaning_axes, path_of, program_of, simple_program, straight_program
from post_reread import axis_error_deg, read_gcode

from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.gcode.along import angles_along

DIALECTS = [
    {},
    {"units": "inch"},
    {"orientation": "rotary"},
    {"orientation": "rotary", "kinematics": "BC", "line_numbers": 5},
    {"orientation": "siemens"},
    {"orientation": "siemens", "units": "inch", "line_numbers": 10},
]


def text_of(files):
    (content,) = files.values()
    return content.decode("ascii")


@pytest.mark.parametrize("options", DIALECTS, ids=str)
def test_program_reads_back(options):
    program = simple_program()
    result = read_gcode(GCode(options).write(program), options.get("kinematics", "AC"))
    assert np.abs(np.array(result.tips) - program.path.tips_mm).max() < 1e-3
    assert axis_error_deg(np.array(result.axes), program.path.axes) < 1e-3
    assert np.allclose(result.feeds, program.path.feeds_mm_min, rtol=1e-5)
    assert result.rapid == program.path.rapid.tolist()


def test_events_stand_in_their_place():
    actions = [a for a in read_gcode(GCode().write(simple_program())).actions if a[0] != "comment" or "first" in a[1]]
    assert actions == [
        *[("code", code) for code in ("G21", "G90", "G94", "G17", "G40")],
        ("code", "G49"),
        ("tool", 3),
        ("code", "M6"),
        ("code", "G435"),
        ("code", "M3"),
        ("speed", 12000.0),
        ("move", 0),
        ("code", "M8"),
        ("move", 1),
        ("comment", "(first side)"),
        ("move", 2),
        ("dwell", 1.5),
        ("move", 3),
        ("code", "M0"),
        ("move", 4),
        ("move", 5),
        ("code", "M9"),
        ("code", "M5"),
        ("code", "G49"),
        ("code", "M30"),
    ]


def test_what_still_runs_is_switched_off_at_the_end():
    events = (Event(0, EventKind.SPINDLE, -500.0), Event(0, EventKind.COOLANT, 1.0))
    lines = text_of(GCode().write(straight_program(2, events=events))).splitlines()
    assert "S500 M4" in lines
    assert lines[-5:] == ["M5", "M9", "G49", "M30", "%"]


def test_feed_stands_where_it_changes_and_after_rapid_moves():
    program = straight_program(6, feed=[0, 100, 100, 200, 0, 200], rapid=[True, False, False, False, True, False])
    lines = [x for x in text_of(GCode().write(program)).splitlines() if x.startswith(("G0", "G1"))]
    assert [x.split("F")[1] if "F" in x else "" for x in lines] == ["", "100.", "", "200.", "", "200."]


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, "G4 X0.250"),
        ({"dialect": "haas"}, "G4 P0.250"),
        ({"dialect": "linuxcnc"}, "G4 P0.250"),
        ({"dwell": "X"}, "G4 X0.250"),
        ({"dwell": "P_MS"}, "G4 P250"),
        ({"orientation": "siemens"}, "G4 F0.250"),
    ],
)
def test_dwell_words(options, line):
    text = text_of(GCode(options).write(straight_program(2, events=(Event(1, EventKind.DWELL, 0.25),))))
    assert line in text.splitlines()
    assert ("dwell in milliseconds" in text) == (options.get("dwell") == "P_MS")


def test_words_of_the_site_replace_those_of_the_dialect():
    options = {"tcp_on": "M428", "tcp_off": "M429", "orientation": "rotary", "work_offset": "G54", "program_number": 7}
    lines = text_of(GCode(options).write(straight_program(2))).splitlines()
    assert lines[:2] == ["%", "O0007"]
    assert "G54" in lines and "M428" in lines and lines[-3:] == ["M429", "M30", "%"]


def test_tool_word_of_the_start():
    assert "G43.5 H4" in text_of(GCode({"tool": 4}).write(straight_program(2))).splitlines()
    assert "G43.5" in text_of(GCode().write(straight_program(2))).splitlines()


def test_frame_of_the_program_is_told_and_written():
    pose = np.eye(4)
    pose[:3, 3] = 1.5, -2.0, 0.25
    program = simple_program(T_scan_program=pose)
    (told,) = [f for f in GCode().preflight(program) if f.code == 612]
    assert told.level is Level.WARN and "work offset" in told.message
    assert "origin 1.5 -2 0.25 mm, rotation rows 1 0 0 / 0 1 0 / 0 0 1" in text_of(GCode().write(program)).replace(
        ")\n(", " "
    )


@pytest.mark.parametrize(
    "options",
    [{"decimals": 2}, {"tcp_on": "G43 (x)"}, {"orientation": "euler"}, {"program_number": 0},
     {"tilt_limits_deg": "9,1"}, {"orientation": "siemens", "program_number": 1}, {"units": "m"}],
)  # fmt: skip
def test_options_out_of_range(options):
    with pytest.raises(JobError):
        GCode(options)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, "(Fanuc G43.5 type 2: I J K points from the tip to the holder)"),
        ({"orientation": "rotary"}, "(Fanuc G43.4 type 1: rotary words AC, head-head)"),
        ({"orientation": "ROTARY", "kinematics": "bc"}, "(Fanuc G43.4 type 1: rotary words BC, head-head)"),
        ({"orientation": "siemens"}, "; Siemens 840D TRAORI: A3 B3 C3 points from the tip to the holder"),
        ({"orientation": "rotary", "tcp_on": "M428"}, "(tool tip control M428: rotary words AC, head-head)"),
        ({"tcp_on": "G43.5{tool}"}, "(tool tip control G43.5: I J K points from the tip to the holder)"),
    ],
)
def test_the_head_names_the_control_and_what_its_words_mean(options, line):
    lines = text_of(GCode(options).write(simple_program())).splitlines()
    assert line in lines
    assert sum("G43" in x or "TRAORI" in x or "M428" in x for x in lines if x[0] in "(;") == 1


def test_the_head_stands_between_the_program_number_and_the_modes():
    lines = text_of(GCode({"program_number": 5, "work_offset": "G55"}).write(straight_program(2))).splitlines()
    assert lines[:3] == ["%", "O0005", "(porthole)"]
    modes = lines.index("G21 G90 G94 G17 G40")
    assert all(line.startswith("(") for line in lines[2:modes]) and lines[modes + 1 : modes + 3] == ["G55", "G43.5"]
    assert "(coordinates in the scan frame: the work offset G55 must hold it)" in lines[2:modes]


@pytest.mark.parametrize(("moved", "frame"), [(False, "scan"), (True, "part")])
def test_a_program_without_work_offset_says_what_the_active_one_must_hold(moved, frame):
    pose = np.eye(4)
    pose[0, 3] = 5.0 * moved
    program = simple_program(T_scan_program=pose)
    (told,) = [f for f in GCode().preflight(program) if f.code == 623]
    assert told.level is Level.INFO and f"those of the {frame} frame" in told.message
    assert told.message.endswith("--set post.gcode.work_offset=G54")
    assert f"(coordinates in the {frame} frame: the active work offset must hold it)" in text_of(GCode().write(program))
    assert [f for f in GCode({"work_offset": "G54"}).preflight(program) if f.code == 623] == []


def test_flags_carry_the_name_of_the_post():
    class Cell(GCode):
        name = "cell_2"

    post = Cell({"orientation": "rotary", "tilt_limits_deg": "-10,10"})
    told = [f.message for f in post.preflight(simple_program())]
    assert any("--set post.cell_2.work_offset=G54" in message for message in told)
    assert any("--set post.cell_2.tilt_limits_deg=lowest,highest" in message for message in told)


class TestRotary:
    def test_hold_is_told_with_its_error(self):
        axes = leaning_axes(5, lean=1e-4, turn=3.0)
        post = GCode({"orientation": "rotary", "singular_cone_deg": 0.01})
        program = program_of(path_of(np.eye(5)[:, :3], axes, 600.0, [True] + [False] * 4))
        (told,) = [f for f in post.preflight(program) if f.code == 620]
        assert told.where == "moves 0 to 4, lines 10 to 14" and "at most 0.00" in told.message
        result = read_gcode(post.write(program))
        assert axis_error_deg(np.array(result.axes), axes) <= 0.01

    def test_travel_is_kept(self):
        post = GCode({"orientation": "rotary", "tilt_limits_deg": "-10,10"})
        with pytest.raises(PathError, match="moves 0 to 5, lines 10 to 15: A leaves its travel -10 to 10"):
            post.write(simple_program())
        turning = GCode({"orientation": "rotary", "turn_limits_deg": "-20,20"})
        with pytest.raises(PathError, match="C leaves its travel"):
            turning.write(simple_program())

    def test_a_fast_turn_is_a_warning(self):
        axes = leaning_axes(4, lean=0.001, turn=3.0)
        program = program_of(path_of(np.eye(4)[:, :3], axes, 600.0, [True] + [False] * 3))
        told = [f for f in GCode({"orientation": "rotary"}).preflight(program) if f.code == 622]
        assert [f.where for f in told] == ["moves 1 to 3, lines 11 to 13"] and told[0].level is Level.WARN

    def test_words_that_miss_the_axis_are_stopped(self, monkeypatch):
        monkeypatch.setattr("sicp_postprocessors.gcode.positions.angles_along", lambda *a: _off(angles_along(*a)))
        with pytest.raises(PathError, match="move 0, line 10: the words miss the tool axis"):
            GCode({"orientation": "rotary"}).write(simple_program())


def _off(angles):
    return dataclasses.replace(angles, deg=angles.deg + np.array([0.0, 0.001]))
