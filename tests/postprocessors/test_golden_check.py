"""Every golden program, and whatever joins them, passes `sicp-cam check`: nothing fails, no warning is unexplained."""

import re
from pathlib import Path

import pytest

from sicp_cam import plugins
from sicp_cam.checking.check import Check, check, programs_of
from sicp_postprocessors.robodk_csv import RoboDkCsv

GOLDEN = Path(__file__).parents[1] / "golden" / "posts"
CASES = sorted(folder.name for folder in GOLDEN.iterdir() if folder.is_dir())
PART = re.compile(r".+[0-9]{3}")
"""Programs that others call are read through them."""
READING = {
    **{case: RoboDkCsv().reading() for case in ("robodk", "robodk-nasty")},
    "gcode-rotary-ac": {"rotary": "AC"},
    "gcode-rotary-bc-inch": {"rotary": "BC"},
    "gcode-haas": {"rotary": "AC"},
    "gcode-heidenhain": {"rotary": "BC"},
    "gcode-heidenhain-nasty": {"rotary": "AC"},
    "gcode-linuxcnc": {"rotary": "AC"},
    "gcode-linuxcnc-inverse": {"rotary": "AC"},
    "gcode-linuxcnc-nasty": {"rotary": "AC"},
    "gcode-plain": {"rotary": "AC"},
    "gcode-siemens-rotary": {"rotary": "AB"},
    "dxf": {"layers": "CUT"},
}
"""What the reader of a case must be told."""
EXPLAINED = {
    "dxf": {302, 303, 366},  # a drawing has neither feeds nor tool axes, nor ways between its curves
    "dxf-nasty": {302, 303, 366},
    "gcode-linuxcnc-inverse": {313},  # the word for tool tip control is the machine's own, and an option
    "gcode-linuxcnc-nasty": {313},
    "gcode-plain": {313},  # it has none: X Y Z are those of the machine
    "rapid-procedures": {886},  # tool and work object are the controller's own
    "ur-base": {886},  # the tool is that of the installation
}
"""Codes of warnings that say what is so on purpose."""


def programs(case):
    """Return what an operator would check of a case: its applications, or its files that readers know."""
    folder = GOLDEN / case
    applications = sorted(file.parent for file in folder.rglob("*.pjx"))
    if applications:
        return [file for application in applications for file in programs_of(application)]
    found = [file for file in sorted(folder.rglob("*")) if file.is_file() and "path" in plugins.roles(file)]
    listed = [file for file in found if file.suffix == ".pgf"]
    return listed or [file for file in found if not PART.fullmatch(file.stem)]


@pytest.mark.parametrize("case", CASES)
def test_a_golden_program_checks_clean(case):
    files = programs(case)
    assert files
    for file in files:
        document = check(Check((file,), path_options=READING.get(case, {})))
        told = [(f["code"], f["message"], f["where"]) for f in document["findings"] if f["level"] != "info"]
        assert [each for each in told if each[0] not in EXPLAINED.get(case, set())] == []
        assert document["exit_code"] == 0
        assert document["programs"][0]["facts"]["moves"] >= 1


def test_warnings_that_are_explained_are_there():
    """So that the list above does not outlive its reasons."""
    for case, codes in EXPLAINED.items():
        (file, *_) = programs(case)
        found = check(Check((file,), path_options=READING.get(case, {})))["findings"]
        assert codes <= {f["code"] for f in found if f["level"] == "warn"}, case
