"""PTX: grids of several scanner positions in one frame, and every way in which such a file can be wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Scan
from sicp_formats.ascii.ptx import read_scan

CORPUS = Path(__file__).parents[1] / "corpus" / "ptx"
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # rows: where the axes of the scanner point
HERE = np.array([10.0, 20.0, 1.5])
POINTS = np.array([[1.0, 0.0, 0.25], [0.0, 0.0, 0.0], [0.0, 2.0, -0.5], [3.0, 1.0, 0.0]])


def scan_text(
    points: np.ndarray = POINTS,
    further: np.ndarray | None = None,
    size: tuple[int, int] = (2, 2),
    axes: np.ndarray = TURN,
    position: np.ndarray = HERE,
) -> str:
    rows = points if further is None else np.column_stack([points, further])
    matrix = np.vstack([np.column_stack([axes, np.zeros(3)]), [*position, 1.0]])
    numbers = [[size[0]], [size[1]], position, *axes, *matrix, *rows]
    return "".join(" ".join(f"{value:.10g}" for value in row) + "\n" for row in numbers)


FURTHER = np.array([[0.5, 10, 20, 30], [0.5, 0, 0, 0], [0.25, 1, 2, 3], [1.0, 255, 0, 7]])
PLAIN, COLOURED = scan_text(), scan_text(further=FURTHER)


def write(folder: Path, content: str | bytes) -> Path:
    path = folder / "scan.ptx"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def codes(scan: Scan) -> list[int]:
    return [int(each.code) for each in scan.findings]


def test_points_come_into_the_common_frame(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path, COLOURED))
    # p' = p M by hand: x goes to y, y to -x, then the position is added; metres become millimetres.
    expected = np.array([[10.0, 21.0, 1.75], [8.0, 20.0, 1.0], [9.0, 23.0, 1.5]]) * 1000
    assert np.allclose(scan.points_mm, expected, atol=1e-9)
    assert scan.columns["intensity"].tolist() == [0.5, 0.25, 1.0]
    assert [scan.columns[name][2] for name in ("red", "green", "blue")] == [255, 0, 7]
    assert codes(scan) == [138, 131] and scan.findings[0].level is Level.WARN
    assert "1 of 4 rays" in scan.findings[1].message
    assert scan.source is not None and (scan.source.unit, scan.source.unit_stated) == ("m", False)


def test_a_unit_that_is_stated_is_followed(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path, PLAIN), units="mm")
    assert np.allclose(scan.points_mm[0], [10.0, 21.0, 1.75]) and codes(scan) == [131]
    assert scan.source is not None and scan.source.unit_stated
    with pytest.raises(UnitError):
        read_scan(write(tmp_path, PLAIN), units="furlong")


@pytest.mark.parametrize("scale", [1.0004, 0.9998, 1.00001])
def test_a_scale_in_the_matrix_is_taken_out_and_told(tmp_path: Path, scale: float) -> None:
    path = write(tmp_path, scan_text(axes=scale * TURN))
    scan = read_scan(path, units="mm")
    assert np.allclose(scan.points_mm[0], [10.0, 21.0, 1.75], rtol=0, atol=1e-12)
    told = [each for each in scan.findings if each.code == 156]
    assert len(told) == 1 and told[0].level is Level.WARN and told[0].where.endswith("line 7")
    with pytest.raises(FormatError, match=r"line 7: .*no rigid motion"):
        read_scan(write(tmp_path, scan_text(axes=1.0006 * TURN)))


def test_rounded_matrices_are_taken_as_they_are(tmp_path: Path) -> None:
    angle = np.radians(30)
    turned = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    scan = read_scan(write(tmp_path, scan_text(axes=turned.round(6))), units="mm")
    assert 156 not in codes(scan) and np.allclose(scan.points_mm[0], HERE + POINTS[0] @ turned, atol=1e-5)


def test_several_scans_share_one_frame(tmp_path: Path) -> None:
    world = HERE + POINTS[[0, 2, 3]] @ TURN
    local = np.vstack([world - (5.0, 5.0, 5.0), np.zeros(3)])
    second = scan_text(local, size=(4, 1), axes=np.eye(3), position=np.array([5.0, 5.0, 5.0]))
    scan = read_scan(write(tmp_path, PLAIN + "\n" + second.replace("\n", "\r\n")))
    assert np.allclose(scan.points_mm[:3], scan.points_mm[3:], atol=1e-9)
    assert codes(scan) == [138, 141, 131]


@pytest.mark.parametrize(
    ("content", "line", "words"),
    [
        (PLAIN[: PLAIN.rindex("3 1")], 1, ["4 rows", "3 present", "--recover"]),
        (PLAIN + "1 1 1\n", 15, ["'1 1 1'", "more"]),
        (PLAIN.replace("0 2 -0.5\n", "") + PLAIN, 1, ["4 rows", "3 present"]),
        ("x\n" + PLAIN, 1, ["'x'", "PTX"]),
        ("2\n1 2 3\n", 2, ["number of rows"]),
        ("2\n", 1, ["number of rows"]),
        ("2\n2\n0 0 0\n", 1, ["ends in the header"]),
        (PLAIN.replace("0 1 0 0\n", "0 1 0\n"), 7, ["3 columns instead of 4"]),
        (PLAIN.replace("0 1 0 0\n", "0 2 0 0\n"), 7, ["no rigid motion"]),
        (PLAIN.replace("0 1 0 0\n", "0 -1 0 0\n"), 7, ["no rigid motion"]),
        (PLAIN.replace("0 1 0 0\n", "0 1 0 10\n"), 7, ["last row"]),
        (PLAIN.replace("0 1 0 0\n", "0 1e300 0 0\n"), 7, ["no rigid motion"]),
        (PLAIN.replace("0 1 0 0\n", "0 nan 0 0\n"), 7, ["'nan'"]),
        (PLAIN.replace("0 2 -0.5", "0 2 x"), 13, ["'x'"]),
        (PLAIN.replace("0 2 -0.5", "0 2 1e400"), 13, ["'1e400'"]),
        (PLAIN.replace("0 2 -0.5", "0 2"), 13, ["2 columns"]),
        (PLAIN.replace("0 2 -0.5", "0 1e9 1"), 13, ["coordinate_mm"]),
        (PLAIN.replace("0 2 -0.5", "0 1,5 1"), 13, ["decimal comma"]),
        (PLAIN.replace("1 0 0.25", "1 0 0.25 1 2"), 11, ["5 columns"]),
        (PLAIN + COLOURED, 25, ["7 columns instead of 3"]),
        (scan_text(np.zeros((4, 3))), 1, ["no ray"]),
        (PLAIN.replace("2\n2\n", "999999\n999999\n"), 1, ["limit points"]),
        (PLAIN.replace("2\n2\n", "9999\n9999\n"), 1, ["99980001 rows", "4 present"]),
    ],
)
def test_damaged_files_are_refused_with_their_line(tmp_path: Path, content: str, line: int, words: list[str]) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    assert f"{path}, line {line}: " in str(caught.value)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("end", ["3 1 0\n", " 0\n", " 1 0\n"])
def test_a_last_scan_that_is_cut_short_can_be_recovered(tmp_path: Path, end: str) -> None:
    path = write(tmp_path, PLAIN + PLAIN.removesuffix(end))
    with pytest.raises(FormatError, match=r"line (15|28): .*--recover"):
        read_scan(path)
    scan = read_scan(path, recover=True)
    assert len(scan.points_mm) == 5 and codes(scan) == [138, 141, 131, 152]
    assert "3 present" in scan.findings[-1].message and scan.findings[-1].level is Level.WARN


def test_recover_repairs_the_last_scan_only(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="line 1: "):
        read_scan(write(tmp_path, PLAIN.replace("0 2 -0.5\n", "") + PLAIN), recover=True)


def test_clouds_that_cannot_register(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="cannot register"):
        read_scan(write(tmp_path, scan_text(np.array([[1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0], [0, 0, 0]]))))


def test_the_limit_of_points_holds_over_all_scans(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="limit points = 5"):
        read_scan(write(tmp_path, PLAIN + PLAIN), limits=Limits(points=5))


def test_seeds_of_the_corpus() -> None:
    assert len(read_scan(CORPUS / "two_positions.ptx").points_mm) == 6
    assert {*read_scan(CORPUS / "coloured.ptx").columns} == {"intensity", "red", "green", "blue"}


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), recover=st.booleans())
def test_whatever_happens_to_the_bytes(tmp_path: Path, data: st.DataObject, recover: bool) -> None:
    content = bytearray((PLAIN + PLAIN).encode())
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        content = content[:at]
    else:
        content[at] = data.draw(st.integers(0, 255))
    try:
        scan = read_scan(write(tmp_path, bytes(content)), recover=recover)
    except (FormatError, UnitError, JobError):
        return
    assert np.isfinite(scan.points_mm).all() and len(scan.points_mm) <= 8
