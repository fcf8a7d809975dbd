"""The STEP reader against shapes whose edges are known, and against files that are damaged on purpose."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import cadquery as cq
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.child_process import ChildCrashError
from sicp_cam.errors import CadError, FormatError, InputError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_formats.cad import child as step_child
from sicp_formats.cad import part as cad_part
from sicp_formats.cad import step
from sicp_formats.cad.faces import bodies
from sicp_formats.cad.mesh import signed_volume, tessellate
from sicp_formats.cad.notes import Notes, as_findings
from sicp_formats.cad.step import read_part

MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
METRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )"
INCH = """( CONVERSION_BASED_UNIT('INCH',#90001) LENGTH_UNIT() NAMED_UNIT(#90003) );
#90001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#90002);
#90002 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );
#90003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)"""


def write(shape, path: Path) -> Path:
    cq.exporters.export(cq.Workplane(obj=shape) if not isinstance(shape, cq.Workplane) else shape, str(path))
    return path


@pytest.fixture(scope="module")
def plate_file(tmp_path_factory) -> Path:
    plate = cq.Workplane().box(400, 400, 2).faces(">Z").workplane().circle(100).cutThruAll()
    return write(plate, tmp_path_factory.mktemp("plate") / "plate.step")


@pytest.fixture(scope="module")
def block_file(tmp_path_factory) -> Path:
    """A block of 2 x 1.5 x 0.1 in whatever unit."""
    return write(cq.Solid.makeBox(2, 1.5, 0.1), tmp_path_factory.mktemp("block") / "block.step")


@pytest.fixture(scope="module")
def plate(plate_file):
    """The plate, read as a user reads it: in a process of its own."""
    return read_part(plate_file)


@pytest.fixture
def altered(plate_file, tmp_path):
    """Return a function that writes the plate's file with some text replaced."""

    def alter(*replacements: tuple[str, str], count: int = -1) -> Path:
        text = plate_file.read_text()
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new, count)
        path = tmp_path / "altered.step"
        path.write_text(text)
        return path

    return alter


def facing(part, normal, length: float):
    """Return the one contour whose normals all have this direction and whose length is about this."""
    found = [
        c
        for c in part.contours
        if np.allclose(c.normals, normal, atol=1e-9) and c.length_mm == pytest.approx(length, rel=1e-3)
    ]
    assert len(found) == 1
    return found[0]


def inward(contour):
    return np.cross(contour.normals, contour.tangents)


def steps(contour):
    points = np.vstack([contour.points_mm, contour.points_mm[:1]]) if contour.closed else contour.points_mm
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def smooth_samples(contour):
    return np.setdiff1d(np.arange(len(contour.points_mm)), contour.corners)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_hole_in_a_plate_is_exact(plate, side):
    hole = facing(plate, [0, 0, side], 2 * np.pi * 100)
    assert hole.closed
    assert hole.length_mm == pytest.approx(2 * np.pi * 100, rel=1e-4)
    np.testing.assert_allclose(np.linalg.norm(hole.points_mm[:, :2], axis=1), 100.0, atol=1e-6)
    np.testing.assert_allclose(hole.points_mm[:, 2], side, atol=1e-6)
    outward_from_centre = hole.points_mm / [100, 100, np.inf]
    np.testing.assert_allclose(inward(hole), outward_from_centre, atol=1e-6)
    assert len(hole.corners) == 0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_outline_of_a_plate_has_its_four_corners(plate, side):
    outline = facing(plate, [0, 0, side], 1600.0)
    assert outline.length_mm == pytest.approx(1600.0, abs=1e-6)
    corners = outline.points_mm[outline.corners]
    assert {tuple(np.round(p, 6)) for p in corners} == {(x, y, side) for x in (-200, 200) for y in (-200, 200)}
    np.testing.assert_allclose(inward(outline)[outline.corners], -corners / [283, 283, np.inf], atol=1e-3)
    smooth = smooth_samples(outline)
    into = outline.points_mm[smooth] + 0.5 * inward(outline)[smooth]
    assert np.abs(into[:, :2]).max(axis=1).tolist() == pytest.approx([199.5] * len(smooth))


def test_walls_of_a_plate_are_contours_of_their_own(plate):
    lengths = sorted((round(c.length_mm) for c in plate.contours), reverse=True)
    assert lengths == [1600] * 2 + [804] * 4 + [628] * 4
    assert [c.length_mm for c in plate.contours] == sorted((c.length_mm for c in plate.contours), reverse=True)
    wall = [c for c in plate.contours if round(c.length_mm) == 628 and abs(c.normals[0, 2]) < 0.5]
    for contour in wall:
        np.testing.assert_allclose(contour.normals, -contour.points_mm / [100, 100, np.inf], atol=1e-6)
        np.testing.assert_allclose(inward(contour)[:, 2], -np.sign(contour.points_mm[:, 2]), atol=1e-6)


def test_samples_are_dense_and_never_doubled(plate):
    for contour in plate.contours:
        assert steps(contour).max() <= 1.0
        assert steps(contour).min() > 1e-3
        np.testing.assert_allclose(np.linalg.norm(contour.tangents, axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(contour.normals, axis=1), 1.0, atol=1e-12)
        ahead = np.roll(contour.points_mm, -1, axis=0) - contour.points_mm
        assert (np.sum(ahead * contour.tangents, axis=1) > 0).all()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_stability_points_lie_on_the_same_skin(plate, side):
    hole = facing(plate, [0, 0, side], 2 * np.pi * 100)
    np.testing.assert_allclose(hole.ring_points_mm[:, 2], side, atol=1e-9)
    np.testing.assert_allclose(hole.ring_normals, np.tile([0, 0, side], (len(hole.ring_normals), 1)), atol=1e-9)
    radii = np.linalg.norm(hole.ring_points_mm[:, :2], axis=1)
    near, far = np.isclose(radii, 110, atol=1e-5), np.isclose(radii, 130, atol=1e-5)
    assert (near | far).all()
    assert near.sum() == far.sum() == round(2 * np.pi * 100 / 4)


def test_stability_points_that_fall_off_are_left_out(plate):
    for contour in plate.contours:
        if round(contour.length_mm) == 628 and abs(contour.normals[0, 2]) < 0.5:  # a wall that is 2 mm high
            assert len(contour.ring_points_mm) == 0


def test_source_and_mesh_of_a_plate(plate, plate_file):
    assert (plate.source.path, plate.source.format) == (str(plate_file), "STEP")
    assert (plate.source.unit, plate.source.unit_stated) == ("mm", True)
    assert plate.findings == ()
    corners = plate.mesh.vertices_mm[plate.mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(
        2 * (160000 - np.pi * 1e4) + 3200 + 400 * np.pi, rel=1e-3
    )
    assert (np.sum(across * plate.mesh.normals[plate.mesh.faces[:, 0]], axis=1) > 0).all()
    volume = np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(2 * (160000 - np.pi * 1e4), rel=1e-3)


@pytest.fixture(scope="module")
def shell_file(tmp_path_factory) -> Path:
    """A quarter of a pipe, R 497 to 500, 600 long along y, with a round hole of R 80 drilled radially at its middle."""
    outer, inner = (cq.Workplane("XZ").circle(r).extrude(600) for r in (500, 497))
    corner = cq.Workplane("XZ").polyline([(0, 0), (700, 0), (700, 700), (0, 700)]).close().extrude(600)
    drill = cq.Workplane(cq.Plane((0, -300, 0), (0, 1, 0), (1, 0, 1))).circle(80).extrude(800)
    return write(outer.cut(inner).intersect(corner).cut(drill), tmp_path_factory.mktemp("shell") / "shell.step")


def test_curved_panel_with_a_hole(shell_file, in_process):
    part = read_part(shell_file)
    axis = np.array([1, 0, 1]) / np.sqrt(2)
    middle = 500 * axis + [0, -300, 0]
    for radius, sign in ((500, 1), (497, -1)):
        radial = [c.points_mm * [1, 0, 1] / radius for c in part.contours]
        on_skin = [c for c, n in zip(part.contours, radial, strict=True) if np.allclose(c.normals, sign * n, atol=1e-6)]
        assert len(on_skin) == 2
        outline, hole = on_skin
        assert outline.length_mm == pytest.approx(1200 + np.pi * radius, rel=1e-4)
        assert len(outline.corners) == 4
        off_axis = hole.points_mm - middle
        off_axis -= np.outer(off_axis @ axis, axis)
        np.testing.assert_allclose(np.linalg.norm(off_axis, axis=1), 80.0, atol=1e-3)
        assert (np.sum(inward(hole) * off_axis, axis=1) > 70).all()
        assert len(hole.corners) == 0
        for contour in (outline, hole):
            ring = contour.ring_points_mm
            np.testing.assert_allclose(np.hypot(ring[:, 0], ring[:, 2]), radius, atol=1e-6)
            np.testing.assert_allclose(contour.ring_normals, sign * ring * [1, 0, 1] / radius, atol=1e-6)
        assert len(hole.ring_points_mm) == pytest.approx(hole.length_mm / 2, abs=2)


def test_faces_that_split_a_hole_are_joined(plate, tmp_path, in_process):
    halves = [cq.Workplane().box(200, 400, 2).translate((x, 0, 0)).val() for x in (-100, 100)]
    glued = cq.Workplane(obj=halves[0].fuse(halves[1])).cut(
        cq.Workplane().circle(100).extrude(10, both=True), clean=False
    )
    assert glued.faces(">Z").size() == 2
    part = read_part(write(glued, tmp_path / "split.step"))
    assert len(part.contours) == len(plate.contours)
    for length in (1600.0, 2 * np.pi * 100):
        whole, split = facing(plate, [0, 0, 1], length), facing(part, [0, 0, 1], length)
        assert split.closed
        assert split.length_mm == pytest.approx(whole.length_mm, rel=1e-4)
        assert len(split.corners) == len(whole.corners)
        assert len(split.ring_points_mm) == pytest.approx(len(whole.ring_points_mm), abs=4)
    hole = facing(part, [0, 0, 1], 2 * np.pi * 100)
    radii = np.linalg.norm(hole.ring_points_mm[:, :2], axis=1)
    assert set(np.round(radii, 4)) == {110.0, 130.0}


@pytest.mark.parametrize(
    ("solid", "lengths"),
    [
        (cq.Solid.makeCylinder(50, 120), [314.16] * 4),
        (cq.Solid.makeCone(50, 20, 100), [314.16] * 2 + [125.66] * 2),
        (cq.Solid.makeCone(50, 0, 100), [314.16] * 2),
        (cq.Solid.makeSphere(50, angleDegrees1=0, angleDegrees2=90), [314.16] * 2),
        (cq.Solid.makeTorus(80, 20), []),
    ],
    ids=["cylinder", "frustum", "cone", "hemisphere", "torus"],
)
def test_seams_and_poles_are_no_boundary(solid, lengths, tmp_path, in_process):
    part = read_part(write(solid, tmp_path / "round.step"))
    assert [round(c.length_mm, 1) for c in part.contours] == [round(length, 1) for length in lengths]
    assert all(c.closed and len(c.corners) == 0 for c in part.contours)
    assert np.isfinite(part.mesh.normals).all()


def test_fillets_are_sampled_finer_and_are_no_corners(tmp_path, in_process):
    pocket = cq.Workplane().rect(60, 40).extrude(2, both=True).edges("|Z").fillet(3)
    part = read_part(write(cq.Workplane().box(100, 100, 2).cut(pocket), tmp_path / "pocket.step"))
    straight, turn = 2 * (54 + 34), 2 * np.pi * 3
    hole = facing(part, [0, 0, 1], straight + turn)
    assert len(hole.corners) == 0
    chords = np.roll(hole.points_mm, -1, axis=0) - hole.points_mm
    chords /= np.linalg.norm(chords, axis=1, keepdims=True)
    cosines = np.sum(chords * np.roll(chords, -1, axis=0), axis=1)
    assert np.degrees(np.arccos(cosines.clip(-1, 1))).max() <= 5.0 + 1e-6
    # The chord of a circle of radius 3 mm sags by s^2 / (8 * 3).
    on_fillet = np.linalg.norm(hole.tangents[:, :2] - np.roll(hole.tangents[:, :2], -1, axis=0), axis=1) > 1e-6
    assert (steps(hole)[on_fillet] ** 2 / 24).max() <= 0.002


def test_edge_within_the_angle_joins_and_beyond_it_does_not(tmp_path, in_process):
    def tent(angle_deg: float):
        rise = 100 * np.tan(np.radians(angle_deg / 2))
        roof = [(-100, 0), (0, rise), (100, 0), (100, -50), (-100, -50)]
        return cq.Workplane("XZ").polyline(roof).close().extrude(300)

    for angle, contours in ((7.0, 6), (16.0, 7)):
        part = read_part(write(tent(angle), tmp_path / "tent.step"))
        assert len(part.contours) == contours


@pytest.mark.parametrize(("text", "unit", "factor"), [(MILLIMETRE, "mm", 1), (INCH, "inch", 25.4), (METRE, "m", 1000)])
def test_unit_of_the_file_becomes_mm(text, unit, factor, block_file, tmp_path, in_process):
    content = block_file.read_text()
    assert MILLIMETRE in content
    path = tmp_path / "block.step"
    path.write_text(content.replace(MILLIMETRE, text))
    part = read_part(path, units=None if unit == "mm" else unit)
    assert (part.source.unit, part.source.unit_stated, part.findings) == (unit, True, ())
    size = np.array([2.0, 1.5, 0.1]) * factor
    np.testing.assert_allclose(np.ptp(part.mesh.vertices_mm, axis=0), size, rtol=1e-9)
    np.testing.assert_allclose(np.ptp(np.vstack([c.points_mm for c in part.contours]), axis=0), size, rtol=1e-9)
    facing(part, [0, 0, 1], 7.0 * factor)


def test_unit_that_contradicts_the_file_is_refused(plate_file, in_process):
    with pytest.raises(UnitError, match=r"plate\.step: the file states mm, not inch"):
        read_part(plate_file, units="inch")
    with pytest.raises(UnitError, match="unknown unit 'furlong'"):
        read_part(plate_file, units="furlong")


def test_file_without_a_unit(block_file, tmp_path, in_process):
    text = re.sub(r"(GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\()#\d+,", r"\1", block_file.read_text())
    assert text != block_file.read_text()
    path = tmp_path / "no_unit.step"
    path.write_text(text)
    assumed = read_part(path)
    assert (assumed.source.unit, assumed.source.unit_stated) == ("mm", False)
    assert [(f.code, f.level) for f in assumed.findings] == [(201, Level.WARN)]
    assert "mm is assumed" in assumed.findings[0].message
    facing(assumed, [0, 0, 1], 7.0)
    stated = read_part(path, units="inch")
    assert (stated.source.unit, stated.source.unit_stated, stated.findings) == ("inch", True, ())
    facing(stated, [0, 0, 1], 7.0 * 25.4)


def test_two_solids_give_all_contours_in_a_stable_order(tmp_path, in_process):
    boxes = [cq.Workplane().box(100, 60, 4).translate((0, y, 0)).val() for y in (0, 100)]
    part = read_part(write(cq.Compound.makeCompound(boxes), tmp_path / "two.step"))
    assert len(part.contours) == 12
    other = read_part(write(cq.Compound.makeCompound(boxes[::-1]), tmp_path / "other.step"))
    for a, b in zip(part.contours, other.contours, strict=True):
        np.testing.assert_allclose(a.normals[0], b.normals[0], atol=1e-9)
        np.testing.assert_allclose(a.points_mm.mean(axis=0), b.points_mm.mean(axis=0), atol=1e-3)


def test_open_shell_is_bounded_by_its_free_edges(tmp_path, in_process):
    faces = [f for f in cq.Workplane().box(100, 60, 40).faces().vals() if f.normalAt().z < 0.5]
    part = read_part(write(cq.Shell.makeShell(faces), tmp_path / "open.step"))
    assert len(part.contours) == 5
    assert [f.code for f in part.findings] == [210]
    rims = [c for c in part.contours if np.isclose(c.points_mm[:, 2], 20).any()]
    assert len(rims) == 4  # each wall has one edge on the rim; the floor has none
    middle = np.zeros(3)
    for contour in part.contours:
        assert ((contour.points_mm.mean(axis=0) - middle) @ contour.normals[0]) > 0


def test_single_face_keeps_its_own_side(tmp_path, in_process):
    face = cq.Face.makePlane(80, 80)
    for number, (shape, up) in enumerate([(face, 1.0), (cq.Face(face.wrapped.Reversed()), -1.0)]):
        part = read_part(write(shape, tmp_path / f"face{number}.step"))
        (contour,) = part.contours
        np.testing.assert_allclose(contour.normals[:, 2], up, atol=1e-12)
        smooth = smooth_samples(contour)
        into = contour.points_mm[smooth] + 0.1 * inward(contour)[smooth]
        assert (np.abs(into[:, :2]) < 40).all()


def test_solid_that_is_inside_out_is_turned(plate_file):
    shape = cq.importers.importStep(str(plate_file)).val().wrapped
    found = bodies(shape)
    meshes, _ = tessellate(shape, found)
    volume = signed_volume(meshes[0])
    assert volume == pytest.approx(2 * (160000 - np.pi * 1e4), rel=1e-3)
    wrong = found[0].turned(), [mesh.turned() for mesh in meshes[0]]
    assert signed_volume(wrong[1]) == pytest.approx(-volume)
    notes = Notes()
    body, turned = step_child._outward(*wrong, 1, notes)
    assert signed_volume(turned) == pytest.approx(volume)
    assert [face.side for face in body.faces] == [face.side for face in found[0].faces]
    assert [row[0] for row in notes.rows()] == [203]


@settings(deadline=None, max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    radius=st.floats(0.5, 35.0),
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1),
    angle=st.floats(-180.0, 180.0),
    shift=st.tuples(*[st.floats(-3000.0, 3000.0)] * 3),
)
def test_any_hole_anywhere_is_exact(radius, axis, angle, shift, tmp_path, in_process):
    plate = cq.Solid.makeBox(80, 80, 5, cq.Vector(-40, -40, -5)).cut(
        cq.Solid.makeCylinder(radius, 9, cq.Vector(0, 0, -7))
    )
    moved = plate.rotate(cq.Vector(), cq.Vector(*axis), angle).translate(cq.Vector(*shift))
    up = Rotation.from_rotvec(np.radians(angle) * np.array(axis) / np.linalg.norm(axis)).apply([0.0, 0.0, 1.0])
    part = read_part(write(moved, tmp_path / "any.step"))
    on_top = [c for c in part.contours if np.allclose(c.normals, up, atol=1e-6)]
    assert len(on_top) == 2
    hole = min(on_top, key=lambda c: c.length_mm)
    offsets = hole.points_mm - shift
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), radius, atol=1e-5)
    np.testing.assert_allclose(inward(hole), offsets / radius, atol=1e-4)
    assert hole.length_mm == pytest.approx(2 * np.pi * radius, rel=2e-3)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"hello", "byte 0: is no STEP file"),
        (b"AC1027\0\0\0", "byte 0: is a DWG drawing"),
        (b"%-72sS      1\n" % b"sent by a friend", "byte 0: is an IGES file"),
        (b"PK\x03\x04....", "byte 0: is a zip archive"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0", "byte 0: is a Git LFS pointer"),
        (b"<!DOCTYPE html><html></html>", "byte 0: is an HTML page"),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=", "byte 39: is cut short"),
        (b"ISO-10303-21;\n#1=CARTESIAN_POINT('',(0.,1.E400,0.));END-ISO-10303-21;", "byte 40: holds the number 1.E400"),
        (b"ISO-10303-21;\n#1=A('%s');END-ISO-10303-21;" % (b"x" * 2_000_000), "byte 19: has a text of more than"),
    ],
)
def test_bytes_that_are_no_step_file_never_reach_the_kernel(content, says, tmp_path, monkeypatch):
    monkeypatch.setattr(cad_part.child_process, "run", lambda *a, **k: pytest.fail("the kernel was started"))
    path = tmp_path / "bad.step"
    path.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        read_part(path)
    assert str(caught.value).startswith(f"{path}, byte ")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_quotes_in_comments_do_not_count_and_long_lists_are_no_text():
    numbers = b"1.,2.," * 20_000
    assert step._long_literal(b"/* don't */ #1=A('',(%s));#2=A('b');" % numbers, 65536) is None
    assert step._long_literal(b"/* don't */ #1=A('%s');" % numbers, 65536) == 17
    assert step._long_literal(b"#1=A('%s');" % (b"x" * 10), 10) is None
    assert step._long_literal(b"#1=A('%s');" % (b"x" * 11), 10) == 5


@pytest.mark.parametrize("number", ["1.E308", "1.E-400", "1.E0000000309X", "E400", "'1.E400'"])
def test_numbers_that_a_double_holds_pass(number):
    assert not step._OVERFLOW.search(b"#1=A(%s,0.);" % number.encode())


@pytest.mark.parametrize("number", ["1.E309", "-1.5E+400", "1.e0400", "1.E123456789"])
def test_numbers_that_no_double_holds_are_found(number):
    assert step._OVERFLOW.search(b"#1=A( %s ,0.);" % number.encode())[1] == number.encode()


def test_reader_does_not_load_the_kernel():
    code = "import sys, sicp_formats.cad.step; sys.exit('OCP' in sys.modules or 'cadquery' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_truncated_file_is_refused_with_its_length(plate_file, tmp_path):
    content = plate_file.read_bytes()
    path = tmp_path / "cut.step"
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(FormatError, match=rf"cut\.step, byte {len(content) // 2}: is cut short"):
        read_part(path)


def test_name_that_looks_like_a_huge_number_is_no_number(altered, plate, in_process):
    part = read_part(altered(("'Open CASCADE STEP translator", "'1.E400 STEP translator")))
    assert len(part.contours) == len(plate.contours)


def test_header_only_holds_no_shapes(plate_file, tmp_path, in_process):
    path = tmp_path / "header.step"
    path.write_text(plate_file.read_text().split("DATA;")[0] + "DATA;\n#1=DATE(2020);\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises(CadError, match=r"header\.step: holds no shapes"):
        read_part(path)


def test_curves_alone_are_no_part(tmp_path, in_process):
    path = write(cq.Edge.makeCircle(50), tmp_path / "curve.step")
    with pytest.raises(CadError, match=r"curve\.step: holds no faces"):
        read_part(path)


def test_missing_entity_is_refused_though_the_kernel_would_go_on(plate_file, tmp_path, in_process):
    text = plate_file.read_text()
    face = re.search(r"#(\d+) = ADVANCED_FACE\('',\(#\d+", text)
    path = tmp_path / "dangling.step"
    path.write_text(text.replace(face.group(), face.group().rsplit("#", 1)[0] + "#99999"))
    with pytest.raises(CadError, match=rf"dangling\.step: is damaged, entity {face[1]} .*unresolved"):
        read_part(path)


def test_face_on_itself_is_refused(plate_file, tmp_path, in_process):
    path = tmp_path / "self.step"
    pattern = r"(#\d+) = ADVANCED_FACE\('',\((#\d+(?:,#\d+)*)\),#\d+"
    path.write_text(re.sub(pattern, r"\1 = ADVANCED_FACE('',(\2),\1", plate_file.read_text()))
    with pytest.raises(CadError, match=r"self\.step: is damaged, entity \d+ .*face_geometry"):
        read_part(path)


def test_edge_that_leaves_its_surface_is_refused(plate_file, tmp_path, in_process):
    text = plate_file.read_text()
    vector = re.search(r"= LINE\('',#\d+,(#\d+)\)", text)[1]
    direction = re.search(rf"{vector} = VECTOR\('',(#\d+)", text)[1]
    path = tmp_path / "bent.step"
    path.write_text(re.sub(rf"({direction} = DIRECTION\('',\()[^)]*", r"\g<1>1.,1.,1.", text))
    with pytest.raises(CadError, match=r"bent\.step: the edge through \(.*\) is .* mm off its surface"):
        read_part(path)


def test_absurd_extent_is_refused(altered, in_process):
    with pytest.raises(CadError, match=r"altered\.step: its shape would be 5\.66e\+05 mm in size"):
        read_part(altered((".MILLI.,.METRE.", "$,.METRE.")))


def test_half_a_file_with_an_end_is_refused_and_stdout_stays_clean(plate_file, tmp_path, capfd):
    text = plate_file.read_text()
    path = tmp_path / "half.step"
    path.write_text(text[: len(text) // 2] + "\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises(CadError, match=r"half\.step: .*wrong syntax"):
        read_part(path)
    assert capfd.readouterr() == ("", "")


def test_kernel_that_hangs_is_ended(plate_file, tmp_path):
    text = plate_file.read_text()
    placement = re.search(r"CYLINDRICAL_SURFACE\('',(#\d+)", text)[1]
    point = re.search(rf"{placement} = AXIS2_PLACEMENT_3D\('',(#\d+)", text)[1]
    path = tmp_path / "hang.step"
    path.write_text(re.sub(rf"({point} = CARTESIAN_POINT\('',\(\s*)[^,]+", r"\g<1>1.E200", text))
    began = time.monotonic()
    with pytest.raises(CadError, match=r"hang\.step: "):
        read_part(path, limits=Limits(cad_seconds=2.5))
    assert time.monotonic() - began < 6


def test_kernel_that_takes_too_long_is_an_error(plate_file):
    with pytest.raises(CadError, match=r"plate\.step: the CAD kernel took longer than cad_seconds = 0\.2"):
        read_part(plate_file, limits=Limits(cad_seconds=0.2))


def test_kernel_without_memory_is_an_error(plate_file):
    with pytest.raises(CadError, match=r"plate\.step: .* more than child_memory_bytes = 209715200; raise limits"):
        read_part(plate_file, limits=Limits(child_memory_bytes=200 * 2**20))


def test_kernel_that_crashes_is_an_error(plate_file, monkeypatch):
    def crash(*args, **kwargs):
        raise ChildCrashError("ended by SIGSEGV")

    monkeypatch.setattr(cad_part, "child_process", SimpleNamespace(**vars(cad_part.child_process) | {"run": crash}))
    with pytest.raises(CadError, match=r"plate\.step: the CAD kernel crashed on it, ended by SIGSEGV"):
        read_part(plate_file)


def test_name_with_control_characters_stays_on_one_line(tmp_path):
    path = tmp_path / "a\x1b]0;x\nb.step"
    path.write_bytes(b"hello")
    with pytest.raises(InputError) as caught:
        read_part(path)
    assert str(caught.value).isprintable()


def test_findings_name_the_file_and_count_what_they_leave_out(tmp_path):
    notes = Notes()
    for number in range(9):
        notes.add(204, Level.INFO, f"entity {number}")
    findings = as_findings(notes.rows(), "part.step")
    assert [f.message for f in findings][-1] == f"{9 - (len(findings) - 1)} more of this kind"
    assert {f.where for f in findings} == {"part.step"}
