"""What VAL3 moves are given, statement by statement: arguments of the right type, attributes and values that exist."""

from __future__ import annotations

import re

from sicp_cam.errors import printable
from sicp_cam.findings import Level
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import split_arguments
from sicp_formats.val3.check_files import Application, Code
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.check_syntax import shape_of, strings_blank
from sicp_formats.val3.data import ITEM
from sicp_formats.val3.words import BLENDS, CODE_ATTRIBUTES

__all__ = ["MOVE", "check_moves"]

MOVE = re.compile(r"(?:[A-Za-z_]\w*(?:\[[^\]]*\])?\s*=\s*)?(move[jlc])\s*\((.*)\)", re.ASCII)
"""A move, and the number that may take what it returns."""

_ATTRIBUTE = re.compile(r"(?<![\w.:\"])([A-Za-z_]\w*)(?:\[[^\[\]]*\])?\s*\.\s*(\w+)", re.ASCII)
_SET = re.compile(r"([A-Za-z_]\w*)(?:\[[^\[\]]*\])?\s*\.\s*(\w+)\s*=(?!=)\s*(.*)", re.ASCII)
_POSITIVE = frozenset({"vel", "accel", "decel", "tvel", "rvel"})


def check_moves(application: Application, report: Report) -> None:
    """Check the moves of every program, and the attributes that code reads and sets."""
    for code in application.programs:
        right: set[str] = set()
        for statement in code.statements:
            text, line, shape = statement.text, statement.line, shape_of(statement.text)
            if text.startswith("//") or shape in right:
                continue
            move = MOVE.fullmatch(text)
            if move and _check_arguments(application, code, move[1], split_arguments(move[2]), line, report):
                right.add(shape)
            if "." in text:
                right.discard(shape)
                _check_attributes(application, code, strings_blank(text), line, report)


def _type(application: Application, code: Code, argument: str) -> str | None:
    """Return the type of a variable or an element of one, None for what is computed or not declared."""
    item = ITEM.fullmatch(argument)
    if item is None:
        return None
    if item[1] in code.own:
        return code.own[item[1]].type.removesuffix("Rx").removesuffix("Rs")
    if item[1] in application.variables:
        return application.variables[item[1]].type.removesuffix("Rs")
    return {"world": "frame", "flange": "tool"}.get(item[1])


def _check_arguments(
    application: Application, code: Code, word: str, arguments: list[str], line: int, report: Report
) -> bool:
    """Check the arguments of a move; say whether they are right."""
    wanted = ["point", "point"] if word == "movec" else ["point"]
    wanted += ["tool", "mdesc"]
    if len(arguments) != len(wanted):
        message = f"{word} takes {len(wanted)} arguments, and here are {len(arguments)}; correct the line"
        report.add(867, Level.FAIL, message, code.file, line, kind="count")
        return False
    right = True
    for argument, kind in zip(arguments, wanted, strict=True):
        found = _type(application, code, argument)
        fits = found in (None, kind) or (kind == "point" and word == "movej" and found == "joint")
        right &= fits
        if not fits:
            told, of = printable(argument, 40), printable(found or "", 20)
            message = f"{word} takes a {kind} here, and '{told}' is a {of}; correct the line"
            report.add(867, Level.FAIL, message, code.file, line, kind="type")
    return right


def _check_attributes(application: Application, code: Code, plain: str, line: int, report: Report) -> None:
    for name, attribute in _ATTRIBUTE.findall(plain):
        kind = _type(application, code, name)
        known = CODE_ATTRIBUTES.get(kind or "")
        if known is not None and attribute not in known:
            right = {"tmax": "; code names this limit tvel", "rmax": "; code names this limit rvel"}.get(attribute, "")
            message = f"a {kind} has no .{printable(attribute, 20)}{right}; correct the line"
            report.add(867, Level.FAIL, message, code.file, line, kind="attribute")
    setting = _SET.fullmatch(plain)
    if setting is None or _type(application, code, setting[1]) != "mdesc":
        return
    value, number = setting[3].strip(), number_of(setting[3])
    told = f"{setting[1]}.{setting[2]} = {printable(value, 20)}"
    if setting[2] in _POSITIVE and number is not None and number <= 0.0:
        message = f"{told} is not positive, and a move with it is refused; correct it"
        report.add(857, Level.FAIL, message, code.file, line, kind=setting[2])
    if setting[2] == "blend" and value.isalpha() and value not in BLENDS:
        message = f"{told} is none of {', '.join(BLENDS)}; correct it"
        report.add(857, Level.WARN, message, code.file, line, kind="blend")
