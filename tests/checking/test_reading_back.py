"""What was written is read back and compared before it is kept."""

import sys
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.checking.reading_back import read_back
from sicp_cam.errors import OutputError
from sicp_postprocessors.apt import Apt
from sicp_postprocessors.base import Postprocessor
from sicp_postprocessors.dxf import Dxf
from sicp_postprocessors.path_csv import PathCsv
from sicp_postprocessors.val3 import Val3

sys.path.insert(0, str(Path(__file__).parents[1] / "postprocessors"))

from post_programs import simple_program


@pytest.mark.parametrize("post", [Apt(), Apt({"units": "inch"}), PathCsv(), Val3()], ids=lambda post: post.name)
def test_what_was_written_is_found_again(post):
    program = simple_program()
    back = read_back(post, program, post.write(program))
    assert back.facts["count"] == 6 and back.facts["largest_difference_mm"] < 1e-3 and back.findings == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"GOTO/100.0000,", b"GOTO/100.0100,", r"1 of 6 tips are off by more than 0\.002 mm, this one by 0\.01"),
        (b"GOTO/100.0000,0.0000,5.0000,", b"GOTO/100.0000,0.0000,5.0000,-", "1 of 6 axes are off by more than 0.002"),
        (b"FEDRAT/2000.0000,MMPM\n", b"RAPID\n", "cuts of the reference are rapid moves here"),
        (b"UNITS/MM", b"UNITS/INCHES", "off by more than"),
    ],
)
def test_a_program_that_says_something_else_is_not_kept(old, new, words):
    program = simple_program()
    ((name, content),) = Apt().write(program).items()
    assert content.count(old) == 1
    with pytest.raises(OutputError, match=f"post apt: what was to be written reads back as something else .*{words}"):
        read_back(Apt(), program, {name: content.replace(old, new)})


def test_a_program_that_cannot_be_read_is_not_kept():
    program = simple_program()
    ((name, content),) = Apt().write(program).items()
    with pytest.raises(OutputError, match=r"cannot be read back \(porthole.apt, line [0-9]+: .*\); nothing was"):
        read_back(Apt(), program, {name: content.replace(b"MULTAX/ON", b"GOTO/1,2")})


def test_a_move_that_is_lost_is_found():
    program = simple_program()
    files = Val3().write(program)
    line = b"  movel(pPath[3],tTool3,mCut[2])\r\n"
    assert files["porthole/start.pgx"].count(line) == 1
    files["porthole/start.pgx"] = files["porthole/start.pgx"].replace(line, b"")
    with pytest.raises(OutputError, match=r"reads back as something else .*5 moves, the reference has 6"):
        read_back(Val3(), program, files)


def test_posts_that_say_not_how_are_told_of_and_not_compared():
    class Foreign(Postprocessor):
        name, summary, suffix = "foreign", "for the tests", ".apt"

        def files(self, program):
            return {"a.apt": b"nothing of an APT file"}

    class Unread(Foreign):
        suffix = ".xyzzy"

        def files(self, program):
            return {"a.xyzzy": b""}

        def reading(self):
            return {}

    program = simple_program()
    for post, words in ((Foreign(), "does not say how"), (Unread(), "no reader knows"), (Dxf(), "holds curves")):
        back = read_back(post, program, post.files(program))
        assert back.facts is None and [f.code for f in back.findings] == [652] and words in back.findings[0].message


def test_a_program_is_compared_in_its_own_frame():
    pose = np.eye(4)
    pose[:3, 3] = 1000.0
    program = simple_program(T_scan_program=pose)
    post = Val3({"cell": "10,20,30,40,50,60"})
    assert read_back(post, program, post.write(program)).facts["largest_difference_mm"] < 1e-3
