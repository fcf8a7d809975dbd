"""What a postprocessor is, and the template of those that write one line after the other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any, ClassVar

from sicp_cam.errors import OutputError, PathError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, Program
from sicp_postprocessors.checks import (
    common_findings,
    event_findings,
    first_move_findings,
    name_findings,
)
from sicp_postprocessors.moves import Move, events_by_move, moves_of
from sicp_postprocessors.options import NoOptions, build_options
from sicp_postprocessors.text import ascii_lines, file_stem

__all__ = ["SAFETY_NOTE", "LinePostprocessor", "Move", "Postprocessor", "failures", "head_remarks"]

SAFETY_NOTE = "not a safety function: verify at reduced speed"
_NAMED_FAILURES = 5


def failures(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that forbid a program."""
    return [finding for finding in findings if finding.level is Level.FAIL]


def head_remarks(program: Program) -> list[str]:
    """Return what the head of every program says: its name, what made it from what, and that it protects nobody."""
    return [program.name, *program.notes, *program.overridden, SAFETY_NOTE]


class Postprocessor(ABC):
    r"""Turns a program into the files of one controller.

    A post is pure: it touches no disk and no clock, and the same program gives the same bytes. Most controllers take
    lines of text, and need only the hooks of `LinePostprocessor`; here is a whole one.

    >>> from dataclasses import dataclass
    >>> import numpy as np
    >>> from sicp_cam.model import EventKind, Program, Status, ToolPath
    >>> from sicp_postprocessors.numbers import fixed
    >>> from sicp_postprocessors.text import ascii_line
    >>> @dataclass(frozen=True)
    ... class LinearOptions:
    ...     decimals: int = 3
    ...     '''Decimals of positions and axes.'''
    >>> class Linear(LinePostprocessor):
    ...     name = "linear"
    ...     summary = "LIN lines of a controller that does not exist"
    ...     Options = LinearOptions
    ...     suffix = ".lin"
    ...     written_events = frozenset({EventKind.COMMENT})
    ...
    ...     def begin(self, program):
    ...         yield f"PROGRAM {ascii_line(program.name)}"
    ...
    ...     def comment(self, text):
    ...         return f"; {text}"
    ...
    ...     def move(self, move, previous):
    ...         numbers = " ".join(fixed(v, self.options.decimals) for v in (*move.tip_mm, *move.axis))
    ...         yield f"FAST {numbers}" if move.rapid else f"LIN {numbers} {fixed(move.feed_mm_min, 1)}"
    ...
    ...     def event(self, event):
    ...         yield from self.comments(event.text)
    ...
    ...     def end(self, program):
    ...         yield "END"
    >>> path = ToolPath(
    ...     tips_mm=[[0, 0, 50], [0, 0, 5]],
    ...     axes=[[0, 0, 1], [0, 0, 1]],
    ...     feeds_mm_min=[0, 600],
    ...     rapid=[True, False],
    ...     lines=[1, 2],
    ... )
    >>> status = (Status.APPROACH, Status.COVERED)
    >>> program = Program("edge", path, status, notes=("corrected to the scan of part 7",))
    >>> post = Linear({"decimals": "1"})
    >>> post.preflight(program)
    []
    >>> for file, content in post.write(program).items():
    ...     print(file, content.decode(), sep="\n", end="")
    edge.lin
    PROGRAM edge
    ; edge
    ; corrected to the scan of part 7
    ; not a safety function: verify at reduced speed
    FAST 0.0 0.0 50.0 0.0 0.0 1.0
    LIN 0.0 0.0 5.0 0.0 0.0 1.0 600.0
    END
    """

    name: ClassVar[str]
    """Short name, as it stands in a job file."""
    summary: ClassVar[str]
    """One line for the list of plug-ins."""
    Options: ClassVar[type[Any]] = NoOptions
    """Frozen dataclass of the options: each field with a default, and under it a docstring that the user reads."""
    suffix: ClassVar[str] = ""
    """Suffix of the file that it writes, with its dot; none where a program is a folder."""
    missing_feed: ClassVar[Level] = Level.FAIL
    """How much a cutting move without feed matters to the controller."""
    options: Any
    """The options of this post, an instance of `Options`."""

    def __init__(self, options: Mapping[str, object] | None = None) -> None:
        """Take options by name; strings are converted to the type of their field.

        Raises
        ------
        JobError
            With every option that is unknown or does not fit.
        """
        self.options = build_options(self.name, self.Options, options or {})

    def preflight(self, program: Program) -> list[Finding]:
        """Return everything that the controller would refuse or that the operator should know, with move indices.

        A subclass adds to this list. A finding of level FAIL makes `write` raise.
        """
        return common_findings(program, self.missing_feed)

    def write(self, program: Program) -> dict[str, bytes]:
        """Return the files of a program: relative names with forward slashes, and their bytes.

        Raises
        ------
        PathError
            If `preflight` finds a failure.
        OutputError
            If the post itself makes a file that may not be written.
        """
        failed = failures(self.preflight(program))
        if failed:
            told = [f"{f.where}: {f.message}" if f.where else f.message for f in failed[:_NAMED_FAILURES]]
            more = [f"and {len(failed) - _NAMED_FAILURES} more"] if len(failed) > _NAMED_FAILURES else []
            raise PathError(f"post {self.name} refuses {printable(program.name)!r}: {'; '.join(told + more)}")
        files = self.files(program)
        for file in files:
            if not file or PurePosixPath(file).is_absolute() or ".." in PurePosixPath(file).parts or "\\" in file:
                raise OutputError(
                    f"post {self.name} names a file outside its folder: {printable(file)!r}; mend the post"
                )
        return files

    @abstractmethod
    def files(self, program: Program) -> dict[str, bytes]:
        """Return the files of a program that has passed `preflight`; called by `write` only."""


class LinePostprocessor(Postprocessor):
    """Template of a controller whose program is one file of lines: begin, head, setup, moves and events, end.

    The hooks return lines without line ends, in printable ASCII; the example stands at `Postprocessor`. The head is
    the template's own, so that name, notes and safety line stand in every program; a post gives it the comment syntax.
    """

    line_end: ClassVar[str] = "\n"
    comment_drop: ClassVar[str] = ""
    """Characters that a comment may not hold, such as those that end it."""
    written_events: ClassVar[frozenset[EventKind]] = frozenset(EventKind) - {EventKind.OTHER}
    """Kinds that the `event` hook is asked for; the others are told as findings, because they would be lost."""

    @abstractmethod
    def begin(self, program: Program) -> Iterable[str]:
        """Return the lines that must stand before the head."""

    @abstractmethod
    def comment(self, text: str) -> str:
        """Return the line of a comment; `text` is one line of printable ASCII, without `comment_drop`."""

    @abstractmethod
    def move(self, move: Move, previous: Move | None) -> Iterable[str]:
        """Return the lines of one move; `previous` is None for the first."""

    @abstractmethod
    def event(self, event: Event) -> Iterable[str]:
        """Return the lines of one event."""

    @abstractmethod
    def end(self, program: Program) -> Iterable[str]:
        """Return the lines after the last move and event."""

    def remarks(self, program: Program) -> Iterable[str]:
        """Return what the head says beyond name, notes and safety line; text of any length."""
        return ()

    def setup(self, program: Program) -> Iterable[str]:
        """Return the lines between the head and the first event or move, such as modes."""
        return ()

    def comments(self, text: str) -> list[str]:
        """Return text as comment lines: made plain, broken where it is long; none if nothing is left of it."""
        return [self.comment(line) for line in ascii_lines(text, drop=self.comment_drop)]

    def orientations(self, program: Program) -> Sequence[str]:
        """Return the orientation words of every move, for controllers that must see the path as a whole."""
        return [""] * len(program.path)

    def assemble(self, lines: Iterable[str]) -> Iterable[str]:
        """Return the lines as they stand in the file; the place for line numbers."""
        return lines

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and those about the name, the first move and the events left out."""
        left_out = set(EventKind) - self.written_events
        return [
            *super().preflight(program),
            *name_findings(program, file_stem(program.name)),
            *first_move_findings(program.path),
            *event_findings(program.path, left_out, f"post {self.name} has no words for it"),
        ]

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one file of the program.

        Raises
        ------
        OutputError
            If a hook returns a line that is not printable ASCII on one line, or the comments carry no text.
        """
        if SAFETY_NOTE.lower() not in self.comment(SAFETY_NOTE).lower():
            raise OutputError(f"post {self.name} writes comments without their text; mend its comment hook")
        lines = list(self.assemble(self._lines(program)))
        for line in lines:
            if not (line.isascii() and line.isprintable()):
                raise OutputError(f"post {self.name} wrote a line that is not plain text: {printable(line)!r}; mend it")
        return {
            file_stem(program.name) + self.suffix: "".join(f"{line}{self.line_end}" for line in lines).encode("ascii")
        }

    def _lines(self, program: Program) -> Iterator[str]:
        events = events_by_move(program.path)
        yield from self.begin(program)
        for remark in (*head_remarks(program), *self.remarks(program)):
            yield from self.comments(remark)
        yield from self.setup(program)
        previous = None
        for move in moves_of(program, self.orientations(program)):
            yield from self._event_lines(events.get(move.index, []))
            yield from self.move(move, previous)
            previous = move
        yield from self._event_lines(events.get(len(program.path), []))
        yield from self.end(program)

    def _event_lines(self, events: Iterable[Event]) -> Iterator[str]:
        for event in events:
            if event.kind in self.written_events:
                yield from self.event(event)
