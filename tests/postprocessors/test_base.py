import ast
import dataclasses
import doctest
import importlib
import inspect
import itertools
import pkgutil
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pytest
from post_programs import NASTY, path_of, program_of, simple_program, straight_program

import sicp_postprocessors
from sicp_cam.errors import JobError, OutputError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_cam.ranges import Between
from sicp_postprocessors.base import Postprocessor
from sicp_postprocessors.checks import common_findings, event_findings, move_place, stretch_findings
from sicp_postprocessors.fanuc_ls import FanucLs
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.krl import Krl
from sicp_postprocessors.numbers import fixed, rounded, trimmed
from sicp_postprocessors.options import THIS_POST, build_options, flag, outside
from sicp_postprocessors.path_csv import PathCsv
from sicp_postprocessors.rapid import Rapid
from sicp_postprocessors.robodk_csv import RoboDkCsv
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.template import LinePostprocessor
from sicp_postprocessors.text import ascii_line, ascii_lines, ascii_name, counted, file_stem
from sicp_postprocessors.urscript import UrScript
from sicp_postprocessors.val3 import Val3


@pytest.mark.parametrize("module", [m.name for m in pkgutil.iter_modules(sicp_postprocessors.__path__)])
def test_examples_in_docstrings_run(module):
    results = doctest.testmod(importlib.import_module(f"sicp_postprocessors.{module}"))
    assert results.failed == 0


def test_the_example_of_a_third_party_is_run():
    assert doctest.testmod(importlib.import_module("sicp_postprocessors.template")).attempted >= 10


class TestNumbers:
    @pytest.mark.parametrize(
        ("value", "decimals", "text"),
        [
            (-0.0004, 3, "0.000"),
            (-0.0, 4, "0.0000"),
            (1e-9, 4, "0.0000"),
            (-1.5, 0, "-2"),
            (1234567.891, 3, "1234567.891"),
            (-0.001, 3, "-0.001"),
            (1e7, 1, "10000000.0"),
        ],
    )
    def test_fixed(self, value, decimals, text):
        assert fixed(value, decimals) == text

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e22, -1.1e7])
    def test_numbers_that_no_program_may_hold(self, value):
        with pytest.raises(PathError, match="cannot be written"):
            fixed(value, 3)
        with pytest.raises(PathError, match="cannot be written"):
            rows("{:.3}", [0.0, value])
        with pytest.raises(PathError, match="cannot be written"):
            rounded(np.array([0.0, value]), 3)

    def test_rounded_has_no_minus_zero(self):
        assert not np.signbit(rounded(np.array([-1e-9, -0.0]), 4)).any()

    @pytest.mark.parametrize("decimals", range(13))
    def test_rows_hold_the_digits_of_fixed(self, decimals):
        rng = np.random.default_rng(decimals)
        sizes = 10.0 ** rng.integers(-9, 7, 9000)
        values = np.concatenate([rng.normal(size=9000) * sizes / 4.0, [0, -0.0, -1e-9, 1e7, -1e7, 9.9999999, 0.5, 2.5]])
        plain = [fixed(value, decimals) for value in rounded(values, decimals).tolist()]
        assert rows(f"{{:.{decimals}}}", values) == plain
        assert rows(f"a{{:.{decimals}t}}", values) == [f"a{trimmed(float(text), decimals)}" for text in plain]
        signed = rows(f"{{:+.{decimals}}}", values)
        assert [text.lstrip("+") for text in signed] == plain and all(text[0] in "+-" for text in signed)

    def test_rows_of_nothing(self):
        assert rows("{:.3}{}", np.zeros(0), words([])) == []


class TestText:
    def test_nasty_text_is_one_plain_line(self):
        line = ascii_line('Hello "Robots"\nNext\x1b\u2028(x)\r é 😀')
        assert line == 'Hello "Robots" Next (x) e ?'

    def test_long_text_is_broken_and_not_cut(self):
        words = [f"word{n}" for n in range(60)]
        lines = ascii_lines(" ".join(words))
        assert max(map(len, lines)) <= 72
        assert " ".join(lines).split() == words

    @pytest.mark.parametrize(
        "name",
        ["../../etc/passwd", "/abs", "a\\b", "CON", "con.txt", "nul", "a" * 300, "😀" * 300, ".", "..", "", " . ",
         "a\0b", "-rf", "x.", "\ud800", "é" * 200],
    )  # fmt: skip
    def test_file_stems_stay_in_their_folder(self, name):
        stem = file_stem(name)
        assert stem and len(stem.encode()) <= 130
        assert not set('/\\:*?"<>|\0') & set(stem)
        assert stem[0] not in ".- " and stem[-1] not in ". "
        assert stem.split(".")[0].lower() not in ("con", "nul")

    @pytest.mark.parametrize(("number", "text"), [(0, "0 points"), (1, "1 point"), (2, "2 points")])
    def test_counts_are_in_singular_or_plural(self, number, text):
        assert counted(number, "point") == text

    @pytest.mark.parametrize("name", ["9x", "é😀", "", "_", "a b-c", "x" * 40])
    def test_names_of_a_controller(self, name):
        assert ascii_name(name, 15).isalnum()
        assert ascii_name(name, 15)[0].isalpha() and len(ascii_name(name, 15)) <= 15


@dataclass(frozen=True)
class Everything:
    flag: bool = False
    count: int = 1
    size_mm: Annotated[float, Between(0.5, 2500.0)] = 1.0
    word: str = ""
    kind: Literal["a", "b"] = "a"
    pair: tuple[float, float] | None = None

    def __post_init__(self):
        problems = outside("count", self.count, 0, 5)
        if problems:
            raise JobError(*problems)


class TestOptions:
    def test_strings_become_the_type_of_their_field(self):
        given = {"flag": "true", "count": "3", "size_mm": "2000", "word": "x", "kind": "b", "pair": "1,-2.5"}
        assert build_options("p", Everything, given) == Everything(True, 3, 2000.0, "x", "b", (1.0, -2.5))

    def test_values_of_the_own_type_are_kept(self):
        given = {"flag": True, "count": 3, "size_mm": 2, "pair": [1, 2.5]}
        assert build_options("p", Everything, given) == Everything(True, 3, 2.0, pair=(1.0, 2.5))
        assert build_options("p", Everything, {"pair": "none"}).pair is None

    @pytest.mark.parametrize(
        ("name", "value"),
        [("flag", "maybe"), ("flag", 2), ("count", "1.5"), ("count", True), ("count", 1.0), ("count", "1_0"),
         ("count", "٣"), ("size_mm", "nan"), ("size_mm", float("inf")), ("size_mm", "1e999"), ("size_mm", "1,5"),
         ("size_mm", True), ("size_mm", None), ("size_mm", 0.4), ("size_mm", "2501"),
         ("word", 3), ("word", "a\nb"), ("word", "é"),
         ("kind", "c"), ("kind", ["a"]), ("pair", "1,2,3"), ("pair", 4), ("pair", ["x", 1]), ("count", 9)],
    )  # fmt: skip
    def test_wrong_values_are_refused_by_name(self, name, value):
        with pytest.raises(JobError, match=f"'{name}'"):
            build_options("p", Everything, {name: value})

    @pytest.mark.parametrize("word", ["b", "B", " b "])
    def test_words_are_taken_in_any_case_and_kept_as_the_post_knows_them(self, word):
        assert build_options("p", Everything, {"kind": word}).kind == "b"

    def test_a_problem_names_the_flag_of_the_post_that_has_it(self):
        @dataclass(frozen=True)
        class Broken:
            def __post_init__(self):
                raise JobError(f"give {flag(THIS_POST, 'size', '1')}")

        with pytest.raises(JobError, match=r"^post cell_2: give --set post\.cell_2\.size=1$"):
            build_options("cell_2", Broken, {})

    def test_one_number_is_singular(self):
        @dataclass(frozen=True)
        class One:
            size: tuple[float] = (1.0,)

        with pytest.raises(JobError, match="must be 1 number, not"):
            build_options("p", One, {"size": "1,2"})

    def test_all_problems_are_told_at_once(self):
        with pytest.raises(JobError) as caught:
            build_options("p", Everything, {"flg": 1, "kind": "z", "count": 99})
        assert len(caught.value.problems) == 3
        told = str(caught.value)
        assert "no option 'flg'" in told and "one of a, b" in told and "from 0 to 5" in told


class TestChecks:
    def test_a_good_program_has_no_findings(self):
        assert common_findings(simple_program()) == []

    def test_empty_path(self):
        (finding,) = common_findings(program_of(path_of(np.zeros((0, 3)), np.zeros((0, 3)))))
        assert (finding.code, finding.level) == (601, Level.FAIL)

    def test_missing_feeds_are_told_by_stretch_with_lines_and_remedy(self):
        path = path_of(np.eye(3).repeat(2, 0), [[0, 0, 1]] * 6, [0, 0, 0, 5, 0, 5], [True] + [False] * 5)
        findings = common_findings(program_of(path))
        assert [f.where for f in findings] == ["moves 1 to 2, lines 11 to 12", "move 4, line 14"]
        assert all(f.code == 603 and "--set path.feed_mm_min=" in f.message for f in findings)

    @pytest.mark.parametrize("feed", [np.nan, np.inf, -1.0])
    def test_feeds_that_are_no_feeds(self, feed):
        (finding,) = common_findings(program_of(path_of(np.eye(3), [[0, 0, 1]] * 3, [1.0, feed, 1.0])))
        assert (finding.code, finding.where) == (602, "move 1, line 11")

    def test_axes_coordinates_frame_and_columns(self):
        path = path_of([[0, 0, 0], [2e7, 0, 0]], [[0, 0, 1.1], [0, 0, 1]])
        mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
        columns = {"ok": np.zeros(2), "short": np.zeros(1), "nan": np.array([0, np.nan]), "a,b": np.zeros(2)}
        findings = common_findings(program_of(path, T_scan_program=mirrored, columns=columns))
        assert [(f.code, f.where) for f in findings[:2]] == [(604, "move 0, line 10"), (605, "move 1, line 11")]
        assert [f.code for f in findings[2:]] == [607, 608, 608, 608]
        assert all(f.level is Level.FAIL for f in findings)

    @pytest.mark.parametrize(
        ("event", "words"),
        [
            (Event(4, EventKind.STOP), "outside"),
            (Event(-1, EventKind.STOP), "outside"),
            (Event(1, EventKind.DWELL, np.nan), "not finite"),
            (Event(1, EventKind.DWELL, -1.0), "negative"),
            (Event(1, EventKind.TOOL, 1.5), "not whole"),
            (Event(1, EventKind.SPINDLE, 1e9), "beyond"),
        ],
    )
    def test_events_that_are_none(self, event, words):
        (finding,) = common_findings(straight_program(3, events=(event,)))
        assert finding.code == 606 and words in finding.message and f"before move {event.before_move}" in finding.where

    def test_events_left_out_are_told_once_for_each_text(self):
        events = [Event(i, EventKind.OTHER, 0.0, text, i + 5) for i, text in enumerate(["G49", "a\nb", "G49"])]
        findings = event_findings(events, {EventKind.OTHER}, "why")
        assert [f.where for f in findings] == ["before move 0, line 5, and 1 more", "before move 1, line 6"]
        assert all(f.code == 610 and f.level is Level.WARN and "\n" not in f.message for f in findings)

    def test_an_event_without_text_is_told_by_its_kind(self):
        (finding,) = event_findings([Event(0, EventKind.COOLANT, 1.0)], {EventKind.COOLANT}, "why")
        assert finding.message == "coolant is not written: why"

    def test_places(self):
        path = path_of(np.eye(3).repeat(2, 0)[:4], [[0, 0, 1]] * 4, lines=[0, 5, 6, 6])
        assert move_place(path, 0) == "move 0"
        assert move_place(path, 1) == "move 1, line 5"
        assert move_place(path, 1, 2) == "moves 1 to 2, lines 5 to 6"
        assert move_place(path, 2, 3) == "moves 2 to 3, line 6"
        assert move_place(path, 0, 3) == "moves 0 to 3"
        assert stretch_findings(path, np.array([False] * 4), 1, Level.INFO, "x") == []


class Plain(LinePostprocessor):
    name = "plain"
    summary = "for the tests"
    suffix = ".txt"
    line_text = "line"

    comment_drop = "!"

    modal_speed = True

    def start(self, program):
        yield "start"

    def comment(self, text):
        return f"# {text}"

    def setup(self, program):
        yield "setup"

    def speed(self, feed_mm_min):
        yield f"speed {feed_mm_min:g}"

    def move_joint(self, moves):
        return [f"joint {index}" for index in moves.index]

    def move_linear(self, moves):
        return [f"linear {index}" for index in moves.index]

    def stop(self, text):
        yield self.line_text

    def spindle(self, rev_min):
        yield f"spindle {rev_min:g}"

    def finish(self, program):
        yield "end"


def body(post, program):
    """Return the lines between setup and end."""
    (content,) = post.write(program).values()
    lines = content.decode().split("\n")
    return lines[lines.index("setup") + 1 : lines.index("end")]


class TestTemplate:
    def test_moves_and_events_come_in_order(self):
        events = (Event(2, EventKind.STOP), Event(0, EventKind.STOP), Event(1, EventKind.OTHER))
        (content,) = Plain().write(straight_program(2, events=events)).values()
        head = ["start", "# porthole", "# not a safety function: verify at reduced speed", "setup"]
        assert content.decode().split("\n") == [*head, "line", "joint 0", "speed 600", "linear 1", "line", "end", ""]

    def test_a_feed_is_stated_where_it_changes_and_behind_every_rapid_move_that_hides_it(self):
        program = straight_program(7, feed=[0, 600, 600, 900, 0, 900, 900], rapid=[1, 0, 0, 0, 1, 0, 0])
        joint = body(Plain(), program)
        assert [line for line in joint if line.startswith("speed")] == ["speed 600", "speed 900", "speed 900"]
        assert joint[:3] == ["joint 0", "speed 600", "linear 1"] and joint[-3:] == ["speed 900", "linear 5", "linear 6"]

    def test_the_rapid_moves_of_a_robot_are_straight_and_have_a_speed_of_their_own(self):
        class Robot(Plain):
            straight_rapids = True

            def feeds_mm_min(self, path):
                return np.where(path.rapid, 15000.0, path.feeds_mm_min)

        lines = body(Robot(), straight_program(4, feed=[0, 600, 0, 600], rapid=[1, 0, 1, 0]))
        speeds = ["speed 600", "linear 1", "speed 15000", "linear 2", "speed 600", "linear 3"]
        assert lines == ["joint 0", *speeds]

    def test_what_still_runs_at_the_end_is_switched_off(self):
        lines = body(Plain(), straight_program(2, events=(Event(1, EventKind.SPINDLE, -300.0),)))
        assert lines == ["joint 0", "spindle -300", "speed 600", "linear 1", "spindle 0"]
        lines = body(Plain(), straight_program(2, events=(Event(1, EventKind.SPINDLE, 0.0),)))
        assert lines == ["joint 0", "spindle 0", "speed 600", "linear 1"]

    def test_a_post_that_loses_moves_is_stopped(self):
        class Losing(Plain):
            def move_linear(self, moves):
                return ["one"]

        with pytest.raises(OutputError, match="post plain wrote 1 texts for 2 moves; mend move_linear"):
            Losing().write(straight_program(3))

    def test_a_cut_longer_than_a_program_stays_whole_and_is_told(self):
        @dataclass(frozen=True)
        class Split:
            max_moves_per_program: int = 3
            split_cuts: bool = False

        class Splitting(Plain):
            Options = Split

        program = straight_program(9, rapid=[1, 0, 0, 0, 0, 1, 0, 0, 1])
        post = Splitting()
        assert [len(part) for part in post.parts(program.path)] == [5, 3, 1]
        (told,) = [f for f in post.preflight(program) if f.code == 653]
        assert told.where == "moves 0 to 4, lines 10 to 14" and "--set post.plain.split_cuts=true" in told.message
        forced = Splitting({"split_cuts": True})
        assert [len(part) for part in forced.parts(program.path)] == [3, 2, 3, 1]
        assert not [f for f in forced.preflight(program) if f.code == 653]
        # Each part states what holds in it.
        assert [body[0] for body in forced.bodies(program)] == ["joint 0", "speed 600", "joint 5", "joint 8"]

    def test_an_event_of_another_language_may_switch_an_output(self):
        class Switching(Plain):
            def switched(self, event):
                return ("vacuum", True) if event.text == "AUXFUN/50" else None

            def output(self, signal, on):
                yield f"{signal} {on}"

        events = (Event(1, EventKind.OTHER, 0.0, "AUXFUN/50"), Event(1, EventKind.OTHER, 0.0, "AUXFUN/51"))
        program = straight_program(2, events=events)
        assert body(Switching(), program) == ["joint 0", "vacuum True", "speed 600", "linear 1"]
        (told,) = [f for f in Switching().preflight(program) if f.code == 610]
        assert "AUXFUN/51" in told.message

    def test_the_head_holds_notes_and_remarks_as_plain_comments(self):
        class Remarking(Plain):
            def remarks(self, program):
                yield "tool tip! control"

        program = straight_program(2, notes=("made! by", NASTY), name="a\nb")
        (content,) = Remarking().write(program).values()
        head = content.decode("ascii").split("\n")[1:-5]
        assert head[:2] == ["# a b", "# made by"] and "Robots" in head[2]
        assert head[3:] == ["# not a safety function: verify at reduced speed", "# tool tip control", "setup"]

    @pytest.mark.parametrize("comment", ["", "#", "# verify"])
    def test_a_post_whose_comments_lose_the_safety_line_is_stopped(self, comment):
        class Silent(Plain):
            def comment(self, text):
                return comment

        with pytest.raises(OutputError, match="post plain writes comments without their text"):
            Silent().write(straight_program(2))

    def test_a_post_without_comment_syntax_cannot_be_made(self):
        class Unfinished(LinePostprocessor):
            name, summary, suffix = "unfinished", "for the tests", ".txt"
            move_joint = move_linear = Plain.move_joint

        with pytest.raises(TypeError, match="comment"):
            Unfinished()

    @pytest.mark.parametrize("text", ["two\nlines", "é", "\x1b"])
    def test_a_hook_that_returns_no_plain_line_is_stopped(self, text):
        post = Plain()
        post.line_text = text
        with pytest.raises(OutputError, match="post plain wrote a line"):
            post.write(straight_program(2, events=(Event(0, EventKind.STOP),)))

    def test_a_failure_in_preflight_stops_the_program_with_every_place(self):
        path = path_of(np.eye(3).repeat(3, 0), [[0, 0, 1]] * 9, [0, 5] * 4 + [0])
        with pytest.raises(PathError, match=r"move 0, line 10: .*; move 2, line 12: ") as caught:
            Plain().write(program_of(path, name="a\nb"))
        assert "\n" not in str(caught.value)

    def test_more_failures_than_a_line_takes_are_counted(self):
        path = path_of(np.tile(np.eye(3), (5, 1)), [[0, 0, 1]] * 15, [0, 5] * 7 + [0])
        with pytest.raises(PathError, match=r"and 3 more$"):
            Plain().write(program_of(path))

    @pytest.mark.parametrize("file", ["/etc/x", "../x", "a/../../x", "a\\b", ""])
    def test_a_post_cannot_leave_its_folder(self, file):
        class Escaping(Postprocessor):
            name, summary = "escaping", "for the tests"

            def files(self, program):
                return {file: b""}

        with pytest.raises(OutputError, match="outside its folder"):
            Escaping().write(straight_program(2))


@pytest.mark.parametrize("post", [Val3, GCode, PathCsv, Krl, Rapid, FanucLs, UrScript, RoboDkCsv])
def test_every_option_has_a_docstring_under_its_field(post):
    """`sicp-cam plugins NAME` reads them from the source: a text of its own for each, that ends as a sentence."""
    own = [kind for kind in reversed(post.Options.__mro__) if dataclasses.is_dataclass(kind)]
    told = {
        field.target.id: text.value.value
        for kind in own
        for field, text in itertools.pairwise(ast.parse(inspect.getsource(kind)).body[0].body)
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
    }
    assert list(told) == [field.name for field in dataclasses.fields(post.Options)]
    assert all(text.endswith(".") and not text.startswith("See ") and "\n" not in text for text in told.values())
    assert len(set(told.values())) == len(told)
