"""The reader of Heidenhain conversational programs against programs whose truth is known, and its checker."""

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.model import EventKind
from sicp_formats.klartext import read_path
from sicp_formats.klartext.check import check

VECTORS = """0 BEGIN PGM TRIM MM
1 ; first side
2 BLK FORM 0.1 Z X+0 Y+0 Z-20
3 TOOL CALL 3 Z S12000
4 M128
5 M3
6 LN X+100 Y+0 Z+50 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1 FMAX
7 M8
8 LN X+100 Y+0 Z+5 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1 F2000
9 CYCL DEF 9.0 DWELL TIME
10 CYCL DEF 9.1 DWELL 1.500
11 LN X+90 Y+10.5 Z+5 NX+0.6 NY+0 NZ+0.8 TX+0.6 TY+0 TZ+0.8
12 STOP
13 LN X+90 Y+10.5 Z+50 NX+0.6 NY+0 NZ+0.8 TX+0.6 TY+0 TZ+0.8 FMAX
14 M9
15 M5
16 M129
17 M30
18 END PGM TRIM MM
"""
ROTARY = """0 BEGIN PGM TURN MM
1 TOOL CALL 1 Z S8000
2 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS
3 L X+0 Y+0 Z+50 A+0 C+170 R0 FMAX M3
4 L Z+0 R0 F1000
5 L X+10 A+30 C+175
6 L IX+10 Y,5 C+185
7 L Z+50 R0 FMAX
8 FUNCTION RESET TCPM
9 M30
10 END PGM TURN MM
"""
LABELS = """BEGIN PGM SUB MM
TOOL CALL 2 Z S5000
L X+0 Y+0 Z+10 R0 FMAX M13
CALL LBL 1
CALL LBL "BACK"
M30
LBL 1
L Z+0 F500
L X+10
LBL 0
LBL "BACK"
L Y+10
LBL 0
END PGM SUB MM
"""
GOOD = {"vectors": VECTORS, "rotary": ROTARY, "labels": LABELS}


def written(tmp_path, text):
    file = tmp_path / "a.h"
    file.write_text(text, encoding="utf-8")
    return file


def read(tmp_path, text, **options):
    return read_path(written(tmp_path, text), **options)


def test_vectors_feeds_and_events(tmp_path):
    path = read(tmp_path, VECTORS)
    assert path.tips_mm.tolist() == [[100, 0, 50], [100, 0, 5], [90, 10.5, 5], [90, 10.5, 50]]
    assert np.allclose(path.axes, [[0, 0, 1], [0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]])
    assert path.feeds_mm_min.tolist() == [0, 2000, 2000, 0]
    assert path.rapid.tolist() == [True, False, False, True]
    assert path.lines.tolist() == [7, 9, 12, 14]
    assert (path.name, path.source.format, path.source.unit, path.source.unit_stated) == (
        "TRIM", "Heidenhain", "mm", True
    )  # fmt: skip
    assert path.findings == ()
    told = [(e.kind, e.value, e.before_move, e.line) for e in path.events if e.kind is not EventKind.OTHER]
    assert told == [
        (EventKind.COMMENT, 0.0, 0, 2),
        (EventKind.TOOL, 3.0, 0, 4),
        (EventKind.SPINDLE, 12000.0, 0, 6),
        (EventKind.COOLANT, 1.0, 1, 8),
        (EventKind.DWELL, 1.5, 2, 11),
        (EventKind.STOP, 0.0, 3, 13),
        (EventKind.COOLANT, 0.0, 4, 15),
        (EventKind.SPINDLE, 0.0, 4, 16),
    ]


def test_rotary_words_incremental_words_and_decimal_commas(tmp_path):
    path = read(tmp_path, ROTARY, rotary="AC")
    assert path.tips_mm.tolist() == [[0, 0, 50], [0, 0, 0], [10, 0, 0], [20, 0.5, 0], [20, 0.5, 50]]
    a, c = np.radians([30.0, 175.0])
    assert np.allclose(path.axes[2], [np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)])
    assert [f.code for f in path.findings] == []
    assert [f.code for f in read(tmp_path, ROTARY.replace("FUNCTION TCPM", "* -"), rotary="AC").findings] == [313]


def test_labels_are_followed(tmp_path):
    path = read(tmp_path, LABELS)
    assert path.tips_mm.tolist() == [[0, 0, 10], [0, 0, 0], [10, 0, 0], [10, 10, 0]]
    assert path.lines.tolist() == [3, 8, 9, 12]
    assert [e.kind for e in path.events] == [EventKind.TOOL, EventKind.SPINDLE, EventKind.COOLANT]


def test_machine_positions_are_no_part_of_the_path(tmp_path):
    text = ROTARY.replace("7 L Z+50 R0 FMAX", "7 L Z+50 R0 FMAX\nL Z-5 R0 FMAX M91\nL Z+60 FMAX")
    path = read(tmp_path, text, rotary="AC")
    assert len(path) == 6 and [f.code for f in path.findings] == [318]


def test_inches_keep_their_feeds_for_the_user_to_state(tmp_path):
    text = LABELS.replace(" MM", " INCH")
    with pytest.raises(FormatError, match=r"a\.h, line 8: F in a program in inches"):
        read(tmp_path, text)
    path = read(tmp_path, text, feed_mm_min=300.0)
    assert path.tips_mm[2].tolist() == [254.0, 0.0, 0.0] and path.feeds_mm_min.tolist() == [0, 300, 300, 300]
    assert [f.code for f in path.findings] == [356]
    with pytest.raises(UnitError, match="the file states inch"):
        read(tmp_path, text, units="mm", feed_mm_min=300.0)


@pytest.mark.parametrize(
    ("program", "old", "new", "line", "told"),
    [
        ("vectors", "0 BEGIN PGM TRIM MM\n", "", 2, "does not begin with BEGIN PGM"),
        ("vectors", "TX+0.6 TY+0 TZ+0.8\n12", "\n12", 12, "LN without TX, TY and TZ"),
        ("vectors", "TX+0.6 TY+0 TZ+0.8\n12", "TX+0 TY+0 TZ+0\n12", 12, "is \\(0, 0, 0\\)"),
        ("vectors", " F2000", "", 9, "without a feed that is known"),
        ("vectors", "F2000", "F0", 9, "F0 is not possible"),
        ("vectors", "X+90 Y+10.5 Z+5 ", "X+90 X+91 Z+5 ", 12, "a word stands twice"),
        ("vectors", "X+90 Y+10.5 Z+5 ", "X+90 Y+Q1 Z+5 ", 12, "'Y\\+Q1 Z\\+5 .*' is not understood"),
        ("vectors", "12 STOP", "12 CC X+0 Y+0", 13, "arcs, polar moves and contours are not read"),
        ("vectors", "12 STOP", "12 CYCL CALL", 13, "cycles are no contour"),
        ("vectors", "12 STOP", "12 CYCL DEF 7.0 DATUM SHIFT", 13, "changes what the coordinates mean"),
        ("vectors", "12 STOP", "12 PLANE SPATIAL SPA+10 SPB+0 SPC+0 STAY", 13, "changes what the coordinates mean"),
        ("vectors", "12 STOP", "12 Q5 = 3", 13, "parameters are not evaluated"),
        ("vectors", "12 STOP", "12 FROBNICATE", 13, "is not known here"),
        ("vectors", "12 STOP", "12 M99", 13, "M99 changes how the tool moves"),
        ("vectors", "17 M30\n18 END PGM TRIM MM\n", "17 LN X+1 ~\n", 18, "goes on \\(~\\) but the file ends"),
        ("rotary", "R0 F1000", "RL F1000", 5, "RL: tool radius compensation"),
        ("rotary", "L X+10 A+30 C+175", "L X+10 A+30 B+1", 6, "B\\+1: what the rotary axes do"),
        (
            "rotary",
            "L X+0 Y+0 Z+50 A+0 C+170 R0 FMAX",
            "L Y+0 A+0 C+170 R0 FMAX",
            5,
            "a cutting move before X, Y and Z",
        ),
        ("rotary", "L X+0 Y+0 Z+50 A", "L IX+0 Y+0 Z+50 A", 4, "IX before the position is known"),
        ("rotary", "L X+10 A", "L U+3 X+10 A", 6, "further axes"),
        ("labels", "CALL LBL 1", "CALL LBL 3", 4, "LBL 3 is nowhere"),
        ("labels", "CALL LBL 1", "CALL LBL 1 REP 3", 4, "REP"),
        ("labels", "LBL 0\nEND", "END", 13, "a label without LBL 0"),
        ("labels", "L X+10\n", "CALL LBL 1\n", 9, "nested too deep"),
    ],
)
def test_what_cannot_be_followed_is_refused_with_its_line(tmp_path, program, old, new, line, told):
    assert GOOD[program].count(old) == 1
    text = GOOD[program].replace(old, new)
    with pytest.raises(FormatError, match=rf"a\.h, line {line}: .*{told}"):
        read(tmp_path, text, rotary="AC")


def test_without_a_word_on_the_rotary_axes_nothing_is_guessed(tmp_path):
    with pytest.raises(FormatError, match=r"C\+170: .*--set path\.rotary=AC"):
        read(tmp_path, ROTARY)
    with pytest.raises(JobError, match="must be one of AC"):
        read(tmp_path, ROTARY, rotary="XY")


# --- the checker ---


@pytest.mark.parametrize("name", GOOD)
def test_a_good_program_has_no_findings(tmp_path, name):
    assert check(written(tmp_path, GOOD[name])) == ()


@pytest.mark.parametrize(
    ("name", "old", "new", "code", "level", "line", "words"),
    [
        ("vectors", "18 END PGM TRIM MM\n", "", 880, "fail", 18, "no END PGM"),
        ("vectors", "17 M30\n", "17 M1\n", 880, "warn", 19, "no end (M2 or M30)"),
        ("vectors", "END PGM TRIM MM", "END PGM TRIMS MM", 881, "fail", 19, "END PGM names TRIMS, BEGIN PGM TRIM"),
        ("vectors", "7 M8", "9 M8", 881, "warn", 8, "the block number is 9, not 7"),
        ("vectors", " F2000", "", 883, "fail", 9, "before a feed (F)"),
        ("vectors", "F2000", "F0", 883, "fail", 9, "F0: a feed must be more than 0"),
        ("rotary", "C+185", "C-175", 885, "warn", 7, "C turns by 350 degrees in one block, from 175 to -175"),
        ("vectors", "TX+0.6 TY+0 TZ+0.8\n12", "TX+0.6 TY+0\n12", 885, "fail", 12, "LN without TX TY TZ"),
        ("vectors", "NX+0.6 NY+0 NZ+0.8 TX+0.6 TY+0 TZ+0.8\n12", "NX+1 NY+0 NZ+0.8 TX+0.6 TY+0 TZ+0.8\n12", 885, "fail",
         12, "NX NY NZ have the length 1.28062, not 1"),
        ("vectors", "14 M9", "14 TOOL CALL 4 Z", 886, "warn", 15, "the tool is changed while M128"),
        ("vectors", "3 TOOL CALL 3 Z S12000", "3 M1", 886, "warn", 0, ""),
        ("vectors", "END PGM TRIM MM", "END PGM TRIM INCH", 887, "fail", 19, "END PGM states INCH, BEGIN PGM MM"),
        ("vectors", "4 M128", "4 M126", 888, "fail", 9, "turns in a cut while M128 or TCPM is off"),
        ("vectors", "16 M129", "16 M1", 888, "warn", 18, "ends while M128 or TCPM is on"),
        ("rotary", "2 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "2 M1", 888, "warn", 0, ""),
        ("rotary", "6 L IX+10", "6 M129\nL IX+10", 888, "fail", 8, "turns in a cut while M128 or TCPM is off"),
        ("vectors", "first side", "f\u00fcrst side", 889, "warn", 2, "no ASCII character"),
    ],
)  # fmt: skip
def test_a_defect_is_told_with_its_code_and_line(tmp_path, name, old, new, code, level, line, words):
    assert GOOD[name].count(old) == 1
    file = written(tmp_path, GOOD[name].replace(old, new))
    found = check(file)
    if not words:  # a program without TOOL CALL, or for a machine without TCPM, is none that is wrong by itself
        assert found == ()
        return
    told = next((f.code, f.level.value, f.where) for f in found if words in f.message)
    assert told == (code, level, f"{file}, line {line}")


def test_cuts_before_the_tool_and_turns_before_tip_control(tmp_path):
    late = ROTARY.replace("1 TOOL CALL 1 Z S8000\n", "").replace("8 FUNCTION RESET TCPM", "8 M129\nTOOL CALL 1 Z S8000")
    found = check(written(tmp_path, late))
    assert (886, "cuts before the first TOOL CALL") in [(f.code, f.message) for f in found]
    moved = ROTARY.replace("2 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\n", "").replace("7 L Z", "M128\n7 L Z")
    found = check(written(tmp_path, moved))
    assert [(f.message, f.where[-6:]) for f in found if f.code == 888] == [
        ("the tool turns in a cut before M128 or TCPM is switched on", "line 5")
    ]
