"""A last line without an end whose last number may be cut short: it would be read as another number without a word."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from sicp_cam.findings import Finding, Level
from sicp_formats.surfaces.checks import Code
from sicp_formats.tables.rows import BLANKS

__all__ = ["TAIL_BYTES", "is_cut", "last_line_cut", "without_cut_line"]

TAIL_BYTES = 2**16
"""How much of the end of a file is looked at."""

_DECIMALS = re.compile(rb"[+-]?[0-9]*(?:[.,]([0-9]*))?")


def is_cut(tail: bytes, delimiter: str | None = None, trailing: bool = False, keyword: bytes = b"") -> bool:
    r"""Tell whether the last number of a text has fewer decimals than all numbers above it, and its line no end.

    Parameters
    ----------
    tail
        The last `TAIL_BYTES` of the text, or all of it.
    delimiter
        What separates the cells, None for any run of blanks.
    trailing
        True if a delimiter may stand behind the last cell.
    keyword
        What the lines in question begin with.

    >>> is_cut(b"1.5 2.25\n1.5 3.75\n2.5 3.")
    True
    """
    lines = tail.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    if len(tail) >= TAIL_BYTES:
        lines = lines[1:]  # half a line
    if not lines or not lines[-1].strip(BLANKS):
        return False
    wanted = [words for line in lines if (words := _words(line, delimiter, trailing, keyword))]
    last = _decimals(wanted[-1]) if wanted and lines[-1].startswith(keyword) else None
    others = [count for words in wanted[:-1] if len(words) == len(wanted[-1]) for count in [_decimals(words)]]
    counts = [count for count in others if count is not None]
    return last is not None and len(counts) >= 2 and len(counts) == len(others) and last < min(counts)


def last_line_cut(path: Path, line: int, *, recover: bool) -> Finding:
    """Return the finding for a last line that may be cut short, which was dropped if the file is to be repaired."""
    message = "the last line has no end, and its last number fewer decimals than all others: it may be cut short; "
    message += "it was dropped" if recover else "copy the file again, or drop the line with --recover"
    return Finding(Code.LAST_LINE_CUT, Level.WARN, message, f"{path}, line {line}")


def without_cut_line(
    path: Path, content: bytes, *, recover: bool, begin: int = 0, keyword: bytes = b""
) -> tuple[bytes, tuple[Finding, ...]]:
    """Return the content of a text, without its last line if `is_cut` says so and it is to be repaired.

    Parameters
    ----------
    path, content
        The file, and its text.
    recover
        True to drop the line.
    begin
        Byte at which the rows begin.
    keyword
        What the lines in question begin with.
    """
    if content.endswith((b"\n", b"\r")) or not is_cut(
        content[max(begin, len(content) - TAIL_BYTES) :], keyword=keyword
    ):
        return content, ()
    end = max(content.rfind(b"\n"), content.rfind(b"\r")) + 1
    line = max(content.count(b"\n"), content.count(b"\r")) + 1
    return content[:end] if recover else content, (last_line_cut(path, line, recover=recover),)


def _words(line: bytes, delimiter: str | None, trailing: bool, keyword: bytes) -> Sequence[bytes]:
    text = line.strip(BLANKS)
    if not text.startswith(keyword):
        return ()
    words = text.split(None if delimiter is None else delimiter.encode("ascii"))
    return words[:-1] if trailing and words and not words[-1].strip() else words


def _decimals(words: Sequence[bytes]) -> int | None:
    """Return the decimals of the last number, -1 without a mark; None if it is no such number."""
    match = _DECIMALS.fullmatch(words[-1].strip().strip(b'"'))
    if match is None or not match[0]:
        return None
    return -1 if match[1] is None else len(match[1])
