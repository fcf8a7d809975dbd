"""What a postprocessor is, and the template of those that write one line after the other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, ClassVar

from sicp_cam.errors import OutputError, PathError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, Program, Status, ToolPath
from sicp_postprocessors.checks import (
    common_findings,
    event_findings,
    first_move_findings,
    name_findings,
)
from sicp_postprocessors.options import NoOptions, build_options
from sicp_postprocessors.text import file_stem

__all__ = [
    "SAFETY_NOTE",
    "LinePostprocessor",
    "Move",
    "Postprocessor",
    "events_by_move",
    "events_in_order",
    "failures",
]

SAFETY_NOTE = "not a safety function: verify at reduced speed"
_NAMED_FAILURES = 5


def failures(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that forbid a program."""
    return [finding for finding in findings if finding.level is Level.FAIL]


def events_in_order(path: ToolPath) -> list[Event]:
    """Return the events as they come along the path; those before the same move keep their order."""
    return sorted(path.events, key=lambda event: event.before_move)


def events_by_move(path: ToolPath) -> dict[int, list[Event]]:
    """Return the events before each move; those after the last one stand at the number of moves."""
    events: dict[int, list[Event]] = defaultdict(list)
    for event in path.events:
        events[event.before_move].append(event)
    return events


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
    ...     def move(self, move, previous):
    ...         numbers = " ".join(fixed(v, self.options.decimals) for v in (*move.tip_mm, *move.axis))
    ...         yield f"FAST {numbers}" if move.rapid else f"LIN {numbers} {fixed(move.feed_mm_min, 1)}"
    ...
    ...     def event(self, event):
    ...         yield f"; {ascii_line(event.text)}"
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
    >>> program = Program("edge", path, (Status.APPROACH, Status.COVERED))
    >>> post = Linear({"decimals": "1"})
    >>> post.preflight(program)
    []
    >>> for file, content in post.write(program).items():
    ...     print(file, content.decode(), sep="\n", end="")
    edge.lin
    PROGRAM edge
    FAST 0.0 0.0 50.0 0.0 0.0 1.0
    LIN 0.0 0.0 5.0 0.0 0.0 1.0 600.0
    END
    """

    name: ClassVar[str]
    """Short name, as it stands in a job file."""
    summary: ClassVar[str]
    """One line for the list of plug-ins."""
    Options: ClassVar[type[Any]] = NoOptions
    """Frozen dataclass of the options, each with a default."""
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


@dataclass(frozen=True, slots=True)
class Move:
    """One move, as the hooks of `LinePostprocessor` see it."""

    index: int
    tip_mm: tuple[float, float, float]
    axis: tuple[float, float, float]
    feed_mm_min: float
    rapid: bool
    status: Status
    orientation: str
    """What `orientations` returned for this move."""


class LinePostprocessor(Postprocessor):
    """Template of a controller whose program is one file of lines: begin, then moves and events, then end.

    The hooks return lines without line ends, in printable ASCII; the example stands at `Postprocessor`.
    """

    suffix: ClassVar[str]
    """Suffix of the file, with its dot."""
    line_end: ClassVar[str] = "\n"
    written_events: ClassVar[frozenset[EventKind]] = frozenset(EventKind) - {EventKind.OTHER}
    """Kinds that the `event` hook is asked for; the others are told as findings, because they would be lost."""

    @abstractmethod
    def begin(self, program: Program) -> Iterable[str]:
        """Return the lines before the first event or move."""

    @abstractmethod
    def move(self, move: Move, previous: Move | None) -> Iterable[str]:
        """Return the lines of one move; `previous` is None for the first."""

    @abstractmethod
    def event(self, event: Event) -> Iterable[str]:
        """Return the lines of one event."""

    @abstractmethod
    def end(self, program: Program) -> Iterable[str]:
        """Return the lines after the last move and event."""

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
            If a hook returns a line that is not printable ASCII on one line.
        """
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
        previous = None
        for move in _moves(program, self.orientations(program)):
            yield from self._event_lines(events.get(move.index, []))
            yield from self.move(move, previous)
            previous = move
        yield from self._event_lines(events.get(len(program.path), []))
        yield from self.end(program)

    def _event_lines(self, events: Iterable[Event]) -> Iterator[str]:
        for event in events:
            if event.kind in self.written_events:
                yield from self.event(event)


def _moves(program: Program, orientations: Sequence[str]) -> Iterator[Move]:
    path = program.path
    columns = zip(
        path.tips_mm.tolist(),
        path.axes.tolist(),
        path.feeds_mm_min.tolist(),
        path.rapid.tolist(),
        program.status,
        orientations,
        strict=True,
    )
    for index, (tip, axis, feed, rapid, status, orientation) in enumerate(columns):
        yield Move(index, tuple(tip), tuple(axis), feed, rapid, status, orientation)
