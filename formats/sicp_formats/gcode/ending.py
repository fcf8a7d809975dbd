"""The last line of a program that nothing ends: whether it was cut short, and may be dropped."""

from __future__ import annotations

import re

from sicp_formats.gcode.machine import END_CODES
from sicp_formats.gcode.words import GCodeError, split_block

__all__ = ["is_torn", "may_be_dropped"]

_REMARK = re.compile(r'\([^()]*\)|;.*|"[^"]*"|(?<![A-Z_=])[ \t]*\([^()]*$', re.ASCII | re.IGNORECASE)
_MOVING = re.compile(r"(?<![A-Z_])[XYZABCIJKRUVW](?![A-Z_])", re.ASCII | re.IGNORECASE)
_CALLING = frozenset({65.0, 66.0, 67.0, 96.0, 97.0, 98.0, 198.0})


def is_torn(last: str) -> bool:
    """Say whether a line, which no line end follows, has words that move the tool.

    >>> is_torn("N5 G1 X100.2"), is_torn("M5 (to X"), is_torn("")
    (True, False, False)
    """
    return not last.lstrip().startswith(("%", "/")) and bool(_MOVING.search(_REMARK.sub("", last)))


def may_be_dropped(last: str, decimal: str) -> bool:
    """Say whether the last line is a block that moves nothing, ends nothing, and calls no other program.

    >>> may_be_dropped("N90 M", "."), may_be_dropped("X2 Y", "."), may_be_dropped("M30", "."), may_be_dropped("", ".")
    (True, False, False, False)
    """
    if not last.strip(" \t\x1a") or last.strip().startswith("%") or is_torn(last):
        return False
    try:
        block = split_block(last, decimal)
    except GCodeError:
        return True
    return not any(code in END_CODES or code in _CALLING for code in (*block.m, *block.g))
