"""PLY as other software writes it, repaired where it is damaged, read as a part, and written."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Contour, Part, Scan, TriangleMesh
from sicp_formats.ply import read_part, read_scan, write_part, write_scan

CORPUS = Path(__file__).resolve().parents[1] / "corpus" / "ply"
POINTS = np.array([[0.0, 0.0, 0.0], [10.5, 0.25, -3.0], [0.0, 20.0, 1.5], [10.0, 20.0, 2.0]])
XYZ = "property float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\n"
ROWS = ["0.0 0.0 0.0", "10.5 0.25 -3.0", "0.0 20.0 1.5", "10.0 20.0 2.0"]


def text(rows: list[str], *, vertices: int = 4, more: str = "", comment: str = "") -> bytes:
    head = f"ply\nformat ascii 1.0\n{comment}element vertex {vertices}\n{XYZ}{more}end_header\n"
    return (head + "".join(f"{row}\n" for row in rows)).encode()


def binary(body: bytes, *, vertices: int = 4, more: str = "", properties: str = XYZ) -> bytes:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{properties}{more}end_header\n"
    return head.encode() + body


def write(folder: Path, content: bytes) -> Path:
    path = folder / "scan.ply"
    path.write_bytes(content)
    return path


def codes(thing: Scan | Part) -> list[tuple[int, str]]:
    return [(int(each.code), str(each.level)) for each in thing.findings]


class TestCorpus:
    @pytest.mark.parametrize(
        ("name", "faces", "found"),
        [
            ("comments_in_body.ply", None, [111]),
            ("faces_first_big_endian.ply", [[0, 1, 2], [1, 3, 2]], [110]),
            ("lists_at_vertices.ply", [[0, 1, 2], [0, 1, 3], [0, 3, 2]], [110, 103]),
            ("columns.ply", None, []),
            ("range_grid.ply", None, [104]),
            ("tristrips.ply", [[0, 1, 2], [2, 1, 3], [3, 2, 1]], []),
            ("packed.ply.gz", None, []),
        ],
    )
    def test_every_variant_gives_the_same_points(
        self, name: str, faces: list[list[int]] | None, found: list[int]
    ) -> None:
        scan = read_scan(CORPUS / name)
        assert np.array_equal(scan.points_mm, POINTS)
        assert (None if scan.faces is None else scan.faces.tolist()) == faces
        assert [each.code for each in scan.findings] == found

    def test_a_payload_that_begins_with_newline_bytes_behind_crlf(self) -> None:
        points = read_scan(CORPUS / "crlf_then_newline_bytes.ply").points_mm
        assert points[0, 0] == struct.unpack("<f", b"\n\n\n\n")[0]
        assert np.array_equal(points[1:], POINTS[1:])

    def test_further_scalars_are_columns_of_their_own_name(self) -> None:
        scan = read_scan(CORPUS / "columns.ply")
        assert list(scan.columns) == [
            *("diffuse_red", "diffuse_green", "diffuse_blue"),
            *("confidence", "intensity", "scalar_Deviation"),
        ]
        assert scan.columns["diffuse_red"].tolist() == [1, 2, 3, 255]
        assert scan.columns["intensity"].tolist() == [0, 1, 40000, 65535]
        assert np.array_equal(scan.columns["scalar_Deviation"], [np.nan, 1, 2, 3], equal_nan=True)
        assert scan.normals is not None and (scan.normals == [0, 0, 1]).all()

    def test_every_cut_of_a_seed_is_read_or_refused(self, tmp_path: Path) -> None:
        for seed in sorted(CORPUS.glob("*.ply")):
            content = seed.read_bytes()
            for length in range(0, len(content), 11):
                for recover in (False, True):
                    try:
                        assert len(read_scan(write(tmp_path, content[:length]), recover=recover).points_mm) >= 3
                    except FormatError as error:
                        assert str(tmp_path) in str(error)


class TestUnit:
    @pytest.mark.parametrize(("unit", "mm"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4)])
    def test_a_comment_states_it(self, tmp_path: Path, unit: str, mm: float) -> None:
        scan = read_scan(write(tmp_path, text(ROWS, comment=f"comment unit {unit}\n")))
        assert np.allclose(scan.points_mm, mm * POINTS, rtol=1e-15)
        assert scan.source is not None and (scan.source.unit, scan.source.unit_stated) == (unit, True)

    def test_the_user_may_not_contradict_it(self, tmp_path: Path) -> None:
        path = write(tmp_path, text(ROWS, comment="comment unit mm\n"))
        with pytest.raises(UnitError, match="line 3: the file states mm, the job inch"):
            read_scan(path, units="inch")
        assert read_scan(path, units="mm").source is not None

    def test_an_unknown_word_is_told(self, tmp_path: Path) -> None:
        scan = read_scan(write(tmp_path, text(ROWS, comment="comment units furlong\n")))
        assert codes(scan) == [(132, "warn")]
        assert scan.findings[0].where.endswith("line 3")
        assert scan.source is not None and not scan.source.unit_stated

    def test_two_units_are_refused(self, tmp_path: Path) -> None:
        path = write(tmp_path, text(ROWS, comment="comment unit mm\ncomment unit m\n"))
        with pytest.raises(FormatError, match="states the unit m, another one in line 3 mm") as caught:
            read_scan(path)
        assert caught.value.line == 4


NAN_ROWS = [ROWS[0], "nan 1 2", *ROWS[1:], "1 inf 0"]
QUADS = ["4 0 2 4 3", "3 0 1 2", "3 0 2 99"]


class TestRecover:
    """Each file is refused without `recover`, with a message that names it, and repaired with it."""

    @pytest.mark.parametrize(
        ("content", "place", "word", "found"),
        [
            (text(NAN_ROWS, vertices=6), "line 9", "nan 1 2 is not finite", [(164, "warn")]),
            (text(ROWS, vertices=9), "line 3", "declares 9 rows, 4 present", [(163, "warn")]),
            (text([*ROWS, "10.0 20"], vertices=5)[:-1], "line 12", "2 columns", [(163, "warn")]),
            (binary(POINTS.astype("<f4").tobytes() + b"\0" * 7, vertices=6), "byte 115", "6 x 12 B", [(163, "warn")]),
        ],
    )
    def test_points(self, tmp_path: Path, content: bytes, place: str, word: str, found: list[tuple[int, str]]) -> None:
        path = write(tmp_path, content)
        with pytest.raises(FormatError, match=word) as caught:
            read_scan(path)
        assert f"{place}:" in str(caught.value)
        if "columns" not in word:
            assert "--recover" in str(caught.value)
        scan = read_scan(path, recover=True)
        assert np.array_equal(scan.points_mm, POINTS)
        assert scan.normals is None and codes(scan) == found

    def test_normals_in_part_are_ignored(self, tmp_path: Path) -> None:
        path = write(tmp_path, text([f"{row} 1" for row in ROWS], more="property float nx\n"))
        with pytest.raises(FormatError, match="line 3: the normals have only nx; export all or none, or repair"):
            read_scan(path)
        scan = read_scan(path, recover=True)
        assert scan.normals is None and not scan.columns and codes(scan) == [(166, "warn")]

    def test_points_that_are_not_finite_are_counted(self, tmp_path: Path) -> None:
        (finding,) = read_scan(write(tmp_path, text(NAN_ROWS, vertices=6)), recover=True).findings
        assert finding.message == "2 of 6 points are not finite and were dropped"
        assert finding.where.endswith("scan.ply, line 9")

    def test_faces_on_dropped_points_and_faces_that_point_nowhere_go(self, tmp_path: Path) -> None:
        path = write(tmp_path, text([*NAN_ROWS, *QUADS], vertices=6, more=FACES.format(3)))
        with pytest.raises(FormatError, match="--recover"):
            read_scan(path)
        scan = read_scan(path, recover=True)
        assert np.array_equal(scan.points_mm, POINTS)
        assert scan.faces is not None and scan.faces.tolist() == [[0, 1, 3], [0, 3, 2]]
        assert codes(scan) == [(164, "warn"), (165, "warn"), (103, "info"), (165, "warn")]
        assert [each.message[:7] for each in scan.findings if each.code == 165] == ["1 of 3 ", "1 trian"]

    def test_columns_and_normals_go_with_their_points(self, tmp_path: Path) -> None:
        more = "property float nx\nproperty float ny\nproperty float nz\nproperty uchar q\n"
        rows = [f"{row} 0 0 1 {index}" for index, row in enumerate(NAN_ROWS)]
        rows[2] = rows[2].replace(" 0 0 1 ", " nan 0 1 ")
        scan = read_scan(write(tmp_path, text(rows, vertices=6, more=more)), recover=True)
        assert scan.columns["q"].tolist() == [0, 2, 3, 4]
        assert scan.normals is not None and scan.normals.tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 1], [0, 0, 1]]
        assert codes(scan) == [(164, "warn"), (155, "warn")]

    @pytest.mark.parametrize("lengths", [(3, 3, 3), (3, 4, 3)])
    def test_faces_that_are_cut_short(self, tmp_path: Path, lengths: tuple[int, ...]) -> None:
        corners = [struct.pack(f"<B{length}i", length, *[0, 1, 3, 2][:length]) for length in lengths]
        content = binary(POINTS.astype("<f4").tobytes() + b"".join(corners)[:-2], more=FACES.format(3))
        path = write(tmp_path, content)
        with pytest.raises(FormatError, match="--recover"):
            read_scan(path)
        scan = read_scan(path, recover=True)
        assert scan.faces is not None and len(scan.faces) == sum(lengths[:2]) - 4
        (finding,) = [each for each in scan.findings if each.code == 163]
        assert finding.message == "element face declares 3 rows, only the first 2 are there"
        assert finding.where.endswith(f"byte {len(content) - len(corners[2]) + 2}")

    def test_a_file_cut_before_its_faces_is_a_cloud(self, tmp_path: Path) -> None:
        path = write(tmp_path, binary(POINTS.astype("<f4").tobytes(), more=FACES.format(3)))
        scan = read_scan(path, recover=True)
        assert scan.faces is None and codes(scan) == [(163, "warn")]
        with pytest.raises(FormatError, match="a part needs a mesh"):
            read_part(path, recover=True)

    def test_the_last_number_of_a_cut_line_is_not_trusted(self, tmp_path: Path) -> None:
        path = write(tmp_path, text([*ROWS, "1.0 2.0 3.14159", "1 2 3"], vertices=6)[:-10])
        scan = read_scan(path, recover=True)
        assert np.array_equal(scan.points_mm, POINTS)
        assert scan.findings[0].message == "element vertex declares 6 rows, only the first 4 are there"

    def test_a_sound_file_has_nothing_to_repair(self) -> None:
        for name in ("columns.ply", "tristrips.ply", "lists_at_vertices.ply"):
            strict, repaired = read_scan(CORPUS / name), read_scan(CORPUS / name, recover=True)
            assert np.array_equal(strict.points_mm, repaired.points_mm) and codes(strict) == codes(repaired)

    @pytest.mark.parametrize(
        "change",
        [
            lambda rows: [*rows[:1], "1_0 0 0", *rows[2:]],
            lambda rows: [*rows[:1], "1,5 0 0", *rows[2:]],
            lambda rows: [*rows[:1], "1 0", *rows[2:]],
        ],
    )
    def test_what_is_no_number_stays_refused(self, tmp_path: Path, change: Callable[[list[str]], list[str]]) -> None:
        with pytest.raises(FormatError, match="line 9"):
            read_scan(write(tmp_path, text(change(ROWS))), recover=True)


class TestFaces:
    def test_strips_and_faces_together(self, tmp_path: Path) -> None:
        more = FACES.format(1) + "element tristrips 2\nproperty list int int vertex_indices\n"
        rows = [*ROWS, "3 0 1 2", "3 0 1 2", "5 1 3 3 2 0"]
        scan = read_scan(write(tmp_path, text(rows, more=more)))
        assert scan.faces is not None
        assert scan.faces.tolist() == [[0, 1, 2], [0, 1, 2], [3, 2, 0]]

    def test_a_long_strip_is_no_polygon(self, tmp_path: Path) -> None:
        grid = np.array([[x, y, 0.0] for x in range(1500) for y in range(2)])
        more = "element tristrips 1\nproperty list int int vertex_indices\n"
        body = grid.astype("<f4").tobytes() + struct.pack("<i", 3000) + np.arange(3000, dtype="<i4").tobytes()
        path = write(tmp_path, binary(body, vertices=3000, more=more))
        scan = read_scan(path)
        assert scan.faces is not None and len(scan.faces) == 2998
        a, b, c = scan.points_mm[scan.faces].transpose(1, 0, 2)
        turns = np.cross(b - a, c - a)[:, 2]
        assert (turns > 0).all() or (turns < 0).all()
        with pytest.raises(FormatError, match="limit faces = 2000"):
            read_scan(path, limits=Limits(faces=2000))

    def test_strips_that_point_nowhere_are_refused(self, tmp_path: Path) -> None:
        more = "element tristrips 1\nproperty list int int vertex_indices\n"
        path = write(tmp_path, text([*ROWS, "5 0 1 2 -2 3"], more=more))
        with pytest.raises(FormatError, match="vertex -2") as caught:
            read_scan(path)
        assert caught.value.line == 14

    def test_columns_of_merged_vertices_are_those_of_the_first(self, tmp_path: Path) -> None:
        rows = ["0 0 0 1", "1 0 0 2", "0 1 0 3", "1 0 0 4", "1 1 0 5", "0 1 0 6", "3 0 1 2", "3 3 4 5"]
        more = "property uchar q\n" + FACES.format(2)
        scan = read_scan(write(tmp_path, text(rows, vertices=6, more=more)))
        assert scan.columns["q"].tolist() == [1, 2, 3, 5]


class TestPart:
    def test_a_mesh_is_a_part_without_contours(self) -> None:
        part = read_part(CORPUS / "faces_first_big_endian.ply")
        assert part.contours == ()
        assert np.array_equal(part.mesh.vertices_mm, POINTS)
        assert part.mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
        assert part.source is not None and part.source.format == "PLY"

    def test_points_are_no_part(self) -> None:
        with pytest.raises(FormatError, match="a part needs a mesh; export") as caught:
            read_part(CORPUS / "columns.ply")
        assert "columns.ply" in str(caught.value)

    @pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
    def test_written_and_read_is_the_same(self, tmp_path: Path, encoding: str) -> None:
        part = read_part(CORPUS / "tristrips.ply", units="mm")
        again = read_part(write(tmp_path, write_part(part, encoding=encoding)))  # type: ignore[arg-type]
        assert np.array_equal(again.mesh.vertices_mm, part.mesh.vertices_mm)
        assert np.array_equal(again.mesh.faces, part.mesh.faces)
        assert again.source is not None and again.source.unit_stated

    def test_contours_alone_are_refused(self) -> None:
        contour = Contour(POINTS, np.tile([1.0, 0, 0], (4, 1)), np.tile([0, 0, 1.0], (4, 1)))
        empty = TriangleMesh(POINTS, np.zeros((0, 3), np.int64))
        with pytest.raises(JobError, match="no triangles"):
            write_part(Part((contour,), empty))


class TestWriter:
    def test_units_are_stated_and_applied(self, tmp_path: Path) -> None:
        path = write(tmp_path, write_scan(Scan(POINTS), unit="inch"))
        assert b"comment unit inch\n" in path.read_bytes()
        scan = read_scan(path)
        assert np.allclose(scan.points_mm, POINTS, rtol=0, atol=1e-14)
        assert scan.source is not None and scan.source.unit == "inch"
        with pytest.raises(UnitError, match="furlong"):
            write_scan(Scan(POINTS), unit="furlong")

    def test_names_of_columns_become_words(self, tmp_path: Path) -> None:
        values = np.array([0.1, np.nan, 1e300, -0.0])
        scan = Scan(POINTS, columns={"Range [m]": values, "größe": values})
        again = read_scan(write(tmp_path, write_scan(scan)))
        assert list(again.columns) == ["Range_[m]", "größe"]
        assert np.array_equal(again.columns["größe"], values, equal_nan=True)

    @pytest.mark.parametrize("names", [("x",), ("nx",), ("",), ("a b", "a_b"), ("normal_z",), ("X",)])
    def test_names_that_would_mean_something_else_are_refused(self, names: tuple[str, ...]) -> None:
        with pytest.raises(JobError, match="of a column"):
            write_scan(Scan(POINTS, columns={name: np.zeros(4) for name in names}))

    def test_an_unknown_encoding_is_refused(self) -> None:
        with pytest.raises(JobError, match="encoding: 'utf8' is none of ascii"):
            write_scan(Scan(POINTS), encoding="utf8")  # type: ignore[arg-type]

    def test_a_packed_file_is_recorded_as_it_lies_there(self, tmp_path: Path) -> None:
        path = tmp_path / "scan.PLY.gz"
        path.write_bytes(gzip.compress(write_scan(Scan(POINTS))))
        assert np.array_equal(read_scan(path).points_mm, POINTS)


def test_many_points_of_any_type_are_exact(tmp_path: Path) -> None:
    """More rows than a block, one number type after the other, columns between the coordinates."""
    kinds = ["<f4", "<f8", "<i2", "<u4", "<i1", "<f4", "<f4", "<f4"]
    names = ["y", "x", "z", "label", "q", "nx", "ny", "nz"]
    words = ["float", "double", "short", "uint32", "char", "float32", "float", "float"]
    rows = np.zeros(40_000, list(zip(names, kinds, strict=True)))
    random = np.random.default_rng(1)
    for name in names[:5]:
        rows[name] = random.uniform(-100 if name != "label" else 0, 100, len(rows))
    rows["nz"] = 1.0
    properties = "".join(f"property {word} {name}\n" for word, name in zip(words, names, strict=True))
    scan = read_scan(write(tmp_path, binary(rows.tobytes(), vertices=len(rows), properties=properties)))
    assert np.array_equal(scan.points_mm, np.column_stack([rows["x"], rows["y"], rows["z"]]).astype(float))
    assert np.array_equal(scan.columns["label"], rows["label"]) and np.array_equal(scan.columns["q"], rows["q"])
    assert list(scan.columns) == ["label", "q"]
    rows["x"][35_000] = np.nan
    with pytest.raises(FormatError, match="not finite") as caught:
        read_scan(write(tmp_path, binary(rows.tobytes(), vertices=len(rows), properties=properties)))
    head = len(binary(b"", vertices=len(rows), properties=properties))
    assert caught.value.byte == head + 35_000 * rows.itemsize


class TestManyRowsOfText:
    """Beyond 20000 rows, blocks of rows are read at once."""

    GRID = np.array([[x, y, (x * y) % 7 / 10] for x in range(250) for y in range(100)])
    LINES = tuple(" ".join(map(repr, row)) for row in GRID.tolist())

    @pytest.mark.parametrize(
        ("change", "found"),
        [
            (lambda lines: lines, []),
            (lambda lines: [*lines[:22_000], "", *lines[22_000:]], []),
            (lambda lines: [*lines[:7], "comment seven", *lines[7:]], [111]),
            (lambda lines: [*lines, "3 0 1 2"], [101]),
            (lambda lines: [line + " " for line in lines], []),
            (lambda lines: [line + "\r" for line in lines], []),
        ],
    )
    def test_they_are_the_same(
        self, tmp_path: Path, change: Callable[[list[str]], list[str]], found: list[int]
    ) -> None:
        scan = read_scan(write(tmp_path, text(change(self.LINES), vertices=25_000)))
        assert np.array_equal(scan.points_mm, self.GRID) and [each.code for each in scan.findings] == found

    @pytest.mark.parametrize(("row", "word"), [(3, "1_0 0 0"), (24_999, "1,5 0 0"), (21_000, "nan 0 0"), (9, "0 0")])
    def test_the_line_of_a_bad_row_is_told(self, tmp_path: Path, row: int, word: str) -> None:
        lines = [*self.LINES[:row], word, *self.LINES[row + 1 :]]
        with pytest.raises(FormatError) as caught:
            read_scan(write(tmp_path, text(lines, vertices=25_000)))
        assert caught.value.line == 8 + row

    def test_faces_follow(self, tmp_path: Path) -> None:
        more = FACES.format(2)
        path = write(tmp_path, text([*self.LINES, "3 0 1 200", "3 0 1 25000"], vertices=25_000, more=more))
        with pytest.raises(FormatError, match="vertex 25000") as caught:
            read_scan(path)
        assert caught.value.line == 10 + 25_001


def test_levels_of_repairs_end_a_strict_run(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path, text(NAN_ROWS, vertices=6)), recover=True)
    assert {each.level for each in scan.findings} == {Level.WARN}


def test_rows_that_are_missing_before_others_are_not_made_of_those(tmp_path: Path) -> None:
    head = b"ply\nformat binary_little_endian 1.0\nelement vertex 8\n"
    head += b"property float x\nproperty float y\nproperty float z\n"
    head += b"element face 3\nproperty list uchar int vertex_indices\nend_header\n"
    faces = np.zeros(3, [("count", "u1"), ("corners", "<i4", (3,))])
    faces["count"], faces["corners"] = 3, [[0, 1, 2], [1, 2, 3], [0, 2, 3]]
    file = tmp_path / "scan.ply"
    file.write_bytes(head + np.asarray(POINTS[:4], "<f4").tobytes() + faces.tobytes())
    with pytest.raises(FormatError, match="element vertex declares 8"):
        read_scan(file, recover=True)
