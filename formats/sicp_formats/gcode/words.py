"""Cut a block of G-code into comments, Siemens keywords and words, and say where each word stands."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sicp_formats.gcode.keywords import KEYWORDS_KEPT

__all__ = ["Block", "GCodeError", "Word", "decimal_mark", "split_block"]

_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
_MANNER = r"AC|IC|DC|ACP|ACN"
_WORD = re.compile(
    r"(CR[ \t]*=|[A-Z](?:[0-9]*[ \t]*=)?|\S)[ \t]*"
    rf"(?:({_MANNER})[ \t]*\([ \t]*({_NUMBER})[ \t]*\)|({_NUMBER}))?",
    re.ASCII,
)
_KEYWORD = re.compile(
    rf"(?!CR[ \t]*=)[A-Z_]{{2,}}[A-Z0-9_]*(?:[ \t]*\([^()]*\)|[ \t]*=[ \t]*(?:{_NUMBER})?)?", re.ASCII
)
_CALL = re.compile(r"[A-Z_]{2,}[A-Z0-9_]*", re.ASCII)
_CALLED = re.compile(r"(?<![A-Z_])[A-Z_]{2,}[A-Z0-9_]*$", re.ASCII)
_MANNERED = re.compile(rf"(?:{_MANNER})[ \t]*\([ \t]*{_NUMBER}[ \t]*\)")
_MESSAGE = re.compile(r'MSG[ \t]*\([ \t]*(?:"([^"]*)")?[ \t]*\)', re.IGNORECASE | re.ASCII)
_TOOL_NAME = re.compile(r'(?<![A-Z_])T[ \t]*=[ \t]*"([^"]*)"', re.IGNORECASE | re.ASCII)
_DECIMAL_COMMA = re.compile(r"(?<=[A-Z0-9=+-]),(?=[0-9])", re.ASCII | re.IGNORECASE)
_WITH_POINT = re.compile(r"[A-FH-LN-Z][0-9]*[ \t]*=?[ \t]*[+-]?[0-9]*\.", re.ASCII | re.IGNORECASE)
_REMARK = re.compile(r'\([^()]*\)|;.*|"[^"]*"')
_UPPER = {ord(small): ord(small) - 32 for small in "abcdefghijklmnopqrstuvwxyz"}
_LETTERS_OF_MANNER = frozenset("XYZABCIJK")


class GCodeError(Exception):
    """What is wrong with a block; the reader adds file and line."""


class Word(NamedTuple):
    """One word of a line: its letter, its number as written, and the columns of both (0-based, end exclusive).

    `manner` is AC, IC ... where the number stands as `AC(...)`, else empty.
    """

    letter: str
    number: str
    start: int
    end: int
    number_start: int
    number_end: int
    manner: str = ""


@dataclass(slots=True)
class Block:
    """One block: G codes and M codes as numbers, all other words by letter, keywords and comments as text.

    `manners` holds AC, IC ... of the words that are stated so; `placed` all words in their order.
    """

    g: list[float] = field(default_factory=list)
    m: list[float] = field(default_factory=list)
    words: dict[str, str] = field(default_factory=dict)
    manners: dict[str, str] = field(default_factory=dict)
    keywords: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    tool_name: str = ""
    placed: list[Word] = field(default_factory=list)


def split_block(line: str, decimal: str = ".") -> Block:
    """Return the parts of a block.

    Parameters
    ----------
    line
        The block; columns are counted in it.
    decimal
        ``","`` if numbers have a decimal comma.

    Raises
    ------
    GCodeError
        If a comment is not closed, a word has no number or comes twice, or the block needs an interpreter of
        variables, expressions or macros.

    >>> block = split_block("N10 g1 X-.5 y 2. (cut) F600")
    >>> block.g, block.words, block.comments
    ([1.0], {'N': '10', 'X': '-.5', 'Y': '2.', 'F': '600'}, ['cut'])
    """
    block = Block()
    # Everything that is taken out leaves blanks behind, so that columns stay true.
    code = _MESSAGE.sub(lambda found: _comment(found, block), line)
    code = _TOOL_NAME.sub(lambda found: _named_tool(found, block), code)
    code = _without_comments(code, block).translate(_UPPER)
    if code.rstrip().endswith("*"):  # the end of a block, where a dialect writes it
        code = code.rstrip()[:-1]
    if decimal == ",":
        code = _DECIMAL_COMMA.sub(".", code)
    if any(mark in code for mark in "#[<"):
        raise GCodeError("variables and expressions are not evaluated; post the path with plain numbers")
    code = _KEYWORD.sub(lambda found: _keyword(found, block), code)
    for found in _WORD.finditer(code):
        _add_word(block, found)
    return block


def decimal_mark(lines: Sequence[str]) -> str:
    """Return ``","`` if the commas of a program can be nothing but decimal commas, else ``"."``.

    They are if each stands in a number and no coordinate has a decimal point.

    >>> decimal_mark(["G1 X10,5 Y,25 (a, b)"]), decimal_mark(["G1 X10 ,R5"]), decimal_mark(["X10,5 Y2.5"])
    (',', '.', '.')
    """
    found = False
    for line in lines:
        if "," not in line:
            continue
        code = _REMARK.sub("", line)
        if len(_DECIMAL_COMMA.findall(code)) != code.count(","):
            return "."
        found = found or "," in code
    return (
        "," if found and not any("." in line and _WITH_POINT.search(_REMARK.sub("", line)) for line in lines) else "."
    )


def _comment(found: re.Match[str], block: Block) -> str:
    block.comments.append(found[1] or "")
    return " " * len(found[0])


def _named_tool(found: re.Match[str], block: Block) -> str:
    block.tool_name = found[1]
    return " " * len(found[0])


def _without_comments(line: str, block: Block) -> str:
    code, rest = "", line
    while rest:
        opened, semicolon = rest.find("("), rest.find(";")
        if semicolon >= 0 and (opened < 0 or semicolon < opened):
            block.comments.append(rest[semicolon + 1 :].strip())
            return code + rest[:semicolon]
        if opened < 0:
            return code + rest
        closed = rest.find(")", opened)
        if closed < 0:
            raise GCodeError("unclosed comment: '(' without ')'; close it")
        if _CALLED.search((code + rest[:opened]).upper().rstrip()):
            code += rest[: closed + 1]  # TRAORI(1): arguments, not a comment
        else:
            if "(" in rest[opened + 1 : closed]:
                raise GCodeError("nested comment: '(' within '( )'; take it out")
            block.comments.append(rest[opened + 1 : closed].strip())
            code += rest[:opened] + " " * (closed + 1 - opened)
        rest = rest[closed + 1 :]
    return code


def _keyword(found: re.Match[str], block: Block) -> str:
    text = found[0].strip()
    name = _CALL.match(text)
    if _MANNERED.fullmatch(text) and found.string[: found.start()].rstrip().endswith("="):
        return found[0]  # X=AC(10)
    if name is None or name[0] not in KEYWORDS_KEPT:
        raise GCodeError(f"{text}: keywords, cycles and expressions are not executed; post the path as plain G1 blocks")
    block.keywords.append(text)
    return " " * len(found[0])


def _add_word(block: Block, found: re.Match[str]) -> None:
    letter, manner = found[1], found[2] or ""
    group = 3 if manner else 4
    number = found[group] or ""
    if not letter[0].isalpha():
        other = " or, if it marks decimals, say --set path.decimal=," if letter == "," else ""
        raise GCodeError(f"bad character {letter!r} used; correct the line{other}")
    if letter[-1] == "=":
        letter = "R" if letter.startswith("CR") else letter[:-1].rstrip()
        if letter[0] in "RGNO" and letter != "R":
            raise GCodeError(f"{letter}=: parameters are not evaluated; post the path with plain numbers")
    if not number:
        raise GCodeError(f"{letter} word without a number; correct the line")
    if manner:
        if letter not in _LETTERS_OF_MANNER or (manner in ("DC", "ACP", "ACN") and letter not in "ABC"):
            raise GCodeError(f"{letter}={manner}(...): not read here; post plain numbers")
        block.manners[letter] = manner
    block.placed.append(Word(letter, number, *found.span(), *found.span(group), manner))
    if letter == "G":
        block.g.append(float(number))
    elif letter == "M":
        block.m.append(float(number))
    elif letter in block.words:
        raise GCodeError(f"multiple {letter} words on one line; take one out")
    else:
        block.words[letter] = number
