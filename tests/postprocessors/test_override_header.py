"""What the head of a program says about gates that the operator overrode: in every dialect, plain and bounded."""

import csv
import io

import numpy as np
import pytest
from post_programs import NASTY, simple_program, straight_program
from post_reread import load_val3, read_csv

from sicp_cam.model import EventKind
from sicp_postprocessors.apt import Apt
from sicp_postprocessors.base import SAFETY_NOTE
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.krl import Krl
from sicp_postprocessors.path_csv import COLUMNS, PathCsv
from sicp_postprocessors.rapid import Rapid
from sicp_postprocessors.template import LinePostprocessor
from sicp_postprocessors.text import ascii_line
from sicp_postprocessors.urscript import UrScript
from sicp_postprocessors.val3 import Val3

JUMP = "gate jump_mm overridden by the operator: 0.75, limit 0.5"
HALVES = "gate leave_out_mm overridden by the operator: could not be measured, limit 0.6"
BROKEN = (JUMP, HALVES)
COMMENT = ("(", ";", "//", "$$", "'", "! ", "# ")


class Bare(LinePostprocessor):
    """The least that a controller of somebody else's needs."""

    name, summary, suffix, written_events = "bare", "a test", ".bare", frozenset[EventKind]()

    def comment(self, text):
        return f"' {text}"

    def move_joint(self, moves):
        return [f"MOVE {index}" for index in moves.index]

    move_linear = move_joint

    def finish(self, program):
        return ["END"]


LINES = {"gcode": GCode(), "siemens": GCode({"orientation": "siemens"}), "val3": Val3(), "apt": Apt(), "bare": Bare()}
LINES |= {"krl": Krl(), "rapid": Rapid(), "ur": UrScript()}
EACH = pytest.mark.parametrize("post", LINES.values(), ids=list(LINES))


def written(post, **more):
    files = post.write(simple_program(**more))
    return {name: content.decode("utf-8-sig") for name, content in files.items()}


def head_of(text):
    """Return the comment lines from the top down to the first line of another kind, as one text each."""
    lines = [line.strip() for line in text.splitlines()]
    first = next(i for i, line in enumerate(lines) if SAFETY_NOTE in line)
    start = next(i for i in range(first, -1, -1) if i == 0 or not lines[i - 1].startswith(COMMENT))
    return [line.lstrip("(;/$'!# ").rstrip(")") for line in lines[start : first + 1]]


@EACH
def test_the_head_names_gate_value_and_limit_before_the_first_move(post):
    (head,) = [head_of(text) for text in written(post, overridden=BROKEN).values() if SAFETY_NOTE in text]
    told = " ".join(head)
    assert JUMP in told and HALVES in told
    assert told.index(JUMP) < told.index(HALVES) < told.index(SAFETY_NOTE)


@EACH
def test_nothing_but_the_head_changes(post):
    plain, broken = written(post), written(post, overridden=BROKEN)
    assert list(plain) == list(broken)
    for name in plain:
        before, after = plain[name].splitlines(), broken[name].splitlines()
        assert [line for line in after if line in before] == before
        assert all(line.strip().startswith(COMMENT) for line in after if line not in before)


@EACH
@pytest.mark.parametrize("nasty", [NASTY, "]]>" * 50, "\x1b]0;x\x07", "(msg,active)", "x" * 5000, "a;b\u2028G0 Z-100"])
def test_nasty_text_is_plain_and_its_lines_are_short(post, nasty):
    plain, broken = written(post), written(post, overridden=(nasty,))
    for name, text in broken.items():
        assert text.isascii() and "\x1b" not in text
        more = [line.strip() for line in text.splitlines() if line not in plain[name].splitlines()]
        assert all(line.startswith(COMMENT) and len(line) <= 80 for line in more)
        if post.name == "gcode":
            assert not any(line.lower().startswith("(msg") or set(line[1:-1]) & set("()%") for line in more)
    if post.name == "val3":
        assert load_val3(post.write(simple_program(overridden=(nasty,)))).name


def table(**more):
    (text,) = written(PathCsv(), **more).values()
    return list(csv.reader(io.StringIO(text)))


def test_the_header_of_the_table_names_gate_value_and_limit():
    plain, broken = table(), table(overridden=BROKEN)
    assert [row[:-1] for row in broken] == plain
    head = broken[0][-1]
    assert head.startswith("overridden: gate jump_mm overridden by the operator: 0.75 limit 0.5 and gate leave_out_mm")
    assert "could not be measured limit 0.6" in head
    assert {row[-1] for row in broken[1:]} == {"1"}


def test_the_column_comes_after_those_of_the_program():
    head = table(columns={"uncertainty_mm": np.zeros(6)}, overridden=(JUMP,))[0]
    assert head[:-1] == [*COLUMNS, "uncertainty_mm"] and head[-1].startswith("overridden: ")


def test_the_table_reads_back_as_before():
    files = PathCsv().write(simple_program(overridden=BROKEN))
    result, rows = read_csv(files)
    plain, _ = read_csv(PathCsv().write(simple_program()))
    assert (result.tips, result.feeds, result.rapid) == (plain.tips, plain.feeds, plain.rapid)
    assert len(rows) == 6


@pytest.mark.parametrize("nasty", [NASTY, "=cmd()|x", "a,b;c\td\n1,2,3", '"', "x" * 5000, "\x1b]0;x\x07"])
def test_nasty_text_stays_in_its_cell(nasty):
    rows = table(overridden=(nasty, nasty))
    assert {len(row) for row in rows} == {len(COLUMNS) + 1}
    head = rows[0][-1]
    assert head.isascii() and head.isprintable() and len(head) <= 230 and not set(head) & set(",;\"'\t")
    assert head.startswith("overridden: ")
    (text,) = written(PathCsv(), overridden=(nasty, nasty)).values()
    assert text.count("\n") == 7
    assert ascii_line(nasty, drop=",;\"'")[:20] in text


@pytest.mark.parametrize("rows", [1, 4096, 4097])
def test_every_row_of_a_long_table_has_the_cell(rows):
    (content,) = PathCsv().write(straight_program(rows, overridden=(JUMP,))).values()
    lines = content.decode("ascii").splitlines()
    assert len(lines) == rows + 1 and all(line.endswith(",covered,1") for line in lines[1:])
