"""Read Universal Robots scripts as tool paths (.script, .urscript).

Facts: Universal Robots, The URScript Programming Language (poses in metres, rotation vectors in radians).
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.motion import RobotMoves, subprograms_named, tool_side
from sicp_formats.source import read_bytes
from sicp_formats.urscript.run import UrRunner
from sicp_formats.urscript.text import Script, read_script

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
    program: str | None = None,
    tool_axis: str = "-z",
    calls: str = "",
) -> ToolPath:
    """Read a script into a path in mm, mm/min and unit axes (tip to holder).

    Executed are movej (rapid), movel, movep and movec to poses p[...] and to variables that hold one, in the base or,
    by pose_trans(NAME, ...), all in one frame, whose coordinates they keep; and calls of functions of the script.
    Speeds are v in m/s. Outputs, sleeps and the like become events.

    Parameters
    ----------
    path
        The .script file.
    units
        Must be m if it is given: URScript knows no other unit.
    limits
        Caps on the file and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Not used: a move without v has the speed of the manual, 0.25 m/s.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    program
        Function to begin with; what stands outside of all functions, or else the first function, if left out.
    tool_axis
        Axis of the tool frame that points from the tip to the holder.
    calls
        Names of functions elsewhere that move nothing, separated by commas; others are refused.

    Raises
    ------
    FormatError
        With the line, if a statement cannot be followed without a guess.
    UnitError
        If `units` is not m.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    side = tool_side(tool_axis)
    content = read_bytes(path, limits)
    script = read_script(path, program_lines(path, content, limits))
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    moves.state_unit("m", 1)
    robot = RobotMoves(moves, side)
    runner = UrRunner(path, script.functions, moves, robot, subprograms_named(calls))
    first = _first_function(path, script, program)
    if first:
        runner.call(first, 0, lambda: runner.run_function(first))
    else:
        runner.run(path, script.statements)
    robot.finish()
    return moves.build(content, format="URScript", name=first or path.name.split(".")[0], feed_mm_min=feed_mm_min)


def _first_function(path: Path, script: Script, program: str | None) -> str:
    """Return the function to begin with, or nothing for what stands outside of all of them."""
    if program is not None and program not in script.functions:
        known = ", ".join(list(script.functions)[:10])
        raise FormatError(
            path,
            f"has no function {printable(program, 40)}; choose one of {known} with --set path.program=",
            line=1,
        )
    if program is not None:
        return program
    outside = any(not statement.text.startswith("#") for statement in script.statements)
    if not outside and not script.functions:
        raise FormatError(path, "has no statement; is this a script of a robot?", line=1)
    return "" if outside else next(iter(script.functions))
