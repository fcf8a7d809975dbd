"""Read Heidenhain conversational programs (.h) as tool paths: straight moves L and LN, tool tip control, labels.

Facts: HEIDENHAIN TNC 640 and iTNC 530, User's Manual for Conversational Programming.
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.gcode.axis import ROTARY_CHOICES
from sicp_formats.klartext.run import KlartextRunner
from sicp_formats.klartext.text import read_blocks
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
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
) -> ToolPath:
    """Read a conversational program into a path in mm, mm/min and unit axes (tip to holder).

    Executed are L and LN with X Y Z, TX TY TZ, A B C, IX ..., F, FMAX and R0, and CALL LBL. X Y Z are the tool tip in
    the part frame, as posted for M128 or FUNCTION TCPM. What would need a control - arcs, cycles, tilted planes,
    compensation, Q parameters - is refused with its line.

    Parameters
    ----------
    path
        The .h file.
    units
        Unit of a program whose BEGIN PGM states none; must not contradict one that does.
    limits
        Caps on the file and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Feed for cutting moves of programs in inches, whose F controls read in different units, or that state none.
    chord_mm, step_mm
        As for other path formats; arcs are not read.
    rotary
        ``AC``, ``BC``, ``AB`` or ``BA``: the tilting and the carrying rotary axis of a head-head machine, as for
        G-code. Without it angles other than 0 are refused.

    Raises
    ------
    FormatError
        With the line, if a block cannot be followed without a guess.
    UnitError
        If `units` is unknown or contradicts the program.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    if rotary is not None and rotary not in ROTARY_CHOICES:
        raise JobError(f"path.rotary = {rotary!r} must be one of {', '.join(ROTARY_CHOICES)}")
    content = read_bytes(path, limits)
    blocks = read_blocks(path, program_lines(path, content, limits))
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    runner = KlartextRunner(moves, blocks, rotary, may_lack_feed=feed_mm_min is not None)
    runner.run()
    return moves.build(content, format="Heidenhain", name=runner.name, feed_mm_min=feed_mm_min)
