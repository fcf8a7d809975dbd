"""Cut Universal Robots scripts into functions and statements."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_formats.robot.program import Statement, without_strings

__all__ = ["BLOCK", "Function", "Script", "read_script"]

BLOCK = re.compile(r"(?:if|while)\b.*:|(?:thread)\b.*:", re.ASCII)
"""The opening of a block that ends with `end`."""

_DEF = re.compile(r"(?:def|sec)[ \t]+(\w+)[ \t]*\((.*)\)[ \t]*:", re.ASCII)
_LABEL = re.compile(r"\$[ \t]*[0-9]+\b.*")
_LONGEST_STATEMENT = 50


@dataclass(slots=True)
class Function:
    """A function: whether it takes arguments, and its statements; comments begin with `#`."""

    name: str
    takes_arguments: bool
    line: int
    statements: list[Statement] = field(default_factory=list)


@dataclass(slots=True)
class Script:
    """A script: what stands outside of all functions, and the functions by name in the order of their beginnings."""

    statements: list[Statement]
    functions: dict[str, Function]


def read_script(path: Path, lines: list[str]) -> Script:
    """Return the functions of a script, nested ones among them.

    Raises
    ------
    FormatError
        If a function, block or statement is not closed, or a name stands twice.
    """
    outside = Function("", False, 1)
    functions: dict[str, Function] = {}
    within, blocks = [outside], [0]
    for statement in _statements(path, lines):
        head = _DEF.fullmatch(statement.text)
        if head:
            if head[1] in functions:
                raise FormatError(path, f"the function {printable(head[1], 40)} stands twice", line=statement.line)
            functions[head[1]] = Function(head[1], bool(head[2].strip()), statement.line)
            within.append(functions[head[1]])
            blocks.append(0)
        elif statement.text == "end" and blocks[-1] == 0:
            if len(within) == 1:
                raise FormatError(path, "'end' closes nothing; correct the script", line=statement.line)
            within.pop()
            blocks.pop()
        else:
            blocks[-1] += bool(BLOCK.fullmatch(statement.text)) - (statement.text == "end")
            within[-1].statements.append(statement)
    if len(within) > 1 or blocks[-1]:
        raise FormatError(path, "a function or block has no end; is the file complete?", line=within[-1].line)
    return Script(outside.statements, functions)


def _statements(path: Path, lines: list[str]) -> list[Statement]:
    """Return the statements of a script; one whose brackets are open goes on in the next line."""
    found, held, begun = list[Statement](), "", 0
    for number, line in enumerate(lines, 1):
        place = without_strings(line).find("#")
        code, comment = (line, "") if place < 0 else (line[:place], line[place:].strip())
        if comment and not held:
            found.append(Statement(number, comment))
        code = code.strip()
        if not code or (not held and _LABEL.fullmatch(code)):
            continue
        begun = begun if held else number
        held = f"{held} {code}" if held else code
        plain = without_strings(held)
        if sum(plain.count(mark) for mark in "([{") > sum(plain.count(mark) for mark in ")]}"):
            if number - begun > _LONGEST_STATEMENT:
                break
            continue
        found.append(Statement(begun, held))
        held = ""
    if held:
        raise FormatError(path, f"'{printable(held, 40)}' is not closed; is the file complete?", line=begun)
    return found
