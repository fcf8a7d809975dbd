"""The DXF post: golden files, what every post must do, and that its drawings are sound and read back."""

import dataclasses
import hashlib
import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from post_programs import nasty_program, path_of, program_of, simple_program, straight_program

from sicp_cam import plugins
from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind, Program, Status
from sicp_cam.rigid_motion import exponential
from sicp_formats.dxf import read_path
from sicp_postprocessors.dxf import Dxf

GOLDEN = Path(__file__).parents[1] / "golden" / "posts"
CASES = {"dxf": simple_program, "dxf-nasty": nasty_program}
STATUSES = (Status.APPROACH, Status.COVERED, Status.COVERED, Status.BRIDGED, Status.COVERED, Status.APPROACH)


def only_file(program, **options):
    ((_, content),) = Dxf(options).write(program).items()
    return content


def opened(content):
    """Return what the library makes of a drawing, after it found nothing to mend."""
    import ezdxf

    document = ezdxf.read(io.StringIO(content.decode("ascii")))
    auditor = document.audit()
    assert not auditor.errors and not auditor.fixes
    return document


def read_back(folder, program, layers="CUT", **options):
    file = folder / "back.dxf"
    file.write_bytes(only_file(program, **options))
    return read_path(file, layers=layers)


@pytest.mark.parametrize("case", CASES)
def test_golden_files(case):
    """Set SICP_REGENERATE_GOLDEN=1 to write them anew, and read the difference before you believe it."""
    files = Dxf().write(CASES[case]())
    for file, content in files.items():
        if os.environ.get("SICP_REGENERATE_GOLDEN") == "1":
            (GOLDEN / case).mkdir(parents=True, exist_ok=True)
            (GOLDEN / case / file).write_bytes(content)
        assert content == (GOLDEN / case / file).read_bytes()
    assert sorted(files) == sorted(path.name for path in (GOLDEN / case).iterdir())


@pytest.mark.parametrize("program", CASES.values(), ids=CASES)
@pytest.mark.parametrize("by_status", [False, True])
def test_the_library_finds_nothing_to_mend(program, by_status):
    content = only_file(program(), by_status=by_status)
    document = opened(content)
    assert document.dxfversion == "AC1015" and document.header["$INSUNITS"] == 4
    lines = content.decode("ascii").splitlines()
    tags = list(zip(lines[::2], lines[1::2], strict=True))
    handles = [int(value, 16) for code, value in tags if code in ("5", "105")]
    seed = handles.pop(0)
    assert len(set(handles)) == len(handles) and seed == max(handles) + 1


def test_cuts_and_rapid_moves_are_polylines_on_their_layers():
    drawn = list(opened(only_file(simple_program())).modelspace())
    assert [(e.dxftype(), e.dxf.layer) for e in drawn] == [
        ("POINT", "RAPID"),
        ("POLYLINE", "CUT"),
        ("POLYLINE", "RAPID"),
    ]
    tips = simple_program().path.tips_mm
    assert np.abs(np.array([v.dxf.location.xyz for v in drawn[1].vertices]) - tips[:5]).max() <= 5e-7
    assert np.abs(np.array([v.dxf.location.xyz for v in drawn[2].vertices]) - tips[4:]).max() <= 5e-7


def test_layers_by_status():
    program = dataclasses.replace(simple_program(), status=STATUSES)
    drawn = [
        (e.dxf.layer, len(e.vertices))
        for e in opened(only_file(program, by_status=True)).modelspace().query("POLYLINE")
    ]
    assert drawn == [("COVERED", 3), ("BRIDGED", 2), ("COVERED", 2), ("RAPID", 2)]


COORDINATES = st.tuples(*[st.floats(-20_000.0, 20_000.0)] * 3)


@settings(max_examples=30, deadline=None)
@given(tips=st.lists(COORDINATES, min_size=3, max_size=12), turn=st.integers(1, 2))
def test_the_cuts_read_back(tmp_path_factory, tips, turn):
    tips = np.cumsum(np.array(tips) / 100.0 + 3.0, axis=0)  # no two at one place, or at the begin again
    rapid = np.arange(len(tips)) < turn
    path = read_back(tmp_path_factory.getbasetemp(), program_of(path_of(tips, [[0, 0, 1]] * len(tips), 600.0, rapid)))
    assert np.abs(path.tips_mm - tips[turn - 1 :]).max() <= 1e-6
    assert path.rapid.tolist() == [True] + [False] * (len(tips) - turn)
    assert path.source.unit == "mm" and path.source.unit_stated


def test_rapid_moves_read_back_and_a_closed_cut_stays_closed(tmp_path):
    square = [[0, 0, 9], [0, 0, 0], [5, 0, 0], [5, 5, 0], [0, 0, 0], [0, 0, 9]]
    program = program_of(path_of(square, [[0, 0, 1]] * 6, 600.0, [True, False, False, False, False, True]))
    assert read_back(tmp_path, program).tips_mm.tolist() == square[:5]
    assert read_back(tmp_path, program, layers="RAPID").tips_mm.tolist() == square[4:]


def test_same_program_same_bytes_in_any_process():
    code = (
        "import hashlib; from post_programs import simple_program; from sicp_postprocessors.dxf import Dxf\n"
        "print(hashlib.sha256(b''.join(Dxf({'by_status': True}).write(simple_program()).values())).hexdigest())"
    )
    here = str(Path(__file__).parent)
    digests = {hashlib.sha256(only_file(simple_program(), by_status=True)).hexdigest()}
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": here}
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
        digests.add(run.stdout.strip())
    assert len(digests) == 1


def test_the_head_says_what_made_it_in_comments():
    program = simple_program(overridden=("gate jump_mm overridden by the operator: 0.75, limit 0.5",))
    lines = only_file(program).decode("ascii").splitlines()
    head = lines[1 : lines.index("SECTION") - 1 : 2]
    assert set(lines[0 : lines.index("SECTION") - 1 : 2]) == {"999"}
    assert head == [
        "porthole",
        "corrected by sicp_cam",
        "gates: all passed",
        "gate jump_mm overridden by the operator: 0.75, limit 0.5",
        "not a safety function: verify at reduced speed",
    ]


def test_nasty_text_stays_in_comments():
    nasty = nasty_program()
    plain = dataclasses.replace(nasty, name="x", notes=("x",))
    contents = [only_file(program).decode("ascii") for program in (nasty, plain)]
    bodies = [content[content.index("0\nSECTION") :] for content in contents]
    assert bodies[0] == bodies[1]
    assert "\x1b" not in contents[0] and "\x07" not in contents[0]
    assert len(contents[0].splitlines()) % 2 == 0


def test_findings_tell_what_a_drawing_cannot_hold():
    findings = Dxf().preflight(simple_program(T_scan_program=exponential(np.full(6, 0.1), np.zeros(3))))
    assert {f.code: f.level for f in findings} == {610: Level.INFO, 612: Level.INFO}
    (told,) = [f.message for f in findings if f.code == 610]
    assert "tool axes and feeds" in told and "2 spindle events" in told
    missing = [f for f in Dxf().preflight(straight_program(3, feed=0.0)) if f.code == 603]
    assert [f.level for f in missing] == [Level.INFO]
    assert [f.code for f in Dxf().preflight(nasty_program()) if f.code == 609] == [609]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(bad):
    with pytest.raises(PathError, match="post dxf refuses 'porthole': "):
        Dxf().write(straight_program(3, events=(Event(1, EventKind.DWELL, bad),)))
    program = straight_program(3)
    broken = program.path.tips_mm.copy()
    broken[1] = bad
    object.__setattr__(program.path, "tips_mm", broken)
    with pytest.raises(PathError, match="move 1, line 11"):
        Dxf().write(program)


def test_decimals_and_tiny_numbers():
    path = path_of([[-0.00004, 1e-9, -0.0], [1e-7, -1e-7, 2.0]], [[0, 0, 1]] * 2, 600.0, [True, False])
    text = only_file(program_of(path), decimals=3).decode("ascii")
    assert "-0" not in text and "e-" not in text.lower() and "\n2.000\n" in text
    for wrong in ({"decimals": 2}, {"decimals": 99}, {"decimal": 3}):
        with pytest.raises(JobError, match="decimal"):
            Dxf(wrong)


def test_one_move_is_a_drawing_and_none_is_refused():
    (point,) = opened(only_file(program_of(path_of([[1, 2, 3]], [[0, 0, 1]], 100.0)))).modelspace()
    assert (point.dxftype(), point.dxf.layer, point.dxf.location.xyz) == ("POINT", "CUT", (1, 2, 3))
    empty = path_of(np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(PathError, match="no moves"):
        Dxf().write(Program("x", empty, ()))


def test_a_target_named_dxf_finds_it() -> None:
    assert Dxf.suffix == ".dxf"
    assert "dxf" in plugins.posts_writing(Path("path.dxf"))
