"""The reader of Fanuc listings against programs whose truth is known."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.fanuc_ls import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "fanuc_ls"
JOINTS = "P[8]{\n GP1:\n UF : 1, UT : 1,\n J1= 0 deg, J2= 0 deg, J3= 0 deg, J4= 0 deg, J5= 0 deg, J6= 0 deg\n};"


def point(number: int, x: float, *, w: float = 180.0, p: float = 0.0, r: float = 0.0, more: str = "") -> str:
    return (
        f"P[{number}]{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX = {x:.3f} mm,\tY = 0.000 mm,"
        f"\tZ = 0.000 mm,\n\tW = {w:.6f} deg,\tP = {p:.6f} deg,\tR = {r:.6f} deg{more}\n}};"
    )


POINTS = "\n".join([*(point(number, 9.0 * number) for number in range(1, 5)), JOINTS])


def read(folder: Path, code: str, points: str = POINTS, **options: object) -> ToolPath:
    numbered = "\n".join(f"{number:4}:  {line} ;" for number, line in enumerate(code.split("\n"), 1))
    (folder / "a.ls").write_text(f"/PROG  A\n/ATTR\n/MN\n{numbered}\n/POS\n{points}\n/END\n")
    return read_path(folder / "a.ls", **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def test_reads_what_a_controller_writes_and_the_program_that_it_calls() -> None:
    path = read_path(CORPUS / "TRIM.LS")
    assert path.tips_mm[:3].tolist() == [[100, 50, 50], [100, 50, 0.5], [100, 50, 15]]
    assert path.tips_mm[-3:].tolist() == [[130, 50, 15], [130, 50, 50], [130, 50, 80]]
    arc = path.tips_mm[2:-3]
    assert np.abs(np.linalg.norm(arc - [110, 50, 15], axis=1) - 10).max() < 1e-9
    assert np.allclose(path.axes[[0, 1, 2, -1]], [[0, 0, 1], [0, 0, 1], [-1, 0, 0], [-1, 0, 0]], atol=1e-12)
    assert path.feeds_mm_min[[0, 1, 2, 3, -3, -2, -1]].tolist() == [0, 15_000, 3000, 3000, 0, 7620, 12_000]
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    assert path.source is not None and path.source.unit_stated
    assert codes(path) == {302, 306, 317, 335, 337}
    told = [(e.kind, e.value, e.text) for e in path.events]
    assert (EventKind.COMMENT, 0.0, "rim of part 7") in told
    assert (EventKind.TOOL, 3.0, "tool UTOOL[3]") in told
    assert (EventKind.OTHER, 0.0, "DO[3:spindle]=ON") in told
    assert (EventKind.DWELL, 1.5, "WAIT   1.50(sec)") in told
    assert told[-1] == (EventKind.STOP, 0.0, "PAUSE")


@settings(deadline=None, max_examples=30)
@given(angles=st.tuples(*[st.one_of(st.floats(-180, 180), st.sampled_from([-90.0, 90.0, 180.0]))] * 3))
def test_angles_are_those_of_the_controller(angles: tuple[float, float, float]) -> None:
    w, p, r = (round(angle, 6) for angle in angles)
    with TemporaryDirectory() as folder:
        points = "\n".join([point(1, 0), point(2, 9, w=w, p=p, r=r)])
        found = read(Path(folder), "L P[1] 9mm/sec FINE\nL P[2] 9mm/sec FINE", points)
    expected = -Rotation.from_euler("ZYX", [r, p, w], degrees=True).as_matrix()[:, 2]
    assert np.abs(found.axes[1] - expected).max() < 1e-9


def test_lines_are_those_of_the_file_where_there_is_one(tmp_path: Path) -> None:
    path = read(tmp_path, "J P[1] 20% CNT100\n!cut\nL P[2] 6cm/min CNT5 ACC90 TB .10sec,CALL X\nL P[3] 9mm/sec CNT100")
    assert path.lines.tolist() == [4, 6, 7]
    assert path.feeds_mm_min.tolist() == [0, 60, 540]
    assert [(e.text, e.line, e.before_move) for e in path.events] == [
        ("tool UTOOL[1]", 9, 0),
        ("cut", 5, 1),
        ("TB .10sec,CALL X", 6, 2),
    ]


def test_what_stands_behind_the_end_is_told(tmp_path: Path) -> None:
    path = read(tmp_path, "L P[1] 9mm/sec FINE\nL P[2] 9mm/sec FINE\nEND\nL P[3] 9mm/sec FINE")
    assert len(path) == 2 and 312 in codes(path)


GO = "L P[1] 9mm/sec FINE\n"


@pytest.mark.parametrize(
    ("code", "line", "words"),
    [
        ("L P[7] 9mm/sec FINE", 4, "P[7] is not in /POS"),
        ("L PR[1] 9mm/sec FINE", 4, "registers and other points are not followed"),
        ("L P[R[1]] 9mm/sec FINE", 4, "registers and other points are not followed"),
        ("C P[1] 9mm/sec FINE", 4, "C needs P[...]"),
        (GO + "C P[2] P[3] 9mm/sec FINE", 5, "on a line"),
        ("A P[1] 9mm/sec FINE", 4, "A motions are not read"),
        ("L P[8] 9mm/sec FINE", 4, "only J takes them"),
        (GO + "J P[8] 20% FINE\n" + GO, 6, "line 5 stands between two points"),
        ("L P[1] 20% FINE", 4, "given in %, not along the path"),
        ("L P[1] 2.5sec FINE", 4, "given in sec"),
        ("L P[1] R[3]mm/sec FINE", 4, "is computed (R[3])"),
        ("R[3]=R[4]*2\nL P[1] R[3]mm/sec FINE", 5, "is computed (R[3])"),
        ("L P[1] 0mm/sec FINE", 4, "is not possible"),
        ("L P[1] fast FINE", 4, "states no speed"),
        ("L P[1] 9mm/sec", 4, "without FINE or CNT"),
        ("L P[1] 9mm/sec FINE Offset,PR[1]", 4, "shifted or cut short (Offset)"),
        ("L P[1] 9mm/sec FINE Skip,LBL[1]", 4, "shifted or cut short (Skip)"),
        ("UFRAME_NUM=2\n" + GO, 5, "UFRAME_NUM is 2, the position was taught in 1"),
        ("UTOOL_NUM=R[1]", 4, "is computed"),
        (GO + "UFRAME[1]=PR[2]", 5, "moves a frame within the path"),
        (GO + "UFRAME_NUM=3", 5, "frame changes from UFRAME[1] to UFRAME[3]"),
        ("IF R[1]=1,CALL MOVE", 4, "decides about motion"),
        ("IF (DI[1]=ON) THEN\nUFRAME_NUM=2\nENDIF", 4, "changes a frame under a condition"),
        ("FOR R[1]=1 TO 3\n" + GO + "ENDFOR", 4, "decides about motion"),
        ("SELECT R[1]=1,JMP LBL[1]", 4, "leaves the way"),
        ("JMP LBL[1]", 4, "leaves the way"),
        ("CALL OTHER", 4, "path.calls=OTHER"),
        ("CALL A", 4, "within itself"),
        ("Open hand 1", 4, "'Open hand 1' is not in the program and may move"),
        ("Track TAST[1]", 4, "leave the programmed points"),
        ("FOR R[1]=1 TO 3", 36, "without its end"),
    ],
)
def test_what_would_be_a_guess_is_refused_with_its_line(tmp_path: Path, code: str, line: int, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, code)
    assert words in str(caught.value)
    if line != 36:
        assert f"a.ls, line {line}: " in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("hello\n", 1, "before /PROG"),
        ("/PROG\n/MN\n", 1, "without a name"),
        ("/PROG A\n/POS\n", 1, "no /PROG and /MN"),
        ("/PROG A\n/MN\n/PROG B\n", 3, "a second /PROG"),
        ("/PROG A\n/MN\nL P[1] 9mm/sec FINE ;\n", 3, "no line number and colon"),
        ("/PROG A\n/MN\n 1:L P[1] 9mm/sec FINE\n", 3, "has no end (;)"),
        ("/PROG A\n/MN\n/POS\nP[1]{\n GP1:\n", 4, "P[1] has no end"),
        (f"/PROG A\n/MN\n/POS\n{point(1, 0)}\n{point(1, 0)}\n", 10, "P[1] stands twice"),
        ("/PROG A\n/MN\n/POS\nP[1]{\n GP1:\n X = 1 mm\n};\n", 4, "lacks Y, Z, W, P, R"),
        ("/PROG A\n/MN\n/POS\nP[1]{\n GP1:\n X = ******** mm\n};\n", 4, "never taught"),
        (f"/PROG A\n/MN\n/POS\n{point(1, 0).replace('mm', 'deg')}\n", 4, "is in 'deg' and not in mm"),
        ("/PROG A\n/MN\n/POS\nX\n", 4, "is no position"),
        ("/PROG A\n/MN\n/POS\n/END\n", 1, "holds no move"),
    ],
)
def test_files_that_are_no_programs(tmp_path: Path, text: str, line: int, words: str) -> None:
    (tmp_path / "a.ls").write_text(text)
    with pytest.raises(FormatError) as caught:
        read_path(tmp_path / "a.ls")
    assert words in str(caught.value)
    assert caught.value.line == line


def test_options(tmp_path: Path) -> None:
    code = "Open hand 1\nCALL SUCK\nL P[1] WELD_SPEED FINE\nL P[2] WELD_SPEED FINE"
    path = read(tmp_path, code, calls="suck, open hand 1", tool_axis="z", feed_mm_min=5.0)
    assert path.axes.round(12).tolist() == [[0, 0, -1]] * 2
    assert path.feeds_mm_min.tolist() == [5, 5]
    assert codes(path) == {317, 338}
    with pytest.raises(UnitError, match="states mm"):
        read(tmp_path, code, units="inch")
    with pytest.raises(JobError, match="tool_axis"):
        read(tmp_path, code, tool_axis="down")


def test_external_axes_that_move_are_told(tmp_path: Path) -> None:
    points = "\n".join([point(1, 0, more=",\n\tE1= 0.000 mm"), point(2, 9, more="\n   GP2:\n\tJ1= 5.000 deg")])
    assert 336 in codes(read(tmp_path, "L P[1] 9mm/sec FINE\nL P[2] 9mm/sec FINE", points))


def test_a_missing_end_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.ls").write_text(
        f"/PROG A\n/MN\n1:L P[1] 9mm/sec FINE ;\n2:L P[2] 9mm/sec FINE ;\n/POS\n{point(1, 0)}\n{point(2, 9)}\n"
    )
    assert 316 in codes(read_path(tmp_path / "a.ls"))


@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_damaged_programs_give_a_path_or_a_typed_error(data: st.DataObject) -> None:
    with TemporaryDirectory() as folder:
        for name in ("TRIM.LS", "lift.ls"):
            content = bytearray((CORPUS / name).read_bytes())
            for _ in range(data.draw(st.integers(0, 3))):
                content[data.draw(st.integers(0, len(content) - 1))] = data.draw(
                    st.sampled_from(b"[]{}(),;:=\r 0.-eX/\x00\xff")
                )
            Path(folder, name).write_bytes(bytes(content[: data.draw(st.integers(1, 2 * len(content)))]))
        try:
            path = read_path(Path(folder, "TRIM.LS"))
        except SicpError as error:
            assert str(error).isprintable()
        else:
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)


def test_a_number_that_is_too_large_is_refused(tmp_path: Path) -> None:
    points = "\n".join([point(1, 0), point(2, 9).replace("W = 180.000000", f"W = {'9' * 400}")])
    with pytest.raises(FormatError, match=r"a\.ls, line \d+: W of P\[2\] is too large to be a number"):
        read(tmp_path, "L P[1] 9mm/sec FINE\nL P[2] 9mm/sec FINE", points)


@pytest.mark.parametrize("line", [" " * 50_000 + "x", "   1:R[" + "]" * 50_000 + " ;", "P[1" + " " * 50_000])
def test_a_long_line_takes_no_long_time(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.ls").write_text(f"/PROG A\n/MN\n{line}\n/POS\n{line}\n/END\n")
    begun = time.process_time()
    with pytest.raises(FormatError, match=r"a\.ls, line [35]"):
        read_path(tmp_path / "a.ls")
    assert time.process_time() - begun < 1.0
