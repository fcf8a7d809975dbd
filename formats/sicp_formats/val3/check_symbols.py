"""The names in VAL3 code: declared before they are used, used where they are declared, within their arrays."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from sicp_cam.errors import printable
from sicp_cam.findings import Level
from sicp_formats.robot.program import Statement
from sicp_formats.val3.check_files import Application, Code
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.check_syntax import shape_of, strings_blank
from sicp_formats.val3.words import INSTRUCTIONS, KEYWORDS, LITERALS, SCREEN

__all__ = ["check_symbols"]

_SYMBOL = re.compile(r"(?<![\w.$])(\$?[A-Za-z_]\w*)(?::([A-Za-z_]\w*))?(\s*\()?", re.ASCII)
_INDEXED = re.compile(r"(?<![\w.:])([A-Za-z_]\w*)\[\s*([0-9]{1,9})\s*\]", re.ASCII)
_TASK = re.compile(r"taskcreate(?:sync)?\s.*,\s*([A-Za-z_]\w*)\s*\(", re.ASCII | re.I)
_CALL = re.compile(r"call\s+([A-Za-z_]\w*)\s*\(", re.ASCII | re.I)
_RESIZED = re.compile(r"\b(?:append|insert|resize|delete)\s*\(\s*([A-Za-z_]\w*)", re.ASCII)
_BUILT_IN = frozenset({"world", "flange"})
_ENTRIES = frozenset({"start", "stop"})


@dataclass(slots=True)
class _Symbols:
    """What the application declares, by exact and by small letters, and what of it is used."""

    application: Application
    report: Report
    used: set[str] = field(default_factory=set)
    called: set[str] = field(default_factory=lambda: set(_ENTRIES))
    resized: set[str] = field(default_factory=set)
    variables: Mapping[str, str] = field(default_factory=dict)
    programs: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)


def check_symbols(application: Application, report: Report) -> None:
    """Check every name in the code, then tell what is declared and never used."""
    symbols = _Symbols(application, report)
    symbols.variables = {name.lower(): name for name in application.variables}
    symbols.programs = {code.name.lower(): code.name for code in application.programs}
    symbols.words = {word.lower(): word for word in INSTRUCTIONS}
    for code in application.programs:
        for statement in code.statements:
            symbols.resized.update(_RESIZED.findall(statement.text))
    for code in application.programs:
        own_used: set[str] = set()
        undeclared: set[str] = set()
        met: set[str] = set()
        for statement in code.statements:
            if statement.text.startswith("//"):
                continue
            shape = shape_of(statement.text)
            if shape not in met and _check_line(symbols, code, statement, own_used, undeclared):
                met.add(shape)
            for name, index in _INDEXED.findall(strings_blank(statement.text)):
                _check_index(symbols, code, name, int(index), statement.line)
        _own_unused(code, own_used, report)
    _unused(symbols)


def _check_line(symbols: _Symbols, code: Code, statement: Statement, own_used: set[str], undeclared: set[str]) -> bool:
    """Check the names in a statement; say whether the next one of its shape needs no look."""
    known = True
    plain = strings_blank(statement.text)
    called = _CALL.match(plain) or _TASK.match(plain)
    called_at = called.start(1) if called else -1
    for match in _SYMBOL.finditer(plain):
        name, inner, bracket = match.groups()
        if inner is not None:
            problem, level = _library_problem(symbols, name), Level.FAIL
        elif match.start() == called_at:
            problem, level = _program_problem(symbols, name)
        elif bracket and name.lower() not in KEYWORDS:
            known &= _check_instruction(symbols, code, name, statement.line)
            continue
        elif name in code.own:
            own_used.add(name)
            continue
        elif name in symbols.application.variables:
            symbols.used.add(name)
            continue
        else:
            problem, level = _variable_problem(symbols, code, name)
        if problem and name not in undeclared:
            undeclared.add(name)
            symbols.report.add(864, level, problem, code.file, statement.line, kind=f"symbol {name}")
    return known


def _library_problem(symbols: _Symbols, name: str) -> str:
    if name in symbols.application.libraries:
        return ""
    return f"'{printable(name, 40)}' is no library of the project; add it to the project"


def _program_problem(symbols: _Symbols, name: str) -> tuple[str, Level]:
    declared = symbols.programs.get(name.lower())
    if declared is None:
        return f"the program '{printable(name, 40)}' is not in the project; add its file and list it", Level.FAIL
    symbols.called.add(declared)
    if declared != name:
        return f"the program '{printable(name, 40)}' is named '{printable(declared, 40)}'; write it so", Level.WARN
    return "", Level.INFO


def _variable_problem(symbols: _Symbols, code: Code, name: str) -> tuple[str, Level]:
    lower = name.lower()
    if lower in KEYWORDS or name in LITERALS or name in _BUILT_IN or name.startswith("$"):
        return "", Level.INFO
    right = next((word for word in LITERALS if word.lower() == lower), None)
    declared = symbols.variables.get(lower) or next((own for own in code.own if own.lower() == lower), right)
    if declared is not None:
        symbols.used.add(declared)
        return f"'{printable(name, 40)}' is declared as '{printable(declared, 40)}'; write it so", Level.WARN
    return f"'{printable(name, 40)}' is declared nowhere in the application; declare it in the data", Level.FAIL


def _check_instruction(symbols: _Symbols, code: Code, name: str, line: int) -> bool:
    """Check the name of an instruction; say whether it is a good one."""
    if name in SCREEN:
        level = Level.INFO if symbols.application.old else Level.WARN
        level = Level.FAIL if symbols.application.version.lower().startswith("s8") else level
        message = f"a CS9 controller has no {name}, an instruction for the screen of a CS8; log or pop up a message"
        symbols.report.add(863, level, message, code.file, line, kind=name)
    elif name in INSTRUCTIONS or name.startswith("$"):
        return True
    elif name.lower() in symbols.words:
        message = f"'{printable(name, 40)}' is written {symbols.words[name.lower()]} in VAL3; write it so"
        symbols.report.add(862, Level.WARN, message, code.file, line, kind=name)
    elif name.lower() in symbols.programs:
        symbols.called.add(symbols.programs[name.lower()])
        message = f"'{printable(name, 40)}' is a program, and no instruction; write call {printable(name, 40)}(...)"
        symbols.report.add(862, Level.FAIL, message, code.file, line, kind=name)
    else:
        message = f"'{printable(name, 40)}' is no instruction that is known here; does the controller have it?"
        symbols.report.add(862, Level.WARN, message, code.file, line, kind=name)
    return False


def _check_index(symbols: _Symbols, code: Code, name: str, index: int, line: int) -> None:
    size: int | None = None
    if name in code.own:
        size = code.own[name].size
    elif name in symbols.application.variables:
        variable = symbols.application.variables[name]
        size = None if variable.collection else max(variable.size, 1)
    if size is not None and index >= size and name not in symbols.resized:
        message = f"{name}[{index}] is beyond the {size} elements of {name}; correct the index or the size"
        symbols.report.add(866, Level.FAIL, message, code.file, line, kind=name)


def _own_unused(code: Code, used: set[str], report: Report) -> None:
    for each in code.own.values():
        if each.local and each.name not in used:
            message = f"the local variable '{printable(each.name, 40)}' is never used"
            report.add(865, Level.INFO, message, code.file, each.line, kind="local")


def _unused(symbols: _Symbols) -> None:
    application, report = symbols.application, symbols.report
    used = symbols.used | set(_named_in_data(application))
    for variable in application.variables.values():
        if variable.name not in used | _BUILT_IN and not variable.public:
            message = f"the {printable(variable.type, 20)} '{printable(variable.name, 40)}' is never used"
            report.add(865, Level.INFO, message, variable.file, variable.line, kind="variable")
    for code in application.programs:
        if code.name not in symbols.called and not code.public:
            message = f"the program '{printable(code.name, 40)}' is never called"
            report.add(865, Level.INFO, message, code.file, code.line, kind="program")


def _named_in_data(application: Application) -> Iterator[str]:
    for variable in application.variables.values():
        for _, attributes in variable.values.values():
            for name in ("fatherId", "ioLink"):
                yield attributes.get(name, "").partition("[")[0].strip()
