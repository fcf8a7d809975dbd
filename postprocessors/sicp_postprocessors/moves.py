"""A path as a post walks along it: the moves one by one, and the events in their order."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sicp_cam.model import Event, Program, Status, ToolPath

__all__ = ["Move", "events_by_move", "events_in_order", "moves_of"]


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


def moves_of(program: Program, orientations: Sequence[str]) -> Iterator[Move]:
    """Return the moves of a program, each with its orientation words."""
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


def events_in_order(path: ToolPath) -> list[Event]:
    """Return the events as they come along the path; those before the same move keep their order."""
    return sorted(path.events, key=lambda event: event.before_move)


def events_by_move(path: ToolPath) -> dict[int, list[Event]]:
    """Return the events before each move; those after the last one stand at the number of moves."""
    events: dict[int, list[Event]] = defaultdict(list)
    for event in path.events:
        events[event.before_move].append(event)
    return events
