"""What path readers may find on the way: the codes, their levels and texts, and the tally of one file."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level

__all__ = ["Notice", "Tally"]

_MOST_DETAILS = 10


class Notice(IntEnum):
    """Codes of the findings that path readers report."""

    UNIT_ASSUMED = 301
    FEED_MISSING = 302
    AXIS_ASSUMED = 303
    AXIS_NOT_UNIT = 304
    AXIS_ZERO = 305
    ARC_FLATTENED = 306
    POINT_REPEATED = 307
    WORD_UNKNOWN = 308
    SPINDLE_UNKNOWN = 309
    POSITION_UNKNOWN = 310
    BLOCK_SKIPPED = 311
    TEXT_AFTER_END = 312
    NO_TIP_CONTROL = 313
    DWELL_IN_MS = 314
    COLUMN_UNUSED = 315
    END_MISSING = 316
    FRAME_CHOSEN = 317
    HOME_LEFT_OUT = 318


_NOTICES = {
    Notice.UNIT_ASSUMED: (Level.WARN, "no length unit is stated, mm assumed; state it with --path-units"),
    Notice.FEED_MISSING: (
        Level.WARN,
        "{count} cutting moves have no feed; state one with --set path.feed_mm_min=...",
    ),
    Notice.AXIS_ASSUMED: (Level.WARN, "no tool axis is stated, (0, 0, 1) assumed for the whole path"),
    Notice.AXIS_NOT_UNIT: (Level.WARN, "{count} tool axes are not of length 1 and were scaled to it"),
    Notice.AXIS_ZERO: (Level.WARN, "{count} tool axes are (0, 0, 0); the axis of the move before was kept"),
    Notice.ARC_FLATTENED: (Level.INFO, "{count} arcs were cut into straight pieces; sense: {detail}"),
    Notice.POINT_REPEATED: (Level.WARN, "{count} moves go nowhere: same tip and same axis as the move before"),
    Notice.WORD_UNKNOWN: (Level.WARN, "{count} statements are not known and were kept as text: {detail}"),
    Notice.SPINDLE_UNKNOWN: (Level.WARN, "{count} spindle commands give no speed in rev/min and were kept as text"),
    Notice.POSITION_UNKNOWN: (
        Level.INFO,
        "{count} rapid moves before the first known position are not part of the path",
    ),
    Notice.BLOCK_SKIPPED: (
        Level.WARN,
        "{count} optional blocks (/) were left out; read them with --set path.block_skip=false",
    ),
    Notice.TEXT_AFTER_END: (Level.WARN, "{count} lines after the end of the program were not read"),
    Notice.NO_TIP_CONTROL: (
        Level.WARN,
        "rotary words without a word for tool tip control (G43.4, G43.5, G234, TRAORI); X Y Z were taken for the tip",
    ),
    Notice.DWELL_IN_MS: (Level.WARN, "{count} dwells G4 P without a decimal point were taken for milliseconds"),
    Notice.COLUMN_UNUSED: (Level.INFO, "columns that a path has no place for were not read: {detail}"),
    Notice.END_MISSING: (Level.INFO, "the program has no end statement; check that the file is complete"),
    Notice.FRAME_CHOSEN: (Level.WARN, "the file states a frame that is not that of the part: {detail}"),
    Notice.HOME_LEFT_OUT: (
        Level.WARN,
        "{count} rapid moves to or from a machine position (G28, G30, G53) are not part of the path",
    ),
}


@dataclass(slots=True)
class _Noted:
    line: int
    count: int = 0
    details: list[str] = field(default_factory=list)


@dataclass(slots=True)
class Tally:
    """How often each notice was met in one file, and where first.

    >>> tally = Tally()
    >>> tally.note(Notice.AXIS_ZERO, 7)
    >>> tally.note(Notice.AXIS_ZERO, 9)
    >>> tally.findings(Path("a.apt"))[0].message
    '2 tool axes are (0, 0, 0); the axis of the move before was kept'
    """

    noted: dict[Notice, _Noted] = field(default_factory=dict)

    def note(self, notice: Notice, line: int, detail: str = "", count: int = 1) -> None:
        """Count something worth a finding; its first line is kept, and each detail once."""
        noted = self.noted.setdefault(notice, _Noted(line))
        noted.count += count
        if detail and detail not in noted.details and len(noted.details) < _MOST_DETAILS:
            noted.details.append(detail)

    def findings(self, path: Path) -> tuple[Finding, ...]:
        """Return one finding for each kind of notice, in the order of their codes."""
        found = []
        for notice, noted in sorted(self.noted.items()):
            level, text = _NOTICES[notice]
            message = text.format(count=noted.count, detail=printable("; ".join(noted.details)))
            where = f"{printable(str(path))}, line {noted.line}" if noted.line else printable(str(path))
            found.append(Finding(int(notice), level, message, where))
        return tuple(found)
