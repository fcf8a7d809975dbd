"""The post that writes the program that was read: its own rules, with a program of ours behind it."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from post_programs import program_of, simple_program

from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import IntArray, Program, Rewritten, ToolPath
from sicp_cam.rigid_motion import exponential
from sicp_formats.apt import read_path
from sicp_postprocessors.same import Same

POSE = exponential(np.array([0.1, -0.2, 0.3, 100.0, -50.0, 25.0]), np.zeros(3))
CORPUS = Path(__file__).parents[1] / "corpus" / "apt"


@dataclass
class Words:
    """An original that writes how many moves it got, and counts how often it was asked."""

    findings: tuple[Finding, ...] = ()
    asked: list[int] = field(default_factory=list)
    suffix: str = ".own"

    def rewritten(self, path: ToolPath, source_moves: IntArray) -> Rewritten:
        self.asked.append(len(path))
        return Rewritten(f"{len(path)} moves\n".encode(), self.findings)


def program(original: Words | None = None, **more: object) -> Program:
    plain = simple_program(**{"source_moves": np.arange(6), **more})
    return replace(plain, path=replace(plain.path, original=original))


def test_the_file_is_what_the_original_writes_and_is_written_once() -> None:
    words = Words()
    post, wanted = Same(), program(words)
    assert post.write(wanted) == {"porthole.own": b"6 moves\n"}
    assert post.preflight(wanted) == []
    assert words.asked == [6]
    assert post.write(program(words, name="other")) == {"other.own": b"6 moves\n"}


def test_findings_of_the_original_are_passed_on_and_failures_forbid_the_program() -> None:
    note = Finding(320, Level.INFO, "2 arcs")
    assert Same().preflight(program(Words((note,)))) == [note]
    with pytest.raises(PathError, match="no words"):
        Same().write(program(Words((Finding(322, Level.FAIL, "no words"),))))


def test_programs_that_cannot_be_written_again_are_refused_with_the_reason() -> None:
    told = r"cannot be written again in its own words: its format .* \(APT, CL, G-code and CSV can\); use another post"
    with pytest.raises(PathError, match=told):
        Same().write(program(None))
    with pytest.raises(PathError, match=r"cannot be written again .* is not known; use another post"):
        Same().write(program(Words(), source_moves=None))


def test_an_overridden_gate_has_no_place_in_it() -> None:
    words = Words()
    with pytest.raises(PathError, match=r"a gate was overridden; use another post"):
        Same().write(program(words, overridden=("gate jump_mm overridden by the operator: 0.75, limit 0.5",)))
    assert words.asked == []


def test_the_frame_and_a_changed_name_are_told() -> None:
    found = Same().preflight(program(Words(), T_scan_program=POSE, name="a/b"))
    assert {f.code for f in found} == {609, 612}
    assert Same().write(program(Words(), name="a/b")) == {"a_b.own": b"6 moves\n"}


def test_numbers_that_are_none_do_not_reach_the_original() -> None:
    words = Words()
    broken = program(words)
    tips = broken.path.tips_mm.copy()
    tips[1] = np.nan
    object.__setattr__(broken.path, "tips_mm", tips)
    with np.errstate(invalid="ignore"), pytest.raises(PathError, match="move 1"):
        Same().write(broken)
    assert words.asked == []


def test_it_has_no_options() -> None:
    with pytest.raises(JobError, match="post same has no option 'head'"):
        Same({"head": "yes"})


def test_an_apt_program_comes_back_byte_for_byte() -> None:
    path = read_path(CORPUS / "autodesk.apt")
    moves = np.arange(len(path))
    assert Same().write(program_of(path, name="edge", source_moves=moves)) == {
        "edge.apt": (CORPUS / "autodesk.apt").read_bytes()
    }
    higher = replace(path, tips_mm=path.tips_mm + np.array([0, 0, 0.5]))
    (content,) = Same().write(program_of(higher, source_moves=moves)).values()
    assert b"GOTO/18,3.25,-0.5,0,0.28,0.96\n" in content
