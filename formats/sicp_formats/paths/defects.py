"""What checkers find in the text of a program: one finding for each place, until there are too many of a kind."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level

__all__ = ["Check", "Defects", "check_characters", "last_line"]

_MOST = 5
_NUMBER = re.compile(r"[0-9.]+")


class Check(IntEnum):
    """Codes of what is wrong with programs other than G-code and VAL3: the kind of defect, in whatever language."""

    FORM = 880
    NAMES = 881
    SYMBOLS = 882
    SPEED = 883
    ZONE = 884
    ORIENTATION = 885
    TOOL = 886
    UNITS = 887
    WORDS = 888
    TEXT = 889


@dataclass(slots=True)
class Defects:
    """The defects of one file.

    >>> defects = Defects(Path("a.nc"))
    >>> defects.fail(875, "F0: a cut without feed", 3)
    >>> defects.findings()[0].where
    'a.nc, line 3'
    """

    path: Path
    _found: list[Finding] = field(default_factory=list)
    _counts: dict[tuple[int, str], int] = field(default_factory=dict)
    _last: dict[tuple[int, str], int] = field(default_factory=dict)

    def fail(self, code: int, message: str, line: int = 0) -> None:
        """Note what forbids to run the program."""
        self._note(code, Level.FAIL, message, line)

    def warn(self, code: int, message: str, line: int = 0) -> None:
        """Note what somebody should look at."""
        self._note(code, Level.WARN, message, line)

    def info(self, code: int, message: str, line: int = 0) -> None:
        """Note what is worth knowing."""
        self._note(code, Level.INFO, message, line)

    def findings(self) -> tuple[Finding, ...]:
        """Return all of them by code and place; the last one told of a kind says how many more there are."""
        found = list(self._found)
        for key, at in self._last.items():
            more = self._counts[key] - _MOST
            if more > 0:
                one = found[at]
                found[at] = Finding(one.code, one.level, f"{one.message} (and {more} more like this)", one.where)
        return tuple(sorted(found, key=lambda finding: finding.code))

    def _note(self, code: int, level: Level, message: str, line: int) -> None:
        """Keep a defect; those whose texts differ in numbers only are of one kind."""
        kind = (code, _NUMBER.sub("0", message))
        self._counts[kind] = self._counts.get(kind, 0) + 1
        if self._counts[kind] > _MOST:
            return
        self._last[kind] = len(self._found)
        name = printable(str(self.path))
        self._found.append(Finding(int(code), level, printable(message, 300), f"{name}, line {line}" if line else name))


def check_characters(defects: Defects, lines: Sequence[str], line_length: int | None = None) -> None:
    """Note characters that controllers may stop at, and lines longer than a length."""
    for number, line in enumerate(lines, 1):
        if not line.isascii():
            odd = next(character for character in line if not character.isascii())
            defects.warn(Check.TEXT, f"{odd!r} is no ASCII character; controllers may stop at it", number)
        if line_length is not None and len(line) > line_length:
            defects.fail(Check.TEXT, f"the line has {len(line)} characters, more than {line_length}", number)


def last_line(lines: Sequence[str]) -> int:
    """Return the 1-based number of the last line that is not blank.

    >>> last_line(["M30", "%", ""])
    2
    """
    return next((number for number in range(len(lines), 0, -1) if lines[number - 1].strip()), 1)
