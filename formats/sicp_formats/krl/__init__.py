"""Read KUKA KRL programs as tool paths: a .src file, the .dat file of the same name, and programs that it calls."""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.krl.data import Values
from sicp_formats.krl.run import KrlRunner
from sicp_formats.krl.text import Module, Subprogram, data_file, without_comment
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.files import file_beside
from sicp_formats.robot.motion import RobotMoves, subprograms_named, tool_side
from sicp_formats.robot.program import Statement
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_DEF = re.compile(r"(?:GLOBAL[ \t]+)?DEF[ \t]+(\w+)[ \t]*\((.*)\)", re.ASCII | re.IGNORECASE)
_DEFFCT = re.compile(r"(?:GLOBAL[ \t]+)?DEFFCT\b", re.ASCII | re.IGNORECASE)
_END = re.compile(r"END(?:FCT)?", re.ASCII | re.IGNORECASE)


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
    """Read a KRL program into a path in mm, mm/min and unit axes (tip to holder).

    Executed are PTP (rapid), LIN, CIRC and LIN_REL to points that stand in the program or the .dat file beside it,
    and calls of subprograms of the same file, or of another .src file beside it that bears the name. Orientations are
    R = Rz(A) Ry(B) Rx(C); points keep the coordinates that they have in their base. Feeds are $VEL.CP in m/s. Outputs,
    waits and the like become events.

    Parameters
    ----------
    path
        The .src file.
    units
        Must be mm if it is given: KRL knows no other unit.
    limits
        Caps on the files and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Feed for cutting moves before the program states one.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    program
        Subprogram to begin with; the first of the file if left out.
    tool_axis
        Axis of the tool frame that points from the tip to the holder.
    calls
        Names of subprograms elsewhere that move nothing, separated by commas; others are refused.

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
    module = _module(path, content, limits)
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    moves.state_unit("mm", 1)
    robot = RobotMoves(moves, side)

    def beside(name: str) -> Module | None:
        file = file_beside(path, name, ".src")
        return None if file is None else _module(file, read_bytes(file, limits), limits)

    runner = KrlRunner(module, beside, moves, robot, subprograms_named(calls))
    first = next(iter(module.subprograms)) if program is None else program.upper()
    if first not in module.subprograms:
        known = ", ".join(list(module.subprograms)[:10])
        raise FormatError(path, f"defines no {program}; choose with --set path.program=NAME one of {known}", line=1)
    runner.call(first, 0, lambda: runner.run_subprogram(module, first))
    robot.finish()
    if runner.files > 1:
        moves.forget_lines()
    return moves.build(content, format="KRL", name=first.lower(), feed_mm_min=feed_mm_min)


def _module(path: Path, content: bytes, limits: Limits) -> Module:
    return Module(path, _subprograms(path, program_lines(path, content, limits)), _values(path, limits))


def _subprograms(path: Path, lines: list[str]) -> dict[str, Subprogram]:
    """Return the subprograms of a file by upper-case name, in its order."""
    found: dict[str, Subprogram] = {}
    name, takes_arguments, statements, inside = "", False, list[Statement](), 0
    for number, line in enumerate(lines, 1):
        code, comment = without_comment(line)
        if comment and inside:
            statements.append(Statement(number, comment))
        if not code or code.startswith("&"):
            continue
        head = _DEF.fullmatch(code)
        if head or _DEFFCT.match(code):
            if inside:
                raise FormatError(path, "a subprogram begins within another; is an END missing?", line=number)
            inside, statements = number, []
            name, takes_arguments = (head[1].upper(), bool(head[2].strip())) if head else ("", False)
        elif _END.fullmatch(code):
            if name:
                found[name] = Subprogram(name, takes_arguments, tuple(statements))
            inside = 0
        elif inside:
            statements.append(Statement(number, code))
        else:
            raise FormatError(path, "a statement outside of DEF and END; is this a KRL program (.src)?", line=number)
    if inside:
        raise FormatError(path, "DEF without END; is the file complete?", line=inside)
    if not found:
        raise FormatError(path, "has no DEF ... END; is this a KRL program (.src)?", line=1)
    return found


def _values(path: Path, limits: Limits) -> Values:
    """Return the values that the .dat file beside the program states, if there is one."""
    # Joint angles that every controller declares in its own configuration; which ones does not matter here.
    values = Values({f"XHOME{number}": {"A1": 0.0} for number in ("", 1, 2, 3, 4, 5)})
    beside = data_file(path)
    if beside is None:
        return values
    for number, line in enumerate(program_lines(beside, read_bytes(beside, limits), limits), 1):
        code = without_comment(line)[0]
        if code.count("{") != code.count("}"):
            raise FormatError(beside, "a brace is not closed; is the file complete?", line=number)
        values.assign(code)
    return values
