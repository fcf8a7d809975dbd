"""Check the text of an ABB RAPID module: names, data declared and used, speeds, zones, orientations, tools.

Facts: ABB Robotics, Technical reference manual, RAPID instructions, functions and data types.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.defects import Check, Defects, check_characters, last_line
from sicp_formats.paths.text import program_lines
from sicp_formats.rapid.data import DECLARED, PREDEFINED_MM_S, Data, Target, arguments_of, parsed_list
from sicp_formats.rapid.text import Module, module_files, read_module
from sicp_formats.robot.check import Blend, check_blends, check_declared, check_name
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError, Statement
from sicp_formats.source import read_bytes

__all__ = ["check"]

_LONGEST_NAME = 32
_NAME = r"[A-Za-z][A-Za-z0-9_]*"
_FASTEST_MM_S = 7000.0
_UNIT = 1e-4
_MOVE = re.compile(r"(Move[JLC]|MoveAbsJ|Move[JLC]DO)\b[ \t]*(.*)", re.IGNORECASE | re.DOTALL)
_WORD = re.compile(r"[A-Za-z]\w*", re.ASCII)
_ZONES_MM = {f"z{mm}": float(mm) for mm in (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)} | {"z0": 0.3}
_SPEEDS = frozenset({"vmax", *(f"v{speed}" for speed in PREDEFINED_MM_S)})
_OF_DATA = {"robtarget": "point", "jointtarget": "point", "speeddata": "speed", "zonedata": "zone"}
_OF_CELL = {"tooldata": "tool", "wobjdata": "work object"}
_PREDEFINED = {
    "speeddata": _SPEEDS,
    "zonedata": frozenset({"fine", *_ZONES_MM}),
    "tooldata": frozenset({"tool0"}),
    "wobjdata": frozenset({"wobj0"}),
}


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a RAPID module: names, targets, speeds, zones, tools and work objects declared and used, quaternions.

    Parameters
    ----------
    path
        The .mod or .prg file, or the .pgf that lists the modules beside it.
    limits
        Caps on it.

    Raises
    ------
    FormatError
        If the file is no module, or a statement or routine is not closed.
    """
    data, declared = Data(), dict[str, _Declared]()
    modules: list[tuple[Defects, Module]] = []
    for file, content in module_files(path, read_bytes(path, limits), limits).items():
        lines = program_lines(file, content, limits)
        modules.append((Defects(file), read_module(file, "\n".join(lines))))
        check_characters(modules[-1][0], lines)
        _check_form(*modules[-1], lines)
        for statement in _declarations(modules[-1][1]):
            _declare(modules[-1][0], statement, data, declared)
    used = _named_in_values(data)
    for defects, module in modules:
        moves = _Moves(defects, data, declared)
        for routine in module.routines.values():
            moves.check(routine.statements)
        used |= moves.used
    for key, each in declared.items():
        if each.kind in _OF_DATA | _OF_CELL and key not in used:
            check_declared(each.defects, {each.name: each.line}, (), (_OF_DATA | _OF_CELL)[each.kind])
    return tuple(finding for defects, _ in modules for finding in defects.findings())


@dataclass(frozen=True, slots=True)
class _Declared:
    name: str
    kind: str
    storage: str
    line: int
    defects: Defects


def _check_form(defects: Defects, module: Module, lines: list[str]) -> None:
    if not any(line.strip().upper() == "ENDMODULE" for line in lines):
        defects.fail(Check.FORM, "no ENDMODULE; is the file complete?", last_line(lines))
    if not module.name:
        defects.fail(Check.FORM, "no MODULE with a name", 1)
    names = [("module", module.name)] if module.name else []
    for noun, name in (*names, *(("procedure", routine.name) for routine in module.routines.values())):
        check_name(defects, name, _line_of(lines, name), longest=_LONGEST_NAME, allowed=_NAME, noun=noun)


def _line_of(lines: list[str], name: str) -> int:
    whole = re.compile(rf"(?:MODULE|PROC)[ \t]+{re.escape(name)}\b", re.IGNORECASE)
    return next((number for number, line in enumerate(lines, 1) if whole.search(line)), 0)


def _declarations(module: Module) -> Iterator[Statement]:
    yield from module.declarations
    for routine in module.routines.values():
        yield from (statement for statement in routine.statements if DECLARED.fullmatch(statement.text))


def _declare(defects: Defects, statement: Statement, data: Data, declared: dict[str, _Declared]) -> None:
    found = DECLARED.fullmatch(statement.text)
    if found is None:
        return
    storage, kind, name = found[1].upper(), found[2].lower(), found[3]
    check_name(defects, name, statement.line, longest=_LONGEST_NAME, allowed=_NAME, noun=kind)
    if name.lower() in declared:
        defects.fail(Check.SYMBOLS, f"{name} is declared twice", statement.line)
    declared[name.lower()] = _Declared(name, kind, storage, statement.line, defects)
    data.declare(statement.text)
    value = (found[4] or "").strip()
    if kind in _OF_CELL and storage != "PERS":
        defects.fail(Check.TOOL, f"the {_OF_CELL[kind]} {name} must be declared as PERS, not {storage}", statement.line)
    if kind == "speeddata" and value.startswith("["):
        _check_speed(defects, value, statement.line)
    if kind in ("robtarget", "tooldata", "wobjdata") and value.startswith("["):
        _check_quaternions(defects, value, statement.line)


def _check_speed(defects: Defects, text: str, line: int) -> None:
    try:
        numbers = parsed_list(text)
    except RobotError:
        return
    speed = numbers[0] if numbers and isinstance(numbers[0], float) else None
    if speed is not None and not speed > 0.0:
        defects.fail(Check.SPEED, f"the speed {speed:g} mm/s is not possible", line)
    elif speed is not None and speed > _FASTEST_MM_S:
        defects.fail(Check.SPEED, f"the speed is {speed:g} mm/s, more than robots can: are these mm/min?", line)


def _check_quaternions(defects: Defects, text: str, line: int) -> None:
    """Note orientations that are not of length 1; in each datum they stand second in a pair [position, orientation]."""
    for found in re.finditer(r"\[([^\[\]]*)\][ \t\n]*,[ \t\n]*\[([^\[\]]*)\]", text):
        first, second = (
            [number for part in group.split(",") if (number := number_of(part)) is not None] for group in found.groups()
        )
        if len(first) == 3 and len(second) == 4 and abs(math.hypot(*second) - 1.0) > _UNIT:
            what = f"the orientation has the length {math.hypot(*second):.6g}, not 1"
            defects.fail(Check.ORIENTATION, what, line)
            return


# --- motion ---


class _Moves:
    """Checks the statements of every routine; `used` holds the names, in lower case, that they use."""

    def __init__(self, defects: Defects, data: Data, declared: dict[str, _Declared]) -> None:
        self.used: set[str] = set()
        self._defects = defects
        self._data = data
        self._declared = declared
        self._told: set[str] = set()

    def check(self, statements: Iterable[Statement]) -> None:
        """Check the moves of one routine."""
        blends: list[Blend] = []
        for statement in statements:
            if statement.text.startswith("!") or DECLARED.fullmatch(statement.text):
                continue
            self.used.update(word.lower() for word in _WORD.findall(statement.text))
            if move := _MOVE.fullmatch(statement.text):
                blends.append(self._move(move[1].lower(), move[2], statement.line))
        check_blends(self._defects, blends)

    def _move(self, word: str, rest: str, line: int) -> Blend:
        try:
            places, switches = arguments_of(rest)
        except RobotError as problem:
            self._defects.fail(Check.WORDS, str(problem), line)
            return Blend(None, 0.0, line)
        points = 2 if word.startswith("movec") else 1
        if len(places) < points + 3:
            self._defects.fail(Check.WORDS, f"{word} lacks points, speed, zone or tool", line)
            return Blend(None, 0.0, line)
        speed, zone, tool = places[points : points + 3]
        self._known(speed, "speeddata", line)
        self._known(zone, "zonedata", line)
        self._known(tool, "tooldata", line)
        self._known(switches.get("wobj", "wobj0"), "wobjdata", line)
        if speed.startswith("["):
            _check_speed(self._defects, speed, line)
        tips = [self._tip(place, line) for place in places[:points]]
        return Blend(tips[-1], 0.0 if word == "moveabsj" else _zone_mm(zone, self._data), line)

    def _known(self, text: str, kind: str, line: int) -> None:
        """Note data that is declared nowhere; tools and work objects may stand in other modules, and are told once."""
        name = text.split("{")[0].strip().lower()
        if text.startswith("[") or name in _PREDEFINED[kind]:
            return
        found = self._declared.get(name)
        if found is not None and found.kind != kind:
            self._defects.fail(Check.SYMBOLS, f"{printable(text, 40)} is a {found.kind} and no {kind}", line)
        if found is not None:
            return
        told = printable(text, 40)
        if kind not in _OF_CELL:
            self._defects.fail(Check.SYMBOLS, f"the {_OF_DATA[kind]} {told} is declared nowhere in the module", line)
        elif name not in self._told:
            self._told.add(name)
            what = f"the {_OF_CELL[kind]} {told} is not declared in this module; the controller must know it"
            self._defects.warn(Check.TOOL, what, line)

    def _tip(self, text: str, line: int) -> Vector | None:
        """Return where a point lies, None if that is not known; note one that is declared nowhere."""
        if text.startswith("["):
            _check_quaternions(self._defects, text, line)
        name = text.split("{")[0].strip().lower()
        if _WORD.fullmatch(name) and name not in self._declared:
            self._defects.fail(Check.SYMBOLS, f"the point {printable(text, 40)} is declared nowhere", line)
            return None
        try:
            target: Target | None = self._data.target(text)
        except RobotError:
            return None  # computed, or wrong: the reader says how
        if target is None:
            return None
        x, y, z = target.pose[:3, 3].tolist()
        return (x, y, z)


def _named_in_values(data: Data) -> set[str]:
    """Return the names, in lower case, of data that other data are made of."""
    values = [value for _, value in data.known.values() if value and not value.startswith("[")]
    return {word.lower() for value in values for word in _WORD.findall(value)}


def _zone_mm(text: str, data: Data) -> float:
    """Return how far from its point a zone begins, 0 for none."""
    name = text.strip().lower()
    if name in _ZONES_MM:
        return _ZONES_MM[name]
    _, value = data.known.get(name, ("", text))
    if not value or not value.strip().startswith("["):
        return 0.0
    try:
        values = parsed_list(value)
    except RobotError:
        return 0.0
    stops = isinstance(values[0], str) and values[0].upper() == "TRUE"
    return values[1] if len(values) > 1 and isinstance(values[1], float) and not stops else 0.0
