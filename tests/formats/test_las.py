"""LAS and LAZ: points by scale and offset, with what is known of each; damaged files are refused or repaired."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, InputError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_formats.external import las
from sicp_formats.external.las import read_scan

laspy = pytest.importorskip("laspy")
pytest.importorskip("lazrs")

COUNT = 300
RAW = np.random.default_rng(6).integers(-20_000, 20_000, (COUNT, 3))
SCALES, OFFSETS = np.array([1e-4, 1e-4, 2e-4]), np.array([1.0, -2.0, 300.0])
TRUTH_M = RAW * SCALES + OFFSETS


def write(path: Path, version: str = "1.2", point_format: int = 2) -> Path:
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales, header.offsets = SCALES, OFFSETS
    scan = laspy.LasData(header)
    scan.X, scan.Y, scan.Z = RAW.T
    scan.intensity = np.arange(COUNT)
    scan.classification = np.full(COUNT, 2)
    if point_format in (2, 7):
        scan.red = np.arange(COUNT) + 1000
    scan.write(str(path))
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("las")
    for name in ("scan.las", "scan.laz"):
        write(folder / name)
    return folder


@pytest.mark.parametrize("name", ["scan.las", "scan.laz"])
def test_points_come_by_scale_and_offset_with_their_columns(files: Path, name: str) -> None:
    scan = read_scan(files / name)
    assert np.array_equal(scan.points_mm, TRUTH_M * 1000.0)
    assert set(scan.columns) == {"intensity", "classification", "red"}
    assert scan.columns["red"].tolist() == list(range(1000, 1000 + COUNT))
    (finding,) = scan.findings
    assert (finding.code, finding.level) == (138, Level.WARN) and "metres were assumed" in finding.message
    assert scan.source is not None
    assert (scan.source.format, scan.source.unit, scan.source.unit_stated) == (name[-3:].upper(), "m", False)


def test_a_newer_version_is_read(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path / "a.las", "1.4", 7), units="m")
    assert np.array_equal(scan.points_mm, TRUTH_M * 1000.0) and scan.findings == ()


def test_a_stated_unit_is_taken(files: Path) -> None:
    scan = read_scan(files / "scan.las", units="mm")
    assert np.array_equal(scan.points_mm, TRUTH_M) and scan.findings == ()
    with pytest.raises(UnitError):
        read_scan(files / "scan.las", units="foot")


def test_the_library_is_asked_for(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"laspy; install sicp-cam\[las\]"):
        read_scan(files / "scan.las")


def test_damaged_heads_are_refused_before_the_library_sees_them(
    files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(las, "answered", lambda *_: pytest.fail("the library was asked"))
    content, path = (files / "scan.las").read_bytes(), tmp_path / "a.las"
    for damaged, limits, place, words in (
        (b"PLY" + content[3:], Limits(), "byte 0", "is no LAS or LAZ file"),
        (content[:100], Limits(), "byte 100", "100 bytes, fewer than the 227"),
        (content[:-1], Limits(), "byte 107", "300 points x 26 B = 7800 B, 7799 B present.*--recover"),
        (content[:107] + struct.pack("<I", 0) + content[111:], Limits(), "byte 107", "no points"),
        (content[:107] + struct.pack("<I", 2**31) + content[111:], Limits(), "byte 107", "limit points"),
        (content[:107] + struct.pack("<I", 10**8) + content[111:], Limits(), "byte 107", "7800 B present"),
        (content, Limits(points=200), "byte 107", "300 points are more than the limit points = 200"),
    ):
        path.write_bytes(damaged)
        with pytest.raises(FormatError, match=words) as caught:
            read_scan(path, limits=limits)
        assert f"{place}:" in str(caught.value)


def test_a_file_that_is_cut_short_is_repaired_on_request(files: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    path.write_bytes((files / "scan.las").read_bytes()[: -26 * 10 - 5])
    scan = read_scan(path, recover=True)
    assert np.array_equal(scan.points_mm, TRUTH_M[: COUNT - 11] * 1000.0)
    assert [(each.code, each.level) for each in scan.findings] == [(163, Level.WARN), (138, Level.WARN)]


@pytest.mark.parametrize("at", [-1000, 400])
def test_a_damaged_archive_is_data_or_a_format_error(files: Path, tmp_path: Path, at: int) -> None:
    content, path = bytearray((files / "scan.laz").read_bytes()), tmp_path / "a.laz"
    if at < 0:
        del content[at:]
    else:
        content[at : at + 4] = b"\xff\xff\xff\x7f"
    path.write_bytes(bytes(content))
    try:
        scan = read_scan(path)
    except FormatError as error:
        assert "a.laz" in str(error) and "\n" not in str(error)
    else:
        assert np.isfinite(scan.points_mm).all()
