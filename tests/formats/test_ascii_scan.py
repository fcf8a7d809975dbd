"""Tables of points: dialects and columns are proven or asked for, and bad rows are refused with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.limits import Limits
from sicp_formats.ascii import read_scan

POINTS = np.array(
    [[456.009, -240.152, 298.603], [458.835, -238.604, 299.05], [462.851, -237.2, 0.5], [-1.5, 2.25, 1e-3]]
)
NORMALS = np.array([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [-1.0, 0.0, 0.0], [0.0, -0.6, 0.8]])
COLOURS = np.array([[0, 0, 255], [12, 13, 14], [255, 255, 255], [1, 2, 3]])
POINT_LINES = ["456.009 -240.152 298.603", "458.835 -238.604 299.05", "462.851 -237.2 0.5", "-1.5 2.25 1e-3"]


def table(values: np.ndarray = POINTS, delimiter: str = " ", decimal: str = ".") -> str:
    rows = (delimiter.join(repr(cell) for cell in row) for row in values.tolist())
    return "".join(row.replace(".", decimal) + "\n" for row in rows)


def write(folder: Path, content: bytes | str) -> Path:
    path = folder / "scan.asc"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


GERMAN = table(delimiter=";", decimal=",")


@pytest.mark.parametrize(
    "content",
    [
        "\n".join(POINT_LINES),
        table(),
        table().replace(" ", "   "),
        "  " + table().replace("\n", "  \r\n  "),
        table().replace("\n", "\r"),
        table(delimiter="\t"),
        table(delimiter=","),
        table(delimiter=", "),
        table(delimiter=";"),
        table(delimiter=" ; "),
        GERMAN,
        table(delimiter="\t", decimal=","),
        table(delimiter=" ", decimal=","),
        GERMAN.replace("\n", ";\n"),
        "456,009;-240,152;298,603\n" + GERMAN.split("\n", 1)[1],
        table().encode("utf-16"),
        b"\xef\xbb\xbf" + table().encode(),
        "# a comment 1 2 3\n// another\n; a third\n\n" + table() + "\n# end\n",
        "4\n" + table(),
        "x y z\n" + table(),
        '"X";"Y";"Z"\n' + GERMAN,
        "X [mm], Y [mm], Z [mm]\n" + table(delimiter=","),
        "//X Y Z\n" + table(),
        "# x y z in the machine frame\n" + table(),
    ],
)
def test_every_dialect_gives_the_same_points(tmp_path: Path, content: bytes | str) -> None:
    scan = read_scan(write(tmp_path, content))
    assert np.array_equal(scan.points_mm, POINTS)
    assert scan.normals is None and scan.findings == ()


def stacked(*columns: np.ndarray) -> np.ndarray:
    return np.column_stack(columns)


INTENSITY = np.array([-1613.0, 0.5, 3.0, 17.0])


@pytest.mark.parametrize(
    ("values", "normals"),
    [
        (stacked(POINTS, NORMALS), True),
        (stacked(POINTS, COLOURS), False),
        (stacked(POINTS, NORMALS, INTENSITY), True),
        (stacked(POINTS, INTENSITY, COLOURS), False),
        (stacked(POINTS, COLOURS, INTENSITY), False),
        (stacked(POINTS, COLOURS, NORMALS), True),
        (stacked(POINTS, np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]])), True),
        (stacked(POINTS, NORMALS, COLOURS, INTENSITY), True),
    ],
)
def test_columns_that_the_numbers_prove(tmp_path: Path, values: np.ndarray, normals: bool) -> None:
    scan = read_scan(write(tmp_path, table(values)))
    assert np.array_equal(scan.points_mm, POINTS)
    assert (scan.normals is not None) == normals
    if scan.normals is not None:
        assert any(
            np.array_equal(scan.normals, values[:, begin : begin + 3]) for begin in range(3, values.shape[1] - 2)
        )
        assert np.allclose(np.linalg.norm(scan.normals, axis=1), 1.0)
    assert [each.code for each in scan.findings] == [120]


@pytest.mark.parametrize(
    "values",
    [
        stacked(POINTS, 2.0 * NORMALS),
        stacked(POINTS, COLOURS + 200),
        stacked(POINTS, INTENSITY),
        stacked(POINTS, INTENSITY, NORMALS),
        stacked(POINTS, INTENSITY, INTENSITY),
        stacked(POINTS, INTENSITY, INTENSITY, NORMALS),
        stacked(COLOURS, COLOURS),
        stacked(np.arange(4.0), POINTS),
        stacked(POINTS, np.array([[0, 0, 1], [0, 0, 0], [0, 1, 0], [1, 0, 0]])),
        stacked(POINTS, np.eye(4)[:, :3] + np.eye(4)[:, 1:]),
        stacked(POINTS, NORMALS, NORMALS, NORMALS),
    ],
)
def test_columns_that_they_do_not_prove_must_be_named(tmp_path: Path, values: np.ndarray) -> None:
    path = write(tmp_path, "# note\n" + table(values))
    with pytest.raises(FormatError, match=r"line 2: .*--set scan\.columns") as caught:
        read_scan(path)
    assert str(path) in str(caught.value)
    names = ["skip"] * (values.shape[1] - 3)
    scan = read_scan(path, columns=",".join(["x", "y", "z", *names]))
    assert np.array_equal(scan.points_mm, values[:, :3])


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("nx ny nz x y z", (NORMALS, POINTS)),
        ("Normal_X Normal_Y Normal_Z X Y Z", (NORMALS, POINTS)),
        ("X Y Z I J K", (POINTS, NORMALS)),
        ("//X Y Z Intensity Nx Ny Nz", (POINTS, INTENSITY, NORMALS)),
        ("# id x y z nx ny nz", (np.arange(4.0), POINTS, NORMALS)),
    ],
)
def test_names_of_a_header_place_the_columns(tmp_path: Path, header: str, columns: tuple[np.ndarray, ...]) -> None:
    scan = read_scan(write(tmp_path, header + "\n" + table(stacked(*columns))))
    assert np.array_equal(scan.points_mm, POINTS)
    assert scan.normals is not None and np.array_equal(scan.normals, NORMALS)


def test_columns_of_text_may_be_skipped(tmp_path: Path) -> None:
    rows = "".join(f"P{index};{row}\n" for index, row in enumerate(GERMAN.splitlines()))
    named = read_scan(write(tmp_path, "name;x;y;z\n" + rows))
    told = read_scan(write(tmp_path, "Messung vom Montag\n" + rows), columns="skip,x,y,z")
    assert np.array_equal(named.points_mm, POINTS) and np.array_equal(told.points_mm, POINTS)
    assert [each.code for each in told.findings] == [111]


def test_units(tmp_path: Path) -> None:
    path = write(tmp_path, "X [m];Y [m];Z [m]\n" + GERMAN)
    scan = read_scan(path)
    assert np.allclose(scan.points_mm, 1000 * POINTS, rtol=1e-15)
    assert scan.source is not None and (scan.source.unit, scan.source.unit_stated) == ("m", True)
    with pytest.raises(UnitError, match="line 1: the file states m, the job mm"):
        read_scan(path, units="mm")
    plain = read_scan(write(tmp_path, GERMAN)).source
    assert plain is not None and (plain.unit, plain.unit_stated, plain.format) == ("mm", False, "ASCII")


def test_two_readings_are_shown_and_an_option_settles_them(tmp_path: Path) -> None:
    path = write(tmp_path, "1 ,5 ,7\n2 ,5 ,8\n3 ,6 ,8\n")
    with pytest.raises(FormatError, match="line 1") as caught:
        read_scan(path)
    for word in (str(path), "1 5 7", "1 0.5 0.7", "--set scan.delimiter", "--set scan.decimal"):
        assert word in str(caught.value)
    assert read_scan(path, delimiter="comma").points_mm[0].tolist() == [1, 5, 7]
    assert read_scan(path, decimal=",").points_mm[0].tolist() == [1, 0.5, 0.7]


def test_commas_for_both_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "45,09,-24,15,98,60\n46,10,-25,16,97,61\n47,00,25,01,99,10\n")
    with pytest.raises(FormatError, match=r"line 1: .*45\.09 -24\.15 98\.60"):
        read_scan(path)
    with pytest.raises(FormatError, match=r"columns"):
        read_scan(write(tmp_path, "45,9,-24,15,98,600\n46,10,-25,16,97,61\n"), decimal=".")


def test_thousands_only_under_a_stated_mark(tmp_path: Path) -> None:
    path = write(tmp_path, "999,5;-240,152;298,603\n1.234,5;2.000;-1.000.000,25\n1;2;3\n")
    with pytest.raises(FormatError, match=r"line 2: .*thousands.*scan\.decimal"):
        read_scan(path)
    expected = [[999.5, -240.152, 298.603], [1234.5, 2000, -1000000.25], [1, 2, 3]]
    assert read_scan(path, decimal=",").points_mm.tolist() == expected
    english = write(tmp_path, "999.5;-240.152;298.603\n1,234.5;2,000;-1,000,000.25\n1;2;3\n")
    assert read_scan(english, decimal=".").points_mm.tolist() == expected


def test_a_wrong_mark_never_multiplies_by_a_thousand(tmp_path: Path) -> None:
    path = write(tmp_path, table(delimiter=";"))
    with pytest.raises(FormatError, match="line 1"):
        read_scan(path, decimal=",")
    late = "".join(f"{index},5;2,5;3,5\n" for index in range(300)) + "456.0099;2,5;3,5\n"
    with pytest.raises(FormatError, match=r"line 301: '456\.0099'"):
        read_scan(write(tmp_path, late), decimal=",")


LONG = "".join(f"{index}.5 {index % 7}.25 1.0\n" for index in range(400))


@pytest.mark.parametrize(
    ("content", "line", "words"),
    [
        (table() + "1 2\n", 5, ["'1 2'"]),
        (table() + "1 2 3 4\n", 5, ["'1 2 3 4'"]),
        (LONG + "1 2\n", 401, ["2 columns instead of 3"]),
        (LONG + "1 2 x\n", 401, ["'x'"]),
        (LONG + "1,5 2 3\n", 401, ["decimal comma"]),
        (LONG + "nan 2 3\n", 401, ["'nan'"]),
        (LONG + "1e400 2 3\n", 401, ["'1e400'"]),
        (LONG + "1_0 2 3\n", 401, ["'1_0'"]),
        (LONG + "-1.#IND 2 3\n", 401, ["-1.#IND"]),
        (LONG + "1e8 2 3\n", 401, ["coordinate_mm"]),
        (LONG + "end of file\n", 401, ["'end'"]),
        (table() + "nan nan nan\n", 5, ["'nan'"]),
        (table() + "1 2 inf\n", 5, ["'inf'"]),
        (table() + "\u0661 2 3\n", 5, ["row of numbers"]),
        (GERMAN + ";2,0;3,0\n", 5, ["';2,0;3,0'"]),
        (GERMAN + "1.5;2,0;3,0\n", 5, ["1.5;2,0;3,0"]),
        ("5\n" + table(), 1, ["5 rows are declared, 4 present"]),
        ("3\n" + table(), 1, ["3 rows are declared, 4 present"]),
        ("5\n", 1, ["no points"]),
        ("4\n4\n0 0 0\n", 1, ["PTX"]),
        ("hello world\n", 1, ["no row of numbers"]),
        ("# only a comment\n", 1, ["no row of numbers"]),
        ("\n\n", 1, ["no row of numbers"]),
        ("first text\nx y z\n" + table(), 1, ["'first text'"]),
        ("east north height\n" + table(), 1, ["names the columns"]),
        ("x y x\n" + table(), 1, ["names the columns"]),
        ("x y z z\n" + table(stacked(POINTS, INTENSITY)), 1, ["names z twice"]),
        ("x y z nx\n" + table(stacked(POINTS, INTENSITY)), 1, ["part of the normal"]),
        ("x y z i\n" + table(), 2, ["3 columns", "4 are named"]),
        ("x [um] y [um] z [um]\n" + table(), 1, ["unit um"]),
        ("x [mm] y [mm] z [m]\n" + table(), 1, ["unit m and mm"]),
        ("x [mm] y z\n" + "1 2 " + "3" * 70_000, 2, ["line_bytes"]),
        ("1 2\n3 4\n5 6\n", 1, ["at least 3 numbers"]),
        ("P1 P2 3\nP2 P3 4\n", 1, ["at least 3 numbers"]),
    ],
)
def test_bad_rows_are_refused_with_their_line(tmp_path: Path, content: str, line: int, words: list[str]) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    message = str(caught.value)
    assert f"{path}, line {line}: " in message and "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("content", "byte", "word"),
    [
        (b"", 0, "empty"),
        (b"1 2 3\n\0\0\0", 6, "zero byte"),
        (b"\xff\xfe1 2 3", 0, "UTF-16"),
        (b"\x1f\x8b\x08", 0, "gzip"),
    ],
)
def test_files_that_are_no_text_are_refused_with_the_byte(tmp_path: Path, content: bytes, byte: int, word: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError, match=word) as caught:
        read_scan(path)
    assert f"{path}, byte " in str(caught.value) and caught.value.byte is not None and caught.value.byte >= byte


@pytest.mark.parametrize(
    "rows", ["1 2 3\n", "1 2 3\n" * 9, "0 0 0\n1 1 1\n2 2 2\n", "0 0 0\n0.1 0.2 0.3\n0.7 1.4 2.1\n"]
)
def test_clouds_that_span_no_area_cannot_register(tmp_path: Path, rows: str) -> None:
    path = write(tmp_path, rows)
    with pytest.raises(FormatError, match="cannot register") as caught:
        read_scan(path)
    assert str(path) in str(caught.value)


def test_a_late_point_off_a_long_line_counts(tmp_path: Path) -> None:
    rows = "".join(f"{index} 0 0\n" for index in range(3001)) + "0 0 1\n"
    assert len(read_scan(write(tmp_path, rows)).points_mm) == 3002


@pytest.mark.parametrize(
    "options",
    [
        {"delimiter": "pipe"},
        {"decimal": "'"},
        {"delimiter": "comma", "decimal": ","},
        {"columns": "x,y"},
        {"columns": "x,y,z,z"},
        {"columns": "x,y,z,nx"},
        {"columns": "x,y,z,quality"},
    ],
)
def test_wrong_options_are_job_errors_that_name_the_option(tmp_path: Path, options: dict[str, str]) -> None:
    with pytest.raises(JobError, match=rf"scan\.{next(iter(options))}"):
        read_scan(write(tmp_path, table()), **options)


def test_the_limit_of_points_is_kept(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"line 4: .*limit points = 3"):
        read_scan(write(tmp_path, table()), limits=Limits(points=3))
