"""A G-code program written again: byte for byte where nothing moves, else itself with other numbers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import SicpError
from sicp_cam.findings import Level
from sicp_cam.model import Rewritten, ToolPath
from sicp_formats.gcode import read_path
from sicp_formats.gcode.style import number_like

CORPUS = Path(__file__).parents[1] / "corpus" / "gcode"
ROTARY = {
    "fanuc_g43_4.nc": "AC", "siemens_rotary.mpf": "BC", "heidenhain.iso": "AC", "linuxcnc_g93.ngc": "BC",
    "haas_g234.nc": "BC",
}  # fmt: skip
SEEDS = sorted(path.name for path in CORPUS.iterdir())
HEAD = "G21 G90\nG0 X0 Y0 Z0\n"
TURN = Rotation.from_rotvec([0.01, -0.02, 0.03]).as_matrix()


def read(tmp_path: Path, content: str | bytes, **options: object) -> ToolPath:
    file = tmp_path / "path.nc"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_path(file, **options)  # type: ignore[arg-type]


def rewrite(path: ToolPath, new: ToolPath, source: np.ndarray | None = None) -> Rewritten:
    assert path.original is not None
    return path.original.rewritten(new, np.arange(len(path)) if source is None else source)


def moved(path: ToolPath, by: tuple[float, float, float] = (1.0, 2.0, 3.0), turn: np.ndarray | None = None) -> ToolPath:
    T = np.eye(3) if turn is None else turn
    return replace(path, tips_mm=path.tips_mm @ T.T + by, axes=path.axes @ T.T)


def lines(rewritten: Rewritten) -> list[str]:
    assert not [finding for finding in rewritten.findings if finding.level is Level.FAIL]
    return rewritten.content.decode().split("\n")


def with_tip(path: ToolPath, move: int, tip: list[float]) -> ToolPath:
    tips = np.array(path.tips_mm)
    tips[move] = tip
    return replace(path, tips_mm=tips)


@pytest.mark.parametrize("name", SEEDS)
def test_a_path_as_it_was_read_gives_the_same_bytes(name: str) -> None:
    path = read_path(CORPUS / name, rotary=ROTARY.get(name))
    content = (CORPUS / name).read_bytes()
    assert rewrite(path, path) == Rewritten(content)
    # below what the program can say, but by the long way
    assert rewrite(path, moved(path, (1e-6, -1e-6, 1e-6))).content == content
    assert path.original is not None
    assert path.original.suffix == Path(name).suffix


@pytest.mark.parametrize("name", SEEDS)
@pytest.mark.parametrize("turn", [None, TURN], ids=["shifted", "turned"])
def test_a_moved_path_is_read_back_from_what_was_written(tmp_path: Path, name: str, turn: np.ndarray | None) -> None:
    path = read_path(CORPUS / name, rotary=ROTARY.get(name))
    new = moved(path, turn=turn)
    result = rewrite(path, new)
    lines(result)
    file = tmp_path / name
    file.write_bytes(result.content)
    back = read_path(file, rotary=ROTARY.get(name))
    assert np.abs(back.tips_mm - new.tips_mm).max() < 2e-4
    off = np.abs(back.axes - new.axes).max(axis=1) > 1e-6
    said = {321, 327} & {finding.code for finding in result.findings}
    assert bool(off.any()) == bool(said)
    assert back.rapid.tolist() == path.rapid.tolist()
    assert [event.kind for event in back.events] == [event.kind for event in path.events]
    # nothing but numbers and their words has changed in lines that hold no move
    assert rewrite(back, moved(back, (0, 0, 0))).content == result.content


def test_numbers_keep_their_style_and_modal_blocks_get_the_word_they_lack(tmp_path: Path) -> None:
    text = HEAD + "N1 G1 X10. Y+5.000 Z0 F100\nX20. ( end ) M8\ny6\nX.5\nG0 Z-.5;up\nM2\n"
    path = read(tmp_path, text)
    assert lines(rewrite(path, moved(path, (0.25, 0, 0))))[2:6] == [
        "N1 G1 X10.25 Y+5.000 Z0 F100", "X20.25 ( end ) M8", "y6", "X.75",
    ]  # fmt: skip
    new = with_tip(path, 2, [20, 5, 0.123456])
    assert lines(rewrite(path, new))[2:6] == [
        "N1 G1 X10. Y+5.000 Z0 F100", "X20. Z.1235 ( end ) M8", "y6 Z.0", "X.5",
    ]  # fmt: skip
    tight = read(tmp_path, "G21G90\nG0X0Y0Z0\nN5G1X1Y2F9\nN6Y3\nM2")
    assert lines(rewrite(tight, with_tip(tight, 2, [1, 3, -1.25])))[3] == "N6Y3Z-1.25"


@pytest.mark.parametrize(
    ("token", "value", "written"),
    [("10.", -0.00004, "0."), ("-3.500", 3.5, "3.500"), ("+1", 2.5, "+2.5"), (".5", 0.0, ".0"), ("0.5", 0.25, "0.25"),
     ("1.123456", 2.0, "2.000000"), ("7", 1234567.00004, "1234567"), ("-.1", -0.2, "-.2")],
)  # fmt: skip
def test_numbers_are_written_like_others(token: str, value: float, written: str) -> None:
    assert number_like(token, value, 4) == written


def test_rounding_does_not_add_up_in_increments(tmp_path: Path) -> None:
    text = HEAD + "G91 G1 F100\n" + "X0.1 Y0.1\n" * 300 + "X=AC(50) Y=IC(1)\nG90 X0\nM2\n"
    path = read(tmp_path, text)
    assert rewrite(path, moved(path, (0, 0, 1e-7))).content == text.encode()
    new = replace(path, tips_mm=path.tips_mm * [1.000123456, 0.999, 1])
    result = rewrite(path, new)
    lines(result)
    back = read(tmp_path, result.content)
    assert np.abs(back.tips_mm - new.tips_mm).max() < 1e-4


def test_added_moves_become_lines_before_the_stop_of_their_block(tmp_path: Path) -> None:
    text = HEAD + "N10 G1 X10 F100 (cut) M0\r\nN20 Y10\nM2\n"
    path = read(tmp_path, text)
    source = np.array([0, 1, 1, 1, 2, 2])
    tips = [[0, 0, 0], [3, 0, 1], [6, 0, 2], [10, 0, 0], [10, 5, 0], [10, 10, 0]]
    new = replace(
        path, tips_mm=tips, axes=path.axes[source], feeds_mm_min=path.feeds_mm_min[source], rapid=path.rapid[source],
        lines=path.lines[source],
    )  # fmt: skip
    result = rewrite(path, new, source)
    assert result.content.decode() == HEAD + (
        "N10 G1 X3 Z1 F100 (cut)\r\nX6 Y0 Z2\r\nX10 Y0 Z0 M0\r\nN20 Y5\nX10 Y10 Z0\nM2\n"
    )
    assert result.findings == ()


ARCS = HEAD + "G2 X10 Y0 I5 J0 F100\nX20 I5 J0\nG3 X30 R5\nX40 R5\nG1 X50\nM2\n"


def test_only_arcs_that_change_become_blocks_and_modes_are_stated_again(tmp_path: Path) -> None:
    path = read(tmp_path, ARCS)
    second = np.flatnonzero(path.lines == 4)
    tips = np.array(path.tips_mm)
    tips[second[1:-1], 2] += 0.01  # its end stays
    result = rewrite(path, replace(path, tips_mm=tips))
    written = lines(result)
    assert written[:3] == ARCS.split("\n")[:3]
    assert written[3].startswith("G1 X10.0")
    assert all(line.startswith("X") for line in written[4 : 2 + len(second)])
    assert written[3 + len(second) :] == ARCS.split("\n")[4:]
    assert [(finding.code, finding.level) for finding in result.findings] == [(320, Level.INFO)]
    third = np.flatnonzero(path.lines == 5)
    tips = np.array(path.tips_mm)
    tips[third[1:-1], 2] += 0.01
    written = lines(rewrite(path, replace(path, tips_mm=tips)))
    assert written[4].startswith("G1 X2")
    assert written[-4:] == ["G3 X40 R5", "G1 X50", "M2", ""]  # it relied on the G3 that is gone


def test_inverse_times_keep_the_speed(tmp_path: Path) -> None:
    text = HEAD + "G93\nG1 X10 F6.0\nX20 F6\nG3 X30 Y0 I5 F2\nM2\n"
    path = read(tmp_path, text)
    new = replace(path, tips_mm=path.tips_mm * 1.1)
    result = rewrite(path, new)
    assert lines(result)[3:5] == ["G1 X11 F5.4545", "X22 F5.4545"]
    back = read(tmp_path, result.content)
    assert np.allclose(back.feeds_mm_min, path.feeds_mm_min, rtol=1e-3)
    turned = read(tmp_path, HEAD + "G43.4 H1\nG93 G1 X10 B5 C0 F6\nB10 F3\nX11 F9\nM2", rotary="BC")
    source = np.array([0, 1, 2, 2, 3])
    pieces = replace(
        turned, tips_mm=turned.tips_mm[source], axes=turned.axes[source], rapid=turned.rapid[source],
        feeds_mm_min=turned.feeds_mm_min[source], lines=turned.lines[source],
    )  # fmt: skip
    axes = np.array(pieces.axes)
    axes[2] = [np.sin(np.radians(7.5)), 0, np.cos(np.radians(7.5))]
    assert lines(rewrite(turned, replace(pieces, axes=axes), source))[4:7] == ["B7.5 F6", "X10 Y0 Z0 B10 F6", "X11 F9"]


def test_axes_are_written_only_where_the_program_has_words_for_them(tmp_path: Path) -> None:
    flat = read(tmp_path, HEAD + "G1 X5 F9\nM2")
    result = rewrite(flat, moved(flat, turn=TURN))
    angle = f"{np.degrees(np.arccos(TURN[2, 2])):.4f}"
    assert [(f.code, f.level) for f in result.findings] == [(321, Level.WARN)]
    assert angle in result.findings[0].message
    assert b"A" not in result.content
    fanuc = read(tmp_path, HEAD + "G43.5 H1\nG1 X5 I.6 K.8 F9\nX6\nX7 I0 J0 K1\nM2")
    new = np.array(fanuc.axes)
    new[2] = [0.0, 0.6, 0.8]
    assert lines(rewrite(fanuc, replace(fanuc, axes=new)))[3:6] == [
        "G1 X5 I.6 K.8 F9", "X6 I0. J0.6 K0.8", "X7 I0 J0 K1",
    ]  # fmt: skip
    new = np.array(fanuc.axes)
    new[1] = [0.6, 0.48, 0.64]
    assert lines(rewrite(fanuc, replace(fanuc, axes=new)))[3:5] == ["G1 X5 J0.48 I.6 K.64 F9", "X6 I.6 J0. K.8"]


def test_rotary_angles_stay_on_their_branch(tmp_path: Path) -> None:
    text = HEAD + "G43.4 H1\nG1 X1 A-20 C350. F9\nX2 C370.\nX3 C390.\nM2"
    path = read(tmp_path, text, rotary="AC")
    new = moved(path, (0, 0, 0), Rotation.from_euler("z", 2, degrees=True).as_matrix())
    back = lines(rewrite(path, new))
    assert [line.split("C")[1].split()[0] for line in back[3:6]] == ["352.", "372.", "392."]
    assert all("A-20" in line for line in back[3:4])
    pole = read(tmp_path, HEAD + "G43.4 H1\nG1 X1 A0 C0 F9\nX2\nM2", rotary="AC")
    tipped = rewrite(pole, moved(pole, turn=Rotation.from_euler("y", 1, degrees=True).as_matrix()))
    assert 326 in {finding.code for finding in tipped.findings}


def test_positions_before_the_first_move_lead_to_it(tmp_path: Path) -> None:
    text = (
        "%\nO1\nG21 G90\nG53 G0 Z0\nG0 X5 Y5\nG0 X6\nG43 H1 Z50\nG1 Z0 F9\nG0 Z50\nG28 Z0\nG0 X9 Y9\nG4 X2\nZ50\nM30\n"
    )
    path = read(tmp_path, text + "%\nX1 Y2\n")
    result = rewrite(path, moved(path, (0.5, 0.25, 0)))
    assert lines(result)[3:13] == [
        "G53 G0 Z0", "G0 X5 Y5.25", "G0 X6.5", "G43 H1 Z50", "G1 Z0 F9", "G0 Z50", "G28 Z0", "G0 X9.5 Y9.25", "G4 X2",
        "Z50",
    ]  # fmt: skip
    assert result.content.decode().endswith("M30\n%\nX1 Y2\n")
    assert [(finding.code, finding.where[-7:]) for finding in result.findings] == [(325, "line 16")]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("\ufeffG21\r\nG0 X0 Y0 Z0 (St\u00fcck)\r\nX1\r\nM2", "utf-8"),
        ("G21\rG0 X0 Y0 Z0 (St\u00fcck)\rX1\rM2\r\r", "latin-1"),
        ("\ufeffG21\nG0 X0 Y0 Z0\nX1\nM2\n", "utf-16-le"),
        ("G21\nG0 X0,0 Y0 Z0 (a,b)\nX1,0 (c,1.5)\nM2 \t\n\n\x1a", "ascii"),
    ],
)
def test_encodings_and_line_ends_survive(tmp_path: Path, text: str, encoding: str) -> None:
    content = text.encode(encoding)
    path = read(tmp_path, content)
    assert rewrite(path, moved(path, (1e-6, 0, 0))).content == content
    written = text.replace("X1", "X2").replace("X0", "X1").encode(encoding)
    assert rewrite(path, moved(path, (1, 0, 0))).content == written


def test_optional_blocks_that_are_read_are_written(tmp_path: Path) -> None:
    text = HEAD + "/1 G1 X5 F9\n/ X6\nM2\n"
    path = read(tmp_path, text, block_skip=False)
    assert rewrite(path, moved(path, (1, 0, 0))).content == b"G21 G90\nG0 X1 Y0 Z0\n/1 G1 X6 F9\n/ X7\nM2\n"
    skipped = read(tmp_path, HEAD + "/G1 X5 F9\nX7\nM2\n")
    result = rewrite(skipped, moved(skipped, (1, 0, 0)))
    assert b"\n/G1 X5 F9\nX8\n" in result.content
    assert [finding.code for finding in result.findings] == [325]


def test_inches_get_decimals_enough(tmp_path: Path) -> None:
    path = read(tmp_path, "G20 G90\nG0 X0 Y0 Z0\nG1 X1.0 F9\nM2\n")
    assert lines(rewrite(path, moved(path, (1, 0, 0))))[1:3] == ["G0 X0.03937 Y0 Z0", "G1 X1.03937 F9"]


def test_a_packed_program_is_named_after_what_is_in_it(tmp_path: Path) -> None:
    import gzip

    file = tmp_path / "path.mpf.gz"
    file.write_bytes(gzip.compress(HEAD.encode() + b"G1 X1 F9\nM2\n"))
    path = read_path(file)
    assert path.original is not None
    assert path.original.suffix == ".mpf"
    file.unlink()
    assert rewrite(path, moved(path, (1, 0, 0))).content == b"G21 G90\nG0 X1 Y0 Z0\nG1 X2 F9\nM2\n"


def test_what_cannot_be_written_is_refused_whole(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "G1 X1 F9\nX2\nM2")
    far = with_tip(path, 1, [1e9, 0, 0])
    for new, source, word in (
        (path, np.array([0, 2, 1]), "order"),
        (path, np.array([0, 1]), "source moves"),
        (far, np.arange(3), "coordinate_mm"),
    ):
        result = rewrite(path, new, source)
        assert result.content == b""
        assert [(finding.code, finding.level) for finding in result.findings] == [(322, Level.FAIL)]
        assert word in result.findings[0].message


# --- any program, any path ---

number = st.floats(-500.0, 500.0).map(lambda value: round(value, 3))
point = st.tuples(number, number, number)
direction = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)).map(
    lambda v: (*v, (1 - v[0] ** 2 - v[1] ** 2) ** 0.5)
)
block = st.tuples(point, direction, st.sampled_from(["all", "xy", "z", "x", "gap"]), st.integers(0, 3))
blocks = st.lists(block, min_size=2, max_size=8)


def program(moves: list[tuple], dialect: str) -> str:
    """Return a program with modal blocks, comments and pauses between them."""
    gap = "" if dialect in ("tight", "arcs") else " "
    begin = {"siemens": "TRAORI", "fanuc": "G43.5 H1", "rotary": "G43.4 H1", "incremental": "G91"}.get(dialect, "G64")
    text = ["%", "O7", "N1 G21 G90 G17", "G0 X0 Y0 Z0", begin, gap.join(["G1", "F500"])]
    for count, ((x, y, z), (i, j, k), which, extra) in enumerate(moves):
        words = {
            "all": [f"X{x}", f"Y{y}", f"Z{z}"],
            "xy": [f"X{x}", f"Y{y:+.3f}"],
            "z": [f"Z{z:.1f}"],
            "x": [f"X{x:.0f}."],
        }
        found = list(words.get(which, []))
        if not found:
            text += ["(a gap, X1 Y2)", "G4 P0.5"]
            continue
        if dialect == "siemens" and extra:
            found += [f"A3={i:.6f}", f"B3={j:.6f}", f"C3={k:.6f}"]
        elif dialect == "fanuc" and extra:
            found += [f"I{i:.6f}", f"J{j:.6f}", f"K{k:.6f}"]
        elif dialect == "rotary" and extra:
            found += [f"B{20 + 10 * i:.3f}", f"C{90 * j:.3f}"][:extra]
        elif dialect == "arcs" and extra == 1 and abs(x) > 1:
            found = ["G2", "G91", f"X{x}", f"I{x / 2}"]
        text.append(gap.join([f"N{10 * count + 10}", *found]))
        if found[0] == "G2":
            text.append("G1G90")
    return "\n".join([*text, "/X1 (skip)", "M5", "M30", "%", ""])


@pytest.mark.parametrize("dialect", ["plain", "tight", "incremental", "siemens", "fanuc", "rotary", "arcs"])
@settings(deadline=None, max_examples=25)
@given(moves=blocks, shift=point, turn=st.tuples(*[st.floats(-0.3, 0.3)] * 3))
def test_any_program_is_kept_or_follows_its_path(
    tmp_path_factory: pytest.TempPathFactory, dialect: str, moves: list, shift: tuple, turn: tuple
) -> None:
    text = program(moves, dialect)
    options = {"rotary": "BC" if dialect == "rotary" else None, "step_mm": 50.0, "chord_mm": 1.0}
    folder = tmp_path_factory.mktemp("g")
    try:
        path = read(folder, text, **options)
    except ValueError as error:
        assert "one point" in str(error)
        return
    assert rewrite(path, path).content == text.encode()
    assert rewrite(path, moved(path, (1e-6, 0, 0))).content == text.encode()
    new = moved(path, shift, Rotation.from_rotvec(turn).as_matrix())
    result = rewrite(path, new)
    lines(result)
    back = read(folder, result.content, **options)
    assert np.abs(back.tips_mm - new.tips_mm).max() < 2e-4
    said = {321, 327} & {finding.code for finding in result.findings}
    assert said or np.abs(back.axes - new.axes).max() < 2e-5


@pytest.mark.parametrize("name", SEEDS)
@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_damaged_programs_are_refused_kept_or_follow_their_path(
    tmp_path_factory: pytest.TempPathFactory, name: str, data: st.DataObject
) -> None:
    content = bytearray((CORPUS / name).read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] = data.draw(st.one_of(st.integers(0, 255), st.sampled_from(b"0123456789.-+=XYZIJKABCGMF /\n")))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(1, len(content))) :]
    options = {"rotary": ROTARY.get(name), "step_mm": 60.0, "chord_mm": 1.0, "recover": data.draw(st.booleans())}
    folder = tmp_path_factory.mktemp("g")
    try:
        path = read(folder, bytes(content), **options)
    except SicpError as error:
        assert "path.nc" in str(error)
        assert str(error).isprintable()
        return
    assert rewrite(path, moved(path, (1e-7, 0, 0))).content == bytes(content)
    new = moved(path, (1.25, 0, -1), TURN)
    result = rewrite(path, new)
    if result.content:
        assert np.abs(read(folder, result.content, **options).tips_mm - new.tips_mm).max() < 2e-4
    else:
        assert [finding.level for finding in result.findings] == [Level.FAIL]
