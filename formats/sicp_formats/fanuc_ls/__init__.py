"""Read Fanuc teach pendant programs as tool paths: a listing (.ls), and those that it calls beside it.

Facts: FANUC HandlingTool operator's manual; listings as controllers write them.
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.fanuc_ls.listing import Listing, read_listing
from sicp_formats.fanuc_ls.run import LsRunner
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.files import file_beside
from sicp_formats.robot.motion import RobotMoves, subprograms_named, tool_side
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
    tool_axis: str = "-z",
    calls: str = "",
) -> ToolPath:
    """Read a Fanuc listing into a path in mm, mm/min and unit axes (tip to holder).

    Executed are J (rapid), L and C to positions P[n] of the listing, and calls of programs whose listings lie beside
    it. Orientations are R = Rz(R) Ry(P) Rx(W); points keep the coordinates that they have in their user frame. Outputs,
    waits and the like become events.

    Parameters
    ----------
    path
        The .ls file.
    units
        Must be mm if it is given: positions are in mm.
    limits
        Caps on the files and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Feed for cutting moves whose speed a schedule sets (WELD_SPEED, max_speed).
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    tool_axis
        Axis of the tool frame that points from the tip to the holder.
    calls
        Names of programs and macros elsewhere that move nothing, separated by commas; others are refused.

    Raises
    ------
    FormatError
        With file and line, if a statement cannot be followed without a guess.
    UnitError
        If `units` is not mm.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    side = tool_side(tool_axis)
    content = read_bytes(path, limits)
    first = read_listing(path, program_lines(path, content, limits))
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    moves.state_unit("mm", 1)
    robot = RobotMoves(moves, side)

    def beside(name: str) -> Listing | None:
        file = file_beside(path, name, ".ls")
        return None if file is None else read_listing(file, program_lines(file, read_bytes(file, limits), limits))

    runner = LsRunner(first, beside, moves, robot, subprograms_named(calls))
    runner.call(first.name, 0, lambda: runner.run_listing(first))
    robot.finish()
    if not first.ended:
        moves.note_missing_end(first.lines)
    if runner.files > 1:
        moves.forget_lines()
    return moves.build(content, format="Fanuc LS", name=first.name, feed_mm_min=feed_mm_min)
