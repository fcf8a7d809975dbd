"""Check the text of a KUKA KRL program and of the data file beside it: heads, names, points, speeds, zones, frames.

Facts: KUKA System Software, operating and programming instructions for system integrators.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.krl.data import parsed_aggregate
from sicp_formats.krl.text import data_file, without_comment
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.defects import Check, Defects, check_characters, last_line
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.check import Blend, check_blends, check_declared, check_name
from sicp_formats.robot.files import file_beside
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import split_arguments
from sicp_formats.source import read_bytes

__all__ = ["check"]

_LONGEST_NAME = 24
_NAME = r"[A-Za-z_$][A-Za-z0-9_$]*"
_FASTEST_M_S = 3.0
_DEF = re.compile(r"(?:GLOBAL[ \t]+)?DEF(?:FCT[ \t]+\w+)?[ \t]+(\w+)[ \t]*\(", re.ASCII | re.IGNORECASE)
_DEFDAT = re.compile(r"DEFDAT[ \t]+(\w+)", re.ASCII | re.IGNORECASE)
_POINT = re.compile(
    r"(?:(?:GLOBAL|DECL|CONST)[ \t]+)*(?:E6POS|POS|FRAME|E6AXIS|AXIS)[ \t]+(\w+)[ \t]*(?:\[[^\]]*\])?[ \t]*(?:=(.*))?",
    re.ASCII | re.IGNORECASE,
)
_MOVE = re.compile(r"(S?PTP|S?LIN|S?CIRC)(_REL)?(?=[ \t{])[ \t]*(.*)", re.ASCII | re.IGNORECASE)
_ZONE = re.compile(r"[ \t]C_(?:DIS|PTP|VEL|ORI|SPL)\b", re.ASCII | re.IGNORECASE)
_CARTESIAN_ZONE = re.compile(r"[ \t]C_DIS\b", re.ASCII | re.IGNORECASE)
_SPEED = re.compile(
    r"(?:\$VEL\.CP[ \t]*=|BAS[ \t]*\([ \t]*#(?:VEL_CP|CP_PARAMS)[ \t]*,)[ \t]*([^)]*)", re.ASCII | re.IGNORECASE
)
_ANY_SPEED = re.compile(r"\$VEL\b|BAS[ \t]*\([ \t]*#(?:VEL_CP|CP_PARAMS|INITMOV)|LDAT_ACT", re.ASCII | re.IGNORECASE)
_DISTANCE = re.compile(r"\$APO\.CDIS[ \t]*=(.*)", re.ASCII | re.IGNORECASE)
_TOOL = re.compile(r"\$TOOL\b|BAS[ \t]*\([ \t]*#TOOL|FDAT_ACT", re.ASCII | re.IGNORECASE)
_BASE = re.compile(r"\$BASE\b|BAS[ \t]*\([ \t]*#BASE|FDAT_ACT", re.ASCII | re.IGNORECASE)
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_CALL = re.compile(r"([A-Za-z_]\w*)[ \t]*\([ \t]*\)", re.ASCII)
_MOST_FILES = 1000


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a KRL program: DEF and DEFDAT, names, points declared and used, $VEL.CP, $APO.CDIS, $TOOL, $BASE.

    Parameters
    ----------
    path
        The .src file; the .dat file of the same name, and programs beside it that it calls, are checked too.
    limits
        Caps on the files.

    Raises
    ------
    FormatError
        If a file is no text.
    """
    program = _Program(limits)
    program.file(path)
    for each in program.files:
        each.finish(program.used)
    return tuple(finding for each in program.files for finding in each.findings())


class _File:
    """A .src file and the .dat file beside it: their text, their defects, and the points that they declare.

    `own` and `points` hold line and value of points by upper-case name: those of the .src, and those of the .dat file.
    """

    def __init__(self, path: Path, limits: Limits) -> None:
        self.lines = program_lines(path, read_bytes(path, limits), limits)
        self.defects = Defects(path)
        self.own: dict[str, tuple[int, str]] = {}
        self.points: dict[str, tuple[int, str]] = {}
        self.blends: list[Blend] = []
        self._of_data = Defects(path)
        check_characters(self.defects, self.lines)
        _check_heads(self.defects, self.lines, path)
        beside = data_file(path)
        if beside is not None:
            self._of_data = Defects(beside)
            data = program_lines(beside, read_bytes(beside, limits), limits)
            check_characters(self._of_data, data)
            self.points = _check_data(self._of_data, data, path)

    def finish(self, used: set[str]) -> None:
        """Judge what only the whole program shows."""
        check_blends(self.defects, self.blends)
        for defects, points in ((self.defects, self.own), (self._of_data, self.points)):
            check_declared(defects, {name: line for name, (line, _) in points.items()}, used, "point")

    def findings(self) -> tuple[Finding, ...]:
        """Return the findings of both files."""
        return (*self.defects.findings(), *self._of_data.findings())


def _check_heads(defects: Defects, lines: Sequence[str], path: Path) -> None:
    heads = [(found[1], number) for number, line in enumerate(lines, 1) if (found := _DEF.match(line.strip()))]
    for name, number in heads:
        check_name(defects, name, number, longest=_LONGEST_NAME, allowed=_NAME, noun="program")
    if heads and heads[0][0].upper() != _stem(path).upper():
        what = f"the first program is called {heads[0][0]}, the file {_stem(path)}; the controller wants one name"
        defects.warn(Check.NAMES, what, heads[0][1])


def _check_data(defects: Defects, lines: Sequence[str], path: Path) -> dict[str, tuple[int, str]]:
    """Check a data file; return line and value of its points by upper-case name."""
    points: dict[str, tuple[int, str]] = {}
    begun = ended = 0
    for number, line in enumerate(lines, 1):
        code = without_comment(line)[0]
        if head := _DEFDAT.match(code):
            begun = number
            if head[1].upper() != _stem(path).upper():
                what = f"DEFDAT is called {head[1]}, the program {_stem(path)}; the controller wants one name"
                defects.fail(Check.NAMES, what, number)
        elif code.upper() == "ENDDAT":
            ended = number
        elif point := _POINT.fullmatch(code):
            name = point[1].upper()
            check_name(defects, point[1], number, longest=_LONGEST_NAME, allowed=_NAME, noun="point")
            if name in points:
                defects.fail(Check.SYMBOLS, f"the point {point[1]} is declared twice", number)
            points[name] = (number, point[2] or "")
    for there, word, place in ((begun, "DEFDAT", 1), (ended, "ENDDAT", last_line(lines))):
        if not there:
            defects.fail(Check.FORM, f"no {word}; is the file complete?", place)
    return points


def _stem(path: Path) -> str:
    return path.name.split(".")[0]


class _Program:
    """What the statements so far have said, those of called programs beside the first one among them."""

    def __init__(self, limits: Limits) -> None:
        self.used: set[str] = set()
        self.files: list[_File] = []
        self._limits = limits
        self._names: set[str] = set()
        self._values: dict[str, str] = {}
        self._speed = self._tool = self._base = self._moved = False
        self._zone_mm = 0.0
        self._tip: dict[str, float] = {}
        self._here: _File
        self._defects: Defects

    def file(self, path: Path) -> None:
        """Check the statements of a file in its order, and those of files that it calls where it calls them."""
        here = _File(path, self._limits)
        self.files.append(here)
        self._names.add(_stem(path).upper())
        self._values |= {name: value for name, (_, value) in here.points.items()}
        for number, line in enumerate(here.lines, 1):
            code = without_comment(line)[0]
            called = _CALL.fullmatch(code)
            if called and (beside := self._beside(path, called[1])) is not None:
                self.file(beside)
            elif code:
                self._take(here, code, number)

    def _beside(self, path: Path, name: str) -> Path | None:
        """Return the file of a called program, None if there is none or it was checked before."""
        if name.upper() in self._names or len(self._names) > _MOST_FILES:
            return None
        return file_beside(path, name, ".src")

    def _take(self, here: _File, code: str, line: int) -> None:
        """Check one statement."""
        self._here, self._defects = here, here.defects
        move = _MOVE.match(code)
        if move is not None:
            self._move(move[1].upper(), bool(move[2]), move[3], line)
            return
        if point := _POINT.fullmatch(code):
            here.own[point[1].upper()] = (line, point[2] or "")
            self._values[point[1].upper()] = point[2] or ""
        elif "$" in code or "BAS" in code.upper() or "_ACT" in code.upper():
            self._setting(code, line)
        else:
            self.used.update(word.upper() for word in _WORD.findall(code))

    def _setting(self, code: str, line: int) -> None:
        self.used.update(word.upper() for word in _WORD.findall(code))
        self._tool = self._tool or bool(_TOOL.match(code))
        self._base = self._base or bool(_BASE.match(code))
        self._speed = self._speed or bool(_ANY_SPEED.match(code))
        if speed := _SPEED.match(code):
            self._check_speed(speed[1], line)
        if zone := _DISTANCE.match(code):
            self._zone_mm = number_of(zone[1]) or 0.0

    def _check_speed(self, text: str, line: int) -> None:
        speed = number_of(text)
        if speed is None:
            return
        if not speed > 0.0:
            self._defects.fail(Check.SPEED, f"the speed {speed:g} m/s is not possible", line)
        elif speed > _FASTEST_M_S:
            what = f"the speed is {speed:g} m/s, more than robots can: are these mm/s?"
            self._defects.fail(Check.SPEED, what, line)

    def _move(self, word: str, relative: bool, rest: str, line: int) -> None:
        linear = "PTP" not in word
        if not self._moved:
            self._first_move(word, linear, line)
        if linear and not self._speed:
            self._speed = True
            self._defects.warn(Check.SPEED, "a straight move before $VEL.CP is stated", line)
        zone = self._zone_mm if linear and _CARTESIAN_ZONE.search(rest) else 0.0
        points = split_arguments(_ZONE.split(rest)[0].split(" WITH ")[0])
        tips = [self._point(point, relative, line) for point in points]
        self._here.blends.append(Blend(tips[-1] if tips else None, zone, line))

    def _first_move(self, word: str, linear: bool, line: int) -> None:
        self._moved = True
        if linear:
            what = f"the first move is {word}; the controller wants PTP to a whole position there"
            self._defects.warn(Check.FORM, what, line)
        for stated, name in ((self._tool, "$TOOL"), (self._base, "$BASE")):
            if not stated:
                self._defects.warn(Check.TOOL, f"the first move comes before {name} is set", line)

    def _point(self, text: str, relative: bool, line: int) -> Vector | None:
        """Return where a point lies, None if that is not known; note one that is declared nowhere."""
        text = text.strip()
        if not text.startswith("{"):
            name = re.split(r"[\[:.]", text, maxsplit=1)[0].strip().upper()
            self.used.add(name)
            if _WORD.fullmatch(name) and name not in self._values and not name.startswith("XHOME"):
                self._defects.fail(Check.SYMBOLS, f"the point {name} is declared neither here nor in the .dat", line)
            text = self._values.get(name, "")
        values = parsed_aggregate(text)
        if values is None or "A1" in values:
            self._tip = {}
            return None
        step = {name: values[name] for name in "XYZ" if name in values}
        if relative:
            step = {name: self._tip[name] + step.get(name, 0.0) for name in self._tip}
        self._tip = {**self._tip, **step}
        if len(self._tip) < 3:
            return None
        return (self._tip["X"], self._tip["Y"], self._tip["Z"])
