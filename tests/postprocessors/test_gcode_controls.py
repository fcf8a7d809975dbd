"""What a control would do with words that it reads otherwise than meant: lengths, numbers, feeds, ways of axes."""

import re

import numpy as np
import pytest
from gcode_reread import read_program
from post_programs import leaning_axes, path_of, program_of, simple_program, straight_program
from test_gcode_dialects import PLAIN, lines_of, told

from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.gcode.forward import axes_of
from sicp_postprocessors.gcode.machines import load_machine
from sicp_postprocessors.gcode.ways import axis_deviations_deg

NO_LENGTH = [{}, {"orientation": "rotary"}, {"dialect": "haas"}, PLAIN, {"tcp_on": "G43.5{tool}"}]
OTHERS = [{"dialect": "siemens"}, {"dialect": "heidenhain"}, {"orientation": "rotary", "tcp_on": "M428"}]
INVERSE = [{"inverse_time": True}, {"dialect": "haas", "inverse_time": True}, PLAIN]
ROTARY = [{"orientation": "rotary", "machine": "head-ac"}, {"dialect": "haas", "machine": "mixed-ac"}, PLAIN]
BACK = {"turn_limits_deg": "-271,451", "tilt_limits_deg": "0,40"}


def of_code(options, program, code, words):
    return [f for f in told(options, program, code) if words in f.message]


def refused(options):
    with pytest.raises(JobError) as caught:
        GCode(options)
    return str(caught.value)


class TestToolLength:
    @pytest.mark.parametrize("options", NO_LENGTH, ids=str)
    def test_tip_control_without_a_length_is_told(self, options):
        program = straight_program(2)
        (warning,) = of_code(options, program, 626, "post.gcode.tool=")
        assert warning.level is Level.WARN and "no H word" in warning.message
        assert any("no H word" in line for line in lines_of(options, program) if line[0] == "(")
        assert not of_code({**options, "tool": 3}, program, 626, "H word")
        assert not of_code(options, simple_program(), 626, "H word")

    @pytest.mark.parametrize("options", OTHERS, ids=str)
    def test_it_is_not_told_where_the_length_is_not_a_matter_of_h(self, options):
        assert not of_code(options, straight_program(2), 626, "H word")

    def test_linuxcnc_takes_the_length_of_the_tool_in_the_spindle(self):
        lines = lines_of({"dialect": "linuxcnc"}, straight_program(2))
        assert "G43" in lines and lines.index("G43") < next(i for i, x in enumerate(lines) if x.startswith("G0"))
        assert any("length of the tool in the spindle" in line for line in lines if line[0] == "(")

    def test_a_tool_without_number_has_no_length_either(self):
        events = (Event(0, EventKind.TOOL, 5.0), Event(1, EventKind.TOOL, 0.0, "", 44))
        (warning,) = of_code({}, straight_program(3, events=events), 626, "no H word")
        assert warning.where == "before move 1, line 44"

    def test_without_tip_control_every_dialect_takes_the_length(self):
        options = {**PLAIN, "tip_control": "off", "orientation": "rotary"}
        for dialect in ("fanuc", "haas"):
            lines = [x for x in lines_of({**options, "dialect": dialect}, simple_program()) if x[0] != "("]
            assert lines[lines.index("T3 M6") + 1] == "G43 H3" and lines.count("G49") == 2
            assert not any("G43.4" in line or "G234" in line for line in lines)


class TestProgramNumbers:
    RAPID = np.arange(60) % 10 == 0
    PROGRAM = program_of(path_of(np.eye(60)[:, :3], leaning_axes(60), 600.0, RAPID))

    @pytest.mark.parametrize("dialect", ["fanuc", "plain"])
    def test_numbers_of_subprograms_have_four_digits(self, dialect):
        options = {**PLAIN, "dialect": dialect, "max_moves_per_program": 20}
        options |= {"tip_control": "off", "orientation": "rotary"}
        assert "O9996" in next(iter(GCode({**options, "program_number": 9996}).write(self.PROGRAM).values())).decode()
        for number in (9997, 9998):
            with pytest.raises(PathError, match=r"subprograms .* larger than 9999.*program_number"):
                GCode({**options, "program_number": number}).write(self.PROGRAM)
        for number in (9999, 12345):
            assert "'program_number'" in refused({**options, "program_number": number})

    def test_larger_numbers_are_good_for_one_program(self):
        assert "O12345678" in lines_of({"program_number": 12_345_678}, self.PROGRAM)

    def test_haas_has_five_digits(self):
        assert "99999" in refused({"dialect": "haas", "program_number": 100_000})
        assert "O99999" in lines_of({"dialect": "haas", "program_number": 99_999}, self.PROGRAM)
        with pytest.raises(PathError, match="larger than 99999"):
            GCode({"dialect": "haas", "program_number": 99_998, "max_moves_per_program": 20}).write(self.PROGRAM)


class TestFeeds:
    @pytest.mark.parametrize("options", [{}, {"dialect": "haas"}, {"dialect": "haas", "units": "inch"}, PLAIN], ids=str)
    @pytest.mark.parametrize("inverse", [False, True])
    def test_f_has_a_point_where_one_without_means_thousandths(self, options, inverse):
        program = straight_program(4, feed=1200.0, spacing=60.0)
        stated = [
            x.split("F")[1] for x in lines_of({**options, "inverse_time": inverse}, program) if re.match("G1 .*F", x)
        ]
        assert stated and all("." in feed for feed in stated)
        if not inverse and options is not PLAIN and "units" not in options:
            assert stated == ["1200."]
        assert any(line.startswith("S12000 ") for line in lines_of(options, simple_program()))

    @pytest.mark.parametrize("dialect", ["siemens", "heidenhain", "linuxcnc"])
    def test_others_write_whole_feeds_as_before(self, dialect):
        assert any(line.endswith(" F1200") for line in lines_of({"dialect": dialect}, straight_program(2, feed=1200.0)))

    @pytest.mark.parametrize("options", INVERSE, ids=str)
    def test_inverse_time_has_three_decimals_and_four_places(self, options):
        program = straight_program(3, feed=6000.0, spacing=0.01)
        lines = [line for line in lines_of(options, program) if line.startswith("G1")]
        assert [line.split("F")[1] for line in lines] == ["9999.999"] * 2
        assert [f.where for f in told(options, program, 628)] == ["moves 1 to 2, lines 11 to 12"]
        with pytest.raises(PathError, match="more than 10 minutes"):
            GCode(options).write(straight_program(2, feed=1.0, spacing=11.0))

    @pytest.mark.parametrize("dialect", ["fanuc", "haas", "plain", "siemens", "linuxcnc"])
    def test_feeds_are_per_minute_again_at_the_end(self, dialect):
        options = PLAIN if dialect == "plain" else {"dialect": dialect}
        lines = lines_of({**options, "inverse_time": True}, simple_program())
        last = max(i for i, line in enumerate(lines) if line.startswith(("G0", "G1")))
        assert "G94" in lines[last:] and lines.index("G94", last) < lines.index("M30")
        if dialect != "plain":
            lines = lines_of(options, simple_program())
            assert "G94" not in lines

    def test_heidenhain_knows_no_feed_above_99999(self):
        feeds = [0, 600, 100_000, 600]
        program = straight_program(4, feed=feeds, rapid=np.arange(4) == 0)
        with pytest.raises(PathError, match=r"move 2, line 12: .*99999"):
            GCode({"dialect": "heidenhain"}).write(program)
        GCode({"dialect": "heidenhain"}).write(straight_program(2, feed=99_999.0))

    def test_feeds_in_inches_have_four_decimals(self):
        lines = lines_of({"units": "inch"}, straight_program(2, feed=1000.0))
        assert any(line.endswith(" F39.3701") for line in lines)
        with pytest.raises(PathError, match=r"move 1, line 11: .*feed"):
            GCode({"units": "inch"}).write(straight_program(2, feed=0.00124))


class TestWaysOfAxes:
    def test_heidenhain_goes_to_the_stated_angle_where_angles_run_through_full_turns(self):
        def words(**options):
            text = "\n".join(lines_of({"dialect": "heidenhain", **options}, simple_program()))
            return re.findall(r"M12[678]\b", text)

        assert words() == ["M127", "M128"]
        assert words(wrap="0..360", machine="table-bc") == ["M126", "M128"]
        assert words(orientation="vector") == ["M128"]
        assert words(tcp_on="FUNCTION TCPM F TCP AXIS POS") == ["M127"]

    TURNS = program_of(
        path_of(
            np.column_stack([np.linspace(0, 40, 200), np.zeros(200), np.zeros(200)]),
            np.vstack([leaning_axes(198, turn=4 * np.pi), leaning_axes(2, turn=0.02)]),
            600.0,
            (np.arange(200) == 0) | (np.arange(200) == 198),
        )
    )

    @pytest.mark.parametrize("options", ROTARY, ids=str)
    def test_a_rapid_move_that_winds_an_axis_back_is_told(self, options):
        options = options | BACK
        program = self.TURNS
        findings = of_code(options, program, 627, "turns by up to")
        (warning,) = findings
        assert warning.level is Level.WARN and warning.where == "move 198, line 208"
        degrees = float(re.search(r"up to ([0-9.]+) degrees", warning.message)[1])
        turn = read_program(GCode(options).write(program), options.get("dialect", "fanuc"))
        c = np.array([row["C"] for row in turn.turn])
        assert degrees > 300 and np.isclose(degrees, np.abs(np.diff(c))[np.array(turn.rapid)[1:]].max(), atol=0.06)

    def test_the_swing_of_two_full_turns_is_measured(self):
        # From the end of two turns back to their start: half way lies a full turn off, where the tip is in its place.
        axes = np.vstack([leaning_axes(200, turn=4 * np.pi)] * 2)
        tips = np.column_stack([np.linspace(0, 40, 400), np.zeros(400), np.zeros(400)])
        program = program_of(path_of(tips, axes, 600.0, np.arange(400) % 200 == 0))
        (turned,) = of_code(PLAIN | BACK, program, 627, "turns by up to")
        assert "720.0 degrees" in turned.message and turned.where == "move 200, line 210"
        (swung,) = of_code(PLAIN | BACK, program, 627, "leaves the straight line")
        # The part lies about 110 mm off the axis of C: it is carried round, twice that far from its place.
        assert 200.0 < float(re.search(r"up to ([0-9.]+) mm", swung.message)[1]) < 260.0

    def test_words_within_a_turn_are_no_rewind(self):
        options = {"dialect": "haas", "machine": "mixed-ac", "wrap": "0..360"}
        assert not of_code(options, self.TURNS, 627, "turns by up to")

    def test_an_axis_that_leaves_the_great_circle_between_blocks_is_told(self):
        # C turns by 20 degrees at a lean of 30: the way bends off by sin 30 cos 30 (20 degrees)^2 / 8 = 0.38 degrees.
        axes = leaning_axes(3, lean=np.tan(np.radians(30.0)), turn=np.radians(40.0))
        program = program_of(path_of(np.eye(3), axes, 600.0, np.arange(3) == 0))
        options = {"orientation": "rotary", "machine": "head-ac"}
        (warning,) = told(options, program, 622)
        assert warning.level is Level.WARN and warning.where == "moves 1 to 2, lines 11 to 12"
        assert "post.gcode.max_axis_step_deg=" in warning.message
        exact = np.degrees(np.arctan(np.tan(np.radians(60)) / np.cos(np.radians(10)))) - 60.0
        assert np.isclose(float(re.search(r"up to ([0-9.]+) degrees", warning.message)[1]), exact, atol=0.006)
        assert not told({**options, "max_axis_step_deg": 5}, program, 622)
        assert not told({}, program, 622)

    def test_small_turns_are_not_looked_at_because_they_cannot_leave_the_way(self):
        machine, rng = load_machine("nutating-table-bc"), np.random.default_rng(2)
        deg = rng.uniform(-180, 180, (4000, 2))
        deg[1::2] = deg[::2] + rng.uniform(-1, 1, (2000, 2)) * [2.0, 4.0]
        off = axis_deviations_deg(machine, deg, axes_of(machine, deg), np.arange(1, 4000, 2))
        assert 0.03 < off.max() < 0.0786

    def test_a_machine_that_is_not_named_is_told(self):
        for options, taken in (({"kinematics": "BC"}, "head-bc"), ({}, "head-ac"), ({"dialect": "haas"}, "head-ac")):
            options = {"orientation": "rotary", **options}
            (warning,) = of_code(options, simple_program(), 626, "post.gcode.machine=")
            assert warning.level is Level.WARN and taken in warning.message
            assert not of_code({**options, "machine": taken}, simple_program(), 626, "machine=")
        assert not of_code({}, simple_program(), 626, "machine=")

    def test_beside_the_pole_the_cone_is_named(self):
        lean = np.radians([5.0, 0.001, 5.0])
        turn = np.radians([0.0, 90.0, 180.0])
        axes = np.column_stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])
        program = program_of(path_of([[50, 0, 0], [51, 0, 0], [52, 0, 0]], axes, 600.0, np.arange(3) == 0))
        failed = [f for f in told(PLAIN, program, 625) if f.level is Level.FAIL]
        assert failed and all("post.gcode.singular_cone_deg=" in f.message for f in failed)


class TestWordsOfTheSite:
    @pytest.mark.parametrize(
        ("dialect", "known", "unknown"),
        [
            ("fanuc", ("X", "P_MS"), ("P", "F")),
            ("haas", ("P", "P_MS"), ("X", "F")),
            ("siemens", ("F",), ("P", "X", "P_MS")),
            ("linuxcnc", ("P",), ("X", "F", "P_MS")),
            ("plain", ("P", "X", "F", "P_MS"), ()),
            ("heidenhain", (), ("P", "X", "F", "P_MS")),
        ],
    )
    def test_words_of_dwells_belong_to_dialects(self, dialect, known, unknown):
        options = PLAIN if dialect == "plain" else {"dialect": dialect}
        for word in known:
            GCode({**options, "dwell": word})
        for word in unknown:
            assert f"dialect {dialect}" in refused({**options, "dwell": word})

    @pytest.mark.parametrize(
        ("name", "words"),
        [
            ("tcp_on", " "), ("tcp_on", "{tool}"), ("tcp_on", "G43.5{h}"), ("tcp_on", "M428 {"), ("tcp_on", "M4\nM5"),
            ("tcp_off", "\t"), ("tcp_off", "G49{tool}"), ("tcp_off", "}"), ("tcp_off", "M\u00fc"),
            ("work_offset", " "), ("work_offset", "G54 G55"), ("work_offset", "G53"), ("work_offset", "M30"),
            ("work_offset", "G54 X1"), ("work_offset", "G54.1"), ("work_offset", "G154 P0"), ("work_offset", "{}"),
        ],
    )  # fmt: skip
    def test_what_is_no_word_is_refused(self, name, words):
        assert f"option {name!r}" in refused({name: words, "line_numbers": 10})

    @pytest.mark.parametrize("word", ["G54", "G59", "G54.1 P3", "G154 P12", "G505", "G59.2"])
    def test_offsets(self, word):
        assert word in lines_of({"work_offset": word}, simple_program())

    def test_heidenhain_has_no_word_of_an_offset(self):
        assert "'work_offset'" in refused({"dialect": "heidenhain", "work_offset": "G54"})
