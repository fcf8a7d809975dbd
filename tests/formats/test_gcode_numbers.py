"""Numbers and words of G-code that one control reads otherwise than another: found, refused or asked, never guessed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sicp_cam.errors import FormatError, JobError
from sicp_cam.findings import Level
from sicp_cam.model import ToolPath
from sicp_formats.gcode import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "gcode"
HEAD = "G21 G90\nG0 X0. Y0. Z0.\n"
INCREMENTS = "G21 G90\nG0 X0 Y0 Z50000\nG1 X100000 Y500 F100\nM30\n"


def read(folder: Path, text: str, name: str = "path.nc", **options: object) -> ToolPath:
    (folder / name).write_text(text, encoding="utf-8")
    return read_path(folder / name, **options)  # type: ignore[arg-type]


def warned(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings if finding.level is Level.WARN}


def refused(folder: Path, text: str, line: int, *words: str, name: str = "path.nc", **options: object) -> None:
    with pytest.raises(FormatError) as caught:
        read(folder, text, name, **options)
    assert f"{name}, line {line}: " in str(caught.value)
    assert caught.value.line == line
    for word in words:
        assert word in str(caught.value)


def shifted(path: ToolPath, by: tuple[float, float, float], **options: object) -> list[str]:
    assert path.original is not None
    result = path.original.rewritten(replace(path, tips_mm=path.tips_mm + by), np.arange(len(path)))
    assert not [finding for finding in result.findings if finding.level is Level.FAIL]
    return result.content.decode().split("\n")


# --- work offsets ---


@pytest.mark.parametrize(
    ("first", "second"),
    [("G54", "G55"), ("G505", "G506"), ("G54.1 P1", "G54.1 P2"), ("G54 P1", "G54 P2"), ("G154 P3", "G154 P4"),
     ("G59", "G59.1"), ("G54", "G500"), ("G15 H1", "G15 H2"), ("", "G254"), ("G254", "G255"), ("", "G55")],
)  # fmt: skip
def test_a_path_has_one_work_offset(tmp_path: Path, first: str, second: str) -> None:
    begin = f"G21 G90\n{first}\nG0 X0. Y0. Z0.\nG1 X10. F100\n"
    name = second or "G254"
    refused(tmp_path, f"{begin}{second}\n(then)\nG1 X20.\nM30\n", 7, "work offset changes", f"{name} in line 5", "post")
    refused(tmp_path, f"{begin}{second} X20.\nM30\n", 5, "work offset changes")
    if first:
        assert len(read(tmp_path, f"{begin}{first}\nG1 X20.\n{second}\nG53 G0 Z0.\nM30\n")) == 3  # nothing follows
    assert len(read(tmp_path, f"G21 G90\n{first}\n{second}\nG0 X0. Y0. Z0.\nG1 X1. F9\nM30\n")) == 2


def test_work_offsets_count_from_the_first_coordinate_on(tmp_path: Path) -> None:
    refused(tmp_path, "G21 G90 G54\nG0 X5. Y5.\nG55\nZ50.\nG1 X1. F9\nM30\n", 4, "work offset")
    refused(tmp_path, "G54 G55\nG0 X5. Y5.\n", 1, "two work offsets")


@pytest.mark.parametrize(
    "block", ["G58 X5. Y5.", "G59 X100.", "G0 G59 Z1.", "TRANS X10", "ATRANS Y5.", "ROT Z45", "AROT RPL=30",
              "MIRROR X0", "SCALE X2", "G110 X1. Y1."],
)  # fmt: skip
def test_programmed_shifts_are_no_moves(tmp_path: Path, block: str) -> None:
    refused(tmp_path, HEAD + block + "\nG1 X1. F9\nM30\n", 3)


def test_offsets_58_and_59_alone_are_kept(tmp_path: Path) -> None:
    path = read(tmp_path, "G21 G90\nG59\nG0 X0. Y0. Z0.\nG1 X1. F9\nM30\n")
    assert [event.text for event in path.events] == ["G59"]


# --- decimal points ---


def test_new_numbers_have_a_decimal_point_where_the_program_has_one(tmp_path: Path) -> None:
    path = read(tmp_path, "G21 G90\nG0 X0. Y0 Z5\nG1 Z0 F100\nX10.5\nY7\nM30\n")
    assert shifted(path, (0, 0, -1))[1:6] == ["G0 X0. Y0 Z4.", "G1 Z-1. F100", "X10.5", "Y7", "M30"]
    tips = np.array(path.tips_mm)
    tips[3, 2] = 2.0
    assert path.original is not None
    written = path.original.rewritten(replace(path, tips_mm=tips), np.arange(len(path))).content.decode()
    assert "\nY7 Z2.\n" in written
    # the point may come late, and one in a remark is none
    late = read(tmp_path, "G21 G90 (1.5)\nG0 X0 Y0 Z5 (X1.)\nG1 Z0 F100\nX10 ;Y.5\nM30\n")
    assert shifted(late, (0, 0, -1))[2] == "G1 Z-1 F100"
    late = read(tmp_path, "G21 G90\nG0 X0 Y0 Z5\nG1 Z0 F100\n" + "Y9\nY8\n" * 800 + "X10.\nM30\n")
    assert shifted(late, (0, 0, -1))[2] == "G1 Z-1. F100"


def test_new_numbers_with_a_decimal_comma_and_of_rotary_axes(tmp_path: Path) -> None:
    comma = read(tmp_path, "G21 G90\nG0 X0,5 Y0 Z5\nG1 Z0 F100\nX1,5\nM30\n")
    assert shifted(comma, (0, 0, -1))[1:3] == ["G0 X0,5 Y0 Z4,0", "G1 Z-1,0 F100"]
    rotary = read(tmp_path, "G21 G90\nG0 X0. Y0 Z5\nG43.4 H1\nG1 X1. B30 C0 F100\nC10 X2.\nM30\n", rotary="BC")
    turn = Rotation.from_euler("z", 1, degrees=True).as_matrix()
    assert rotary.original is not None
    new = replace(rotary, axes=rotary.axes @ turn.T)
    written = rotary.original.rewritten(new, np.arange(len(new))).content.decode().split("\n")
    assert written[3:5] == ["G1 X1. B30 C1. F100", "C11. X2."]


# --- least-increment input ---


def test_whole_numbers_are_asked_about(tmp_path: Path) -> None:
    path = read(tmp_path, INCREMENTS)
    assert path.tips_mm.tolist() == [[0, 0, 50000], [100000, 500, 50000]]
    (found,) = [finding for finding in path.findings if finding.code == 328]
    assert (found.level, found.where[-6:]) == (Level.WARN, "line 2")
    assert "2 blocks" in found.message
    assert "--set path.integers=units or thousandths" in found.message
    units = read(tmp_path, INCREMENTS, integers="units")
    assert units.tips_mm.tolist() == path.tips_mm.tolist()
    assert 328 not in warned(units)
    small = read(tmp_path, INCREMENTS, integers="thousandths")
    assert small.tips_mm.tolist() == [[0, 0, 50], [100, 0.5, 50]]
    assert small.feeds_mm_min.tolist() == [0, 100]
    assert not warned(small)
    with pytest.raises(JobError, match=r"path\.integers"):
        read(tmp_path, INCREMENTS, integers="mm")


@pytest.mark.parametrize(
    ("body", "asked"),
    [
        ("X10.5\nX100", True),
        ("X10.5\nX99", False),
        ("X10.5\nC=360", True),
        ("X10.5 (X100)\nG53 G0 Z-500", False),
        ("X10.5\nG4 X100", False),
        ("X10.5\nX0100.", False),
        ("X1.5\nG3 X100.5 R2000", True),
    ],
)
def test_mixed_programs_are_asked_about_large_whole_numbers(tmp_path: Path, body: str, asked: bool) -> None:
    path = read(tmp_path, f"{HEAD}G1 F100\n{body}\nM30\n", rotary="BC")
    assert (328 in warned(path)) == asked


def test_siemens_and_heidenhain_count_units(tmp_path: Path) -> None:
    body = "G90 G0 X0 Y0 Z500\nG1 X1000 F100\nM30\n"
    assert 328 in warned(read(tmp_path, "G21\n" + body))
    assert 328 in warned(read(tmp_path, "G21 (TRAORI)\n" + body))
    assert 328 not in warned(read(tmp_path, "G710\n" + body))
    assert 328 not in warned(read(tmp_path, "G71\n" + body, "path.mpf"))
    assert 328 not in warned(read(tmp_path, 'G71 MSG("x")\n' + body))
    assert 328 not in warned(read(tmp_path, "%A G71 *\nN1 G90 G00 X+0 Y+0 Z+500 *\nN2 G01 X+1000 F9 *\nN3 M30 *\n"))


def test_thousandths_of_all_words(tmp_path: Path) -> None:
    text = (
        "G21 G90\nG0 X10000 Y0 Z0\nG3 X0 Y10000 I-10000 J0 F100\nG2 X10. Y0 R10000\nG43.4 H1\nG1 X5 B30000 C0\n"
        "G4 X2000\nG91 X1.5 Y-1500\nM30\n"
    )
    path = read(tmp_path, text, rotary="BC", integers="thousandths", step_mm=50.0)
    assert np.allclose(path.tips_mm[-2:], [[0.005, 0, 0], [1.505, -1.5, 0]])
    assert np.allclose(path.axes[-1], [0.5, 0, 0.75**0.5])
    assert np.allclose(np.linalg.norm(path.tips_mm[:3, :2], axis=1), 10)
    assert [event.value for event in path.events if event.kind.name == "DWELL"] == [2.0]
    inch = read(tmp_path, "G20 G90\nG0 X10000 Y0 Z0\nG1 X0 F1.\nM30\n", integers="thousandths")
    assert inch.tips_mm[0].tolist() == [25.4, 0, 0]
    vectors = read(tmp_path, HEAD + "G43.5 H1\nG1 X1000 I0 J3 K4 F9\nM30\n", integers="thousandths")
    assert np.allclose(vectors.axes[-1], [0, 0.6, 0.8])


def test_thousandths_are_written_as_numbers_with_a_point(tmp_path: Path) -> None:
    path = read(tmp_path, INCREMENTS, integers="thousandths")
    assert shifted(path, (0, 0, -1))[1:3] == ["G0 X0 Y0 Z49.", "G1 X100000 Y500 F100"]
    assert shifted(path, (0.25, 0, 0))[1:3] == ["G0 X0.25 Y0 Z50000", "G1 X100.25 Y500 F100"]


whole = st.integers(-60000, 60000)
moves = st.lists(
    st.tuples(st.sampled_from(["X{}Y{}", "Z{}", "X{}. Y{}", "G91 X{} Y{}", "G90 Z{}", "G0 X{}", "G1 Y{}"]),
              whole, whole),
    min_size=2, max_size=8,
)  # fmt: skip


@settings(deadline=None, max_examples=50)
@given(
    moves=moves,
    by=st.tuples(*[st.integers(-5000, 5000).map(lambda v: v / 1000)] * 3),
    how=st.sampled_from(["units", "thousandths"]),
)
def test_whole_numbers_written_again_mean_the_same(
    tmp_path_factory: pytest.TempPathFactory, moves: list[tuple[str, int, int]], by: tuple[float, ...], how: str
) -> None:
    folder = tmp_path_factory.mktemp("g")
    body = "\n".join(template.format(a, b) for template, a, b in moves)
    text = f"G21 G90\nG0 X1 Y2 Z3\nG1 F100\nX7\n{body}\nG90 G1 X1.5\nM30\n"
    path = read(folder, text, integers=how)
    assert path.original is not None
    new = replace(path, tips_mm=path.tips_mm + by)
    result = path.original.rewritten(new, np.arange(len(path)))
    back = read(folder, result.content.decode(), integers=how)
    assert np.abs(back.tips_mm - new.tips_mm).max() < 2e-4
    old, written = text.split("\n"), result.content.decode().split("\n")
    for before, after in zip(old, written, strict=True):  # words that are new have a point
        fresh = set(after.replace("X", " X").replace("Y", " Y").replace("Z", " Z").split())
        kept = set(before.replace("X", " X").replace("Y", " Y").replace("Z", " Z").split())
        assert all("." in word for word in fresh - kept if word[0] in "XYZ")


# --- feeds under G70 ---


@pytest.mark.parametrize(
    ("text", "name", "line"),
    [
        ("G70 G90\nTRAORI\nG0 X0. Y0. Z0.\nG1 X1. F100\nM30\n", "path.nc", 4),
        ("G70 G90\nG0 X0. Y0. Z0.\nG1 X1. F100\nM30\n", "path.mpf", 3),
        ("%A G70 *\nN1 G90 G00 X+0 Y+0 Z+0 *\nN2 G01 X+1 F9 *\nN3 M30 *\n", "path.iso", 3),
        ("F100\nG70 G90\nG0 X0. Y0. Z0.\nG1 X1.\nM30\n", "path.spf", 2),
    ],
)
def test_a_feed_under_g70_is_not_inches_on_these_controls(tmp_path: Path, text: str, name: str, line: int) -> None:
    refused(tmp_path, text, line, "F under G70", "G700", "path.feed_mm_min", name=name)
    path = read(tmp_path, text, name, feed_mm_min=500.0)
    assert path.tips_mm[-1].tolist() == [25.4, 0, 0]
    assert path.feeds_mm_min.tolist() == [0, 500]
    assert 356 in warned(path)


def test_other_feeds_in_inches(tmp_path: Path) -> None:
    body = " G90\nG0 X0. Y0. Z0.\nG1 X1. F100\nM30\n"
    assert read(tmp_path, "G700" + body, "path.mpf").feeds_mm_min.tolist() == [0, 2540]
    inverse = "G70 G90\nG0 X0. Y0. Z0.\nG93 G1 X1. F2\nM30\n"
    assert read(tmp_path, inverse, "path.mpf").feeds_mm_min.tolist() == [0, 50.8]
    assert 357 in warned(read(tmp_path, "G70" + body))
    assert not warned(read(tmp_path, "G20" + body))


# --- words beside codes that are kept ---


@pytest.mark.parametrize(
    ("block", "word"),
    [("G54 X1E2", "E"), ("G1 G61 X1E2 F100", "E"), ("M51 X5 E-3", "E"), ("G64 R5", "R"), ("G43 H1 Q2", "Q"),
     ("G187 P3 X1E2", "E"), ("M8 P5", "P"), ("TRAORI R3", "R"), ("G61 P1", "P"), ("M777 R2", "R"),
     ("G1 X1.e5 F9", "E")],
)  # fmt: skip
def test_words_that_nothing_takes_are_refused(tmp_path: Path, block: str, word: str) -> None:
    refused(tmp_path, "G54\n" + HEAD + block + "\nG1 X3. F9\nM30\n", 4, f"{word} word")


def test_words_that_codes_own_are_kept(tmp_path: Path) -> None:
    blocks = ["G187 P3 E0.01", "G5.1 Q1 R2", "G64 P0.01 Q0.02", "M19 R90", "M62 P1", "G103 P1", "H2", "D1", "G8 P1"]
    path = read(tmp_path, HEAD + "\n".join(blocks) + "\nG1 X1. F9\nM30\n")
    assert [event.text for event in path.events] == blocks
    # an arc needs R and P itself, whatever stands beside it
    arc = read(tmp_path, HEAD + "G2 X2. Y0. R1. F9\nX4. R1. M19\nM30\n", step_mm=50.0)
    assert np.ptp(arc.tips_mm[:, 1]) == pytest.approx(1.0, abs=0.1)
    refused(tmp_path, HEAD + "G2 X2. Y0. I1. F9\nX4. I1. P2 M62\nM30\n", 4, "several turns")


# --- the end ---


@pytest.mark.parametrize("end", ["\nG1 X100.2", "\nG0 Z5 Y1", "\nG91 X1. (cut"[:-5]])
def test_a_last_move_without_a_line_end_is_a_warning(tmp_path: Path, end: str) -> None:
    path = read(tmp_path, HEAD + "G1 X1. F9" + end)
    (found,) = [finding for finding in path.findings if finding.code == 316]
    assert found.level is Level.WARN
    assert "line has no end" in found.message
    assert 316 not in {finding.code for finding in read(tmp_path, HEAD + "G1 X1. F9" + end + " M30").findings}


@pytest.mark.parametrize("last", ["X2 Y", "X", "G1 X1. Z(", "X=AC(10", "G3 X1. I", "N9 A", "g1 x2 y-"])
def test_recovery_drops_nothing_that_moves(tmp_path: Path, last: str) -> None:
    for recover in (False, True):
        with pytest.raises(FormatError, match=r"line 4: .*export it again") as caught:
            read(tmp_path, HEAD + "G1 X1. F9\n" + last, recover=recover)
        assert "--recover" not in str(caught.value)


@pytest.mark.parametrize("last", ["M", "N90 M3 S", "(to X1", "TRAFO", "G", "G7"])
def test_recovery_drops_a_cut_block_that_moves_nothing(tmp_path: Path, last: str) -> None:
    with pytest.raises(FormatError, match=r"line 4: .*--recover"):
        read(tmp_path, HEAD + "G1 X1. F9\n" + last)
    path = read(tmp_path, HEAD + "G1 X1. F9\n" + last, recover=True)
    assert (len(path), 350 in warned(path)) == (2, True)


@pytest.mark.parametrize("recover", [False, True])
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("G21 G90\nG0 X0. Y0. Z0.\nG1 X1.\nM2\n", "zero feed"),
        ("G21 G90\nG0 X0. Y0. Z0.\nG1 X1. X2. F9\nM2\n", "multiple X"),
        ("G21 G90\nG0 X0. Y0. Z0.\nG2 X1. R.5 I.5 J0 F9\nM2\n", "mixed radius-ijk"),
        ("G21 G90\nG0 X0. Y0. Z0.\nG1 X1. (a F9\nM2\n", "unclosed comment"),
        ("G90\nG0 X1. Y0. Z0.\nG20\nG1 X2. F9\nM2\n", "unit changes"),
        ("%", "no move"),
        ("G21 G90\nG0 X0. Y0. Z0.\no100 while [#1 LT 5]\nM2\n", "not evaluated"),
        ("G21 G90\nG0 X0. Y0. Z0.\nO100 call\nM2\n", "not executed"),
        ("G21 G90\nG0 X0. Y0. Z0.\n#1=5\nG1 X#1 F9\nM2\n", "not evaluated"),
        ("G21 G90\nG0 X0. Y0. Z0.\nG1 X[1+2] F9\nM2\n", "not evaluated"),
        ("G21 G90\nG0 X0. Y0. Z0.\nG1 X1. F9\nM98 P5", "subprograms"),
    ],
)
def test_bad_input_72(tmp_path: Path, text: str, words: str, recover: bool) -> None:
    with pytest.raises(FormatError, match=words) as caught:
        read(tmp_path, text, recover=recover)
    assert caught.value.line is not None


def test_the_seed_of_least_increments() -> None:
    path = read_path(CORPUS / "fanuc_increments.nc", integers="thousandths")
    assert np.abs(path.tips_mm).max() == 50
    assert 328 in warned(read_path(CORPUS / "fanuc_increments.nc"))
