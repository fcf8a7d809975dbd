"""What each dialect must hold, what is refused, and what the operator is told."""

import re
from pathlib import Path

import numpy as np
import pytest
from gcode_reread import axes_of_words, read_blocks, read_program, tips_of_words, vectors_of
from post_programs import leaning_axes, nasty_program, path_of, program_of, simple_program, straight_program
from post_reread import axis_error_deg

from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_postprocessors.gcode import GCode

TRUNNION = str(Path(__file__).parent / "machines" / "trunnion.toml")
PLAIN = {"dialect": "plain", "machine": TRUNNION, "part_zero_mm": "100,50,20"}
TABLE = [("C", (0, 0, 1), (10.0, 20.0, -30.0), "table"), ("A", (1, 0, 0), (0.0, 20.0, -75.0), "table")]
ALL = {
    "fanuc": {},
    "fanuc-rotary": {"orientation": "rotary"},
    "siemens": {"dialect": "siemens"},
    "siemens-rotary": {"dialect": "siemens", "orientation": "rotary"},
    "heidenhain": {"dialect": "heidenhain"},
    "heidenhain-vector": {"dialect": "heidenhain", "orientation": "vector"},
    "haas": {"dialect": "haas"},
    "linuxcnc": {"dialect": "linuxcnc"},
    "plain": PLAIN,
}
EACH = pytest.mark.parametrize("name", ALL)


def text_of(files):
    return next(iter(files.values())).decode("ascii")


def lines_of(options, program):
    return text_of(GCode(options).write(program)).splitlines()


def told(options, program, code):
    return [finding for finding in GCode(options).preflight(program) if finding.code == code]


@EACH
def test_every_dialect_reads_back(name):
    program = simple_program()
    post = GCode(ALL[name])
    blocks = read_program(post.write(program), ALL[name].get("dialect", "fanuc"))
    xyz, turn, feeds, rapid = blocks.arrays()
    path = program.path
    if name == "plain":
        tips, axes = tips_of_words(TABLE, turn, xyz, np.array([100.0, 50.0, 20.0]), 0.0), axes_of_words(TABLE, turn)
        met = np.linalg.norm(tips[:, None] - path.tips_mm[None], axis=2).argmin(axis=0)
        lengths = np.append(1.0, np.linalg.norm(np.diff(tips, axis=0), axis=1))
        feeds = np.where(rapid, 0.0, feeds * lengths)
        xyz, feeds, rapid, axes = tips[met], feeds[met], rapid[met], axes[met]
    elif "C" in turn[0]:
        axes = axes_of_words([("C", (0, 0, 1)), ("A", (1, 0, 0))], turn)
    else:
        axes = vectors_of(turn)
    assert np.abs(xyz - path.tips_mm).max() < 1e-3 and axis_error_deg(axes, path.axes) < 1e-3
    assert np.array_equal(rapid, path.rapid)
    assert np.allclose(feeds[~rapid], path.feeds_mm_min[~rapid], rtol=1e-4)


@EACH
def test_nasty_text_changes_no_line_but_its_own(name):
    def moves(program):
        post = GCode(ALL[name])
        blocks = read_program(post.write(program), ALL[name].get("dialect", "fanuc"))
        return [a for a in blocks.actions if a[0] != "comment"], [line.partition("L ")[2] for line in blocks.lines]

    nasty = moves(nasty_program())
    assert len(nasty[1]) >= 2 and all(re.fullmatch(r"[A-Z0-9 =+.%_-]*", line) for line in nasty[1])
    assert all("active" not in str(action) for action in nasty[0])


@EACH
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(name, bad):
    program = straight_program(3)
    broken = program.path.tips_mm.copy()
    broken[1, 2] = bad
    object.__setattr__(program.path, "tips_mm", broken)
    with np.errstate(invalid="ignore"), pytest.raises(PathError, match="move 1, line 11"):
        GCode(ALL[name]).write(program)


@EACH
def test_the_same_bytes_again_from_a_post_that_wrote_before(name):
    post, other = GCode(ALL[name]), simple_program()
    first = post.write(simple_program())
    post.write(nasty_program())
    assert post.write(other) == first == GCode(ALL[name]).write(other)


class TestHeidenhain:
    def test_every_line_has_the_next_number_and_the_name_is_that_of_the_file(self):
        files = GCode({"dialect": "heidenhain"}).write(simple_program())
        lines = text_of(files).splitlines()
        assert list(files) == ["PORTHOLE.H"]
        assert lines[0] == "0 BEGIN PGM PORTHOLE MM" and lines[-1].endswith(" END PGM PORTHOLE MM")
        assert [int(line.split()[0]) for line in lines] == list(range(len(lines)))

    def test_the_speed_stands_in_the_tool_call(self):
        lines = [line.split(" ", 1)[1] for line in lines_of({"dialect": "heidenhain"}, simple_program())]
        call = lines.index("TOOL CALL 3 Z S12000")
        assert lines[call - 1] == "M129" and lines[call + 1 : call + 5] == ["; LOADTL/3", "M127", "M128", "M3"]

    def test_a_speed_alone_is_a_tool_call_without_number(self):
        events = (Event(0, EventKind.SPINDLE, 500.0), Event(1, EventKind.SPINDLE, -900.0))
        lines = [
            line.split(" ", 1)[1] for line in lines_of({"dialect": "heidenhain"}, straight_program(2, events=events))
        ]
        assert "TOOL CALL S500" in lines and "TOOL CALL S900" in lines and "M4" in lines

    def test_vectors_stand_in_every_block_in_order_with_seven_decimals(self):
        lines = lines_of({"dialect": "heidenhain", "orientation": "vector"}, simple_program())
        moves = [line for line in lines if " LN " in line]
        word = r"[+-][0-9]+\.[0-9]{7}"
        assert len(moves) == 6
        for line in moves:
            found = re.search(rf"NX({word}) NY({word}) NZ({word}) TX({word}) TY({word}) TZ({word})", line)
            assert found and found.groups()[:3] == found.groups()[3:]

    def test_what_it_does_not_know_is_refused(self):
        for options in ({"units": "inch"}, {"inverse_time": True}, {"program_number": 1}, {"dwell": "P"}):
            with pytest.raises(JobError, match="heidenhain"):
                GCode({"dialect": "heidenhain", **options})


class TestWords:
    def test_haas_has_a_number_of_five_digits(self):
        lines = lines_of({"dialect": "haas"}, simple_program())
        assert lines[:2] == ["%", "O00001"] and "G234 H3" in lines

    def test_siemens_says_how_orientations_are_read(self):
        vector, rotary = (
            lines_of({"dialect": "siemens", "orientation": o}, simple_program()) for o in ("vector", "rotary")
        )
        assert vector[vector.index("TRAORI") + 1] == "ORIWKS ORIVECT"
        assert rotary[rotary.index("TRAORI") + 1] == "ORIWKS ORIAXES"
        assert list(GCode({"dialect": "siemens"}).write(simple_program())) == ["porthole.mpf"]

    def test_linuxcnc_has_no_words_that_it_does_not_know(self):
        known = {"G0", "G1", "G4", "G17", "G21", "G40", "G43", "G49", "G64", "G90", "G94"}
        text = "\n".join(line for line in lines_of({"dialect": "linuxcnc"}, simple_program()) if line[0] != "(")
        assert set(re.findall(r"G[0-9.]+", text)) <= known and not re.search(r"[IJK]", text)

    def test_the_words_of_the_site_stand_beside_the_tool_length(self):
        lines = lines_of({"dialect": "linuxcnc", "tcp_on": "M428", "tcp_off": "M429"}, simple_program())
        tool = lines.index("T3 M6")
        assert lines[tool - 2 : tool] == ["M429", "G49"] and lines[tool + 2 : tool + 4] == ["G43 H3", "M428"]

    def test_linuxcnc_without_words_for_its_kinematics_is_a_warning(self):
        named = {"dialect": "linuxcnc", "machine": "head-ac"}
        (warning,) = told(named, simple_program(), 626)
        assert warning.level is Level.WARN and "--set post.gcode.tcp_on=M428" in warning.message
        assert not told({**named, "tcp_on": "M428"}, simple_program(), 626)

    @pytest.mark.parametrize(("name", "file"), [("2nd tür", "PR_P2ndtur"), ("x", "PR_x"), ("a-b_c", "ab_c")])
    def test_siemens_names_begin_with_two_letters(self, name, file):
        program = program_of(simple_program().path, name=name)
        (written,) = GCode({"dialect": "siemens"}).write(program)
        assert written == f"{file}.mpf"

    def test_what_reads_the_programs_back_is_told_the_axes(self):
        assert GCode({"dialect": "haas", "machine": "table-bc"}).reading() == {"rotary": "BC"}
        assert GCode({"dialect": "siemens"}).reading() == {}
        assert GCode({"dialect": "heidenhain"}).reading() == {"rotary": "AC"}
        for options in ({"dialect": "haas", "machine": "nutating-head-bc"}, PLAIN):
            assert isinstance(GCode(options).reading(), str)

    @pytest.mark.parametrize(("ends", "count"), [("lf", 0), ("crlf", 1)])
    def test_line_ends(self, ends, count):
        (content,) = GCode({"line_ends": ends}).write(simple_program()).values()
        assert content.count(b"\r\n") == count * content.count(b"\n") and content.endswith(b"\n")

    def test_block_numbers_begin_again(self):
        lines = lines_of({"line_numbers": 100}, straight_program(1200))
        numbers = [int(line[1:].split()[0]) for line in lines if line[0] == "N"]
        assert max(numbers) == 99_900 and numbers[999:1001] == [100, 200]

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"dialect": "haas", "orientation": "vector"}, "'orientation' must be rotary for dialect haas"),
            ({"dialect": "haas", "orientation": "siemens"}, "siemens is not one of dialect haas"),
            ({"dialect": "siemens", "program_number": 5}, "'program_number' has no meaning for dialect siemens"),
            ({"dialect": "plain"}, "name a machine FILE.toml with point_mm"),
            ({"dialect": "plain", "machine": TRUNNION}, "'part_zero_mm' is needed"),
            ({"dialect": "plain", "machine": "head-ac"}, "'tool_length_mm' is needed"),
            ({"tip_control": "off"}, "'tip_control' off needs orientation rotary"),
            ({"orientation": "rotary", "machine": "lathe"}, "machine 'lathe' is not known"),
            ({"max_moves_per_program": 100}, "needs 'program_number'"),
            ({"wrap": "270"}, "must be one of auto, none, 0..360, +-180"),
            ({"max_axis_step_deg": 0}, "from 0.01 to 180"),
        ],
    )
    def test_options_that_do_not_fit(self, options, words):
        with pytest.raises(JobError) as caught:
            GCode(options)
        assert words in str(caught.value)


class TestTravel:
    def test_limits_are_told_with_the_line(self):
        program = simple_program()
        with pytest.raises(PathError, match=r"moves 0 to 5, lines 10 to 15: A leaves its travel -10 to 10 degrees"):
            GCode({"dialect": "haas", "tilt_limits_deg": "-10,10"}).write(program)

    def test_a_cut_of_many_turns_names_the_move_at_which_the_travel_ends_and_what_helps(self):
        axes = leaning_axes(400, turn=4 * np.pi)
        path = path_of(np.eye(400)[:, :3] * 50, axes, 600.0, np.arange(400) == 0)
        options = {"dialect": "linuxcnc", "turn_limits_deg": "-200,200"}
        (failed,) = told(options, program_of(path), 621)
        assert failed.level is Level.FAIL and "retract there in CAM" in failed.message
        assert re.fullmatch(r"moves [0-9]+ to 399, lines [0-9]+ to 409", failed.where)
        rapid = np.arange(400) % 100 == 0
        retracting = program_of(path_of(np.eye(400)[:, :3] * 50, axes, 600.0, rapid))
        assert not told(options, retracting, 621)
        turn = read_program(GCode(options).write(retracting), "linuxcnc").turn
        assert np.abs([row["C"] for row in turn]).max() <= 200.0

    def test_a_head_that_would_turn_over_within_a_cut_is_refused(self):
        axes = leaning_axes(300, turn=3.0)
        program = program_of(path_of(np.eye(300)[:, :3] * 50, axes, 600.0, np.arange(300) == 0))
        options = {"dialect": "linuxcnc", "machine": "head-bc", "turn_limits_deg": "-100,100"}
        (failed,) = told(options, program, 621)
        assert failed.where.startswith("move ") and "turn over within a cut" in failed.message

    def test_a_direction_out_of_reach_is_refused(self):
        axes = np.array([[0, 0, 1.0], [0.6, 0, 0.8], [0.6, 0, -0.8]])
        program = program_of(path_of(np.eye(3), axes, 600.0, True))
        with pytest.raises(PathError, match=r"move 2, line 12: the machine head-head, C carries B .* 53\.13"):
            GCode({"dialect": "haas", "machine": "nutating-head-bc"}).write(program)

    def test_linear_travel(self):
        options = PLAIN | {"tool_length_mm": 120}
        assert not told(options, simple_program(), 629)
        far = simple_program()
        moved = path_of(far.path.tips_mm + np.array([600.0, 0, 0]), far.path.axes, 600.0, True)
        failed = told(options, program_of(moved), 629)
        assert failed and all(f.level is Level.FAIL for f in failed)
        assert any("leaves its travel -400 to 400 mm" in f.message for f in failed)
        (unchecked,) = told({"dialect": "haas", "machine": TRUNNION}, simple_program(), 629)
        assert unchecked.level is Level.INFO and "post.gcode.part_zero_mm" in unchecked.message


class TestWrap:
    @pytest.mark.parametrize(("wrap", "low", "high"), [("0..360", 0.0, 360.0), ("+-180", -180.0, 180.0)])
    def test_words_stay_within_a_turn_and_point_the_same_way(self, wrap, low, high):
        axes = leaning_axes(300, turn=20.0)
        program = program_of(path_of(np.eye(300)[:, :3] * 50, axes, 600.0, np.arange(300) == 0))
        options = {"dialect": "haas", "machine": "table-bc", "wrap": wrap}
        turn = read_program(GCode(options).write(program), "haas").turn
        c = np.array([row["C"] for row in turn])
        assert low <= c.min() and c.max() <= high and c.max() < 360.0 and np.ptp(c) > 300.0
        assert axis_error_deg(axes_of_words([("C", (0, 0, 1)), ("B", (0, 1, 0))], turn), axes) < 1e-3
        (warning,) = told({**options, "tool": 1}, program, 626)
        assert "C is written within one turn" in warning.message

    def test_heidenhain_goes_the_shorter_way_itself(self):
        options = {"dialect": "heidenhain", "machine": "table-bc", "wrap": "0..360"}
        assert not told(options, simple_program(), 626)
        assert any(line.endswith(" M126") for line in lines_of(options, simple_program()))

    def test_an_angle_that_rounds_to_a_full_turn_is_zero(self):
        axes = leaning_axes(2, turn=-1e-9)
        program = program_of(path_of(np.eye(2, 3), axes, 600.0, True))
        turn = read_program(
            GCode({"dialect": "haas", "machine": "table-bc", "wrap": "0..360"}).write(program), "haas"
        ).turn
        assert [row["C"] for row in turn] == [0.0, 0.0]


class TestDivision:
    PROGRAM = program_of(
        path_of(
            [[0, 0, 0], [10, 0, 0], [20, 0, 0], [20, 0, 50]],
            leaning_axes(4, lean=0.8, turn=1.5),
            [0, 600, 600, 0],
            [True, False, False, True],
            (Event(2, EventKind.COMMENT, 0.0, "second"),),
        )
    )

    @pytest.mark.parametrize("orientation", ["vector", "rotary"])
    def test_points_lie_on_the_line_and_axes_on_the_great_circle(self, orientation):
        options = {"orientation": orientation, "max_axis_step_deg": 2}
        blocks = read_program(GCode(options).write(self.PROGRAM), "fanuc")
        xyz, turn, feeds, rapid = blocks.arrays()
        axes = (
            vectors_of(turn) if orientation == "vector" else axes_of_words([("C", (0, 0, 1)), ("A", (1, 0, 0))], turn)
        )
        assert len(xyz) >= 20 and rapid.sum() == 2 and np.allclose(feeds[~rapid], 600.0)
        cuts = xyz[1:-1]
        assert np.allclose(cuts[:, 1:], 0.0) and (np.diff(cuts[:, 0]) > 0).all() and 10.0 in cuts[:, 0]
        path = self.PROGRAM.path
        for move in (1, 2):
            normal = np.cross(path.axes[move - 1], path.axes[move])
            within = (xyz[:-1, 0] >= path.tips_mm[move - 1, 0]) & (xyz[:-1, 0] <= path.tips_mm[move, 0])
            assert np.abs(axes[:-1][within] @ normal).max() < 1e-5
        if orientation == "rotary":
            steps = np.abs(np.diff([[row["A"], row["C"]] for row in turn], axis=0))[:-1]
            assert steps.max() <= 2.0 + 1e-3
        else:
            steps = np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", axes[1:-1], axes[:-2]), -1, 1)))
            assert steps.max() <= 2.0 + 1e-3
        at = blocks.actions.index(("comment", "second"))
        assert blocks.actions[at - 1][0] == "move" and xyz[blocks.actions[at - 1][1]][0] == 10.0

    def test_it_is_told(self):
        (info,) = told({"orientation": "rotary", "max_axis_step_deg": 2}, self.PROGRAM, 625)
        assert info.level is Level.INFO and info.message.startswith("2 cutting moves divided by ")
        assert not told({"orientation": "rotary"}, self.PROGRAM, 625)

    def test_findings_name_the_moves_of_the_path_and_not_their_pieces(self):
        options = {"orientation": "rotary", "max_axis_step_deg": 2, "tilt_limits_deg": "-10,10"}
        with pytest.raises(PathError, match="moves 0 to 3, lines 10 to 13: A leaves"):
            GCode(options).write(self.PROGRAM)

    def test_an_axis_that_turns_to_its_opposite_has_no_way(self):
        program = program_of(path_of(np.eye(2, 3), [[0, 0, 1], [0, 0, -1]], 600.0, [True, False]))
        with pytest.raises(PathError, match="move 1, line 11: the tool axis turns to its opposite"):
            GCode({"orientation": "rotary", "max_axis_step_deg": 2}).write(program)

    def test_a_path_that_would_grow_too_long_is_refused(self):
        axes = np.tile(leaning_axes(2, lean=5.0, turn=3.0), (300, 1))
        program = program_of(path_of(np.eye(600)[:, :3], axes, 600.0, np.arange(600) == 0))
        with pytest.raises(PathError, match=r"the divided path would have [0-9]+ moves; allow larger steps"):
            GCode({"max_axis_step_deg": 0.01}).write(program)


class TestWithoutTipControl:
    def test_the_tip_stays_on_its_way_between_the_blocks(self):
        t = np.linspace(0, 1.2, 7)
        tips = np.column_stack([100 * t, 20 * t, 0 * t])
        program = program_of(path_of(tips, leaning_axes(7, lean=0.4, turn=1.2), 900.0, np.arange(7) == 0))
        blocks = read_program(GCode(PLAIN | {"tip_tolerance_mm": 0.005}).write(program), "plain")
        xyz, turn = np.array(blocks.xyz), np.array([[row["C"], row["A"]] for row in blocks.turn])
        zero, worst = np.array([100.0, 50.0, 20.0]), 0.0
        for share in np.linspace(0, 1, 9):
            # All axes move evenly within a block: the tip must not leave the line from point to point by more.
            deg = turn[:-1] + share * np.diff(turn, axis=0)
            words = [{"C": c, "A": a} for c, a in deg]
            at = tips_of_words(TABLE, words, xyz[:-1] + share * np.diff(xyz, axis=0), zero, 0.0)
            ends = tips_of_words(TABLE, blocks.turn, xyz, zero, 0.0)
            way = np.diff(ends, axis=0)
            way /= np.linalg.norm(way, axis=1, keepdims=True)
            worst = max(worst, np.linalg.norm(np.cross(at - ends[:-1], way), axis=1).max())
        assert 0.0005 < worst < 0.006

    def test_the_tip_keeps_its_feed_by_inverse_time(self):
        program = simple_program()
        blocks = read_program(GCode(PLAIN).write(program), "plain")
        assert blocks.inverse
        tips = tips_of_words(TABLE, blocks.turn, np.array(blocks.xyz), np.array([100.0, 50.0, 20.0]), 0.0)
        lengths = np.linalg.norm(np.diff(tips, axis=0), axis=1)
        feeds = np.array(blocks.feeds)[1:]
        cut = feeds > 0
        assert set(np.round(feeds[cut] * lengths[cut], 0)) == {2000.0, 900.0}

    def test_rapid_moves_that_swing_are_a_warning(self):
        swung = program_of(path_of([[0, 0, 0], [100, 0, 0]], leaning_axes(2, turn=2.0), 0.0, True))
        (warning,) = told(PLAIN, swung, 627)
        assert "1 rapid move" in warning.message and re.search(r"up to [0-9.]+ mm", warning.message)

    def test_a_spin_at_the_pole_that_would_throw_the_tip_is_refused(self):
        # Through the pole, with a trunnion that tilts to one side only: C must turn half round on the spot.
        lean = np.radians([5.0, 1.0, -1.0, -5.0])
        axes = np.column_stack([np.zeros(4), -np.sin(lean), np.cos(lean)])
        tips = np.column_stack([50.0 + np.arange(4.0), np.zeros(4), np.zeros(4)])
        program = program_of(path_of(tips, axes, 600.0, [True, False, False, False]))
        assert not [f for f in GCode(PLAIN).preflight(program) if f.level is Level.FAIL]
        post = GCode(PLAIN | {"tilt_limits_deg": "-0.0001,40"})
        with pytest.raises(
            PathError, match=r"move 2, line 12: without tip control the tip leaves its straight way by up"
        ):
            post.write(program)

    def test_a_part_that_stands_turned_is_refused(self):
        pose = np.eye(4)
        pose[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
        with pytest.raises(PathError, match=r"no work offset can turn it: .* --frame scan"):
            GCode(PLAIN).write(simple_program(T_scan_program=pose))

    def test_one_length_does_for_one_tool_only(self, tmp_path):
        fork = tmp_path / "fork.toml"
        axis = '[[rotary]]\nletter = "{}"\non = "head"\ndirection = {}\npivot_mm = {}\n'
        text = 'name = "fork"\n' + axis.format("C", [0, 0, 1], 0) + axis.format("B", [0, 1, 0], 200)
        fork.write_text(text, "ascii")
        options = {"dialect": "plain", "machine": str(fork), "tool_length_mm": 100}
        tools = tuple(Event(move, EventKind.TOOL, float(move + 1)) for move in (0, 1))
        assert GCode(options).write(straight_program(3, events=tools[:1]))
        with pytest.raises(PathError, match="X Y Z hold for one length"):
            GCode(options).write(straight_program(3, events=tools))

    def test_the_first_cut_has_no_time(self):
        program = program_of(path_of(np.eye(2, 3), leaning_axes(2), 600.0, False))
        with pytest.raises(PathError, match="move 0, line 10: the path begins with a cutting move"):
            GCode({"dialect": "linuxcnc", "inverse_time": True}).write(program)

    def test_moves_too_long_for_inverse_time_are_refused(self):
        program = straight_program(2, feed=1.0, spacing=200.0)
        with pytest.raises(PathError, match="move 1, line 11: the move takes more than 100 minutes"):
            GCode({"dialect": "linuxcnc", "inverse_time": True}).write(program)

    def test_moves_too_short_for_inverse_time_are_made_slower_and_told(self):
        program = straight_program(3, feed=6000.0, spacing=0.01)
        (info,) = told(PLAIN, program, 628)
        assert info.where == "moves 1 to 2, lines 11 to 12" and "made slower" in info.message
        assert read_program(GCode(PLAIN).write(program), "plain").feeds[1] == 9_999.999


class TestTurnsAlone:
    def test_a_turn_of_the_tool_has_a_feed_in_degrees_and_the_path_its_own_again(self):
        tips = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [10, 0, 0], [20, 0, 0]]
        program = program_of(path_of(tips, leaning_axes(5), 600.0, np.arange(5) == 0))
        for units, factor in (("mm", 1.0), ("inch", 25.4)):
            options = {"orientation": "rotary", "units": units, "rotary_feed_deg_min": 90}
            stated = [x.split("F")[1] if "F" in x else "" for x in lines_of(options, program) if x.startswith("G1")]
            assert stated[:2] == ["90.", ""] and np.isclose(float(stated[2]), 600.0 / factor) and stated[3] == ""

    def test_feeds_of_inverse_time_come_from_the_turn(self):
        axes = np.array([[0, 0, 1], [0, -0.5, 0.75**0.5]])
        program = program_of(path_of(np.zeros((2, 3)), axes, 600.0, [True, False]))
        options = {"dialect": "linuxcnc", "inverse_time": True, "rotary_feed_deg_min": 60}
        assert np.isclose(read_program(GCode(options).write(program), "linuxcnc").feeds[1], 2.0)


class TestSubprograms:
    RAPID = np.arange(60) % 10 == 0
    TIPS = np.column_stack([np.arange(60.0), np.zeros(60), np.zeros(60)])
    PROGRAM = program_of(path_of(TIPS, leaning_axes(60), 600.0, RAPID), name="Übung 5")

    @pytest.mark.parametrize(
        ("options", "files", "calls", "start", "end"),
        [
            ({"program_number": 100}, ["Übung 5.nc", "Übung 5_1.nc"], ["M98 P101", "M98 P102"],
             ["%", "O0101"], ["M99", "%"]),
            ({"dialect": "haas"}, ["Übung 5.nc", "Übung 5_1.nc"], ["M98 P2", "M98 P3"], ["%", "O00002"], ["M99", "%"]),
            ({"dialect": "siemens"}, ["Ubung5.mpf", "Ubung5_1.spf"], ["Ubung5_1", "Ubung5_2"], [], ["M17"]),
            ({"dialect": "linuxcnc"}, ["Übung 5.ngc", "ubung5_1.ngc"], ["o<ubung5_1> call", "o<ubung5_2> call"],
             ["o<ubung5_1> sub"], ["o<ubung5_1> endsub", "M2"]),
        ],
    )  # fmt: skip
    def test_parts_are_called_one_after_the_other(self, options, files, calls, start, end):
        post = GCode(options | {"max_moves_per_program": 20})
        written = post.write(self.PROGRAM)
        assert list(written)[:2] == files and len(written) == 4 and post.main_file(written) == files[0]
        main, part = (content.decode("ascii").splitlines() for content in list(written.values())[:2])
        at = main.index(calls[0])
        assert main[at + 1] == calls[1] and not any(line.startswith(("G0", "G1 ")) for line in main)
        assert part[: len(start)] == start and part[-len(end) :] == end

    @pytest.mark.parametrize("dialect", ["siemens", "linuxcnc"])
    def test_the_parts_together_are_the_path(self, dialect):
        written = GCode({"dialect": dialect, "max_moves_per_program": 20}).write(self.PROGRAM)
        tips = []
        for content in list(written.values())[1:]:
            text = "\n".join(x for x in content.decode("ascii").splitlines() if not x.startswith("o<"))
            blocks = read_blocks(text, dialect)
            assert blocks.rapid[0] and "F" in blocks.lines[1]
            tips += blocks.xyz
        assert np.allclose(tips, self.TIPS)

    def test_heidenhain_calls_programs(self):
        written = GCode({"dialect": "heidenhain", "max_moves_per_program": 20}).write(self.PROGRAM)
        assert list(written) == ["UBUNG5.H", "UBUNG5_1.H", "UBUNG5_2.H", "UBUNG5_3.H"]
        assert " CALL PGM UBUNG5_1.H\n" in written["UBUNG5.H"].decode()
        assert written["UBUNG5_2.H"].decode().startswith("0 BEGIN PGM UBUNG5_2 MM\n1 L X")
