"""STL: text and binary give the known mesh, and every damaged file is refused with its line or byte."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_formats.stl import read_part, read_scan

VERTICES = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.5], [0.0, 3.0, 0.0]])
FACES = [[0, 1, 2], [0, 2, 3]]
FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 4 0 0\nvertex 4 3 0.5\nendloop\nendfacet\n"
SECOND = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 4 3 0.5\nvertex 0 3 0\nendloop\nendfacet\n"
TEXT = f"solid part\n{FACET}{SECOND}endsolid part\n"


def binary(
    faces: list[list[int]] = FACES, *, vertices: np.ndarray = VERTICES, header: bytes = b"", normal: float = 1.0
) -> bytes:
    facets = np.zeros(len(faces), [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["normal"] = [0, 0, normal]
    facets["corners"] = vertices[np.array(faces, int).reshape(-1, 3)]
    return header.ljust(80, b" ")[:80] + struct.pack("<I", len(faces)) + facets.tobytes()


def write(folder: Path, content: bytes | str) -> Path:
    path = folder / "mesh.stl"
    path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(
    "content",
    [
        binary(),
        binary(header=b"solid exported by VXelements"),
        TEXT,
        TEXT.replace("\n", "\r\n"),
        TEXT.replace("\n", "\r"),
        TEXT.replace("\n", "\n\n  "),
        TEXT.upper(),
        TEXT.encode().replace(b"part", b"Tr\xe4ger \xb0"),
        b"\xef\xbb\xbf" + TEXT.upper().encode(),
        f"solid a\n{FACET}endsolid a\nsolid b\n{SECOND}endsolid b\n",
        TEXT.replace("solid part", "solid"),
        TEXT.replace("facet normal 0 0 1\n", "facet normal 0 0 nan # odd\n# note\n"),
        TEXT.replace("facet normal 0 0 1\n", "facet\n"),
    ],
)
def test_every_variant_gives_the_same_mesh(tmp_path: Path, content: bytes | str) -> None:
    path = write(tmp_path, content)
    scan, part = read_scan(path), read_part(path)
    for vertices, faces in ((scan.points_mm, scan.faces), (part.mesh.vertices_mm, part.mesh.faces)):
        assert np.array_equal(vertices, VERTICES)
        assert faces is not None and faces.tolist() == FACES
    assert part.contours == () and scan.findings == () and part.findings == ()
    assert scan.source == part.source


def test_units(tmp_path: Path) -> None:
    path = write(tmp_path, binary())
    part = read_part(path, units="m")
    assert np.array_equal(part.mesh.vertices_mm, 1000.0 * VERTICES)
    assert part.source is not None and (part.source.unit, part.source.unit_stated) == ("m", True)
    assumed = read_part(path).source
    assert assumed is not None and (assumed.unit, assumed.unit_stated) == ("mm", False)


def test_vertices_merge_only_where_they_are_equal(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    grid = np.stack([*np.meshgrid(np.arange(30.0), np.arange(20.0), indexing="ij"), rng.normal(size=(30, 20))], -1)
    vertices = grid.reshape(-1, 3).astype("f4").astype(float)
    vertices[1] = vertices[0] + [0, np.spacing(np.float32(1)), 0]
    corner = (np.arange(29)[:, None] * 20 + np.arange(19)).ravel()
    faces = np.vstack([np.c_[corner, corner + 20, corner + 1], np.c_[corner + 1, corner + 20, corner + 21]])
    scan = read_scan(write(tmp_path, binary(faces.tolist(), vertices=vertices)))
    assert len(scan.points_mm) == 600
    assert scan.faces is not None
    assert np.array_equal(scan.points_mm[scan.faces], vertices[faces])


def test_collapsed_triangles_are_dropped_and_slivers_kept(tmp_path: Path) -> None:
    vertices = np.vstack([VERTICES, [[2.0, 0.0, 0.0]]])
    scan = read_scan(write(tmp_path, binary([*FACES, [0, 0, 1], [0, 4, 1]], vertices=vertices)))
    assert scan.faces is not None and len(scan.faces) == 3
    assert [(each.code, each.message.split(" ")[0]) for each in scan.findings] == [(106, "1"), (106, "1")]


def test_normals_against_the_winding_are_warned_of(tmp_path: Path) -> None:
    (finding,) = read_scan(write(tmp_path, binary(normal=-1.0))).findings
    assert (finding.code, finding.level) == (109, Level.WARN)
    assert finding.message.startswith("2 of 2")


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "byte 0", ["empty"]),
        (b"\x01" * 60, "byte 0", ["60 bytes", "84"]),
        (b"so", "byte 0", ["2 bytes"]),
        (b"x", "byte 0", ["1 bytes"]),
        (binary([]), "byte 80", ["no triangles"]),
        ("solid a\nendsolid a\n", "line 2", ["no triangles"]),
        (
            binary()[:80] + struct.pack("<I", 3) + binary()[84:],
            "byte 80",
            ["3 triangles x 50 B = 150 B", "100 B present"],
        ),
        (
            binary()[:80] + struct.pack("<I", 1) + binary()[84:],
            "byte 80",
            ["1 triangles x 50 B = 50 B", "100 B present"],
        ),
        (binary()[:-1], "byte 80", ["100 B", "99 B present"]),
        (binary(header=b"solid x")[:-7], "byte 80", ["100 B", "93 B present"]),
        (TEXT.replace("endsolid part\n", ""), "line 15", ["'endsolid'", "cut short"]),
        (TEXT[:40], "line 3", ["ends before 'vertex'"]),
        (TEXT[:60], "line 5", ["ends before 'vertex'"]),
        (TEXT.replace("4 3 0.5", "4 3 0,5"), "line 6", ["decimal comma"]),
        (TEXT.replace("vertex 4 0 0", "vertex 4 O 0"), "line 5", ["'O'"]),
        (TEXT.replace("vertex 4 0 0\n", ""), "line 6", ["'endloop' stands where 'vertex'"]),
        (TEXT.replace("vertex 4 0 0\n", "vertex 4 0 0\nvertex 1 1 1\n"), "line 7", ["'vertex' stands where 'endloop'"]),
        (TEXT.replace("vertex 4 0 0", "vertex 4 nan 0"), "line 5", ["'nan'"]),
        (TEXT.replace("vertex 4 0 0", "vertex 4 1e400 0"), "line 5", ["'1e400'"]),
        (TEXT.replace("vertex 4 0 0", "vertex 4 1e300 0"), "line 5", ["coordinate_mm"]),
        (TEXT.replace("vertex 4 0 0", "vertex 4 0"), "line 5", ["2 columns instead of 3"]),
        (TEXT.replace("vertex 4 0 0", "vertex"), "line 5", ["0 columns instead of 3"]),
        (TEXT.replace("outer loop", "outer"), "line 3", ["'loop'"]),
        (TEXT.replace("facet normal", "facet colour", 1), "line 2", ["'normal'"]),
        (TEXT + "junk\n", "line 17", ["'junk' stands where 'solid'"]),
        (binary(vertices=np.where(VERTICES == 3.0, np.nan, VERTICES)), "byte 120", ["not finite"]),
        (binary(vertices=np.where(VERTICES == 3.0, np.inf, VERTICES)), "byte 120", ["not finite"]),
        (binary([[0, 0, 1], [1, 1, 1]]), "", ["none of the 2 triangles has an area"]),
        (b"PK\x03\x04" + b"\0" * 100, "byte 0", ["zip"]),
    ],
)
@pytest.mark.parametrize("read", [read_scan, read_part])
def test_damaged_files_are_refused_with_their_place(
    tmp_path: Path, content: bytes | str, place: str, words: list[str], read: type
) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError) as caught:
        read(path)
    message = str(caught.value)
    assert str(path) in message and f"{place}:" in message and "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize("content", [binary(), TEXT])
def test_the_limit_of_triangles_is_kept(tmp_path: Path, content: bytes | str) -> None:
    with pytest.raises(FormatError, match="limit faces = 1"):
        read_scan(write(tmp_path, content), limits=Limits(faces=1))
