"""PLY: every variant gives the known points, and every damaged file is refused with its line or byte."""

from __future__ import annotations

import hashlib
import struct
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Part, TriangleMesh
from sicp_formats.ply import read_scan, write_part, write_scan

POINTS = np.array([[0.0, 0.0, 0.0], [10.5, 0.25, -3.0], [0.0, 20.0, 1.5], [10.0, 20.0, 2.0]])
XYZ = "property float x\nproperty float y\nproperty float z\n"


def write(folder: Path, content: bytes | str) -> Path:
    path = folder / "scan.ply"
    path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return path


def ascii_ply(rows: str, *, count: int = 4, properties: str = XYZ, more: str = "") -> str:
    return f"ply\nformat ascii 1.0\nelement vertex {count}\n{properties}{more}end_header\n{rows}"


def text_rows(points: np.ndarray = POINTS) -> str:
    return "".join(" ".join(map(str, row)) + "\n" for row in points.tolist())


def binary_ply(
    payload: bytes, *, count: int = 4, properties: str = XYZ, more: str = "", order: str = "little"
) -> bytes:
    head = f"ply\nformat binary_{order}_endian 1.0\nelement vertex {count}\n{properties}{more}end_header\n"
    return head.encode() + payload


SINGLES = POINTS.astype("<f4").tobytes()
HEAD = len(binary_ply(b""))


def refused(path: Path, *words: str, place: str = "") -> str:
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    assert f"{place}:" in message
    for word in words:
        assert word in message
    return message


class TestVariants:
    def test_ascii_points_are_read_in_order(self, tmp_path: Path) -> None:
        scan = read_scan(write(tmp_path, ascii_ply(text_rows())))
        assert np.array_equal(scan.points_mm, POINTS)
        assert scan.normals is None and scan.faces is None and scan.findings == ()

    @pytest.mark.parametrize(("order", "code"), [("little", "<f4"), ("big", ">f4")])
    def test_both_byte_orders(self, tmp_path: Path, order: str, code: str) -> None:
        scan = read_scan(write(tmp_path, binary_ply(POINTS.astype(code).tobytes(), order=order)))
        assert np.array_equal(scan.points_mm, POINTS)

    @pytest.mark.parametrize("line_end", ["\r\n", "\r"])
    def test_header_line_ends_before_binary(self, tmp_path: Path, line_end: str) -> None:
        head = binary_ply(b"").replace(b"\n", line_end.encode())
        assert np.array_equal(read_scan(write(tmp_path, head + SINGLES)).points_mm, POINTS)

    @pytest.mark.parametrize("line_end", ["\r\n", "\r"])
    def test_line_ends_of_text(self, tmp_path: Path, line_end: str) -> None:
        path = write(tmp_path, ascii_ply(text_rows()).replace("\n", line_end))
        assert np.array_equal(read_scan(path).points_mm, POINTS)

    def test_payload_that_begins_with_a_newline(self, tmp_path: Path) -> None:
        points = POINTS.copy()
        points[0, 0] = struct.unpack("<f", b"\n\n\n\n")[0]
        scan = read_scan(write(tmp_path, binary_ply(points.astype("<f4").tobytes())))
        assert np.array_equal(scan.points_mm, points.astype("f4"))

    def test_doubles_keep_a_micrometre_at_a_kilometre(self, tmp_path: Path) -> None:
        points = POINTS + 1e6
        points[0, 0] = 1000000.001
        content = binary_ply(points.astype("<f8").tobytes(), properties=XYZ.replace("float", "double"))
        scan = read_scan(write(tmp_path, content))
        assert np.array_equal(scan.points_mm, points)
        assert scan.findings == ()

    def test_singles_far_from_the_origin_are_warned_of(self, tmp_path: Path) -> None:
        scan = read_scan(write(tmp_path, binary_ply((POINTS + 1e6).astype("<f4").tobytes())))
        assert [(each.code, each.level) for each in scan.findings] == [(105, Level.WARN)]

    def test_extra_scalars_do_not_shift_columns(self, tmp_path: Path) -> None:
        properties = (
            "property uchar flag\nproperty double z\nproperty short w\nproperty float scalar_q\n"
            "property int x\nproperty uint16 u\nproperty float32 y\n"
        )
        row = np.dtype(
            [("f", "u1"), ("z", "<f8"), ("w", "<i2"), ("q", "<f4"), ("x", "<i4"), ("u", "<u2"), ("y", "<f4")]
        )
        rows = np.zeros(4, row)
        rows["x"], rows["y"], rows["z"] = [1, -2, 3, 4], [0.5, 1.5, 2.5, 9], [7, 8, 9.25, 1]
        rows["q"] = np.nan
        scan = read_scan(write(tmp_path, binary_ply(rows.tobytes(), properties=properties)))
        assert np.array_equal(scan.points_mm, np.column_stack([rows["x"], rows["y"], rows["z"]]))
        text = "".join(f"1 {r['z']} 2 nan {r['x']} 3 {r['y']}\n" for r in rows)
        scan = read_scan(write(tmp_path, ascii_ply(text, properties=properties)))
        assert np.array_equal(scan.points_mm, np.column_stack([rows["x"], rows["y"], rows["z"]]))

    def test_lists_of_differing_length_in_vertices(self, tmp_path: Path) -> None:
        properties = "property float x\nproperty list uchar short tags\nproperty float y\nproperty float z\n"
        lists = [[1, 2], [], [5], [1, 2, 3]]
        payload = b"".join(
            struct.pack("<fB", x, len(tags)) + np.array(tags, "<i2").tobytes() + struct.pack("<ff", y, z)
            for (x, y, z), tags in zip(POINTS.tolist(), lists, strict=True)
        )
        assert np.array_equal(read_scan(write(tmp_path, binary_ply(payload, properties=properties))).points_mm, POINTS)
        text = "".join(
            " ".join(map(str, [x, len(tags), *tags, y, z])) + "\n"
            for (x, y, z), tags in zip(POINTS.tolist(), lists, strict=True)
        )
        assert np.array_equal(read_scan(write(tmp_path, ascii_ply(text, properties=properties))).points_mm, POINTS)

    def test_normals(self, tmp_path: Path) -> None:
        properties = XYZ + XYZ.replace(" x", " nx").replace(" y", " ny").replace(" z", " nz")
        rows = "0 0 0 0 0 1\n1 0 0 0 0 0\n0 1 0 0 3 4\n1 1 0 1 0 0\n"
        scan = read_scan(write(tmp_path, ascii_ply(rows, properties=properties)))
        assert scan.normals is not None
        assert np.allclose(scan.normals, [[0, 0, 1], [0, 0, 0], [0, 0.6, 0.8], [1, 0, 0]], atol=1e-15)
        assert [(each.code, each.message[:9]) for each in scan.findings] == [(102, "1 normals")]

    def test_enormous_normals_do_not_overflow(self, tmp_path: Path) -> None:
        properties = (XYZ + XYZ.replace(" x", " nx").replace(" y", " ny").replace(" z", " nz")).replace(
            "float", "double"
        )
        rows = "0 0 0 0 0 1e300\n1 0 0 0 0 1\n0 1 0 0 1e300 0\n1 1 0 1 0 0\n"
        scan = read_scan(write(tmp_path, ascii_ply(rows, properties=properties)))
        assert scan.normals is not None
        assert np.array_equal(scan.normals, [[0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]])

    def test_comments_blanks_and_object_info(self, tmp_path: Path) -> None:
        content = ascii_ply(text_rows()).replace(
            "element", "comment \x1b]0;x\x07 \0 ../../etc\nobj_info num_cols 3\n\nelement  ", 1
        )
        assert np.array_equal(read_scan(write(tmp_path, content)).points_mm, POINTS)

    @pytest.mark.parametrize("text", [True, False])
    def test_mixed_polygons_before_the_vertices(self, tmp_path: Path, text: bool) -> None:
        head = (
            f"ply\nformat {'ascii' if text else 'binary_little_endian'} 1.0\nelement face 3\n"
            "property uchar red\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n"
            f"element vertex 4\n{XYZ}end_header\n"
        )
        polygons = [[0, 1, 2], [0, 1, 3, 2], [1, 3, 2]]
        if text:
            rows = "".join(f"9 {len(p)} {' '.join(map(str, p))} {i} {' 0.5' * i}\n" for i, p in enumerate(polygons))
            content = (head + rows + text_rows()).encode()
        else:
            body = b"".join(
                struct.pack("<BB", 9, len(p)) + np.array(p, "<i4").tobytes() + bytes([i]) + b"\0" * 4 * i
                for i, p in enumerate(polygons)
            )
            content = head.encode() + body + SINGLES
        scan = read_scan(write(tmp_path, content))
        assert np.array_equal(scan.points_mm, POINTS)
        assert scan.faces is not None
        assert scan.faces.tolist() == [[0, 1, 2], [0, 1, 3], [0, 3, 2], [1, 3, 2]]
        assert [each.code for each in scan.findings] == [110, 103]
        assert scan.findings[0].message == "properties not used: red of face, texcoord of face"

    def test_equal_vertices_of_a_mesh_are_merged(self, tmp_path: Path) -> None:
        soup = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, -0.0]])
        more = "element face 2\nproperty list uchar int vertex_indices\n"
        content = ascii_ply(text_rows(soup) + "3 0 1 2\n3 3 4 5\n", count=6, more=more)
        scan = read_scan(write(tmp_path, content))
        assert scan.points_mm.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
        assert scan.faces is not None and scan.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
        assert [each.code for each in scan.findings] == [107]

    def test_collapsed_and_small_faces_are_dropped_and_told(self, tmp_path: Path) -> None:
        more = "element face 3\nproperty list uchar int vertex_indices\n"
        content = ascii_ply(text_rows() + "3 0 1 2\n3 1 1 2\n2 0 1\n", more=more)
        scan = read_scan(write(tmp_path, content))
        assert scan.faces is not None and scan.faces.tolist() == [[0, 1, 2]]
        assert [each.code for each in scan.findings] == [106, 106]

    def test_elements_of_no_use_are_told(self, tmp_path: Path) -> None:
        more = "element edge 1\nproperty int a\n"
        scan = read_scan(write(tmp_path, binary_ply(SINGLES + struct.pack("<i", 7), more=more)))
        assert [(each.code, each.level) for each in scan.findings] == [(104, Level.INFO)]

    def test_trailing_content_is_told(self, tmp_path: Path) -> None:
        path = write(tmp_path, binary_ply(SINGLES + b"x" * 12))
        (finding,) = read_scan(path).findings
        assert (finding.code, finding.level) == (101, Level.WARN)
        assert finding.message.startswith("12 more bytes") and finding.where.endswith(
            f"byte {path.stat().st_size - 12}"
        )
        (finding,) = read_scan(write(tmp_path, ascii_ply(text_rows() + "\n1 2 3\n"))).findings
        assert finding.message.startswith("1 more lines") and finding.where.endswith("line 13")

    def test_units_and_source(self, tmp_path: Path) -> None:
        path = write(tmp_path, ascii_ply(text_rows()))
        assumed, stated = read_scan(path), read_scan(path, units="inch")
        assert np.allclose(stated.points_mm, 25.4 * POINTS, rtol=1e-15)
        assert assumed.source is not None and stated.source is not None
        assert (assumed.source.unit, assumed.source.unit_stated) == ("mm", False)
        assert (stated.source.unit, stated.source.unit_stated) == ("inch", True)
        assert stated.source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        assert stated.source.format == "PLY" and stated.source.path == str(path)
        with pytest.raises(UnitError, match="furlong"):
            read_scan(path, units="furlong")

    def test_several_points_at_zero_are_warned_of(self, tmp_path: Path) -> None:
        points = np.vstack([POINTS, np.zeros((1, 3))])
        (finding,) = read_scan(write(tmp_path, ascii_ply(text_rows(points), count=5))).findings
        assert (finding.code, finding.level) == (108, Level.WARN)


FACES = "element face 1\nproperty list uchar int vertex_indices\n"
FLOAT_COUNT = "element face 1\nproperty list float int vertex_indices\n"


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "byte 0", ["empty"]),
        (b"ply", "byte 3", ["no end_header"]),
        (b"ply\n", "byte 4", ["no end_header"]),
        (b"solid x\n", "byte 0", ["does not begin with 'ply'"]),
        (ascii_ply("").replace("end_header\n", ""), f"byte {len(ascii_ply('')) - 11}", ["no end_header"]),
        (binary_ply(b"\0" * 120, count=4294967295), f"byte {HEAD + 9}", ["4294967295 x 12 B", "120 B present"]),
        (ascii_ply(text_rows(), count=10**18), "line 3", ["1000000000000000000 rows"]),
        (ascii_ply(text_rows()).replace("vertex 4", "vertex -5"), "line 3", ["'-5'"]),
        (ascii_ply(text_rows()).replace("vertex 4", "vertex abc"), "line 3", ["'abc'"]),
        (ascii_ply(text_rows()).replace("vertex 4", "vertex 0x10"), "line 3", ["'0x10'"]),
        (ascii_ply(text_rows()).replace("vertex 4", "vertex 1_0"), "line 3", ["'1_0'"]),
        (ascii_ply(text_rows()).replace("vertex 4", "vertex " + "9" * 5000), "line 3", ["no count"]),
        (binary_ply(SINGLES[:-7]), f"byte {HEAD}", ["4 x 12 B", "41 B present"]),
        (ascii_ply(text_rows(), count=5), "line 3", ["declares 5 rows, 4 present"]),
        (ascii_ply("0 0 0\n1 nan 0\n0 1 0\n1 1 1\n"), "line 9", ["1 nan 0 is not finite", "--recover"]),
        (ascii_ply("0 0 0\n1 1e400 0\n0 1 0\n1 1 1\n"), "line 9", ["1 inf 0 is not finite", "--recover"]),
        (ascii_ply("0 0 0\n1 2\n0 1 0\n1 1 1.25\n"), "line 9", ["2 columns instead of 3"]),
        (ascii_ply("0 0 0\n1 2 3\n0 1_0 0\n1 1 1\n"), "line 10", ["'1_0'"]),
        (ascii_ply("0 0 0\n1,5 2,5 3,5\n0 1 0\n1 1 1\n"), "line 9", ["decimal comma in '1,5'"]),
        (binary_ply(SINGLES[:16] + struct.pack("<f", np.inf) + SINGLES[20:]), f"byte {HEAD + 12}", ["not finite"]),
        (binary_ply(SINGLES[:16] + b"\x01\x00\xa0\x7f" + SINGLES[20:]), f"byte {HEAD + 12}", ["not finite"]),
        (ascii_ply(text_rows() + "3 0 1 99\n", more=FACES), "line 14", ["vertex 99", "0..3"]),
        (ascii_ply(text_rows() + "3 0 1 -1\n", more=FACES), "line 14", ["vertex -1"]),
        (ascii_ply(text_rows() + "3 0 1 1.5\n", more=FACES), "line 14", ["vertex 1.5"]),
        (ascii_ply(text_rows() + "4 0 1 2\n", more=FACES), "line 14", ["4 columns instead of 5"]),
        (ascii_ply(text_rows() + "-1 0 1 2\n", more=FACES), "line 14", ["length -1"]),
        (ascii_ply(text_rows(), more=FACES), "line 7", ["declares 1 rows, 0 present"]),
        (
            binary_ply(SINGLES + b"\xff" + b"\0" * 12, more=FACES),
            f"byte {HEAD + len(FACES) + 48}",
            ["row 0 of element face"],
        ),
        (
            binary_ply(SINGLES + b"\3" + b"\0" * 8, more=FACES),
            f"byte {HEAD + len(FACES) + 48}",
            ["row 0 of element face"],
        ),
        (binary_ply(SINGLES + b"\0" * 16, more=FLOAT_COUNT), "line 8", ["integer type"]),
        (binary_ply(SINGLES + b"\0" * 16, more=FACES.replace("uchar int", "uchar float")), "line 7", ["integers"]),
        (
            binary_ply(SINGLES + b"\xff" * 16, more=FACES.replace("uchar", "char")),
            f"byte {HEAD + len(FACES) - 1 + 48}",
            ["length -1"],
        ),
        (ascii_ply(text_rows() + "7\n", more="element face 1\nproperty int flags\n"), "line 7", ["vertex_indices"]),
        (ascii_ply("1 2\n" * 4, properties=XYZ.replace("property float z\n", "")), "line 3", ["no z"]),
        (
            ascii_ply(text_rows()).replace("end_header", "element vertex 4\nproperty int a\nend_header"),
            "line 7",
            ["twice"],
        ),
        (ascii_ply(text_rows(), properties=XYZ + "property float x\n"), "line 7", ["property x", "twice"]),
        (ascii_ply(text_rows(), properties=XYZ + "property float nx\n"), "line 3", ["only nx"]),
        (ascii_ply(text_rows()).replace("1.0", "2.0", 1), "line 2", ["ascii 2.0"]),
        (ascii_ply(text_rows()).replace("ascii", "utf8", 1), "line 2", ["utf8 1.0"]),
        (ascii_ply(text_rows()).replace("float z", "float16 z"), "line 6", ["float16"]),
        (ascii_ply(text_rows()).replace("float z", "int128 z"), "line 6", ["int128"]),
        (ascii_ply(text_rows()).replace("format ascii 1.0\n", ""), "line 6", ["no format line"]),
        (ascii_ply(text_rows()).replace("comment", "").replace("element", "elemnt"), "line 3", ["elemnt"]),
        ("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3", ["before any element"]),
        ("ply\nformat ascii 1.0\nelement vertex 4\nend_header\n", "line 3", ["no properties"]),
        ("ply\nformat ascii 1.0\nend_header\n", "line 3", ["no element vertex"]),
        (ascii_ply("", count=0), "line 3", ["no points"]),
        ("ply\n" + "comment\n" * 20_000, "line 10001", ["header_lines"]),
        ("ply\ncomment " + "x" * 2_000_000, "line 2", ["header_bytes"]),
        (ascii_ply("0 0 " + "0" * 70_000 + "\n" + text_rows()), "line 8", ["line_bytes"]),
        (b"\x1f\x8b\x08\0\0\0", "byte 0", ["gzip"]),
        (b"\n <!DOCTYPE html><html>", "byte 0", ["HTML"]),
        (b"version https://git-lfs.github.com/spec/v1\noid", "byte 0", ["Git LFS"]),
        (ascii_ply("1 2 3\n", count=1), "", ["cannot register"]),
        (ascii_ply("1 2 3\n" * 5, count=5), "", ["equal", "cannot register"]),
        (ascii_ply("0 0 0\n1 2 3\n2 4 6\n", count=3), "", ["on one line", "cannot register"]),
        (ascii_ply("0 0 0\n1 2 3\n2 1e9 6\n", count=3), "line 10", ["coordinate_mm"]),
    ],
)
def test_damaged_files_are_refused_with_their_place(
    tmp_path: Path, content: bytes | str, place: str, words: list[str]
) -> None:
    refused(write(tmp_path, content), *words, place=place)


def test_a_mesh_without_area_is_refused(tmp_path: Path) -> None:
    refused(write(tmp_path, ascii_ply(text_rows() + "3 1 1 2\n", more=FACES)), "area")


@pytest.mark.parametrize("recover", [False, True])
@pytest.mark.parametrize(
    ("declared", "words"), [(3, "48 more bytes than the header declares"), (5, "a count of the header")]
)
def test_a_wrong_count_of_vertices_is_blamed(tmp_path: Path, declared: int, words: str, recover: bool) -> None:
    content = write_part(Part((), TriangleMesh(POINTS, np.array([[0, 1, 2], [1, 3, 2]]))))
    assert b"element vertex 4\n" in content
    path = write(tmp_path, content.replace(b"element vertex 4\n", b"element vertex %d\n" % declared))
    with pytest.raises(FormatError, match=rf"none of the 2 faces has 3 corners.*{words}"):
        read_scan(path, recover=recover)


def test_files_that_are_none(tmp_path: Path) -> None:
    refused(tmp_path / "absent.ply", "no such file")
    refused(tmp_path, "folder")
    with pytest.raises(FormatError, match="file name"):
        read_scan(Path("a\0b.ply"))


@pytest.mark.parametrize(
    ("limits", "key"), [(Limits(file_bytes=10), "file_bytes"), (Limits(points=3), "points"), (Limits(faces=0), "faces")]
)
def test_limits_are_kept(tmp_path: Path, limits: Limits, key: str) -> None:
    path = write(tmp_path, ascii_ply(text_rows() + "3 0 1 2\n", more=FACES))
    with pytest.raises(FormatError, match=f"limit {key} = ") as caught:
        read_scan(path, limits=limits)
    assert str(path) in str(caught.value)


def test_polygons_beyond_the_limit_are_refused(tmp_path: Path) -> None:
    more = "element face 1\nproperty list int int vertex_indices\n"
    body = SINGLES + struct.pack("<i", 1001) + b"\0" * 4004
    refused(write(tmp_path, binary_ply(body, more=more)), "list_length", place=f"byte {HEAD + len(more) + 48}")


def test_encode_does_not_change_the_scan(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path, ascii_ply(text_rows() + "3 0 1 2\n", more=FACES)))
    before = (scan.points_mm.copy(), scan.faces)
    assert write_scan(scan) == write_scan(scan)
    assert np.array_equal(scan.points_mm, before[0]) and scan.faces is before[1]
