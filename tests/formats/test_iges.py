"""The IGES reader: loose trimmed faces, units, and files that have lost a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.IGESControl import IGESControl_Controller, IGESControl_Writer

from sicp_cam.errors import FormatError, InputError, UnitError
from sicp_formats.cad.iges import read_part

CORPUS = Path(__file__).parents[1] / "corpus" / "iges"


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """A plate of 100 x 60 x 4 with a hole of R 10, by the unit of the file and whether it is a solid there."""
    drill = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(50, 30, -5), gp_Dir(0, 0, 1)), 10, 20).Shape()
    plate = BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(100, 60, 4).Shape(), drill).Shape()
    IGESControl_Controller.Init_s()
    folder = tmp_path_factory.mktemp("plates")
    for unit, solid in (("MM", 0), ("IN", 0), ("MM", 1)):
        writer = IGESControl_Writer(unit, solid)
        writer.AddShape(plate)
        writer.ComputeModel()
        writer.Write(str(folder / f"{unit}{solid}.igs"))
    return folder


@pytest.mark.parametrize(("name", "unit", "codes"), [("MM0", "mm", [212]), ("IN0", "inch", [212]), ("MM1", "mm", [])])
def test_plate_with_a_hole(name, unit, codes, plates, in_process):
    part = read_part(plates / f"{name}.igs")
    assert [round(c.length_mm) for c in part.contours] == [320, 320, 208, 208, 128, 128, 63, 63, 63, 63]
    assert (part.source.format, part.source.unit, part.source.unit_stated) == ("IGES", unit, True)
    assert [finding.code for finding in part.findings] == codes
    (hole,) = [c for c in part.contours if round(c.length_mm) == 63 and np.allclose(c.normals, [0, 0, 1], atol=1e-6)]
    np.testing.assert_allclose(np.linalg.norm(hole.points_mm - [50, 30, 4], axis=1), 10.0, atol=1e-5)
    inward = np.cross(hole.normals, hole.tangents)
    np.testing.assert_allclose(inward, (hole.points_mm - [50, 30, 4]) / 10, atol=1e-3)


@pytest.mark.parametrize("unit", ["mm", "inch"])
def test_seed_is_a_triangle_of_30_40_50_mm(unit, in_process):
    part = read_part(CORPUS / f"trimmed_{unit}.igs")
    (contour,) = part.contours
    assert contour.length_mm == pytest.approx(120.0)
    assert part.source.unit == unit
    other = "mm" if unit == "inch" else "inch"
    with pytest.raises(UnitError, match=rf"the file states {unit}, not {other}"):
        read_part(CORPUS / f"trimmed_{unit}.igs", units=other)


@pytest.mark.parametrize(("flag", "says"), [(2, "mm"), (9, "um"), (6, "m")])
def test_flag_and_name_that_contradict_each_other_are_refused(flag, says, plates, tmp_path, in_process):
    path = restated(plates, tmp_path, f"1.,{flag},4HINCH")
    with pytest.raises(UnitError, match=rf"the unit flag {flag} says {says}, the unit name says inch; .*--cad-units"):
        read_part(path)
    with pytest.raises(UnitError, match="says inch"):
        read_part(path, units="cm")


@pytest.mark.parametrize("unit", ["mm", "inch"])
def test_user_decides_between_flag_and_name(unit, plates, tmp_path, in_process):
    part = read_part(restated(plates, tmp_path, "1.,2,4HINCH"), units=unit)
    scale = 1.0 if unit == "inch" else 1 / 25.4
    assert part.contours[0].length_mm == pytest.approx(320.0 * scale)
    assert (part.source.unit, part.source.unit_stated) == (unit, True)


def test_unit_that_cannot_be_read_is_asked_for(plates, tmp_path, in_process):
    path = restated(plates, tmp_path, "1.,3,4HELLE")
    with pytest.raises(UnitError, match="the unit of length cannot be read; state it with --cad-units"):
        read_part(path)
    assert read_part(path, units="inch").contours[0].length_mm == pytest.approx(320.0)


def restated(plates: Path, folder: Path, unit: str) -> Path:
    """Return the plate in inch with another unit in its global section."""
    text = (plates / "IN0.igs").read_text()
    assert "1.,1,4HINCH" in text
    path = folder / "restated.igs"
    path.write_text(text.replace("1.,1,4HINCH", unit))
    return path


def altered(folder: Path, change) -> Path:
    lines = (CORPUS / "trimmed_mm.igs").read_bytes().splitlines()
    path = folder / "altered.igs"
    path.write_bytes(b"\n".join(change(lines)) + b"\n")
    return path


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda lines: lines[:-1], "is cut short (no T section ends it)"),
        (lambda lines: lines[:8] + lines[9:], "section D has"),
        (lambda lines: [*lines[:3], lines[0], *lines[3:]], "line 4: column 73 names no section, or one that is over"),
        (lambda lines: [*lines[:3], b"oops", *lines[3:]], "line 4: column 73 names no section"),
        (lambda lines: [*lines[:-1], b"no numbers here".ljust(72) + b"T0000001"], "the T section states no numbers"),
        (lambda lines: [b"x".ljust(72) + b"C0000001", *lines], "byte 0: is an IGES file in its binary or compressed"),
        (lambda lines: [b"ISO-10303-21;", *lines], "byte 0: is a STEP file (no S section comes first); name it .step"),
        (lambda lines: [b"CASCADE Topology V1"], "byte 0: is an OpenCASCADE BRep file"),
        (lambda lines: [b"hello"], "byte 0: is no IGES file"),
    ],
)
def test_lines_that_cannot_be(change, says, tmp_path):
    with pytest.raises(FormatError) as caught:
        read_part(altered(tmp_path, change))
    assert says in str(caught.value)


def test_blank_line_at_the_end_and_crlf_are_harmless(tmp_path, in_process):
    path = tmp_path / "crlf.igs"
    path.write_bytes((CORPUS / "trimmed_mm.igs").read_bytes().replace(b"\n", b"\r\n") + b"\r\n\x1a")
    assert len(read_part(path).contours) == 1


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(kept=st.floats(0.0, 0.97))
def test_every_cut_is_refused(kept, tmp_path):
    content = (CORPUS / "trimmed_mm.igs").read_bytes().rstrip()
    path = tmp_path / "cut.igs"
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError):
        read_part(path)
