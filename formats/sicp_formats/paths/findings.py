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
    ARC_AS_POINTS = 320
    AXIS_NOT_WRITTEN = 321
    NOT_REWRITTEN = 322
    COMPENSATION_KEPT = 323
    CYCLE_AS_POINTS = 324
    BLOCKS_LEFT_AS_THEY_WERE = 325
    ROTARY_TURNS_FURTHER = 326
    AXIS_NOT_IN_FORCE = 327
    WHOLE_NUMBERS = 328
    NO_CURVE = 330
    SURFACE_LEFT_OUT = 331
    LAYER_LEFT_OUT = 332
    CURVE_REPEATED = 333
    ENDS_APART = 334
    JOINTS_LEFT_OUT = 335
    EXTERNAL_AXES = 336
    CONDITION_LEFT_OUT = 337
    CALL_LEFT_OUT = 338
    TEXT_READ_AS = 339
    LAST_STATEMENT_DROPPED = 350
    STATEMENT_AS_TEXT = 351
    PADDING_DROPPED = 352
    BLOCKS_RESTART = 355
    FEED_PUT_ASIDE = 356
    FEED_IN_INCHES = 357
    DRAWING_REPAIRED = 360
    COUNT_IGNORED = 361
    CURVE_LEFT_OUT = 362
    VALUE_REPLACED = 363
    DRAWING_LARGE = 364
    NO_RETRACT = 366


_NOTICES = {
    Notice.UNIT_ASSUMED: (Level.WARN, "no length unit is stated, mm assumed; state it with --path-units"),
    Notice.FEED_MISSING: (
        Level.WARN,
        "{count} cutting moves have no feed{detail}; state one with --set path.feed_mm_min=...",
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
    Notice.ARC_AS_POINTS: (Level.INFO, "{count} arcs were moved or bent, and were written as points"),
    Notice.AXIS_NOT_WRITTEN: (
        Level.WARN,
        "the program states no tool axis, so none was written: the correction would turn it by up to {detail} degrees",
    ),
    Notice.NOT_REWRITTEN: (
        Level.FAIL,
        "the program cannot be written again in its own words: {detail}; use another post",
    ),
    Notice.COMPENSATION_KEPT: (
        Level.WARN,
        "{count} statements switch cutter compensation on and were kept as text: "
        "the control will shift the path by the tool's radius",
    ),
    Notice.CYCLE_AS_POINTS: (
        Level.WARN,
        "{count} drilling cycles were kept as text, and their positions read as points of the path",
    ),
    Notice.LAST_STATEMENT_DROPPED: (
        Level.WARN,
        "the last statement is cut short and was dropped; check where the path ends",
    ),
    Notice.STATEMENT_AS_TEXT: (
        Level.WARN,
        "{count} damaged statements that move nothing were kept as text: {detail}",
    ),
    Notice.PADDING_DROPPED: (
        Level.WARN,
        "{count} NUL bytes at the end of the file were dropped; is the path complete?",
    ),
    Notice.BLOCKS_LEFT_AS_THEY_WERE: (
        Level.WARN,
        "{count} blocks with coordinates are not part of the path (optional, or after the end): they were left as they "
        "were and are not corrected",
    ),
    Notice.ROTARY_TURNS_FURTHER: (
        Level.WARN,
        "{count} blocks turn a rotary axis by more than 10 degrees further than before, as near the pole: {detail}",
    ),
    Notice.AXIS_NOT_IN_FORCE: (
        Level.WARN,
        "{count} moves stand where the program states no tool axis, so none was written there: the correction would "
        "turn it by up to {detail} degrees",
    ),
    Notice.BLOCKS_RESTART: (
        Level.WARN,
        "the block numbers go back {count} times; the file was read on as one program: check that it is one",
    ),
    Notice.WHOLE_NUMBERS: (
        Level.WARN,
        "{count} blocks have coordinates without a decimal point, which were read as whole units; a control with "
        "least-increment input takes them for thousandths: say which with --set path.integers=units or thousandths",
    ),
    Notice.FEED_PUT_ASIDE: (
        Level.WARN,
        "{count} feeds under G70, of which the unit is not known, were not read; path.feed_mm_min took their place",
    ),
    Notice.FEED_IN_INCHES: (
        Level.WARN,
        "feeds under G70 were read as inch/min; a Siemens control takes them in the machine's unit: state G700 there",
    ),
    Notice.JOINTS_LEFT_OUT: (
        Level.WARN,
        "{count} moves to joint angles before the first or after the last known point are not part of the path",
    ),
    Notice.EXTERNAL_AXES: (Level.WARN, "external axes move along the path; points were kept as they stand"),
    Notice.CONDITION_LEFT_OUT: (
        Level.WARN,
        "{count} conditions and loops without motion in them were not executed: {detail}",
    ),
    Notice.CALL_LEFT_OUT: (
        Level.WARN,
        "{count} calls were taken to move nothing, as --set path.calls=... says: {detail}",
    ),
    Notice.TEXT_READ_AS: (Level.INFO, "the suffix does not tell what the text is; it was read as {detail}"),
    Notice.NO_RETRACT: (
        Level.WARN,
        "a drawing tells no way to its curves: {count} rapid moves run straight at the height of the drawing, and "
        "nothing retracts at the end; lift them with --set path.clearance_mm=...",
    ),
    Notice.NO_CURVE: (Level.INFO, "{count} entities of the drawing are no curves and were not read: {detail}"),
    Notice.SURFACE_LEFT_OUT: (
        Level.WARN,
        "{count} surfaces, solids and unknown entities were not read, a path is made of curves: {detail}",
    ),
    Notice.LAYER_LEFT_OUT: (Level.INFO, "{count} entities are hidden or not asked for and were not read: {detail}"),
    Notice.CURVE_REPEATED: (Level.WARN, "{count} curves lie on top of others and were left out: {detail}"),
    Notice.ENDS_APART: (
        Level.WARN,
        "{count} ends of curves have another end near and were not joined to it, {detail}; "
        "join them with a larger path.gap_mm",
    ),
    Notice.DRAWING_REPAIRED: (Level.WARN, "the drawing is damaged, {count} flaws were repaired: {detail}"),
    Notice.COUNT_IGNORED: (
        Level.WARN,
        "{count} polylines state another number of corners than they have; those that are there were read",
    ),
    Notice.CURVE_LEFT_OUT: (Level.WARN, "{count} curves that lead nowhere were left out: {detail}"),
    Notice.VALUE_REPLACED: (Level.WARN, "{count} values that cannot be were replaced: {detail}"),
    Notice.DRAWING_LARGE: (
        Level.WARN,
        "the drawing has {count} entities and takes long to read; save the layer of the path alone",
    ),
}

_GRAVE = {
    Notice.END_MISSING: (
        Level.WARN,
        "the program has no end statement and ends in a cut{detail}; check that the file is complete",
    ),
}
"""What is said in place of that where a notice was taken as grave."""


@dataclass(slots=True)
class _Noted:
    line: int
    count: int = 0
    details: list[str] = field(default_factory=list)
    grave: bool = False


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

    def note(self, notice: Notice, line: int, detail: str = "", count: int = 1, *, grave: bool = False) -> None:
        """Count something worth a finding; its first line is kept, and each detail once. Grave is grave for good."""
        noted = self.noted.setdefault(notice, _Noted(line))
        noted.grave = noted.grave or grave
        noted.count += count
        if detail and detail not in noted.details and len(noted.details) < _MOST_DETAILS:
            noted.details.append(detail)

    def findings(self, path: Path) -> tuple[Finding, ...]:
        """Return one finding for each kind of notice, in the order of their codes."""
        found = []
        for notice, noted in sorted(self.noted.items()):
            level, text = (_GRAVE if noted.grave else _NOTICES)[notice]
            message = text.format(count=noted.count, detail=printable("; ".join(noted.details)))
            where = f"{printable(str(path))}, line {noted.line}" if noted.line else printable(str(path))
            found.append(Finding(int(notice), level, message, where))
        return tuple(found)
