"""Read ABB RAPID programs as tool paths: the moves of `main` and of the procedures that it calls."""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
from sicp_formats.rapid.data import Data
from sicp_formats.rapid.run import RapidRunner
from sicp_formats.rapid.text import Module, Routine, module_files, read_module
from sicp_formats.robot.motion import RobotMoves, subprograms_named, tool_side
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_CALL = re.compile(r"(\w+)[ \t]*", re.ASCII)


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
    """Read a RAPID module into a path in mm, mm/min and unit axes (tip to holder).

    Executed are MoveJ (rapid), MoveL and MoveC to robtargets that are declared or written out, Offs and RelTool of
    them by constants, and calls of procedures of the same program. Points keep the coordinates that they have in their
    work object. Feeds are those of the speeddata in mm/s. Outputs, waits and the like become events.

    Parameters
    ----------
    path
        The .mod, .modx or .prg file, or the .pgf that lists the modules beside it.
    units
        Must be mm if it is given: RAPID knows no other unit.
    limits
        Caps on the file and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Feed for cutting moves whose speed is not limited (vmax).
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    program
        Procedure to begin with; `main`, or the only one that no other calls, if left out.
    tool_axis
        Axis of the tool frame that points from the tip to the holder.
    calls
        Names of procedures elsewhere that move nothing, separated by commas; others are refused.

    Raises
    ------
    FormatError
        With the line, if a statement cannot be followed without a guess.
    UnitError
        If `units` is not mm.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    side = tool_side(tool_axis)
    content = read_bytes(path, limits)
    files = module_files(path, content, limits)
    modules = [read_module(file, "\n".join(program_lines(file, text, limits))) for file, text in files.items()]
    module = _together(path, modules)
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    moves.state_unit("mm", 1)
    robot = RobotMoves(moves, side)
    data = Data()
    for declaration in module.declarations:
        data.declare(declaration.text)
    runner = RapidRunner(module.routines, data, moves, robot, subprograms_named(calls))
    first = _first_routine(path, module, program)
    runner.call(first, 0, lambda: runner.run_routine(first))
    robot.finish()
    if len(modules) > 1:
        moves.forget_lines()
    return moves.build(content, format="RAPID", name=module.name or first, feed_mm_min=feed_mm_min)


def _together(path: Path, modules: list[Module]) -> Module:
    """Return the modules of a program as one; names of procedures must differ."""
    routines: dict[str, Routine] = {}
    for module in modules:
        if twice := sorted(routines.keys() & module.routines.keys()):
            raise FormatError(path, f"has the procedure {twice[0]} in two modules; rename one of them")
        routines |= module.routines
    return Module(modules[0].name, tuple(each for module in modules for each in module.declarations), routines)


def _first_routine(path: Path, module: Module, program: str | None) -> str:
    wanted = "main" if program is None else program.lower()
    if wanted in module.routines:
        return wanted
    called = {name for each in module.routines.values() for name in _called(each)}
    first = [name for name in module.routines if name not in called]
    if program is None and len(first) == 1:
        return first[0]
    known = ", ".join(list(module.routines)[:10])
    raise FormatError(path, f"has no procedure {wanted}; choose with --set path.program=NAME one of {known}", line=1)


def _called(routine: Routine) -> set[str]:
    """Return the lower-case names of what a procedure may call without arguments."""
    return {found[1].lower() for each in routine.statements if (found := _CALL.fullmatch(each.text))}
