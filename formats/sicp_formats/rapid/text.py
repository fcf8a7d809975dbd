"""Cut ABB RAPID modules into statements: routines by their names, and the declarations of the module."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

from sicp_cam.errors import FormatError, printable
from sicp_cam.limits import Limits
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.program import Statement
from sicp_formats.source import read_bytes

__all__ = ["Module", "Routine", "module_files", "read_module"]

_FILE_HEADER = re.compile(r"\s*%%%[^%]*%%%")
_TOKEN = re.compile(r'"(?:[^"\n]|"")*"?|!.*|;|\n|[^"!;\n]+')
_HEAD = re.compile(r"(?:MODULE\b.*|ENDMODULE|END(?:PROC|FUNC|TRAP|RECORD|IF|FOR|WHILE|TEST)|ELSE|ERROR|UNDO)", re.I)
_ROUTINE = re.compile(r"(?:LOCAL[ \t]+)?(PROC|FUNC|TRAP|RECORD)\b[ \t]*(.*)", re.IGNORECASE | re.DOTALL)
_ROUTINE_HEAD = re.compile(r"(?:LOCAL[ \t]+)?(?:(?:PROC|FUNC)\b.*\)|(?:TRAP|RECORD)[ \t]+\w+)[ \t]*", re.I | re.DOTALL)
_BLOCK_HEAD = re.compile(
    r"(?:IF\b.*\bTHEN|ELSEIF\b.*\bTHEN|FOR\b.*\bDO|WHILE\b.*\bDO|(?:CASE\b.*|DEFAULT[ \t]*):)", re.I | re.S
)
_TEST = re.compile(r"TEST\b.*", re.IGNORECASE)
_LABEL = re.compile(r"\w+[ \t]*:", re.ASCII)
_INLINE = re.compile(
    r"((?:IF|ELSEIF|FOR|WHILE)\b.*?\b(?:THEN|DO)\b|ELSE\b|(?:CASE\b[^:]*|DEFAULT[ \t]*):(?!=))(.+)", re.I | re.DOTALL
)
_LONGEST_HEAD = 2000
_DECLARATION = re.compile(r"(?:(?:LOCAL|TASK)[ \t]+)?(?:CONST|PERS|VAR|ALIAS)\b", re.IGNORECASE)
_LISTED = re.compile(r"<Module>([^<>]*)</Module>", re.IGNORECASE)
_NAME = re.compile(r"(\w+)[ \t]*(?:\((.*)\))?[ \t]*", re.ASCII | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Routine:
    """A procedure: whether it takes arguments, its declarations, and its statements; comments begin with `!`."""

    name: str
    takes_arguments: bool
    statements: tuple[Statement, ...]
    file: Path


@dataclass(frozen=True, slots=True)
class Module:
    """A module: its name, its declarations, and its procedures by lower-case name in the order of the file."""

    name: str
    declarations: tuple[Statement, ...]
    routines: dict[str, Routine]


def module_files(path: Path, content: bytes, limits: Limits) -> dict[Path, bytes]:
    """Return the modules of a program with their text: the file itself, or those that a .pgf lists, in its order.

    Raises
    ------
    FormatError
        If a .pgf lists none, or one that does not lie beside it.
    """
    if ".pgf" not in path.name.lower():
        return {path: content}
    names = _LISTED.findall("\n".join(program_lines(path, content, limits)))
    if not names:
        raise FormatError(path, "lists no <Module>; is this a RAPID program (.pgf)?", line=1)
    files = [path.with_name(PureWindowsPath(name.strip()).name or "?") for name in names]
    missing = next((file for file in files if not file.is_file()), None)
    if missing is not None:
        raise FormatError(path, f"lists {printable(missing.name, 60)}, which does not lie beside it", line=1)
    return {file: read_bytes(file, limits) for file in files}


def read_module(path: Path, text: str) -> Module:
    """Return the declarations and procedures of a module.

    Raises
    ------
    FormatError
        If the text is no RAPID module, or a statement or routine is not closed.
    """
    name, declarations, routines = "", list[Statement](), dict[str, Routine]()
    kind, head, body, begun = "", "", list[Statement](), 0
    header = _FILE_HEADER.match(text)
    if header:
        text = "\n" * header[0].count("\n") + text[header.end() :]
    for statement in _statements(path, text):
        routine = _ROUTINE.fullmatch(statement.text)
        word = statement.text.upper()
        if routine and kind:
            raise FormatError(path, "a routine begins within another; is its end missing?", line=statement.line)
        if routine:
            kind, head, body, begun = routine[1].upper(), routine[2], [], statement.line
        elif kind and word == f"END{kind}":
            if kind == "PROC":
                found = _routine(path, head, body, begun)
                routines[found.name.lower()] = found
            kind = ""
        elif kind:
            body.append(statement)
        elif _DECLARATION.match(statement.text):
            declarations.append(statement)
        elif word.startswith("MODULE"):
            name = statement.text[6:].split("(")[0].strip()
        elif word != "ENDMODULE" and not statement.text.startswith("!"):
            what = f"'{printable(statement.text, 40)}' stands outside of a routine; is this a RAPID module?"
            raise FormatError(path, what, line=statement.line)
    if kind:
        raise FormatError(path, f"{kind} without END{kind}; is the file complete?", line=begun)
    if not routines:
        raise FormatError(path, "has no PROC ... ENDPROC; is this a RAPID module with a program?", line=1)
    return Module(name, tuple(declarations), routines)


def _routine(path: Path, head: str, body: list[Statement], line: int) -> Routine:
    match = _NAME.fullmatch(head)
    if match is None:
        raise FormatError(path, f"'PROC {printable(head, 40)}' has no name; correct the line", line=line)
    handlers = [at for at, each in enumerate(body) if each.text.upper() in ("ERROR", "UNDO")]
    # What stands behind ERROR or UNDO runs only when something has gone wrong.
    return Routine(match[1], bool((match[2] or "").strip()), tuple(body[: handlers[0]] if handlers else body), path)


def _statements(path: Path, text: str) -> Iterator[Statement]:
    """Yield statements, heads of blocks, and comments (with their `!`), each with the line where it begins."""
    held, length, begun, line = list[str](), 0, 1, 1
    for token in _TOKEN.finditer(text):
        piece = token[0]
        if piece.startswith("!"):
            yield Statement(line, piece)
        elif piece == ";" or (piece == "\n" and length < _LONGEST_HEAD and _is_head("".join(held))):
            yield from _cut("".join(held), begun)
            held, length = [], 0
        elif held or piece.strip():
            begun = begun if held else line
            held.append(" " if piece == "\n" else piece)
            length += len(piece)
        line += piece == "\n"
    if length < _LONGEST_HEAD and _is_head("".join(held)):
        yield from _cut("".join(held), begun)
    elif held:
        what = f"'{printable(''.join(held)[:80], 40)}' has no end (;); is the file complete?"
        raise FormatError(path, what, line=begun)


def _is_head(text: str) -> bool:
    """Say whether a text that no semicolon ends is whole at the end of its line."""
    text = text.strip()
    patterns = (_HEAD, _ROUTINE_HEAD, _BLOCK_HEAD, _TEST, _LABEL)
    return any(pattern.fullmatch(text) for pattern in patterns)


def _cut(text: str, line: int) -> Iterator[Statement]:
    """Yield a statement, the heads that stand before it on its line apart from it."""
    text = text.strip()
    while found := _INLINE.fullmatch(text):
        yield Statement(line, found[1].strip())
        text = found[2].strip()
    if text:
        yield Statement(line, text)
