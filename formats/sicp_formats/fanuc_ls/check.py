"""Check the text of a Fanuc listing: name, counts, line numbers, positions declared and used, speeds, CNT, frames.

Facts: FANUC HandlingTool operator's manual.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.fanuc_ls.listing import Listing, read_listing
from sicp_formats.paths.defects import Check, Defects, check_characters, last_line
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.check import check_declared, check_name
from sicp_formats.robot.files import file_beside
from sicp_formats.source import read_bytes

__all__ = ["check"]

_LONGEST_NAME = 36
_NAME = r"[A-Z_][A-Z0-9_-]*"
_FASTEST_MM_S = 4000.0
_SECTION = re.compile(r"/(PROG|ATTR|APPL|MN|POS|END)\b", re.ASCII)
_COUNT = re.compile(r"LINE_COUNT[ \t]*=[ \t]*([0-9]+)", re.ASCII)
_NUMBERED = re.compile(r"[ \t]*([0-9]+)[ \t]*:", re.ASCII)
_USED = re.compile(r"(?<!P)P\[[ \t]*([0-9]{1,9})[ \t:\]]", re.ASCII)
_MOVE = re.compile(r"([JLCA])[ \t]+(?=P)", re.ASCII)
_SPEED = re.compile(r"\][ \t]*([0-9.]+)[ \t]*(%|mm/sec|cm/min|inch/min)", re.ASCII)
_ROUNDING = re.compile(r"\bCNT[ \t]*([0-9]+)", re.ASCII)
_ENDING = re.compile(r"\b(?:FINE|CNT|CD)[ \t]*[0-9R]*", re.ASCII)
_CHOSEN = re.compile(r"(UFRAME|UTOOL)_NUM[ \t]*=[ \t]*([0-9]+)", re.ASCII)
_CALL = re.compile(r"CALL[ \t]+([\w-]+)", re.ASCII)
_MOST_FILES = 200
_MM_S = {"mm/sec": 1.0, "cm/min": 1.0 / 6.0, "inch/min": 25.4 / 60.0}


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a Fanuc listing: /PROG, LINE_COUNT, line numbers, P[n], speeds, CNT, UFRAME_NUM and UTOOL_NUM, /END.

    Parameters
    ----------
    path
        The .ls file; listings beside it that it calls are checked too.
    limits
        Caps on the files.

    Raises
    ------
    FormatError
        If the file is no listing, or a statement or position is cut short or stands twice.
    """
    found: dict[str, Defects] = {}
    _check_file(path, limits, found, {})
    return tuple(finding for defects in found.values() for finding in defects.findings())


def _check_file(path: Path, limits: Limits, found: dict[str, Defects], chosen: dict[str, int]) -> None:
    """Check a listing, and those beside it that it calls, with the frames that it has chosen."""
    lines = program_lines(path, read_bytes(path, limits), limits)
    listing = read_listing(path, lines)
    defects = found[listing.name.upper()] = Defects(path)
    check_characters(defects, lines)
    _check_form(defects, lines, listing)
    _check_numbers(defects, lines)
    _check_statements(defects, listing, chosen)
    used = {int(number) for statement in listing.statements for number in _USED.findall(statement.text)}
    declared = {f"P[{number}]": position.line for number, position in listing.positions.items()}
    check_declared(defects, declared, (f"P[{number}]" for number in used), "position")
    for statement in listing.statements:
        called = _CALL.fullmatch(statement.text)
        if called and called[1].upper() not in found and len(found) < _MOST_FILES:
            beside = file_beside(path, called[1], ".ls")
            if beside is not None:
                _check_file(beside, limits, found, dict(chosen))


def _check_form(defects: Defects, lines: Sequence[str], listing: Listing) -> None:
    check_name(defects, listing.name, 1, longest=_LONGEST_NAME, allowed=_NAME, noun="program")
    stem = listing.file.name.split(".")[0]
    if listing.name.upper() != stem.upper():
        what = f"the program is called {listing.name}, the file {stem}; the controller takes the name in /PROG"
        defects.warn(Check.NAMES, what, 1)
    if not listing.ended:
        defects.fail(Check.FORM, "no /END; is the file complete?", last_line(lines))
    for number, line in enumerate(lines, 1):
        if count := _COUNT.search(line):
            there = len(_statement_lines(lines))
            if int(count[1]) != there:
                what = f"LINE_COUNT is {count[1]}, and there are {there} lines in /MN; is the file complete?"
                defects.warn(Check.FORM, what, number)
            return


def _statement_lines(lines: Sequence[str]) -> list[tuple[int, int]]:
    """Return file line and stated number of each numbered line of /MN; those that go on in a line have none."""
    found, inside = [], False
    for number, line in enumerate(lines, 1):
        if section := _SECTION.match(line):
            inside = section[1] == "MN"
        elif inside and (stated := _NUMBERED.match(line)):
            found.append((number, int(stated[1])))
    return found


def _check_numbers(defects: Defects, lines: Sequence[str]) -> None:
    for wanted, (line, stated) in enumerate(_statement_lines(lines), 1):
        if stated != wanted:
            defects.warn(Check.NAMES, f"the line number is {stated}, not {wanted}", line)
            return


def _check_statements(defects: Defects, listing: Listing, chosen: dict[str, int]) -> None:
    moved = False
    for statement in listing.statements:
        text, line = statement.text, statement.line
        if text.startswith(("!", "--", "//")):
            continue
        if frame := _CHOSEN.fullmatch(text):
            chosen[frame[1]] = int(frame[2])
        move = _MOVE.match(text)
        if move is None:
            continue
        if not moved:
            for name in ("UFRAME", "UTOOL"):
                if name not in chosen:
                    defects.warn(Check.TOOL, f"the first move comes before {name}_NUM is set", line)
        moved = True
        _check_positions(defects, listing, text, line, chosen)
        _check_speed(defects, move[1], text, line)
        _check_end(defects, text, line)


def _check_positions(defects: Defects, listing: Listing, text: str, line: int, chosen: dict[str, int]) -> None:
    for word in _USED.findall(text):
        position = listing.positions.get(int(word))
        if position is None:
            defects.fail(Check.SYMBOLS, f"P[{word}] is not in /POS", line)
            continue
        for name, stated in (("UFRAME", position.user_frame), ("UTOOL", position.tool)):
            if stated is not None and chosen.get(name, stated) != stated:
                what = f"P[{word}] was taught in {name} {stated}, and {name}_NUM is {chosen[name]}"
                defects.fail(Check.TOOL, what, line)


def _check_speed(defects: Defects, word: str, text: str, line: int) -> None:
    found = _SPEED.search(text)
    if found is None:
        return
    speed, unit = float(found[1]), found[2]
    if unit == "%":
        if word != "J" or not 0.0 < speed <= 100.0:
            defects.fail(Check.SPEED, f"the speed {found[1]}% is not possible in a {word} move", line)
        return
    mm_s = speed * _MM_S[unit]
    if word == "J" or not speed > 0.0:
        defects.fail(Check.SPEED, f"the speed {found[1]} {unit} is not possible in a {word} move", line)
    elif mm_s > _FASTEST_MM_S:
        what = f"the speed is {found[1]} {unit}, more than robots can: are these mm/min?"
        defects.fail(Check.SPEED, what, line)


def _check_end(defects: Defects, text: str, line: int) -> None:
    if not _ENDING.search(text):
        defects.fail(Check.ZONE, "a move with neither FINE nor CNT", line)
    if (rounding := _ROUNDING.search(text)) and int(rounding[1]) > 100:
        defects.fail(Check.ZONE, f"CNT{rounding[1]}: at most 100", line)
