"""Tables that are written and read again are the same; what would not be is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.model import Scan
from sicp_formats import ascii as ascii_scan
from sicp_formats.ascii.writer import write_csv, write_pts, write_scan, write_txt

POINTS = np.array([[0.1, 0.2, 1e-7], [123456.789, 1 / 3, -2.5], [7.0, 8.0, 1e6], [5e-324, -0.0, 2.0]])
NORMALS = np.array([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
COLUMNS = {
    "intensity": np.array([-1613.0, 0.5, 3.0, 17.0]),
    "red": np.array([0.0, 12.0, 255.0, 1.0]),
    "green": np.array([0.0, 13.0, 255.0, 2.0]),
    "blue": np.array([255.0, 14.0, 255.0, 3.0]),
    "scalar C2C distance, mm": np.array([np.nan, 1e300, -0.25, np.inf]),
    "42": np.array([1e15, -7.0, 0.0, 2.0**60]),
    "Größe": np.arange(4.0),
}
SCAN = Scan(POINTS, NORMALS, columns=COLUMNS)
SUFFIXES = {".xyz": write_scan, ".csv": write_csv, ".txt": write_txt}
finite = st.floats(-1e6, 1e6)


def reread(folder: Path, content: bytes, suffix: str = ".xyz", **options: str) -> Scan:
    path = folder / f"scan{suffix}"
    path.write_bytes(content)
    return ascii_scan.read_scan(path, **options)


def assert_same(found: Scan, scan: Scan) -> None:
    assert np.array_equal(found.points_mm, scan.points_mm)
    assert (found.normals is None) == (scan.normals is None)
    assert found.normals is None or scan.normals is None or np.array_equal(found.normals, scan.normals)
    assert [*found.columns] == [*scan.columns]
    for name, values in scan.columns.items():
        assert np.array_equal(found.columns[name], values, equal_nan=True), name


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_everything_comes_back(tmp_path: Path, suffix: str) -> None:
    found = reread(tmp_path, SUFFIXES[suffix](SCAN), suffix)
    assert_same(found, SCAN)
    assert found.findings == () and found.source is not None
    assert (found.source.unit, found.source.unit_stated) == ("mm", True)


@pytest.mark.parametrize("delimiter", ["blank", "tab", "semicolon"])
def test_german_tables_come_back(tmp_path: Path, delimiter: str) -> None:
    content = write_csv(SCAN, delimiter=delimiter, decimal=",")
    assert b"0,25" in content and b"0.25" not in content
    assert_same(reread(tmp_path, content), SCAN)


def test_headers_say_what_is_what() -> None:
    scan = Scan(POINTS, NORMALS, columns={"red": np.zeros(4)})
    assert write_scan(scan).startswith(b"# x_mm y_mm z_mm nx ny nz red\n0.1 0.2 1e-07 0.0 0.0 1.0 0\n")
    assert write_csv(scan, unit="inch").startswith(b"x_inch,y_inch,z_inch,nx,ny,nz,red\n")
    assert write_txt(Scan(POINTS), decimals=2, header=False).splitlines()[0] == b"0.10\t0.20\t0.00"
    assert write_scan(Scan(POINTS), decimals=1).splitlines()[-1] == b"0.0 0.0 2.0"


@pytest.mark.parametrize("unit", ["cm", "m", "inch"])
def test_units(tmp_path: Path, unit: str) -> None:
    found = reread(tmp_path, write_scan(SCAN, unit=unit))
    assert np.allclose(found.points_mm, POINTS, rtol=4e-16, atol=1e-300)
    assert found.source is not None and (found.source.unit, found.source.unit_stated) == (unit, True)
    with pytest.raises(UnitError):
        write_scan(SCAN, unit="ell")


@pytest.mark.parametrize("names", [(), ("intensity",), ("intensity", "red", "green", "blue"), ("red", "green", "blue")])
def test_pts(tmp_path: Path, names: tuple[str, ...]) -> None:
    scan = Scan(POINTS, columns={name: COLUMNS[name] for name in names})
    content = write_pts(Scan(POINTS, NORMALS, columns={**scan.columns, "quality": np.ones(4)}))
    assert content.startswith(b"4\n")
    assert_same(reread(tmp_path, content, ".pts"), scan)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"delimiter": "pipe"}, "delimiter"),
        ({"decimal": "'"}, "decimal"),
        ({"delimiter": "comma", "decimal": ","}, "both a comma"),
        ({"decimals": 18}, "decimals"),
        ({"decimals": -1}, "decimals"),
    ],
)
def test_wrong_options(options: dict[str, object], word: str) -> None:
    with pytest.raises(JobError, match=word):
        write_scan(SCAN, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["x", "PosY", "nx", 'a"b', "a\nb", "\x1b[2J", "", "a\0b", " a"])
def test_names_that_would_be_read_as_others_are_refused(name: str) -> None:
    with pytest.raises(JobError, match="rename"):
        write_scan(Scan(POINTS, columns={name: np.zeros(4)}))


def test_pts_refuses_colours_that_it_cannot_hold() -> None:
    with pytest.raises(JobError, match=r"0\.\.255"):
        write_pts(Scan(POINTS, columns=dict.fromkeys(("red", "green", "blue"), np.full(4, 0.5))))


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(st.tuples(finite, finite, finite, st.floats()), min_size=1, max_size=9),
    name=st.text(max_size=8),
    suffix=st.sampled_from([*SUFFIXES]),
)
def test_written_and_read_is_the_same(
    tmp_path: Path, rows: list[tuple[float, float, float, float]], name: str, suffix: str
) -> None:
    table = np.array([[0.5, 0, 0, 1], [0, 1.5, 0, 2], [0, 0, 2.5, 3], *rows])
    scan = Scan(table[:, :3], columns={name: table[:, 3]})
    try:
        content = SUFFIXES[suffix](scan)
    except JobError:
        return
    assert_same(reread(tmp_path, content, suffix), scan)


def test_long_tables_come_back(tmp_path: Path) -> None:
    points = np.random.default_rng(3).uniform(-1e3, 1e3, (60_000, 3))
    scan = Scan(points, columns={"q": np.arange(60_000.0)})
    assert_same(reread(tmp_path, write_csv(scan), ".csv"), scan)
    with pytest.raises(FormatError, match="columns"):  # without the header, nothing tells what the last column is
        reread(tmp_path, write_csv(Scan(points, columns={"q": points[:, 0], "p": points[:, 1]}), header=False))
