"""Read tool paths from G-code: RS-274 of the usual controls, with tool orientation as vectors or rotary angles.

The reader executes motion only. What would need a control - variables, macros, cycles, cutter compensation, tilted
planes - is refused with its line, in the words that LinuxCNC uses where it has them.
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.gcode.axis import ROTARY_CHOICES
from sicp_formats.gcode.dialect import INTEGERS_CHOICES
from sicp_formats.gcode.program import GCodeOptions, execute
from sicp_formats.gcode.rewrite import GCodeOriginal
from sicp_formats.paths.moves import check_options
from sicp_formats.source import read_bytes

__all__ = ["read_path"]


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    rotary: str | None = None,
    block_skip: bool = True,
    decimal: str | None = None,
    integers: str | None = None,
) -> ToolPath:
    """Read a G-code program into a path in mm, mm/min and unit axes (tip to holder).

    X Y Z are the tool tip in the part frame, as posted for tool tip control (G43.4, TRAORI ...). The axis is (0, 0, 1)
    until a word states it: I J K under G43.5, A3= B3= C3=, or rotary angles if `rotary` says how to read them.

    Parameters
    ----------
    path
        The file.
    units
        Unit of a program that states none; must not contradict one that does.
    limits
        Caps on the file and the path.
    recover
        True to drop a last line that nothing ends if it moves nothing, to read on where block numbers go back, and to
        drop NUL bytes at the end of the file.
    feed_mm_min
        Feed for cutting moves that the program gives none, or one under G70 on a control on which F is not inch/min.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    rotary
        ``AC``, ``BC``, ``AB`` or ``BA``: the tilting and the carrying rotary axis of a head-head machine, in degrees,
        right-handed: n = R_second R_first z (see `gcode_axis.axis_from_angles`). Without it angles other than 0 are
        refused.
    block_skip
        True to leave out blocks that begin with a slash, False to read them.
    decimal
        Decimal mark, ``.`` or ``,``; by default the comma where all commas of the program can be nothing else.
    integers
        What a coordinate without a decimal point counts: ``units``, or ``thousandths`` (0.001 mm or degrees, 0.0001
        inch) as on controls with least-increment input. By default units, with a finding where that may be wrong.

    Raises
    ------
    FormatError
        With the line, if a block cannot be understood or must not be guessed at.
    UnitError
        If `units` is unknown or contradicts the program.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if rotary is not None and rotary not in ROTARY_CHOICES:
        raise JobError(f"path.rotary = {rotary!r} must be one of {', '.join(ROTARY_CHOICES)}")
    if decimal not in (None, ".", ","):
        raise JobError(f"path.decimal = {decimal!r} must be . or ,")
    if integers not in (None, *INTEGERS_CHOICES):
        raise JobError(f"path.integers = {integers!r} must be one of {', '.join(INTEGERS_CHOICES)}")
    content = read_bytes(path, limits)
    options = GCodeOptions(
        units,
        limits,
        recover,
        feed_mm_min,
        chord_mm,
        step_mm,
        rotary,
        block_skip=block_skip,
        decimal=decimal,
        integers=integers,
    )
    reader = execute(path, content, options)
    original = GCodeOriginal(path, content, options)
    return reader.moves.build(content, format="G-code", name=reader.name, feed_mm_min=feed_mm_min, original=original)
