"""Check the text of a G-code program: its form as a file, comments that controls execute, and every block."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.gcode.checked_blocks import CheckedBlocks
from sicp_formats.gcode.words import decimal_mark
from sicp_formats.paths.defects import Defects, last_line
from sicp_formats.paths.text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["check"]

FORM, COMMENT = 870, 879
"""Codes of the findings; those of blocks stand in `checked_blocks`."""

# What LinuxCNC does at a comment that begins so, instead of passing it over.
_EXECUTED = re.compile(
    r"\([ \t]*(MSG|DEBUG|PRINT|LOG|LOGOPEN|LOGAPPEND|LOGCLOSE|PROBEOPEN|PROBECLOSE|ABORT|PY)[ \t]*[,) ]"
    r"|;[ \t]*(PY|ABORT)[ \t]*,",
    re.ASCII | re.IGNORECASE,
)
_SIEMENS_MESSAGE = re.compile(r"MSG[ \t]*\(", re.IGNORECASE)


def check(
    path: Path, *, limits: Limits = DEFAULT_LIMITS, line_length: int = 255, rotary_step_deg: float = 180.0
) -> tuple[Finding, ...]:
    """Check a G-code program: form, modes, feeds, tip control, rotary steps, arcs, block numbers, words.

    Parameters
    ----------
    path
        The file.
    limits
        Caps on it.
    line_length
        Longest line that the control takes, in characters.
    rotary_step_deg
        Turn of a rotary axis from block to block beyond which it is told.

    Raises
    ------
    FormatError
        If the file is no text.
    """
    content = read_bytes(path, limits)
    lines = program_lines(path, content, limits)
    defects = Defects(path)
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        defects.fail(FORM, "the text is UTF-16, which no control reads; save it as ASCII")
    _check_text(defects, lines, line_length)
    _check_percent(defects, lines)
    blocks = CheckedBlocks(defects, decimal_mark(lines), rotary_step_deg)
    for number, line in enumerate(lines, 1):
        if blocks.take(line, number):
            break
    blocks.finish(last_line(lines))
    return defects.findings()


def _check_text(defects: Defects, lines: Sequence[str], line_length: int) -> None:
    for number, line in enumerate(lines, 1):
        if len(line) > line_length:
            defects.fail(FORM, f"the line has {len(line)} characters, more than {line_length}", number)
        if not line.isascii():
            odd = next(character for character in line if not character.isascii())
            defects.warn(FORM, f"{odd!r} is no ASCII character; controls may stop at it", number)
        if ("(" in line or ";" in line) and (found := _EXECUTED.search(_SIEMENS_MESSAGE.sub("", line))):
            word = (found[1] or found[2]).upper()
            defects.warn(COMMENT, f"a comment that begins with {word} is executed by LinuxCNC", number)


def _check_percent(defects: Defects, lines: Sequence[str]) -> None:
    """See that lines of a single % stand at both ends of the program or nowhere."""
    marks = [number for number, line in enumerate(lines, 1) if line.strip() == "%"]
    if not marks:
        return
    first = next(number for number, line in enumerate(lines, 1) if line.strip())
    if len(marks) == 1:
        where = "end" if marks[0] == first else "beginning"
        defects.warn(FORM, f"a % without its counterpart at the {where} of the program", marks[0])
    elif len(marks) > 2:
        defects.fail(FORM, "a third %: two programs in one file", marks[2])
    elif marks[0] != first:
        defects.warn(FORM, "text before the first %, which controls do not read", first)
