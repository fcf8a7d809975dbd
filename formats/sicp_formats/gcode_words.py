"""Cut a block of G-code into comments, Siemens keywords and words."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

__all__ = ["FIND_WORDS", "Block", "GCodeError", "split_block"]

FIND_WORDS = re.compile(r"([A-Z](?:[0-9]*=)?|\S)[ \t]*([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))?", re.ASCII).findall
"""(letter, number) pairs of a block in upper case; a character that is no letter comes as its own pair."""

_KEYWORD = re.compile(r"[A-Z_]{2,}[A-Z0-9_]*(?:[ \t]*\([^()]*\))?", re.ASCII)
_MESSAGE = re.compile(r'MSG[ \t]*\([ \t]*(?:"([^"]*)")?[ \t]*\)', re.IGNORECASE)
_RADIUS_WORD = re.compile(r"\bCR[ \t]*=", re.ASCII)
_KEYWORDS_KEPT = frozenset(
    {
        "TRAORI",
        "TRAFOOF",
        "ORIWKS",
        "ORIVECT",
        "ORIAXES",
        "ORIVIRT1",
        "STOPRE",
        "SOFT",
        "BRISK",
        "FFWON",
        "COMPOF",
        "SUPA",
    }
)


class GCodeError(Exception):
    """What is wrong with a block; the reader adds file and line."""


@dataclass(slots=True)
class Block:
    """One block: G codes and M codes as numbers, all other words by letter, keywords and comments as text."""

    g: list[float] = field(default_factory=list)
    m: list[float] = field(default_factory=list)
    words: dict[str, str] = field(default_factory=dict)
    keywords: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)


def split_block(line: str) -> Block:
    """Return the parts of a block.

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
    if message := _MESSAGE.search(line):
        block.comments.append(message[1] or "")
        line = line[: message.start()] + line[message.end() :]
    code = _RADIUS_WORD.sub("R", _without_comments(line, block).upper())
    if any(mark in code for mark in "#[<"):
        raise GCodeError("variables and expressions are not evaluated; post the path with plain numbers")
    code = _KEYWORD.sub(lambda found: _keyword(found[0], block), code)
    for letter, number in FIND_WORDS(code):
        _add_word(block, letter, number)
    return block


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
        if _KEYWORD.fullmatch(re.split(r"[ \t0-9.]", (code + rest[:opened]).upper().rstrip())[-1] or ""):
            code += rest[: closed + 1]  # TRAORI(1): arguments, not a comment
        else:
            if "(" in rest[opened + 1 : closed]:
                raise GCodeError("nested comment: '(' within '( )'; take it out")
            block.comments.append(rest[opened + 1 : closed].strip())
            code += rest[:opened] + " "
        rest = rest[closed + 1 :]
    return code


def _keyword(text: str, block: Block) -> str:
    name = re.match(r"[A-Z_]+[A-Z0-9_]*", text)
    if name is None or name[0] not in _KEYWORDS_KEPT:
        raise GCodeError(f"{text}: keywords, cycles and expressions are not executed; post the path as plain G1 blocks")
    block.keywords.append(text)
    return " "


def _add_word(block: Block, letter: str, number: str) -> None:
    if not letter[0].isalpha():
        raise GCodeError(f"bad character {letter!r} used; correct the line")
    if letter[-1] == "=":
        letter = letter[:-1]
        if letter[0] in "RGMNO" and letter != "R":
            raise GCodeError(f"{letter}=: parameters are not evaluated; post the path with plain numbers")
    if not number:
        raise GCodeError(f"{letter} word without a number; correct the line")
    if letter == "G":
        block.g.append(float(number))
    elif letter == "M":
        block.m.append(float(number))
    elif letter in block.words:
        raise GCodeError(f"multiple {letter} words on one line; take one out")
    else:
        block.words[letter] = number
