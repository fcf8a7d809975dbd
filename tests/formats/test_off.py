"""OFF: every way to say a mesh gives that mesh, written ones are read again, damaged files are refused or repaired."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Part, Scan, TriangleMesh
from sicp_formats.off import read_part, read_scan, write_part, write_scan

CORPUS = Path(__file__).parents[1] / "corpus" / "off"
VERTICES = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.5], [0.0, 3.0, 0.0]])
FACES = [[0, 1, 2], [0, 2, 3]]
POINTS = "0 0 0\n4 0 0\n4 3 0.5\n0 3 0\n"
MESH = f"OFF\n4 2 0\n{POINTS}3 0 1 2\n3 0 2 3\n"


def write(folder: Path, content: bytes | str) -> Path:
    path = folder / "mesh.off"
    path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(
    "content",
    [
        MESH,
        MESH.replace("\n", "\r\n"),
        MESH.replace("\n", "\r"),
        MESH.replace("\n", "  # note\n\n"),
        "\xef\xbb\xbf# Tr\xe4ger\n" + MESH,
        MESH.replace("OFF\n4 2 0", "off 4 2"),
        MESH.replace("3 0 1 2", "3 00 +1 2"),
    ],
)
def test_every_variant_gives_the_same_mesh(tmp_path: Path, content: str) -> None:
    path = write(tmp_path, content)
    scan, part = read_scan(path), read_part(path)
    for vertices, faces in ((scan.points_mm, scan.faces), (part.mesh.vertices_mm, part.mesh.faces)):
        assert np.array_equal(vertices, VERTICES)
        assert faces is not None and faces.tolist() == FACES
    assert part.contours == () and scan.findings == () and part.findings == () and scan.normals is None


@pytest.mark.parametrize(
    ("name", "columns", "codes"),
    [
        ("mesh.off", "", [103]),
        ("counts_beside.off", "", [110]),
        ("coloured.off", "red green blue alpha", []),
        ("normals.off", "", []),
        ("all.off", "red green blue s t", []),
    ],
)
def test_the_corpus_is_one_mesh(name: str, columns: str, codes: list[int]) -> None:
    scan = read_scan(CORPUS / name)
    assert np.array_equal(scan.points_mm, VERTICES)
    assert scan.faces is not None and scan.faces.tolist() == FACES
    assert list(scan.columns) == columns.split() and [each.code for each in scan.findings] == codes
    if name in ("normals.off", "all.off"):
        assert scan.normals is not None and scan.normals.tolist() == [[0, 0, 1]] * 4
    if "t" in scan.columns:
        assert scan.columns["t"].tolist() == [0, 0, 1, 1] and scan.columns["green"].tolist() == [0.5] * 4


def test_a_file_without_faces_is_a_cloud_and_no_part() -> None:
    scan = read_scan(CORPUS / "cloud.off")
    assert scan.faces is None and np.array_equal(scan.points_mm, VERTICES)
    with pytest.raises(FormatError, match="a part needs a mesh"):
        read_part(CORPUS / "cloud.off")


def test_units(tmp_path: Path) -> None:
    path = write(tmp_path, MESH)
    assert np.array_equal(read_part(path, units="m").mesh.vertices_mm, 1000.0 * VERTICES)
    with pytest.raises(UnitError):
        read_scan(path, units="foot")


@pytest.mark.parametrize("recover", [False, True])
def test_too_many_declared_vertices_are_named(tmp_path: Path, recover: bool) -> None:
    path = write(tmp_path, MESH.replace("4 2 0", "5 2 0"))
    with pytest.raises(FormatError, match=r"line 7: .*declares too many vertices \(5\)"):
        read_scan(path, recover=recover)


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "byte 0", ["empty"]),
        ("# nothing\n", "line 1", ["does not begin with OFF"]),
        (MESH[4:], "line 1", ["does not begin with OFF"]),
        ("OFF BINARY\n\0\0\0\1", "line 1", ["binary kind", "export it as text"]),
        (MESH.replace("OFF", "4OFF"), "line 1", ["not of x y z"]),
        (MESH.replace("OFF", "nOFF"), "line 1", ["not of x y z"]),
        (MESH.replace("OFF\n", "OFF"), "line 1", ["'OFF4'", "line break", "--recover"]),
        (MESH.replace("4 2 0", "4 2 0 0"), "line 2", ["counts"]),
        (MESH.replace("4 2 0", "-4 2 0"), "line 2", ["counts"]),
        (MESH.replace("4 2 0", "4 1_0 0"), "line 2", ["counts"]),
        ("OFF\n", "line 1", ["counts"]),
        (MESH.replace("4 2 0", "353535235358 6 0"), "line 2", ["353535235358 vertices", "707070470728 B", "63 B"]),
        (MESH.replace("4 2 0", "0 0 0"), "line 2", ["0 vertices"]),
        (MESH.replace("4 2 0", "4 3 0"), "line 8", ["declares 3 faces, 2 rows are present", "--recover"]),
        (MESH[:18], "line 4", ["declares 4 vertices, 2 rows are present"]),
        (MESH.replace("4 3 0.5", "4 3 0,5"), "line 5", ["decimal comma"]),
        (MESH.replace("4 3 0.5", "4 3"), "line 5", ["2 columns instead of 3"]),
        (MESH.replace("0 0 0\n4 0 0\n", "0 0 0 1\n4 0 0 1\n"), "line 3", ["4 numbers", "asks for 3"]),
        (MESH.replace("OFF", "COFF"), "line 3", ["3 numbers", "asks for 6 or 7"]),
        (MESH.replace("4 3 0.5", "4 3 nan"), "line 5", ["'nan'"]),
        (MESH.replace("4 3 0.5", "4 3 1e300"), "line 5", ["coordinate_mm"]),
        (MESH.replace("3 0 2 3", "3 0 2 4"), "line 8", ["vertex 4", "there are 4", "--recover"]),
        (MESH.replace("3 0 2 3", "3 0 2 -1"), "line 8", ["vertex -1"]),
        (MESH.replace("3 0 2 3", "3 0 2 3.5"), "line 8", ["'3.5' names no vertex"]),
        (MESH.replace("3 0 2 3", "4 0 2 3"), "line 8", ["not as many corners"]),
        (MESH.replace("3 0 2 3", "3 0 2 3 9 9"), "line 8", ["not as many corners"]),
        (MESH.replace("3 0 2 3", "x 0 2 3"), "line 8", ["not as many corners"]),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "", ["none of the 0 triangles has an area"]),
        ("OFF\n2 0 0\n0 0 0\n1 0 0\n", "", ["2 points cannot register"]),
    ],
)
def test_damaged_files_are_refused_with_their_place(
    tmp_path: Path, content: bytes | str, place: str, words: list[str]
) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    message = str(caught.value)
    assert str(path) in message and f"{place}:" in message and "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize("limits", [Limits(points=3), Limits(faces=1), Limits(list_length=2)])
def test_limits_are_kept(tmp_path: Path, limits: Limits) -> None:
    with pytest.raises(FormatError, match="limit"):
        read_scan(write(tmp_path, MESH), limits=limits)


def test_a_large_count_costs_no_memory(tmp_path: Path) -> None:
    path = write(tmp_path, MESH.replace("4 2 0", "99999999999 2 0"))
    tracemalloc.start()
    for recover in (False, True):
        with pytest.raises(FormatError):
            read_scan(path, recover=recover)
    assert tracemalloc.get_traced_memory()[1] < 10 * 2**20
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("content", "points", "faces", "codes"),
    [
        (MESH.replace("OFF\n", "OFF"), VERTICES, FACES, []),
        (MESH.replace("4 2 0", "4 9 0"), VERTICES, FACES, [163]),
        (MESH[:-3], VERTICES, FACES[:1], [165]),
        (MESH[:-9], VERTICES, None, [163]),
        (MESH.replace("3 0 2 3", "3 0 2 7"), VERTICES, FACES[:1], [165]),
        (MESH.replace("0 3 0", "0 inf 0"), VERTICES[:3], FACES[:1], [164, 165]),
    ],
)
def test_repairs_are_made_on_request_and_told(
    tmp_path: Path, content: str, points: np.ndarray, faces: list[list[int]] | None, codes: list[int]
) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError):
        read_scan(path)
    if content == MESH[:-3]:
        with pytest.raises(FormatError, match="not as many corners"):
            read_scan(path, recover=True)
        return
    scan = read_scan(path, recover=True)
    assert np.array_equal(scan.points_mm, points)
    assert (None if scan.faces is None else scan.faces.tolist()) == faces
    assert [(each.code, each.level) for each in scan.findings] == [(code, Level.WARN) for code in codes]


def test_more_lines_than_declared_are_told(tmp_path: Path) -> None:
    (finding,) = read_scan(write(tmp_path, MESH + "3 0 1 3\n")).findings
    assert (finding.code, finding.level, finding.where[-6:]) == (101, Level.WARN, "line 9")


NUMBER = st.floats(-1e6, 1e6).map(lambda value: value + 0.0)


@given(
    st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=4, max_size=9, unique=True), st.booleans(), st.integers(0, 3)
)
@settings(max_examples=30, deadline=None)
def test_written_scans_are_read_again(
    tmp_path_factory: pytest.TempPathFactory, points: list, mesh: bool, extras: int
) -> None:
    rng = np.random.default_rng(len(points))
    vertices = np.array(points)
    normals = rng.normal(size=vertices.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    names = ("red", "green", "blue", "alpha")[: 4 if extras == 3 else 3] if extras > 1 else ()
    colours = {name: rng.random(len(points)) for name in names}
    faces = np.array([[0, i, i + 1] for i in range(1, len(points) - 1)]) if mesh else None
    path = tmp_path_factory.getbasetemp() / "written.off"
    path.write_bytes(write_scan(Scan(vertices, normals if extras else None, faces, columns=colours)))
    try:
        scan = read_scan(path)
    except FormatError as error:
        assert "on one line" in str(error) or "area" in str(error)
        return
    assert np.array_equal(scan.points_mm, vertices)
    assert (scan.faces is None) == (faces is None)
    assert faces is None or np.array_equal(scan.faces, faces)
    assert (scan.normals is None) == (extras == 0)
    assert scan.normals is None or np.array_equal(scan.normals, normals)
    assert {name: values.tolist() for name, values in scan.columns.items()} == {
        name: values.tolist() for name, values in colours.items()
    }


def test_parts_are_written_in_the_unit_asked_for(tmp_path: Path) -> None:
    part = Part((), TriangleMesh(VERTICES, np.array(FACES)))
    path = write(tmp_path, write_part(part, unit="cm"))
    assert np.array_equal(read_part(path, units="cm").mesh.vertices_mm, VERTICES)
    with pytest.raises(JobError):
        write_part(Part((), TriangleMesh(VERTICES, np.zeros((0, 3), int))))


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_damaged_bytes_are_data_or_a_format_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(sorted(path.name for path in CORPUS.iterdir())))
    content = bytearray((CORPUS / name).read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.off"
    path.write_bytes(bytes(content[: data.draw(st.integers(1, len(content)))]))
    for recover in (False, True):
        try:
            scan = read_scan(path, recover=recover)
        except FormatError as error:
            assert "damaged.off" in str(error) and "\n" not in str(error)
        else:
            assert np.isfinite(scan.points_mm).all()


@pytest.mark.parametrize(("face", "line"), [(b"3 0 1 2.0", 20_020), (b"3 0 1", 20_020), (b"3 0 1 9", 20_020)])
def test_many_faces_are_read_at_once_and_refused_one_by_one(tmp_path: Path, face: bytes, line: int) -> None:
    square = b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    rows = [b"3 0 1 2", b"3 2 3 0"] * 10_010
    path = tmp_path / "mesh.off"
    path.write_bytes(b"OFF\n4 %d 0\n%s" % (len(rows), square) + b"\n".join(rows) + b"\n")
    scan = read_scan(path)
    assert scan.faces is not None and scan.faces[:3].tolist() == [[0, 1, 2], [2, 3, 0], [0, 1, 2]]
    assert len(scan.faces) == len(rows)
    rows[line - 7] = face
    path.write_bytes(b"OFF\n4 %d 0\n%s" % (len(rows), square) + b"\n".join(rows) + b"\n")
    with pytest.raises(FormatError) as caught:
        read_scan(path)
    assert caught.value.line == line
