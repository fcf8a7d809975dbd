"""What a controller is asked for: verbs, flags, and what it may say of the path as a whole.

The verbs are those that RoboDK's users know: start, frame, tool, speed, zone, move_joint, move_linear, output, comment,
finish, and some between them. `template.LinePostprocessor` asks them in their order.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from typing import ClassVar

import numpy as np

from sicp_cam.model import Event, EventKind, FloatArray, Program, ToolPath
from sicp_postprocessors.base import Postprocessor
from sicp_postprocessors.moves import Moves, divided_at_retracts, events_in_order
from sicp_postprocessors.text import ascii_lines, file_stem

__all__ = ["Verbs"]


class Verbs(Postprocessor):
    """The words of a controller, and what it can do.

    Verbs return lines without line ends, in printable ASCII, and are pure: they keep nothing. Most have an answer
    already: none.
    """

    line_end: ClassVar[str] = "\n"
    comment_drop: ClassVar[str] = ""
    """Characters that a comment may not hold, such as those that end it."""
    written_events: ClassVar[frozenset[EventKind]] = frozenset(EventKind) - {EventKind.OTHER}
    straight_rapids: ClassVar[bool] = False
    """True: rapid moves are straight, at a speed of `feeds_mm_min`; only the first move may go any way in space."""
    modal_speed: ClassVar[bool] = False
    """True: a feed holds until the next, and `speed` states it; False: moves state their feed themselves."""
    modal_zone: ClassVar[bool] = False
    """True: a zone holds until the next, and `zone` states it."""

    # --- the verbs, in the order in which they are asked ---

    def start(self, program: Program) -> Iterable[str]:
        """Return the lines that must stand before the head."""
        return ()

    @abstractmethod
    def comment(self, text: str) -> str:
        """Return the line of a comment; `text` is one line of printable ASCII, without `comment_drop`."""

    def setup(self, program: Program) -> Iterable[str]:
        """Return the lines after the head, such as modes."""
        return ()

    def frame(self, program: Program) -> Iterable[str]:
        """Return the lines that choose the frame of the coordinates, see `Program.T_scan_program`."""
        return ()

    def tool(self, number: int, text: str, *, first: bool) -> Iterable[str]:
        """Return the lines that take a tool; `first` where the program begins with one that no event names (-1)."""
        return ()

    def speed(self, feed_mm_min: float) -> Iterable[str]:
        """Return the lines of a feed that holds from here on; for `modal_speed` only."""
        return ()

    def zone(self, radius_mm: float) -> Iterable[str]:
        """Return the lines of a zone that holds from here on, 0 to come to rest; for `modal_zone` only."""
        return ()

    @abstractmethod
    def move_joint(self, moves: Moves) -> Sequence[str]:
        """Return one text for each move of which the end alone matters: rapid moves, or the first one of a robot."""

    @abstractmethod
    def move_linear(self, moves: Moves) -> Sequence[str]:
        """Return one text for each straight move; a text may have several lines."""

    def spindle(self, rev_min: float) -> Iterable[str]:
        """Return the lines of a spindle speed: positive clockwise, negative counter-clockwise, 0 off."""
        return ()

    def coolant(self, on: bool) -> Iterable[str]:
        """Return the lines that switch coolant or extraction."""
        return ()

    def output(self, signal: str, on: bool) -> Iterable[str]:
        """Return the lines that switch an output, by the name that the controller knows it by."""
        return ()

    def pause(self, seconds: float) -> Iterable[str]:
        """Return the lines of a dwell."""
        return ()

    def stop(self, text: str) -> Iterable[str]:
        """Return the lines of a stop that the operator ends."""
        return ()

    def remark(self, text: str) -> Iterable[str]:
        """Return the lines of a comment of the path, where they are not those of any comment."""
        return self.comments(text)

    def finish(self, program: Program) -> Iterable[str]:
        """Return the lines after the last move, event and switching off."""
        return ()

    # --- what a verb may use, and what a post may say of the path as a whole ---

    def comments(self, text: str) -> list[str]:
        """Return text as comment lines: made plain, broken where it is long; none if nothing is left of it."""
        return [self.comment(line) for line in ascii_lines(text, drop=self.comment_drop)]

    def remarks(self, program: Program) -> Iterable[str]:
        """Return what the head says beyond name, notes and safety line; text of any length."""
        return ()

    def targets(self, program: Program) -> FloatArray:
        """Return what only the path as a whole tells of each move, one row a move: by default the axes (n, 3).

        Angles that must not jump, the number of a point in its array: the verbs of motion find their rows in `Moves`.
        """
        return program.path.axes

    def feeds_mm_min(self, path: ToolPath) -> FloatArray:
        """Return the speed of each move (n,)."""
        return path.feeds_mm_min

    def zones_mm(self, path: ToolPath) -> FloatArray:
        """Return how far from its target each move may bend into the next (n,)."""
        return np.zeros(len(path))

    def pose_in_world(self, program: Program) -> FloatArray:
        """Return the pose (4, 4) of the program frame in the machine's world, in which a work box stands."""
        return np.eye(4)

    def events(self, program: Program) -> list[Event]:
        """Return the events in order, as the controller is told of them."""
        return events_in_order(program.path)

    def stops_spindle(self, event: Event) -> bool:
        """Say whether the machine stops the spindle at an event that does not say so itself, such as a tool change."""
        return False

    def switched(self, event: Event) -> tuple[str, bool] | None:
        """Return the output that an event of kind OTHER switches, and how; None if it switches none."""
        return None

    def longest_program(self) -> int | None:
        """Return the most moves of a program, by the option `max_moves_per_program`; None where there is no limit."""
        longest: int | None = getattr(self.options, "max_moves_per_program", None)
        return longest

    def parts(self, path: ToolPath) -> list[range]:
        """Return the moves of each program, by the options `max_moves_per_program` and `split_cuts` if it has them."""
        longest = self.longest_program()
        if longest is None:
            return [range(len(path))]
        return divided_at_retracts(path.rapid, longest, within_cuts=getattr(self.options, "split_cuts", False))

    def assemble(self, lines: Iterable[str]) -> Iterable[str]:
        """Return the lines as they stand in a file; the place for line numbers."""
        return lines

    def program_name(self, program: Program) -> str:
        """Return the name of the program as the controller takes it."""
        return file_stem(program.name)
