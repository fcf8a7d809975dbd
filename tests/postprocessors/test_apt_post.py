"""The APT post, read back by the reader of the format and looked at by eye."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from post_programs import path_of, program_of, simple_program, straight_program

from sicp_cam.errors import JobError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind, Program, ToolPath
from sicp_cam.rigid_motion import exponential
from sicp_formats.apt import read_path
from sicp_postprocessors.apt import Apt

POSE = exponential(np.array([0.1, -0.2, 0.3, 100.0, -50.0, 25.0]), np.zeros(3))
OPTIONS = [{}, {"units": "inch"}, {"wrap": True}, {"units": "inch", "wrap": "yes", "decimals": 7, "vector_decimals": 9}]


def text_of(post: Apt, program: Program) -> str:
    (content,) = post.write(program).values()
    return content.decode("ascii")


def read_back(post: Apt, program: Program) -> ToolPath:
    ((name, content),) = post.write(program).items()
    assert name.endswith(".apt")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "program.apt"
        file.write_bytes(content)
        return read_path(file)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_program_reads_back(options: dict[str, object]) -> None:
    program = simple_program()
    found = read_back(Apt(options), program)
    assert np.abs(found.tips_mm - program.path.tips_mm).max() <= 1e-4
    assert np.abs(found.axes - program.path.axes).max() <= 1e-7
    assert np.allclose(found.feeds_mm_min, program.path.feeds_mm_min, rtol=0, atol=1e-4)
    assert found.rapid.tolist() == program.path.rapid.tolist()
    assert found.findings == ()
    assert found.name == "porthole"
    kept = [(e.before_move, e.kind, e.value) for e in found.events if e.kind is not EventKind.COMMENT]
    given_events = (EventKind.COMMENT, EventKind.OTHER)
    assert kept == [(e.before_move, e.kind, e.value) for e in program.path.events if e.kind not in given_events]
    assert "first side" in [e.text for e in found.events]


@settings(deadline=None, max_examples=40)
@given(
    tips=st.lists(st.tuples(*[st.floats(-9999.0, 9999.0)] * 3), min_size=2, max_size=8, unique=True),
    axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: sum(c * c for c in v) > 0.01),
    feed=st.floats(0.01, 1e5),
    options=st.sampled_from(OPTIONS),
)
def test_any_path_reads_back(tips, axis, feed, options) -> None:  # type: ignore[no-untyped-def]
    tips = np.array(tips)
    if np.abs(tips - tips[0]).max() < 1e-3:
        return
    axes = np.array([np.array(axis) / np.linalg.norm(axis)] * len(tips))
    found = read_back(Apt(options), program_of(path_of(tips, axes, feed, np.arange(len(tips)) == 0)))
    assert np.abs(found.tips_mm - tips).max() <= 1e-4
    assert np.abs(found.axes - axes).max() <= 1e-7
    assert np.allclose(found.feeds_mm_min[1:], feed, rtol=0, atol=1e-4)


def test_every_rapid_move_has_its_own_word_and_the_feed_stands_where_it_changes() -> None:
    program = straight_program(6, feed=[0, 100, 100, 0, 0, 200], rapid=[True, False, False, True, True, False])
    words = [line.split("/")[0] for line in text_of(Apt(), program).splitlines()]
    moves = words[words.index("MULTAX") + 1 :]
    assert moves == [
        "RAPID",
        "GOTO",
        "FEDRAT",
        "GOTO",
        "GOTO",
        "RAPID",
        "GOTO",
        "RAPID",
        "GOTO",
        "FEDRAT",
        "GOTO",
        "FINI",
    ]


def test_events_of_the_other_sense_and_what_still_runs() -> None:
    events = (
        Event(0, EventKind.SPINDLE, -500.5),
        Event(0, EventKind.COOLANT, 1.0),
        Event(1, EventKind.STOP, 0.0, "OPSTOP"),
        Event(1, EventKind.COMMENT, 0.0, "*CATIA0"),
        Event(1, EventKind.COMMENT, 0.0, "-> CSYS / 1, 0 $"),
    )
    lines = text_of(Apt(), straight_program(2, events=events)).splitlines()
    assert "SPINDL/500.5,RPM,CCLW" in lines
    assert "OPSTOP" in lines
    assert lines[-3:] == ["SPINDL/OFF", "COOLNT/OFF", "FINI"]
    assert "PPRINT/- *CATIA0" in lines
    assert "PPRINT/- -> CSYS / 1, 0" in lines
    assert read_back(Apt(), straight_program(2, events=events, notes=("*CATIA0", "-> CSYS/1"))).findings == ()


def test_the_frame_of_the_coordinates_is_told() -> None:
    program = simple_program(T_scan_program=POSE)
    (told,) = [f for f in Apt().preflight(program) if f.code == 612]
    assert told.level is Level.WARN
    assert "$$ coordinates in the part frame" in text_of(Apt(), program)
    assert not [f for f in Apt().preflight(simple_program()) if f.code == 612]


def test_lines_are_short_where_that_is_wanted() -> None:
    program = simple_program(notes=("x" * 300,))
    assert max(map(len, text_of(Apt({"wrap": True}), program).splitlines())) <= 76


@pytest.mark.parametrize("options", [{"decimals": 2}, {"vector_decimals": 13}, {"units": "cm"}, {"wrap": "perhaps"}])
def test_options_out_of_range_are_job_errors(options: dict[str, object]) -> None:
    with pytest.raises(JobError, match=next(iter(options))):
        Apt(options)


def test_a_path_without_any_feed_is_left_to_the_post_that_follows() -> None:
    program = straight_program(4, feed=[0, 0, 0, 0])
    (told,) = [finding for finding in Apt().preflight(program) if finding.code == 603]
    assert told.level is Level.WARN
    assert "FEDRAT" not in text_of(Apt(), program)
