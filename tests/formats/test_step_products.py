"""STEP files whose products, doubled faces or units a careless reader takes for something else."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Sewing
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Ax3, gp_Dir, gp_Pln, gp_Pnt, gp_Trsf, gp_Vec
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Controller, STEPControl_StepModelType, STEPControl_Writer
from OCP.TopLoc import TopLoc_Location

from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_formats.cad.step import read_part

MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"


def sheet(x: float = 0.0, z: float = 0.0, width: float = 100.0):
    """A flat face of `width` x 100 mm from x on."""
    plane = gp_Pln(gp_Ax3(gp_Pnt(x, 0, z), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)))
    return BRepBuilderAPI_MakeFace(plane, 0.0, width, 0.0, 100.0).Face()


def skin(x: float):
    """A shell of two sheets, 200 x 100 mm together."""
    sewing = BRepBuilderAPI_Sewing(1e-4)
    for each in (sheet(x), sheet(x + 100.0)):
        sewing.Add(each)
    sewing.Perform()
    return sewing.SewedShape()


def write(path: Path, *roots, names: tuple[str, ...] = (), unit: str = "MM") -> Path:
    """Write each shape as a product that is in no assembly, with a name or that which the kernel makes up."""
    STEPControl_Controller.Init_s()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer = STEPControl_Writer()
    for root in roots:
        writer.Transfer(root, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    text, given = path.read_text(), iter(names)
    if names:
        text = re.sub(r"= PRODUCT\('[^']*',\s*'[^']*'", lambda _: f"= PRODUCT('{(n := next(given))}','{n}'", text)
    path.write_text(text)
    return path


def without_length(text: str) -> str:
    """Return a file, or its data, of which the shapes have no unit of length."""
    return re.sub(r"(GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(\s*)#\d+\s*,", r"\1", text)


def lengths(part):
    return [round(contour.length_mm) for contour in part.contours]


def said(part, code):
    return next(finding for finding in part.findings if finding.code == code)


def codes(part):
    return sorted(finding.code for finding in part.findings)


@pytest.mark.parametrize("make", [skin, sheet])
def test_products_that_touch_stay_apart_under_their_names(make, tmp_path, in_process):
    width = 200.0 if make is skin else 100.0
    path = write(tmp_path / "two.step", make(0.0), make(width), names=("Wing skin", "Flap skin"))
    part = read_part(path)
    assert lengths(part) == [2 * width + 200] * 2
    assert codes(part) == [210, 210, 211]
    assert "1 'Wing skin' (" in said(part, 211).message
    flap = read_part(path, body="flap skin")
    assert lengths(flap) == [2 * width + 200]
    assert flap.contours[0].points_mm[:, 0].min() == pytest.approx(width)
    assert len(read_part(path, sew_mm=0.0, body="Wing skin").contours) == 1


def test_several_faces_are_a_product_of_their_own_though_it_has_no_name(tmp_path, in_process):
    part = read_part(write(tmp_path / "two.step", skin(0.0), skin(200.0)))
    assert lengths(part) == [600, 600]
    assert codes(part) == [210, 210, 211]


@pytest.mark.parametrize("names", [(), ("", ""), ("Skin", "skin"), ("Face 1", "Face 2"), ("=>[0:1:1:2]", "SHELL")])
def test_faces_of_which_no_name_tells_are_sewn_with_a_warning(names, tmp_path, in_process):
    part = read_part(write(tmp_path / "patches.step", sheet(), sheet(100.0), names=names))
    assert lengths(part) == [600]
    assert said(part, 217).level is Level.WARN
    assert said(part, 217).message.startswith("2 products of one face each")
    apart = read_part(tmp_path / "patches.step", sew_mm=0.0)
    assert lengths(apart) == [400, 400]
    assert 217 not in codes(apart)


def test_named_product_stays_out_of_the_patches_beside_it(tmp_path, in_process):
    shapes = [sheet(), sheet(100.0), sheet(200.0)]
    part = read_part(write(tmp_path / "three.step", *shapes, names=("", "", "Flap")))
    assert lengths(part) == [600, 400]
    assert lengths(read_part(tmp_path / "three.step", body="Flap")) == [400]


def test_names_survive_a_unit_that_the_user_states(tmp_path, in_process):
    path = write(tmp_path / "two.step", sheet(), sheet(100.0), names=("Wing", "Flap"))
    path.write_text(without_length(path.read_text()))
    part = read_part(path, units="inch")
    assert [c.length_mm for c in part.contours] == pytest.approx([400 * 25.4] * 2)
    assert lengths(read_part(path, units="inch", body="Flap")) == [round(400 * 25.4)]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sew_mm", [0.0, 0.05])
def test_face_that_is_there_twice_is_read_once(turned, sew_mm, tmp_path, in_process):
    copy = sheet().Reversed() if turned else sheet()
    part = read_part(write(tmp_path / "twice.step", sheet(), copy), sew_mm=sew_mm)
    assert lengths(part) == [400]
    assert part.contours[0].normals[0, 2] == pytest.approx(1.0)
    assert said(part, 218).level is Level.WARN
    assert said(part, 218).message.startswith("1 of 2 loose faces are there twice")
    assert codes(part) == [210, 218]


def test_copy_within_a_skin_does_not_keep_the_skin_from_being_sewn(tmp_path, in_process):
    part = read_part(write(tmp_path / "twice.step", sheet(), sheet(100.0), sheet(), sheet(200.0)))
    assert lengths(part) == [800]
    assert {212, 218} <= set(codes(part))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("gap", [0.005, 0.04])
def test_stack_of_thin_skins_is_no_solid(turned, gap, tmp_path, in_process):
    upper = sheet(z=gap).Reversed() if turned else sheet(z=gap)
    part = read_part(write(tmp_path / "stack.step", sheet(), upper))
    assert lengths(part) == [400, 400]
    assert {round(c.points_mm[0, 2], 6): round(c.normals[0, 2]) for c in part.contours} == {
        0.0: 1,
        gap: -1 if turned else 1,
    }
    assert said(part, 219).level is Level.WARN
    assert "2 of 2 loose faces lie on each other" in said(part, 219).message
    assert 212 not in codes(part)


def test_narrow_strip_between_sheets_is_no_stack(tmp_path, in_process):
    strip = sheet(100.0, width=0.04)
    part = read_part(write(tmp_path / "strip.step", sheet(), strip, sheet(100.04)))
    assert [c.length_mm for c in part.contours] == pytest.approx([600.08], abs=0.1)
    assert not {218, 219} & set(codes(part))


def test_inch_file_that_is_cut_before_its_unit_is_not_taken_for_mm(tmp_path, in_process):
    text = write(tmp_path / "inch.step", BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape(), unit="INCH").read_text()
    path = tmp_path / "cut.step"
    path.write_text(text[: text.index("GLOBAL_UNIT_ASSIGNED_CONTEXT", text.index("CLOSED_SHELL"))])
    if "CONVERSION_BASED_UNIT" in path.read_text():
        pytest.fail("the unit is not cut off")
    with pytest.raises(UnitError, match=r"cut\.step: the unit of length cannot be read; state it with --cad-units"):
        read_part(path, recover=True)
    assert lengths(read_part(path, recover=True, units="inch"))[0] == 200


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("LENGTH_MEASURE_WITH_UNIT(", "XENGTH("),
        ("CONVERSION_BASED_UNIT('INCH',", "CONVERSION_BASED_UNIX('INCH',"),
    ],
)
def test_unit_that_is_misspelt_is_not_taken_for_mm(old, new, tmp_path, in_process):
    path = write(tmp_path / "inch.step", sheet(), unit="INCH")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    for recover in (False, True):
        with pytest.raises(
            (UnitError, CadError), match=r"inch\.step: (the unit of length cannot|.*wrong syntax|.*damaged)"
        ):
            read_part(path, recover=recover)


def test_unit_of_some_shapes_alone_is_refused(tmp_path, in_process):
    first = write(tmp_path / "inch.step", sheet(), names=("a",), unit="INCH").read_text()
    second = write(tmp_path / "mm.step", sheet(100.0), names=("b",)).read_text()
    data = second.split("DATA;")[1].split("ENDSEC;")[0]
    data = without_length(data)
    head, tail = first.rsplit("ENDSEC;", 1)
    path = tmp_path / "mixed.step"
    path.write_text(head + re.sub(r"#(\d+)", lambda m: f"#{int(m[1]) + 1000}", data) + "ENDSEC;" + tail)
    for units in (None, "inch"):
        with pytest.raises(UnitError, match="of some shapes cannot be read, that of others is inch"):
            read_part(path, units=units)


def test_no_unit_entity_at_all_is_refused(tmp_path, in_process):
    path = write(tmp_path / "bare.step", sheet())
    text = without_length(path.read_text())
    assert MILLIMETRE in text
    path.write_text(text.replace(MILLIMETRE, "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)"))
    with pytest.raises(UnitError, match="the unit of length cannot be read"):
        read_part(path)
    assert lengths(read_part(path, units="mm")) == [400]


def test_vertex_that_is_far_off_does_not_hang_the_mesh(tmp_path, in_process):
    motion = gp_Trsf()
    motion.SetTranslation(gp_Vec(-30.0, -20.0, -10.0))
    box = BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape().Moved(TopLoc_Location(motion))
    text = write(tmp_path / "moved.step", box).read_text()
    point = re.search(r"VERTEX_POINT\('',(#\d+)\)", text)[1]
    path = tmp_path / "moved.step"
    path.write_text(re.sub(rf"({point} = CARTESIAN_POINT\('',\()[^,]+", r"\g<1>-190.", text))
    began = time.monotonic()
    with pytest.raises(CadError, match=r"moved\.step: the edge through .* mm off"):
        read_part(path)
    assert time.monotonic() - began < 8


def test_unit_without_its_dimensions_is_read(tmp_path, in_process):
    path = write(tmp_path / "inch.step", sheet(), unit="INCH")
    text = re.sub(r"(LENGTH_UNIT\(\) NAMED_UNIT\(\s*)#\d+", r"\1*", path.read_text())
    assert text != path.read_text()
    path.write_text(text)
    part = read_part(path)
    assert (lengths(part), part.source.unit) == ([400], "inch")
