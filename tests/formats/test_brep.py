"""The BRep reader: known shapes, and files that would hang the kernel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
from OCP.BRepTools import BRepTools

from sicp_cam.errors import CadError, FormatError, UnitError
from sicp_formats.cad import part as cad_part
from sicp_formats.cad.brep import read_part

SEED = Path(__file__).parents[1] / "corpus" / "brep" / "triangle.brep"


@pytest.fixture
def kernel_off(monkeypatch):
    """Let nothing reach the kernel."""
    monkeypatch.setattr(cad_part, "part_of", lambda *a, **k: pytest.fail("the kernel was started"))
    monkeypatch.setattr("sicp_formats.cad.brep.part_of", lambda *a, **k: pytest.fail("the kernel was started"))


def test_seed_is_a_triangle_of_30_40_50(in_process):
    part = read_part(SEED)
    (contour,) = part.contours
    assert contour.length_mm == pytest.approx(120.0)
    assert len(contour.corners) == 3
    assert (part.source.format, part.source.unit, part.source.unit_stated) == ("BREP", "mm", False)


def test_stated_unit_scales(in_process):
    part = read_part(SEED, units="inch")
    assert part.contours[0].length_mm == pytest.approx(120.0 * 25.4)
    assert (part.source.unit, part.source.unit_stated) == ("inch", True)
    with pytest.raises(UnitError, match="unknown unit 'furlong'"):
        read_part(SEED, units="furlong")


def test_cylinder_has_its_four_circles(tmp_path, in_process):
    path = tmp_path / "cylinder.brep"
    BRepTools.Write_s(BRepPrimAPI_MakeCylinder(50.0, 120.0).Shape(), str(path))
    part = read_part(path)
    assert [c.length_mm for c in part.contours] == pytest.approx([100 * np.pi] * 4, rel=1e-3)
    for contour in part.contours:
        np.testing.assert_allclose(np.linalg.norm(contour.points_mm[:, :2], axis=1), 50.0, atol=1e-6)


def test_drawable_shape_is_read_too(tmp_path, in_process):
    path = tmp_path / "drawable.brep"
    path.write_bytes(b"DBRep_DrawableShape\n" + SEED.read_bytes() + b"\n0\n\n")
    assert len(read_part(path).contours) == 1


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"hello", "byte 0: is no BREP file"),
        (b"ISO-10303-21;\n", "byte 0: is a STEP file ('CASCADE Topology' does not come first); name it .step"),
        (b"%-72sS      1\n" % b"IGES", "byte 0: is an IGES file"),
        (b"\nOpen CASCADE Topology V3 (c)\n", "byte 0: is a binary BRep file"),
        (b"CASCADE Topology V1\nLocations 0\n", "byte 32: has no section Curve2ds where it should be"),
    ],
)
def test_bytes_that_are_no_brep_never_reach_the_kernel(content, says, tmp_path, kernel_off):
    path = tmp_path / "bad.brep"
    path.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        read_part(path)
    assert says in str(caught.value)


def test_impossible_count_is_refused(tmp_path, kernel_off):
    content = SEED.read_bytes()
    path = tmp_path / "count.brep"
    path.write_bytes(content.replace(b"\nSurfaces 1", b"\nSurfaces 99999999999"))
    with pytest.raises(
        FormatError, match=rf"byte {content.index(b'Surfaces')}: states 99999999999 Surfaces, in \d+ bytes"
    ):
        read_part(path)


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(kept=st.floats(0.001, 0.995))
def test_every_cut_is_refused_before_the_kernel_hangs_on_it(kept, tmp_path, kernel_off):
    content = SEED.read_bytes().rstrip()
    path = tmp_path / "cut.brep"
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(FormatError):
        read_part(path)


def test_absurd_size_is_refused(tmp_path, in_process):
    path = tmp_path / "huge.brep"
    BRepTools.Write_s(BRepPrimAPI_MakeCylinder(5e6, 120.0).Shape(), str(path))
    with pytest.raises(CadError, match=r"huge\.brep: its shape would be .* mm in size"):
        read_part(path)


def test_number_of_a_curve_that_is_not_there_is_refused(tmp_path, in_process):
    content = SEED.read_bytes()
    path = tmp_path / "dangling.brep"
    path.write_bytes(content.replace(b"\n1  1 0 0 ", b"\n1  9 0 0 ", 1))
    assert path.read_bytes() != content
    with pytest.raises(CadError, match=r"dangling\.brep: the CAD kernel (fails on|cannot read) it"):
        read_part(path)
