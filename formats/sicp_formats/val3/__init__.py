"""Read Staubli VAL3 applications as tool paths: the moves of `start` and of the programs that it calls."""

from __future__ import annotations

from array import array
from dataclasses import replace
from pathlib import Path

from sicp_cam.errors import FormatError, JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.robot.motion import RobotMoves, subprograms_named, tool_side
from sicp_formats.source import describe
from sicp_formats.val3.project import Project, open_project
from sicp_formats.val3.run import Val3Runner

__all__ = ["read_path"]

_NUMBERS_A_MOVE = 9


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
    frame: str = "apply",
    tool_axis: str = "-z",
    rapid: str = "mRapid,mStart",
    calls: str = "",
) -> ToolPath:
    """Read a VAL3 application into a path in mm, mm/min and unit axes (tip to holder).

    A .pjx lists the program and data files; any of them, or the folder, finds it. Executed are movej, movel and movec
    to declared points and `appro` of them, loops over whole numbers with constant bounds, and calls without arguments;
    outputs, waits and everything else that moves nothing become events. Orientations are R = Rx Ry Rz, speeds `tmax`
    (or .tvel) in mm/s; movej is rapid.

    Parameters
    ----------
    path
        The .pjx, another file of the application, or its folder.
    units
        Must not contradict the unit of the application: mm, or inch where `millimeterUnit` is false.
    limits
        Caps on the files and the path.
    recover
        Nothing in a program is repaired: a guess about motion would cut the part.
    feed_mm_min
        Feed for cutting moves whose mdesc does not limit the tip's speed (tmax of 9999 and more).
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    program
        Program to begin with; `start` if left out, or the .pgx that is given.
    frame
        ``apply`` the frames that points stand in, so that the path comes into the robot's world, or ``keep`` the
        coordinates, which must then all stand in one frame.
    tool_axis
        Axis of the tool frame that points from the tip to the holder.
    rapid
        Names of the mdesc whose straight moves are rapid, separated by commas.
    calls
        Names of programs elsewhere that move nothing, separated by commas; others are refused.

    Raises
    ------
    FormatError
        With file and line, if a statement cannot be followed without a guess.
    UnitError
        If `units` contradicts the application.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    side = tool_side(tool_axis)
    if frame not in ("apply", "keep"):
        raise JobError(f"path.frame = {frame!r} must be one of apply, keep")
    project = open_project(path, limits)
    moves = MoveList(project.file, limits, units, chord_mm, step_mm)
    moves.state_unit(project.unit, project.unit_line)
    robot = RobotMoves(moves, side)
    runner = Val3Runner(project, moves, robot, frame == "keep", subprograms_named(rapid), subprograms_named(calls))
    name = program or (path.stem if path.suffix.lower() == ".pgx" else "start")
    first = project.program(name)
    if first is None:
        raise FormatError(project.file, f"lists no program {name!r}; choose one with --set path.program=NAME")
    runner.call(name, 0, lambda: runner.run_program(first))
    robot.finish()
    return _built(project, moves, runner, frame, feed_mm_min)


def _built(project: Project, moves: MoveList, runner: Val3Runner, frame: str, feed_mm_min: float | None) -> ToolPath:
    frames = ", ".join(sorted(runner.frames))
    if frames and frame == "keep":
        moves.note(Notice.FRAME_CHOSEN, 0, f"points are kept as they stand in {frames}")
    elif frames:
        moves.note(Notice.FRAME_CHOSEN, 0, f"the frame {frames} was applied; leave it with --set path.frame=keep")
    if len(runner.files) == 1:
        moves.path = runner.files[0]
    else:
        # A line means nothing without its file, and a path has room for one file.
        moves.rows[_NUMBERS_A_MOVE - 1 :: _NUMBERS_A_MOVE] = array("d", bytes(8 * len(moves)))
        moves.events[:] = [replace(event, line=0) for event in moves.events]
        for noted in moves.tally.noted.values():
            noted.line = 0
    path = moves.build(project.content, format="VAL3", name=project.file.stem, feed_mm_min=feed_mm_min)
    source = describe(project.file, project.content, format="VAL3", unit=project.unit, unit_stated=True)
    return replace(path, source=source)
