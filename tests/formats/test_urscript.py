"""The reader of Universal Robots scripts against programs whose truth is known."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.urscript import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "urscript"
P, Q, R = (f"p[{x},0,0,3.14159265,0,0]" for x in (0, 0.009, 0.02))


def read(folder: Path, code: str, **options: object) -> ToolPath:
    (folder / "a.script").write_text(f"def a():\n{code}\nend\n")
    return read_path(folder / "a.script", **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def test_reads_a_script() -> None:
    path = read_path(CORPUS / "trim.script")
    assert np.allclose(path.tips_mm[:3], [[100, 50, 50], [100, 50, 5], [100, 50, 15]])
    arc = path.tips_mm[2:-1]
    assert np.abs(np.linalg.norm(arc - [110, 50, 15], axis=1) - 10).max() < 1e-6
    assert np.allclose(path.tips_mm[-1], [130, 50, 50])
    assert np.allclose(path.axes[[0, 1, 2, -1]], [[0, 0, 1], [0, 0, 1], [-1, 0, 0], [-1, 0, 0]], atol=1e-7)
    assert path.feeds_mm_min[[0, 1, 2, 3, -1]].tolist() == [0, 3000, 3000, 6000, 12_000]
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    assert path.lines[[0, 1, 2, 3, -1]].tolist() == [12, 15, 16, 17, 8]
    assert path.name == "trim"
    assert path.source is not None and path.source.unit == "m" and path.source.unit_stated
    assert codes(path) == {306, 317, 335, 337}
    told = [(e.kind, e.value, e.text, e.line) for e in path.events]
    assert (EventKind.DWELL, 0.5, "sleep(0.5)", 14) in told
    assert (EventKind.OTHER, 0.0, "set_standard_digital_out(3, True)", 13) in told
    assert (EventKind.COMMENT, 0.0, 'trim, the "rim" of part 7', 1) in told
    assert [e.line for e in path.events if e.kind is EventKind.STOP] == [22]


@settings(deadline=None, max_examples=30)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3))
def test_rotation_vectors_are_those_of_the_controller(turn: tuple[float, ...]) -> None:
    vector = [round(angle, 9) for angle in turn]
    with TemporaryDirectory() as folder:
        words = ",".join(f"{angle:.9f}" for angle in vector)
        path = read(Path(folder), f"movel({P}, v=1)\nmovel(p[1,0,0,{words}], v=1)")
    assert np.abs(path.axes[1] + Rotation.from_rotvec(vector).as_matrix()[:, 2]).max() < 1e-9


def test_speeds_by_place_and_by_name(tmp_path: Path) -> None:
    code = f"s = 0.1\nmovej({P}, 1.4, 1.05)\nmovel({Q}, 1.2, 0.02)\nmovel({R}, v=s, a=1, r=0.001)\nmovep({P})"
    path = read(tmp_path, code)
    assert np.allclose(path.feeds_mm_min, [0, 1200, 6000, 15_000])
    assert np.allclose(path.tips_mm[:, 0], [0, 9, 20, 0])


def test_statements_outside_of_functions_are_the_program(tmp_path: Path) -> None:
    (tmp_path / "a.script").write_text(f"def b():\nmovel({Q})\nend\nmovel({P})\nb()\n")
    path = read_path(tmp_path / "a.script")
    assert path.tips_mm[:, 0].tolist() == [0, 9] and path.name == "a"
    with pytest.raises(FormatError, match="choose one of b with"):
        read_path(tmp_path / "a.script", program="c")
    with pytest.raises(FormatError, match="all moves end at one point"):
        read_path(tmp_path / "a.script", program="b")


@pytest.mark.parametrize(
    ("code", "line", "words"),
    [
        ("movel(x)", 2, "assigned nowhere"),
        ("x = get_actual_tcp_pose()\nmovel(x)", 3, "computed by the script"),
        (f"movel(pose_add({P}, {Q}))", 2, "is computed"),
        ("movel(p[1,2,3])", 2, "is computed or incomplete"),
        ("movel(p[1,2,3,0,0,d2r(90)])", 2, "is computed or incomplete"),
        ("movel([0,0,0,0,0,0])", 2, "movel to joint angles"),
        ("movel()", 2, "lacks its points"),
        (f"movel({P}, t=5)", 2, "time of the move"),
        (f"movel({P}, v=0)", 2, "not possible"),
        (f"movel({P}, v=speed)", 2, "assigned nowhere"),
        (f"movel({P})\nmovej([0,0,0,0,0,0])\nmovel({Q})", 4, "line 3 stands between two points"),
        (f"movec({P}, {Q})", 2, "before the first known point"),
        (f"movel({P})\nmovec({Q}, {R})", 3, "on a line"),
        (f"movel({P})\nmovel(pose_trans(part, {Q}))", 3, "frame changes from base to part"),
        (f"if x:\nmovel({P})\nend", 2, "decides about motion"),
        (f"while (True):\nmovel({P})\nend", 2, "decides about motion"),
        ("if x:\nset_tcp(y)\nend", 2, "set_tcp under a condition"),
        ("def set_b():\nmovel(x)\nend\nif y:\nset_b()\nend", 5, "decides about motion"),
        ("servoj([0,0,0,0,0,0])", 2, "may move the robot"),
        ("force_mode(x)", 2, "may move the robot"),
        ("grip(5)", 2, "path.calls=grip"),
        ("x = grip(5)", 2, "calls what may move"),
        ("def b(x):\nmovel(x)\nend\nb(1)", 5, "has arguments"),
        ("a()", 2, "within itself"),
        ("return 5", 2, "leaves the way"),
    ],
)
def test_what_would_be_a_guess_is_refused_with_its_line(tmp_path: Path, code: str, line: int, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, code)
    assert words in str(caught.value)
    assert f"a.script, line {line}: " in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("\n", 1, "has no statement"),
        ("def a():\nmovel(x)\n", 1, "has no end"),
        ("def a():\nend\nend\n", 3, "closes nothing"),
        ("def a():\nend\ndef a():\nend\n", 3, "stands twice"),
        ("movel(p[1,2,\n3", 1, "is not closed"),
        ("sleep(1)\n", 1, "holds no move"),
    ],
)
def test_files_that_are_no_programs(tmp_path: Path, text: str, line: int, words: str) -> None:
    (tmp_path / "a.script").write_text(text)
    with pytest.raises(FormatError) as caught:
        read_path(tmp_path / "a.script")
    assert words in str(caught.value)
    assert caught.value.line == line


def test_options(tmp_path: Path) -> None:
    code = f"suck()\nmovel({P})\nmovel({Q})"
    path = read(tmp_path, code, calls="suck", tool_axis="z", units="m")
    assert np.allclose(path.axes, [[0, 0, -1]] * 2, atol=1e-7)
    assert codes(path) == {317, 338}
    with pytest.raises(UnitError, match="states m"):
        read(tmp_path, code, units="mm")
    with pytest.raises(JobError, match="tool_axis"):
        read(tmp_path, code, tool_axis="down")


@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_damaged_scripts_give_a_path_or_a_typed_error(data: st.DataObject) -> None:
    content = bytearray((CORPUS / "trim.script").read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.sampled_from(b'[](),:=\r 0.-e#"\x00\xff'))
    with TemporaryDirectory() as folder:
        file = Path(folder, "trim.script")
        file.write_bytes(bytes(content[: data.draw(st.integers(1, 2 * len(content)))]))
        try:
            path = read_path(file)
        except SicpError as error:
            assert str(error).isprintable()
        else:
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)
