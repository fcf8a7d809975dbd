"""The data of a VAL3 application: declarations, numbers, speeds and blends, configurations, frames, outputs."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from sicp_cam.errors import FormatError, printable
from sicp_cam.findings import Level
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError
from sicp_formats.val3.check_files import Application
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.data import Variable, Variables
from sicp_formats.val3.words import ATTRIBUTES, BLENDS, CONFIGURATION, TYPES
from sicp_formats.val3.xml import Element

__all__ = ["check_data"]

_INNER = frozenset({"key", "index", "alias", "privilege", "size", "name", "public"})
_WORDS = frozenset({"shoulder", "elbow", "wrist", "fatherId", "ioLink", "blend"})
_ANGLES = ("rx", "ry", "rz")
_LINKED = re.compile(r"(?:dio|aio)Link\s*\(\s*([A-Za-z_]\w*)", re.ASCII)
_FULL_TURN = 360.0
_RADIANS = (math.pi, math.pi / 2.0)
_FEW_ANGLES = 3
_PLAIN_TYPES = frozenset(kind.removesuffix("Rx") for kind in TYPES)


def check_data(application: Application, report: Report) -> None:
    """Check every variable of the data files."""
    variables = Variables(dict(application.variables))
    for variable, element in application.elements:
        _check_declaration(application, variable, element, report)
        for key, (line, attributes) in variable.values.items():
            _check_attributes(variable, key, line, attributes, report)
        _check_father(application, variables, variable, report)
        if variable.type in ("dio", "aio"):
            _check_links(variable, report, _linked(application) if application.old else None)
    _check_radians(application, report)


def _check_declaration(application: Application, variable: Variable, element: Element, report: Report) -> None:
    told = f"the {printable(variable.type, 20)} {printable(variable.name, 40)}"
    if variable.type not in _PLAIN_TYPES and variable.type not in application.types:
        message = f"{told} is of a type that neither VAL3 nor the project knows; add the type to the project"
        report.add(855, Level.FAIL, message, variable.file, variable.line, kind="type")
    if variable.collection:
        return
    keys = [(key, line) for key, (line, _) in variable.values.items()]
    for key, line in keys:
        if not key.isdecimal() or int(key) >= max(variable.size, 1):
            message = f"{told} has {variable.size} elements, but a value of key {printable(key, 20)}; correct it"
            report.add(855, Level.FAIL, message, variable.file, line, kind="key")
    written = [each for each in element.children if each.name.lower().startswith("value")]
    if len(written) > len(keys):
        message = f"{told} has two values with one key; correct the keys"
        report.add(855, Level.FAIL, message, variable.file, variable.line, kind="keys")
    if 0 < len(keys) < variable.size and variable.type in ("point", "joint", "mdesc", "frame", "tool"):
        message = f"{told} has {variable.size} elements, but {len(keys)} values; the others have their defaults"
        report.add(855, Level.INFO, message, variable.file, variable.line, kind="size")


def _check_attributes(variable: Variable, key: str, line: int, attributes: Mapping[str, str], report: Report) -> None:
    known = ATTRIBUTES.get(variable.type)
    for name, text in attributes.items():
        if known is not None and name not in known and name not in _INNER:
            message = f"{_named(variable, key)}: {_unknown(variable.type, printable(name, 20))}; the default holds"
            report.add(855, Level.FAIL, message, variable.file, line, kind=f"attribute {name}")
        elif (known is not None and name in known and name not in _WORDS) or (variable.type, name) == ("num", "value"):
            _check_number(variable, key, name, text, line, report)
    if variable.type == "bool" and attributes.get("value", "false") not in ("true", "false"):
        told = printable(attributes["value"], 20)
        message = f"{_named(variable, key)}: {told!r} is neither true nor false; correct it"
        report.add(856, Level.FAIL, message, variable.file, line, kind="bool")
    if variable.type == "mdesc":
        _check_mdesc(variable, _named(variable, key), line, attributes, report)
    for part, words in CONFIGURATION.items():
        if attributes.get(part, words[0]) not in words:
            told = f"{part} = {printable(attributes[part], 20)!r}"
            message = f"{_named(variable, key)}: {told} is none of {', '.join(words)}; correct it"
            report.add(858, Level.FAIL, message, variable.file, line, kind=f"word {part}")


def _named(variable: Variable, key: str) -> str:
    return f"{printable(variable.name, 40)}[{printable(key, 20)}]"


def _unknown(kind: str, name: str) -> str:
    if kind == "mdesc" and name in ("tvel", "rvel"):
        return f"a data file names the limit {name} as {'tmax' if name == 'tvel' else 'rmax'}"
    if kind == "joint":
        return f"a joint has j1 to j6, and no {name}"
    return f"a {kind} has no {name}"


def _check_number(variable: Variable, key: str, name: str, text: str, line: int, report: Report) -> None:
    value = number_of(text)
    if value is None:
        message = f"{_named(variable, key)}: {name} = {printable(text, 40)!r} is no number; correct it"
        report.add(856, Level.FAIL, message, variable.file, line, kind="number")
    elif name in _ANGLES and abs(value) > _FULL_TURN:
        told = f"{_named(variable, key)}: {name} = {value:g} degrees"
        message = f"{told} is more than a full turn; is it a length, or in other units?"
        report.add(856, Level.WARN, message, variable.file, line, kind="angle")


def _check_mdesc(variable: Variable, told: str, line: int, attributes: Mapping[str, str], report: Report) -> None:
    for name in ("vel", "accel", "decel", "tmax", "rmax"):
        value = number_of(attributes.get(name, "1"))
        if value is not None and value <= 0.0:
            message = f"{told}: {name} = {value:g} is not positive, and a move with it is refused; correct it"
            report.add(857, Level.FAIL, message, variable.file, line, kind=name)
    for name in ("leave", "reach"):
        value = number_of(attributes.get(name, "0"))
        if value is not None and value < 0.0:
            message = f"{told}: {name} = {value:g} is negative; correct it"
            report.add(857, Level.FAIL, message, variable.file, line, kind=name)
    blend = attributes.get("blend", "off")
    if blend not in BLENDS:
        right = next((word for word in BLENDS if word.lower() == blend.lower()), "")
        message = f"{told}: blend = {printable(blend, 20)!r} is none of {', '.join(BLENDS)}; write {right or 'one'}"
        report.add(857, Level.WARN if right else Level.FAIL, message, variable.file, line, kind="blend")


def _check_father(application: Application, variables: Variables, variable: Variable, report: Report) -> None:
    """Check that what an element stands in is declared, of the right type, and not the element itself."""
    root, wanted = ("flange", "tool") if variable.type == "tool" else ("world", "frame")
    if variable.type not in ("point", "frame", "tool"):
        return
    problems: dict[str, str] = {"": ""}
    for key, (line, attributes) in variable.values.items():
        text = attributes.get("fatherId", "").strip()
        if text not in problems:
            problems[text] = _father_problem(application, variables, variable, key, root, wanted)
        if problems[text]:
            what = f"{_named(variable, key)} stands in {printable(text, 40)}, {problems[text]}"
            report.add(859, Level.FAIL, what, variable.file, line, kind=f"father {text}")
        if variable.name == root and any(number_of(attributes.get(each, "0")) for each in ("x", "y", "z", *_ANGLES)):
            what = f"the built-in {root} is given a pose, which it does not take; declare a {wanted} of your own"
            report.add(859, Level.FAIL, what, variable.file, line, kind="world")


def _father_problem(
    application: Application, variables: Variables, variable: Variable, key: str, root: str, wanted: str
) -> str:
    library = variable.values[key][1]["fatherId"].partition(":")
    if library[1]:
        return "" if library[0] in application.libraries else "which is in no library of the project; add the library"
    try:
        name, index = variables.father(variable.name, key)
    except RobotError:
        return f"which is no {wanted}; correct it"
    father = application.variables.get(name)
    if name == root:
        return ""
    if father is None:
        return "which is not declared; add it to the data"
    if father.type != wanted:
        return f"which is a {printable(father.type, 20)} and no {wanted}; correct it"
    if not father.collection and int(index) >= father.size:
        return f"of which there are {father.size}; correct the index"
    try:
        variables.frame(name, index) if wanted == "frame" else None
    except RobotError as error:
        return f"which cannot be placed: {error}"
    except FormatError:
        return ""  # a number that is none is told where it stands
    return ""


def _linked(application: Application) -> set[str]:
    """Return the variables that the programs link, as those of s6 do."""
    texts = [statement.text for code in application.programs for statement in code.statements]
    return {name for text in texts for name in _LINKED.findall(text) if not text.startswith("//")}


def _check_links(variable: Variable, report: Report, linked: set[str] | None) -> None:
    if linked is not None:
        if variable.name not in linked and not variable.public:
            told = printable(variable.name, 40)
            message = f"{told} is linked to no input or output; link it, as by {variable.type}Link({told},io:bOut0)"
            report.add(860, Level.WARN, message, variable.file, variable.line, kind="none")
        return
    for key, (line, attributes) in variable.values.items():
        link = attributes.get("link", "")
        if not link:
            message = f"{_named(variable, key)} is linked to no input or output; name one such as BasicIO-1\\%Q0"
            report.add(860, Level.WARN, message, variable.file, line, kind="none")
        elif "\\" not in link:
            told = f"{_named(variable, key)}: the link {printable(link, 40)!r}"
            message = f"{told} has no backslash between board and signal; correct it"
            report.add(860, Level.WARN, message, variable.file, line, kind="form")
    without = 0 if variable.collection else variable.size - len(variable.values)
    if without > 0:
        told = f"{without} of the {variable.size} elements of {printable(variable.name, 40)} are"
        message = f"{told} linked to no input or output; name one such as BasicIO-1\\%Q0"
        report.add(860, Level.WARN, message, variable.file, variable.line, kind="none")


def _check_radians(application: Application, report: Report) -> None:
    """Tell of points whose angles are all small and hold pi: they were written in radians."""
    for variable in application.variables.values():
        if variable.type != "point":
            continue
        texts = [attributes.get(each) for _, attributes in variable.values.values() for each in _ANGLES]
        angles = [abs(value) for text in texts if text is not None and (value := number_of(text)) is not None]
        turns = [value for value in angles if any(abs(value - turn) < 5e-4 for turn in _RADIANS)]
        if len(angles) >= _FEW_ANGLES and turns and max(angles) <= math.pi + 1e-3:
            message = f"the angles of {printable(variable.name, 40)} look like radians; VAL3 takes degrees"
            report.add(856, Level.WARN, message, variable.file, variable.line, kind="radians")
