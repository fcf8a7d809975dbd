"""STEP files of several patches, bodies and units, with known edges; and files that need a repair."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeVertex, BRepBuilderAPI_Sewing
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Controller, STEPControl_StepModelType, STEPControl_Writer
from OCP.TColgp import TColgp_Array2OfPnt
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound

from sicp_cam.contour.mesh_contours import mesh_contours
from sicp_cam.correction import choose_contours
from sicp_cam.errors import CadError, FormatError, InputError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.model import ToolPath
from sicp_formats.cad.step import read_part

CORPUS = Path(__file__).parents[1] / "corpus" / "step"
RADIUS, HOLE, HALF = 800.0, 40.0, 100.0


def write(shape, path: Path, *, products: bool = True) -> Path:
    """Write a file; each shape of a compound is a product, and each solid one of them, or all are one product."""
    STEPControl_Controller.Init_s()
    Interface_Static.SetIVal_s("write.step.assembly", 2 if products else 0)
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    Interface_Static.SetIVal_s("write.step.assembly", 2)
    writer.Write(str(path))
    return path


def together(*shapes):
    whole = TopoDS_Compound()
    BRep_Builder().MakeCompound(whole)
    for shape in shapes:
        BRep_Builder().Add(whole, shape)
    return whole


def shifted(shape, x=0.0, y=0.0, z=0.0):
    motion = gp_Trsf()
    motion.SetTranslation(gp_Vec(x, y, z))
    return shape.Moved(TopLoc_Location(motion))


def faces_of(shape):
    explorer, found = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def codes(part):
    return sorted(finding.code for finding in part.findings)


def said(part, code):
    return next(finding for finding in part.findings if finding.code == code)


@pytest.fixture(scope="module")
def patches():
    """Four patches of one dome of 200 x 200 mm, with a round hole of R 40 across the corner where they meet."""
    ticks = np.linspace(-HALF, HALF, 9)
    grid = TColgp_Array2OfPnt(1, 9, 1, 9)
    for i, x in enumerate(ticks.tolist(), start=1):
        for j, y in enumerate(ticks.tolist(), start=1):
            grid.SetValue(i, j, gp_Pnt(x, y, -(x * x + y * y) / (2 * RADIUS)))
    surface = GeomAPI_PointsToBSplineSurface(grid).Surface()
    u1, u2, v1, v2 = surface.Bounds()
    u, v = (u1 + u2) / 2, (v1 + v2) / 2
    drill = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -50), gp_Dir(0, 0, 1)), HOLE, 100).Shape()
    quarters = [(a, b, c, d) for a, b in ((u1, u), (u, u2)) for c, d in ((v1, v), (v, v2))]
    whole = [BRepBuilderAPI_MakeFace(surface, *quarter, 1e-6).Face() for quarter in quarters]
    return [faces_of(BRepAlgoAPI_Cut(face, drill).Shape())[0] for face in whole]


def assert_outline_and_hole(part):
    outline, hole = part.contours
    for contour in (outline, hole):
        assert contour.closed
        sag = contour.points_mm[:, 2] + np.sum(contour.points_mm[:, :2] ** 2, axis=1) / (2 * RADIUS)
        np.testing.assert_allclose(sag, 0.0, atol=0.02)
        assert np.sign(contour.normals[:, 2]).tolist() == [np.sign(contour.normals[0, 2])] * len(contour.normals)
    assert np.abs(outline.points_mm[:, :2]).max(axis=1) == pytest.approx(HALF, abs=0.03)
    assert len(outline.corners) == 4
    assert np.linalg.norm(hole.points_mm[:, :2], axis=1) == pytest.approx(HOLE, abs=0.03)
    assert len(hole.corners) == 0
    assert len(hole.ring_points_mm) == pytest.approx(2 * hole.length_mm / 4, abs=3)


def test_loose_patches_are_one_skin(patches, tmp_path, in_process):
    part = read_part(write(together(*patches), tmp_path / "loose.step"))
    assert_outline_and_hole(part)
    assert codes(part) == [210, 212, 217]
    assert said(part, 212).level is Level.INFO
    assert "4 seams" in said(part, 212).message
    assert said(part, 217).level is Level.WARN
    assert said(part, 217).message.startswith("4 products of one face each, which have no names of their own")
    assert "part.sew_mm=0" in said(part, 217).message
    assert codes(read_part(write(together(*patches), tmp_path / "one.step", products=False))) == [210, 212]


def test_patches_of_one_shell_are_one_skin_without_sewing(patches, tmp_path, in_process):
    sewing = BRepBuilderAPI_Sewing(1e-4)
    sewing.Add(together(*patches))
    sewing.Perform()
    part = read_part(write(sewing.SewedShape(), tmp_path / "shell.step"))
    assert_outline_and_hole(part)
    assert codes(part) == [210]


def test_patches_with_gaps_are_sewn_within_the_tolerance_only(patches, tmp_path, in_process):
    path = write(together(shifted(patches[0], -0.02, -0.02), *patches[1:]), tmp_path / "gaps.step")
    part = read_part(path)
    assert_outline_and_hole(part)
    assert said(part, 212).level is Level.WARN
    assert float(re.search(r"up to (\S+) mm", said(part, 212).message)[1]) == pytest.approx(0.02, abs=0.01)
    apart = read_part(path, sew_mm=0.0)
    assert len(apart.contours) == 4
    assert codes(apart) == [210] * 4 + [211]
    assert "2 seams" in said(read_part(path, sew_mm=0.01), 212).message
    with pytest.raises(JobError, match="sew_mm = 5 must lie between 0"):
        read_part(path, sew_mm=5.0)


def test_patch_that_faces_the_other_way_is_turned_to_the_others(patches, tmp_path, in_process):
    plain = read_part(write(together(*patches), tmp_path / "plain.step"))
    part = read_part(write(together(patches[0].Reversed(), *patches[1:]), tmp_path / "mixed.step"))
    assert_outline_and_hole(part)
    assert "1 of 4 loose faces" in said(part, 213).message
    up = np.sign(plain.contours[0].normals[0, 2])
    assert np.sign(part.contours[0].normals[0, 2]) == up
    turned = read_part(tmp_path / "mixed.step", turned=True)
    assert_outline_and_hole(turned)
    assert np.sign(turned.contours[0].normals[0, 2]) == -up
    assert (turned.mesh.normals[:, 2] * up < 0).all()


def test_loose_faces_of_a_closed_box_are_a_solid_with_its_outside_outward(tmp_path, in_process):
    faces = faces_of(BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape())
    for number, loose in enumerate((faces, [face.Reversed() for face in faces])):
        part = read_part(write(together(*loose), tmp_path / f"box{number}.step"))
        assert len(part.contours) == 6
        for contour in part.contours:
            assert (contour.points_mm.mean(axis=0) - [30, 20, 10]) @ contour.normals[0] > 0


@pytest.fixture(scope="module")
def three_boxes(tmp_path_factory):
    """Three boxes, the third one 5 m away."""
    boxes = [BRepPrimAPI_MakeBox(60.0, 40.0, height).Shape() for height in (10.0, 20.0, 30.0)]
    whole = together(boxes[0], shifted(boxes[1], 100.0), shifted(boxes[2], 5000.0))
    path = write(whole, tmp_path_factory.mktemp("boxes") / "boxes.step", products=False)
    text = path.read_text()
    for name in ("floor", "wall", "far"):
        text = text.replace("MANIFOLD_SOLID_BREP(''", f"MANIFOLD_SOLID_BREP('{name}'", 1)
    path.write_text(text)
    return path


def test_bodies_are_listed_and_one_can_be_chosen(three_boxes, in_process):
    part = read_part(three_boxes)
    assert len(part.contours) == 18
    listed = said(part, 211).message
    for word in ("3 bodies", "1 'floor' (", "2 'wall' (", "3 'far' (", "part.body"):
        assert word in listed
    for wanted in ("3", "far", " FAR "):
        far = read_part(three_boxes, body=wanted)
        assert len(far.contours) == 6
        assert min(c.points_mm[:, 0].min() for c in far.contours) == pytest.approx(5000.0)
        assert far.mesh.vertices_mm[:, 0].min() == pytest.approx(5000.0)
        assert "1 'floor' (not read)" in said(far, 211).message
    numbers = re.search(r"2 'wall' \(([^)]*)\)", listed)[1]
    first = int(re.match(r"\d+", numbers)[0])
    assert (
        100.0
        <= part.contours[first - 1].points_mm[:, 0].min()
        <= part.contours[first - 1].points_mm[:, 0].max()
        <= 160.0
    )
    for wrong in ("4", "0", "bolt", "", "9" * 400):
        with pytest.raises(CadError, match=r"boxes\.step: has no body .*; it has 1 'floor', 2 'wall', 3 'far'"):
            read_part(three_boxes, body=wrong)


def test_path_chooses_the_contour_of_its_own_body(three_boxes, in_process):
    part = read_part(three_boxes)
    x, y = np.meshgrid([5000.0, 5060.0], [0.0, 40.0])
    corners = np.column_stack([x.ravel(), y.ravel(), np.full(4, 30.0)])[[0, 1, 3, 2, 0]]
    path = ToolPath(corners, np.tile([0.0, 0.0, 1.0], (5, 1)), np.full(5, 500.0), np.zeros(5, bool), np.arange(5))
    ((number, chosen),) = choose_contours(part.contours, path, None, 10.0).items()
    assert part.contours[number - 1] is chosen
    np.testing.assert_allclose(chosen.normals, [[0, 0, 1]] * len(chosen.normals), atol=1e-9)
    assert chosen.points_mm[:, 0].min() == pytest.approx(5000.0)


def test_touching_skins_of_two_products_stay_apart(patches, tmp_path, in_process):
    halves = together(together(*patches[:2]), together(*patches[2:]))
    assert_outline_and_hole(read_part(write(halves, tmp_path / "one.step", products=False)))
    text = write(halves, tmp_path / "two.step").read_text()
    names = iter(["panel", "left", "", "", "right", "Face 1", "Face 2"])
    text = re.sub(r"= PRODUCT\('[^']*',\s*'[^']*'", lambda match: f"= PRODUCT('{(name := next(names))}','{name}'", text)
    (tmp_path / "two.step").write_text(text)
    part = read_part(tmp_path / "two.step")
    assert len(part.contours) == 2
    assert part.contours[0].length_mm == pytest.approx(part.contours[1].length_mm, rel=1e-3)
    assert said(part, 212).message.startswith("2 seams")
    assert re.search(r"2 bodies, .* 1 'left' \(\d\), 2 'right' \(\d\)", said(part, 211).message)
    assert [f.message[:10] for f in part.findings if f.code == 217] == ["2 products"] * 2


@pytest.mark.parametrize(
    ("name", "unit", "factor"),
    [("ap203_mm", "mm", 1.0), ("ap214_inch", "inch", 25.4), ("ap242_m", "m", 1000.0)],
)
def test_seed_of_each_protocol_is_a_triangle_of_30_40_50_mm(name, unit, factor, in_process):
    part = read_part(CORPUS / f"{name}.step")
    (contour,) = part.contours
    assert contour.length_mm == pytest.approx(120.0)
    assert len(contour.corners) == 3
    assert (part.source.unit, part.source.unit_stated) == (unit, True)
    assert codes(part) == [210]


def test_packed_file_is_the_same_part(tmp_path, in_process):
    content = (CORPUS / "ap203_mm.step").read_bytes()
    path = tmp_path / "part.stp.gz"
    path.write_bytes(gzip.compress(content))
    np.testing.assert_array_equal(
        read_part(path).contours[0].points_mm, read_part(CORPUS / "ap203_mm.step").contours[0].points_mm
    )


def test_triangles_only_make_a_mesh_whose_open_edges_are_the_contours(in_process):
    part = read_part(CORPUS / "ap242_triangles_only.step")
    assert part.contours == ()
    assert codes(part) == [216]
    (contour,) = mesh_contours(part.mesh)
    assert contour.length_mm == pytest.approx(120.0, rel=0.02)


def test_assembly_of_other_files_is_refused_with_their_names(tmp_path):
    path = CORPUS / "external_parts.step"
    with pytest.raises(
        FormatError, match=r"byte \d+: is an assembly whose parts are in other files \(bolt\.stp, nut\.stp\)"
    ):
        read_part(path)


def test_other_files_beside_own_shapes_are_noted(tmp_path, in_process):
    text = (CORPUS / "ap203_mm.step").read_text()
    for name, level in (("bolt.stp", Level.WARN), ("drawing.pdf", Level.INFO)):
        path = tmp_path / "mixed.step"
        path.write_text(
            text.replace("DATA;", f"DATA;\n#9001=DOCUMENT_FILE('{name}','',$,#9002,'',$);\n#9002=DOCUMENT_TYPE('');")
        )
        part = read_part(path)
        assert len(part.contours) == 1
        assert (said(part, 214).level, name in said(part, 214).message) == (level, True)


def test_points_alone_are_no_part(tmp_path, in_process):
    path = write(BRepBuilderAPI_MakeVertex(gp_Pnt(1, 2, 3)).Vertex(), tmp_path / "point.step")
    with pytest.raises(InputError, match=r"point\.step: (holds no faces, only 1 points|its shape would be)"):
        read_part(path)


def test_units_of_each_product_are_their_own(tmp_path, in_process):
    """Two triangles in one file, one in mm and one in inch."""
    first = (CORPUS / "ap203_mm.step").read_text()
    second = (CORPUS / "ap214_inch.step").read_text()
    data = second.split("DATA;")[1].split("ENDSEC;")[0]
    moved = re.sub(r"#(\d+)", lambda match: f"#{int(match[1]) + 1000}", data)
    head, tail = first.rsplit("ENDSEC;", 1)
    path = tmp_path / "mixed.step"
    path.write_text(head + moved + "ENDSEC;" + tail)
    part = read_part(path)
    assert [c.length_mm for c in part.contours] == pytest.approx([120.0, 120.0])
    assert (part.source.unit, part.source.unit_stated) == ("inch+mm", True)
    assert 202 in codes(part)
    with pytest.raises(UnitError, match="the file states inch and mm, not mm"):
        read_part(path, units="mm")


def bent(folder: Path) -> Path:
    """Return a box of which one edge leaves its faces by some mm."""
    text = write(BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape(), folder / "bent.step").read_text()
    vector = re.search(r"= LINE\('',#\d+,(#\d+)\)", text)[1]
    direction = re.search(rf"{vector} = VECTOR\('',(#\d+)", text)[1]
    path = folder / "bent.step"
    path.write_text(re.sub(rf"({direction} = DIRECTION\('',\()[^)]*", r"\g<1>1.,1.,1.", text))
    return path


def test_edge_off_its_surface_is_healed_or_left_out(tmp_path, in_process):
    path = bent(tmp_path)
    with pytest.raises(
        CadError, match=r"bent\.step: the edge through .* mm off .*; export it again, or repair it with --recover"
    ):
        read_part(path)
    part = read_part(path, recover=True)
    assert 4 <= len(part.contours) <= 6
    assert {finding.level for finding in part.findings if finding.code >= 250} == {Level.WARN}
    assert {250, 253} & set(codes(part))
    for contour in part.contours:
        assert contour.points_mm.min() >= -0.5
        assert (contour.points_mm.max(axis=0) <= [60.5, 40.5, 20.5]).all()


def test_file_that_is_cut_short_is_read_as_far_as_it_goes(tmp_path, in_process):
    text = write(BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape(), tmp_path / "box.step").read_text()
    path = tmp_path / "cut.step"
    path.write_text(text[: text.rindex("ENDSEC;") - 10])
    with pytest.raises(FormatError, match=r"cut\.step, byte \d+: is cut short .*repair it with --recover"):
        read_part(path)
    part = read_part(path, recover=True)
    assert len(part.contours) == 6
    assert said(part, 254).level is Level.WARN


def test_face_without_its_surface_is_left_out_when_recovering(tmp_path, in_process):
    text = write(BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape(), tmp_path / "box.step").read_text()
    face = re.search(r"ADVANCED_FACE\('',\(#\d+\),(#\d+)", text)
    path = tmp_path / "torn.step"
    path.write_text(text.replace(face.group(), face.group().replace(face[1], "#99999")))
    with pytest.raises(CadError, match=r"torn\.step: is damaged, entity .*repair it with --recover"):
        read_part(path)
    part = read_part(path, recover=True)
    assert {251, 205} <= set(codes(part))
    assert len(part.contours) == 5


def outcome(path, **options):
    try:
        return read_part(path, **options)
    except InputError as error:
        assert "\n" not in str(error)
        return None


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_headers_and_ends_are_data_or_typed_errors(data, tmp_path, in_process):
    """Flips in the entities may crash the kernel, which is what the child process is for; here it is this one."""
    content = bytearray((CORPUS / "ap203_mm.step").read_bytes())
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content) - 1)) :]
    else:
        content[data.draw(st.integers(0, content.index(b"DATA;")))] ^= 1 << data.draw(st.integers(0, 7))
    path = tmp_path / "flipped.step"
    path.write_bytes(bytes(content))
    outcome(path)
