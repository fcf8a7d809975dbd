"""What a robot's operator must know or set before a program runs.

Codes: 630 tool not given, 631 cell not given, 632 output not linked, 633 spindle direction, 634 spindle speed not
commanded, 635 flange turns further than the tool axis, 636 tool change by hand, 638 several tools, 639 stops between
cutting moves, 640 angles that miss the tool axis.
"""

from __future__ import annotations

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, FloatArray, ToolPath
from sicp_postprocessors.checks import event_place, move_place, stretch_findings
from sicp_postprocessors.moves import events_in_order
from sicp_postprocessors.options import flag
from sicp_postprocessors.orientations import axis_errors_deg, flange_turns_deg, rotation_matrices
from sicp_postprocessors.robot_options import RobotOptions
from sicp_postprocessors.text import counted
from sicp_postprocessors.zones import passed_points

__all__ = ["changes_tool_by_hand", "robot_findings"]

_FLANGE_TURN_DEG = 30.0
_AXIS_ERROR_DEG = 1e-3
_FEW_STOPS = 10
_SIX = "x,y,z,rx,ry,rz"


def robot_findings(
    path: ToolPath, angles_deg: FloatArray, zones_mm: FloatArray, options: RobotOptions, post: str
) -> list[Finding]:
    """Return what the operator must set or know: tool, cell, outputs, spindle, tool changes, spin and stops.

    Parameters
    ----------
    path
        The path, which has passed the checks of every post.
    angles_deg
        (n, 3) rx, ry, rz of the tool.
    zones_mm
        (n,) zone of each move, 0 where the arm comes to rest.
    options, post
        Options and name of the post.
    """
    return [
        *_cell_findings(path, options, post),
        *_spindle_findings(path, options, post),
        *_tool_findings(path, post),
        *_axis_findings(path, angles_deg),
        *_flange_findings(path, angles_deg, post),
        *_stop_findings(path, zones_mm, options, post),
    ]


def changes_tool_by_hand(event: Event) -> bool:
    """Say whether a tool is called after the path has begun: a robot has no word for it, so a person must act."""
    return event.kind is EventKind.TOOL and event.before_move > 0


def _cell_findings(path: ToolPath, options: RobotOptions, post: str) -> list[Finding]:
    """Tell what the program declares without knowing it: the tool, the place of the scan frame, the outputs."""
    findings = []
    if not options.tool_is_known:
        message = (
            "the tool is declared at the flange itself, and the program waits for the operator to teach it; give its "
            f"tip in mm and degrees with {flag(post, 'tool', _SIX)}"
        )
        findings.append(Finding(630, Level.WARN, message))
    if not options.cell_is_known:
        message = (
            f"no cell is given, so the scan frame is taken as the robot's {options.cell_origin}, and the program waits "
            f"for the operator; give its pose there in mm and degrees with {flag(post, 'cell', _SIX)}"
        )
        findings.append(Finding(631, Level.WARN, message))
    driven = options.spindle_output or options.commands_speed
    signals = {
        EventKind.SPINDLE: (driven, "the program stops for the operator to start it"),
        EventKind.COOLANT: (options.coolant_output, "nothing switches it"),
    }
    kinds = {event.kind for event in path.events}
    for kind, (signal, instead) in signals.items():
        if kind in kinds and not signal:
            words = flag(post, f"{kind}_output", "OUTPUT")
            message = f"no output is named for the {kind}, so {instead}; name it with {words}"
            findings.append(Finding(632, Level.WARN, message))
    return findings


def _spindle_findings(path: ToolPath, options: RobotOptions, post: str) -> list[Finding]:
    """Check the spindle: a direction that has an output, a speed that somebody sets, no cut while it stands."""
    findings = []
    starts = [event for event in path.events if event.kind is EventKind.SPINDLE and event.value != 0]
    if not options.spindle_ccw_output:
        words = flag(post, "spindle_ccw_output", "OUTPUT")
        message = f"the path turns the spindle counter-clockwise; name the output that does with {words}"
        findings += [Finding(633, Level.FAIL, message, event_place(e)) for e in starts if e.value < 0]
    elif not options.spindle_output:
        words = flag(post, "spindle_output", "OUTPUT")
        message = f"the path turns the spindle clockwise; name the output that does with {words}"
        findings += [Finding(633, Level.FAIL, message, event_place(e)) for e in starts if e.value > 0]
    if starts and not options.commands_speed:
        speeds = ", ".join(f"{abs(speed):g}" for speed in dict.fromkeys(event.value for event in starts))
        words = f", or {flag(post, 'spindle_speed', 'aio')}" if hasattr(options, "spindle_speed") else ""
        message = f"the spindle speed is not commanded: set {speeds} rev/min at the drive{words}"
        findings.append(Finding(634, Level.INFO, message))
    return findings


def _tool_findings(path: ToolPath, post: str) -> list[Finding]:
    """Tell of tool changes, which a person makes, and of tools that share one declared pose."""
    calls = [event for event in events_in_order(path) if event.kind is EventKind.TOOL]
    message = "tool change: the program waits until the operator has changed the tool"
    findings = [Finding(636, Level.INFO, message, event_place(e)) for e in calls if changes_tool_by_hand(e)]
    numbers = sorted({int(event.value) for event in calls})
    if len(numbers) > 1:
        told = ", ".join(map(str, numbers))
        words = flag(post, "tool", _SIX)
        message = f"tools {told} are declared with one pose, that of {words}; set each on the controller"
        findings.append(Finding(638, Level.WARN, message))
    return findings


def _axis_findings(path: ToolPath, angles_deg: FloatArray) -> list[Finding]:
    """Check by the controller's own formula that rx, ry, rz (n, 3) turn the tool's Z against the axis of each move."""
    errors = axis_errors_deg(path.axes, -rotation_matrices(angles_deg)[:, :, 2])
    message = f"rx, ry, rz miss the tool axis by more than {_AXIS_ERROR_DEG:g} degrees; report this"
    return stretch_findings(path, errors > _AXIS_ERROR_DEG, 640, Level.FAIL, message)


def _flange_findings(path: ToolPath, angles_deg: FloatArray, post: str) -> list[Finding]:
    """Tell of moves in which the flange swings about the tool although the tool axis hardly moves."""
    swings = flange_turns_deg(angles_deg) > _FLANGE_TURN_DEG
    words = flag(post, "spin", "transport")
    message = f"the flange turns over {_FLANGE_TURN_DEG:g} degrees about the tool; prevent it with {words}"
    return stretch_findings(path, swings & ~path.rapid, 635, Level.WARN, message)


def _stop_findings(path: ToolPath, zones_mm: FloatArray, options: RobotOptions, post: str) -> list[Finding]:
    """Tell how often the robot stops within cuts, where nothing in the path asks for it."""
    stops = np.flatnonzero(passed_points(path) & (zones_mm == 0.0))
    told = f"the robot stops at {counted(len(stops), 'point')} between cutting moves"
    where = move_place(path, int(stops[0]), int(stops[-1])) if len(stops) else ""
    if options.blends:
        message = f"{told}, where a blend would be below 0.001 mm; take double points out of the path"
        return [Finding(639, Level.INFO, message, where)] if len(stops) else []
    if len(stops) <= _FEW_STOPS:
        return []
    if options.first_run:
        words = flag(post, "first_run", "false")
        return [Finding(639, Level.INFO, f"{told}, as a first run does; production: {words}", where)]
    return [Finding(639, Level.WARN, f"{told}; let it run through with {flag(post, 'blend', 'true')}", where)]
