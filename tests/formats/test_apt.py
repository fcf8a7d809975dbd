"""The APT reader against paths whose truth is known."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, SicpError, UnitError
from sicp_cam.findings import Level
from sicp_cam.limits import Limits
from sicp_cam.model import EventKind, ToolPath
from sicp_formats.apt import read_path

CORPUS = Path(__file__).parents[1] / "corpus" / "apt"
HEAD = "UNITS/MM\nFEDRAT/600,MMPM\n"


def write(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "path.apt"
    path.write_bytes(text.encode(encoding))
    return path


def read(tmp_path: Path, text: str, **options: object) -> ToolPath:
    return read_path(write(tmp_path, text), **options)  # type: ignore[arg-type]


def codes(path: ToolPath) -> set[int]:
    return {finding.code for finding in path.findings}


def refused(tmp_path: Path, text: str, line: int, *words: str, **options: object) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, **options)
    assert caught.value.line == line
    assert f"path.apt, line {line}" in str(caught.value)
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_reads_a_whole_contour_program(tmp_path: Path) -> None:
    text = (
        "PARTNO/CONTOUR DEBURR\n$$ axis points away\nUNITS/MM\nMULTAX\nLOADTL/3\nSPINDL/18000,RPM,CLW\nRAPID\n"
        "GOTO/1.0,2.0,40.0,0.0,0.6,0.8\nFEDRAT/600,MMPM\nGOTO/1.0,2.0,0.5,0,.6,.8\nCOOLNT/ON\nGOTO/5.0,2.0,0.5\n"
        "STOP\nSPINDL/OFF\nFINI\n"
    )
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[1, 2, 40], [1, 2, 0.5], [5, 2, 0.5]]
    assert np.allclose(path.axes, [0, 0.6, 0.8], atol=1e-15)
    assert path.feeds_mm_min.tolist() == [0, 600, 600]
    assert path.rapid.tolist() == [True, False, False]
    assert path.lines.tolist() == [8, 10, 12]
    assert path.name == "CONTOUR DEBURR"
    assert path.findings == ()
    assert path.source is not None
    assert (path.source.unit, path.source.unit_stated, path.source.format) == ("mm", True, "APT")
    assert [(e.kind, e.value, e.before_move) for e in path.events if e.kind is not EventKind.COMMENT] == [
        (EventKind.TOOL, 3.0, 0),
        (EventKind.SPINDLE, 18000.0, 0),
        (EventKind.COOLANT, 1.0, 2),
        (EventKind.STOP, 0.0, 3),
        (EventKind.SPINDLE, 0.0, 3),
    ]
    assert [e.text for e in path.events if e.kind is EventKind.COMMENT] == ["CONTOUR DEBURR", "axis points away"]


@pytest.mark.parametrize(
    ("text", "axes"),
    [
        (
            "GOTO/0,0,0,0,1,0\nGOTO/1,0,0\nGOTO/2,0,0,1,0,0\nGOTO/3,0,0\nFINI",
            [[0, 1, 0], [0, 1, 0], [1, 0, 0], [1, 0, 0]],
        ),
        ("MULTAX/OFF\nGOTO/0,0,0,0,1,0\nGOTO/1,0,0\nFINI", [[0, 1, 0], [0, 1, 0]]),
        ("TLAXIS/0,-1,0\nGOTO/0,0,0\nGOTO/1,0,0\nFINI", [[0, -1, 0], [0, -1, 0]]),
        ("GOTO/0,0,0\nGOTO/1,0,0\nFINI", [[0, 0, 1], [0, 0, 1]]),
    ],
)
def test_axis_is_modal_whatever_multax_says(tmp_path: Path, text: str, axes: list[list[float]]) -> None:
    assert read(tmp_path, HEAD + text).axes.tolist() == axes


def test_blanks_case_continuations_labels_and_comments(tmp_path: Path) -> None:
    text = (
        "units / mm\r\nFedrat / MMPM , 250. $$ feed first\r\ngoto  / 1., 2. , $ more follows\r\n   -.5E1 \r\n"
        "10) GOTO / 4.0 , 5.0 , 6.0 $   \r\n\r\n$$ between\r\n .0000 , .3420201433 , .9396926208\r\nFINI\r\n"
    )
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[1, 2, -5], [4, 5, 6]]
    assert path.feeds_mm_min.tolist() == [250, 250]
    assert path.lines.tolist() == [3, 5]
    assert path.axes[1].tolist() == pytest.approx([0, 0.3420201433, 0.9396926208], abs=1e-9)
    assert [e.text for e in path.events] == ["feed first", "between"]


def test_dollars_in_quotes_and_text_statements_are_text(tmp_path: Path) -> None:
    text = HEAD + "SYN/'TLAXIS','$$*TLAXIS'\nPPRINT costs 5$\nTPRINT/T1 'x\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n"
    path = read(tmp_path, text)
    assert len(path) == 2
    assert [e.text for e in path.events] == ["SYN/'TLAXIS','$$*TLAXIS'", "costs 5$", "T1 'x"]


def test_latin_1_and_utf_16_are_read(tmp_path: Path) -> None:
    text = "$$ Généré le\nUNITS/MM\nFEDRAT/1\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n"
    for encoding in ("latin-1", "utf-16", "utf-8-sig"):
        assert read_path(write(tmp_path, text, encoding)).events[0].text == "Généré le"


def test_units_of_length_and_feed(tmp_path: Path) -> None:
    text = "FEDRAT/10\nUNITS/INCHES\nGOTO/1,0,0\nFEDRAT/100,MMPM\nGOTO/2,0,0\nFEDRAT/IPM,2\nGOTO/3,0,0\nFINI"
    path = read(tmp_path, text)
    assert path.tips_mm[:, 0].tolist() == [25.4, 50.8, 3 * 25.4]
    assert path.feeds_mm_min.tolist() == [254, 100, 50.8]
    assert read(tmp_path, "FEDRAT/5\nGOTO/1,0,0\nGOTO/2,0,0\nFINI", units="inch").tips_mm[1, 0] == 50.8


def test_feed_per_revolution_follows_the_spindle(tmp_path: Path) -> None:
    text = "UNITS/MM\nFEDRAT/0.1,MMPR\nGOTO/0,0,0\nSPINDL/CCLW,RPM,2000\nGOTO/1,0,0\nSPINDL/1000\nGOTO/2,0,0\nFINI"
    path = read(tmp_path, text)
    assert path.feeds_mm_min.tolist() == [0, 200, 100]
    assert [e.value for e in path.events] == [-2000, 1000]
    assert codes(path) == {302}


def test_a_feed_per_revolution_without_a_speed_is_told_as_what_it_is(tmp_path: Path) -> None:
    moves = "GOTO/0,0,0\nGOTO/1,0,0\nRAPID\nGOTO/2,0,0\nGOTO/3,0,0\nFINI"
    path = read(tmp_path, "UNITS/MM\nSPINDL/SFM,300,CLW\nFEDRAT/0.3,MMPR\n" + moves)
    (found,) = [f for f in path.findings if f.code == 302]
    assert found.message.startswith("3 cutting moves have no feed that is known in mm/min (3 state it per revolution")
    assert "no speed in rev/min is stated" in found.message and "path.feed_mm_min" in found.message
    (found,) = read(tmp_path, "UNITS/MM\n" + moves).findings
    assert "revolution" not in found.message
    assert codes(read(tmp_path, "UNITS/MM\nFEDRAT/0.3,MMPR\nSPINDL/900\n" + moves)) == set()


def test_numbered_statements_are_read(tmp_path: Path) -> None:
    text = (
        "N1 UNITS/MM\nN2 FEDRAT/9\nN3GOTO/0,0,0\nn7 goto / 1,2,$\n3\n"
        "N20 RAPID\nN30 GOTO/0,0,9\nN4 PPRINT $ text\nN5 FINI"
    )
    path = read(tmp_path, text)
    assert path.tips_mm.tolist() == [[0, 0, 0], [1, 2, 3], [0, 0, 9]]
    assert path.feeds_mm_min.tolist() == [9, 9, 0]
    assert [e.text for e in path.events] == ["$ text"]
    assert codes(path) == set()


def test_rapid_holds_for_one_move(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "RAPID/\nGOTO/0,0,0\nGOTO/1,0,0\nRAPID\nGODLTA/0,0,5\nGOTO/9,0,0\nFINI")
    assert path.rapid.tolist() == [True, False, True, False]
    assert path.feeds_mm_min.tolist() == [0, 600, 0, 600]
    assert path.tips_mm[2].tolist() == [1, 0, 5]


def test_from_and_gohome(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "FROM/0,0,50\nGOTO/1,0,0\nRAPID\nGOHOME\nFINI")
    assert path.tips_mm.tolist() == [[0, 0, 50], [1, 0, 0], [0, 0, 50]]
    assert path.rapid.tolist() == [True, False, True]


def test_missing_feed_is_reported_once_or_filled(tmp_path: Path) -> None:
    text = "UNITS/MM\nRAPID\nGOTO/0,0,0\nGOTO/1,0,0\nGOTO/2,0,0\nFINI"
    path = read(tmp_path, text)
    assert path.feeds_mm_min.tolist() == [0, 0, 0]
    (finding,) = path.findings
    assert finding.level is Level.WARN
    assert "2 cutting moves" in finding.message
    assert "--set path.feed_mm_min=" in finding.message
    assert finding.where.endswith("line 4")
    filled = read(tmp_path, text, feed_mm_min=900.0)
    assert filled.feeds_mm_min.tolist() == [0, 900, 900]
    assert filled.findings == ()


def test_missing_unit_is_a_warning(tmp_path: Path) -> None:
    path = read(tmp_path, "FEDRAT/1\nGOTO/0,0,0\nGOTO/1,0,0\nFINI")
    assert codes(path) == {301}
    assert path.source is not None
    assert not path.source.unit_stated


def test_unit_option_must_not_contradict_the_file(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match=r"path\.apt, line 1: the file states mm"):
        read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0", units="inch")
    assert len(read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0", units="mm")) == 2
    with pytest.raises(UnitError, match="unknown unit 'furlong'"):
        read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0", units="furlong")


def test_axis_not_unit_is_scaled_and_zero_axis_keeps_the_last(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0,0,0,2\nGOTO/1,0,0,0,1,0\nGOTO/2,0,0,0,0,0\nFINI")
    assert path.axes.tolist() == [[0, 0, 1], [0, 1, 0], [0, 1, 0]]
    assert codes(path) == {304, 305}
    refused(tmp_path, HEAD + "GOTO/0,0,0,0,0,0\nGOTO/1,0,0", 3, "axis is (0, 0, 0)")


def test_repeated_points_text_after_end_and_missing_end_are_findings(tmp_path: Path) -> None:
    assert codes(read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nGOTO/1,0,0\nFINI")) == {307}
    assert codes(read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nFINI\nGOTO/9,9,9\n")) == {312}
    assert codes(read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/1,0,0\n")) == {316}


def test_unknown_words_are_kept_and_named(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "GOTO/0,0,0\nWIBBLE/1,2\nGOTO/1,0,0\nFINI")
    assert [(e.kind, e.text, e.before_move, e.line) for e in path.events] == [(EventKind.OTHER, "WIBBLE/1,2", 1, 4)]
    (finding,) = path.findings
    assert (finding.code, finding.level) == (308, Level.WARN)
    assert "WIBBLE" in finding.message


def test_chosen_tool_counts_only_if_none_is_loaded(tmp_path: Path) -> None:
    moves = "GOTO/0,0,0\nGOTO/1,0,0\nFINI"
    alone = read(tmp_path, HEAD + "SELECT/TOOL,17\n" + moves)
    assert [(e.kind, e.value) for e in alone.events] == [(EventKind.TOOL, 17)]
    both = read(tmp_path, HEAD + "LOAD/TOOL,4,ADJUST,9\nSELECT/TOOL,17\n" + moves)
    assert [(e.kind, e.value) for e in both.events] == [(EventKind.TOOL, 4), (EventKind.OTHER, 0)]


def test_dwell_and_surface_speed(tmp_path: Path) -> None:
    text = HEAD + "DELAY/1.5\nSPINDL/600,RPM\nDELAY/5,REV\nSPINDL/200,SFM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI"
    path = read(tmp_path, text)
    assert [(e.kind, e.value) for e in path.events] == [
        (EventKind.DWELL, 1.5), (EventKind.SPINDLE, 600), (EventKind.DWELL, 0.5), (EventKind.OTHER, 0),
    ]  # fmt: skip
    assert codes(path) == {309}


# --- dialects, one seed file each ---


def test_catia(tmp_path: Path) -> None:
    path = read_path(CORPUS / "catia.aptsource")
    assert codes(path) == {306}
    assert path.name == "PART TO BE MACHINED"
    assert path.tips_mm[0].tolist() == [20.4, 0, 60]
    assert np.allclose(path.axes[1], [0.6, 0, 0.8])
    arc = path.tips_mm[1:-1]
    assert np.abs(np.linalg.norm(arc - [25, 0, -30], axis=1) - 4.6).max() < 1e-9
    assert (np.diff(arc[:, 2]) > 0).all()
    assert np.allclose(path.axes[2:-1], [0.6, 0, 0.8])
    assert np.allclose(path.axes[-1], [0, 0.6, 0.8])
    assert path.rapid.tolist() == [True] + [False] * (len(path) - 1)
    texts = [e.text for e in path.events]
    assert "Généré le 14 mai" in texts
    assert [(e.kind, e.value) for e in path.events if e.kind in ("tool", "spindle")] == [
        (EventKind.TOOL, 1), (EventKind.SPINDLE, 9000), (EventKind.SPINDLE, 0),
    ]  # fmt: skip


def test_nx() -> None:
    path = read_path(CORPUS / "nx.cls", units="mm")
    assert codes(path) == {306}
    assert path.name == "EDGE_1"
    on_arc = path.tips_mm[(path.lines == 17)]
    assert np.abs(np.linalg.norm(on_arc, axis=1) - 10).max() < 1e-9
    assert (on_arc[:, 1] > 0).all()  # the short way, clockwise about -z
    assert np.allclose(path.axes[-2:], [-0.6, 0, 0.8])  # the axis is modal
    assert set(path.feeds_mm_min.tolist()) == {0, 800}
    assert any(e.kind is EventKind.OTHER and e.text.startswith("TLDATA/MILL") for e in path.events)


def test_solidworks() -> None:
    path = read_path(CORPUS / "solidworks.apt")
    assert codes(path) == {306}
    assert np.allclose(path.tips_mm[0], [25.4, -12.7, 12.7])
    assert np.allclose(path.tips_mm[-1], [-12.7, 25.4, 12.7])
    assert path.feeds_mm_min[1] == pytest.approx(508)
    assert path.original is not None
    assert path.original.suffix == ".apt"


def test_camworks_needs_the_user_to_decide() -> None:
    with pytest.raises(FormatError, match=r"line 5: CUTCOM: .*path\.cutcom=ignore"):
        read_path(CORPUS / "camworks.clt", cycles="points")
    with pytest.raises(FormatError, match=r"line 16: CYCLE: .*path\.cycles=points"):
        read_path(CORPUS / "camworks.clt", cutcom="ignore")
    path = read_path(CORPUS / "camworks.clt", cutcom="ignore", cycles="points")
    assert codes(path) == {306, 323, 324}
    assert {f.level for f in path.findings if f.code > 306} == {Level.WARN}
    assert path.tips_mm[-2:].tolist() == [[20, 0, 0], [30, 0, 0]]
    kept = [e.text for e in path.events if e.kind is EventKind.OTHER]
    assert kept == ["CUTCOM/LEFT,XYPLAN", "CUTCOM/OFF", "CYCLE/DRILL,5.,400.,MMPM,1.", "CYCLE/OFF"]


def test_creo_lists_points_of_an_arc() -> None:
    with pytest.raises(FormatError, match=r"line 21: .*same circle.*path\.arc_points=arc or straight"):
        read_path(CORPUS / "creo.ncl")
    arc = read_path(CORPUS / "creo.ncl", arc_points="arc")
    on_arc = arc.tips_mm[2:-1]
    assert np.abs(np.linalg.norm(on_arc, axis=1) - 10).max() < 1e-8
    assert np.linalg.norm(np.diff(on_arc, axis=0), axis=1).sum() == pytest.approx(10 * np.pi, rel=1e-3)
    assert np.allclose(arc.axes[-1], [0, 0.6, 0.8])
    straight = read_path(CORPUS / "creo.ncl", arc_points="straight")
    assert straight.tips_mm[-3:-1].tolist() == [[0, 10, 0], [-10, 0, 0]]


def test_autodesk() -> None:
    path = read_path(CORPUS / "autodesk.apt")
    assert path.findings == ()
    assert path.tips_mm.tolist() == [[0, 0, 100], [12.5, 3.25, 20], [12.5, 3.25, -1], [18, 3.25, -1], [0, 0, 100]]
    assert path.rapid.tolist() == [True, True, False, False, True]
    assert np.allclose(path.axes[3], [0, 0.28, 0.96])


def test_makino_sections_and_every_layout_of_a_point() -> None:
    path = read_path(CORPUS / "makino.cldata")
    assert codes(path) == {305}
    assert path.tips_mm.tolist() == [[0, 0, 50], [5, 5, 10], [5, 5, 0], [9, 5, 0], [9, 9, 0.5]]
    assert np.allclose(path.axes, [[0, 0.6, 0.8]] * 4 + [[0, -0.6, 0.8]])
    assert path.rapid.tolist() == [True, True, False, False, False]
    assert "APTCL-SPEC,MAKINO-FF,1" in [e.text for e in path.events]


# --- repairs ---


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("GOTO/0,0,0\nGOTO/1,0,0\nCUTTER/10,$\n", 5, "file ends"),
        ("GOTO/0,0,0\nGOTO/1,0,0\nN9 SPINDL/900,$\n\n", 5, "file ends"),
        ("GOTO/0,0,0\nGOTO/1,0,0\nTLAXIS/0,\n", 5, "TLAXIS needs"),
        ("GOTO/0,0,0\nGOTO/1,0,0\nUNITS/", 5, "UNITS needs"),
        ("GOTO/0,0,0\nGOTO/1,0,0\nCUTCOM/LE", 5, "CUTCOM"),
        ("GOTO/0,0,0\nGOTO/1,0,0\n$$-> CSYS / 1,0 $", 5, "file ends"),
    ],
)
def test_a_last_statement_that_is_cut_short_and_moves_nothing_can_be_left_out(
    tmp_path: Path, text: str, line: int, words: str
) -> None:
    refused(tmp_path, HEAD + text, line, words, "--recover")
    path = read(tmp_path, HEAD + text, recover=True)
    assert path.tips_mm.tolist() == [[0, 0, 0], [1, 0, 0]]
    assert codes(path) == {316, 350}
    (dropped,) = [f for f in path.findings if f.code == 350]
    assert dropped.level is Level.WARN
    assert dropped.where.endswith("line 5")


@pytest.mark.parametrize(
    "cut",
    [
        *("GOTO/2,0\n", "GOTO/-4", "GOTO/2,0,$\n", "N7 GOTO/2,$", "L1) GOTO/2,", "GODLTA/1", "FROM/0,0\n", "GOHOME/1"),
        *("CIRCLE/0,0,0,0,0,1,1\n", "CIRCLE/0,0,\n\n", "INDIRV/1,0\n", "TLON,GOFWD/(CIRCLE/1,0\n", "GOT", "3.,4.\n"),
        *("CYCLE/DRI", "HELIX/1,2"),
    ],
)
def test_a_cut_motion_is_never_left_out(tmp_path: Path, cut: str) -> None:
    text = HEAD + "GOTO/0,0,0\nGOTO/1,0,0\n" + cut
    for recover in (False, True):
        with pytest.raises(FormatError) as caught:
            read(tmp_path, text, recover=recover)
        assert caught.value.line == 5
        assert "--recover" not in str(caught.value)


def test_an_arc_that_waits_is_not_left_out_with_what_follows_it(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nFEDRAT/$\n"
    refused(tmp_path, text, 5, "without the GOTO", recover=True)


def test_a_program_without_end_that_ends_in_a_cut_is_a_warning(tmp_path: Path) -> None:
    def level(rest: str) -> Level:
        (found,) = [f for f in read(tmp_path, HEAD + "GOTO/0,0,0\nGOTO/9,0,0\n" + rest).findings if f.code == 316]
        assert ("ends in a cut" in found.message) == (found.level is Level.WARN)
        return found.level

    assert level("") is Level.WARN
    assert level("GOTO/9,0,-5\n") is Level.WARN
    assert level("RAPID\nGOTO/9,0,50\n") is Level.INFO
    assert level("GOTO/9,0,50\n") is Level.INFO  # straight off the part
    assert level("GOTO/9,0,50\nCOOLNT/OFF") is Level.INFO
    # 5 may have been 50: the line has no end
    assert level("RAPID\nGOTO/9,0,5") is Level.WARN
    assert level("RAPID\nGOTO/9,0,$\n5") is Level.WARN


def test_a_damaged_motion_in_the_middle_is_never_repaired(tmp_path: Path) -> None:
    for damaged, words in (("GOTO/1,0", "3 numbers"), ("GXTO/1,0,0", "much like GOTO"), ("GTO/1,0,0,0,0,1", "GOTO")):
        text = HEAD + f"GOTO/0,0,0\n{damaged}\nGOTO/2,0,0\nFINI\n"
        refused(tmp_path, text, 4, words)
        refused(tmp_path, text, 4, words, recover=True)


def test_a_damaged_feed_or_dwell_can_be_kept_as_text(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0,0,0\nFEDRAT/6\x010\nDELAY/x\nGOTO/1,0,0\nFEDRAT/300\nGOTO/2,0,0\nFINI\n"
    refused(tmp_path, text, 4, "FEDRAT", "--recover")
    path = read(tmp_path, text, recover=True)
    assert path.feeds_mm_min.tolist() == [600, 0, 300]
    assert codes(path) == {302, 351}
    assert [e.text for e in path.events] == ["FEDRAT/6\x010", "DELAY/x"]
    assert all(f.message.isprintable() for f in path.findings)


def test_padding_after_the_end_can_be_dropped(tmp_path: Path) -> None:
    text = HEAD + "GOTO/0,0,0\nGOTO/1,0,0\nFINI\n"
    with pytest.raises(FormatError, match=rf"byte {len(text)}: ends with 64 NUL bytes.*--recover"):
        read(tmp_path, text + "\0" * 64)
    assert codes(read(tmp_path, text + "\0" * 64, recover=True)) == {352}


def test_gzip_and_version_numbers(tmp_path: Path) -> None:
    packed = tmp_path / "path.ncl.3.gz"
    packed.write_bytes(gzip.compress((CORPUS / "creo.ncl").read_bytes()))
    path = read_path(packed, arc_points="straight")
    assert path.original is not None
    assert path.original.suffix == ".ncl"
    assert path.original.rewritten(path, np.arange(len(path))).content == (CORPUS / "creo.ncl").read_bytes()


# --- arcs ---


def angles_deg(path: ToolPath, first: int) -> np.ndarray:
    return np.degrees(np.unwrap(np.arctan2(path.tips_mm[first:, 1], path.tips_mm[first:, 0])))


@pytest.mark.parametrize(
    ("circle", "turn_deg"),
    [
        ("CIRCLE/0,0,0,0,0,1", 90),  # SolidWorks CAM: right-hand rule
        ("CIRCLE/0,0,0,0,0,-1,10.", -270),  # Creo: right-hand rule
        ("CIRCLE/0,0,0,0,0,1,10.,0.06,0.5,20.,0.", -270),  # NX: clockwise about the axis
        ("CIRCLE/0,0,0,0,0,-1,10.,0.06,0.5,20.,0.", 90),
        ("CIRCLE/0,0,0,0,0,1,10.,COUNTERCLOCKWISE", 90),
        ("CIRCLE/0,0,0,0,0,1,10.,CLOCKWISE", -270),
    ],
)
def test_sense_of_circle_by_dialect(tmp_path: Path, circle: str, turn_deg: float) -> None:
    path = read(tmp_path, HEAD + f"RAPID\nGOTO/10,0,0\n{circle}\nGOTO/0,10,0\nFINI")
    angles = angles_deg(path, 0)
    assert angles[-1] - angles[0] == pytest.approx(turn_deg)
    assert np.abs(np.linalg.norm(path.tips_mm, axis=1) - 10).max() < 1e-9
    assert path.tips_mm[-1].tolist() == [0, 10, 0]
    assert set(path.lines[1:].tolist()) == {6}
    assert codes(path) == {306}


def test_stated_sense_wins_over_the_dialect(tmp_path: Path) -> None:
    text = HEAD + "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10.,0.06,0.5,20.,0.\nGOTO/0,10,0\nFINI"
    assert angles_deg(read(tmp_path, text, arc_sense="ccw"), 0)[-1] == pytest.approx(90)
    assert angles_deg(read(tmp_path, text, arc_sense="cw"), 0)[-1] == pytest.approx(-270)


def test_arcs_against_the_moves_beside_them_are_refused(tmp_path: Path) -> None:
    # The tool arrives upwards at (10, 0) and the arc would leave downwards.
    text = HEAD + "GOTO/10,-5,0\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10.\nGOTO/0,10,0\nGOTO/-5,10,0\nFINI"
    refused(tmp_path, text, 5, "run against", "path.arc_sense")
    assert angles_deg(read(tmp_path, text, arc_sense="cw"), 1)[-2] == pytest.approx(90)


@pytest.mark.parametrize("chord_mm", [0.1, 0.005, 0.0005])
def test_full_circle_keeps_chord_and_step(tmp_path: Path, chord_mm: float) -> None:
    text = HEAD + "GOTO/50,0,0\nCIRCLE/0,0,0,0,0,1,50.\nGOTO/50,0,0\nFINI"
    path = read(tmp_path, text, chord_mm=chord_mm, step_mm=7.0)
    middles = (path.tips_mm[1:] + path.tips_mm[:-1]) / 2
    steps = np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1)
    assert (50 - np.linalg.norm(middles, axis=1)).max() <= chord_mm
    assert steps.max() <= 7.0
    assert steps.sum() == pytest.approx(100 * np.pi, rel=5e-3)


def test_helix_and_turning_axis(tmp_path: Path) -> None:
    text = HEAD + "GOTO/10,0,0,1,0,0\nCIRCLE/0,0,0,0,0,1,10.\nGOTO/-10,0,6,0,0,1\nFINI"
    path = read(tmp_path, text)
    share = np.unwrap(np.arctan2(path.tips_mm[:, 1], path.tips_mm[:, 0])) / np.pi
    assert np.allclose(path.tips_mm[:, 2], 6 * share, atol=1e-9)
    assert np.allclose(np.linalg.norm(path.axes, axis=1), 1)
    assert path.axes[0].tolist() == [1, 0, 0]
    assert path.axes[-1].tolist() == [0, 0, 1]


def test_catia_arcs_in_space(tmp_path: Path) -> None:
    text = (
        HEAD + "GOTO  /   20.40000,    0.00000,  -30.00000\nAUTOPS\nINDIRV/    0.00000,    0.00000,    1.00000\n"
        "TLON,GOFWD/      (CIRCLE/     25.00000,      0.00000,    -30.00000,$\n"
        "       4.60000),ON,(LINE/     25.00000,      0.00000,    -30.00000,$\n"
        "                              25.00000,      0.00000,    -25.40000)\nGOTO/30,0,-25.4\nFINI\n"
    )
    path = read(tmp_path, text)
    arc = path.tips_mm[:-1]
    assert np.abs(np.linalg.norm(arc - [25, 0, -30], axis=1) - 4.6).max() < 1e-9
    assert (np.diff(arc[:, 2]) > 0).all()
    assert (np.diff(arc[:, 0]) > 0).all()
    assert arc[-1].tolist() == [25, 0, -25.4]
    assert set(path.lines[1:-1].tolist()) == {6}


# --- frames ---


def test_identity_frames_are_fine(tmp_path: Path) -> None:
    text = (
        "$$*CATIA0\n$$ Part\n$$ 1.00000 0.00000 0.00000 0.00000\n$$ 0.00000 1.00000 0.00000 0.00000\n"
        "$$ 0.00000 0.00000 1.00000 0.00000\nUNITS/MM\nMSYS/0,0,0,1,0,0,0,1,0\nTRNTYP/WORLD,0,0,0\n"
        "CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\n$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n 0.0, 1.0, 0.0, 0.0, $\n"
        " 0.0, 0.0, 1.0, 0.0\nORIGIN/0,0,0\nCUTCOM/OFF\nFEDRAT/1\nGOTO/0,0,0\nGOTO/1,0,0\nFINI"
    )
    assert read(tmp_path, text).findings == ()


def test_frames_can_be_applied_or_kept(tmp_path: Path) -> None:
    text = "MSYS/1,2,3,0,1,0,-1,0,0\nUNITS/INCHES\nFEDRAT/1\nGOTO/1,0,0,1,0,0\nGOTO/1,1,0\nFINI"
    refused(tmp_path, text, 1, "MSYS", "path.frame=apply")
    applied = read(tmp_path, text, frame="apply")
    assert np.allclose(applied.tips_mm / 25.4, [[1, 3, 3], [0, 3, 3]])
    assert np.allclose(applied.axes, [0, 1, 0])
    kept = read(tmp_path, text, frame="keep")
    assert np.allclose(kept.tips_mm / 25.4, [[1, 0, 0], [1, 1, 0]])
    assert codes(applied) == codes(kept) == {317}


def test_catia_axis_system_is_applied(tmp_path: Path) -> None:
    text = (
        "$$*CATIA0\n$$ MSYS/\n$$     1.00000     0.00000     0.00000  -220.00000\n"
        "$$     0.00000    -1.00000     0.00000     0.00000\n$$     0.00000     0.00000    -1.00000     5.00000\n"
        + HEAD
        + "GOTO/220,1,2,0,0,1\nGOTO/221,1,2\nFINI\n"
    )
    path = read(tmp_path, text, frame="apply")
    assert np.allclose(path.tips_mm, [[0, -1, 3], [1, -1, 3]])
    assert np.allclose(path.axes, [0, 0, -1])
    refused(tmp_path, text, 5, "CATIA0")


MOVES = "GOTO/0,0,0\nGOTO/1,0,0\nFINI\n"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("GOTO/1,2\n", 3, ["3 numbers"]),
        ("GOTO/1,2,3,4,5,6,7\n", 3, ["3 numbers"]),
        ("GOTO/1,2,3,\n", 3, ["3 numbers"]),
        ("GOTO/1_0,2,3\n", 3, ["3 numbers"]),
        ("GOTO/nan,2,3\n", 3, ["3 numbers"]),
        ("GOTO/\u0661,2,3\n", 3, ["3 numbers"]),
        ("GOTO/P1\n", 3, ["3 numbers"]),
        ("GOTO/0,0,0\nGOTO/1,2,3 $\n", 4, ["file ends"]),
        ("GOTO/0,0,0\n1.,2.,3.\n", 4, ["numbers without a word"]),
        ("/1,2,3\n", 3, ["without a word"]),
        ("GOTO/0,0,0\nGOTO/1e9,0,0\n", 4, ["coordinate_mm"]),
        ("GOTO/0,0,0\nGOTO/1e400,0,0\n", 4, ["coordinate_mm"]),
        ("GOTO/0,0,0\nGOTO/1,0,0,1e300,1e300,0\n", 4, ["axis"]),
        ("GOTO/0,0,0\nUNITS/INCHES\n" + MOVES, 4, ["unit changes"]),
        ("UNITS/CUBITS\n", 3, ["UNITS"]),
        ("FEDRAT/0\n", 3, ["above zero"]),
        ("FEDRAT/MMPM\n", 3, ["FEDRAT"]),
        ("FEDRAT/10,INVERS\n", 3, ["FEDRAT"]),
        ("GOTO/0,0,0\nCIRCLE/\n", 4, ["CIRCLE"]),
        ("CIRCLE/0,0,0,0,0,1\nGOTO/1,0,0\n", 3, ["before any position"]),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\n", 4, ["without the GOTO"]),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,0,1\nGOTO/0,1,0\n", 4, ["axis"]),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nGOTO/0,2,0\n", 4, ["off the circle"]),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1,0.01,0.5,1,0,TIMES,2\nGOTO/0,1,0\n", 4, ["TIMES"]),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nGODLTA/1,0,0\n", 4, ["GOTO"]),
        ("RAPID\nGOTO/9,0,0\nCIRCLE/0,0,0,0,0,1,9\nGOTO/0,9,0\nGOTO/-9,0,0\n", 7, ["same circle"]),
        ("GOTO/0,0,0\nTLON,GOFWD/(CIRCLE/1,0,0,1),ON,(LINE/1,0,0,2,0,0)\n", 4, ["INDIRV"]),
        ("GOTO/0,0,0\nINDIRV/1,0,0\nTLON,GOFWD/(CIRCLE/1,0,0,1),ON,(LINE/1,0,0,2,0,0)\n", 5, ["INDIRV"]),
        ("GOTO/0,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/1,0,0,1),TO,(LINE/1,0,0,2,0,0)\n", 5, ["TLON"]),
        ("GODLTA/1,0,0\n", 3, ["GODLTA"]),
        ("GOTO/0,0,0\nGODLTA/5\n", 4, ["GODLTA"]),
        ("GOHOME\n", 3, ["GOHOME"]),
        ("GOTO/0,0,0\nFROM/5,0,0\n", 4, ["FROM"]),
        ("GOTP/1,2,3\n", 3, ["GOTP"]),
        ("AA=GOTO/1,0,0\n", 3, ["APT language"]),
        ("AA=GOHOME\n", 3, ["APT language"]),
        ("MOVARC/0,0,0,0,0,1,5\n", 3, ["moves the tool", "GOTO"]),
        ("HELIX/1\n", 3, ["moves the tool"]),
        ("MOVETO/1,2,3\n", 3, ["moves the tool"]),
        ("POSITN/X,5\n", 3, ["moves the tool"]),
        ("TRANSL/1,0,0\n", 3, ["frame"]),
        ("COORD/1,0,0\n", 3, ["frame"]),
        ("DEFSUB/1\n", 3, ["APT language"]),
        ("CALSUB/1\n", 3, ["APT language"]),
        ("ENDSUB\n", 3, ["APT language"]),
        ("CYCLE/DRILL,5\n", 3, ["drilling"]),
        ("CUTCOM/LEFT,XYPLAN\n", 3, ["tool radius"]),
        ("TRANS/0,0,5\n", 3, ["frame"]),
        ("ROTATE/ZAXIS,90\n", 3, ["frame"]),
        ("ORIGIN/1,0,0\n", 3, ["frame"]),
        ("ROTABL/1.57,AAXIS,TABLE,CCLW\n", 3, ["frame"]),
        ("NURBS/3\n", 3, ["splines"]),
        ("SET/MODE,INCR\n", 3, ["incremental"]),
        ("MSYS/0,0,0,2,0,0,0,2,0\n", 3, ["orthonormal"]),
        ("CSYS/1,0,0,0,0,1,0,0,0,0,-1,0\n", 3, ["orthonormal"]),
        ("CSYS/1,0,0,5,0,1,0,0,0,0,1,0\n", 3, ["path.frame=keep"]),
        ("TLAXIS/0,0,0\n", 3, ["axis"]),
        ("RAPID/5\n", 3, ["RAPID"]),
        ("DELAY/REV\n", 3, ["DELAY"]),
        ("GOTO/5,5,5\n", 3, ["one point"]),
        ("GOTO/5,5,5\nGOTO/5,5,5\n", 3, ["one point"]),
    ],
)
def test_bad_statements_name_their_line(tmp_path: Path, text: str, line: int, words: list[str]) -> None:
    refused(tmp_path, HEAD + text, line, *words)


def test_files_that_are_no_path(tmp_path: Path) -> None:
    refused(tmp_path, "hello\n", 1, "no move")
    with pytest.raises(FormatError, match=r"path\.apt, byte 3: .*NUL"):
        read(tmp_path, "GOT\0/1,2,3")
    with pytest.raises(FormatError, match=r"path\.apt.*empty"):
        read(tmp_path, "")
    with pytest.raises(FormatError, match=r"absent\.apt"):
        read_path(tmp_path / "absent.apt")


def test_caps(tmp_path: Path) -> None:
    many = HEAD + "".join(f"GOTO/{x},0,0\n" for x in range(12))
    refused(tmp_path, many, 13, "path_points", limits=Limits(path_points=10))
    circle = HEAD + "GOTO/1000000,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/1000000,0,0\n"
    refused(tmp_path, circle, 5, "path_points", limits=Limits(path_points=1000))
    refused(tmp_path, HEAD + "$$" + "x" * 100, 3, "line_bytes", limits=Limits(line_bytes=90))


def test_bad_options_are_job_errors(tmp_path: Path) -> None:
    text = HEAD + MOVES
    for options in (
        {"feed_mm_min": 0.0},
        {"chord_mm": float("nan")},
        {"step_mm": -1.0},
        {"frame": "x"},
        {"arc_sense": ""},
        {"arc_points": "x"},
        {"cutcom": "off"},
        {"cycles": "yes"},
    ):
        with pytest.raises(JobError, match=rf"path\.{next(iter(options))}"):
            read(tmp_path, text, **options)


def test_control_characters_do_not_reach_messages(tmp_path: Path) -> None:
    path = read(tmp_path, HEAD + "A\x1b]0;x\x07B/1\n" + MOVES)
    assert all(finding.message.isprintable() for finding in path.findings)
    with pytest.raises(SicpError) as caught:
        read(tmp_path, HEAD + "GO\x1b]0;x\n")
    assert str(caught.value).isprintable()
