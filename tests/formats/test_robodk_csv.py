"""Tables of robots and spreadsheets: orientations, units, quotes, names by option, and tables written again."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError
from sicp_cam.findings import Level
from sicp_cam.model import FloatArray, IntArray, Rewritten, ToolPath
from sicp_formats.path_csv import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "csv"


def read(folder: Path, text: str | bytes, **options: object) -> ToolPath:
    file = folder / "path.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_path(file, **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def moved(
    path: ToolPath, tips: FloatArray, axes: FloatArray | None = None, sources: IntArray | None = None
) -> Rewritten:
    """Write the table of a path again with other coordinates."""
    assert path.original is not None
    sources = np.arange(len(path)) if sources is None else sources
    axes = path.axes[sources] if axes is None else axes
    other = ToolPath(tips, axes, path.feeds_mm_min[sources], path.rapid[sources], path.lines[sources])
    return path.original.rewritten(other, sources)


# --- reading ---


def test_xyzwpr_needs_names_and_the_order_of_its_angles() -> None:
    file = CORPUS / "robodk_xyzwpr.csv"
    with pytest.raises(FormatError, match=r"line 1: 7 columns without a header.*path\.columns="):
        read_path(file)
    with pytest.raises(FormatError, match=r"path\.euler=xyz or zyx"):
        read_path(file, columns="x,y,z,w,p,r,-")
    path = read_path(file, columns="x,y,z,w,p,r,-", euler="zyx")
    expected = -Rotation.from_euler("ZYX", [[0, 0, 180], [0, 30, 180], [45, 0, 180]], degrees=True).as_matrix()[:, :, 2]
    assert path.tips_mm[:, 0].tolist() == [10.5, 20.5, 30.5]
    assert np.allclose(path.axes, expected, atol=1e-12)
    other = read_path(file, columns="x y z rx ry rz -", euler="xyz", tool_axis="z")
    expected = Rotation.from_euler("XYZ", [[180, 0, 0], [180, 30, 0], [180, 0, 45]], degrees=True).as_matrix()[:, :, 2]
    assert np.allclose(other.axes, expected, atol=1e-12)


def test_a_spreadsheet_with_quotes_quaternions_and_decimal_commas() -> None:
    path = read_path(CORPUS / "spreadsheet.csv")
    assert path.tips_mm.tolist() == [[1.5, 2, 3], [2.5, 2, 3], [2.5, 4, 3]]
    assert path.axes.tolist() == [[0, 0, 1]] * 3
    assert path.feeds_mm_min.tolist() == [0, 1200, 1200]
    assert path.rapid.tolist() == [True, False, False]
    assert [(e.text, e.line, e.before_move) for e in path.events] == [("corner", 5, 2)]
    assert path.source is not None and path.source.unit_stated
    assert codes(path) == {315}


@pytest.mark.parametrize(
    ("head", "feed"),
    [
        ("X,Y,Z,NX,NY,NZ,F", 10),
        ("pos_x,pos_y,pos_z,axis_x,axis_y,axis_z,feedrate [mm/s]", 600),
        ("tip x,tip y,tip z,ux,uy,uz,speed (m/min)", 10_000),
        ("x,y,z,i,j,k,speed", 0),
        ("x,y,z,i,j,k,velocity_mm_s", 600),
    ],
)
def test_names_that_leave_no_doubt(tmp_path: Path, head: str, feed: float) -> None:
    path = read(tmp_path, f"{head}\n1,2,3,0,0.6,0.8,10\n4,5,6,0,0,1,10\n")
    assert path.tips_mm.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert np.allclose(path.axes[0], [0, 0.6, 0.8])
    assert path.feeds_mm_min.tolist() == [feed, feed]
    assert (315 in codes(path)) == (feed == 0)


def test_names_by_option_replace_a_header(tmp_path: Path) -> None:
    path = read(tmp_path, "a;b;c\n1;2;3\n4;5;6\n", columns="z,y,x")
    assert path.tips_mm.tolist() == [[3, 2, 1], [6, 5, 4]]
    assert path.events[0].text == "a;b;c"


@pytest.mark.parametrize(
    ("text", "options", "line", "words"),
    [
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,1,0,0\n4,5,6,1,0,0,0\n", {}, 2, "not of length 1"),
        ("x,y,z,qw,qx\n1,2,3,1,1\n", {}, 1, "part of qw,qx,qy,qz"),
        ("x,y,z,rx,ry,rz\n1,2,3,0,0,0\n", {}, 1, "path.euler="),
        ("x [um],y [um],z [um]\n1,2,3\n", {}, 1, "'um' of x, y, z is not known"),
        ("x,y,z,feed [rpm]\n1,2,3,4\n", {}, 1, "'rpm' of the feed"),
        ("1,2,3,4,5,6,7,8\n", {}, 1, "path.columns="),
        ("1,2,3,4,5,6,7\n", {}, 1, "x,y,z,w,p,r,- with --set path.euler=xyz or zyx"),
        ("1,2,3,40,5,6\n", {}, 1, "x,y,z,rx,ry,rz with path.euler=xyz or zyx"),
        ("x,y,z,i,j,k\n1,2,3,0,0,1\n1,2,3,0,45,90\n", {}, 3, "length 100.6"),
        ("x,y,z,i,j,k\n1,2,3,0,0,0.4\n", {}, 2, "path.euler="),
        ("1,2,3,0,0,2.1\n", {"columns": "x,y,z,nx,ny,nz"}, 1, "length 2.1"),
        ("x,y,z,a,b,c\n1,2,3,0,0,180\n", {"euler": "xyz"}, 1, "no orientation is read from angles"),
        ("x,y,z,i,j,k\n1,2,3,0,0,1\n", {"euler": "zyx"}, 1, "leave the option out"),
        ("1,2,3\n4,5,6\n", {"euler": "zyx"}, 1, "leave the option out"),
        ("1,2,3\n4,5\n7,8,9\n", {"recover": True}, 2, "2 cells where 3"),
        ("1,2\n4,5\n", {"columns": "x,y,z"}, 1, "2 cells where 3"),
    ],
)
def test_what_is_not_clear_is_refused(
    tmp_path: Path, text: str, options: dict[str, object], line: int, words: str
) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, **options)
    assert caught.value.line == line
    assert words in str(caught.value)


def test_bad_options_are_job_errors(tmp_path: Path) -> None:
    for wrong in ({"columns": "x,y"}, {"columns": "x,y,z,x"}, {"euler": "zxz"}, {"tool_axis": "up"}):
        with pytest.raises(JobError, match=next(iter(wrong))):
            read(tmp_path, "1,2,3\n4,5,6\n", **wrong)


def test_a_last_row_that_is_cut_short_is_never_dropped(tmp_path: Path) -> None:
    for recover in (False, True):
        for cut in ("7,8", "7,8,", "7"):
            with pytest.raises(FormatError) as caught:
                read(tmp_path, f"1,2,3\n4,5,6\n{cut}", recover=recover)
            assert caught.value.line == 3
            assert "--recover" not in str(caught.value)


def test_a_b_c_are_angles_about_z_y_and_x_where_that_is_said(tmp_path: Path) -> None:
    path = read(tmp_path, "x,y,z,a,b,c\n1,2,3,90,0,-90\n4,5,6,0,30,180\n", euler="zyx")
    expected = -Rotation.from_euler("ZYX", [[90, 0, -90], [0, 30, 180]], degrees=True).as_matrix()[:, :, 2]
    assert np.allclose(path.axes, expected, atol=1e-12)
    assert not codes(path) & {303, 315}
    assert {303, 315} <= codes(read(tmp_path, "x,y,z,a,b,c\n1,2,3,90,0,-90\n4,5,6,0,30,180\n"))


def test_axes_near_to_length_1_are_scaled_with_a_warning(tmp_path: Path) -> None:
    path = read(tmp_path, "x,y,z,i,j,k\n1,2,3,0,0,2\n4,5,6,0,0.5,0\n")
    assert path.axes.tolist() == [[0, 0, 1], [0, 1, 0]]
    assert 304 in codes(path)


# --- written again ---


@pytest.mark.parametrize("name", ["own.csv", "spreadsheet.csv"])
def test_a_table_that_does_not_change_keeps_every_byte(name: str) -> None:
    path = read_path(CORPUS / name)
    written = moved(path, path.tips_mm)
    assert written.content == (CORPUS / name).read_bytes()
    assert not written.findings


def test_only_what_changes_is_written(tmp_path: Path) -> None:
    path = read_path(CORPUS / "own.csv")
    tips, axes = path.tips_mm.copy(), path.axes.copy()
    tips[1] += [0.25, 0, 1e-5]
    axes[2] = [0.6, 0, 0.8]
    lines = (CORPUS / "own.csv").read_text().splitlines()
    written = moved(path, tips, axes).content.decode().splitlines()
    assert written[:2] == lines[:2]
    assert written[2] == lines[2].replace("4.5000", "4.7500")
    assert written[3] == lines[3].replace("0.0000000,0.0000000,1.0000000", "0.6000000,0.0000000,0.8000000")


def test_whole_numbers_between_commas_get_decimal_points(tmp_path: Path) -> None:
    text = (
        "x,y,z,i,j,k,feed,rapid,note\n131,-0,40,0,0,1,0,1,safe height\n10 ,0,0,0,0,1,9,0,a 5\n# c\n1, 0 ,0,0,0,1,9,0,\n"
    )
    path = read(tmp_path, text)
    shift = np.array([-6.939, -6.2556, 0.5])
    written = moved(path, path.tips_mm + shift)
    assert not [finding for finding in written.findings if finding.level is Level.FAIL]
    assert written.content.decode().splitlines()[1] == "124.0610,-6.2556,40.5000,0,0,1,0,1,safe height"
    assert np.abs(read(tmp_path, written.content).tips_mm - path.tips_mm - shift).max() < 1e-4


def test_whole_numbers_between_semicolons_get_the_mark_of_the_table(tmp_path: Path) -> None:
    for feed, tip in (("9,5", "1,2500;2;3;9,5"), ("9.5", "1.2500;2;3;9.5"), ("9", "1.2500;2;3;9")):
        path = read(tmp_path, f"x;y;z;feed\n1;2;3;{feed}\n4;5;6;{feed}\n")
        tips = path.tips_mm.copy()
        tips[0, 0] += 0.25
        assert moved(path, tips).content.decode().splitlines()[1] == tip


def test_what_does_not_read_back_is_not_given_out(tmp_path: Path) -> None:
    path = read(tmp_path, '"1,5",2,3\n4,5,6\n')
    written = moved(path, path.tips_mm + np.array([0, 0.25, 0]))  # 2,25 without quotes would be two cells
    assert written.content == b""
    (finding,) = [f for f in written.findings if f.level is Level.FAIL]
    assert finding.code == 322 and "cannot be written again" in finding.message
    far = moved(path, path.tips_mm + np.array([0, 0, 1e9]))
    assert far.content == b"" and {f.code for f in far.findings} == {322}


def test_added_rows_copy_the_other_cells_and_the_decimal_comma() -> None:
    path = read_path(CORPUS / "spreadsheet.csv")
    sources = np.array([0, 1, 1, 2])
    tips = np.vstack([path.tips_mm[:1], [[2.125, 2, 3]], path.tips_mm[1:]])
    written = moved(path, tips, sources=sources).content.decode("utf-8").split("\r\n")
    assert written[3] == "2,1250;2,0;3,0;0;1;0;0;20;0;"
    assert written[4] == "2,5;2,0;3,0;0;1;0;0;20;0;"
    assert written[5].endswith("# corner")


def test_axes_without_a_place_are_told() -> None:
    path = read_path(CORPUS / "spreadsheet.csv")
    axes = path.axes.copy()
    axes[1] = [0, 0.6, 0.8]
    (finding,) = moved(path, path.tips_mm, axes).findings
    assert (finding.code, finding.level) == (341, Level.FAIL)


def test_tables_of_tips_say_how_far_the_axis_turned(tmp_path: Path) -> None:
    path = read(tmp_path, "1,2,3\n4,5,6\n")
    axes = np.array([[0, 0, 1], [0, 0.6, 0.8]])
    written = moved(path, path.tips_mm, axes)
    assert written.content == b"1,2,3\n4,5,6\n"
    assert [(f.code, f.level) for f in written.findings] == [(340, Level.WARN)]
    assert "36.9 degrees" in written.findings[0].message


def test_zeros_for_the_axis_before_are_written_out_when_that_changes(tmp_path: Path) -> None:
    text = "x,y,z,i,j,k\n1,2,3,0,0,1\n4,5,6,0,0,0\n7,8,9,0,0,0\n"
    path = read(tmp_path, text)
    assert moved(path, path.tips_mm).content.decode() == text
    axes = path.axes.copy()
    axes[0] = [0, 0.6, 0.8]
    axes[2] = [0, 0, 1]
    rows = moved(path, path.tips_mm, axes).content.decode().splitlines()
    assert rows[1:] == ["1,2,3,0,0.6000000,0.8000000", "4,5,6,0,0,1.0000000", "7,8,9,0,0,0"]


table = st.lists(st.tuples(*[st.integers(-99_999, 99_999)] * 3), min_size=2, max_size=8, unique=True)


@settings(deadline=None, max_examples=40)
@given(
    rows=table,
    style=st.sampled_from([(";", ","), (",", "."), ("\t", ","), (" ", ".")]),
    unit=st.sampled_from([("mm", 1.0), ("inch", 25.4), ("m", 1000.0)]),
    by=st.tuples(*[st.floats(-5, 5)] * 3),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_a_shifted_table_reads_back_shifted(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[int, ...]],
    style: tuple[str, str],
    unit: tuple[str, float],
    by: tuple[float, ...],
    end: str,
) -> None:
    mark, point = style
    lines = [mark.join(f"{value / 100:.2f}".replace(".", point) for value in row) for row in rows]
    folder = tmp_path_factory.getbasetemp()
    path = read(folder, end.join([f"x_{unit[0]}{mark}y_{unit[0]}{mark}z_{unit[0]}", *lines, ""]))
    assert np.allclose(path.tips_mm, np.array(rows) / 100 * unit[1], atol=1e-9)
    tips = np.repeat(path.tips_mm, 2, axis=0) + by
    sources = np.repeat(np.arange(len(path)), 2)
    again = read(folder, moved(path, tips, sources=sources).content)
    assert np.abs(again.tips_mm - tips).max() <= 6e-5
