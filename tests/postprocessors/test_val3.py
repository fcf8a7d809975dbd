import re

import numpy as np
import pytest
from post_programs import leaning_axes, path_of, program_of, simple_program, straight_program
from post_reread import axis_error_deg, load_val3, read_val3
from scipy.spatial.transform import Rotation

from sicp_cam.errors import JobError, OutputError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_postprocessors.moves import divided_at_retracts
from sicp_postprocessors.orientations import (
    angles_from_axes,
    euler_angles,
    flange_turns_deg,
    pose_from_six,
    rotation_matrices,
    six_from_pose,
)
from sicp_postprocessors.val3 import Val3, application_name
from sicp_postprocessors.val3.xml import S7, Variable

MOVES = ("movej", "movel")
STOPPED = ["resetMotion()", "doSpindle=false", "doCoolant=false"]
PLACED = {"tool": "0,0,150,0,0,0", "cell": "0,0,0,0,0,0"}
TEST_VECTOR = np.array(
    [[0.813798, -0.469846, 0.342020], [0.543838, 0.823173, -0.163176], [-0.204874, 0.318796, 0.925417]]
)


def codes(post, program):
    """Return the codes of the findings, without 669, which tells what is not checked."""
    return [f.code for f in post.preflight(program) if f.code != 669]


class TestEuler:
    def test_the_published_vector(self):
        assert np.abs(rotation_matrices(np.array([[10.0, 20.0, 30.0]]))[0] - TEST_VECTOR).max() < 5e-7
        assert np.allclose(euler_angles(TEST_VECTOR), (10, 20, 30), atol=1e-4)

    def test_against_scipy(self):
        angles = np.random.default_rng(2).uniform(-180, 180, size=(500, 3))
        angles[:100, 1] = np.repeat([90.0, -90.0], 50)
        R = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
        assert np.allclose(rotation_matrices(angles), R, atol=1e-14)
        again = rotation_matrices(np.array([euler_angles(r) for r in R]))
        assert np.allclose(again, R, atol=1e-12)

    def test_six_numbers_and_back(self):
        six = (1.0, -2.0, 3.0, 10.0, 20.0, 30.0)
        assert np.allclose(six_from_pose(pose_from_six(six)), six)
        assert np.allclose(pose_from_six(six)[:3, :3], TEST_VECTOR, atol=5e-7)

    def test_tool_z_is_against_the_axis_and_x_follows_the_spin(self):
        axes = leaning_axes(20)
        for spin in (0.0, 35.0, -170.0):
            angles = angles_from_axes(axes, spin, transport=False)
            assert np.allclose(-rotation_matrices(angles)[:, :, 2], axes)
            assert np.allclose(angles[:, 2], spin)

    def test_through_the_gimbal_the_flange_does_not_jump(self):
        lean = np.radians(np.linspace(70, 110, 41))
        axes = -np.column_stack([np.sin(lean), np.zeros(41), np.cos(lean)])
        angles = angles_from_axes(axes, 0.0, transport=False)
        R = rotation_matrices(angles)
        assert np.allclose(R[:, :, 2], -axes) and np.abs(angles[:, 1]).max() <= 90.0
        assert (np.einsum("nij,nij->n", R[1:], R[:-1]) > 1 + 2 * np.cos(np.radians(1.01))).all()
        assert flange_turns_deg(angles).max() < 1e-6

    def test_transport_turns_no_more_than_the_axis(self):
        axes = -leaning_axes(300, lean=0.02, turn=2 * np.pi)[:, [2, 0, 1]]
        fixed = flange_turns_deg(angles_from_axes(axes, 5.0, transport=False)).sum()
        carried = angles_from_axes(axes, 5.0, transport=True)
        assert fixed > 350.0 and flange_turns_deg(carried).max() < 1e-6 and carried[0, 2] == pytest.approx(5.0)
        assert np.allclose(-rotation_matrices(carried)[:, :, 2], axes)


class TestFrame:
    POSE = pose_from_six((100.0, -20.0, 30.0, 10.0, 20.0, 30.0))

    def test_frame_is_cell_times_program_frame(self):
        cell = (500.0, 1.0, 2.0, -15.0, 90.0, 5.0)
        app = load_val3(Val3({"cell": cell}).write(simple_program(T_scan_program=self.POSE)))
        assert np.abs(app.pose("fPart") - pose_from_six(cell) @ self.POSE).max() < 1e-6
        assert app.data["fPart"][0]["fatherId"] == "world[0]"

    def test_cell_measured_from_the_base_plate_is_lowered_to_the_shoulder(self):
        options = {"world_origin": "base_plate", "shoulder_height_mm": 375}
        app = load_val3(Val3(options).write(simple_program(T_scan_program=self.POSE)))
        assert np.allclose(app.pose("fPart")[:3, 3], [100.0, -20.0, 30.0 - 375.0])

    def test_tool_pose(self):
        app = load_val3(Val3({"tool": (1, 2, 150, 0, 0, 45)}).write(straight_program(2)))
        assert app.data["tTool"][0] == {
            "x": "1", "y": "2", "z": "150", "rx": "0", "ry": "0", "rz": "45",
            "fatherId": "flange[0]", "ioLink": "valve1",
        }  # fmt: skip

    def test_far_frames_are_refused(self):
        with pytest.raises(PathError, match=r"program frame .*--set post\.val3\.cell="):
            Val3({"cell": "1e8,0,0,0,0,0"}).write(simple_program())

    @pytest.mark.parametrize("spin", ["fixed", "transport"])
    def test_an_axis_that_turns_round_is_followed(self, spin):
        axes = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0], [-1, 1e-9, 0], [-1, -1e-9, 0]])
        program = program_of(path_of(np.eye(5)[:, :3], axes, 600.0, [True] + [False] * 4))
        _, result = read_val3(Val3({"spin": spin}).write(program))
        assert axis_error_deg(np.array(result.axes), axes) < 1e-3

    def test_angles_that_miss_the_axis_are_refused(self, monkeypatch):
        exact = Val3.angles_deg
        monkeypatch.setattr(Val3, "angles_deg", lambda post, path: exact(post, path) + 0.01)
        with pytest.raises(PathError, match="moves 0 to 5, lines 10 to 15: rx, ry, rz miss the tool axis"):
            Val3().write(simple_program())


class TestProgram:
    @pytest.mark.parametrize(
        "options",
        [{}, {"max_moves_per_program": 2}, {"max_points_per_array": 4}, {"spin_deg": 40, "spin": "transport"}],
        ids=str,
    )
    def test_reads_back(self, options):
        program = simple_program()
        _, result = read_val3(Val3(options).write(program))
        assert np.abs(np.array(result.tips) - program.path.tips_mm).max() < 1e-3
        assert axis_error_deg(np.array(result.axes), program.path.axes) < 1e-3
        assert result.rapid == program.path.rapid.tolist()
        cuts = ~program.path.rapid
        assert np.allclose(np.array(result.feeds)[cuts], program.path.feeds_mm_min[cuts], rtol=1e-6)

    def test_events_wait_for_the_end_of_the_move(self):
        linked = {"spindle_output": "B\\%Q0", "coolant_output": "B\\%Q1"}
        _, result = read_val3(Val3(linked | PLACED).write(simple_program()))
        actions = [a for a in result.actions if a[0] != "comment" or a[1] in ("first side", "tool 3 LOADTL/3")]
        told = [(kind, value["index"]) if kind in MOVES else (kind, value) for kind, value in actions]
        assert told == [
            ("resetMotion", None),
            ("comment", "tool 3 LOADTL/3"),
            ("waitEndMove", None),
            ("output", ("doSpindle", "true")),
            ("delay", ("2",)),
            ("movej", 0),
            ("waitEndMove", None),
            ("output", ("doCoolant", "true")),
            ("movel", 1),
            ("comment", "first side"),
            ("movel", 2),
            ("waitEndMove", None),
            ("delay", ("1.5",)),
            ("movel", 3),
            ("waitEndMove", None),
            ("reset", ("bContinue",)),
            ("operator", ("bContinue", None)),
            ("movel", 4),
            ("movel", 5),
            ("waitEndMove", None),
            ("output", ("doCoolant", "false")),
            ("waitEndMove", None),
            ("output", ("doSpindle", "false")),
            ("waitEndMove", None),
        ]

    def test_speeds_are_mm_per_second(self):
        app, result = read_val3(Val3({"rapid_mm_s": 300}).write(simple_program()))
        moves = [value["mdesc"] for kind, value in result.actions if kind in MOVES]
        assert [m["tmax"] for m in moves] == ["300", "33.333333", "33.333333", "15", "15", "300"]
        assert [m["vel"] for m in moves] == ["10"] + ["100"] * 5
        assert {(m["tmax"], m["blend"]) for m in app.data["mCut"]} == {
            ("33.333333", "Cartesian"), ("33.333333", "off"), ("15", "off")
        }  # fmt: skip

    def test_first_run_caps_every_speed_and_blends_nothing(self):
        post = Val3({"first_run": True, "first_run_mm_s": 20, "blend": "true"})
        app, result = read_val3(post.write(simple_program()))
        moves = [value["mdesc"] for kind, value in result.actions if kind in MOVES]
        assert [float(m["tmax"]) for m in moves] == [20, 20, 20, 15, 15, 20]
        assert {m["blend"] for m in moves} == {"off"}
        assert any("first run" in line for line in app.code["start"])

    def test_names_are_short_unique_and_declared(self):
        app = load_val3(Val3({"max_moves_per_program": 3, "max_points_per_array": 2}).write(simple_program()))
        names = [app.name, *app.data, *app.code]
        assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,14}", name) for name in names)
        assert len({name.lower() for name in names}) == len(names)

    def test_only_words_that_both_controllers_know(self):
        code = "\n".join(load_val3(Val3({"log_messages": True}).write(simple_program())).code["start"])
        assert not re.search(r"\b(putln|userPage|gotoxy|cls|popUpMsg)\b", code)
        assert 'logMsg("stop: STOP")' in code

    def test_first_point_has_the_chosen_configuration(self):
        post = Val3({"shoulder": "lefty", "elbow": "epositive", "wrist": "wnegative"})
        points = load_val3(post.write(simple_program())).data["pPath"]
        assert [points[0][n] for n in ("shoulder", "elbow", "wrist")] == ["lefty", "epositive", "wnegative"]
        assert {tuple(p[n] for n in ("shoulder", "elbow", "wrist")) for p in points[1:]} == {
            ("ssame", "esame", "wsame")
        }

    def test_head_of_the_program(self):
        post = Val3({"cell": "0,0,0,0,0,0", "world_origin": "base_plate", "shoulder_height_mm": 478})
        head = " ".join(load_val3(post.write(simple_program())).code["start"]).replace("// ", "")
        for words in (
            "porthole",
            "gates: all passed",
            "not a safety function: verify at reduced speed",
            "478 mm below",
        ):
            assert words in head
        assert "at the shoulder" in " ".join(load_val3(Val3().write(simple_program())).code["start"])

    SHOULDER = "the robot's world is at the shoulder (axes 1 and 2), not on the base plate"

    @pytest.mark.parametrize(
        ("pose", "options", "frame", "world"),
        [
            (
                np.eye(4),
                {},
                "fPart is the pose of the scan frame; no cell is given, so the scan frame is taken as the "
                "robot's world",
                SHOULDER,
            ),
            (
                TestFrame.POSE,
                {},
                "fPart is the pose of the part in the scan frame; no cell is given, so the scan frame is taken as the "
                "robot's world",
                SHOULDER,
            ),
            (
                np.eye(4),
                {"cell": "1,2,3,0,0,0"},
                "fPart is the pose of the scan frame in the robot's world: the option cell",
                f"{SHOULDER}; cell was measured from the shoulder",
            ),
            (
                TestFrame.POSE,
                {"cell": "1,2,3,0,0,0", "world_origin": "base_plate", "shoulder_height_mm": 375},
                "fPart is the pose of the part in the robot's world: the option cell times its pose in the scan frame",
                f"{SHOULDER}, which is 375 mm below; cell was measured from there, and fPart is shifted by that",
            ),
            (
                np.eye(4),
                {"world_origin": "base_plate", "shoulder_height_mm": 375},
                "so the scan frame is taken as the robot's world",
                f"{SHOULDER}, which is 375 mm below; the scan frame is taken to lie there, and fPart is shifted by "
                "that",
            ),
        ],
        ids=["scan", "part", "scan, cell", "part, cell from the plate", "plate without cell"],
    )
    def test_the_head_says_what_the_frame_is(self, pose, options, frame, world):
        program = straight_program(2, T_scan_program=pose)
        head = " ".join(x.removeprefix("// ") for x in load_val3(Val3(options).write(program)).code["start"])
        assert f"{frame} {world} points: mm" in head

    def test_stop_switches_off(self):
        linked = {"spindle_output": "B\\%Q0", "coolant_output": "B\\%Q1"}
        assert load_val3(Val3(linked).write(simple_program())).code["stop"] == STOPPED
        assert load_val3(Val3().write(simple_program())).code["stop"] == ["resetMotion()"]
        assert load_val3(Val3().write(straight_program(2))).code["stop"] == ["resetMotion()"]
        speed = {"spindle_speed": "aio", "spindle_speed_output": "B\\%A0", "spindle_speed_scale": 0.001}
        assert load_val3(Val3(speed).write(simple_program())).code["stop"] == ["resetMotion()", "aioSet(aoSpindle,0)"]


class TestSplit:
    def test_stretches_follow_one_another_and_keep_the_limit(self):
        rapid = np.random.default_rng(3).random(500) < 0.05
        for longest in (1, 2, 7, 100, 499, 500, 501):
            stretches = divided_at_retracts(rapid, longest, within_cuts=True)
            assert [i for s in stretches for i in s] == list(range(500))
            assert max(map(len, stretches)) <= longest

    def test_cuts_lie_before_rapid_moves_where_there_are_any(self):
        rapid = np.arange(100) % 20 == 0
        assert all(rapid[s.start] for s in divided_at_retracts(rapid, 30, within_cuts=True))

    def test_split_program_does_the_same(self):
        program = simple_program()
        _, whole = read_val3(Val3().write(program))
        for options in ({"max_moves_per_program": 1}, {"max_moves_per_program": 4, "max_points_per_array": 3}):
            files = Val3(options).write(program)
            _, split = read_val3(files)
            assert split.tips == whole.tips
            strip = [(k, v["mdesc"] | v["point"] if k in MOVES else v) for k, v in split.actions]
            assert strip == [(k, v["mdesc"] | v["point"] if k in MOVES else v) for k, v in whole.actions]
            assert any("move001.pgx" in file for file in files)

    def test_limits_hold(self):
        options = {"max_moves_per_program": 50, "max_points_per_array": 30, "split_cuts": True}
        app = load_val3(Val3(options).write(straight_program(120)))
        assert [len(app.data[n]) for n in app.data if n.startswith("pPath")] == [30] * 4
        counts = [sum("move" in x and "(pPath" in x for x in code) for code in app.code.values()]
        assert max(counts) <= 50 and sum(counts) == 120


class TestBlend:
    def moves(self, program, **options):
        _, result = read_val3(Val3(options).write(program))
        return [value["mdesc"] for kind, value in result.actions if kind in MOVES]

    def test_never_more_than_half_of_the_shorter_neighbour(self):
        x = np.cumsum([0, 10, 10, 3, 0.2, 0.2, 50, 0, 5, 5, 5])
        path = path_of(np.column_stack([x, 0 * x, 0 * x]), [[0, 0, 1]] * 11, 600.0, [True] + [False] * 10)
        moves = self.moves(program_of(path), blend_mm=4)
        lengths = np.diff(x)
        for i in range(1, 10):
            half = min(lengths[i - 1], lengths[i]) / 2
            assert float(moves[i]["reach"]) <= half and moves[i]["leave"] == moves[i]["reach"]
            assert moves[i]["blend"] == ("Cartesian" if float(moves[i]["reach"]) > 0 else "off")
        assert float(moves[1]["reach"]) == 4.0 and moves[4]["reach"] == "0.0625" and moves[6]["blend"] == "off"
        assert moves[0]["blend"] == moves[10]["blend"] == "off"

    def test_not_before_events_and_rapid_moves(self):
        events = (Event(3, EventKind.DWELL, 1.0), Event(5, EventKind.COMMENT, 0.0, "x"))
        program = straight_program(9, rapid=[0, 0, 0, 0, 0, 0, 0, 1, 0], spacing=10.0, events=events)
        blends = [m["blend"] for m in self.moves(program)]
        assert [i for i, b in enumerate(blends) if b == "Cartesian"] == [1, 3, 4, 5]

    def test_a_finely_divided_contour_runs_through_by_default(self):
        events = (Event(200, EventKind.DWELL, 1.0),)
        moves = self.moves(straight_program(520, spacing=2.0, events=events))
        assert [i for i, m in enumerate(moves) if m["blend"] == "off"] == [0, 199, 519]
        assert {(m["leave"], m["reach"]) for m in moves if m["blend"] == "Cartesian"} == {("0.5", "0.5")}
        assert [f.code for f in Val3().preflight(straight_program(520, spacing=2.0)) if f.code == 639] == []

    def test_a_large_blend_is_made_smaller_and_not_left_out(self):
        moves = self.moves(straight_program(20, spacing=0.01), blend_mm=100)
        assert {m["blend"] for m in moves[1:-1]} == {"Cartesian"}
        assert all(0.001 <= float(m["reach"]) <= 0.005 for m in moves[1:-1])

    def test_the_head_tells_of_blending_where_there_is_some(self):
        def blended(**options):
            return [x for x in load_val3(Val3(options).write(straight_program(9))).code["start"] if "blended" in x]

        assert blended(blend_mm=0.25) == ["// points between cuts are blended: within 0.25 mm, corners cut by 0.05 mm"]
        assert blended(blend="off") == blended(first_run=True) == []

    @pytest.mark.parametrize(
        ("options", "level", "flag"),
        [
            ({"blend": "off"}, Level.WARN, "--set post.val3.blend=true"),
            ({"first_run": True}, Level.INFO, "--set post.val3.first_run=false"),
            ({"first_run": True, "blend": "off"}, Level.INFO, "--set post.val3.first_run=false"),
        ],
        ids=str,
    )
    def test_stops_within_cuts_are_counted(self, options, level, flag):
        events = (Event(100, EventKind.DWELL, 1.0), Event(101, EventKind.COMMENT, 0.0, "x"))
        program = straight_program(520, events=events)
        (told,) = [f for f in Val3(options).preflight(program) if f.code == 639]
        assert told.level is level and "stops at 517 points" in told.message and told.message.endswith(flag)
        assert told.where == "moves 1 to 518, lines 11 to 528"
        assert 639 not in codes(Val3(options), straight_program(12))

    def test_points_too_close_to_blend_are_told(self):
        tips = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]], float)
        program = program_of(path_of(tips, [[0, 0, 1]] * 6, 600.0, [True] + [False] * 5))
        (told,) = [f for f in Val3().preflight(program) if f.code == 639]
        assert (told.level, told.where) == (Level.INFO, "moves 2 to 3, lines 12 to 13")
        assert "stops at 2 points" in told.message and "double points" in told.message
        single = np.delete(tips, 3, axis=0)
        assert 639 not in codes(Val3(), program_of(path_of(single, [[0, 0, 1]] * 5, 600.0, [True] + [False] * 4)))

    @pytest.mark.parametrize("turn_deg", [20.0, 90.0, 150.0, 180.0])
    @pytest.mark.parametrize(("options", "most_mm"), [({}, 0.05), ({"blend_corner_mm": 0.2}, 0.2)], ids=str)
    def test_corners_are_cut_by_no_more_than_allowed(self, turn_deg, options, most_mm):
        turn = np.radians(turn_deg)
        after = np.array([np.cos(turn), np.sin(turn), 0.0])
        tips = np.array([[-20, 0, 0], [-10, 0, 0], [0, 0, 0], 10 * after, 20 * after])
        moves = self.moves(program_of(path_of(tips, [[0, 0, 1]] * 5, 600.0, [True] + [False] * 4)), **options)
        reach = float(moves[2]["reach"])
        cut = np.linalg.norm(reach * (after - [1.0, 0.0, 0.0]) / 2.0)
        assert moves[2]["blend"] == "Cartesian" and cut <= most_mm + 1e-9
        assert cut > most_mm / 2 or reach == 0.5
        assert moves[1]["reach"] == moves[3]["reach"] == "0.5"


class TestSpindleAndTools:
    def test_defaults_tell_what_is_not_set(self):
        found = codes(Val3(), simple_program())
        assert found == [610, 630, 631, 632, 632, 634]

    def test_what_is_not_set_is_told_with_the_flag_that_sets_it(self):
        class Cell(Val3):
            name = "cell_2"

        told = {f.code: f.message for f in Cell().preflight(simple_program())}
        assert told[630].endswith("--set post.cell_2.tool=x,y,z,rx,ry,rz")
        assert told[631].endswith("--set post.cell_2.cell=x,y,z,rx,ry,rz")
        assert "--set post.cell_2.spindle_speed=aio" in told[634]
        links = [f.message for f in Cell().preflight(simple_program()) if f.code == 632]
        for kind, message in zip(("spindle", "coolant"), links, strict=True):
            assert f"--set post.cell_2.{kind}_output=OUTPUT" in message
        plate = {"world_origin": "base_plate", "shoulder_height_mm": 375}
        assert any("taken as the robot's base plate" in f.message for f in Val3(plate).preflight(simple_program()))

    def test_a_complete_cell_is_quiet(self):
        options = {
            "tool": "0,0,100,0,0,0",
            "cell": "0,0,0,0,0,0",
            "spindle_output": "BasicIO-1\\%Q0",
            "coolant_output": "BasicIO-1\\%Q1",
            "spindle_speed": "num",
        }
        assert codes(Val3(options), simple_program()) == [610]
        app = load_val3(Val3(options).write(simple_program()))
        assert app.data["doSpindle"] == [{"link": "BasicIO-1\\%Q0"}]

    def test_counter_clockwise_needs_an_output(self):
        program = straight_program(3, events=(Event(1, EventKind.SPINDLE, -9000.0, line=4),))
        with pytest.raises(
            PathError, match=r"before move 1, line 4: .*counter-clockwise.*--set post\.val3\.spindle_ccw_output="
        ):
            Val3().write(program)
        app, result = read_val3(Val3({"spindle_output": "B\\%Q0", "spindle_ccw_output": "B\\%Q1"}).write(program))
        outputs = [value for kind, value in result.actions if kind == "output"]
        off = [("doSpindleCcw", "false"), ("doSpindle", "false")]
        assert outputs == [("doSpindle", "false"), ("doSpindleCcw", "true"), *off]
        assert app.code["stop"] == ["resetMotion()", "doSpindle=false", "doSpindleCcw=false"]

    def test_speed_by_analog_output(self):
        options = {"spindle_speed": "aio", "spindle_speed_output": "B\\%A0", "spindle_speed_scale": 0.001}
        app, result = read_val3(Val3(options).write(simple_program()))
        assert ("analog", ("aoSpindle", "12")) in result.actions and app.types["aoSpindle"] == "aio"

    def test_an_analog_speed_without_its_scale_is_refused(self):
        """18000 rev/min must not become 18000 volts."""
        with pytest.raises(JobError, match=r"one rev/min; give --set post\.val3\.spindle_speed_scale="):
            Val3({"spindle_speed": "aio", "spindle_speed_output": "B\\%A0"})
        with pytest.raises(JobError) as caught:
            Val3({"spindle_speed": "AIO"})
        assert len(caught.value.problems) == 2
        _, result = read_val3(Val3({"spindle_speed": "num"}).write(simple_program()))
        assert ("number", ("nSpindle", "12000")) in result.actions

    def test_a_spindle_that_no_output_starts_is_started_by_the_operator(self):
        events = (
            Event(0, EventKind.SPINDLE, 5000.0),
            Event(1, EventKind.COOLANT, 1.0),
            Event(3, EventKind.SPINDLE, 0.0),
        )
        app, result = read_val3(Val3(PLACED).write(straight_program(3, events=events)))
        assert not any(name.startswith("do") for name in app.data)
        start = result.actions.index(("comment", "stop: start spindle cw, 5000 rev/min"))
        assert [kind for kind, _ in result.actions[start + 1 : start + 4]] == ["reset", "operator", "movej"]
        told = [value for kind, value in result.actions if kind == "comment"]
        assert "coolant on: no output is named for it" in told and "spindle off: no output is named for it" in told
        # A drive that a speed starts needs no output; one direction alone does not stand for the other.
        speed = {"spindle_speed": "aio", "spindle_speed_output": "B\\%A0", "spindle_speed_scale": 0.001}
        _, result = read_val3(Val3(speed | PLACED).write(straight_program(3, events=events)))
        assert ("analog", ("aoSpindle", "5")) in result.actions and "operator" not in dict(result.actions)
        with pytest.raises(PathError, match=r"turns the spindle clockwise; .*--set post\.val3\.spindle_output="):
            Val3(PLACED | {"spindle_ccw_output": "B\\%Q1"}).write(straight_program(3, events=events))

    def test_an_arm_whose_tool_or_cell_is_not_stated_waits_for_the_operator(self):
        for options, words in (
            ({}, ["stop: teach tool and cell, not stated"]),
            ({"tool": PLACED["tool"]}, ["stop: teach cell, not stated"]),
            ({"cell": PLACED["cell"]}, ["stop: teach tool, not stated"]),
            (PLACED, []),
        ):
            _, result = read_val3(Val3(options).write(straight_program(3)))
            first = [kind for kind, _ in result.actions].index("movej")
            told = [value for kind, value in result.actions[:first] if kind == "comment" and value.startswith("stop")]
            assert told == words and ("operator" in [kind for kind, _ in result.actions[:first]]) is bool(words)

    def test_a_later_tool_stops_the_spindle_and_waits(self):
        events = (
            Event(0, EventKind.TOOL, 1.0),
            Event(0, EventKind.SPINDLE, 5000.0),
            Event(2, EventKind.TOOL, 2.0),
            Event(2, EventKind.SPINDLE, 6000.0),
        )
        program = straight_program(4, events=events)
        _, result = read_val3(Val3({"continue_input": "B\\%I0", "spindle_output": "B\\%Q0"}).write(program))
        assert [v["tool"] for k, v in result.actions if k in MOVES] == ["tTool1"] * 2 + ["tTool2"] * 2
        change = result.actions.index(("comment", "tool 2"))
        assert result.actions[change - 2 : change + 5] == [
            ("waitEndMove", None),
            ("output", ("doSpindle", "false")),
            ("comment", "tool 2"),
            ("waitEndMove", None),
            ("comment", "stop: tool 2"),
            ("operator", ("diContinue", "false")),
            ("operator", ("diContinue", "true")),
        ]
        assert {636, 638} <= set(codes(Val3(), program))

    def test_cutting_with_the_spindle_left_off_is_refused(self):
        events = (Event(0, EventKind.SPINDLE, 5000.0), Event(2, EventKind.TOOL, 2.0, line=9))
        with pytest.raises(PathError, match="before move 2, line 9: cuts with the spindle off"):
            Val3().write(straight_program(4, events=events))
        after_the_cut = (*events, Event(3, EventKind.SPINDLE, 5000.0))
        with pytest.raises(PathError, match="cuts with the spindle off"):
            Val3().write(straight_program(4, events=after_the_cut))
        before_it = (*events, Event(3, EventKind.SPINDLE, 5000.0))
        assert Val3().write(straight_program(4, rapid=[1, 1, 1, 0], events=before_it))

    def test_a_swinging_flange_is_told(self):
        axes = -leaning_axes(5, lean=0.001, turn=3.0)[:, [2, 0, 1]]
        program = program_of(path_of(np.eye(5)[:, :3], axes, 600.0, [True] + [False] * 4))
        told = [f for f in Val3().preflight(program) if f.code == 635]
        assert [f.where for f in told] == ["moves 1 to 4, lines 11 to 14"] and told[0].level is Level.WARN
        assert told[0].message.endswith("--set post.val3.spin=transport")
        assert 635 not in codes(Val3({"spin": "transport"}), program)


@pytest.mark.parametrize(
    ("name", "written"),
    [("porthole", "porthole"), ("trim_porthole", "trimporthole"), ("7up", "P7up"), ("stop", "stopApp"),
     ("EndIf", "EndIfApp"), ("CON", "CONApp"), ("é", "e"), ("😀", "Program"),
     ("a" * 40, "a" * 15), ('a"b<&>\n.pjx', "abpjx"), ("%s{0}", "s0")],
)  # fmt: skip
def test_application_names(name, written):
    assert application_name(name) == written


@pytest.mark.parametrize(
    "options",
    [{"world_origin": "base_plate"}, {"shoulder_height_mm": 5}, {"spindle_speed": "aio"}, {"decimals": 3},
     {"version": 's7"><x'}, {"tool": "1,2,3"}, {"max_moves_per_program": 0}, {"approach_percent": 0},
     {"blend": "joint"}, {"spindle_speed": "aio", "spindle_speed_output": "A", "spindle_speed_scale": 0},
     {"spindle_output": "a\x01b"}],
)  # fmt: skip
def test_options_that_do_not_fit(options):
    with pytest.raises(JobError):
        Val3(options)


def test_links_are_escaped():
    app = load_val3(Val3({"spindle_output": 'a"<&>\\%Q0'}).write(simple_program()))
    assert app.data["doSpindle"] == [{"link": 'a"<&>\\%Q0'}]


@pytest.mark.parametrize("text", ["\x01", "\ufffe", "\ud800", "\x00"])
def test_characters_that_xml_forbids_are_refused(text):
    with pytest.raises(OutputError, match="forbids"):
        S7().data_file([Variable("x", "num", [{"value": text}])])
    with pytest.raises(OutputError, match="forbids"):
        S7().program_file("start", [f"// {text}"])


def test_the_end_mark_of_code_is_refused():
    with pytest.raises(OutputError, match="program start holds ]]>"):
        S7().program_file("start", ["// ]]>"])


def test_a_link_may_not_have_a_name_of_the_program_itself():
    with pytest.raises(JobError, match="'doSpindle' is a name of the program's own"):
        Val3({"dialect": "s6", "spindle_output": "doSpindle", "outputs": "M51=doSpindle:on"})
