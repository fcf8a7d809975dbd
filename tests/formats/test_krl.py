"""The KUKA reader against programs whose truth is known."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.krl import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "krl"
P = "{X 0,Y 0,Z 0,A 0,B 0,C 180}"
Q = "{X 9,Y 0,Z 0,A 0,B 0,C 180}"


def read(folder: Path, code: str, data: str | None = None, **options: object) -> ToolPath:
    (folder / "a.src").write_text(f"DEF a()\n{code}\nEND\n")
    if data is not None:
        (folder / "a.dat").write_text(f"DEFDAT A\n{data}\nENDDAT\n")
    return read_path(folder / "a.src", **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def test_reads_a_program_with_its_data_file() -> None:
    path = read_path(CORPUS / "trim.src")
    assert path.tips_mm[:3].tolist() == [[100, 50, 50], [100, 50, 5], [100, 50, 15]]
    assert np.allclose(path.tips_mm[-1], [120, 50, 50])
    arc = path.tips_mm[2:-1]
    assert np.abs(np.linalg.norm(arc - [110, 50, 15], axis=1) - 10).max() < 1e-9
    assert arc[:, 1].max() == pytest.approx(60, abs=0.01)
    # C = 180 turns the tool's Z down, B = 90 along X; the axis points the other way.
    assert np.allclose(path.axes[[0, 1, -1]], [[0, 0, 1], [-1, 0, 0], [-1, 0, 0]], atol=1e-12)
    assert path.feeds_mm_min[[0, 1, 2, 3, -1]].tolist() == [0, 3000, 3000, 6000, 12_000]
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    assert path.lines[[0, 1, -1]].tolist() == [13, 18, 29]
    assert path.source is not None and path.source.unit_stated
    assert codes(path) == {306, 317, 335, 337}
    told = [(e.kind, e.value, e.text, e.line) for e in path.events]
    assert (EventKind.TOOL, 2.0, "tool TOOL_DATA[2]", 10) in told
    assert (EventKind.OTHER, 0.0, "$OUT[3]=TRUE", 16) in told
    assert (EventKind.DWELL, 0.5, "WAIT SEC 0.5", 17) in told
    assert (EventKind.COMMENT, 0.0, "FOLD PTP P1 Vel=100 % PDAT1", 12) in told


@settings(deadline=None, max_examples=30)
@given(angles=st.tuples(*[st.one_of(st.floats(-180, 180), st.sampled_from([-90.0, 90.0, 180.0]))] * 3))
def test_angles_are_those_of_the_controller(angles: tuple[float, float, float]) -> None:
    a, b, c = (round(angle, 6) for angle in angles)
    with TemporaryDirectory() as folder:
        code = f"$VEL.CP=1\nLIN {P}\nLIN {{X 1,A {a:.6f},B {b:.6f},C {c:.6f}}}"
        found = read(Path(folder), code)
    expected = -Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix()[:, 2]
    assert np.abs(found.axes[1] - expected).max() < 1e-9


def test_points_can_be_assigned_on_the_way(tmp_path: Path) -> None:
    code = (
        f"DECL E6POS XA\nXA={P}\n$VEL={{CP 0.1,ORI1 200}}\nLIN XA\nXA.X=5\nLIN XA\nXB=XA\nXA.X=n*2\nLIN XB\nLIN {{Z 1}}"
    )
    path = read(tmp_path, code)
    assert path.tips_mm.tolist() == [[0, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 1]]


@pytest.mark.parametrize(
    ("code", "line", "words"),
    [
        (f"LIN {P}\nLIN XP9", 3, "declared nowhere; is the .dat"),
        (f"LIN {P}\nLIN XP1:{{X 1}}", 3, "is computed"),
        (f"XA={P}\nXA.X=n+1\nLIN XA", 4, "computed by the program"),
        ("LIN {X 1,Y 2}", 2, "leaves out Z, A, B, C"),
        ("LIN {X 1,5}", 2, "computed or no point"),
        ("LIN {A1 0,A2 -90}", 2, "only PTP takes them"),
        (f"LIN {P}\nPTP {{A1 0,A2 -90}}\nLIN {Q}", 4, "line 3 stands between two points"),
        (f"CIRC {P},{Q}", 2, "before the first known point"),
        (f"LIN {P}\nCIRC {Q},{Q},CA 90", 3, "an angle CA"),
        (f"LIN {P}\nCIRC {Q},{{X 20}}", 3, "on a line"),
        ("PTP_REL {A1 10}", 2, "with X, Y and Z behind a known point"),
        (f"IF $IN[1] THEN\nLIN {P}\nENDIF", 2, "decides about motion"),
        (f"FOR I=1 TO 3\nLIN {P}\nENDFOR", 2, "decides about motion"),
        (f"LOOP\nPTP {P}\nENDLOOP", 2, "decides about motion"),
        (f"SPLINE\nSPL {P}\nENDSPLINE", 2, "decides about motion"),
        (f"IF $IN[1] THEN\n$VEL.CP=1\nENDIF\nLIN {P}", 5, "under a condition"),
        ("IF $IN[1] THEN\n$BASE=X\nENDIF", 2, "change the base under a condition"),
        (f"LIN {P}\n$BASE=BASE_DATA[2]\n", 3, "frame changes from none to $BASE"),
        ("$VEL.CP=0", 2, "not possible"),
        ("$VEL.CP=V*2", 2, "is computed"),
        ("$IPO_MODE=#TCP", 2, "carries the part"),
        ("GRIPPER()", 2, "path.calls=GRIPPER"),
        ("a()", 2, "within itself"),
        ("GOTO X", 2, "leave the program"),
        ("IF X THEN", 2, "is not closed"),
    ],
)
def test_what_would_be_a_guess_is_refused_with_its_line(tmp_path: Path, code: str, line: int, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, code)
    assert words in str(caught.value)
    assert f"a.src, line {line}: " in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("DEF a()\nHALT\n", 1, "DEF without END"),
        ("hello\n", 1, "outside of DEF"),
        ("<xml>\n", 1, "is this a KRL program"),
        ("DEF a()\nDEF b()\nEND\n", 2, "an END missing"),
        ("&ACCESS RVP\n", 1, "has no DEF"),
        ("DEF a()\nEND\n", 1, "holds no move"),
    ],
)
def test_files_that_are_no_programs(tmp_path: Path, text: str, line: int, words: str) -> None:
    (tmp_path / "a.src").write_text(text)
    with pytest.raises(FormatError) as caught:
        read_path(tmp_path / "a.src")
    assert caught.value.line == line
    assert words in str(caught.value)


def test_options(tmp_path: Path) -> None:
    code = f"SUCK()\nLIN {P}\nLIN {Q}"
    path = read(tmp_path, code, calls="suck", tool_axis="z", feed_mm_min=5.0)
    assert path.axes.tolist() == [[0, 0, -1]] * 2
    assert path.feeds_mm_min.tolist() == [5, 5]
    assert codes(path) == {338}
    with pytest.raises(UnitError, match="states mm"):
        read(tmp_path, code, units="inch")
    with pytest.raises(JobError, match="tool_axis"):
        read(tmp_path, code, tool_axis="down")
    with pytest.raises(FormatError, match=r"path\.program=NAME one of A"):
        read(tmp_path, code, program="other")


def test_external_axes_that_move_are_told(tmp_path: Path) -> None:
    path = read(tmp_path, f"$VEL.CP=1\nLIN {P[:-1]},E1 0}}\nLIN {Q[:-1]},E1 5}}")
    assert codes(path) == {336}


def test_a_data_file_that_is_cut_short(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.dat, line 2: a brace is not closed"):
        read(tmp_path, f"LIN {P}", "DECL E6POS XP1={X 1,Y 2")


@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_damaged_programs_give_a_path_or_a_typed_error(data: st.DataObject) -> None:
    with TemporaryDirectory() as folder:
        for name in ("trim.src", "trim.dat"):
            content = bytearray((CORPUS / name).read_bytes())
            for _ in range(data.draw(st.integers(0, 3))):
                content[data.draw(st.integers(0, len(content) - 1))] = data.draw(
                    st.sampled_from(b"{}(),;=\r 0.-eX\x00\xff")
                )
            Path(folder, name).write_bytes(bytes(content[: data.draw(st.integers(1, 2 * len(content)))]))
        try:
            path = read_path(Path(folder, "trim.src"))
        except SicpError as error:
            assert str(error).isprintable()
        else:
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)


def test_programs_beside_it_are_called_by_their_name(tmp_path: Path) -> None:
    (tmp_path / "Part_1.SRC").write_text("&ACCESS RVP\nDEF part_1( )\nLIN XP1\nEND\n")
    (tmp_path / "Part_1.dat").write_text(f"DEFDAT part_1\nDECL E6POS XP1={Q}\nENDDAT\n")
    path = read(tmp_path, f"$VEL.CP=0.1\nPTP {P}\nPART_1( )\nWAIT SEC 0\nLIN {P}")
    assert path.tips_mm[:, 0].tolist() == [0, 9, 0]
    assert path.feeds_mm_min.tolist() == [0, 6000, 6000] and path.lines.tolist() == [0, 0, 0]
    assert not [event for event in path.events if event.kind is EventKind.DWELL]
    with pytest.raises(FormatError, match=r"a\.src, line 2: 'XP1' is declared nowhere"):
        read(tmp_path, "LIN XP1\nPART_1( )")
    (tmp_path / "Part_1.SRC").write_text("DEF part_1( )\nLIN XP2\nEND\n")
    with pytest.raises(FormatError, match=r"Part_1\.SRC, line 2: 'XP2' is declared nowhere"):
        read(tmp_path, f"PTP {P}\nPART_1( )")
