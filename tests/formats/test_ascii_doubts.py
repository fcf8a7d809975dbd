"""Tables that can be read in two ways: asked for or told, never guessed."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from sicp_cam.errors import FormatError
from sicp_cam.findings import Level
from sicp_cam.model import Scan
from sicp_formats import obj, pcd, ply
from sicp_formats.ascii import read_scan
from sicp_formats.tables import stream as text_stream

RNG = np.random.default_rng(5)
POINTS = np.round(RNG.uniform(-900, 900, (40, 3)), 3)
POINTS[7, 1] = 0.125
NORMALS = np.tile([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0]], (20, 1))
COLOURS = RNG.integers(0, 256, (40, 3))
INTENSITY = RNG.uniform(0, 1, 40).round(4)
ASKED = r"line 1: .*--set scan\.columns"


def rows(*blocks: np.ndarray) -> str:
    return "".join(" ".join(f"{value:.10g}" for value in row) + "\n" for row in np.column_stack(blocks))


def write(folder: Path, content: str, name: str = "scan.xyz") -> Path:
    path = folder / name
    path.write_bytes(content.encode())
    return path


def codes(scan: Scan) -> list[int]:
    return [int(each.code) for each in scan.findings]


IDS = {
    "gap": np.delete(np.arange(1, 42), 2),
    "tens": 10 * np.arange(40),
    "names": np.repeat([0, 0, 0, 1], 10),
    "equal": np.full(40, 7),
}


@pytest.mark.parametrize("ids", IDS)
@pytest.mark.parametrize("further", [(), (NORMALS,), (COLOURS,), (COLOURS[:, :1], COLOURS)])
def test_numbers_of_points_are_no_coordinates(tmp_path: Path, ids: str, further: tuple[np.ndarray, ...]) -> None:
    path = write(tmp_path, rows(IDS[ids], POINTS, *further))
    with pytest.raises(FormatError, match=ASKED) as caught:
        read_scan(path)
    assert "skip,x,y,z" in str(caught.value)
    width = 1 + sum(block.shape[1] for block in further)
    scan = read_scan(path, columns="skip,x,y,z" + ",skip" * (width - 1))
    assert np.array_equal(scan.points_mm, POINTS)


def test_a_first_column_that_may_count_is_asked_for_even_before_normals(tmp_path: Path) -> None:
    whole = np.column_stack([np.arange(40), POINTS[:, 1:]])
    for further in (NORMALS, COLOURS):
        with pytest.raises(FormatError, match=ASKED):
            read_scan(write(tmp_path, rows(whole, further)))


@pytest.mark.parametrize("further", [(INTENSITY,), (INTENSITY, NORMALS)])
def test_one_column_more_proves_nothing(tmp_path: Path, further: tuple[np.ndarray, ...]) -> None:
    with pytest.raises(FormatError, match=ASKED):
        read_scan(write(tmp_path, rows(POINTS, *further)))


@pytest.mark.parametrize(
    ("name", "further", "layout"),
    [
        ("a.pts", (INTENSITY,), "x y z intensity"),
        ("a.xyzn", (NORMALS,), "x y z nx ny nz"),
        ("a.xyzrgb", (COLOURS,), "x y z red green blue"),
    ],
)
def test_a_suffix_settles_it(tmp_path: Path, name: str, further: tuple[np.ndarray, ...], layout: str) -> None:
    whole = np.column_stack([10 * np.arange(40), POINTS[:, 1:]])
    scan = read_scan(write(tmp_path, rows(whole, *further), name))
    assert np.array_equal(scan.points_mm, whole) and codes(scan) == [120] and layout in scan.findings[0].message


@pytest.mark.parametrize(
    "comment", ["# Columns: Y X Z", "#Y X Z", "# format: y, x, z", "// Fields = Y_mm X_mm Z_mm", "# y x z\n# 40 points"]
)
def test_comments_that_name_another_order_are_followed(tmp_path: Path, comment: str) -> None:
    scan = read_scan(write(tmp_path, comment + "\n" + rows(POINTS)))
    assert np.array_equal(scan.points_mm, POINTS[:, [1, 0, 2]])


@pytest.mark.parametrize(
    ("comment", "values"),
    [
        ("#Y X Z intensity", POINTS),
        ("# rotated by z, y and x", POINTS),
        ("# z/um y/um x/um", POINTS),
        ("# No x y z", np.column_stack([POINTS, NORMALS])),
        ("# z y x and more", np.column_stack([POINTS, NORMALS])),
        ("# x y z\n# z y x", POINTS),
    ],
)
def test_comments_that_do_not_fit_are_refused(tmp_path: Path, comment: str, values: np.ndarray) -> None:
    path = write(tmp_path, comment + "\n" + rows(values))
    with pytest.raises(FormatError, match=r"line [12]: .*the comment .*--set scan\.columns"):
        read_scan(path)
    further = ",skip" * (values.shape[1] - 3)
    assert np.array_equal(read_scan(path, columns=f"x,y,z{further}").points_mm, values[:, :3])


@pytest.mark.parametrize(
    ("comment", "values"),
    [
        ("# x y z in the machine frame", POINTS),
        ("# axes: X right, Y forward, Z up", POINTS),
        ("# matrix xyz, zyx order", POINTS),
        ("# Columns: X Y Z, then normals", np.column_stack([POINTS, NORMALS])),
    ],
)
def test_comments_that_agree_may_say_more(tmp_path: Path, comment: str, values: np.ndarray) -> None:
    assert np.array_equal(read_scan(write(tmp_path, comment + "\n" + rows(values))).points_mm, POINTS)


@pytest.mark.parametrize(
    "line", ["587,57,868,30,117,30,{}", "587,57,868,30,117,{}", "587,-57,868,30,117,{}", "1,2,3,4,5,6,7,{},9"]
)
def test_whole_numbers_between_commas_may_be_decimals(tmp_path: Path, line: str) -> None:
    content = "".join(line.format(10 + at * at % 77) + "\n" for at in range(9))
    with pytest.raises(FormatError, match=r"line 1: .*decimal commas.*scan\.decimal=\."):
        read_scan(write(tmp_path, content, "scan.csv"))


def test_quoted_decimal_commas_are_read(tmp_path: Path) -> None:
    text = "".join(",".join(f'"{value}"'.replace(".", ",") for value in row) + "\n" for row in POINTS.tolist())
    for content in (text, '"X","Y","Z"\n' + text, "# x,y,z\r\n" + text.replace("\n", "\r\n")):
        scan = read_scan(write(tmp_path, content, "scan.csv"))
        assert np.array_equal(scan.points_mm, POINTS) and scan.findings == ()
    with pytest.raises(FormatError, match=r"line 41: .*no row of numbers like those before"):
        read_scan(write(tmp_path, text + '5,1,"2,5","3,5"\n', "scan.csv"))
    with pytest.raises(FormatError):
        read_scan(write(tmp_path, text + '"1.234,5","2,5","3,5"\n', "scan.csv"))


@pytest.mark.parametrize("head", ["X/mm;Y/mm;Z/mm\n", "X in mm;Y in mm;Z in mm\n", "X / mm;Y / mm;Z / mm\n"])
def test_units_behind_the_names(tmp_path: Path, head: str) -> None:
    scan = read_scan(write(tmp_path, head + rows(POINTS).replace(" ", ";"), "scan.csv"))
    assert np.array_equal(scan.points_mm, POINTS) and scan.source is not None and scan.source.unit_stated


FIXED = "".join(" ".join(f"{value:.3f}" for value in row) + "\n" for row in POINTS)


@pytest.mark.parametrize("delimiter", [" ", ";", ","])
@pytest.mark.parametrize("cut", [2, 3, 4])
def test_a_last_number_that_is_cut_is_told(tmp_path: Path, delimiter: str, cut: int) -> None:
    path = write(tmp_path, FIXED.replace(" ", delimiter)[:-cut])
    scan = read_scan(path)
    found = [each for each in scan.findings if each.code == 153]
    assert len(found) == 1 and found[0].level is Level.WARN and found[0].where.endswith("line 40")
    assert "the last line has no end" in found[0].message and "--recover" in found[0].message
    repaired = read_scan(path, recover=True)
    assert np.array_equal(repaired.points_mm, POINTS[:-1]) and "dropped" in repaired.findings[0].message
    assert codes(repaired) == [153]


@pytest.mark.parametrize("content", [FIXED, FIXED[:-1], rows(POINTS)[:-1], FIXED + "# end", FIXED + "  "])
@pytest.mark.parametrize("recover", [False, True])
def test_a_last_line_may_lack_its_end(tmp_path: Path, content: str, recover: bool) -> None:
    scan = read_scan(write(tmp_path, content), recover=recover)
    assert np.array_equal(scan.points_mm, POINTS) and scan.findings == ()


SMALL = np.round(RNG.uniform(1.1, 99, (40, 3)), 3)
THREE = "".join(" ".join(f"{value:.3f}" for value in row) + "\n" for row in SMALL)


@pytest.mark.parametrize("mark", [".", ","])
def test_marks_that_may_set_thousands_apart_are_told(tmp_path: Path, mark: str) -> None:
    path = write(tmp_path, THREE.replace(".", mark))
    scan = read_scan(path)
    assert np.array_equal(scan.points_mm, SMALL) and codes(scan) == [154]
    assert scan.findings[0].level is Level.WARN and f"scan.decimal={mark}" in scan.findings[0].message
    assert read_scan(path, decimal=mark).findings == ()
    for other in ("0.500 2.500 3.500\n", "1234.500 2.500 3.500\n", "1.5 2.5 3.5\n"):
        assert codes(read_scan(write(tmp_path, (THREE + other).replace(".", mark)))) == []


@pytest.mark.parametrize(
    ("reader", "name", "head", "before"),
    [
        (obj, "scan.obj", "", "v "),
        (pcd, "scan.pcd", "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 40\nHEIGHT 1\nDATA ascii\n", ""),
        (
            ply,
            "scan.ply",
            "ply\nformat ascii 1.0\nelement vertex 40\n"
            "property double x\nproperty double y\nproperty double z\nend_header\n",
            "",
        ),
    ],
)
def test_other_text_may_be_cut_in_its_last_number(
    tmp_path: Path, reader: ModuleType, name: str, head: str, before: str
) -> None:
    text = head + "".join(f"{before}{row}\n" for row in FIXED.splitlines())
    path = write(tmp_path, text[:-2], name)
    scan = reader.read_scan(path)
    assert codes(scan)[:1] == [153] and scan.findings[0].where.endswith(f"line {text.count(chr(10))}")
    repaired = reader.read_scan(path, recover=True)
    assert np.array_equal(repaired.points_mm, POINTS[:-1]) and codes(repaired)[0] == 153
    assert scan.source is not None and repaired.source is not None
    assert repaired.source.sha256 == scan.source.sha256
    assert 153 not in codes(reader.read_scan(write(tmp_path, text[:-1], name)))


def test_a_long_file_is_not_read_again_for_an_error_at_its_beginning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_stream, "HEAD_BYTES", 100)
    monkeypatch.delattr(text_stream, "read_bytes")
    with pytest.raises(FormatError, match=r"line 1: .*row of numbers"):
        read_scan(write(tmp_path, "no scan\n" * 100))
    with pytest.raises(FormatError, match=r"byte 0: .*zip archive"):
        read_scan(write(tmp_path, "PK\x03\x04" + "1 2 3\n" * 100))
