"""Each defect of a G-code program, put into a good one, is told with its code and its line."""

import time

import pytest

from sicp_cam.errors import JobError
from sicp_cam.findings import Level
from sicp_cam.plugins.checkers import check_program
from sicp_formats.gcode import read_path
from sicp_formats.gcode.check import check

VECTOR = """%
(porthole)
N10 G21 G90 G94 G17 G40
N20 T3 M6
N30 G43.5 H3
N40 S12000 M3
N50 G0 X100. Y0. Z50. I0.1 J0. K0.995
N60 G1 X100. Y0. Z5. I0.1 J0. K0.995 F2000
N70 G1 X98. Y20. Z5. I0.1 J0.05 K0.99
N80 G0 X98. Y20. Z50. I0.1 J0.05 K0.99
N90 M5
N100 G49
N110 M30
%
"""
ROTARY = """G21 G90 G94 G17
G49
G43.4 H1
G0 X0. Y0. Z50. A10. C170.
G1 Z0. F1000
G1 X10. Y0. A10. C175.
G1 X20. Y5. A11. C185.
G0 Z50.
G49
M30
"""
ARCS = """G21 G90 G17
G0 X0 Y0 Z5
G1 Z0 F500
G2 X10 Y0 I5 J0
G3 X10 Y10 R5
G2 X10 Y10 I5
G18 G2 X20 Z0 I5 K0
G1 X20 Y20
M2
"""
INVERSE = """G21 G90 G17 G93
G0 X0 Y0 Z5
G1 X10 F60
G1 X20 F30
M30
"""
HEIDENHAIN = """%PART G71 *
N10 G30 G17 X+0 Y+0 Z-20*
N20 G00 G90 X+0 Y+0 Z+50*
N30 G01 Z-1 F500*
N40 X+20 Y+5*
N50 G00 Z+50 M2*
N99999 %PART G71 *
"""
SIEMENS = """%_N_PART_MPF
G710 G90 G94 G17 G40
TRAFOOF
T="MILL" M6
TRAORI
MSG("hello")
S1000 M3
G0 X0 Y0 Z50 A3=0 B3=0 C3=1
G1 X0 Y0 Z0 A3=0 B3=0.1 C3=0.99 F800
G1 X=IC(5) Y3
M5
TRAFOOF
M30
"""
GOOD = {
    "vector": VECTOR,
    "rotary": ROTARY,
    "arcs": ARCS,
    "inverse": INVERSE,
    "siemens": SIEMENS,
    "heidenhain": HEIDENHAIN,
}
BROKEN = [
    # program, old, new, code, level, line, words
    ("vector", "%\n(porthole)", "(porthole)", 870, "warn", 13, "without its counterpart at the beginning"),
    ("vector", "M30\n%", "M30", 870, "warn", 1, "without its counterpart at the end"),
    ("vector", "M30\n%", "M30\n%\n%", 870, "fail", 15, "a third %"),
    ("vector", "%\n(porthole)", "(head)\n%\n(porthole)", 870, "warn", 1, "text before the first %"),
    ("vector", "(porthole)", "(p\u00f6rthole)", 870, "warn", 2, "no ASCII character"),
    ("vector", "(porthole)", f"({'p' * 300})", 870, "fail", 2, "302 characters, more than 255"),
    ("vector", "N110 M30\n%", "%", 871, "warn", 13, "no end"),
    ("vector", "G21 G90", "G90", 872, "warn", 7, "units"),
    ("vector", "G21 G90", "G21", 872, "warn", 7, "absolute coordinates"),
    ("arcs", "G21 G90 G17", "G21 G90", 872, "warn", 4, "arc before its plane"),
    ("arcs", "G0 X0 Y0 Z5", "X0 Y0 Z5", 872, "fail", 2, "without a motion word"),
    ("vector", "N70 ", "N60 ", 873, "warn", 9, "N60 stands twice"),
    ("vector", "N70 ", "N55 ", 873, "warn", 9, "N55 comes after N60"),
    ("vector", "G94 G17", "G93 G94 G17", 874, "fail", 3, "G93, G94 in one block"),
    ("vector", "M5\n", "M5 M3\n", 874, "fail", 11, "M5, M3 in one block"),
    ("vector", "M5\n", "M5 M5\n", 874, "fail", 11, "M5"),
    ("vector", "G40", "G321", 874, "fail", 3, "unknown g code used: G321"),
    ("vector", "X98. Y20. Z5.", "X98. X20. Z5.", 874, "fail", 9, "multiple X words"),
    ("vector", "X98. Y20. Z5.", "X98. Y#1 Z5.", 874, "fail", 9, "variables"),
    ("vector", "(porthole)", "(porthole", 874, "fail", 2, "unclosed comment"),
    ("vector", " F2000", "", 875, "fail", 8, "before a feed"),
    ("vector", "F2000", "F0", 875, "fail", 8, "must be more than 0"),
    ("inverse", "X20 F30", "X20", 875, "fail", 4, "inverse time (G93) without F"),
    ("inverse", "G1 X10 F60", "G1 G94 X10", 875, "fail", 3, "before a feed"),
    ("vector", "N30 G43.5 H3\n", "", 876, "fail", 6, "no word switches tip control on"),
    ("vector", "G43.5", "G43.4", 876, "fail", 7, "G43.5 is not on"),
    ("vector", "N100 G49\n", "", 876, "warn", 12, "ends while tip control is on"),
    ("vector", "N90 M5", "N90 T4 M6", 876, "warn", 11, "tool is changed while tip control is on"),
    ("vector", "N80 G0", "N75 G49\nN80 G0", 876, "fail", 11, "after tip control is switched off"),
    ("vector", "N30 G43.5 H3\n", "", 876, "fail", 6, "as a vector"),
    ("siemens", "TRAORI\n", "", 876, "fail", 7, "no word switches tip control on"),
    ("rotary", "G0 Z50.\nG49", "G49\nG1 C200.\nG0 Z50.", 876, "fail", 9, "C turns in a cut after tip control"),
    ("rotary", "G43.4 H1\nG0", "G0 A0. C0.\nG1 X1. A5. F100\nG43.4 H1\nG0", 876, "fail", 4, "before tip control"),
    ("vector", "N90 M5", "N85 G49\nN90 G1 X50.", 876, "fail", 12, "while the tool axis of the last vector still holds"),
    ("vector", "N90 M5", "N85 G43 H3\nN90 G1 X50.", 876, "fail", 12, "while the tool axis of the last vector"),
    ("siemens", "M5\nTRAFOOF", "TRAFOOF\nG1 X9 Y9", 876, "fail", 12, "while the tool axis of the last vector"),
    ("rotary", "G0 Z50.\nG49", "G49\nG1 X30.\nG0 Z50.", 876, "warn", 9, "while A11 C185 still hold"),
    ("rotary", "G0 Z50.\nG49", "G43 H1\nG1 X30.\nG0 Z50.", 876, "warn", 9, "while A11 C185 still hold"),
    (
        "rotary",
        "G43.4 H1\nG0 X0. Y0. Z50. A10. C170.",
        "G0 X0. Y0. Z50. A10. C170.\nG43.4 H1",
        876,
        "warn",
        3,
        "rotary words beside X Y Z before tip control",
    ),
    ("rotary", "G43.4 H1\n", "G43.4\n", 876, "warn", 3, "G43.4 without H"),
    ("rotary", "G49\nM30", "G49\nG53 G0 Z0.\nG1 X30.\nM30", 876, "warn", 11, "while A11 C185 still hold"),
    ("vector", "G43.5 H3", "G43.5", 876, "warn", 5, "G43.5 without H"),
    ("vector", "G43.5 H3", "G43.5 H4", 876, "info", 5, "H4 is taken for the tool T3"),
    ("rotary", "G49\nG43.4 H1", "T1 M6\nG43.4 H1\nG49\nT2 M6\nG43.4", 876, "warn", 8, "no H since T2"),
    (
        "vector",
        "X98. Y20. Z5.",
        "X98 Y20. Z5.",
        874,
        "warn",
        9,
        "1 X word without a decimal point among those with one",
    ),
    ("rotary", "G0 X0. Y0. Z50. A10.", "G0 X0 Y0 Z50 A10", 874, "warn", 4, "1 A word without a decimal point"),
    ("rotary", "C185.", "C-175.", 877, "warn", 7, "C turns by 350 degrees in one block, from 175 to -175"),
    ("arcs", "X10 Y0 I5 J0", "X10 Y0 I6 J0", 878, "fail", 4, "begins 6 and ends 4"),
    ("arcs", "X10 Y10 R5", "X10 Y10 R4", 878, "fail", 5, "R4 makes no arc"),
    ("arcs", "X10 Y10 R5", "X10 Y10", 878, "fail", 5, "neither R nor I J"),
    ("arcs", "I5 K0", "I7 K0", 878, "fail", 7, "begins 7 and ends 3"),
    ("vector", "(porthole)", "(MSG, porthole)", 879, "warn", 2, "MSG is executed"),
    ("vector", "(porthole)", "(logopen,x.txt)", 879, "warn", 2, "LOGOPEN is executed"),
    ("vector", "(porthole)", ";py,stop()", 879, "warn", 2, "PY is executed"),
]


def findings_of(tmp_path, text, **options):
    file = tmp_path / "a.nc"
    file.write_text(text, encoding="utf-8")
    return check(file, **options)


@pytest.mark.parametrize("name", GOOD)
def test_a_good_program_has_no_findings_and_can_be_read(tmp_path, name):
    assert findings_of(tmp_path, GOOD[name]) == ()
    read_path(tmp_path / "a.nc", rotary="AC" if name == "rotary" else None)


@pytest.mark.parametrize(("name", "old", "new", "code", "level", "line", "words"), BROKEN)
def test_a_defect_is_told_with_its_code_and_line(tmp_path, name, old, new, code, level, line, words):
    assert GOOD[name].count(old) == 1
    found = findings_of(tmp_path, GOOD[name].replace(old, new))
    told = next((f.code, f.level.value, f.where) for f in found if words in f.message)
    assert told == (code, level, f"{tmp_path / 'a.nc'}, line {line}")
    assert {f.code for f in found} == {code}


def test_what_is_positioned_or_turned_back_is_no_alarm(tmp_path):
    head = "G43.4 H1\nG0 X0."
    for old, new in (
        (head, "G0 A10. C170.\nG43.4 H1\nG0 X0."),  # the rotary axes are set before, and nothing else
        (head, "G0 X5. Y5. A10. C170.\nG43.4 H1\nG0 X0."),  # as examples of Haas do before G234
        ("G49\nM30", "G49\nG0 A0. C360.\nG1 X5.\nM30"),
        ("G49\nM30", "G49\nG53 G0 A0. C0.\nG1 X5.\nM30"),
        ("G49\nM30", "G49\nG0 X5.\nM30"),
        ("G49\nM30", "G49\nG53 G0 Z0.\nM30"),
        (head, f"T1 M6\n{head}"),
        (head, f"T7\n{head}"),  # chosen, not yet changed to
    ):
        assert ROTARY.count(old) == 1
        assert findings_of(tmp_path, ROTARY.replace(old, new)) == ()


def test_rotary_words_of_a_program_without_tip_control_are_told_only(tmp_path):
    """So are programs on purpose whose X Y Z are those of the machine."""
    (found,) = findings_of(tmp_path, ROTARY.replace("G43.4 H1", "G43 H1"))
    assert (found.code, found.level, found.where[-6:]) == (876, Level.INFO, "line 5")
    assert "no word switches tip control on: X Y Z must be those of the machine" in found.message


def test_a_tool_may_be_changed_where_controls_know_its_length(tmp_path):
    again = VECTOR.replace("N90 M5\n", "N85 G49\nN86 T4 M6\nN87 G43.5 H4\nN88 G1 X0. Y0. Z9. I0. J0. K1.\nN90 M5\n")
    assert findings_of(tmp_path, again) == ()
    found = findings_of(tmp_path, again.replace("H4", ""))
    assert [(f.code, f.level, f.where[-7:]) for f in found] == [(876, Level.WARN, "line 14")]
    bare = INVERSE.replace("G0 X0", "T1 M6\nG43\nG0 X0")  # LinuxCNC takes the length of the tool in the spindle
    assert findings_of(tmp_path, bare) == ()
    assert findings_of(tmp_path, INVERSE.replace("G0 X0", "T1 M6\nG0 X0")) == ()  # lengths are no matter of H here


def test_a_text_of_two_bytes_a_character_is_no_program(tmp_path):
    file = tmp_path / "a.nc"
    for encoding, mark in (("utf-16-le", b"\xff\xfe"), ("utf-16-be", b"\xfe\xff")):
        file.write_bytes(mark + VECTOR.encode(encoding))
        (found,) = check(file)
        assert (found.code, found.level) == (870, Level.FAIL)
        assert "UTF-16, which no control reads; save it as ASCII" in found.message


def test_missing_points_are_counted_where_they_matter(tmp_path):
    text = ROTARY.replace("G0 Z50.", "G1 X40 Y0\nG1 X50 Y0\nG4 X2\nG0 Z50.")
    (found,) = findings_of(tmp_path, text)
    assert (found.code, found.level, found.where[-6:]) == (874, Level.WARN, "line 8")
    assert found.message.startswith("2 X words without a decimal point among those with one, the first X40:")
    assert findings_of(tmp_path, SIEMENS.replace("X0 Y0 Z0 A3", "X20 Y.5 Z0 A3").replace("Y3", "Y4")) == ()
    assert findings_of(tmp_path, HEIDENHAIN.replace("X+20", "X+20.5")) == ()
    assert findings_of(tmp_path, text.replace("G17", "G17 G64 P0.01", 1)) == ()  # LinuxCNC


@pytest.mark.parametrize(("call", "file"), [("o<part_1> call", "part_1.ngc"), ("N7 Part_1", "Part_1.spf")])
def test_a_subprogram_beside_the_program_may_be_called(tmp_path, call, file):
    text = INVERSE.replace("M30", f"{call}\nM30")
    assert [f.level for f in findings_of(tmp_path, text)] == [Level.FAIL]
    (tmp_path / file).write_text("M2\n", encoding="ascii")
    (found,) = findings_of(tmp_path, text)
    assert (found.code, found.level, found.where[-6:]) == (874, Level.INFO, "line 5")
    assert found.message == f"{file} is a program of its own, not judged with this one"


def test_inches_and_incremental_moves_are_followed(tmp_path):
    text = "G20 G91 G17\nG0 X0 Y0 Z0\nG1 X1 F10\nG2 X1 Y0 I.5 J0\nG2 X1 Y0 I.5001 J0\nG2 X1 Y0 I.501 J0\nM2\n"
    text = text.replace("G0 X0 Y0 Z0", "G90 G0 X0 Y0 Z0\nG91")
    assert [f.where[-6:] for f in findings_of(tmp_path, text)] == ["line 7"]


def test_machine_positions_are_no_part_of_the_path(tmp_path):
    text = ROTARY.replace("G0 Z50.\n", "G0 Z50.\nG53 G0 Z0. C0.\nG28 A0. C720.\nG0 A0. C-170.\n")
    assert findings_of(tmp_path, text) == ()


def test_a_pole_may_turn_as_far_as_the_option_says(tmp_path):
    text = ROTARY.replace("C185.", "C-175.")
    assert findings_of(tmp_path, text, rotary_step_deg=360.0) == ()
    assert [f.code for f in findings_of(tmp_path, ROTARY, rotary_step_deg=4.0)] == [877, 877]
    assert [f.code for f in findings_of(tmp_path, VECTOR, line_length=30)] == [870] * 4


def test_defects_of_one_kind_are_counted_after_the_fifth(tmp_path):
    text = INVERSE.replace("G1 X20 F30\n", "".join(f"G1 X{20 + i}\n" for i in range(12)))
    found = findings_of(tmp_path, text)
    assert [f.where.rpartition(" ")[2] for f in found] == ["4", "5", "6", "7", "8"]
    assert found[-1].message.endswith("(and 7 more like this)") and "more" not in found[0].message


def test_options_have_types_and_near_names(tmp_path):
    file = tmp_path / "a.nc"
    file.write_text(VECTOR, encoding="ascii")
    with pytest.raises(JobError, match=r"check\.line_lenght: unknown option; did you mean line_length"):
        check_program(check, file, options={"line_lenght": 3})
    with pytest.raises(JobError, match=r"check\.line_length: must be a whole number"):
        check_program(check, file, options={"line_length": "x"})
    assert [f.level for f in check_program(check, file, options={"line_length": 40})] == [Level.FAIL]


def test_long_programs_are_checked_in_seconds(tmp_path):
    rows = "".join(f"N{i} G1 X{i}.5 Y{i % 7}. Z5.1234 I0.1 J0.05 K0.99\n" for i in range(71, 100_000))
    file = tmp_path / "a.nc"
    file.write_text(VECTOR.replace("N80 ", f"{rows}N100000 ").replace("N90 ", "").replace("N100 ", ""))
    start = time.perf_counter()
    assert check(file) == ()
    assert time.perf_counter() - start < 5.0
