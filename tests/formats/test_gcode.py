"""The G-code reader against programs whose truth is known."""

from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.gcode import read_path
from sicp_formats.gcode.axis import angles_near, axis_from_angles

HEAD = "G21 G90\n"
START = HEAD + "G0 X0. Y0. Z0.\n"


def read(tmp_path: Path, text: str, **options: object) -> ToolPath:
    path = tmp_path / "path.nc"
    path.write_text(text, encoding="utf-8")
    return read_path(path, **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def refused(tmp_path: Path, text: str, line: int, *words: str, **options: object) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, **options)
    assert caught.value.line == line
    assert f"path.nc, line {line}: " in str(caught.value)
    assert str(caught.value).isprintable()
    for word in words:
        assert word in str(caught.value)


DISC = """%
O1001 (CIRCLE DEBURR)
N10 G21 G90 G17
N20 T1 M6
N30 S18000 M3
N40 G0 X100.000 Y0.000 Z40.000
N50 G1 Z0.000 F600.
N60 G3 X100.000 Y0.000 I-100.000 J0.000 F1500.
N70 G1 Z40.000 F3000.
N80 M5
N90 M30
%
"""


def test_reads_a_full_circle(tmp_path: Path) -> None:
    path = read(tmp_path, DISC)
    circle = path.tips_mm[1:-1]
    steps = np.linalg.norm(np.diff(circle, axis=0), axis=1)
    middles = (circle[1:] + circle[:-1]) / 2
    assert path.tips_mm[0].tolist() == [100, 0, 40]
    assert path.tips_mm[-1].tolist() == [100, 0, 40]
    assert circle[0].tolist() == circle[-1].tolist() == [100, 0, 0]
    assert np.abs(np.linalg.norm(circle, axis=1) - 100).max() < 1e-9
    assert steps.max() <= 2.0
    assert 100 - np.linalg.norm(middles, axis=1).min() <= 0.005
    turned = circle[:-1, 0] * circle[1:, 1] - circle[:-1, 1] * circle[1:, 0]
    assert turned.min() > 0  # counter-clockwise all the way
    assert path.feeds_mm_min[[0, 1, -1]].tolist() == [0, 600, 3000]
    assert set(path.feeds_mm_min[2:-1].tolist()) == {1500}
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    assert (path.axes == [0, 0, 1]).all()
    assert path.lines.tolist() == [6, 7, *[8] * (len(circle) - 1), 9]
    assert path.name == "O1001"
    assert [(e.kind, e.value, e.before_move, e.text) for e in path.events] == [
        (EventKind.COMMENT, 0, 0, "CIRCLE DEBURR"),
        (EventKind.TOOL, 1, 0, "T1 M6"),
        (EventKind.SPINDLE, 18000, 0, "M3 S18000"),
        (EventKind.SPINDLE, 0, len(path), "M5"),
    ]
    assert codes(path) == {306}


def test_letters_numbers_and_blanks(tmp_path: Path) -> None:
    text = "g21g90g1f600x10.y.5z-0\nX 1 Y -12.607 z=+2 ; end\nN5X=1.5(c1)Y3(c2)\n\n/1 X99\nM2"
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[10, 0.5, 0], [1, -12.607, 2], [1.5, 3, 2]]
    assert [e.text for e in path.events] == ["end", "c1", "c2", "/1 X99"]
    assert codes(path) == {311}
    assert read(tmp_path, text, block_skip=False).tips_mm[-1].tolist() == [99, 3, 2]


def test_modal_motion_distance_and_feed(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "G0 X0 Y0 Z5\nG1 Z0 F100\nX5\nG91\nX1 Y1 F200\nG0 Z5\nG90 G1 X0\nM2")
    assert path.tips_mm.tolist() == [[0, 0, 5], [0, 0, 0], [5, 0, 0], [6, 1, 0], [6, 1, 5], [0, 1, 5]]
    assert path.feeds_mm_min.tolist() == [0, 100, 100, 200, 0, 200]


def test_inches_wherever_the_word_stands(tmp_path: Path) -> None:
    path = read(tmp_path, "F10\nG20 G90\nG1 X1 Y0 Z0\nX2 F20\nM2")
    assert path.tips_mm[:, 0].tolist() == [25.4, 50.8]
    assert path.feeds_mm_min.tolist() == [254, 508]
    assert read(tmp_path, "G70 G1 X1 Y0 Z0 F1\nX2").tips_mm[0, 0] == 25.4
    assert read(tmp_path, "G1 X1 Y0 Z0 F1\nX2\nM2", units="inch").tips_mm[0, 0] == 25.4
    with pytest.raises(UnitError, match=r"path\.nc, line 1: the file states inch"):
        read(tmp_path, "G20\nG1 X1 Y0 Z0 F1\nX2", units="mm")


def test_missing_unit_and_end_are_findings(tmp_path: Path) -> None:
    assert codes(read(tmp_path, "G1 X1. Y0 Z0 F1\nX2")) == {301, 316}
    assert codes(read(tmp_path, START + "X1\nM30\n%\n\nX9\n")) == {312}


def test_inverse_time_and_feed_per_revolution(tmp_path: Path) -> None:
    path = read(tmp_path, START + "G93 G1 X10 F6\nG94 G1 Z1 F50\nS1000 M3\nG95 X0 F0.2\nM2")
    assert path.feeds_mm_min.tolist() == [0, 60, 50, 200]
    arc = read(tmp_path, START + "G93 G3 X10 Y0 I5 F2\nM2")
    assert arc.feeds_mm_min[-1] == pytest.approx(2 * 5 * np.pi)


@pytest.mark.parametrize(
    ("block", "middle", "end"),
    [
        ("G17 G2 X0 Y-10 I-10 J0", [7.0710678, -7.0710678, 0], [0, -10, 0]),
        ("G17 G3 X0 Y10 R10", [7.0710678, 7.0710678, 0], [0, 10, 0]),
        ("G17 G2 X0 Y10 R-10", [-7.0710678, -7.0710678, 0], [0, 10, 0]),
        ("G17 G3 X0 Y10 CR=10", [7.0710678, 7.0710678, 0], [0, 10, 0]),
        ("G18 G2 X0 Z10 I-10 K0", [7.0710678, 0, 7.0710678], [0, 0, 10]),
        ("G18 G3 X0 Z-10 I-10", [7.0710678, 0, -7.0710678], [0, 0, -10]),
        ("G90.1 G3 X0 Y10 I0 J0", [7.0710678, 7.0710678, 0], [0, 10, 0]),
        ("G3 X0 Y10 Z4 I-10", [7.0710678, 7.0710678, 2], [0, 10, 4]),
    ],
)
def test_arcs_in_their_planes(tmp_path: Path, block: str, middle: list[float], end: list[float]) -> None:
    path = read(tmp_path, HEAD + f"G0 X10 Y0 Z0\nF100 {block}\nM2", step_mm=100.0)
    assert path.tips_mm[-1].tolist() == end
    assert np.linalg.norm(path.tips_mm - middle, axis=1).min() < 0.4
    assert np.abs(np.delete(path.tips_mm, np.argmin(np.ptp(path.tips_mm, axis=0)), axis=1)).max() <= 10 + 1e-9


def test_arc_in_the_yz_plane(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "G0 X0 Y10 Z0\nG19 G3 Y0 Z10 J-10 K0 F100\nM2")
    assert np.allclose(np.linalg.norm(path.tips_mm[:, 1:], axis=1), 10)
    assert (path.tips_mm >= -1e-12).all()  # the short way: from +Y to +Z


def test_tool_axis_from_vectors(tmp_path: Path) -> None:
    siemens = read(tmp_path, START + "TRAORI\nG1 X1 A3=0.6 B3=0 C3=0.8 F100\nX2\nX3 C3=2\nTRAFOOF\nM2")
    assert np.allclose(siemens.axes, [[0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8], [0, 0, 1]])
    fanuc = read(tmp_path, START + "G43.5 H1\nG1 X1 I0 J-0.6 K0.8 F100\nX2\nG49\nG3 X4 I1 J0\nM2")
    assert np.allclose(fanuc.axes[1:], [0, -0.6, 0.8])
    assert [e.text for e in fanuc.events] == ["G43.5 H1", "G49"]
    assert 305 in codes(read(tmp_path, START + "TRAORI(1)\nG1 X1 C3=1 F9\nX2 A3=0 B3=0 C3=0\nM2"))


@pytest.mark.parametrize(
    ("rotary", "words", "axis"),
    [
        ("AC", "A30 C0", [0, -0.5, 0.8660254]),
        ("AC", "A30 C90", [0.5, 0, 0.8660254]),
        ("BC", "B30 C0", [0.5, 0, 0.8660254]),
        ("BC", "B30 C90", [0, 0.5, 0.8660254]),
        ("AB", "A0 B90", [1, 0, 0]),
        ("BA", "B0 A-90", [0, 1, 0]),
    ],
)
def test_rotary_angles_need_a_convention(tmp_path: Path, rotary: str, words: str, axis: list[float]) -> None:
    text = START + f"G43.4 H1\nG1 X1 {words} F100\nX2\nM2"
    assert np.allclose(read(tmp_path, text, rotary=rotary).axes[1:], axis, atol=1e-7)
    refused(tmp_path, text, 4, "rotary axes", "path.rotary")
    assert 313 in codes(read(tmp_path, text.replace("G43.4 H1", ""), rotary=rotary))
    assert np.allclose(read(tmp_path, START + "G1 X1 A0 C0. F100\nM2").axes, [0, 0, 1])


def test_events_of_the_machine(tmp_path: Path) -> None:
    text = (
        "G54\n"
        + START
        + 'T5\nM6\nS900\nM4\nM8\nG4 P1.5\nG4 P250\nG4 X2\nG54\nG64\nM428\nM0\nM9\nMSG("hi")\nG1 X1 F9\nS800\nM30'
    )
    path = read(tmp_path, text)
    assert [(e.kind, e.value) for e in path.events] == [
        (EventKind.OTHER, 0), (EventKind.OTHER, 0), (EventKind.TOOL, 5), (EventKind.OTHER, 0),
        (EventKind.SPINDLE, -900), (EventKind.COOLANT, 1), (EventKind.DWELL, 1.5), (EventKind.DWELL, 0.25),
        (EventKind.DWELL, 2), (EventKind.OTHER, 0), (EventKind.OTHER, 0), (EventKind.OTHER, 0),
        (EventKind.STOP, 0), (EventKind.COOLANT, 0), (EventKind.COMMENT, 0), (EventKind.SPINDLE, -800),
    ]  # fmt: skip
    assert [e.text for e in path.events if e.kind is EventKind.OTHER] == ["G54", "T5", "S900", "G54", "G64", "M428"]
    assert codes(path) == {314}


def test_moves_before_the_position_is_known_are_not_in_the_path(tmp_path: Path) -> None:
    text = HEAD + "G0 X5. Y5\nG43 H1 Z50\nG1 Z0 F100\nG0 Z50\nG91 G28 Z0\nG90 G0 X9 Y9\nZ50\nM2"
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[5, 5, 50], [5, 5, 0], [5, 5, 50], [9, 9, 50]]
    assert codes(path) == {310, 318}
    assert [e.text for e in path.events] == ["G0 X5. Y5", "G43 H1", "G28 Z0", "G0 X9 Y9"]


def test_block_numbers_may_wrap_but_not_restart(tmp_path: Path) -> None:
    assert len(read(tmp_path, START + "N9998 X1\nN9999 X2\nN1 X3\nM2")) == 4
    refused(tmp_path, START + "N10 X1\nN20 X2\nN10 X3\n", 5, "N10 after N20")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("G1 X1\n", 3, ["zero feed"]),
        ("G1 X1 F0\n", 3, ["zero feed"]),
        ("G93\nG1 X1 F2\nX2\n", 5, ["F word missing"]),
        ("G1 X1 F-5\n", 3, ["negative F"]),
        ("G1 X1 X2 F9\n", 3, ["multiple X words"]),
        ("G0 G1 X1 F9\n", 3, ["modal group"]),
        ("G90 G91\n", 3, ["modal group"]),
        ("G2 X1 F9\n", 3, ["R i j k words all missing"]),
        ("G2 X1 I.5 R.5 F9\n", 3, ["mixed radius-ijk"]),
        ("G2 X2 I.5 F9\n", 3, ["differs from radius to start"]),
        ("G2 X2 R.5 F9\n", 3, ["radius too small"]),
        ("G2 X0 R5 F9\n", 3, ["full circle with R"]),
        ("G2 X0 I0 F9\n", 3, ["zero-radius"]),
        ("G2 X1 I.5 K2 F9\n", 3, ["K word given"]),
        ("G2 X1 I.5 P3 F9\n", 3, ["several turns"]),
        ("G90.1 G2 X1 I.5 F9\n", 3, ["both needed"]),
        ("G1 X1 I1 F9\n", 3, ["I word"]),
        ("G1 X1 (open\n", 3, ["unclosed"]),
        ("G1 X1 (a (b) F9\n", 3, ["nested comment"]),
        ("G1 X\n", 3, ["X word without a number"]),
        ("G1 X1,5 Y2.5 F9\n", 3, ["bad character ','"]),
        ("G1 X1 2 F9\n", 3, ["bad character"]),
        ("G1 X\u0661 F9\n", 3, ["without a number"]),
        ("#1=5\n", 3, ["variables"]),
        ("G1 X[1+2] F9\n", 3, ["expressions"]),
        ("R1=10\n", 3, ["parameters"]),
        ("G1 X=AC(10+1) F9\n", 3, ["expressions"]),
        ("G1 X=DC(10) F9\n", 3, ["X=DC", "plain numbers"]),
        ("G1 X10 ,R5 F9\n", 3, ["bad character ','", "path.decimal"]),
        ("G1 Y5 L2 F9\n", 3, ["L word"]),
        ("G44 H1 Z5\n", 3, ["G44", "tool offsets"]),
        ("O100 WHILE\n", 3, ["WHILE"]),
        ("X1\nO200\n", 4, ["O200"]),
        ("M98 P100\n", 3, ["subprograms"]),
        ("G65 P9000\n", 3, ["macros"]),
        ("G41 D1\n", 3, ["compensation"]),
        ("G68.2 X0 Y0 Z0 I0 J0 K0\n", 3, ["G68.2"]),
        ("G81 X1 Y1 Z-1 R1 F9\n", 3, ["canned"]),
        ("CYCLE800()\n", 3, ["CYCLE800"]),
        ("G92 X0\n", 3, ["G92"]),
        ("G77\n", 3, ["unknown g code used: G77"]),
        ("G20\n", 3, ["unit changes"]),
        ("G80\nX1\n", 4, ["motion mode"]),
        ("G1 X1 U2 F9\n", 3, ["U word"]),
        ("Q5\n", 3, ["Q word"]),
        ("G53 G1 X1 F9\n", 3, ["machine coordinates"]),
        ("G5.1 X1 Y1 I2\n", 3, ["spline"]),
        ("G1 X1e5 F9\n", 3, ["E word"]),
        ("G1 X99999999 F9\n", 3, ["coordinate_mm"]),
        (f"G1 X1{'0' * 400} F9\n", 3, ["coordinate_mm"]),
        (f"G2 X1 I1{'0' * 400} F9\n", 3, ["coordinate_mm"]),
        ("G43.5 H1\nG2 X1 I.5 J0 F9\n", 4, ["G43.5"]),
        ("A3=0 B3=0 C3=0 X1\n", 3, ["axis is (0, 0, 0)"]),
        ("G4\n", 3, ["dwell"]),
        ("G4 P1 X2\n", 3, ["G4 needs one dwell time"]),
        ("G4 P1. Y2\n", 3, ["G4 with coordinates"]),
        ("M3 M5\n", 3, ["M3, M4, M5"]),
    ],
)
def test_bad_blocks_name_their_line(tmp_path: Path, text: str, line: int, words: list[str]) -> None:
    refused(tmp_path, START + text, line, *words)


def test_feed_option_stands_in_for_a_missing_feed(tmp_path: Path) -> None:
    path = read(tmp_path, START + "G1 X1\nG3 X3 I1\nM2", feed_mm_min=700.0)
    assert set(path.feeds_mm_min[1:].tolist()) == {700}
    assert codes(path) == {306}


def test_programs_that_are_no_path(tmp_path: Path) -> None:
    refused(tmp_path, "%\n", 1, "no move")
    refused(tmp_path, "%\n%\n", 1, "no move")
    refused(tmp_path, "G21\nG0 X0 Y0 Z0\n", 2, "one point")
    refused(tmp_path, "X1\n", 1, "motion mode")
    refused(tmp_path, "G91 G0 X1\n", 1, "incremental")
    refused(tmp_path, "G1 X1 F9\n", 1, "before X, Y and Z are known")
    refused(tmp_path, "G3 X1 I1 F9\n", 1, "before X, Y and Z are known")
    refused(tmp_path, START + "G2 X0 Y0 I1000000 F1\n", 3, "path_points", limits=Limits(path_points=1000))


def test_bad_options_are_job_errors(tmp_path: Path) -> None:
    for options in ({"rotary": "AA"}, {"feed_mm_min": -1.0}, {"step_mm": 0.0}):
        with pytest.raises(JobError, match=rf"path\.{next(iter(options))}"):
            read(tmp_path, DISC, **options)


def test_the_manner_of_a_single_word(tmp_path: Path) -> None:
    text = START + "G1 X=AC(10) Y = 5 Z2 F9\nG91\nX=AC(3) Y=IC(1) Z1\nG90 X=IC(-2)\nG2 X1 Y8 I=AC(1) J=AC(7)\nM2"
    path = read(tmp_path, text, step_mm=100.0)
    assert path.tips_mm[1:4].tolist() == [[10, 5, 2], [3, 6, 3], [1, 6, 3]]
    assert np.allclose(np.linalg.norm(path.tips_mm[4:, :2] - [1, 7], axis=1), 1)
    turned = read(tmp_path, START + "TRAORI\nG1 X1 B=DC(30) C=ACP(10) F9\nC=IC(5) X2\nM2", rotary="BC")
    assert np.allclose(turned.axes[2], [0.5 * np.cos(np.radians(15)), 0.5 * np.sin(np.radians(15)), 0.75**0.5])


def test_decimal_commas_where_they_can_be_nothing_else_or_are_stated(tmp_path: Path) -> None:
    text = "G21 G90\nG0 X0 Y0 Z0 (a, b.)\nG1 X10,5 Y-,25 F100,5 ; c, d\nX11 Z2,5\nM2"
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[0, 0, 0], [10.5, -0.25, 0], [11, -0.25, 2.5]]
    assert path.feeds_mm_min[1] == 100.5
    assert [event.text for event in path.events] == ["a, b.", "c, d"]
    assert read(tmp_path, text, decimal=",").tips_mm.tolist() == path.tips_mm.tolist()
    refused(tmp_path, text, 3, "bad character ','", "path.decimal", decimal=".")
    with pytest.raises(JobError, match=r"path\.decimal"):
        read(tmp_path, text, decimal="x")


def test_words_that_cannot_move_the_tool_are_kept(tmp_path: Path) -> None:
    text = START + (
        'T="MILL (6); 2"\nM6\nD1\nS1=9000 M1=3\nG64 SOFT COMPCAD ADIS=0.1\nCYCLE832(0.01,_ORI,1)\nM777\n'
        "G1 X1 F9\nM13\nM2"
    )
    path = read(tmp_path, text)
    texts = [event.text for event in path.events]
    assert 'T="MILL (6); 2" M6' in texts
    assert {"D1", "S1=9000 M1=3", "CYCLE832(0.01,_ORI,1)", "M777", "M13"} <= set(texts)
    assert [(f.code, f.where[-6:]) for f in path.findings] == [(308, "line 6")]
    assert "3 statements" in path.findings[0].message
    assert "S1=9000; M1=3; M777" in path.findings[0].message


def test_heidenhain_iso(tmp_path: Path) -> None:
    path = read_path(CORPUS / "heidenhain.iso", rotary="AC")
    assert path.name == "TRIM5"
    assert path.source is not None
    assert path.source.unit_stated
    assert path.tips_mm[[0, 1, -1]].tolist() == [[50, 0, 100], [50, 0, 0], [20.25, 60, 100]]
    assert [event.text for event in path.events][:3] == [
        "%TRIM5 G71 *",
        "G30 G17 X-100 Y-100 Z-20",
        "G31 G90 X+100 Y+100 Z+0",
    ]
    head = "%A G71 *\nN1 G00 G90 X+0 Y+0 Z+0 *\n"
    refused(tmp_path, head + "N2 G15 X+1 *\n", 3, "G15", "Heidenhain")
    refused(tmp_path, head + "N2 G02 X+1 I+0,5 J+0 F1 *\n", 3, "pole")


CORPUS = Path(__file__).parents[1] / "corpus" / "gcode"
SEEDS = [
    ("fanuc_g43_4.nc", "AC", 8, {310, 318}, [0.1710101, 0.2961981, 0.9396926]),
    ("fanuc_g43_5.nc", None, 6, set(), [0, 0.3420201, 0.9396926]),
    ("siemens_traori.mpf", None, 5, {308, 318}, [0.4, 0.3, 0.8660254]),
    ("siemens_rotary.mpf", "BC", 5, set(), [0.5072135, 0.0894354, 0.8571673]),
    ("linuxcnc_g93.ngc", "BC", 6, set(), [0.2931688, 0.1761539, 0.9396926]),
    ("haas_g234.nc", "BC", 5, {310, 318}, [0.1652453, 0.0954044, 0.9816272]),
    ("three_axis_arcs.nc", None, 376, {306, 310, 311, 312, 318}, [0, 0, 1]),
]


@pytest.mark.parametrize(("name", "rotary", "moves", "found", "axis"), SEEDS)
def test_programs_of_the_usual_controls(
    name: str, rotary: str | None, moves: int, found: set[int], axis: list[float]
) -> None:
    path = read_path(CORPUS / name, rotary=rotary)
    assert len(path) == moves
    assert codes(path) == found
    if name == "fanuc_g43_4.nc":
        axis = [np.sin(np.radians(-20)), 0, np.cos(np.radians(-20))]
    assert np.allclose(path.axes[-1], axis, atol=1e-6)


@pytest.mark.parametrize("rotary", ["AC", "BC", "AB", "BA"])
def test_angles_of_an_axis_are_the_nearest_and_give_it_back(rotary: str) -> None:
    rng = np.random.default_rng(1)
    for axis in rng.normal(size=(100, 3)):
        axis /= np.linalg.norm(axis)
        near = dict(zip("ABC", rng.uniform(-400, 400, 3), strict=True))
        angles = angles_near(rotary, tuple(axis.tolist()), near)
        assert np.allclose(axis_from_angles(rotary, near | angles), axis, atol=1e-12)
        assert all(abs(angles[letter] - near[letter]) <= 180 for letter in rotary)
        assert sum(abs(angles[letter] - near[letter]) for letter in rotary) <= 270
        exact = {letter: near[letter] for letter in rotary}
        back = angles_near(rotary, axis_from_angles(rotary, near), near)
        assert np.allclose([back[x] for x in rotary], [exact[x] for x in rotary], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [  # what every reader of paths must refuse, in the words of LinuxCNC where it has them
        ("G1 X1\n", 3, ["cannot do G1 with zero feed rate", "path.feed_mm_min"]),
        ("G1 X1 X2 F9\n", 3, ["multiple X words on one line"]),
        ("G2 X1 I.5 R.5 F9\n", 3, ["mixed radius-ijk format for arc"]),
        ("G1 X1 F9 (no end\n", 3, ["unclosed comment", "close it"]),
        ("G20\n", 3, ["the length unit changes"]),
        ("N20 G1 X1 F9\nN10 X2\n", 4, ["N10 after N20", "--recover"]),
        ("O100 SUB\n", 3, ["SUB"]),
        ("#1=7\n", 3, ["variables and expressions are not evaluated"]),
        ("TRAORI\nG1 X1 A3=0 B3=0 C3=0 F9\n", 4, ["the tool axis is (0, 0, 0)"]),
        ("G93 G1 X1 F2\nX2\n", 4, ["F word missing with inverse time"]),
        ("S900\nG95 G1 X1 F.2\n", 4, ["zero feed rate", "turning spindle"]),
    ],
)
def test_bad_input_72_and_73(tmp_path: Path, text: str, line: int, words: list[str]) -> None:
    refused(tmp_path, START + text, line, *words)


def test_repeated_points_and_long_axes_are_findings(tmp_path: Path) -> None:
    path = read(tmp_path, START + "TRAORI\nG1 X1 A3=0 B3=0 C3=2 F9\nX1\nX2\nM2")
    assert codes(path) == {304, 307}
    refused(tmp_path, "%\n", 1, "no move")
    refused(tmp_path, "G0 X1 Y1 Z1\nM2\n", 1, "one point")


def test_recover_drops_what_is_cut_and_guesses_nothing(tmp_path: Path) -> None:
    cut = START + "G1 X1 F9\nX2\nM3 S"
    refused(tmp_path, cut, 5, "S word without a number", "--recover")
    path = read(tmp_path, cut, recover=True)
    assert path.tips_mm[-1].tolist() == [2, 0, 0]
    assert [(f.code, f.where[-6:]) for f in path.findings] == [(350, "line 5")]
    for recover in (False, True):  # what moves is never dropped
        with pytest.raises(FormatError, match=r"line 4: Y word without a number.*export it again") as caught:
            read(tmp_path, START + "G1 X1 F9\nX2 Y", recover=recover)
        assert "--recover" not in str(caught.value)
        # a whole number may have been a longer one
        path = read(tmp_path, START + "G1 X1 F9\nX25", recover=recover)
        assert path.tips_mm[-1].tolist() == [25, 0, 0]
        assert [(f.code, f.level) for f in path.findings] == [(316, Level.WARN)]
        assert "whose line has no end" in path.findings[0].message
    assert codes(read(tmp_path, START + "G1 X1 F9\nM30", recover=True)) == set()
    joined = START + "N20 G1 X1 F9\nN10 X2\nM2\n"
    path = read(tmp_path, joined, recover=True)
    assert (path.tips_mm[-1].tolist(), codes(path)) == ([2, 0, 0], {355})
    with pytest.raises(FormatError, match="line 4: Y word without a number"):
        read(tmp_path, START + "G1 X1 F9\nX2 Y\nX3\n", recover=True)


def test_padding_after_a_crash(tmp_path: Path) -> None:
    content = (START + "G1 X1 F9\nX2\n").encode() + bytes(512)
    file = tmp_path / "path.nc"
    file.write_bytes(content)
    with pytest.raises(FormatError, match=r"512 NUL bytes, .* --recover") as caught:
        read_path(file)
    assert caught.value.byte == len(content) - 512
    path = read_path(file, recover=True)
    assert codes(path) == {316, 352}
    assert path.original is not None
    assert path.original.rewritten(path, np.arange(3)).content == content


def test_a_feed_outlives_the_unit_stated_twice(tmp_path: Path) -> None:
    path = read(tmp_path, START + "G1 X1 F100\nX2 F200\nG21\nX3\nM2")
    assert path.feeds_mm_min.tolist() == [0, 100, 200, 200]


def test_the_fast_way_and_the_general_way_agree(tmp_path: Path) -> None:
    body = [
        "N1 G1 X1. Y-.5 Z+2 A3=.1 B3=0 C3=1 F100",
        "X2 I.1 K1",
        "N3 G01 Y3 A3=1 C3=1",
        "G0 Z9",
        "G1 X=4 J-1 K2 F=50",
    ]
    text = START + "G43.5 H1\n" + "\n".join(body) + "\nM2"
    slow = START + "G43.5 H1\n" + "\n".join(f"{line} M8" for line in body) + "\nM2"
    fast, general = read(tmp_path, text), read(tmp_path, slow)
    assert fast.tips_mm.tolist() == general.tips_mm.tolist()
    assert fast.axes.tolist() == general.axes.tolist()
    assert fast.feeds_mm_min.tolist() == general.feeds_mm_min.tolist()
