"""Each defect of an APT program or a CSV table, put into a good one, is told with its code and its place."""

import pytest

from sicp_cam.findings import Level
from sicp_formats import apt, path_csv, path_text
from sicp_formats.apt.check import check as check_apt
from sicp_formats.path_csv.check import check as check_csv

APT = """PARTNO/trim
UNITS/MM
MULTAX/ON
LOADTL/3
SPINDL/12000,RPM,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/2000,MMPM
GOTO/0,0,5,0,0,1
GOTO/10,0,5,0,0.1,0.994987
RAPID
GOTO/10,0,50,0,0,1
FINI
"""
CSV = """x,y,z,i,j,k,feed,rapid,status,u_mm
0.0000,0.0000,50.0000,0.0000000,0.0000000,1.0000000,0.0000,1,approach,
0.0000,0.0000,5.0000,0.0000000,0.0000000,1.0000000,900.0000,0,covered,0.1
10.0000,0.0000,5.0000,0.0000000,0.6000000,0.8000000,900.0000,0,bridged,0.2
"""
BROKEN = [
    ("apt", "FINI\n", "", 880, "warn", 12, "no end (FINI)"),
    ("apt", "GOTO/10,0,50,0,0,1\n", "", 888, "warn", 11, "RAPID without a move"),
    ("apt", "UNITS/MM\n", "", 887, "warn", 0, ""),
    ("apt", "FEDRAT/2000", "UNITS/MM\nFEDRAT/2000", 887, "warn", 7, "comes after the first move in line 6"),
    ("apt", "MULTAX/ON\n", "", 888, "warn", 6, "MULTAX is not on"),
    ("apt", "MULTAX/ON", "MULTAX/OFF", 888, "warn", 7, "MULTAX is not on"),
    ("apt", "FEDRAT/2000,MMPM\n", "", 883, "warn", 8, "before a feed (FEDRAT)"),
    ("apt", "FEDRAT/2000", "FEDRAT/0", 883, "fail", 8, "FEDRAT/0: a feed must be more than 0"),
    ("apt", "LOADTL/3\n", "FEDRAT/5\nGOTO/0,0,60,0,0,1\nLOADTL/3\n", 886, "warn", 5, "cuts before the first tool"),
    ("apt", "PARTNO/trim", "PARTNO/tr\u00efm", 889, "warn", 1, "no ASCII character"),
    ("csv", "x,y,z,i,j,k", "y,x,z,i,j,k", 880, "warn", 1, "not in the order"),
    ("csv", "rapid,status", "rapid,state", 880, "info", 1, "other columns"),
    ("csv", ",covered,0.1", "", 880, "fail", 3, "8 cells, at least 9"),
    ("csv", "900.0000,0,covered", "0.0000,0,covered", 883, "fail", 3, "a cut with the feed 0"),
    ("csv", "0.0000,1,approach", "900.0000,1,approach", 883, "fail", 2, "a rapid move with the feed 900"),
    ("csv", "0.6000000", "0.6000100", 885, "fail", 4, "length 1.000006"),
    ("csv", "bridged", "bridge", 888, "fail", 4, "'bridge', not one of covered, bridged, approach"),
    ("csv", "0,bridged", "2,bridged", 888, "fail", 4, "'2', not 0 or 1"),
    ("csv", "bridged,0.2", "bridged,0.2 # gr\u00fcn", 889, "warn", 4, "no ASCII character"),
]
GOOD = {"apt": APT, "csv": CSV}
CHECKS = {"apt": check_apt, "csv": check_csv}


def written(tmp_path, name, text):
    file = tmp_path / f"a.{name}"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("name", GOOD)
def test_a_good_program_has_no_findings_and_can_be_read(tmp_path, name):
    file = written(tmp_path, name, GOOD[name])
    assert CHECKS[name](file) == ()
    assert len({"apt": apt, "csv": path_csv}[name].read_path(file)) >= 3
    as_text = written(tmp_path, "txt", GOOD[name])
    assert path_text.check(as_text) == ()


@pytest.mark.parametrize(("name", "old", "new", "code", "level", "line", "words"), BROKEN)
def test_a_defect_is_told_with_its_code_and_line(tmp_path, name, old, new, code, level, line, words):
    text = GOOD[name]
    if new.startswith("UNITS/MM"):
        text = text.replace("UNITS/MM\n", "")
    assert text.count(old) == 1
    file = written(tmp_path, name, text.replace(old, new))
    found = CHECKS[name](file)
    if not words:  # told by the reader, once
        assert found == () and [f.code for f in apt.read_path(file).findings] == [301]
        return
    told = next((f.code, f.level.value, f.where) for f in found if words in f.message)
    assert told == (code, level, f"{file}, line {line}")
    assert {f.code for f in found} == {code}


def test_a_text_file_is_checked_as_what_it_is(tmp_path):
    file = written(tmp_path, "txt", APT.replace("FINI\n", ""))
    assert [(f.code, f.level) for f in path_text.check(file)] == [(880, Level.WARN)]


def test_the_longest_line_of_a_post_is_an_option(tmp_path):
    file = written(tmp_path, "apt", APT)
    found = check_apt(file, line_length=21)
    assert [(f.code, f.where.rpartition(" ")[2]) for f in found] == [(889, "10")]
