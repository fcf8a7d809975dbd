"""Cut APT and CL text into statements: continuations joined, comments kept, words in upper case without blanks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from sicp_cam.errors import FormatError

__all__ = ["COMMENT", "TEXT_WORDS", "last_line", "split_line", "statements", "statements_of", "word_of"]

COMMENT = "$$"
"""The word under which comments are handed out."""

TEXT_WORDS = ("PARTNO", "PPRINT", "TPRINT", "INSERT", "LETTER", "REMARK", "TITLES")
"""Statements whose rest of the line is text, with or without a slash, whatever stands in it."""

_TEXT = re.compile(rf"\s*(?:N[0-9]+\s*)?({'|'.join(TEXT_WORDS)})\b\s*/?(.*)", re.IGNORECASE | re.ASCII | re.DOTALL)
_LABEL = re.compile(r"[A-Z0-9]+\)|N[0-9]+(?=[A-Z])", re.ASCII)
_QUOTE_OR_DOLLAR = re.compile(r"'[^']*'|\$\$?")


def statements(path: Path, lines: list[str]) -> Iterator[tuple[int, str, str]]:
    """Yield (1-based line where it begins, word, arguments) for each statement and comment.

    Raises
    ------
    FormatError
        If the file ends within a continued statement, or a line has arguments and no word.

    >>> list(statements(Path("a.apt"), ["goto / 1.,2., $ more", " 3.  $$ end"]))
    [(1, 'GOTO', ' 1.,2.,3.'), (2, '$$', 'end')]
    """
    numbered = iter(enumerate(lines, 1))
    for number, line in numbered:
        yield from statements_of(path, number, line, numbered)


def statements_of(
    path: Path, number: int, line: str, numbered: Iterator[tuple[int, str]]
) -> Iterator[tuple[int, str, str]]:
    """Yield what `statements` does for one line; lines that it goes on in are taken from `numbered`."""
    if "$" not in line:
        word, _, arguments = line.partition("/")
        word = word.strip().upper()
        if word == "GOTO":
            yield number, word, arguments
            return
    if text := _TEXT.match(line):
        yield number, text[1].upper(), text[2].strip()
        return
    yield from _assembled(path, number, line, numbered)


def word_of(line: str) -> str:
    """Return the word of the statement that begins in a line, without label or number; "" if none does.

    >>> word_of("N7 GOTO / 1,2,$"), word_of("  $$ GOTO")
    ('GOTO', '')
    """
    if text := _TEXT.match(line):
        return text[1].upper()
    return _without_label(split_line(line)[0].partition("/")[0])


def _without_label(word: str) -> str:
    word = "".join(word.upper().split())
    label = _LABEL.match(word)
    return word[label.end() :] if label else word


def last_line(lines: list[str], first: int) -> int:
    """Return the 1-based line in which the statement that begins in line `first` ends.

    >>> last_line(["GOTO/1,2,$", "$$ between", "3", "FINI"], 1)
    3
    """
    last = first
    continued = split_line(lines[first - 1])[1]
    while continued and last < len(lines):
        last += 1
        more, again, _ = split_line(lines[last - 1])
        if more.strip() or again:
            continued = again
    return last


def _assembled(
    path: Path, first: int, line: str, numbered: Iterator[tuple[int, str]]
) -> Iterator[tuple[int, str, str]]:
    code, continued, comment = split_line(line)
    comments = [] if comment is None else [(first, comment)]
    while continued:
        number, line = next(numbered, (0, ""))
        if not number:
            raise FormatError(path, "the statement goes on ($) but the file ends; export it again", line=first)
        more, again, comment = split_line(line)
        if comment is not None:
            comments.append((number, comment))
        # Blank lines and comments may stand within a statement; they do not end it.
        if more.strip() or again:
            code, continued = _joined(code, more), again
    yield from _statement(path, first, code)
    for number, comment in comments:
        yield from _comment(path, number, comment, numbered)


def _statement(path: Path, number: int, code: str) -> Iterator[tuple[int, str, str]]:
    word, slash, arguments = code.partition("/")
    if word := _without_label(word):
        yield number, word, arguments
    elif slash:
        raise FormatError(path, "arguments without a word before the slash; correct the line", line=number)


def _comment(
    path: Path, number: int, comment: str, numbered: Iterator[tuple[int, str]]
) -> Iterator[tuple[int, str, str]]:
    text = comment.strip()
    # Creo hides statements in comments ("$$-> CSYS / ... $") and continues them on plain lines.
    while text.startswith("->") and text.endswith("$"):
        following = next(numbered, None)
        if following is None:
            raise FormatError(path, "the comment goes on ($) but the file ends; export it again", line=number)
        text = _joined(text[:-1], following[1].strip())
    if text:
        yield number, COMMENT, text


def split_line(line: str) -> tuple[str, bool, str | None]:
    """Return what stands before the first dollar, whether the statement goes on, and the comment.

    >>> split_line("GOTO/1,2 $ more $$ why")
    ('GOTO/1,2 ', True, 'why')
    """
    if "'" not in line and "$$" not in line:
        code, dollar, _ = line.partition("$")
        return code, bool(dollar), None
    continued, code = False, line
    for found in _QUOTE_OR_DOLLAR.finditer(line):
        if found[0] == "$$":
            return (code if continued else line[: found.start()]), continued, line[found.end() :].strip()
        if found[0] == "$" and not continued:
            continued, code = True, line[: found.start()]
    return code, continued, None


def _joined(head: str, tail: str) -> str:
    """Join two lines of a statement; some systems leave out the comma at the break."""
    head, tail = head.rstrip(), tail.strip()
    needs_comma = head and tail and head[-1] not in ",/(=" and tail[0] not in ",/)=$"
    return f"{head},{tail}" if needs_comma else head + tail
