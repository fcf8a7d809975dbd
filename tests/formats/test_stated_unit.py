"""Units that comments and headers state: followed in every format, never overruled, and told where they are unknown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, UnitError
from sicp_cam.model import Scan
from sicp_formats import ascii as ascii_scan
from sicp_formats import obj, pcd, ply, stl
from sicp_formats.surfaces.unit import unit_in

POINTS = np.array([[1.5, 2.25, 0.5], [4.0, -5.5, 6.25], [7.0, 8.0, -9.75]])
ROWS = "".join(" ".join(map(repr, row)) + "\n" for row in POINTS.tolist())
TEXT_PLY = (
    "ply\nformat ascii 1.0\n{}\nelement vertex 3\n"
    "property double x\nproperty double y\nproperty double z\nend_header\n" + ROWS
)
TEXT_PCD = "{}\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 3\nHEIGHT 1\nDATA ascii\n" + ROWS
TEXT_OBJ = "{}\n" + "".join(f"v {row}\n" for row in ROWS.splitlines()) + "f 1 2 3\n"
READERS = {".xyz": ascii_scan, ".ply": ply, ".pcd": pcd, ".obj": obj, ".stl": stl}
TEXT_STL = stl.write_scan(Scan(POINTS, faces=np.array([[0, 1, 2]])), encoding="ascii").decode().split("\n", 1)[1]
BINARY_STL = stl.write_scan(Scan(POINTS, faces=np.array([[0, 1, 2]])))[80:]


def write(folder: Path, suffix: str, content: str | bytes) -> Path:
    path = folder / f"scan{suffix}"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def unit_of(path: Path, **options: str) -> tuple[str, bool, list[int]]:
    scan = READERS[path.suffix].read_scan(path, **options)
    mm = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}[scan.source.unit]
    assert np.allclose(scan.points_mm, mm * POINTS, rtol=1e-6)
    return scan.source.unit, scan.source.unit_stated, [int(each.code) for each in scan.findings if each.level == "warn"]


STATED = [
    (".xyz", "# unit: inch\n" + ROWS, "inch"),
    (".xyz", "# unit inch\n" + ROWS, "inch"),
    (".xyz", "# Units = m\n" + ROWS, "m"),
    (".xyz", "# Scanned on Monday; units: Millimetres, 3 points\n" + ROWS, "mm"),
    (".xyz", "# all coordinates in inch\n" + ROWS, "inch"),
    (".xyz", "// The units are centimeters.\n# x y z\n" + ROWS, "cm"),
    (".xyz", "X/m Y/m Z/m\n" + ROWS, "m"),
    (".xyz", "X in inch;Y in inch;Z in inch\n" + ROWS.replace(" ", ";"), "inch"),
    (".ply", TEXT_PLY.format("comment units: inch"), "inch"),
    (".ply", TEXT_PLY.format("comment Unit: m"), "m"),
    (".ply", TEXT_PLY.format("comment unit = inch"), "inch"),
    (".ply", TEXT_PLY.format("obj_info unit inch"), "inch"),
    (".pcd", TEXT_PCD.format("# units: inch"), "inch"),
    (".pcd", TEXT_PCD.format("#UNITS=metres"), "m"),
    (".obj", TEXT_OBJ.format("# Units: inch"), "inch"),
    (".obj", TEXT_OBJ.format("# File units = meters"), "m"),
    (".obj", TEXT_OBJ.format("# coordinates in inch"), "inch"),
    (".stl", "solid part UNITS=in\n" + TEXT_STL, "inch"),
    (".stl", b"exported UNITS=in".ljust(80) + BINARY_STL, "inch"),
    (".stl", b"UNITS=in".ljust(80, b"\0") + BINARY_STL, "inch"),
]


@pytest.mark.parametrize(("suffix", "content", "unit"), STATED)
def test_a_unit_that_is_stated_is_followed(tmp_path: Path, suffix: str, content: str | bytes, unit: str) -> None:
    path = write(tmp_path, suffix, content)
    assert unit_of(path) == (unit, True, [])
    assert unit_of(path, units=unit) == (unit, True, [])
    other = "mm" if unit != "mm" else "inch"
    with pytest.raises(UnitError, match=rf"(line|byte) \d.*the file states {unit}, the job {other}"):
        unit_of(path, units=other)


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        (".xyz", "# unit: furlong\n" + ROWS),
        (".ply", TEXT_PLY.format("comment units: furlong")),
        (".pcd", TEXT_PCD.format("# unit = furlong")),
        (".obj", TEXT_OBJ.format("# units: furlong")),
        (".stl", "solid UNITS=furlong\n" + TEXT_STL),
    ],
)
def test_an_unknown_unit_is_told(tmp_path: Path, suffix: str, content: str) -> None:
    assert unit_of(write(tmp_path, suffix, content)) == ("mm", False, [132])


@pytest.mark.parametrize(
    "comment",
    [
        "unit normals",
        "normals are unit vectors",
        "one unit in 25.4",
        "unit M 200",
        "united",
        "no units",
        "Unit in-house",
    ],
)
def test_words_that_state_no_unit(comment: str) -> None:
    assert unit_in(Path("a.xyz"), comment, 1) is None


def test_a_name_is_no_unit(tmp_path: Path) -> None:
    assert unit_of(write(tmp_path, ".stl", "solid unit cube\n" + TEXT_STL)) == ("mm", False, [])


@pytest.mark.parametrize(
    "head", ["# unit: m\n# units: inch\n", "# unit: m\nx_inch y_inch z_inch\n", "# unit: m\n# X [mm] Y [mm] Z [mm]\n"]
)
def test_two_units_are_refused(tmp_path: Path, head: str) -> None:
    with pytest.raises(FormatError, match=r"line \d: .*states the unit .*another one in line 1 m"):
        unit_of(write(tmp_path, ".xyz", head + ROWS))


def test_two_names_of_one_unit_agree(tmp_path: Path) -> None:
    assert (
        unit_of(
            write(
                tmp_path, ".xyz", '# unit: inches\n# units = in\n"X [in]";"Y [in]";"Z [in]"\n' + ROWS.replace(" ", ";")
            )
        )[0]
        == "inch"
    )


@pytest.mark.parametrize("unit", ["mm", "inch"])
@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_our_own_stl_states_it(tmp_path: Path, unit: str, encoding: str) -> None:
    content = stl.write_scan(Scan(POINTS, faces=np.array([[0, 1, 2]])), unit=unit, encoding=encoding)
    path = write(tmp_path, ".stl", content)
    found = stl.read_scan(path)
    assert np.allclose(found.points_mm, POINTS, rtol=1e-6)
    assert found.source is not None and (found.source.unit, found.source.unit_stated) == (unit, True)


def test_our_own_obj_states_it(tmp_path: Path) -> None:
    found = obj.read_scan(write(tmp_path, ".obj", obj.write_scan(Scan(POINTS), unit="inch")))
    assert np.allclose(found.points_mm, POINTS) and found.source is not None and found.source.unit == "inch"
