"""The text of Heidenhain conversational programs: blocks without their numbers, comments, and words of a move."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError, printable

__all__ = ["BEGIN", "END", "Block", "read_blocks", "words_of"]

BEGIN = re.compile(r"BEGIN[ \t]+PGM[ \t]+(\S+)(?:[ \t]+(MM|INCH))?", re.ASCII | re.IGNORECASE)
END = re.compile(r"END[ \t]+PGM[ \t]+(\S+)(?:[ \t]+(MM|INCH))?", re.ASCII | re.IGNORECASE)

_NUMBERED = re.compile(r"[ \t]*([0-9]+)?[ \t]*(.*)", re.ASCII | re.DOTALL)
_WORD = re.compile(
    r"[ \t]*(?:(I?[XYZABCUVW]|[NT][XYZ]|F|M|S|DL|DR|DR2)[ \t]*([+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+))"
    r"|(FMAX|F[ \t]+MAX|F[ \t]*AUTO|R0|RL|RR|R\+|R-))(?![A-Z0-9.,])",
    re.ASCII | re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Block:
    """A block: its line in the file, its number (-1 if it has none), its code in upper case, and its comment."""

    line: int
    number: int
    code: str
    comment: str


def read_blocks(path: Path, lines: Sequence[str]) -> list[Block]:
    """Return the blocks of a program; one that ends with ~ goes on in the next line.

    Raises
    ------
    FormatError
        If the text is no conversational program, or the last block is cut short.
    """
    blocks: list[Block] = []
    held, begun, number = "", 0, -1
    for line, text in enumerate(lines, 1):
        found = _NUMBERED.fullmatch(text.strip(" \t\f\v\x1a"))
        if found is None or not found[2]:
            continue
        code, _, comment = found[2].partition(";")
        if not held:
            begun, number = line, -1 if found[1] is None else int(found[1][:12])
        # The lines of a block that goes on have no numbers of their own: digits there belong to it.
        code = code.strip() if not held else text.partition(";")[0].strip()
        held = f"{held} {code}".strip()
        if held.endswith("~"):
            held = held[:-1].rstrip()
            continue
        blocks.append(Block(begun, number, held.upper(), comment.strip()))
        held = ""
    if held:
        raise FormatError(path, f"'{printable(held, 40)}' goes on (~) but the file ends; export it again", line=begun)
    first = next((block for block in blocks if block.code), None)
    if first is None or not BEGIN.fullmatch(first.code):
        what = "does not begin with BEGIN PGM; is this a conversational program (.h)?"
        raise FormatError(path, what, line=first.line if first else 1)
    return blocks


def words_of(text: str) -> tuple[list[tuple[str, float]], list[str], str]:
    """Return the words of a move with their numbers, those without one, and what is left where it is no word.

    >>> words_of("X+1.5 IY-2 FMAX M3 R0")
    ([('X', 1.5), ('IY', -2.0), ('M', 3.0)], ['FMAX', 'R0'], '')
    """
    numbers: list[tuple[str, float]] = []
    plain: list[str] = []
    at = 0
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None:
            break
        if found[3]:
            plain.append("".join(found[3].upper().split()))
        else:
            numbers.append((found[1].upper(), float(found[2].replace(",", "."))))
        at = found.end()
    return numbers, plain, text[at:].strip()
