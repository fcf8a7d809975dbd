"""OBJ: every way to say a mesh gives that mesh, written ones are read again, damaged files are refused or repaired."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import Part, Scan, TriangleMesh
from sicp_formats.obj import read_part, read_scan, write_part, write_scan

CORPUS = Path(__file__).parents[1] / "corpus" / "obj"
VERTICES = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.5], [0.0, 3.0, 0.0]])
FACES = [[0, 1, 2], [0, 2, 3]]
POINTS = "v 0 0 0\nv 4 0 0\nv 4 3 0.5\nv 0 3 0\n"
MESH = POINTS + "f 1 2 3\nf 1 3 4\n"
NORMALS = "vn 0 0 1\nvn 0 0 2\nvn 0 1 0\n"


def write(folder: Path, content: bytes | str) -> Path:
    path = folder / "mesh.obj"
    path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(
    "content",
    [
        MESH,
        MESH.replace("\n", "\r\n"),
        MESH.replace("\n", "\r"),
        "\xef\xbb\xbf# Tr\xe4ger\n" + MESH,
        MESH.replace("v ", "v\t").replace("f ", "  f   "),
        MESH.replace("f 1 2 3", "f 1/5/7 2/5/7 3/5/7").replace("f 1 3 4", "f 1/1 3/1/ 4//"),
        MESH.replace("f 1 2 3", "f -4 -3 -2 # back").replace("f 1 3 4", "f +1 3 -1"),
        MESH.replace("f 1 2 3", "f 1 \\\n2 \\\n3"),
        MESH.replace("f 1 3 4", "fo 1 3 4"),
        "f 1 2 3\nf 1 3 4\n" + POINTS,
        "mtllib C:\\parts\\\no part\ng a b\ns 1\nusemtl x\nvt 0 0\nlod 1\n" + MESH,
        "# exported from C:\\\n" + MESH,
    ],
)
def test_every_variant_gives_the_same_mesh(tmp_path: Path, content: str) -> None:
    path = write(tmp_path, content)
    scan, part = read_scan(path), read_part(path)
    for vertices, faces in ((scan.points_mm, scan.faces), (part.mesh.vertices_mm, part.mesh.faces)):
        assert np.array_equal(vertices, VERTICES)
        assert faces is not None and faces.tolist() == FACES
    assert part.contours == () and scan.findings == () and part.findings == () and scan.normals is None
    assert scan.source == part.source and scan.source is not None and not scan.source.unit_stated


@pytest.mark.parametrize(
    ("name", "codes"), [("mesh.obj", [103]), ("relative.obj", [104, 104]), ("curves.obj", [136, 136, 136, 136, 136])]
)
def test_the_corpus_is_one_mesh(name: str, codes: list[int]) -> None:
    scan = read_scan(CORPUS / name)
    assert np.array_equal(scan.points_mm, VERTICES) and not scan.columns
    assert scan.faces is not None and scan.faces.tolist() == FACES
    assert [each.code for each in scan.findings] == codes


def test_a_cloud_has_normals_and_colours_in_order() -> None:
    scan = read_scan(CORPUS / "cloud.obj")
    assert scan.faces is None and np.array_equal(scan.points_mm, VERTICES)
    assert scan.normals is not None
    assert scan.normals.tolist() == [[0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    assert {name: values.tolist() for name, values in scan.columns.items()} == {
        "red": [1, 0, 0, 0.5],
        "green": [0, 1, 0, 0.5],
        "blue": [0, 0, 1, 0.5],
    }
    with pytest.raises(FormatError, match="a part needs a mesh"):
        read_part(CORPUS / "cloud.obj")


def test_normals_of_corners_are_averaged_at_their_vertex(tmp_path: Path) -> None:
    text = POINTS + NORMALS + "f 1//1 2//2 3//-1\nf 1//3 3//3 4//1\n"
    scan = read_scan(write(tmp_path, text))
    half = np.sqrt(0.5)
    assert scan.normals is not None
    np.testing.assert_allclose(scan.normals, [[0, half, half], [0, 0, 1], [0, 1, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize("text", [MESH + NORMALS, POINTS + NORMALS, POINTS + NORMALS + "f 1//1 2//2 3\n"])
def test_normals_that_not_every_point_has_are_told_of(tmp_path: Path, text: str) -> None:
    scan = read_scan(write(tmp_path, text))
    assert scan.normals is None
    assert [(each.code, each.message[:18]) for each in scan.findings if each.code == 140] == [
        (140, "3 normals were not")
    ]


def test_weights_that_say_something_are_kept_and_told(tmp_path: Path) -> None:
    scan = read_scan(write(tmp_path, POINTS.replace("\n", " 2\n")))
    assert scan.columns["w"].tolist() == [2, 2, 2, 2] and np.array_equal(scan.points_mm, VERTICES)
    assert [(each.code, each.level) for each in scan.findings] == [(139, Level.WARN)]


def test_equal_vertices_are_merged_with_their_columns(tmp_path: Path) -> None:
    text = (
        "v 0 0 0 1 0 0\nv 4 0 0 0 1 0\nv 4 3 1 0 0 1\nv 0 0 0 0 0 0\nv 4 3 1 1 1 1\nv 0 3 0 1 1 0\nf 1 2 3\nf 4 5 6\n"
    )
    scan = read_scan(write(tmp_path, text))
    assert scan.faces is not None and scan.faces.tolist() == FACES
    assert scan.columns["red"].tolist() == [1, 0, 0, 1]
    assert [each.code for each in scan.findings] == [107]


def test_units(tmp_path: Path) -> None:
    path = write(tmp_path, MESH)
    assert np.array_equal(read_part(path, units="m").mesh.vertices_mm, 1000.0 * VERTICES)
    with pytest.raises(UnitError):
        read_scan(path, units="foot")


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "byte 0", ["empty"]),
        ("# nothing\n", "line 1", ["no vertices"]),
        (MESH + "junk 1\n", "line 7", ["unknown statement 'junk'"]),
        (MESH.replace("4 3 0.5", "4 3 0,5"), "line 3", ["decimal comma"]),
        (MESH.replace("4 3 0.5", "4 3"), "line 3", ["2 columns instead of 3"]),
        (MESH.replace("4 3 0.5", "4 3 O"), "line 3", ["'O'"]),
        (MESH.replace("4 3 0.5", "4 3 nan"), "line 3", ["'nan'"]),
        (MESH.replace("4 3 0.5", "4 3 1e400"), "line 3", ["'1e400'"]),
        (MESH.replace("4 3 0.5", "4 3 1e300"), "line 3", ["coordinate_mm"]),
        (POINTS.replace("\n", " 1 1 1 1\n"), "line 1", ["7 numbers", "x y z red green blue"]),
        (MESH.replace("f 1 3 4", "f 1 3 5"), "line 6", ["vertex 5", "there are 4", "--recover"]),
        (MESH.replace("f 1 3 4", "f 1 3 0"), "line 6", ["vertex 0"]),
        (MESH.replace("f 1 3 4", "f 1 3 -5"), "line 6", ["vertex -5"]),
        (MESH.replace("f 1 3 4", "f 1 3 4.5"), "line 6", ["'4.5' names no vertex"]),
        (MESH.replace("f 1 3 4", "f 1 3 /4"), "line 6", ["'/4' names no vertex"]),
        (MESH.replace("f 1 3 4", "f 1 3 4/1/1/1"), "line 6", ["'4/1/1/1'"]),
        (MESH.replace("f 1 3 4", "f 1 3 9999999999999999999"), "line 6", ["names no vertex"]),
        (MESH + "vn 0 0 inf\n", "line 7", ["'inf'"]),
        (POINTS + "vn 0 0 1\nf 1//1 2//1 3//2\n", "line 6", ["normal 2", "there are 1"]),
        (POINTS + "f 1 2 2\n", "", ["none of the 1 triangles has an area"]),
        (POINTS + "f 1 2\n", "", ["none of the 0 triangles has an area"]),
        (MESH + "v 1 2 \\\n", "line 7", ["cut short"]),
        ("v 0 0 0\nv 1 0 0\n", "", ["2 points cannot register"]),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\n", "", ["on one line"]),
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
        read_scan(write(tmp_path, MESH.replace("f 1 3 4", "f 0001 0003 0004")), limits=limits)


@pytest.mark.parametrize(
    ("content", "points", "faces", "codes"),
    [
        (MESH.replace("f 1 3 4", "f 1 3 9"), VERTICES, FACES[:1], [165]),
        (MESH.replace("v 0 3 0", "v 0 nan 0"), VERTICES[:3], FACES[:1], [164, 165]),
        (POINTS + "v nan nan nan\n", VERTICES, None, [164]),
        (POINTS + "vn 0 0 inf\n" + "vn 0 0 1\n" * 3, VERTICES, None, [166]),
        (POINTS + "vn 0 0 1\nf 1//1 2//1 3//2\nf 1//1 3//1 4//1\n", VERTICES, FACES, [140]),
    ],
)
def test_repairs_are_made_on_request_and_told(
    tmp_path: Path, content: str, points: np.ndarray, faces: list[list[int]] | None, codes: list[int]
) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FormatError):
        read_scan(path)
    scan = read_scan(path, recover=True)
    assert np.array_equal(scan.points_mm, points)
    assert (None if scan.faces is None else scan.faces.tolist()) == faces
    found = [(each.code, each.level) for each in scan.findings if each.code != 108]
    assert found == [(code, Level.INFO if code == 140 else Level.WARN) for code in codes]


NUMBER = st.floats(-1e6, 1e6).map(lambda value: value + 0.0)


@given(st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=4, max_size=9, unique=True), st.booleans(), st.booleans())
@settings(max_examples=30, deadline=None)
def test_written_scans_are_read_again(
    tmp_path_factory: pytest.TempPathFactory, points: list, mesh: bool, coloured: bool
) -> None:
    rng = np.random.default_rng(len(points))
    vertices = np.array(points)
    normals = rng.normal(size=vertices.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[-1] = 0.0
    colours = {name: rng.random(len(points)) for name in ("red", "green", "blue")} if coloured else {}
    faces = np.array([[0, i, i + 1] for i in range(1, len(points) - 1)]) if mesh else None
    path = tmp_path_factory.getbasetemp() / "written.obj"
    path.write_bytes(write_scan(Scan(vertices, normals, faces, columns=colours)))
    try:
        scan = read_scan(path)
    except FormatError as error:
        assert "on one line" in str(error) or "area" in str(error)
        return
    assert np.array_equal(scan.points_mm, vertices)
    assert (scan.faces is None) == (faces is None)
    assert faces is None or np.array_equal(scan.faces, faces)
    assert scan.normals is not None
    np.testing.assert_allclose(scan.normals, normals, atol=1e-15)
    assert {name: values.tolist() for name, values in scan.columns.items()} == {
        name: values.tolist() for name, values in colours.items()
    }


def test_parts_are_written_in_the_unit_asked_for(tmp_path: Path) -> None:
    part = Part((), TriangleMesh(VERTICES, np.array(FACES)))
    path = write(tmp_path, write_part(part, unit="cm"))
    assert np.array_equal(read_part(path, units="cm").mesh.vertices_mm, VERTICES)
    with pytest.raises(JobError):
        write_part(Part((), TriangleMesh(VERTICES, np.zeros((0, 3), int))))


def test_colours_up_to_255_are_written_from_0_to_1(tmp_path: Path) -> None:
    colours = {name: np.array([0.0, 51.0, 255.0, 102.0]) for name in ("red", "green", "blue")}
    scan = read_scan(write(tmp_path, write_scan(Scan(VERTICES, columns=colours))))
    np.testing.assert_allclose(scan.columns["green"], [0.0, 0.2, 1.0, 0.4])


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_damaged_bytes_are_data_or_a_format_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(sorted(path.name for path in CORPUS.iterdir())))
    content = bytearray((CORPUS / name).read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.obj"
    path.write_bytes(bytes(content[: data.draw(st.integers(1, len(content)))]))
    for recover in (False, True):
        try:
            scan = read_scan(path, recover=recover)
        except FormatError as error:
            assert "damaged.obj" in str(error) and "\n" not in str(error)
        else:
            assert np.isfinite(scan.points_mm).all()
