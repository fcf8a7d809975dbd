"""The CSV path reader against tables whose truth is known."""

from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.path_csv import read_path

TIPS = [[1, 2, 3], [4.5, -5, 6]]


def read(tmp_path: Path, text: str, **options: object) -> ToolPath:
    path = tmp_path / "path.csv"
    path.write_bytes(text.encode())
    return read_path(path, **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def refused(tmp_path: Path, text: str, line: int, *words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text)
    assert caught.value.line == line
    assert f"path.csv, line {line}: " in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_reads_the_table_that_this_package_writes(tmp_path: Path) -> None:
    text = (
        "x,y,z,i,j,k,feed,rapid,status\n1.0000,2.0000,3.0000,0.0000000,0.0000000,1.0000000,0,1,approach\n"
        "4.5000,-5.0000,6.0000,0.0000000,0.6000000,0.8000000,1500,0,covered\n"
    )
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == TIPS
    assert np.allclose(path.axes, [[0, 0, 1], [0, 0.6, 0.8]], atol=1e-15)
    assert path.feeds_mm_min.tolist() == [0, 1500]
    assert path.rapid.tolist() == [True, False]
    assert path.lines.tolist() == [2, 3]
    assert path.source is not None
    assert path.source.unit_stated
    assert codes(path) == {315}
    with pytest.raises(UnitError, match=r"path\.csv, line 1"):
        read(tmp_path, text, units="inch")


def test_reads_the_table_with_uncertainties_and_empty_cells(tmp_path: Path) -> None:
    text = (
        "x,y,z,i,j,k,feed,rapid,status,u_mm\n1.0000,2.0000,3.0000,0.0,0.0,1.0,0.0000,1,approach,\n"
        "4.5000,-5.0000,6.0000,0.0,0.6,0.8,1500.0000,0,covered,0.050000\n"
    )
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == TIPS
    assert path.rapid.tolist() == [True, False]
    (finding,) = path.findings
    assert finding.code == 315
    assert "status" in finding.message and "u_mm" in finding.message
    assert path.source is not None and path.source.unit_stated


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,i,j,k\n1,2,3,0,0,1\n4.5,-5,6,0,0,1\n",
        "K , Z, Y ,X,I,J\r\n1,3,2,1,0,0\r\n\r\n1,6,-5,4.5,0,0",
        "x;y;z;i;j;k\n1,0;2,0;3,0;0,0;0,0;1,0\n4,5;-5,0;6,0;0,0;0,0;1,0\n",
        "x;y;z;i;j;k\n1;2;3;0;0;1\n4.5;-5;6;0;0;1\n",
        "x\ty\tz\ti\tj\tk\n1\t2\t3\t0\t0\t1\n4,5\t-5\t6\t0\t0\t1\n",
        "1,2,3,0,0,1\n4.5,-5,6,0,0,1\n",
        "1 2 3  0 0 1\n4.5 -5   6 0 0 1\n",
        '# made by hand\n"x","y","z","i","j","k"\n1,2,3,0,0,1\n# half\n4.5,-5,6,0,0,1\n',
        "\ufeffx,y,z,i,j,k\n1,2,3,0,0,1\n4.5,-5,6,0,0,1\n",
        "x,y,z,i,j,k\n1,2,3,0,0,1\n4.5,-5,6,0,0,0\n",
    ],
)
def test_layouts(tmp_path: Path, text: str) -> None:
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == TIPS
    assert path.axes.tolist() == [[0, 0, 1], [0, 0, 1]]
    assert codes(path) - {305} == {301, 302}


def test_comments_are_events(tmp_path: Path) -> None:
    path = read(tmp_path, "# made by hand\nx,y,z\n1,2,3\n4,5,6\n")
    assert [(e.kind, e.text, e.line) for e in path.events] == [(EventKind.COMMENT, "made by hand", 1)]


@pytest.mark.parametrize("text", ["x,y,z\n1,2,3\n4.5,-5,6\n", "1,2,3\n4.5,-5,6\n"])
def test_missing_axis_is_assumed_with_a_warning(tmp_path: Path, text: str) -> None:
    path = read(tmp_path, text, units="mm", feed_mm_min=10.0)
    assert path.axes.tolist() == [[0, 0, 1], [0, 0, 1]]
    assert path.feeds_mm_min.tolist() == [10, 10]
    assert codes(path) == {303}


@pytest.mark.parametrize(
    "head", ["x [inch],y [inch],z [inch],feed", "x_in,y_in,z_in,feed", "X (in),Y (in),Z (in),Feed"]
)
def test_unit_in_the_header(tmp_path: Path, head: str) -> None:
    path = read(tmp_path, f"{head}\n1,2,3,10\n4,5,6,20\n")
    assert path.tips_mm[0].tolist() == [25.4, 50.8, 3 * 25.4]
    assert path.feeds_mm_min.tolist() == [254, 508]
    assert path.source is not None
    assert path.source.unit == "inch"


def test_unit_option_and_feed_with_its_own_unit(tmp_path: Path) -> None:
    path = read(tmp_path, "x,y,z,feed_mm_min\n1,2,3,10\n4,5,6,20\n", units="m")
    assert path.tips_mm[0].tolist() == [1000, 2000, 3000]
    assert path.feeds_mm_min.tolist() == [10, 20]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("x,y,z\n1,2,3\n4,5\n", 3, ["2 cells where 3"]),
        ("x,y,z\n1,5,2,5,3,5\n", 2, ["decimal commas"]),
        ("x,y,z\n1,2,3\n4,5,abc\n", 3, ["column 3", "'abc'"]),
        ("x,y,z\n1,2,3\n4,5,\n", 3, ["column 3"]),
        ("x,y,z\n1,2,nan\n", 2, ["column 3"]),
        ("x,y,z\n1,2,1_0\n", 2, ["column 3"]),
        ("x,y,z\n1,2,3\n1,2,1e400\n", 3, ["coordinate_mm"]),
        ("x;y;z\n1.234,5;2;3\n", 2, ["column 1"]),
        ("x;y;z\n1,5;2;3\n1.5;2;3\n", 3, ["decimal points and decimal commas"]),
        ("x,y\n1,2\n", 1, ["does not name z"]),
        ("x,y,z,i,j\n1,2,3,0,0\n", 1, ["part of i,j,k"]),
        ("x,y,z,x\n1,2,3,4\n", 1, ["more than once"]),
        ("x_mm,y_in,z_mm\n1,2,3\n", 1, ["different units"]),
        ("1,2,3,4\n", 1, ["4 columns without a header"]),
        ("1,2,3,90,0,90\n", 1, ["no unit vectors"]),
        ("1,5,2,5,3,5\n", 1, ["no unit vectors"]),
        ("x,y,z,i,j,k\n1,2,3,0,0,0\n", 2, ["axis is (0, 0, 0)"]),
        ("x,y,z,rapid\n1,2,3,maybe\n", 2, ["rapid must be 0 or 1"]),
        ("x,y,z,feed\n1,2,3,-5\n", 2, ["negative feed"]),
        ("x,y,z\n", 1, ["no move"]),
        ("x,y,z\n1,2,3\n", 2, ["one point"]),
    ],
)
def test_bad_tables_name_their_line(tmp_path: Path, text: str, line: int, words: list[str]) -> None:
    refused(tmp_path, text, line, *words)


def test_bad_options_are_job_errors(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r"path\.feed_mm_min"):
        read(tmp_path, "1,2,3\n4,5,6\n", feed_mm_min=float("inf"))
