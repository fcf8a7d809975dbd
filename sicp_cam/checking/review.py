"""Judge a path that was read back from a program: what holds for every format and every controller."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, EventKind, FloatArray, ToolPath

__all__ = ["ReviewLimits", "angles_deg", "place", "review"]

NO_CUT, FEED, AXIS_JUMP, AXIS_FLIP, SPINDLE_OFF, TOOL_WHILE_TURNING, SIZE = range(890, 897)
"""Codes of the findings."""

_TURNING_ON_THE_SPOT_MM = 10.0
_RETRACTS = 0.99  # cosine between a move and the tool axis
_SMALLEST_MM, _LARGEST_MM = 0.5, 50_000.0


@dataclass(frozen=True, slots=True)
class ReviewLimits:
    """What is still plausible.

    Parameters
    ----------
    feed_max_mm_min, feed_min_mm_min
        Feeds of cutting moves beyond these are told.
    axis_jump_deg
        Turn of the tool axis from one move to the next within 10 mm beyond which it is told.
    axis_flip_deg
        Turn of the tool axis from one move to the next at which nobody can say which way it goes.
    """

    feed_max_mm_min: float = 120_000.0
    feed_min_mm_min: float = 1.0
    axis_jump_deg: float = 30.0
    axis_flip_deg: float = 150.0


def review(path: ToolPath, limits: ReviewLimits, file: str) -> tuple[Finding, ...]:
    """Return what is wrong or odd with a path.

    Parameters
    ----------
    path
        The path as it was read.
    limits
        What is plausible.
    file
        Name of the program, for the places.
    """
    return tuple(
        sorted(
            (
                *_motion(path, file),
                *_feeds(path, limits, file),
                *_turns(path, limits, file),
                *_spindle(path, file),
            ),
            key=lambda finding: finding.code,
        )
    )


def place(path: ToolPath, move: int, file: str) -> str:
    """Return where a move is found: file, move, and line where there is one."""
    line = int(path.lines[move])
    return f"{printable(file)}, move {move}{f', line {line}' if line else ''}"


def angles_deg(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the (n,) angles between two times (n, 3) unit vectors, exact for small ones too.

    >>> angles_deg(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 1.0, 0.0]])).tolist()
    [90.0]
    """
    across = np.linalg.norm(np.cross(first, second), axis=1)
    angles: FloatArray = np.degrees(np.arctan2(across, np.sum(first * second, axis=1)))
    return angles


def _motion(path: ToolPath, file: str) -> Iterator[Finding]:
    name = printable(file)
    if path.rapid.all():
        yield Finding(NO_CUT, Level.WARN, "all moves are rapid; nothing is cut", name)
    span_mm = float(np.ptp(path.tips_mm, axis=0).max())
    if not _SMALLEST_MM <= span_mm <= _LARGEST_MM:
        yield Finding(SIZE, Level.WARN, f"the whole path spans {span_mm:.4g} mm; is the unit right?", name)


def _feeds(path: ToolPath, limits: ReviewLimits, file: str) -> Iterator[Finding]:
    feeds = path.feeds_mm_min
    stated = ~path.rapid & (feeds > 0.0)
    for beyond, word, limit in (
        (stated & (feeds > limits.feed_max_mm_min), "above", limits.feed_max_mm_min),
        (stated & (feeds < limits.feed_min_mm_min), "below", limits.feed_min_mm_min),
    ):
        if beyond.any():
            first = int(np.flatnonzero(beyond)[0])
            what = (
                f"{_counted(beyond)} with a feed {word} {limit:.6g} mm/min, the first {feeds[first]:.6g}; is the unit"
                " of the feed right?"
            )
            yield Finding(FEED, Level.WARN, what, place(path, first, file))


def _turns(path: ToolPath, limits: ReviewLimits, file: str) -> Iterator[Finding]:
    turned = angles_deg(path.axes[:-1], path.axes[1:])
    far = np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1)
    cuts = ~path.rapid[1:]
    flips = turned >= limits.axis_flip_deg
    jumps = cuts & ~flips & (turned > limits.axis_jump_deg) & (far < _TURNING_ON_THE_SPOT_MM)
    for which, code, level, what in (
        (flips & cuts, AXIS_FLIP, Level.FAIL, "cuts turn the tool over"),
        (flips & ~cuts, AXIS_FLIP, Level.WARN, "rapid moves turn the tool over"),
        (jumps, AXIS_JUMP, Level.WARN, "cuts turn the tool on the spot"),
    ):
        if which.any():
            first = int(np.flatnonzero(which)[0])
            told = f"{what}: {_counted(which)}, the first by {turned[first]:.1f} degrees within {far[first]:.4g} mm"
            yield Finding(code, level, told, place(path, first + 1, file))


def _spindle(path: ToolPath, file: str) -> Iterator[Finding]:
    """Judge spindle and tool, where the program speaks of its spindle at all."""
    changes, speed = [(0, 0.0)], 0.0
    for event in path.events:
        if event.kind is EventKind.TOOL and speed:
            what = f"the tool is changed (to {event.value:g}) while the spindle turns"
            where = f"{printable(file)}{f', line {event.line}' if event.line else ''}"
            yield Finding(TOOL_WHILE_TURNING, Level.WARN, what, where)
        if event.kind is EventKind.SPINDLE:
            speed = event.value
            changes.append((event.before_move, speed))
    if len(changes) == 1:
        return
    starts = np.array([move for move, _ in changes])
    speeds = np.array([value for _, value in changes])
    running = np.searchsorted(starts, np.arange(len(path)), side="right") - 1
    still = _cutting(path) & (speeds[running] == 0.0)
    begun = int(starts[speeds != 0.0][0]) if speeds.any() else len(path)
    for which, level, when in (
        (still & (np.arange(len(path)) < begun), Level.WARN, "before the spindle is switched on"),
        (still & (np.arange(len(path)) >= begun), Level.FAIL, "while the spindle is switched off"),
    ):
        if which.any():
            first = int(np.flatnonzero(which)[0])
            yield Finding(SPINDLE_OFF, level, f"{_counted(which)} at feed {when}", place(path, first, file))


def _cutting(path: ToolPath) -> BoolArray:
    """Return the feed moves that lead somewhere, without those that only retract along the tool axis."""
    way = np.diff(path.tips_mm, axis=0, prepend=path.tips_mm[:1])
    length = np.linalg.norm(way, axis=1)
    back = np.sum(way * path.axes, axis=1) > _RETRACTS * length
    cutting: BoolArray = ~path.rapid & (length > 0.0) & ~back
    return cutting


def _counted(which: BoolArray) -> str:
    count = int(np.count_nonzero(which))
    return f"{count} move{'' if count == 1 else 's'}"
