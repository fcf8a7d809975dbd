"""APT programs written again in their own words: byte for byte where nothing differs, right where something does."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.errors import SicpError
from sicp_cam.findings import Level
from sicp_cam.model import FloatArray, Rewritten, ToolPath
from sicp_cam.rigid_motion import apply, exponential, rotate
from sicp_formats.apt import read_path
from sicp_formats.paths.number_tokens import restyled, retold

CORPUS = Path(__file__).parents[1] / "corpus" / "apt"
OPTIONS: dict[str, dict[str, str]] = {
    "camworks.clt": {"cutcom": "ignore", "cycles": "points"},
    "creo.ncl": {"arc_points": "arc"},
}
SEEDS = sorted(CORPUS.iterdir())
EACH_SEED = pytest.mark.parametrize("seed", SEEDS, ids=lambda seed: seed.name)
POSE = exponential(np.array([0.02, -0.03, 0.05, 1.5, -0.75, 0.25]), np.zeros(3))
HEAD = "UNITS/MM\nFEDRAT/600,MMPM\n"


def read_seed(seed: Path) -> ToolPath:
    return read_path(seed, **OPTIONS.get(seed.name, {}))


def read(folder: Path, text: str | bytes, **options: object) -> ToolPath:
    file = folder / "path.apt"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_path(file, **options)  # type: ignore[arg-type]


def rewritten(path: ToolPath, source: np.ndarray | None = None) -> Rewritten:
    assert path.original is not None
    return path.original.rewritten(path, np.arange(len(path)) if source is None else source)


def shifted(path: ToolPath, by: tuple[float, float, float], where: slice = slice(None)) -> ToolPath:
    tips = path.tips_mm.copy()
    tips[where] += by
    return replace(path, tips_mm=tips)


def moved(path: ToolPath, T: FloatArray = POSE) -> ToolPath:
    return replace(path, tips_mm=apply(T, path.tips_mm), axes=rotate(T, path.axes))


def lines(result: Rewritten) -> list[str]:
    assert not [f for f in result.findings if f.level is Level.FAIL]
    return result.content.decode().splitlines()


def codes(result: Rewritten) -> set[int]:
    return {finding.code for finding in result.findings}


@EACH_SEED
def test_nothing_changed_is_byte_for_byte_the_same(seed: Path) -> None:
    result = rewritten(read_seed(seed))
    assert result.content == seed.read_bytes()
    assert result.findings == ()


@EACH_SEED
def test_a_moved_program_reads_back_to_the_moved_path(seed: Path, tmp_path: Path) -> None:
    path = read_seed(seed)
    goal = moved(path)
    result = rewritten(goal)
    file = tmp_path / seed.name
    file.write_bytes(result.content)
    again = read_path(file, **OPTIONS.get(seed.name, {}))
    assert np.abs(again.tips_mm - goal.tips_mm).max() <= 2e-4
    assert np.array_equal(again.feeds_mm_min, path.feeds_mm_min)
    assert np.array_equal(again.rapid, path.rapid)
    assert [e.text for e in again.events] == [e.text for e in path.events]
    if seed.name in ("solidworks.apt", "camworks.clt"):  # they state no axis
        assert codes(result) == {320, 321}
    else:
        assert np.abs(again.axes - goal.axes).max() <= 1e-6
        assert codes(result) <= {320}


@EACH_SEED
def test_only_lines_of_changed_moves_differ(seed: Path) -> None:
    path = read_seed(seed)
    result = rewritten(shifted(path, (0.0, 0.0, 0.125), slice(-1, None)))
    before, after = seed.read_bytes().splitlines(True), result.content.splitlines(True)
    assert len(before) == len(after)
    differ = [number for number, pair in enumerate(zip(before, after, strict=True), 1) if pair[0] != pair[1]]
    assert 1 <= len(differ) <= 2
    assert path.lines[-1] <= differ[0] <= path.lines[-1] + 1


@pytest.mark.parametrize(
    ("token", "value", "text"),
    [
        ("10.", 10.00001, "10."),
        ("10.", 10.25, "10.25"),
        ("10.", 12.0, "12."),
        ("10", 12.0, "12"),
        ("10", 12.34567, "12.3457"),
        ("1.50", 2.0, "2.00"),
        ("-1.5000000000", 0.25, ".2500000000"),
        (".50", -0.25, "-.25"),
        ("0.50", -0.25, "-0.25"),
        ("+1.5", 2.25, "+2.25"),
        ("+1.5", -2.25, "-2.25"),
        ("1.5E2", 12.5, "12.5"),
        ("1.0", -0.00001, ".0"),
        ("1", -0.4, "-.4"),
    ],
)
def test_numbers_keep_their_style(token: str, value: float, text: str) -> None:
    assert retold(token, value, 5e-5, 4, bare=True) == text


@given(st.floats(-1e6, 1e6), st.sampled_from(["1", "1.", "-.5", "+0.25", "7.0000000", "1e3", "0"]), st.booleans())
def test_every_number_is_written_to_four_decimals_without_exponent(value: float, token: str, bare: bool) -> None:
    text = restyled(token, value, 4, bare=bare)
    assert abs(float(text) - value) <= 5.0001e-5
    assert "e" not in text.lower()
    assert text not in ("", "-", "+", ".", "-0", "-0.", "-0.0000")


# --- the tool axis ---


def test_an_axis_that_is_no_longer_in_force_is_written(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0,0,0,1\nGOTO/1,0,0\nGOTO/2,0,0\nGOTO/3,0,0\nFINI\n")
    axes = path.axes.copy()
    axes[1] = [0.6, 0.0, 0.8]
    assert lines(rewritten(replace(path, axes=axes)))[2:] == [
        "GOTO/0,0,0,0,0,1", "GOTO/1,0,0,0.6000000,0.0000000,0.8000000"[:0] or "GOTO/1,0,0,.6,0,.8"[:0] or
        "GOTO/1,0,0,0.6,0,0.8", "GOTO/2,0,0,0,0,1", "GOTO/3,0,0", "FINI",
    ]  # fmt: skip


def test_a_turned_program_states_the_axis_once_and_stays_modal(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0,0.0000,0.0000,1.0000\nGOTO/1,0,0\nGOTO/2,0,0\nFINI\n")
    text = lines(rewritten(moved(path)))
    assert [line.count(",") for line in text[2:5]] == [5, 2, 2]


def test_zero_axes_go_on_meaning_the_axis_in_force(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0,0,0.6,0.8\nGOTO/1,0,0,0,0,0\nFINI\n")
    assert lines(rewritten(moved(path)))[3].endswith(",0,0,0")
    axes = path.axes.copy()
    axes[1] = [0.0, 0.0, 1.0]
    assert lines(rewritten(replace(path, axes=axes)))[3] == "GOTO/1,0,0,0,0,1"


def test_tlaxis_is_turned(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "TLAXIS/0,0,1\nGOTO/0,0,0\nGOTO/1,0,0\nTLAXIS/0,1,0\nGOTO/1,0,5\nFINI\n")
    text = lines(rewritten(moved(path)))
    stated = [[float(part) for part in line[7:].split(",")] for line in text if line.startswith("TLAXIS/")]
    assert np.abs(np.array(stated) - moved(path).axes[[0, 2]]).max() < 1e-7
    assert [line.count(",") for line in text if line.startswith("GOTO")] == [2, 2, 2]


def test_a_program_without_axes_keeps_three_values_and_says_so(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    result = rewritten(moved(path))
    (finding,) = result.findings
    assert (finding.code, finding.level) == (321, Level.WARN)
    assert "2.07 degrees" in finding.message
    assert [line.count(",") for line in lines(result)[2:4]] == [2, 2]


def test_multax_alone_lets_axes_be_written(tmp_path: Path) -> None:
    path = read(tmp_path, "MULTAX/ON\n" + HEAD + "GOTO/0.000,0.000,0.000\nGOTO/1.000,0.000,0.000\nFINI\n")
    result = rewritten(moved(path))
    assert result.findings == ()
    assert [line.count(",") for line in lines(result)[3:5]] == [5, 2]


def test_a_long_line_is_continued(tmp_path: Path) -> None:
    text = "MULTAX\n" + HEAD + "GOTO / 1000.0000000000 , 0.0000000000 , 0.0000000000\nGOTO / 1, 0, 0\nFINI\n"
    assert any(line.endswith(" $") for line in lines(rewritten(moved(read(tmp_path, text)))))


# --- positions ---


def test_differences_are_taken_from_what_was_written(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0.,0.,0.\n" + "GODLTA/1.,0.,0.\n" * 200 + "FINI\n"
    path = read(tmp_path, text)
    goal = shifted(path, (1.00004e-4 / 3, 0.0, 0.0))
    drifting = replace(goal, tips_mm=goal.tips_mm + np.arange(201)[:, None] * [1e-4 / 3, 0, 0])
    again = read(tmp_path, rewritten(drifting).content)
    assert np.abs(again.tips_mm - drifting.tips_mm).max() < 1e-4


def test_a_difference_whose_axis_turns_becomes_a_point(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0,0,0,1\nGODLTA/1,0,0 $$ over\nGODLTA/1,0,0\nFINI\n")
    axes = path.axes.copy()
    axes[1:] = [0.0, 0.6, 0.8]
    assert lines(rewritten(replace(path, axes=axes)))[2:5] == [
        "GOTO/0,0,0,0,0,1", "$$ over", "GOTO/1,0,0,0,0.6,0.8",
    ]  # fmt: skip


def test_gohome_states_its_point_once_home_has_moved(tmp_path: Path) -> None:
    text = HEAD + "FROM/0,0,50\nGOTO/1,0,0\nRAPID\nGOHOME $$ back\nFINI\n"
    path = read(tmp_path, text)
    both = shifted(path, (0.0, 0.0, 1.0))
    assert lines(rewritten(both))[2:6] == ["FROM/0,0,51", "GOTO/1,0,1", "RAPID", "GOHOME $$ back"]
    end = shifted(path, (0.0, 0.0, 1.0), slice(-1, None))
    assert lines(rewritten(end))[2:6] == ["FROM/0,0,50", "GOTO/1,0,0", "RAPID", "GOHOME/0,0,51 $$ back"]


def test_from_again_stays_where_the_tool_is(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,50\nGOTO/1,0,0\nFROM/1,0,0\nGOTO/2,0,0\nFINI\n")
    assert lines(rewritten(shifted(path, (0.5, 0, 0))))[4] == "FROM/1.5,0,0"


def test_inches_and_applied_frames_are_written_in_the_numbers_of_the_file(tmp_path: Path) -> None:
    text = "MSYS/1,2,3,0,1,0,-1,0,0\nUNITS/INCHES\nFEDRAT/1\nGOTO/1.00,0.00,0.00,1.,0.,0.\nGOTO/1.00,1.00,0.00\nFINI\n"
    path = read(tmp_path, text, frame="apply")
    assert rewritten(path).content == text.encode()
    result = rewritten(shifted(path, (25.4 / 8, 0.0, 0.0)))
    assert lines(result)[3:5] == ["GOTO/1.00,-0.125,0.00,1.,0.,0.", "GOTO/1.00,0.875,0.00"]


def test_line_ends_encoding_columns_and_comments_stay(tmp_path: Path) -> None:
    text = (
        "UNITS/MM\r\nFEDRAT/1\r\n$$ é\r\nGOTO  /   20.40000,    0.00000,$ x\r\n  $$ y\r\n -30.00000 $$ z\r\nGOTO/0,0,0"
    )
    for encoding in ("utf-8", "latin-1", "utf-8-sig", "utf-16"):
        content = text.encode(encoding)
        path = read(tmp_path, content)
        assert rewritten(path).content == content
        result = rewritten(shifted(path, (100.0, 0.0, 0.0)))
        assert result.content.decode(encoding) == text.replace("  20.40000", " 120.40000").replace("/0,0,0", "/100,0,0")


# --- arcs and added moves ---

ARC = HEAD + "GOTO/10.0,-5.0,0.0\nGOTO/10.0,0.0,0.0\nCIRCLE/0,0,0,$ $$ first\n0,0,1\nGOTO/0.0,10.0,0.0 $$ end\n"


def test_arcs_stay_where_they_are_not_changed_and_become_points_where_they_are(tmp_path: Path) -> None:
    text = ARC + "GOTO/-5.0,10.0,0.0\nFINI\n"
    path = read(tmp_path, text)
    far = rewritten(shifted(path, (0.0, 1.0, 0.0), slice(-1, None)))
    assert lines(far) == text.replace("-5.0,10.0", "-5.0,11.0").splitlines()
    assert far.findings == ()
    near = rewritten(shifted(path, (0.0, 0.0, 0.1), slice(5, 6)))
    assert codes(near) == {320}
    assert "1 arcs" in near.findings[0].message
    written = lines(near)
    assert "$$ first" in written
    assert not any("CIRCLE" in line for line in written)
    assert sum(line.startswith("GOTO/") for line in written) == len(path)
    assert written[-3:] == ["GOTO/0.0,10.0,0.0 $$ end", "GOTO/-5.0,10.0,0.0", "FINI"]


def test_an_arc_whose_start_has_moved_becomes_points(tmp_path: Path) -> None:
    path = read(tmp_path, ARC + "GOTO/-5.0,10.0,0.0\nFINI\n")
    assert codes(rewritten(shifted(path, (0.0, 0.0, 0.01), slice(1, 2)))) == {320}


def test_added_moves_are_added_lines_and_rapid_ones_say_so(tmp_path: Path) -> None:
    path = read(
        tmp_path, HEAD + "GOTO / 0. , 0. , 0.\nrapid\n10) GOTO / 2. , 0. , 0. $$ far\nGOTO / 4. , 0. , 0.\nFINI"
    )
    source = np.array([0, 1, 1, 2, 2])
    tips = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0.5, 0], [4, 0, 0]], dtype=np.float64)
    goal = replace(
        path,
        tips_mm=tips,
        axes=path.axes[source],
        feeds_mm_min=path.feeds_mm_min[source],
        rapid=path.rapid[source],
        lines=path.lines[source],
        events=(),
    )
    assert lines(rewritten(goal, source))[2:] == [
        "GOTO / 0. , 0. , 0.",
        "rapid",
        "GOTO / 1. , 0. , 0.",
        "rapid",
        "10) GOTO / 2. , 0. , 0. $$ far",
        "GOTO / 3. , 0.5 , 0.",
        "GOTO / 4. , 0. , 0.",
        "FINI",
    ]


# --- what cannot be written ---


def refused(result: Rewritten, *words: str) -> None:
    assert result.content == b""
    (finding,) = result.findings
    assert (finding.code, finding.level) == (322, Level.FAIL)
    assert all(word in finding.message for word in (*words, "use another post"))


def test_paths_of_other_moves_feeds_or_repaired_programs_are_refused(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nGOTO/2,0,0\n"
    path = read(tmp_path, text)
    refused(rewritten(path, np.array([0, 0, 2])), "all moves")
    refused(rewritten(path, np.array([0, 2, 1])), "order")
    refused(rewritten(path, np.array([0, 1])), "all moves")
    refused(rewritten(replace(path, feeds_mm_min=path.feeds_mm_min * 2)), "feeds")
    refused(rewritten(replace(path, rapid=~path.rapid)), "rapid")
    refused(rewritten(read(tmp_path, text + "TLAXIS/0\n", recover=True)), "damaged")
    refused(rewritten(read(tmp_path, text.replace("FEDRAT/600,MMPM\n", ""), feed_mm_min=500.0)), "feed_mm_min")


def test_numbers_of_unknown_statements_do_not_stay_behind_a_correction(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0,0,0\nAVOID/1,2,3\nSOFT/1,2\nGOTO/1,0,0\nFINI\n"
    path = read(tmp_path, text)
    assert rewritten(path).content == text.encode()
    refused(rewritten(shifted(path, (0.5, 0.0, 0.0))), "not known", "AVOID (line 4)")
    lines(rewritten(shifted(read(tmp_path, text.replace("AVOID", "CUTTER")), (0.5, 0.0, 0.0))))


def test_numbers_of_statements_stay(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "N10 GOTO/0,0,0\nN20 RAPID\nN30GOTO / 1,0,0 $$ up\nN40 FINI\n")
    assert lines(rewritten(shifted(path, (0.0, 0.0, 0.5))))[2:] == [
        "N10 GOTO/0,0,0.5", "N20 RAPID", "N30GOTO / 1,0,0.5 $$ up", "N40 FINI",
    ]  # fmt: skip
    sources = np.array([0, 1, 1])
    tips = np.array([[0.0, 0, 0], [0.5, 0, 0.5], [1.0, 0, 0]])
    more = replace(path, tips_mm=tips, axes=path.axes[sources], feeds_mm_min=path.feeds_mm_min[sources],
                   rapid=path.rapid[sources], lines=path.lines[sources])  # fmt: skip
    assert lines(rewritten(more, sources))[3:7] == [
        "N20 RAPID", "GOTO / 0.5,0,0.5", "RAPID", "N30GOTO / 1,0,0 $$ up",
    ]  # fmt: skip


def test_a_remark_within_a_statement_is_written_once(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,$ more $$ why\n0 $$ end\nFINI\n")
    sources = np.array([0, 1, 1])
    tips = np.array([[0.0, 0, 0], [0.5, 0.5, 0], [1.0, 0, 0]])
    more = replace(path, tips_mm=tips, axes=path.axes[sources], feeds_mm_min=path.feeds_mm_min[sources],
                   rapid=path.rapid[sources], lines=path.lines[sources])  # fmt: skip
    written = lines(rewritten(more, sources))
    assert written[2:] == ["GOTO/0,0,0", "GOTO/0.5,0.5,0", "GOTO/1,0,$ more $$ why", "0 $$ end", "FINI"]


def test_what_was_written_is_not_refused_for_the_sense_of_its_arcs(tmp_path: Path) -> None:
    arc = "GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nGOTO/0,1,0\n"
    path = read(tmp_path, HEAD + "GOTO/1,-5,0\n" + arc + "GOTO/-5,1,0\nFINI\n")
    tips = path.tips_mm.copy()
    tips[0] = [1.0, 5.0, 0.0]  # now the moves beside the arc run against it
    tips[-1] = [5.0, 1.0, 0.0]
    written = lines(rewritten(replace(path, tips_mm=tips)))
    assert written[2:] == ["GOTO/1,5,0", *arc.splitlines(), "GOTO/5,1,0", "FINI"]


def test_what_would_not_read_back_is_refused(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    refused(rewritten(shifted(path, (2e7, 0.0, 0.0))), "coordinate_mm")


# --- any program ---

number = st.floats(-999.0, 999.0).map(lambda value: round(value, 4))
vector = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: sum(c * c for c in v) > 0.01)


@st.composite
def programs(draw: st.DrawFn) -> str:
    """Statements of all kinds, in the layout of one dialect."""
    comma = draw(st.sampled_from([",", " , ", ",    "]))
    slash = draw(st.sampled_from(["/", " / ", "  /   "]))
    form = draw(st.sampled_from(["{:.4f}", "{:.10f}", "{:g}"]))
    end = draw(st.sampled_from(["\n", "\r\n"]))
    broken = draw(st.booleans())
    text = [draw(st.sampled_from(["UNITS/MM", "UNITS/INCHES"])), "FEDRAT/200"]
    text.append("GOTO/1000,0,0,0,0,1" if draw(st.booleans()) else "GOTO/1000,0,0")
    for _ in range(draw(st.integers(1, 8))):
        kind = draw(st.sampled_from(["GOTO", "GOTO", "GOTO6", "GODLTA", "RAPID", "TLAXIS", "$$ note", "arc"]))
        x, y, z = (form.format(draw(number)) for _ in range(3))
        if kind == "arc":
            text += [f"GOTO{slash}10{comma}0{comma}0", "CIRCLE/0,0,0,0,0,1,10", f"GOTO{slash}0{comma}10.{comma}0"]
        elif kind in ("GOTO", "GODLTA"):
            text.append(f"{kind}{slash}{comma.join((x, y, z))}")
        elif kind in ("GOTO6", "TLAXIS"):
            axis = np.array(draw(vector))
            ijk = comma.join(f"{part:.7f}" for part in axis / np.linalg.norm(axis))
            gap = f" ${end}" if broken else comma
            text.append(f"TLAXIS/{ijk}" if kind == "TLAXIS" else f"GOTO{slash}{comma.join((x, y, z))}{gap}{ijk}")
        else:
            text.append(kind)
    return end.join([*text, "GOTO/-1000,5,5", "FINI", ""])


@settings(deadline=None, max_examples=50)
@given(text=programs(), data=st.data())
def test_any_program_is_itself_again_and_follows_any_motion(text: str, data: st.DataObject) -> None:
    with TemporaryDirectory() as name:
        folder = Path(name)
        path = read(folder, text, arc_sense="ccw", arc_points="straight")
        assert rewritten(path).content == text.encode()
        twist = np.array(data.draw(st.tuples(*[st.floats(-0.2, 0.2)] * 6)))
        first = data.draw(st.integers(0, len(path) - 1))
        goal = moved(path, exponential(twist, np.zeros(3)))
        tips, axes = path.tips_mm.copy(), path.axes.copy()
        tips[first:], axes[first:] = goal.tips_mm[first:], goal.axes[first:]
        goal = replace(path, tips_mm=tips, axes=axes)
        result = rewritten(goal)
        assert not [f for f in result.findings if f.level is Level.FAIL], result.findings
        again = read(folder, result.content, arc_sense="ccw", arc_points="straight")
    assert np.abs(again.tips_mm - goal.tips_mm).max() <= 2e-4
    if 321 not in codes(result):
        assert np.abs(again.axes - goal.axes).max() <= 2e-6


@settings(deadline=None, max_examples=60)
@given(seed=st.sampled_from(SEEDS), data=st.data())
def test_whatever_is_read_of_a_damaged_program_is_itself_again(seed: Path, data: st.DataObject) -> None:
    damaged = bytearray(seed.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.one_of(st.integers(0, 255), st.sampled_from(b"0123456789.,/$-+()\n '")))
    with TemporaryDirectory() as name:
        try:
            path = read(Path(name), bytes(damaged), **{**OPTIONS.get(seed.name, {}), "frame": "apply"})
        except SicpError as error:
            assert "path.apt" in str(error)
            return
        assert rewritten(path).content == bytes(damaged)
        result = rewritten(moved(path))
    assert bool(result.content) != any(finding.level is Level.FAIL for finding in result.findings)


def test_a_frame_of_few_decimals_does_not_stretch_the_axes(tmp_path: Path) -> None:
    text = "MSYS/0,0,0,1,0,0,0,1,0.0007\nUNITS/MM\nFEDRAT/1\nGOTO/0,0,0,0,0,1\nGOTO/9,0,0\nFINI\n"
    path = read(tmp_path, text, frame="apply")
    assert np.abs(np.linalg.norm(path.axes, axis=1) - 1).max() < 1e-12
    assert rewritten(path).content == text.encode()
