"""Execute robot programs as far as they are plain: one statement after another, and calls of their own subprograms.

What would need the robot's controller - conditions, loops, expressions - is left out where it holds no motion, and
refused with its line where it does.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import EventKind
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["Language", "RobotError", "Runner", "Statement", "split_arguments", "without_strings"]

_STRING = re.compile(r'"[^"]*"?')
_NESTED = re.compile(r'["(){}]')
_CALLED = re.compile(r"(?:call[ \t]+)?([A-Za-z_][\w:]*)", re.ASCII)
_DEEPEST_CALL = 32
_STATEMENTS_A_POINT = 10


class RobotError(Exception):
    """What is wrong with a statement; the reader adds file and line."""


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement without its comment, and the 1-based line where it begins."""

    line: int
    text: str


@dataclass(frozen=True, slots=True)
class Language:
    """How a language marks its blocks.

    Parameters
    ----------
    opens, closes
        What a statement begins with that opens or closes a block; they nest.
    active
        True for a statement that may move the robot or leave the way of the program.
    """

    opens: re.Pattern[str]
    closes: re.Pattern[str]
    active: Callable[[str], bool]


class Runner:
    """Runs statements in order; a language derives from it and says what one statement does."""

    def __init__(self, moves: MoveList, language: Language, calls: frozenset[str]) -> None:
        self.moves = moves
        self._language = language
        self._moving_nothing = calls
        self._running: list[str] = []
        self._left = _STATEMENTS_A_POINT * moves.limits.path_points

    def execute(self, text: str, line: int) -> None:
        """Execute one statement that is no block."""
        raise NotImplementedError

    def block(self, file: Path, statements: Sequence[Statement]) -> None:
        """Execute a block from its opening to its closing statement: those without motion are left out."""
        first = statements[0]
        if any(self._is_active(each.text) for each in statements):
            told = printable(first.text, 40)
            raise RobotError(
                f"'{told}' decides about motion; loops and conditions are not executed: write the moves out"
            )
        self.moves.note(Notice.CONDITION_LEFT_OUT, first.line, printable(first.text, 40))
        for each in statements:
            self.forget(each.text)
            self.moves.event(EventKind.OTHER, each.line, 0.0, each.text)

    def forget(self, text: str) -> None:
        """Take it that a statement may or may not have been executed: what it sets is not known any more."""

    def run(self, file: Path, statements: Sequence[Statement]) -> None:
        """Execute statements in order.

        Raises
        ------
        FormatError
            With the line of the statement that cannot be executed.
        """
        at = 0
        while at < len(statements):
            statement = statements[at]
            try:
                self._count()
                if self._language.opens.match(statement.text):
                    end = self._block_end(statements, at)
                    self.block(file, statements[at : end + 1])
                    at = end
                elif self._language.closes.match(statement.text):
                    raise RobotError(f"'{printable(statement.text, 40)}' closes nothing; correct the program")
                else:
                    self.execute(statement.text, statement.line)
            except RobotError as problem:
                raise FormatError(file, str(problem), line=statement.line) from None
            at += 1

    def call(self, name: str, line: int, run: Callable[[], None] | None) -> None:
        """Execute a subprogram: one of the program's own, or one that the user says to move nothing."""
        if name.lower() in self._moving_nothing:
            self.moves.note(Notice.CALL_LEFT_OUT, line, printable(name, 40))
            self.moves.event(EventKind.OTHER, line, 0.0, f"call {name}")
            return
        if run is None:
            raise RobotError(
                f"'{printable(name, 40)}' is not in the program and may move the robot; "
                f"give it too, or say that it moves nothing with --set path.calls={printable(name, 40)}"
            )
        if name.lower() in self._running or len(self._running) >= _DEEPEST_CALL:
            raise RobotError(f"'{printable(name, 40)}' is called within itself, or calls are nested too deep")
        self._running.append(name.lower())
        run()
        self._running.pop()

    def unknown(self, text: str, line: int) -> None:
        """Keep a statement that is not known as an event, with a finding."""
        self.moves.note(Notice.WORD_UNKNOWN, line, printable(text, 40))
        self.keep(text, line)

    def keep(self, text: str, line: int) -> None:
        """Keep a statement as an event."""
        self.moves.event(EventKind.OTHER, line, 0.0, text)

    def _is_active(self, text: str) -> bool:
        called = _CALLED.match(text)
        known = called is not None and called[1].lower() in self._moving_nothing
        return self._language.active(text) and not known

    def _count(self) -> None:
        self._left -= 1
        if self._left < 0:
            raise RobotError("the loops of the program do not come to an end within the limit path_points; unroll them")

    def _block_end(self, statements: Sequence[Statement], start: int) -> int:
        depth = 0
        for at in range(start, len(statements)):
            text = statements[at].text
            depth += bool(self._language.opens.match(text)) - bool(self._language.closes.match(text))
            if depth == 0:
                return at
        raise RobotError(f"'{printable(statements[start].text, 40)}' is not closed; is the file complete?")


def split_arguments(text: str, mark: str = ",") -> list[str]:
    """Cut a list of arguments at its outermost commas, not within brackets or strings.

    >>> split_arguments('p[1,2], {1,2,3}, "a,b"')
    ['p[1,2]', '{1,2,3}', '"a,b"']
    """
    if not _NESTED.search(text):
        simple = [part.strip() for part in text.split(mark)]
        if all(part.count("[") == part.count("]") for part in simple):
            return simple
    parts, depth, start = [], 0, 0
    plain = without_strings(text)
    for place, character in enumerate(plain):
        if character in "([{":
            depth += 1
        elif character in ")]}":
            depth -= 1
        elif character == mark and depth == 0:
            parts.append(text[start:place].strip())
            start = place + 1
    return [*parts, text[start:].strip()]


def without_strings(text: str) -> str:
    """Return a text of the same length with every string, its quotes included, as underscores.

    >>> without_strings('f("a;b"); g')
    'f(_____); g'
    """
    return _STRING.sub(lambda found: "_" * len(found[0]), text) if '"' in text else text
