"""Long PLY files, of which a block at a time is read: the same as files that are read at once."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, Scan
from sicp_formats import ply
from sicp_formats.ply import read_scan, write_scan
from sicp_formats.source import LongFile
from sicp_formats.surfaces import point_rows, row_blocks

RANDOM = np.random.default_rng(7)
TYPES = {"float": "f4", "double": "f8", "uchar": "u1", "short": "i2"}
FACES = "element face 2\nproperty list uchar int vertex_indices\n"
CAMERA = "element camera 1\nproperty float focus\n"


@pytest.fixture
def in_blocks(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Read every binary file in places, three rows at a time."""
    monkeypatch.setattr(ply, "_LONG_BYTES", 0)
    for module in (row_blocks, point_rows):
        monkeypatch.setattr(module, "BLOCK_ROWS", 3)
    return monkeypatch


def cloud(points: FloatArray, order: str, types: list[str], *, normals: FloatArray | None, colour: bool) -> bytes:
    """Return header and rows of a vertex element whose coordinates have these types."""
    columns = [*zip(("x", "y", "z"), types, points.T, strict=True)]
    if normals is not None:
        columns += [*zip(("nx", "ny", "nz"), ["float", "double", "float"], normals.T, strict=True)]
    if colour:
        columns.insert(1, ("red", "uchar", np.arange(len(points)) % 256))
    rows = np.zeros(len(points), [(name, order + TYPES[kind]) for name, kind, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    kind = {"<": "little", ">": "big"}[order]
    head = f"ply\nformat binary_{kind}_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property {kind} {name}\n" for name, kind, _ in columns)
    return head.encode() + b"end_header\n" + rows.tobytes()


def with_elements(content: bytes, more: str, body: bytes) -> bytes:
    return content.replace(b"end_header\n", more.encode() + b"end_header\n", 1) + body


def outcome(path: Path, *, recover: bool) -> object:
    """Return all that can be told of a scan, or of the refusal."""
    try:
        scan = read_scan(path, recover=recover)
    except FormatError as error:
        return str(error), error.line, error.byte
    return _told(scan)


def _told(scan: Scan) -> object:
    arrays = [scan.points_mm, scan.normals, scan.faces, *scan.columns.values()]
    return [None if each is None else each.tobytes() for each in arrays], [*scan.columns], scan.source, scan.findings


def both_ways(path: Path, patch: pytest.MonkeyPatch, *, recover: bool) -> tuple[object, object]:
    patch.setattr(ply, "_LONG_BYTES", 0)
    in_places = outcome(path, recover=recover)
    patch.setattr(ply, "_LONG_BYTES", 1 << 60)
    return in_places, outcome(path, recover=recover)


@st.composite
def files(draw: st.DrawFn) -> bytes:
    rows = draw(st.integers(0, 11))
    points = RANDOM.uniform(-5.0, 5.0, (rows, 3))
    points[RANDOM.random(rows) < draw(st.sampled_from([0.0, 0.5]))] = draw(st.sampled_from([0.0, 1e7, np.nan]))
    normals = None
    if draw(st.booleans()):
        normals = RANDOM.normal(size=(rows, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        normals[RANDOM.random(rows) < 0.2] *= draw(st.sampled_from([1.0, 0.0, 2.0, np.inf]))
    types = draw(st.lists(st.sampled_from(["float", "double", "short"]), min_size=3, max_size=3))
    with np.errstate(invalid="ignore"):
        content = cloud(points, draw(st.sampled_from("<>")), types, normals=normals, colour=draw(st.booleans()))
    faces = np.zeros(2, [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, [[0, 1, 2], [2, 1, draw(st.integers(0, 12))]]
    body = draw(st.sampled_from([("", b""), ("", b"behind"), (FACES, faces.tobytes()), (CAMERA, bytes(4))]))
    content = with_elements(content, *body)
    match draw(st.sampled_from(["whole", "cut", "flipped"])):
        case "cut":
            return content[: draw(st.integers(1, len(content)))]
        case "flipped":
            at = draw(st.integers(0, len(content) - 1))
            return content[:at] + bytes([content[at] ^ draw(st.integers(1, 255))]) + content[at + 1 :]
    return content


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=files(), recover=st.booleans())
def test_a_file_read_in_places_says_what_a_file_read_at_once_says(
    tmp_path: Path, in_blocks: pytest.MonkeyPatch, content: bytes, recover: bool
) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(content)
    in_places, at_once = both_ways(path, in_blocks, recover=recover)
    assert in_places == at_once


def test_every_row_of_a_long_file_stands_in_its_place(tmp_path: Path) -> None:
    points = RANDOM.uniform(-5.0, 5.0, (60_001, 3))
    normals = RANDOM.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    path = tmp_path / "scan.ply"
    path.write_bytes(cloud(points, ">", ["double"] * 3, normals=normals, colour=True))
    assert path.stat().st_size < ply._LONG_BYTES
    path.write_bytes(path.read_bytes() + bytes(ply._LONG_BYTES))  # and the findings of what stands behind
    scan = read_scan(path)
    assert np.array_equal(scan.points_mm, points)
    assert scan.normals is not None and np.allclose(scan.normals, normals, atol=1e-7)
    assert np.array_equal(scan.columns["red"], np.arange(len(points)) % 256)
    assert [int(finding.code) for finding in scan.findings] == [101]


@pytest.mark.parametrize("row", [0, 3, 4, 5, 9])
def test_a_row_that_is_not_finite_is_named_wherever_the_blocks_end(
    tmp_path: Path, in_blocks: pytest.MonkeyPatch, row: int
) -> None:
    points = RANDOM.uniform(-5.0, 5.0, (10, 3))
    points[row:, 1] = np.inf
    path = tmp_path / "scan.ply"
    path.write_bytes(cloud(points, "<", ["double"] * 3, normals=None, colour=False))
    with pytest.raises(FormatError, match="is not finite") as caught:
        read_scan(path)
    assert caught.value.byte == path.stat().st_size - 24 * (10 - row)


def test_the_points_at_the_origin_are_counted_over_all_blocks(tmp_path: Path, in_blocks: pytest.MonkeyPatch) -> None:
    points = RANDOM.uniform(1.0, 5.0, (10, 3))
    points[[1, 4, 9]] = 0.0
    points[6, :2] = 0.0
    path = tmp_path / "scan.ply"
    path.write_bytes(cloud(points, "<", ["float"] * 3, normals=None, colour=False))
    assert next(finding.message for finding in read_scan(path).findings if finding.code == 108).startswith("3 points")


def test_a_packed_file_is_read_at_once(tmp_path: Path, in_blocks: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scan.ply.gz"
    path.write_bytes(gzip.compress(write_scan(Scan(np.eye(3)))))
    assert np.array_equal(read_scan(path).points_mm, np.eye(3))


class TestLongFile:
    def test_blocks_are_those_of_the_file(self, tmp_path: Path) -> None:
        path = tmp_path / "file"
        path.write_bytes(bytes(range(10)))
        file = LongFile(path, Limits())
        assert [bytes(block) for block in file.blocks(1, 9, 3)] == [b"\1\2\3", b"\4\5\6", b"\7\x08"]
        assert (len(file), file.head(2), file.head(99), file.whole()) == (10, b"\0\1", path.read_bytes(), file.head(10))

    @pytest.mark.parametrize("content", [b"", b"short", b"the same length", b"and this one is longer"])
    def test_a_file_that_changes_is_refused(self, tmp_path: Path, content: bytes) -> None:
        path = tmp_path / "file"
        path.write_bytes(b"fifteen letters")
        file = LongFile(path, Limits())
        path.write_bytes(content)
        os.utime(path, ns=(1, 1))
        for read in (file.whole, file.sha256, lambda: [*file.blocks(0, 15, 4)]):
            with pytest.raises(FormatError, match="was written to while it was read; read it again"):
                read()

    def test_a_file_that_is_gone_is_refused(self, tmp_path: Path) -> None:
        path = tmp_path / "file"
        path.write_bytes(b"content")
        file = LongFile(path, Limits())
        path.unlink()
        with pytest.raises(FormatError, match="no such file"):
            file.whole()
