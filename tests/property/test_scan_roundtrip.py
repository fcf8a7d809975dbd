"""Scans survive writing and reading, and no damaged file ever causes anything but an error of ours."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import SicpError
from sicp_cam.model import Scan
from sicp_formats import ascii as ascii_scan
from sicp_formats import pcd, ply, stl

ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")
coordinates = st.floats(-1e6, 1e6, allow_nan=False)
modest = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
thorough = settings(modest, max_examples=300)


@st.composite
def scans(draw: st.DrawFn) -> Scan:
    """Scans whose points all differ and span an area."""
    rows = draw(st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=20))
    points = np.unique(np.array([[2e6, 0, 0], [0, 2e6, 0], [0, 0, 2e6], *rows]) + 0.0, axis=0)
    points = draw(st.permutations(points.tolist()).map(np.array))
    normals = None
    if draw(st.booleans()):
        raw = np.random.default_rng(draw(st.integers(0, 2**32))).normal(size=points.shape)
        normals = raw / np.linalg.norm(raw, axis=1)[:, None]
        normals[:: draw(st.integers(1, 5))] = 0.0
    faces = None
    if draw(st.booleans()):
        faces = np.array(
            [
                np.argmax(points, axis=0),
                *(draw(st.permutations(range(len(points))))[:3] for _ in range(draw(st.integers(0, 5)))),
            ]
        )
    numbers = st.lists(st.floats(), min_size=len(points), max_size=len(points)).map(np.array)
    columns = draw(st.dictionaries(st.sampled_from(["red", "scalar_Q", "größe"]), numbers, max_size=2))
    return Scan(points, normals, faces, columns=columns)


@modest
@given(scan=scans(), encoding=st.sampled_from(ENCODINGS))
def test_ply_written_and_read_is_the_same(
    tmp_path: Path, scan: Scan, encoding: Literal["ascii", "binary_little_endian", "binary_big_endian"]
) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(ply.write_scan(scan, encoding=encoding))
    again = ply.read_scan(path)
    assert np.array_equal(again.points_mm, scan.points_mm)
    assert list(again.columns) == list(scan.columns)
    for name, values in scan.columns.items():
        assert np.array_equal(again.columns[name], values, equal_nan=True)
    for ours, theirs in ((again.normals, scan.normals), (again.faces, scan.faces)):
        assert (ours is None) == (theirs is None)
        assert ours is None or theirs is None or np.array_equal(ours, theirs)


@modest
@given(
    rows=st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=20),
    delimiter=st.sampled_from([" ", "\t", ";", " ; "]),
    decimal=st.sampled_from([".", ","]),
)
def test_tables_written_and_read_are_the_same(
    tmp_path: Path, rows: list[tuple[float, float, float]], delimiter: str, decimal: str
) -> None:
    points = np.array([[0.5, 0, 0], [0, 1.5, 0], [0, 0, 2.5], *rows])
    lines = (delimiter.join(repr(cell).replace(".", decimal) for cell in row) for row in points.tolist())
    path = tmp_path / "scan.asc"
    path.write_text("\n".join(lines))
    assert np.array_equal(ascii_scan.read_scan(path).points_mm, points)


POINTS = np.array([[0.0, 0.0, 0.0], [10.0, 0.5, 0.0], [10.0, 7.0, 1.0], [0.0, 7.0, 0.25]])
SCAN = Scan(POINTS, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))
FACETS = b"".join(struct.pack("<12fH", 0, 0, 1, *POINTS[list(face)].ravel(), 0) for face in ((0, 1, 2), (0, 2, 3)))
MIXED_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"property list uchar short tags\nelement face 2\nproperty list uchar uint vertex_index\nend_header\n"
    + b"".join(struct.pack("<3fB", *row, tags) + b"\7\0" * tags for tags, row in enumerate(POINTS.tolist()))
    + struct.pack("<B3IB4I", 3, 0, 1, 2, 4, 0, 1, 2, 3)
)
SEEDS = {
    "ascii.ply": ply.write_scan(SCAN, encoding="ascii"),
    "little.ply": ply.write_scan(SCAN),
    "big.ply": ply.write_scan(SCAN, encoding="binary_big_endian"),
    "mixed.ply": MIXED_PLY,
    "mixed_text.ply": ply.write_scan(SCAN, encoding="ascii").replace(b"3 0 2 3", b"4 0 1 2 3"),
    "text.pcd": pcd.write_scan(SCAN, data="ascii"),
    "binary.pcd": pcd.write_scan(SCAN),
    "binary.stl": b" " * 80 + struct.pack("<I", 2) + FACETS,
    "text.stl": b"solid a\n"
    + b"".join(
        b"facet normal 0 0 1\nouter loop\n"
        + b"".join(b"vertex %g %g %g\n" % tuple(POINTS[corner]) for corner in face)
        + b"endloop\nendfacet\n"
        for face in ((0, 1, 2), (0, 2, 3))
    )
    + b"endsolid a\n",
    "plain.asc": b"".join(b"%g %g %g\n" % tuple(row) for row in POINTS.tolist()),
    "german.asc": b"4\n" + b"".join(b"%g;%g;%g\n" % tuple(row) for row in POINTS.tolist()).replace(b".", b","),
    "named.asc": b"// note\nX [mm],Y [mm],Z [mm],nx,ny,nz\n"
    + b"".join(b"%g,%g,%g,0,0,1\n" % tuple(row) for row in POINTS.tolist()),
    "wide.asc": b"\xff\xfe" + "1 2 3\n4 5.5 6\n7 8 1\n".encode("utf-16-le"),
}


def read(path: Path) -> None:
    if path.suffix == ".stl":
        stl.read_part(path)
    reader = {
        ".ply": ply.read_scan,
        ".pcd": pcd.read_scan,
        ".stl": stl.read_scan,
        ".asc": ascii_scan.read_scan,
    }[path.suffix]
    scan = reader(path)
    assert np.isfinite(scan.points_mm).all() and len(scan.points_mm) >= 3


@pytest.mark.parametrize("name", SEEDS)
def test_seeds_are_valid(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(SEEDS[name])
    read(path)


@pytest.mark.parametrize("name", SEEDS)
def test_every_truncation_is_read_or_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for length in range(len(SEEDS[name])):
        path.write_bytes(SEEDS[name][:length])
        try:
            read(path)
        except SicpError as error:
            assert str(path) in str(error)


@thorough
@given(name=st.sampled_from(sorted(SEEDS)), data=st.data())
def test_changed_bytes_are_read_or_refused(tmp_path: Path, name: str, data: st.DataObject) -> None:
    content = bytearray(SEEDS[name])
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / name
    path.write_bytes(bytes(content))
    try:
        read(path)
    except SicpError as error:
        assert str(path) in str(error)


@modest
@given(name=st.sampled_from(sorted(name for name in SEEDS if name.endswith((".ply", ".pcd")))), data=st.data())
def test_damaged_files_are_repaired_or_refused(tmp_path: Path, name: str, data: st.DataObject) -> None:
    content = bytearray(SEEDS[name])
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / name
    path.write_bytes(bytes(content[: data.draw(st.integers(0, len(content)))]))
    reader = ply.read_scan if path.suffix == ".ply" else pcd.read_scan
    try:
        scan = reader(path, recover=True)
        assert np.isfinite(scan.points_mm).all() and len(scan.points_mm) >= 3
    except SicpError as error:
        assert str(path) in str(error)


@modest
@given(content=st.binary(max_size=300), suffix=st.sampled_from([".ply", ".pcd", ".stl", ".asc"]))
def test_noise_is_read_or_refused(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"noise{suffix}"
    path.write_bytes(content)
    try:
        read(path)
    except SicpError as error:
        assert str(path) in str(error)
