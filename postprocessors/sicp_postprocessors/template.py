"""The template of controllers whose programs are lines: it walks along the path and asks for the words of each verb.

A post answers in words (see `verbs`); order, checks, events, head, parts and plain text are seen to here.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from sicp_cam.errors import OutputError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, Event, EventKind, FloatArray, Program, ToolPath
from sicp_postprocessors.base import SAFETY_NOTE, failures, head_remarks
from sicp_postprocessors.checks import event_findings, first_move_findings, move_place, name_findings, spindle_findings
from sicp_postprocessors.moves import Moves, events_by_move, tools_in_use
from sicp_postprocessors.options import flag
from sicp_postprocessors.path_checks import PreflightOptions, path_findings
from sicp_postprocessors.verbs import Verbs

__all__ = ["LinePostprocessor", "Moves"]

_FEED_DECIMALS = 6
"""Feeds, in mm/min, that differ by less are one feed."""


class LinePostprocessor(Verbs):
    r"""Template of a controller that is told what to do by verbs; each verb answers with lines in printable ASCII.

    Verbs are pure: they keep nothing. `move_joint` and `move_linear` are asked once for all moves of their kind, as
    columns, and answer with one text for each move, which `rows.rows` formats in one go. Every other verb has an answer
    already, mostly none; `written_events` says which events the controller has words for, and the others are told as
    findings, because they would be lost. Here is a whole post.

    >>> from dataclasses import dataclass
    >>> from typing import Annotated
    >>> import numpy as np
    >>> from sicp_cam.model import EventKind, Program, Status, ToolPath
    >>> from sicp_cam.ranges import Between
    >>> from sicp_postprocessors.rows import rows
    >>> from sicp_postprocessors.text import ascii_line
    >>> class Linear(LinePostprocessor):
    ...     name = "linear"
    ...     summary = "LIN lines of a controller that does not exist"
    ...     suffix = ".lin"
    ...     modal_speed = True
    ...     written_events = frozenset({EventKind.COMMENT, EventKind.SPINDLE})
    ...
    ...     def start(self, program):
    ...         yield f"PROGRAM {ascii_line(program.name)}"
    ...
    ...     def comment(self, text):
    ...         return f"; {text}"
    ...
    ...     def speed(self, feed_mm_min):
    ...         yield f"SPEED {feed_mm_min:.1f}"
    ...
    ...     def move_joint(self, moves):
    ...         return rows("FAST {:.1} {:.1} {:.1}", *moves.tips_mm.T)
    ...
    ...     def move_linear(self, moves):
    ...         return rows("LIN {:.1} {:.1} {:.1}", *moves.tips_mm.T)
    ...
    ...     def spindle(self, rev_min):
    ...         yield f"SPINDLE {rev_min:.0f}"
    ...
    ...     def finish(self, program):
    ...         yield "END"
    >>> path = ToolPath(
    ...     tips_mm=[[0, 0, 50], [0, 0, 5], [9, 0, 5]],
    ...     axes=[[0, 0, 1]] * 3,
    ...     feeds_mm_min=[0, 600, 600],
    ...     rapid=[True, False, False],
    ...     lines=[1, 2, 3],
    ...     events=(Event(1, EventKind.SPINDLE, 9000.0),),
    ... )
    >>> status = (Status.APPROACH, Status.COVERED, Status.COVERED)
    >>> program = Program("edge", path, status, notes=("corrected to the scan of part 7",))
    >>> post = Linear()
    >>> post.preflight(program)
    []
    >>> for file, content in post.write(program).items():
    ...     print(file, content.decode(), sep="\n", end="")
    edge.lin
    PROGRAM edge
    ; edge
    ; corrected to the scan of part 7
    ; not a safety function: verify at reduced speed
    FAST 0.0 0.0 50.0
    SPINDLE 9000
    SPEED 600.0
    LIN 0.0 0.0 5.0
    LIN 9.0 0.0 5.0
    SPINDLE 0
    END
    """

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and those about name, first move, parts, lost events and the path."""
        path = program.path
        lost = set(EventKind) - self.written_events - {EventKind.OTHER}
        unknown = [e for e in path.events if e.kind is EventKind.OTHER and self.switched(e) is None]
        unwritten = {EventKind.OTHER} if EventKind.OTHER not in self.written_events else set()
        findings = [
            *super().preflight(program),
            *name_findings(program, self.program_name(program)),
            *first_move_findings(path),
            *spindle_findings(path, self.stops_spindle),
            *event_findings(path.events, lost, f"post {self.name} has no words for it"),
            *event_findings(unknown, unwritten, f"post {self.name} has no words for it"),
            *self._part_findings(path),
        ]
        if isinstance(self.options, PreflightOptions) and program.placed and not failures(findings):
            findings += path_findings(program, self.pose_in_world(program), self.options)
        return findings

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one file of the program.

        Raises
        ------
        OutputError
            If a verb answers with what is not printable ASCII on one line, with too few moves, or with comments that
            carry no text.
        """
        bodies = self.bodies(program)
        lines = [*self.opening(program), *(line for body in bodies for line in body), *self.closing(program)]
        return {self.program_name(program) + self.suffix: self.encoded(lines)}

    def opening(self, program: Program) -> list[str]:
        """Return everything before the first event or move."""
        if SAFETY_NOTE.lower() not in self.comment(SAFETY_NOTE).lower():
            raise OutputError(f"post {self.name} writes comments without their text; mend its comment verb")
        remarks = [*head_remarks(program), *self.remarks(program)]
        named = any(event.kind is EventKind.TOOL and event.before_move == 0 for event in program.path.events)
        return [
            *self.start(program),
            *(line for remark in remarks for line in self.comments(remark)),
            *self.setup(program),
            *self.frame(program),
            *(() if named else self.tool(-1, "", first=True)),
        ]

    def bodies(self, program: Program) -> list[list[str]]:
        """Return the lines of each part of the path: moves, and the events and changes of feed and zone before them."""
        path, parts = program.path, self.parts(program.path)
        joint = np.arange(len(path)) == 0 if self.straight_rapids else path.rapid
        moves = self._moves(program, parts, joint)
        texts = self._move_texts(moves, joint)
        before = self._lines_before(program, moves)
        places = sorted(before)
        bodies = [_woven(texts, before, places, part) for part in parts]
        bodies[-1] += before.get(len(path), [])
        return bodies

    def closing(self, program: Program) -> list[str]:
        """Return everything after the last move and event: what still runs is switched off."""
        last = {event.kind: event.value for event in self.events(program)}
        lines = list(self.spindle(0.0)) if last.get(EventKind.SPINDLE) else []
        lines += self.coolant(False) if last.get(EventKind.COOLANT) else []
        return [*lines, *self.finish(program)]

    def encoded(self, lines: Iterable[str]) -> bytes:
        """Return the lines of a file as bytes, all of them printable ASCII.

        Raises
        ------
        OutputError
            If one is not.
        """
        told = list(self.assemble(lines))
        text = "\n".join([*told, ""])
        if not (text.isascii() and text.replace("\n", "").isprintable() and text.count("\n") == len(told)):
            wrong = next(line for line in told if not (line.isascii() and line.isprintable()))
            raise OutputError(f"post {self.name} wrote a line that is not plain text: {printable(wrong)!r}; mend it")
        return (text if self.line_end == "\n" else text.replace("\n", self.line_end)).encode("ascii")

    def _moves(self, program: Program, parts: Sequence[range], joint: BoolArray) -> Moves:
        path = program.path
        feeds, zones, starts = self.feeds_mm_min(path), self.zones_mm(path), [part.start for part in parts]
        # A rapid move at the control's own speed leaves it open which feed holds behind it: that is stated again.
        feed_known = ~joint
        return Moves(
            np.arange(len(path)),
            path.tips_mm,
            path.axes,
            feeds,
            zones,
            path.rapid,
            tools_in_use(path),
            self.targets(program),
            _changes(feeds.round(_FEED_DECIMALS), starts, feed_known) & feed_known,
            _changes(zones, starts, np.ones(len(path), np.bool_)),
        )

    def _move_texts(self, moves: Moves, joint: BoolArray) -> list[str]:
        texts = np.empty(len(moves), dtype=object)
        for verb, which in ((self.move_joint, joint), (self.move_linear, ~joint)):
            asked = np.count_nonzero(which)
            answer = list(verb(moves.those(which))) if asked else []
            if len(answer) != asked:
                raise OutputError(f"post {self.name} wrote {len(answer)} texts for {asked} moves; mend {verb.__name__}")
            texts[which] = answer
        moves_as_text: list[str] = texts.tolist()
        return moves_as_text

    def _lines_before(self, program: Program, moves: Moves) -> dict[int, list[str]]:
        """Return the lines before each move, by its index; those after the last one stand at the number of moves."""
        lines = {move: list(self._told(events)) for move, events in events_by_move(self.events(program)).items()}
        if self.modal_zone:
            for move in np.flatnonzero(moves.states_zone).tolist():
                lines.setdefault(move, []).extend(self.zone(float(moves.zones_mm[move])))
        if self.modal_speed:
            for move in np.flatnonzero(moves.states_feed).tolist():
                lines.setdefault(move, []).extend(self.speed(float(moves.feeds_mm_min[move])))
        return lines

    def _told(self, events: Iterable[Event]) -> Iterator[str]:
        for event in events:
            if event.kind in self.written_events or event.kind is EventKind.OTHER:
                yield from self._event(event)

    def _event(self, event: Event) -> Iterable[str]:
        match event.kind:
            case EventKind.SPINDLE:
                return self.spindle(event.value)
            case EventKind.COOLANT:
                return self.coolant(event.value > 0)
            case EventKind.TOOL:
                return self.tool(int(event.value), event.text, first=False)
            case EventKind.DWELL:
                return self.pause(event.value)
            case EventKind.STOP:
                return self.stop(event.text)
            case EventKind.COMMENT:
                return self.remark(event.text)
        switched = self.switched(event)
        return () if switched is None else self.output(*switched)

    def _part_findings(self, path: ToolPath) -> list[Finding]:
        longest = self.longest_program()
        if longest is None or not len(path):
            return []
        part = max(self.parts(path), key=len)
        if len(part) <= longest:
            return []
        message = (
            f"{len(part)} moves without a retract stay in one program, more than max_moves_per_program = {longest}; "
            f"raise it if the controller takes them, or divide the cut with {flag(self.name, 'split_cuts', 'true')}"
        )
        return [Finding(653, Level.WARN, message, move_place(path, part.start, part.stop - 1))]


def _changes(values: FloatArray, starts: Sequence[int], known: BoolArray) -> BoolArray:
    """Return where a value differs from that of the move before, or nothing is known of that one (n,)."""
    changes = np.ones(len(values), np.bool_)
    changes[1:] = (values[1:] != values[:-1]) | ~known[:-1]
    changes[list(starts)] = True
    return changes


def _woven(texts: Sequence[str], before: dict[int, list[str]], places: Sequence[int], part: range) -> list[str]:
    """Return the texts of the moves of a part, with the lines that stand before some of them; `places` is in order."""
    lines: list[str] = []
    done = part.start
    for move in places[bisect_left(places, part.start) : bisect_left(places, part.stop)]:
        lines += [*_lines(texts[done:move]), *before[move]]
        done = move
    return [*lines, *_lines(texts[done : part.stop])]


def _lines(texts: Sequence[str]) -> list[str]:
    """Return the lines of the texts of moves, which may have several each."""
    return "\n".join(texts).split("\n") if texts else []
