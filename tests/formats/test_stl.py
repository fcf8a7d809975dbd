"""STL: text and binary give the known mesh, written meshes are read again, damaged files are refused or repaired."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Part, Scan, TriangleMesh
from sicp_formats.stl import read_part, read_scan, write_part, write_scan
from sicp_formats.stl.regular import regular_corners
from sicp_formats.surfaces.meshes import equal_points

CORPUS = Path(__file__).parents[1] / "corpus" / "stl"

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


@pytest.mark.parametrize("path", sorted(CORPUS.iterdir()), ids=lambda path: path.name)
def test_the_corpus_is_one_mesh_in_many_ways(path: Path) -> None:
    scan = read_scan(path)
    assert np.array_equal(scan.points_mm, VERTICES)
    assert scan.faces is not None and scan.faces.tolist() == FACES
    assert [each.code for each in scan.findings] == ([135] if "coloured" in path.name else [])


def test_colours_are_told(tmp_path: Path) -> None:
    (finding,) = read_scan(CORPUS / "binary_coloured.stl").findings
    assert finding.level == Level.INFO
    assert "COLOR in the header" in finding.message and "at 1 of 2 triangles" in finding.message


def facets(count: int) -> np.ndarray:
    return np.random.default_rng(3).normal(scale=100.0, size=(3 * count, 3))


def lines_of(corners: np.ndarray, indent: str = "  ", end: str = "\n") -> str:
    rows = [" ".join(map(repr, row)) for row in corners.tolist()]
    text = ["solid x"]
    for a, b, c in zip(rows[::3], rows[1::3], rows[2::3], strict=True):
        text += ["facet normal 0 0 1", f"{indent}outer loop"]
        text += [f"{2 * indent}vertex {row}" for row in (a, b, c)]
        text += [f"{indent}endloop", "endfacet"]
    return end.join([*text, "endsolid x", ""])


@pytest.mark.parametrize(("indent", "end"), [("", "\n"), ("  ", "\n"), ("\t", "\r\n")])
def test_the_regular_layout_is_read_exactly_and_at_once(indent: str, end: str) -> None:
    corners = facets(200)
    found = regular_corners(lines_of(corners, indent, end).encode(), DEFAULT_LIMITS)
    assert found is not None
    assert np.array_equal(found[0], corners)
    assert found[1][:4].tolist() == [4, 5, 6, 11] and found[1][-1] == 2 + 7 * 199 + 4


def test_blocks_of_the_regular_layout_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sicp_formats.stl.regular._BLOCK_BYTES", 1000)
    corners = facets(50)
    found = regular_corners((lines_of(corners) + lines_of(corners)).encode(), DEFAULT_LIMITS)
    assert found is not None
    assert np.array_equal(found[0], np.vstack([corners, corners]))
    assert found[1][-1] == 2 * (2 + 7 * 50) - 3


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("endloop", "endlop"),
        ("outer loop", "outer"),
        ("facet normal", "facet colour"),
        ("vertex", "vertexx"),
        ("vertex", "# vertex"),
        ("endsolid x\n", ""),
        ("endsolid", "endsolidx"),
        ("solid x\n", "\n\n\n\n\n\n\n\n        "),
        ("solid x", "x"),
    ],
)
def test_what_is_not_of_the_regular_layout_is_left_to_the_strict_reader(old: str, new: str) -> None:
    assert regular_corners(lines_of(facets(3)).replace(old, new, 1).encode(), DEFAULT_LIMITS) is None


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_both_text_readers_agree_on_damaged_files(data: st.DataObject) -> None:
    content = bytearray(lines_of(np.round(facets(4), 2)).encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from(b" \n\rv1.e#x-\0"))
    found = regular_corners(bytes(content), DEFAULT_LIMITS)
    if found is not None:
        from sicp_formats.stl import text as stl_text
        from sicp_formats.tables.rows import numbers

        rows = stl_text._corner_rows(Path("x"), bytes(content), DEFAULT_LIMITS, False, [])
        corners, lines = numbers(Path("x"), rows, 3, finite=(0, 1, 2))
        assert np.array_equal(found[0], corners) and np.array_equal(found[1], lines)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("hashed_from", [0, 10**9])
def test_equal_points_are_found_either_way(monkeypatch: pytest.MonkeyPatch, dtype: type, hashed_from: int) -> None:
    monkeypatch.setattr("sicp_formats.surfaces.meshes._HASHED_FROM", hashed_from)
    rng = np.random.default_rng(1)
    kinds = rng.integers(-1, 2, (70, 3)).astype(dtype)
    points = kinds[rng.integers(0, 70, 1000)]
    points[points == 0] *= rng.choice([-1.0, 1.0], int((points == 0).sum())).astype(dtype)
    first, merged = equal_points(points)
    assert np.array_equal(points[first][merged], points)
    assert len(first) == len(np.unique(points + 0.0, axis=0))
    assert (np.diff(first) > 0).all() and np.array_equal(merged[first], np.arange(len(first)))


def test_points_whose_mixes_collide_stay_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sicp_formats.surfaces.meshes._mixed", lambda points: np.zeros(len(points), np.uint64))
    first, merged = equal_points(VERTICES[[0, 1, 0, 2]])
    assert first.tolist() == [0, 1, 3] and merged.tolist() == [0, 1, 0, 2]


def cut(content: bytes | str, count: int) -> bytes | str:
    return content[:-count]


@pytest.mark.parametrize(
    ("content", "triangles", "code", "words"),
    [
        (cut(binary(), 7), 1, 160, "declares 2 triangles, 1 whole"),
        (binary()[:80] + struct.pack("<I", 1) + binary()[84:], 2, 160, "declares 1 triangles, 2 whole"),
        (binary()[:80] + struct.pack("<I", 10**9) + binary()[84:], 2, 160, "2 whole ones are present"),
        (binary() + b"tail", 2, 101, "4 more bytes"),
        (TEXT.replace("endsolid part\n", ""), 2, 161, "the 2 whole triangles"),
        (cut(TEXT, len("endsolid part\n") + 4), 2, 161, "before 'endfacet'; the 2 whole triangles"),
        (TEXT[: TEXT.rindex("endloop") - 3], 1, 161, "ends before 'vertex'"),
        (TEXT[: TEXT.rindex("endloop")], 1, 161, "ends before 'endloop'"),
        (TEXT.replace("vertex 0 3 0", "vertex 0 nan 0"), 1, 162, "1 of 2 triangles"),
        (binary(vertices=np.vstack([VERTICES[:3], [[0, np.inf, 0]]])), 1, 162, "1 of 2 triangles"),
    ],
)
def test_repairs_are_made_on_request_and_told(
    tmp_path: Path, content: bytes | str, triangles: int, code: int, words: str
) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError):
        read_scan(path)
    scan = read_scan(path, recover=True)
    assert scan.faces is not None and scan.faces.tolist() == FACES[:triangles]
    assert np.array_equal(scan.points_mm, VERTICES[: triangles + 2])
    (finding,) = scan.findings
    assert (finding.code, finding.level) == (code, Level.WARN) and words in finding.message
    assert str(path) in finding.where and read_part(path, recover=True).findings == scan.findings


@pytest.mark.parametrize("content", [cut(binary(), 7), TEXT.replace("endsolid part\n", "")])
def test_errors_that_a_repair_would_cure_say_so(tmp_path: Path, content: bytes | str) -> None:
    with pytest.raises(FormatError, match="; or repair it with --recover"):
        read_scan(write(tmp_path, content))


@pytest.mark.parametrize("content", [binary()[:100], TEXT[:60], binary(vertices=VERTICES * np.nan)])
def test_a_file_without_a_whole_triangle_cannot_be_repaired(tmp_path: Path, content: bytes | str) -> None:
    with pytest.raises(FormatError):
        read_scan(write(tmp_path, content), recover=True)


COORDINATE = st.floats(-1e5, 1e5, width=32)


@given(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=3, max_size=8, unique=True), st.data())
@settings(max_examples=30, deadline=None)
def test_written_meshes_are_read_again(
    tmp_path_factory: pytest.TempPathFactory, points: list, data: st.DataObject
) -> None:
    vertices, path = np.array(points) + 0.0, tmp_path_factory.getbasetemp() / "written.stl"
    faces = np.array([[0, i, i + 1] for i in range(1, len(points) - 1)])
    mesh = TriangleMesh(vertices, faces)
    encoding = data.draw(st.sampled_from(["binary", "ascii"]))
    path.write_bytes(write_part(Part((), mesh), encoding=encoding))
    try:
        again = read_part(path).mesh
    except FormatError as error:
        assert "line" in str(error) or "area" in str(error)
        return
    assert np.array_equal(again.vertices_mm[again.faces], vertices[faces])


def test_text_keeps_all_digits_and_units_are_converted(tmp_path: Path) -> None:
    vertices = np.random.default_rng(2).normal(size=(3, 3))
    scan = Scan(vertices, faces=np.array([[0, 1, 2]]), columns={"quality": np.ones(3)})
    path = write(tmp_path, write_scan(scan, encoding="ascii"))
    assert np.array_equal(read_scan(path).points_mm, vertices)
    path = write(tmp_path, write_scan(scan, unit="inch"))
    np.testing.assert_allclose(read_scan(path, units="inch").points_mm, vertices, rtol=1e-7)
    assert read_scan(path, units="inch").findings == ()


def test_what_stl_cannot_hold_is_refused() -> None:
    with pytest.raises(JobError, match="the scan has none"):
        write_scan(Scan(VERTICES))
    with pytest.raises(JobError, match="1 points belong to no triangle"):
        write_scan(Scan(VERTICES, faces=np.array([[0, 1, 2]])))
    with pytest.raises(JobError, match="no 'text' STL"):
        write_scan(Scan(VERTICES, faces=np.array(FACES)), encoding="text")  # type: ignore[arg-type]
    with pytest.raises(JobError, match="the part has none"):
        write_part(Part((), TriangleMesh(VERTICES, np.zeros((0, 3), int))))
    with pytest.raises(UnitError):
        write_scan(Scan(VERTICES, faces=np.array(FACES)), unit="foot")


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_damaged_bytes_are_data_or_a_format_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = bytearray(data.draw(st.sampled_from([binary(), binary(header=b"solid"), TEXT.encode()])))
    for _ in range(data.draw(st.integers(0, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.stl"
    path.write_bytes(bytes(content[: data.draw(st.integers(1, len(content)))]))
    for recover in (False, True):
        try:
            scan = read_scan(path, recover=recover)
        except FormatError as error:
            assert "damaged.stl" in str(error) and "\n" not in str(error)
        else:
            assert np.isfinite(scan.points_mm).all() and scan.faces is not None and len(scan.faces)
