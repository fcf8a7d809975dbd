"""Check the text of a Universal Robots script: units, speeds, blend radii, rotation vectors, functions, tool.

Facts: Universal Robots, The URScript Programming Language.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.defects import Check, Defects, check_characters
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.check import Blend, check_blends, check_declared
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError, Statement, without_strings
from sicp_formats.source import read_bytes
from sicp_formats.urscript.data import Data, arguments_of
from sicp_formats.urscript.text import Script, read_script

__all__ = ["check"]

_LONGEST_M = 10.0
_FASTEST_M_S = 3.0
_MM = 1000.0
_MOVE = re.compile(r"(move[jlpc])[ \t]*\((.*)\)", re.ASCII)
_POSE = re.compile(r"p[ \t]*\[([^\[\]]*)\]", re.ASCII)
_CALLED = re.compile(r"\b([A-Za-z_]\w*)[ \t]*\(", re.ASCII)
_ASSIGNED = re.compile(r"(?:global[ \t]+|local[ \t]+)?([A-Za-z_]\w*)[ \t]*=(?!=)", re.ASCII)
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_PLACES = {"movej": ("a", "v", "t", "r"), "movel": ("a", "v", "t", "r")}


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a script: metres and m/s, blend radii against the ways, rotation vectors, set_tcp, functions and variables.

    Parameters
    ----------
    path
        The .script file.
    limits
        Caps on it.

    Raises
    ------
    FormatError
        If a function, block or statement is not closed.
    """
    lines = program_lines(path, read_bytes(path, limits), limits)
    script = read_script(path, lines)
    defects = Defects(path)
    check_characters(defects, lines)
    statements = sorted(_statements(script), key=lambda statement: statement.line)
    _check_symbols(defects, script, statements)
    data, blends, tool = Data(), list[Blend](), False
    for statement in statements:
        for pose in _POSE.findall(statement.text):
            _check_pose(defects, pose, statement.line)
        data.assign(statement.text)
        tool = tool or statement.text.startswith("set_tcp")
        if move := _MOVE.fullmatch(statement.text):
            if not blends and not tool:
                defects.warn(Check.TOOL, "the first move comes before set_tcp", statement.line)
            blends.append(_check_move(defects, move[1], move[2], statement.line, data))
    check_blends(defects, blends)
    if blends and blends[-1].zone_mm > 0.0:
        defects.warn(Check.ZONE, "the last move has a blend radius, and nothing to blend into", blends[-1].line)
    return defects.findings()


def _statements(script: Script) -> Iterator[Statement]:
    for group in (script.statements, *(function.statements for function in script.functions.values())):
        yield from (statement for statement in group if not statement.text.startswith("#"))


def _check_symbols(defects: Defects, script: Script, statements: list[Statement]) -> None:
    called = {name for statement in statements for name in _CALLED.findall(without_strings(statement.text))}
    first = next(iter(script.functions), "")
    functions = {name: function.line for name, function in script.functions.items() if name != first}
    check_declared(defects, functions, called, "function")
    assigned: dict[str, int] = {}
    used: set[str] = set()
    for statement in statements:
        plain = without_strings(statement.text)
        if found := _ASSIGNED.match(plain):
            assigned.setdefault(found[1], statement.line)
            plain = plain[found.end() :]
        used.update(_WORD.findall(plain))
    check_declared(defects, assigned, used, "variable")


def _check_pose(defects: Defects, text: str, line: int) -> None:
    numbers = [number_of(part) for part in text.split(",")]
    values = [number for number in numbers if number is not None]
    if len(values) != 6:
        return
    if max(map(abs, values[:3])) > _LONGEST_M:
        what = f"a coordinate of {max(values[:3], key=abs):g} m is out of reach: are these millimetres?"
        defects.fail(Check.UNITS, what, line)
    turn = math.hypot(*values[3:])
    if turn > math.tau + 1e-6:
        what = f"the rotation vector has the length {turn:.6g}, more than a whole turn: are these degrees?"
        defects.fail(Check.ORIENTATION, what, line)


def _check_move(defects: Defects, word: str, arguments: str, line: int, data: Data) -> Blend:
    places, named = arguments_of(arguments)
    points = 2 if word == "movec" else 1
    settings = dict(zip(_PLACES.get(word, ("a", "v", "r")), places[points:], strict=False)) | named
    for name, noun, unit in (("v", "speed", "m/s"), ("a", "acceleration", "m/s2")):
        value = _value(settings.get(name), data)
        if value is not None and not value > 0.0:
            defects.fail(Check.SPEED, f"the {noun} {value:g} is not possible", line)
        elif value is not None and name == "v" and value > _FASTEST_M_S and word != "movej":
            what = f"the {noun} is {value:g} {unit}, more than robots can: are these mm/s?"
            defects.fail(Check.SPEED, what, line)
    radius = _value(settings.get("r"), data) or 0.0
    if radius < 0.0:
        defects.fail(Check.ZONE, f"the blend radius {radius:g} is not possible", line)
    return Blend(_tip(defects, places[points - 1] if len(places) >= points else "", line, data), radius * _MM, line)


def _value(text: str | None, data: Data) -> float | None:
    if text is None:
        return None
    try:
        return data.number(text)
    except RobotError:
        return None  # computed: the reader says so


def _tip(defects: Defects, text: str, line: int, data: Data) -> Vector | None:
    if _WORD.fullmatch(text) and text not in data.known:
        defects.fail(Check.SYMBOLS, f"the point {printable(text, 40)} is assigned nowhere before", line)
        return None
    try:
        pose, _ = data.target(text)
    except RobotError:
        return None
    if pose is None:
        return None
    x, y, z = pose[:3, 3].tolist()
    return (x, y, z)
