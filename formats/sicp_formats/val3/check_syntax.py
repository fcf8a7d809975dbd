"""The form of VAL3 statements: blocks that close, brackets and strings in pairs, and nothing that is no statement."""

from __future__ import annotations

import re

from sicp_cam.errors import printable
from sicp_cam.findings import Level
from sicp_formats.val3.check_files import Application, Code
from sicp_formats.val3.check_report import Report

__all__ = ["check_syntax", "shape_of", "strings_blank"]

_STRING = re.compile(r'"[^"]*"')
_CONSTANT = re.compile(r"\[[0-9]+\]")
_FIRST_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_BRACKETS = {")": "(", "]": "[", "}": "{"}
_OPENS = {"if": "endif", "for": "endfor", "while": "endwhile", "do": "until", "switch": "endswitch"}
_WITHIN = {"else": "if", "elseif": "if", "case": "switch", "default": "switch"}
_WRITTEN = {"endif": "endIf", "endfor": "endFor", "endwhile": "endWhile", "endswitch": "endSwitch", "elseif": "elseIf"}
_NAME = r"\$?[A-Za-z_]\w*(?::[A-Za-z_]\w*)?"
_INDEX = r"(?:\[[^=]*?\])?"
_FORMS = {
    "for": re.compile(rf"for\s+{_NAME}{_INDEX}\s*=.+\sto[\s(].+", re.ASCII | re.I),
    "if": re.compile(r"if\b.*\S.*", re.I),
    "elseif": re.compile(r"elseif\b.*\S.*", re.I),
    "while": re.compile(r"while\b.*\S.*", re.I),
    "until": re.compile(r"until\b.*\S.*", re.I),
    "switch": re.compile(r"switch\b.*\S.*", re.I),
    "case": re.compile(r"case\b.*\S.*", re.I),
    "call": re.compile(rf"call\s+{_NAME}\s*\(.*\)", re.ASCII | re.I),
    "taskcreate": re.compile(rf"taskcreate\s.+,.+,\s*{_NAME}\s*\(.*\)", re.ASCII | re.I),
    "taskcreatesync": re.compile(rf"taskcreatesync\s.+,.+,.+,\s*{_NAME}\s*\(.*\)", re.ASCII | re.I),
}
_ALONE = re.compile(r"(?:do|else|endif|endfor|endwhile|endswitch|default|break|return)\s*:?", re.I)
_STATEMENT = re.compile(rf"{_NAME}\s*\(.*\)|{_NAME}{_INDEX}(?:\s*\.\s*\w+{_INDEX})*\s*=(?!=).*\S.*", re.ASCII)


def check_syntax(application: Application, report: Report) -> None:
    """Check every statement of every program by itself, and the blocks that they make."""
    for code in application.programs:
        open_blocks: list[tuple[str, int, str]] = []
        clean: set[str] = set()
        for statement in code.statements:
            shape = shape_of(statement.text)
            if statement.text.startswith("//") or shape in clean:
                continue
            # A move that differs from one before in its index only is as good as that.
            if _check_statement(code, statement.text, statement.line, open_blocks, report):
                clean.add(shape)
        for word, line, _ in open_blocks:
            message = f"'{word}' is not closed by {_WRITTEN.get(_OPENS[word], _OPENS[word])}; close it"
            report.add(861, Level.FAIL, message, code.file, line, kind="open")


def strings_blank(text: str) -> str:
    """Return a statement of the same length with blanks within its strings.

    >>> strings_blank('f("a;b"); g')
    'f("   "); g'
    """
    return _STRING.sub(lambda found: f'"{" " * (len(found[0]) - 2)}"', text) if '"' in text else text


def shape_of(text: str) -> str:
    """Return a statement without the indices that are plain numbers: long paths have very few shapes.

    >>> shape_of("movel(pPath[12],tTool,mCut[3])")
    'movel(pPath[],tTool,mCut[])'
    """
    return _CONSTANT.sub("[]", text)


def _check_statement(code: Code, text: str, line: int, open_blocks: list[tuple[str, int, str]], report: Report) -> bool:
    """Check a statement; say whether it is one that stands for itself and that is right."""
    plain = strings_blank(text)
    problem = ""
    if plain.count('"') % 2:
        problem = "has a string that is not closed"
    elif not _balanced(plain):
        problem = "has brackets that do not open and close in pairs"
    first = _FIRST_WORD.match(plain)
    word = first[0].lower() if first else ""
    block = _block_problem(word, line, text, open_blocks)
    form = _FORMS[word] if word in _FORMS else _ALONE if _is_alone(word) else _STATEMENT
    problem = problem or block or ("" if form.fullmatch(plain) else "is no statement of VAL3")
    if problem:
        message = f"'{printable(text, 60)}' {problem}; correct it"
        report.add(861, Level.FAIL, message, code.file, line, kind="form")
    return not problem and word not in _FORMS and not _is_alone(word)


def _is_alone(word: str) -> bool:
    return bool(_ALONE.fullmatch(word))


def _block_problem(word: str, line: int, text: str, open_blocks: list[tuple[str, int, str]]) -> str:
    """Keep account of the blocks that are open; return what is wrong with a word that opens, divides or closes one."""
    inner = open_blocks[-1][0] if open_blocks else ""
    if word in _OPENS:
        open_blocks.append((word, line, text))
    elif word in _WITHIN and inner != _WITHIN[word]:
        return f"stands outside of a {_WITHIN[word]}"
    elif word in _OPENS.values():
        if not inner or _OPENS[inner] != word:
            wanted = f"; line {open_blocks[-1][1]} opens {inner}" if inner else ""
            return f"closes nothing here{wanted}"
        open_blocks.pop()
    elif word in ("begin", "end"):
        return "stands within a program"
    return ""


def _balanced(plain: str) -> bool:
    waiting: list[str] = []
    for character in _STRING.sub("", plain):
        if character in "([{":
            waiting.append(character)
        elif character in _BRACKETS and (not waiting or waiting.pop() != _BRACKETS[character]):
            return False
    return not waiting
