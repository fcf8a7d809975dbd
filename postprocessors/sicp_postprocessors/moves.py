"""A path as a post sees it: moves of one kind as columns, events in their order, and where it may be divided."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sicp_cam.model import BoolArray, Event, EventKind, FloatArray, IntArray, ToolPath

__all__ = ["Moves", "divided_at_retracts", "events_by_move", "events_in_order", "tools_in_use"]


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """Moves of one kind, in their order, as the verbs of `LinePostprocessor` see them: arrays of n rows.

    Parameters
    ----------
    index
        (n,) index of each move in the program.
    tips_mm, axes
        (n, 3) target of the tip, and unit vector from tip to holder, in the program frame.
    feeds_mm_min
        (n,) speed of the tip as `feeds_mm_min` gives it; 0 for rapid moves of controllers that have a speed for them.
    zones_mm
        (n,) distance from the target at which the move may bend into the next; 0 to come to rest there.
    rapid
        (n,) True where the tool does not cut.
    tools
        (n,) number of the tool in use, -1 where the path has not named any.
    targets
        (n, ...) what `targets` returned for these moves.
    states_feed, states_zone
        (n,) True where feed or zone differ from what holds before: the first move of its kind in a program file, and
        wherever they change.
    """

    index: IntArray
    tips_mm: FloatArray
    axes: FloatArray
    feeds_mm_min: FloatArray
    zones_mm: FloatArray
    rapid: BoolArray
    tools: IntArray
    targets: FloatArray
    states_feed: BoolArray
    states_zone: BoolArray

    def __len__(self) -> int:
        return len(self.index)

    def those(self, which: BoolArray | IntArray) -> Moves:
        """Return some of the moves, by a mask (n,) or by rows."""
        return Moves(*(getattr(self, name)[which] for name in self.__slots__))


def events_in_order(path: ToolPath) -> list[Event]:
    """Return the events as they come along the path; those before the same move keep their order."""
    return sorted(path.events, key=lambda event: event.before_move)


def events_by_move(events: Iterable[Event]) -> dict[int, list[Event]]:
    """Return the events before each move; those after the last one stand at the number of moves."""
    grouped: dict[int, list[Event]] = defaultdict(list)
    for event in events:
        grouped[event.before_move].append(event)
    return grouped


def tools_in_use(path: ToolPath) -> IntArray:
    """Return the number of the tool of each move (n,), -1 where the path has not named one yet."""
    tools = np.full(len(path), -1, np.int64)
    for event in events_in_order(path):
        if event.kind is EventKind.TOOL:
            tools[event.before_move :] = int(event.value)
    return tools


def divided_at_retracts(rapid: BoolArray, longest: int, *, within_cuts: bool) -> list[range]:
    """Divide the moves of a path into parts of at most `longest`, each of which but the first begins with a rapid move.

    Parameters
    ----------
    rapid
        (n,) True for rapid moves.
    longest
        Most moves of a part.
    within_cuts
        What becomes of a cut that is longer than that: True divides it, False keeps it whole in a part of its own.

    >>> rapid = np.array([1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0], bool)
    >>> divided_at_retracts(rapid, 4, within_cuts=False)
    [range(0, 3), range(3, 9), range(9, 11)]
    >>> divided_at_retracts(rapid, 4, within_cuts=True)
    [range(0, 3), range(3, 7), range(7, 11)]
    """
    retracts = np.flatnonzero(rapid)
    parts, start = [], 0
    while len(rapid) - start > longest:
        after = int(np.searchsorted(retracts, start + longest, side="right"))
        if after > 0 and retracts[after - 1] > start:
            stop = int(retracts[after - 1])
        elif within_cuts:
            stop = start + longest
        else:
            stop = int(retracts[after]) if after < len(retracts) else len(rapid)
        parts.append(range(start, stop))
        start = stop
    return [*parts, range(start, len(rapid))] if start < len(rapid) else parts
