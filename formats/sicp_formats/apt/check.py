"""Check the text of an APT program: units, multi-axis mode, feeds, rapid moves, tool, end."""

from __future__ import annotations

from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.apt.arguments import split_arguments
from sicp_formats.apt.refusals import switches_on
from sicp_formats.apt.statements import COMMENT, statements
from sicp_formats.paths.defects import Check, Defects, check_characters, last_line
from sicp_formats.paths.text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["check"]

_ENDS = ("FINI", "END", "END-OF-PATH")
_MOVES = ("GOTO", "GODLTA", "FROM", "GOHOME", "TLON,GOFWD")
_TOOLS = ("LOADTL", "LOAD", "TURRET", "TOOLNO", "SELECT")


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS, line_length: int | None = None) -> tuple[Finding, ...]:
    """Check an APT or CL program: UNITS, MULTAX, FEDRAT, RAPID, LOADTL, FINI.

    Parameters
    ----------
    path
        The file.
    limits
        Caps on it.
    line_length
        Longest line that its post takes, in characters; any if left out.

    Raises
    ------
    FormatError
        If the file is no text, or a statement is cut short.
    """
    lines = program_lines(path, read_bytes(path, limits), limits)
    defects = Defects(path)
    check_characters(defects, lines, line_length)
    program = _Program(defects)
    for line, word, arguments in statements(path, lines):
        program.take(line, word, arguments)
        if program.ended:
            break
    program.finish(last_line(lines))
    return defects.findings()


class _Program:
    """What the statements so far have said."""

    def __init__(self, defects: Defects) -> None:
        self.ended = False
        self._defects = defects
        self._feed = self._units = self._several_axes = self._tool = False
        self._moved = 0
        self._rapid = 0
        self._cut_before_tool = 0
        self._axes_before = 0

    def take(self, line: int, word: str, arguments: str) -> None:
        """Check one statement."""
        if word in _MOVES:
            self._move(line, word, arguments)
        elif word == "RAPID":
            self._rapid = line
        elif word == "FEDRAT":
            self._take_feed(line, arguments)
        elif word in ("UNITS", "UNIT"):
            if self._moved and not self._units:
                self._defects.warn(Check.UNITS, f"{word} comes after the first move in line {self._moved}", line)
            self._units = True
        elif word == "MULTAX":
            self._several_axes = switches_on(arguments)
        elif word in _TOOLS:
            if self._cut_before_tool and not self._tool:
                self._defects.warn(Check.TOOL, "cuts before the first tool is loaded", self._cut_before_tool)
            self._tool = True
        elif word in _ENDS:
            self.ended = True
        elif word != COMMENT:
            return

    def finish(self, last: int) -> None:
        """Judge what only the whole program shows."""
        if not self.ended:
            self._defects.warn(Check.FORM, "the program has no end (FINI); is the file complete?", last)
        if self._rapid:
            self._defects.warn(Check.WORDS, "RAPID without a move behind it", self._rapid)
        if self._axes_before:
            what = "points with a tool axis while MULTAX is not on; posts may pass the axis over"
            self._defects.warn(Check.WORDS, what, self._axes_before)

    def _move(self, line: int, word: str, arguments: str) -> None:
        cuts = not self._rapid and word not in ("FROM", "GOHOME")
        self._rapid = 0
        self._moved = self._moved or line
        if cuts and not self._feed:
            self._feed = True
            self._defects.warn(Check.SPEED, "the first cut comes before a feed (FEDRAT) is stated", line)
        if cuts and not self._tool:
            self._cut_before_tool = self._cut_before_tool or line
        if word == "GOTO" and arguments.count(",") == 5 and not self._several_axes:
            self._axes_before = self._axes_before or line

    def _take_feed(self, line: int, arguments: str) -> None:
        self._feed = True
        numbers, _ = split_arguments(arguments)
        if numbers and not numbers[0] > 0.0:
            self._defects.fail(Check.SPEED, f"FEDRAT/{numbers[0]:g}: a feed must be more than 0", line)
