"""The DXF reader against drawings whose truth is known: curves, blocks, units, layers, chains, and bad input."""

import gzip
import itertools
import math
import struct
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from sicp_cam.errors import FormatError, InputError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, ToolPath
from sicp_formats.dxf import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "dxf"
FEED_AND_AXIS = {302, 303}
NO_RETRACT = 366
SQUARE = ("LINE|8 0|10 0|20 0|11 9|21 0", "LINE|8 0|10 9|20 0|11 9|21 9", "LINE|8 0|10 9|20 9|11 0|21 0")


def lines_of(*tags: str) -> str:
    """Return the lines of tags that are written `code value|code value`."""
    pairs = (pair.partition(" ") for text in tags for pair in text.split("|"))
    return "".join(f"{code}\n{value}\n" for code, _, value in pairs)


def drawing(*entities: str, unit: int | None = 4, version: str = "AC1009", blocks: tuple[str, ...] = ()) -> str:
    """Return a drawing; with $INSUNITS the first entity begins in line 19."""
    stated = "" if unit is None else f"|9 $INSUNITS|70 {unit}"
    head = [f"0 SECTION|2 HEADER|9 $ACADVER|1 {version}{stated}|0 ENDSEC"]
    middle = ["0 SECTION|2 BLOCKS", *blocks, "0 ENDSEC"] if blocks else []
    return lines_of(*head, *middle, "0 SECTION|2 ENTITIES", *(f"0 {entity}" for entity in entities), "0 ENDSEC|0 EOF")


def block(name: str, *entities: str) -> str:
    inner = "".join(f"|0 {entity}" for entity in entities)
    return f"0 BLOCK|8 0|2 {name}|70 0|10 0|20 0|30 0|3 {name}|1 {inner}|0 ENDBLK|8 0"


def r2000(kind: str, subclass: str, rest: str, layer: str = "0") -> str:
    return f"{kind}|5 2F|100 AcDbEntity|8 {layer}|100 {subclass}|{rest}"


def read(tmp_path: Path, text: str | bytes, **options: object) -> ToolPath:
    path = tmp_path / "drawing.dxf"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_path(path, **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings} - FEED_AND_AXIS - {NO_RETRACT}


def message(path: ToolPath, code: int) -> str:
    (found,) = [finding for finding in path.findings if finding.code == code]
    return found.message


def refused(tmp_path: Path, text: str | bytes, line: int | None, *words: str, **options: object) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, **options)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def chains(path: ToolPath) -> list[FloatArray]:
    return np.split(path.tips_mm, np.flatnonzero(path.rapid)[1:])


def sagitta(points: FloatArray, centre: FloatArray, radius: float) -> tuple[float, float]:
    """Return how far the corners and the middles of the straights lie from a circle."""
    middles = (points[1:] + points[:-1]) / 2.0
    off = [np.abs(np.linalg.norm(p - centre, axis=1) - radius).max() for p in (points, middles)]
    return float(off[0]), float(off[1])


def test_lines_and_an_arc_become_one_loop_in_the_direction_of_the_first() -> None:
    path = read_path(CORPUS / "r12_lines_arc.dxf")
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    assert path.tips_mm[0].tolist() == path.tips_mm[-1].tolist() == [0, 0, 0]
    assert path.tips_mm[1].tolist() == [40, 0, 0]
    assert path.tips_mm[-2].tolist() == [0, 20, 0]
    on_arc = path.tips_mm[1:-2]
    assert max(*sagitta(on_arc, np.array([40.0, 10.0, 0.0]), 10.0)) <= 0.005
    assert (path.axes == [0, 0, 1]).all()
    assert path.feeds_mm_min.max() == 0.0
    assert path.lines[[0, 1, 2, -1]].tolist() == [19, 19, 31, 57]
    assert path.source is not None and path.source.unit == "mm" and path.source.unit_stated
    assert codes(path) == {306, 330}
    assert {f.code for f in path.findings} >= FEED_AND_AXIS


def test_old_polylines_with_extrusion_bulge_and_three_dimensions_in_inch() -> None:
    flat, space = chains(read_path(CORPUS / "r12_polylines.dxf"))
    mm = 25.4
    assert np.allclose(flat[0], [-1 * mm, 0, -2 * mm], atol=1e-9)
    assert np.allclose(flat[1], [-3 * mm, 0, -2 * mm], atol=1e-9)
    assert np.abs(flat[:, 0]).max() == pytest.approx(4 * mm, abs=0.01)  # half a circle about (3, 1), radius 1
    assert sagitta(flat[1:-1], np.array([-3, 1, -2]) * mm, mm)[0] < 1e-9
    assert np.allclose(space, np.array([[0, 5, 1], [1, 6, 2], [2, 7, 4]]) * mm, atol=1e-12)


def test_bulges_of_a_slot() -> None:
    path = read_path(CORPUS / "r2000_bulges.dxf")
    right = path.tips_mm[path.tips_mm[:, 0] > 30.0]
    assert max(*sagitta(right, np.array([30.0, 6.0, 3.0]), 6.0)) <= 0.005
    assert path.tips_mm[:, 0].min() == pytest.approx(-6.0, abs=0.005)
    assert np.allclose(path.tips_mm[:, 2], 3.0)
    assert np.array_equal(path.tips_mm[0], path.tips_mm[-1])


def test_a_rational_spline_is_the_circle_that_it_means() -> None:
    path = read_path(CORPUS / "r2000_spline.dxf")  # in metres
    corners, middles = sagitta(path.tips_mm, np.zeros(3), 1000.0)
    assert corners < 1e-9 and middles <= 0.005
    assert np.linalg.norm(np.diff(path.tips_mm[1:], axis=0), axis=1).max() <= 2.0


def test_blocks_within_blocks_mirrored_turned_unevenly_scaled_and_in_arrays() -> None:
    first, *array = chains(read_path(CORPUS / "r12_blocks.dxf", chord_mm=1e-4))
    # Half axes 4 and 2, turned by 90 degrees, about (100, -10, 5).
    off = ((first - [100, -10, 5]) / [2, 4, 1])[:, :2]
    assert np.abs(np.hypot(*off.T) - 1.0).max() < 1e-12
    centres = sorted(np.round((loop.min(axis=0) + loop.max(axis=0)) / 2, 3).tolist() for loop in array)
    assert centres == sorted([x, y, 0.0] for x in (0.0, 20.0, 40.0) for y in (50.0, 80.0))


def test_a_binary_drawing_reads_like_a_text() -> None:
    path = read_path(CORPUS / "r12_binary.dxf")
    assert path.tips_mm[:2].tolist() == [[0, 0, 1], [25, 0, 1]]
    assert np.allclose(path.tips_mm[-1], [0, 25, 1])
    assert path.lines.tolist() == [0] * len(path)


def test_ellipses_and_circles_under_an_extrusion(tmp_path: Path) -> None:
    full = r2000("ELLIPSE", "AcDbEllipse", "10 5|20 6|30 7|11 8|21 0|31 0|210 0|220 0|230 1|40 0.5|41 0|42 6.283185307")
    path = read(tmp_path, drawing(full, version="AC1015"))
    assert np.abs(np.hypot(*((path.tips_mm - [5, 6, 7]) / [8, 4, 1])[:, :2].T) - 1.0).max() < 1e-12
    assert np.array_equal(path.tips_mm[0], path.tips_mm[-1])
    tilted = read(tmp_path, drawing("CIRCLE|8 0|10 1|20 2|30 3|40 4|210 1|220 0|230 0"))
    # x out of the plane: the plane's x axis is y, its y axis z.
    assert np.allclose(tilted.tips_mm[:, 0], 3.0)
    assert sagitta(tilted.tips_mm, np.array([3.0, 1.0, 2.0]), 4.0)[0] < 1e-12


def test_fit_points_are_on_the_spline(tmp_path: Path) -> None:
    fit = [(0, 0), (10, 5), (20, 0), (30, 8)]
    told = "|".join(f"11 {x}|21 {y}|31 0" for x, y in fit)
    path = read(tmp_path, drawing(r2000("SPLINE", "AcDbSpline", f"70 8|71 3|72 0|73 0|74 4|{told}"), version="AC1015"))
    for x, y in fit:
        assert np.linalg.norm(path.tips_mm - [x, y, 0], axis=1).min() < 0.6
    assert np.allclose(path.tips_mm[[0, -1]], [[0, 0, 0], [30, 8, 0]])


@settings(max_examples=25, deadline=None)
@given(
    scale=st.tuples(*[st.floats(0.2, 5.0) | st.floats(-5.0, -0.2)] * 3),
    turn=st.floats(0.0, 360.0),
    up=st.sampled_from([(0, 0, 1), (0, 0, -1), (1, 0, 0), (1, 2, 3), (0.01, 0, 1)]),
    bulge=st.floats(0.01, 8.0) | st.floats(-8.0, -0.01) | st.just(0.0),
)
def test_an_inserted_arc_is_where_the_drawing_rules_put_it(
    tmp_path_factory: pytest.TempPathFactory,
    scale: tuple[float, float, float],
    turn: float,
    up: tuple[float, float, float],
    bulge: float,
) -> None:
    vertices = f"VERTEX|8 0|10 0|20 0|30 0|42 {bulge!r}|0 VERTEX|8 0|10 10|20 4|30 0|0 SEQEND|8 0"
    shape = block("SHAPE", "POLYLINE|8 0|66 1|10 0|20 0|30 0", vertices)
    scales = "|".join(f"{code} {value!r}" for code, value in zip((41, 42, 43), scale, strict=True))
    direction = "|".join(f"{code} {value}" for code, value in zip((210, 220, 230), up, strict=True))
    insert = f"INSERT|8 0|2 SHAPE|10 20|20 -30|30 40|{scales}|50 {turn!r}|{direction}"
    path = read(tmp_path_factory.getbasetemp(), drawing(insert, blocks=(shape,)), step_mm=0.2)
    truth = bulged(np.array([0.0, 0.0]), np.array([10.0, 4.0]), bulge) * scale
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    truth = truth @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [20, -30, 40]
    truth = truth @ object_axes(np.array(up, dtype=float))
    assert np.abs(path.tips_mm[[0, -1]] - truth[[0, -1]]).max() < 1e-9
    assert cKDTree(path.tips_mm).query(truth)[0].max() < (0.11 if abs(bulge) > 1e-9 else np.inf)


def bulged(start: FloatArray, end: FloatArray, bulge: float) -> FloatArray:
    """Return points of the circle through the ends whose arc bulges to the right by bulge times half the chord."""
    chord = end - start
    t = np.linspace(0.0, 1.0, 400)[:, None]
    if abs(bulge) <= 1e-9:
        flat = start + t * chord
    else:
        apex = (start + end) / 2 + bulge / 2 * np.array([chord[1], -chord[0]])
        lhs = np.array([2 * (end - start), 2 * (apex - start)])
        centre = np.linalg.solve(lhs, [end @ end - start @ start, apex @ apex - start @ start])
        first = math.atan2(*(start - centre)[::-1])
        angles = first + t * 4 * math.atan(bulge)
        flat = centre + np.linalg.norm(start - centre) * np.hstack([np.cos(angles), np.sin(angles)])
    return np.hstack([flat, np.zeros((len(flat), 1))])


def object_axes(up: FloatArray) -> FloatArray:
    """Return the axes (rows) of the plane of an extrusion direction, by the arbitrary axis algorithm."""
    z = up / np.linalg.norm(up)
    other = np.array([0.0, 1.0, 0.0] if max(abs(z[:2])) < 1 / 64 else [0.0, 0.0, 1.0])
    x = np.cross(other, z)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


@pytest.mark.parametrize(("number", "unit", "mm"), [(1, "inch", 25.4), (4, "mm", 1.0), (5, "cm", 10.0), (6, "m", 1e3)])
def test_units_are_exact(tmp_path: Path, number: int, unit: str, mm: float) -> None:
    path = read(tmp_path, drawing(*SQUARE, unit=number))
    assert path.tips_mm[1].tolist() == [9 * mm, 0, 0]
    assert path.source is not None and path.source.unit == unit and path.source.unit_stated
    with pytest.raises(UnitError, match=rf"line 12: the drawing states {unit}, the job"):
        read(tmp_path, drawing(*SQUARE, unit=number), units="cm" if unit != "cm" else "mm")


@pytest.mark.parametrize("unit", [None, 0])
def test_a_drawing_without_a_unit_needs_one(tmp_path: Path, unit: int | None) -> None:
    with pytest.raises(UnitError, match=r"no unit \(\$INSUNITS\); state it with --path-units"):
        read(tmp_path, drawing(*SQUARE, unit=unit))
    assert read(tmp_path, drawing(*SQUARE, unit=unit), units="inch").tips_mm[1, 0] == 9 * 25.4


@pytest.mark.parametrize(("unit", "word"), [(2, "feet"), (13, "micrometres"), (99, "unit 99"), (-1, "unit -1")])
def test_units_that_no_path_is_in_are_refused(tmp_path: Path, unit: int, word: str) -> None:
    with pytest.raises(UnitError, match=f"line 12: the drawing is in {word} .*save it in mm, cm, m or inch"):
        read(tmp_path, drawing(*SQUARE, unit=unit))


def test_layers_are_asked_for_when_several_have_curves(tmp_path: Path) -> None:
    text = drawing(
        "CIRCLE|8 TRIM|10 0|20 0|40 5", "CIRCLE|8 Hole_1|10 0|20 0|40 1", "LINE|8 Hole_2|10 7|20 0|11 9|21 0"
    )
    refused(tmp_path, text, None, "Hole_1 (1), Hole_2 (1), TRIM (1)", "--set path.layers=")
    path = read(tmp_path, text, layers="trim")
    assert path.tips_mm.max() == 5.0
    assert message(path, 332).endswith("1 on Hole_1 (not asked for); 1 on Hole_2 (not asked for)")
    assert len(chains(read(tmp_path, text, layers="hole_?, TRIM"))) == 3
    refused(tmp_path, text, None, "path.layers = 'TRIM,none' names a layer without", layers="TRIM,none")
    refused(tmp_path, text, None, "path.layers", layers=" ,")


def test_hidden_layers_and_paper_space_are_not_read_and_told(tmp_path: Path) -> None:
    import ezdxf

    document = ezdxf.new("R2000")
    document.units = 4
    document.layers.add("FROZEN").freeze()
    document.layers.add("OFF").off()
    model = document.modelspace()
    model.add_circle((0, 0), 1)
    for layer in ("FROZEN", "OFF", "OFF"):
        model.add_circle((50, 0), 1, {"layer": layer})
    model.add_circle((60, 0), 1, {"invisible": 1})
    inner = document.blocks.new("INNER")
    inner.add_circle((70, 0), 1, {"layer": "0"})
    model.add_blockref("INNER", (0, 0), {"layer": "OFF"})
    document.layout("Layout1").add_circle((80, 0), 1)
    document.saveas(tmp_path / "layers.dxf")
    path = read_path(tmp_path / "layers.dxf")
    assert path.tips_mm[:, 0].max() == 1.0
    told = message(path, 332)
    for words in ("1 on FROZEN (frozen)", "3 on OFF (off)", "1 on 0 (invisible)", "1 in paper space", "6 entities"):
        assert words in told


def test_gaps_are_closed_up_to_the_tolerance_and_told_beyond(tmp_path: Path) -> None:
    text = drawing(*SQUARE[:2], "LINE|8 0|10 0.004|20 0|11 9|21 9.006")
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 0, 0]]
    apart = read(tmp_path, text, gap_mm=0.005)
    assert len(chains(apart)) == 1 and not np.array_equal(apart.tips_mm[0], apart.tips_mm[-1])
    assert "up to 0.006 mm away" in message(apart, 334)
    assert "path.gap_mm" in message(apart, 334)
    assert 334 not in codes(read(tmp_path, text, gap_mm=0.0))


def test_short_curves_do_not_close_upon_themselves(tmp_path: Path) -> None:
    x = np.arange(41) * 0.005
    steps = [f"LINE|8 0|10 {a:.3f}|20 0|11 {b:.3f}|21 0" for a, b in itertools.pairwise(x)]
    path = read(tmp_path, drawing(*steps))
    assert path.rapid.sum() == 1
    assert np.allclose(path.tips_mm[:, 0], x)


def test_curves_on_top_of_others_are_dropped_and_told(tmp_path: Path) -> None:
    twice = drawing(*SQUARE, "LINE|8 0|10 9|20 0|11 0|21 0", "CIRCLE|8 0|10 50|20 0|40 1", "CIRCLE|8 0|10 50|20 0|40 1")
    path = read(tmp_path, twice)
    assert [len(chain) for chain in chains(path)][:1] == [4]
    assert len(chains(path)) == 2
    assert message(path, 333).startswith("2 curves")
    crossing = drawing("LINE|8 0|10 0|20 0|11 1|21 1", "LINE|8 0|10 0|20 1|11 1|21 0")
    assert 333 not in codes(read(tmp_path, crossing))


def test_order_direction_start_and_axis(tmp_path: Path) -> None:
    text = drawing("CIRCLE|8 0|10 100|20 0|40 1", "CIRCLE|8 0|10 300|20 0|40 1", "CIRCLE|8 0|10 200|20 0|40 1")
    assert [c[0, 0] for c in chains(read(tmp_path, text))] == [101, 301, 201]
    near = read(tmp_path, text, order="nearest", start_mm=(320.0, 0.0, 0.0))
    assert [round(c[:, 0].mean(), -1) for c in chains(near)] == [300, 200, 100]
    for direction, sign in (("ccw", 1.0), ("cw", -1.0)):
        for axis in ((0.0, 0.0, 2.0), (0.0, 0.0, -1.0)):
            path = read(tmp_path, text, direction=direction, axis=axis)
            assert 303 not in {f.code for f in path.findings}
            assert np.allclose(path.axes, np.array(axis) / np.abs(axis).max())
            for loop in chains(path):
                area = np.cross(loop[:-1] - loop[0], loop[1:] - loop[0]).sum(axis=0)
                assert area @ axis * sign > 0
                assert np.array_equal(loop[0], loop[-1])
    started = read(tmp_path, text, start_mm=(300.0, -50.0, 0.0))
    assert np.allclose(chains(started)[1][0], [300, -1, 0], atol=0.2)


TWO_LINES = drawing("LINE|8 0|10 0|20 0|30 -5|11 9|21 0|31 3", "LINE|8 0|10 50|20 0|30 1|11 59|21 0|31 1")


def test_rapid_moves_at_the_height_of_the_drawing_are_told(tmp_path: Path) -> None:
    path = read(tmp_path, TWO_LINES)
    assert path.rapid.tolist() == [True, False, True, False]
    (found,) = [finding for finding in path.findings if finding.code == NO_RETRACT]
    assert found.level is Level.WARN and "2 rapid moves" in found.message
    assert "--set path.clearance_mm=" in found.message
    assert message(read(tmp_path, drawing(*SQUARE)), NO_RETRACT).count("1 rapid moves") == 1


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 3.0, 4.0), (0.0, 0.0, -1e-5)])
def test_a_clearance_lifts_all_rapid_moves_over_the_highest_point(
    tmp_path: Path, axis: tuple[float, float, float]
) -> None:
    path = read(tmp_path, TWO_LINES, clearance_mm=10.0, axis=axis, feed_mm_min=500.0)
    up = np.array(axis) / np.linalg.norm(axis)
    height = path.tips_mm @ up
    assert path.rapid.tolist() == [True, False, False, True] * 2
    assert np.allclose(height[path.rapid], height[~path.rapid].max() + 10.0)
    assert (path.feeds_mm_min[~path.rapid] == 500.0).all()
    plain = read(tmp_path, TWO_LINES, axis=axis)
    assert np.array_equal(path.tips_mm[~path.rapid], plain.tips_mm)
    # straight down along the axis, and straight up
    along = np.diff(path.tips_mm, axis=0)[[0, 2, 4, 6]]
    assert np.allclose(np.cross(along, up), 0.0) and ((along @ up > 0.0) == [False, True, False, True]).all()
    assert NO_RETRACT not in {finding.code for finding in path.findings}


@pytest.mark.parametrize(
    "options",
    [
        {"clearance_mm": 0.0},
        {"clearance_mm": math.inf},
        {"gap_mm": -1.0},
        {"gap_mm": math.nan},
        {"axis": (0.0, 0.0, 0.0)},
        {"order": "x"},
        {"direction": "up"},
        {"chord_mm": 0.0},
    ],
)
def test_options_out_of_range_are_job_errors(tmp_path: Path, options: dict[str, object]) -> None:
    with pytest.raises(JobError, match=r"path\.") as caught:
        read(tmp_path, drawing(*SQUARE), **options)
    assert next(iter(options)) in str(caught.value)


def test_a_packed_drawing_reads_like_a_plain_one(tmp_path: Path) -> None:
    packed = tmp_path / "drawing.dxf.gz"
    packed.write_bytes(gzip.compress((CORPUS / "r2000_bulges.dxf").read_bytes()))
    assert np.array_equal(read_path(packed).tips_mm, read_path(CORPUS / "r2000_bulges.dxf").tips_mm)


def test_trash_behind_the_end_line_ends_and_marks_do_not_matter(tmp_path: Path) -> None:
    plain = drawing(*SQUARE)
    tips = read(tmp_path, plain).tips_mm
    for text in (plain + "trash\nand more\n", plain.replace("\n", "\r\n"), "\ufeff" + plain, "999\nremark\n" + plain):
        assert np.array_equal(read(tmp_path, text).tips_mm, tips)


def spline(knots: str = "40 0|40 0|40 1|40 1", weights: str = "", degree: int = 1) -> str:
    points = "10 0|20 0|30 0|10 5|20 5|30 0"
    more = f"|{weights}" if weights else ""
    return drawing(r2000("SPLINE", "AcDbSpline", f"71 {degree}|{knots}{more}|{points}"), version="AC1015")


def polyline(rest: str) -> str:
    return drawing(r2000("LWPOLYLINE", "AcDbPolyline", rest), version="AC1015")


BAD = {
    "empty": (b"", None, "empty"),
    "hello": ("hello\n", 1, "holds no section"),
    "no section": ("9\n$ACADVER\n", 1, "holds no section"),
    "words": ("hello\nworld\n", 1, "group code 'hello'", "Export it again"),
    "DWG": (b"AC1015\0\0\0\0\0\0\1", None, "DWG", "save the drawing as DXF"),
    "UTF-16": (drawing(*SQUARE).encode("utf-16"), None, "UTF-16"),
    "no EOF": (drawing(*SQUARE).replace("0\nEOF\n", ""), 56, "no end (EOF)", "--recover"),
    "no ENDSEC": (drawing(*SQUARE).replace("0\nENDSEC\n0\nEOF", "0\nEOF"), 56, "ENTITIES has no end (ENDSEC)"),
    "text code": (drawing(*SQUARE).replace("11\n9\n", "eleven\n9\n", 1), 27, "group code 'eleven'"),
    "NaN": (drawing("LINE|8 0|5 A1|10 nan|20 0|11 1|21 1"), 26, "LINE #A1", "'nan' is no finite number"),
    "infinite": (drawing("CIRCLE|8 0|10 0|20 0|40 1e400"), 28, "CIRCLE", "'1e400'"),
    "comma": (drawing("LINE|8 0|10 1,5|20 0|11 1|21 1"), 24, "'1,5'", "correct it"),
    "too far": (drawing("CIRCLE|8 0|5 A1|10 1e9|20 0|40 1"), 19, "CIRCLE #A1", "coordinate_mm"),
    "huge radius": (drawing("CIRCLE|8 0|5 A1|10 0|20 0|40 1e300"), 19, "CIRCLE #A1", "is the unit right?"),
    "negative radius": (drawing("CIRCLE|8 0|5 A1|10 0|20 0|40 -1"), 19, "CIRCLE #A1", "negative radius"),
    "extrusion": (drawing("CIRCLE|8 0|10 0|20 0|40 1|210 0|220 0|230 0"), 30, "extrusion", "--recover"),
    "bulge": (polyline("90 2|70 0|10 0|20 0|42 1e300|10 5|20 5"), 19, "LWPOLYLINE #2F", "bulge of 1e+300"),
    "few knots": (spline("40 0|40 1"), 19, "SPLINE #2F", "2 knots for 2 control points"),
    "falling knots": (spline("40 0|40 2|40 1|40 1"), 19, "knots that do not rise"),
    "one knot": (spline("40 1|40 1|40 1|40 1"), 19, "knots that do not rise"),
    "zero weight": (spline(weights="41 1|41 0"), 19, "weights"),
    "one weight": (spline(weights="41 1"), 19, "weights"),
    "degree": (spline(degree=99), 19, "degree 99"),
    "no curve": (drawing("TEXT|8 0|10 0|20 0|40 1|1 x", "3DFACE|8 0|10 0|20 0"), None, "1 3DFACE, 1 TEXT"),
    "no entities": (drawing(), None, "nothing at all"),
    "missing block": (drawing("INSERT|8 0|5 A1|2 GONE|10 0|20 0"), 19, "INSERT #A1", "'gone'", "--recover"),
    "scale": (drawing("INSERT|8 0|2 X|10 0|20 0|41 0", blocks=(block("X", SQUARE[0]),)), None, "a scale is 0"),
    "a point": (drawing("LINE|8 0|10 1|20 1|11 1|21 1"), None, "holds no move"),
    "branch": (drawing(*SQUARE, "LINE|8 0|10 9|20 9|11 12|21 12"), 31, "(9, 9, 0) mm", "path.layers", "trim"),
    "unit": (drawing(*SQUARE).replace("70\n4\n", "70\nfour\n"), 12, "four"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_drawings_are_refused_with_their_place(tmp_path: Path, case: str) -> None:
    text, line, *words = BAD[case]
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    found = getattr(caught.value, "line", None)
    if case not in ("scale", "a point"):
        assert found == line
    for word in words:
        assert word.lower() in str(caught.value).lower()


def test_a_drawing_of_no_known_version_is_told_apart_from_a_damaged_one(tmp_path: Path) -> None:
    bare = drawing("LWPOLYLINE|5 2F|8 0|90 2|70 0|10 0|20 0|10 5|20 5", version="AC1015")
    for recover in (False, True):
        refused(tmp_path, bare, None, "missing 'AcDbPolyline' subclass", "export it as R2000", recover=recover)


def test_a_cut_binary_drawing_is_refused(tmp_path: Path) -> None:
    content = (CORPUS / "r12_binary.dxf").read_bytes()
    for cut in (30, 100, len(content) - 20, len(content) - 1):
        refused(tmp_path, content[:cut], None, "drawing")
    damaged = content.replace(struct.pack("<d", 25.0), struct.pack("<d", math.nan), 1)
    refused(tmp_path, damaged, None, "LINE", "'nan' is no finite number")


def test_a_block_within_itself_is_refused(tmp_path: Path) -> None:
    blocks = (block("A", "INSERT|8 0|2 B|10 0|20 0"), block("B", "INSERT|8 0|2 A|10 0|20 0"))
    refused(tmp_path, drawing("INSERT|8 0|5 A1|2 A|10 0|20 0", blocks=blocks), 89, "INSERT #A1", "into itself")


def test_a_bomb_of_blocks_is_refused_before_it_unfolds(tmp_path: Path) -> None:
    names = [f"B{level}" for level in range(12)]
    blocks = [block(name, *[f"INSERT|8 0|2 {inner}|10 1|20 0"] * 10) for name, inner in itertools.pairwise(names)]
    blocks.append(block(names[-1], *SQUARE))
    begin = time.perf_counter()
    refused(
        tmp_path, drawing("INSERT|8 0|2 B0|10 0|20 0", blocks=tuple(blocks)), None, "more than 1000000"
    ) if False else None
    with pytest.raises(FormatError, match="unfold to more than 1000000 entities"):
        read(tmp_path, drawing("INSERT|8 0|2 B0|10 0|20 0", blocks=tuple(blocks)))
    array = drawing("INSERT|8 0|2 X|10 0|20 0|70 30000|71 30000|44 1|45 1", blocks=(block("X", SQUARE[0]),))
    with pytest.raises(FormatError, match="unfold to more than 1000000 entities"):
        read(tmp_path, array)
    assert time.perf_counter() - begin < 2.0


def test_blocks_too_deep_are_refused(tmp_path: Path) -> None:
    names = [f"B{level}" for level in range(18)]
    blocks = [block(a, f"INSERT|8 0|2 {b}|10 0|20 0") for a, b in itertools.pairwise(names)]
    text = drawing("INSERT|8 0|2 B0|10 0|20 0", blocks=(*blocks, block(names[-1], *SQUARE)))
    with pytest.raises(FormatError, match="more than 16 blocks deep"):
        read(tmp_path, text)
    text = drawing("INSERT|8 0|2 B2|10 0|20 0", blocks=(*blocks, block(names[-1], *SQUARE)))
    assert len(read(tmp_path, text)) == 4


def test_too_many_points_are_refused(tmp_path: Path) -> None:
    few = Limits(path_points=20)
    refused(tmp_path, drawing("CIRCLE|8 0|10 0|20 0|40 100"), 19, "path_points", limits=few)
    refused(
        tmp_path, drawing(*[f"LINE|8 0|10 {x}|20 0|11 {x}|21 1" for x in range(11)]), 139, "path_points", limits=few
    )


def test_a_wrong_count_of_corners_is_told(tmp_path: Path) -> None:
    path = read(tmp_path, polyline("90 999999999|70 0|10 0|20 0|10 5|20 5"))
    assert path.tips_mm.tolist() == [[0, 0, 0], [5, 5, 0]]
    assert message(path, 361).startswith("1 polylines")


def test_repairs_are_told(tmp_path: Path) -> None:
    cut = read(tmp_path, drawing(*SQUARE).replace("0\nEOF\n", ""), recover=True)
    assert len(cut) == 4 and "no end (EOF)" in message(cut, 360)
    flat = read(tmp_path, drawing("CIRCLE|8 0|10 0|20 0|40 1|210 0|220 0|230 0"), recover=True)
    assert "extrusion direction is (0, 0, 0)" in message(flat, 363)
    assert np.allclose(flat.tips_mm[:, 2], 0.0)
    left = read(tmp_path, drawing(*SQUARE, "INSERT|8 0|2 GONE|10 0|20 0"), recover=True)
    assert "'GONE'" in message(left, 360)
    swapped = drawing(*SQUARE, "LINE|8 0|10 20|11 29|20 0|21 0")
    refused(tmp_path, swapped, 62, "y coordinate", "--recover")
    assert chains(read(tmp_path, swapped, recover=True))[1].tolist() == [[20, 0, 0], [29, 0, 0]]
    assert 362 in codes(read(tmp_path, drawing(*SQUARE, "LINE|8 0|10 1|20 1|11 1|21 1")))


@pytest.mark.parametrize("case", BAD)
def test_what_a_repair_is_offered_for_is_repaired(tmp_path: Path, case: str) -> None:
    text = BAD[case][0]
    if case == "missing block":  # and some curve beside it
        text = drawing(*SQUARE, "INSERT|8 0|5 A1|2 GONE|10 0|20 0")
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    if "--recover" in str(caught.value):
        assert codes(read(tmp_path, text, recover=True)) & {360, 362, 363}
    else:
        with pytest.raises(InputError):
            read(tmp_path, text, recover=True)


def test_a_drawing_that_lost_curves_is_never_repaired(tmp_path: Path) -> None:
    whole = drawing(*SQUARE)
    for cut, recover in itertools.product(range(1, whole.index("0\nENDSEC\n0\nEOF") + 3, 3), (False, True)):
        with pytest.raises(InputError) as caught:
            read(tmp_path, whole[:cut], recover=recover)
        if cut > whole.index("ENTITIES") + 9:
            assert "--recover" not in str(caught.value)
    swapped = whole.replace("11\n9\n", "eleven\n9\n", 1)
    refused(tmp_path, swapped, 27, "group code 'eleven'", "Export it again", recover=True)


def test_nothing_is_printed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    twice = drawing("LINE|5 C|8 0|10 0|20 0|11 9|21 0", "LINE|5 C|8 0|10 9|20 0|11 9|21 9")
    path = read(tmp_path, twice)
    assert "non-unique entity handle #C" in message(path, 360)
    assert capfd.readouterr() == ("", "")


SEEDS = sorted(CORPUS.iterdir())


def survives(path: Path, content: bytes, *, recover: bool) -> None:
    path.write_bytes(content)
    try:
        result = read_path(path, units=None, recover=recover, limits=Limits(path_points=20_000))
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(result.tips_mm).all()


@pytest.mark.parametrize("seed", SEEDS, ids=lambda p: p.name)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_damaged_bytes_never_raise_anything_else(
    tmp_path_factory: pytest.TempPathFactory, seed: Path, data: st.DataObject
) -> None:
    content = bytearray(seed.read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(1, len(content)) | st.just(len(content)))
    path = tmp_path_factory.getbasetemp() / "damaged.dxf"
    survives(path, bytes(content[:cut]), recover=data.draw(st.booleans()))


def test_a_cut_text_is_never_read_as_whole(tmp_path: Path) -> None:
    content = (CORPUS / "r12_lines_arc.dxf").read_bytes()
    for cut in range(1, len(content) - 5, 7):
        with pytest.raises(InputError):
            read(tmp_path, content[:cut])
