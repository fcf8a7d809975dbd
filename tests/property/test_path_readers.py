"""Any path written as APT, G-code or CSV is read back; any damage gives a path or a typed error, nothing else."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import SicpError
from sicp_cam.model import ToolPath
from sicp_formats import apt, gcode, path_csv, path_text
from sicp_formats.paths.arcs import arc_between, centre_for_radius, cross, dot, unit

Rows = list[tuple[tuple[float, float, float], tuple[float, float, float], int, bool]]

coordinate = st.floats(-9999.0, 9999.0).map(lambda value: round(value, 4))
component = st.floats(-1.0, 1.0)
vector = st.tuples(component, component, component)
axis = vector.filter(lambda v: sum(c * c for c in v) > 0.01).map(
    lambda v: tuple(c / sum(d * d for d in v) ** 0.5 for c in v)
)
row = st.tuples(st.tuples(coordinate, coordinate, coordinate), axis, st.integers(1, 20_000), st.booleans())
rows = st.lists(row, min_size=2, max_size=12).filter(lambda found: len({tip for tip, *_ in found}) > 1)


def as_apt(path: Rows) -> str:
    lines = ["UNITS/MM", "MULTAX"]
    for (x, y, z), (i, j, k), feed, rapid in path:
        lines.append("RAPID" if rapid else f"FEDRAT/{feed},MMPM")
        lines.append(f"GOTO/{x:.4f},{y:.4f},{z:.4f},$\n{i:.7f},{j:.7f},{k:.7f}")
    return "\n".join([*lines, "FINI", ""])


def as_gcode(path: Rows) -> str:
    lines = ["%", "O1", "G21 G90 G94", "TRAORI"]
    for number, ((x, y, z), (i, j, k), feed, rapid) in enumerate(path):
        motion = "G0" if rapid else f"G1 F{feed}"
        lines.append(f"N{number} {motion} X{x:.4f} Y{y:.4f} Z{z:.4f} A3={i:.7f} B3={j:.7f} C3={k:.7f}")
    return "\n".join([*lines, "M30", "%", ""])


def as_csv(path: Rows) -> str:
    lines = ["x,y,z,i,j,k,feed,rapid,status"]
    for (x, y, z), (i, j, k), feed, rapid in path:
        lines.append(f"{x:.4f},{y:.4f},{z:.4f},{i:.7f},{j:.7f},{k:.7f},{0 if rapid else feed},{int(rapid)},covered")
    return "\n".join([*lines, ""])


DIALECTS: list[tuple[str, Callable[[Rows], str], Callable[..., ToolPath]]] = [
    ("path.apt", as_apt, apt.read_path),
    ("path.nc", as_gcode, gcode.read_path),
    ("path.csv", as_csv, path_csv.read_path),
]

SEEDS = [
    (
        "path.apt",
        apt.read_path,
        "PARTNO/A\n$$*CATIA0\n$$ A\n$$ 1.0 0.0 0.0 0.0\n$$ 0.0 1.0 0.0 0.0\n$$ 0.0 0.0 1.0 0.0\nUNITS/MM\n"
        "LOADTL/1\nSPINDL/9000,RPM,CLW\nRAPID\nGOTO/9,0,5,0,0,1\nFEDRAT/.2,MMPR\nGOTO/9,0,0\nCIRCLE/0,0,0,0,0,1,9.\n"
        "GOTO/0,9,0\nINDIRV/-1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,9),ON,(LINE/0,0,0,-9,0,0)\nDELAY/2\nGODLTA/0,0,$\n5\nFINI\n",
    ),
    (
        "path.nc",
        gcode.read_path,
        "%\nO1 (X)\nN10 G21 G90 G17\nN20 T1 M6\nN30 S900 M3\nN40 G0 X9. Y0 Z5\nN50 G1 Z0 F600.\nN60 G3 X0 Y9 I-9. J0\n"
        "G2 X9 Y0 R9\nG43.5 H1\nG1 X3 I0 J.6 K.8\nG49\nG4 P1.\nG93 G1 X4 F2\nG94\nG0 Z9 ; up\nG28 Z0\nM5\nM30\n%\n",
    ),
    (
        "path.csv",
        path_csv.read_path,
        "# c\nx;y;z;i;j;k;feed;rapid\n1,5;2;3;0;0;1;0;1\n2;2;3;0;0,6;0,8;500;0\n3;2;3;0;0;1;9;0\n",
    ),
]


@pytest.mark.parametrize(("name", "written", "read_path"), DIALECTS, ids=["apt", "gcode", "csv"])
@settings(deadline=None, max_examples=60)
@given(path=rows)
def test_written_paths_are_read_back(
    name: str, written: Callable[[Rows], str], read_path: Callable[..., ToolPath], path: Rows
) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_text(written(path))
        found = read_path(file)
    assert np.abs(found.tips_mm - [tip for tip, *_ in path]).max() <= 1e-9
    assert np.abs(found.axes - [direction for _, direction, *_ in path]).max() <= 2e-7
    assert np.abs(np.linalg.norm(found.axes, axis=1) - 1).max() <= 1e-12
    assert found.rapid.tolist() == [rapid for *_, rapid in path]
    assert found.feeds_mm_min.tolist() == [0 if rapid else feed for *_, feed, rapid in path]
    assert {finding.code for finding in found.findings} <= {307, 315}


@pytest.mark.parametrize(("name", "read_path", "text"), SEEDS, ids=["apt", "gcode", "csv"])
@settings(deadline=None, max_examples=250)
@given(data=st.data())
def test_damaged_files_give_a_path_or_a_typed_error(
    name: str, read_path: Callable[..., ToolPath], text: str, data: st.DataObject
) -> None:
    damaged = bytearray(text.encode())
    for _ in range(data.draw(st.integers(0, 3))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.one_of(st.integers(0, 255), st.sampled_from(b"0123456789.,/$-+eE()\n XGI#")))
    if data.draw(st.booleans()):
        del damaged[data.draw(st.integers(1, len(damaged))) :]
    with TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_bytes(bytes(damaged))
        try:
            path = read_path(file)
        except SicpError as error:
            assert name in str(error)
            assert str(error).isprintable()
        else:
            assert len(path) > 1
            assert np.isfinite(path.tips_mm).all()
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)


@pytest.mark.parametrize(("name", "read_path", "text"), SEEDS, ids=["apt", "gcode", "csv"])
def test_every_truncation_gives_a_path_or_a_typed_error(
    tmp_path: Path, name: str, read_path: Callable[..., ToolPath], text: str
) -> None:
    file = tmp_path / name
    whole = 0
    for end in range(len(text) + 1):
        file.write_text(text[:end])
        try:
            whole = len(read_path(file))
        except SicpError as error:
            assert name in str(error)
    assert whole > 2


@settings(deadline=None, max_examples=100)
@given(
    centre=st.tuples(coordinate, coordinate, coordinate),
    normal=axis,
    helper=axis,
    radius=st.floats(0.01, 5000.0),
    sweep=st.floats(0.01, 6.27),
    rise=st.floats(-20.0, 20.0),
    chord_mm=st.floats(1e-3, 0.5),
    step_mm=st.floats(0.5, 50.0),
)
def test_arcs_stay_within_chord_and_step(
    centre: tuple[float, float, float],
    normal: tuple[float, float, float],
    helper: tuple[float, float, float],
    radius: float,
    sweep: float,
    rise: float,
    chord_mm: float,
    step_mm: float,
) -> None:
    u = unit(cross(normal, helper))
    if u is None or abs(dot(normal, helper)) > 0.999:
        return
    c, n, a, b = np.array(centre), np.array(normal), np.array(u), np.cross(normal, u)
    start, end = c + radius * a, c + radius * (np.cos(sweep) * a + np.sin(sweep) * b) + rise * n
    arc = arc_between(tuple(start), tuple(end), centre, normal)
    assert arc is not None
    assert arc.sweep == pytest.approx(sweep, abs=1e-6)
    steps = arc.steps(chord_mm, step_mm)
    points = np.vstack([start, arc.points(steps)])
    assert np.abs(points[-1] - end).max() == 0.0
    heights = (points - c) @ n
    distances = np.linalg.norm(points - c - np.outer(heights, n), axis=1)
    assert np.abs(distances - radius).max() < 1e-6
    middles = (points[1:] + points[:-1]) / 2 - c
    sagitta = radius - np.linalg.norm(middles - np.outer(middles @ n, n), axis=1)
    assert sagitta.max() <= chord_mm + 1e-6
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= step_mm + 1e-6
    flat_end = tuple(end - rise * n)
    found = centre_for_radius(tuple(start), flat_end, normal, radius if sweep < np.pi else -radius, 1e-6)
    if abs(sweep - np.pi) > 1e-2:
        assert found is not None
        assert np.linalg.norm(np.array(found) - c) < 1e-3 * max(radius, 1.0)


TEXT_SEEDS = [(name, text) for name, _, text in SEEDS]


@pytest.mark.parametrize(("name", "text"), TEXT_SEEDS, ids=["apt", "gcode", "csv"])
@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_damaged_text_files_give_a_path_or_a_typed_error(name: str, text: str, data: st.DataObject) -> None:
    damaged = bytearray(text.encode())
    for _ in range(data.draw(st.integers(0, 3))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "path.txt"
        file.write_bytes(bytes(damaged))
        try:
            path = path_text.read_path(file)
        except SicpError as error:
            assert "path.txt" in str(error)
            assert str(error).isprintable()
        else:
            assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)


@settings(deadline=None, max_examples=25)
@given(path=rows)
def test_tables_are_written_again_as_they_stand(path: Rows) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "path.csv"
        file.write_text(as_csv(path))
        found = path_csv.read_path(file)
        assert found.original is not None
        same = found.original.rewritten(found, np.arange(len(found)))
        assert same.content == file.read_bytes()
        turned = replace(found, tips_mm=found.tips_mm[:, ::-1] + 1.0, axes=found.axes[:, ::-1])
        file.write_bytes(found.original.rewritten(turned, np.arange(len(found))).content)
        again = path_csv.read_path(file)
    assert np.abs(again.tips_mm - turned.tips_mm).max() <= 6e-5
    assert np.abs(again.axes - turned.axes).max() <= 2e-7
    assert again.feeds_mm_min.tolist() == found.feeds_mm_min.tolist()
