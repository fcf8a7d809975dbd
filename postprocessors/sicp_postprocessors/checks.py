"""What every controller refuses or should hear about, as findings with the index of the move.

Codes: 601 empty path, 602 feed not valid, 603 feed missing, 604 axis not of unit length, 605 coordinate too large,
606 event not valid, 607 program frame not rigid, 608 column not valid, 609 name changed, 610 event not written,
611 begins with a cutting move, 612 program frame is not the scan frame, 613 cut with the spindle off, 653 cut longer
than a program. Posts of this package go on at 620 (G-code) and 630 (robots).
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import BoolArray, Event, EventKind, IntArray, Program, ToolPath
from sicp_cam.rigid_motion import is_rigid
from sicp_postprocessors.moves import events_in_order
from sicp_postprocessors.text import counted

__all__ = [
    "common_findings",
    "event_findings",
    "event_place",
    "first_move_findings",
    "frame_findings",
    "frame_name",
    "in_scan_frame",
    "move_place",
    "name_findings",
    "spindle_findings",
    "stretch_findings",
]

_AXIS_TOLERANCE = 1e-6
_SMALLEST_FEED = 1e-3
"""A feed below this, in mm/min, would be written as zero by some controller's format."""

_LARGEST = {EventKind.SPINDLE: 1e6, EventKind.TOOL: 99_999_999.0, EventKind.COOLANT: 1.0, EventKind.DWELL: 1e5}
_TOO_FAR = f"a coordinate is not within {DEFAULT_LIMITS.coordinate_mm:g} mm; check units"
_COLUMN_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")


def common_findings(program: Program, missing_feed: Level = Level.FAIL) -> list[Finding]:
    """Check what no controller can do without: moves, feeds, unit axes, sane numbers, events in their place.

    Parameters
    ----------
    program
        The program to be written.
    missing_feed
        Level of a cutting move without feed.
    """
    path = program.path
    if len(path) == 0:
        return [Finding(601, Level.FAIL, "the path has no moves; give a path with at least one", printable(path.name))]
    feeds = path.feeds_mm_min
    unusable = ~np.isfinite(feeds) | (feeds < 0)
    missing = ~path.rapid & ~unusable & (feeds < _SMALLEST_FEED)
    not_unit = ~(np.abs(np.linalg.norm(path.axes, axis=1) - 1.0) <= _AXIS_TOLERANCE)
    too_far = ~(np.abs(path.tips_mm).max(axis=1) <= DEFAULT_LIMITS.coordinate_mm)
    return [
        *stretch_findings(
            path, unusable, 602, Level.FAIL, "the feed is not a positive finite number; correct the path"
        ),
        *stretch_findings(
            path, missing, 603, missing_feed, "cutting move with feed 0; state one with --set path.feed_mm_min=..."
        ),
        *stretch_findings(path, not_unit, 604, Level.FAIL, "the tool axis is not of unit length; correct the path"),
        *stretch_findings(path, too_far, 605, Level.FAIL, _TOO_FAR),
        *_wrong_events(path),
        *_wrong_frame(program),
        *_wrong_columns(program),
    ]


def stretch_findings(path: ToolPath, where: BoolArray, code: int, level: Level, message: str) -> list[Finding]:
    """Return one finding for each unbroken run of moves that are marked in `where` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(np.int8)))
    runs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [Finding(code, level, message, move_place(path, first, end - 1)) for first, end in runs]


def move_place(path: ToolPath, first: int, last: int | None = None) -> str:
    """Return where moves stand, by 0-based index and source line: "move 3, line 12" or "moves 3 to 9, lines 12 to 18".

    Moves without a source line are named by their index only.
    """
    last = first if last is None else last
    lines = path.lines[first], path.lines[last]
    moves = f"move {first}" if first == last else f"moves {first} to {last}"
    if min(lines) <= 0:
        return moves
    return f"{moves}, line {lines[0]}" if lines[0] == lines[1] else f"{moves}, lines {lines[0]} to {lines[1]}"


def event_place(event: Event) -> str:
    """Return where an event stands, by the index of the move that it precedes and its source line."""
    return f"before move {event.before_move}" + (f", line {event.line}" if event.line > 0 else "")


def event_findings(events: Iterable[Event], kinds: set[EventKind], why: str) -> list[Finding]:
    """Return a warning for each different text of events of the given kinds, because the program does not hold them."""
    lost: dict[tuple[EventKind, str], list[Event]] = {}
    for event in events:
        if event.kind in kinds:
            lost.setdefault((event.kind, event.text), []).append(event)
    return [
        Finding(
            610,
            Level.WARN,
            f"{kind} {printable(text)!r} is not written: {why}" if text else f"{kind} is not written: {why}",
            event_place(left_out[0]) + (f", and {len(left_out) - 1} more" if len(left_out) > 1 else ""),
        )
        for (kind, text), left_out in lost.items()
    ]


def spindle_findings(path: ToolPath, stops_spindle: Callable[[Event], bool]) -> list[Finding]:
    """Refuse cuts with a spindle that ran and that a tool change has stopped.

    Parameters
    ----------
    path
        The path.
    stops_spindle
        Whether the machine stops the spindle at an event.
    """
    message = "cuts with the spindle off after a tool change; start the spindle in the path after the change"
    return [Finding(613, Level.FAIL, message, event_place(event)) for event in _not_restarted(path, stops_spindle)]


def _not_restarted(path: ToolPath, stops_spindle: Callable[[Event], bool]) -> list[Event]:
    """Return the events that stop a running spindle which does not start again before the next cut."""
    cuts = np.flatnonzero(~path.rapid)
    stopped: list[Event] = []
    runs, pending = False, None
    for event in events_in_order(path):
        if pending and _cut_between(cuts, pending.before_move, event.before_move):
            stopped.append(pending)
            pending = None
        if event.kind is EventKind.SPINDLE:
            runs, pending = event.value != 0, None
        elif runs and stops_spindle(event):
            runs, pending = False, event
    if pending and _cut_between(cuts, pending.before_move, len(path)):
        stopped.append(pending)
    return stopped


def _cut_between(cuts: IntArray, first: int, stop: int) -> bool:
    return bool(np.searchsorted(cuts, first) < np.searchsorted(cuts, stop))


def name_findings(program: Program, written: str) -> list[Finding]:
    """Tell that the program's name was made to fit the controller's rules."""
    if written == program.name:
        return []
    return [Finding(609, Level.INFO, f"the program {printable(program.name)!r} is written as {written!r}")]


def first_move_findings(path: ToolPath) -> list[Finding]:
    """Tell that a program starts with a cutting move, from wherever the machine then stands."""
    if len(path) == 0 or path.rapid[0]:
        return []
    message = "the path begins with a cutting move; bring the tool near its first point before the start"
    return [Finding(611, Level.INFO, message, move_place(path, 0))]


def in_scan_frame(program: Program) -> bool:
    """Say whether the coordinates are those of the scan; otherwise the program keeps the part's own."""
    return np.array_equal(program.T_scan_program, np.eye(4))


def frame_name(program: Program) -> str:
    """Return whose frame the coordinates are in: scan, part, or path where nothing was corrected."""
    if not program.corrected:
        return "path"
    return "scan" if in_scan_frame(program) else "part"


def frame_findings(program: Program, level: Level, remedy: str) -> list[Finding]:
    """Tell that the coordinates are not those of the scan, where the program cannot carry the frame itself."""
    if in_scan_frame(program):
        return []
    return [Finding(612, level, f"the coordinates are in the part frame, not in that of the scan; {remedy}")]


def _wrong_events(path: ToolPath) -> list[Finding]:
    findings = []
    for event in path.events:
        wrong = _wrong_event(event, len(path))
        if wrong:
            message = f"the {event.kind} event {wrong}; correct the path"
            findings.append(Finding(606, Level.FAIL, message, event_place(event)))
    return findings


def _wrong_event(event: Event, moves: int) -> str:
    if not 0 <= event.before_move <= moves:
        return f"stands outside the path of {counted(moves, 'move')}"
    if not math.isfinite(event.value):
        return "has a value that is not finite"
    if abs(event.value) > _LARGEST.get(event.kind, math.inf):
        return f"has a value beyond {_LARGEST[event.kind]:g}"
    if event.value < 0 and event.kind in (EventKind.TOOL, EventKind.DWELL, EventKind.COOLANT):
        return "has a negative value"
    if event.kind is EventKind.TOOL and event.value != int(event.value):
        return "has a tool number that is not whole"
    return ""


def _wrong_frame(program: Program) -> list[Finding]:
    if not is_rigid(program.T_scan_program):
        message = "the program frame is not a rigid motion (orthonormal, right-handed); correct the registration"
        return [Finding(607, Level.FAIL, message)]
    if np.abs(program.T_scan_program[:3, 3]).max() > DEFAULT_LIMITS.coordinate_mm:
        message = f"the program frame lies beyond {DEFAULT_LIMITS.coordinate_mm:g} mm; check units"
        return [Finding(605, Level.FAIL, message)]
    return []


def _wrong_columns(program: Program) -> list[Finding]:
    findings = []
    lower = Counter(name.lower() for name in program.columns)
    for name, column in program.columns.items():
        values = np.asarray(column)
        wrong = (
            "is not a plain name"
            if not _COLUMN_NAME.fullmatch(name) or lower[name.lower()] > 1
            else f"has {counted(values.size, 'number')} for {counted(len(program.path), 'move')}"
            if values.shape != (len(program.path),)
            else "holds numbers that are not finite or too large"
            if not (np.abs(values) <= DEFAULT_LIMITS.coordinate_mm).all()
            else ""
        )
        if wrong:
            findings.append(Finding(608, Level.FAIL, f"the column {printable(name)!r} {wrong}; correct it"))
    return findings
