"""E57: all scans of a file in one frame, with what they know of each point; damaged files are refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, InputError, UnitError
from sicp_cam.limits import Limits
from sicp_formats.external import e57
from sicp_formats.external.e57 import read_scan

pye57 = pytest.importorskip("pye57")

COUNT = 200
TURN = Rotation.from_rotvec([0.3, -0.2, 1.1])
SHIFT = np.array([1.0, -2.0, 0.5])


def numbers(seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    names = ("cartesianX", "cartesianY", "cartesianZ", "intensity")
    found = {name: rng.uniform(-1.0, 1.0, COUNT).astype(np.float32).astype(np.float64) for name in names}
    return found | {name: rng.integers(0, 256, COUNT).astype("u1") for name in ("colorRed", "colorGreen", "colorBlue")}


def xyz(found: dict[str, np.ndarray]) -> np.ndarray:
    return np.column_stack([found[name] for name in ("cartesianX", "cartesianY", "cartesianZ")])


def with_fields(path: Path, fields: dict[str, np.ndarray], pose: bool = False) -> Path:
    """Write one scan with whatever fields, as doubles, and no pose or half of one."""
    from pye57 import libe57

    with pye57.E57(str(path), mode="w") as file:
        image = file.image_file
        image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
        scan, prototype = libe57.StructureNode(image), libe57.StructureNode(image)
        for name in fields:
            prototype.set(name, libe57.FloatNode(image, 0.0))
        if pose:
            node, shift = libe57.StructureNode(image), libe57.StructureNode(image)
            scan.set("pose", node)
            for name, value in zip("xyz", SHIFT.tolist(), strict=True):
                shift.set(name, libe57.FloatNode(image, value))
            node.set("translation", shift)
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        scan.set("points", points)
        file.data3d.append(scan)
        buffers = libe57.VectorSourceDestBuffer()
        kept = {name: np.ascontiguousarray(values, np.float64) for name, values in fields.items()}
        for name, values in kept.items():
            buffers.append(libe57.SourceDestBuffer(image, name, values, len(values), True, True))
        points.writer(buffers).write(len(next(iter(kept.values()))))
    return path


@pytest.fixture(scope="module")
def stations(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file of two scans, the first with a pose and every tenth point invalid."""
    path = tmp_path_factory.mktemp("e57") / "two.e57"
    with pye57.E57(str(path), mode="w") as file:
        invalid = {"cartesianInvalidState": (np.arange(COUNT) % 10 == 0).astype("i1")}
        file.write_scan_raw(numbers(1) | invalid, rotation=np.roll(TURN.as_quat(), 1), translation=SHIFT)
        file.write_scan_raw(numbers(2))
    return path


def test_all_scans_come_at_their_pose_in_millimetres(stations: Path) -> None:
    scan = read_scan(stations)
    valid = np.arange(COUNT) % 10 != 0
    first = TURN.apply(xyz(numbers(1))[valid]) + SHIFT
    np.testing.assert_allclose(scan.points_mm, 1000.0 * np.vstack([first, xyz(numbers(2))]), atol=1e-9)
    assert [(each.code, each.message.split(" ")[0]) for each in scan.findings] == [(137, "20"), (141, "2")]
    assert scan.source is not None and (scan.source.unit, scan.source.unit_stated) == ("m", True)
    assert list(scan.columns) == ["intensity", "red", "green", "blue"]
    red = np.concatenate([numbers(1)["colorRed"][valid], numbers(2)["colorRed"]])
    assert np.array_equal(scan.columns["red"], red)


def test_spherical_coordinates_normals_and_half_a_pose(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    points, normals = rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    fields = {
        "sphericalRange": np.linalg.norm(points, axis=1),
        "sphericalAzimuth": np.arctan2(points[:, 1], points[:, 0]),
        "sphericalElevation": np.arcsin(points[:, 2] / np.linalg.norm(points, axis=1)),
    } | {f"nor:normal{axis}": normals[:, i] for i, axis in enumerate("XYZ")}
    scan = read_scan(with_fields(tmp_path / "a.e57", fields, pose=True))
    np.testing.assert_allclose(scan.points_mm, 1000.0 * (points + SHIFT), atol=1e-9)
    assert scan.normals is not None
    np.testing.assert_allclose(scan.normals, normals, atol=1e-12)
    assert not scan.columns and scan.findings == ()


def test_points_that_are_not_finite_are_refused_or_dropped(tmp_path: Path) -> None:
    fields = {f"cartesian{axis}": np.arange(9.0) ** power for power, axis in enumerate("XYZ")}
    fields["cartesianY"][4] = np.nan
    path = with_fields(tmp_path / "a.e57", fields)
    with pytest.raises(FormatError, match=r"point 4 first.*--recover"):
        read_scan(path)
    scan = read_scan(path, recover=True)
    assert len(scan.points_mm) == 8 and [each.code for each in scan.findings] == [164]


def test_no_coordinates_and_no_points_are_told(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="scan 1 has neither cartesian nor spherical"):
        read_scan(with_fields(tmp_path / "a.e57", {"intensity": np.ones(5)}))
    with pye57.E57(str(tmp_path / "b.e57"), mode="w"):
        pass
    with pytest.raises(FormatError, match="has no points"):
        read_scan(tmp_path / "b.e57")


def test_another_unit_than_metres_is_refused(stations: Path) -> None:
    assert read_scan(stations, units="m").source == read_scan(stations).source
    with pytest.raises(UnitError, match="in m by their standard, not mm"):
        read_scan(stations, units="mm")
    with pytest.raises(UnitError, match="unknown unit"):
        read_scan(stations, units="foot")


def test_the_library_is_asked_for(stations: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pye57; install sicp-cam\[e57\]"):
        read_scan(stations)


def test_limits_are_kept(stations: Path) -> None:
    with pytest.raises(FormatError, match="400 points are more than the limit points = 300"):
        read_scan(stations, limits=Limits(points=300))
    with pytest.raises(FormatError, match="took longer than cad_seconds"):
        read_scan(stations, limits=Limits(cad_seconds=0.01))


def test_damaged_heads_are_refused_before_the_library_sees_them(
    stations: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(e57, "answered", lambda *_: pytest.fail("the library was asked"))
    content, path = stations.read_bytes(), tmp_path / "a.e57"
    for damaged, place, words in (
        (b"PLY" + content[3:], "byte 0", "is no E57 file"),
        (content[:40], "byte 40", "40 bytes, fewer than the 48"),
        (content[:-1024], "byte 16", f"declares {len(content)} B, {len(content) - 1024} B present"),
    ):
        path.write_bytes(damaged)
        with pytest.raises(FormatError, match=words) as caught:
            read_scan(path)
        assert f"{place}:" in str(caught.value)


@pytest.mark.parametrize("part", ["head", "points", "xml", "cut"])
def test_damaged_bytes_are_refused_by_their_checksums(stations: Path, tmp_path: Path, part: str) -> None:
    content = bytearray(stations.read_bytes())
    if part == "cut":
        del content[2048:]
        content[16:24] = struct.pack("<Q", len(content))
    else:
        content[{"head": 9, "points": 1500, "xml": len(content) - 700}[part]] ^= 0x5A
    path = tmp_path / "a.e57"
    path.write_bytes(bytes(content))
    with pytest.raises(FormatError, match=r"cannot be read as E57|crashed"):
        read_scan(path)
