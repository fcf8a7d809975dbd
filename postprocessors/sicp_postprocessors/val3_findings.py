"""What a robot operator must know or set before a VAL3 program runs.

Codes: 630 tool not given, 631 cell not given, 632 output not linked, 633 spindle direction, 634 spindle speed not
commanded, 635 flange turns further than the tool axis, 636 tool change by hand, 637 cutting with the spindle off,
638 several tools, 639 stops between cutting moves, 640 angles that miss the tool axis.
"""

from __future__ import annotations

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, FloatArray, ToolPath
from sicp_postprocessors.checks import event_place, move_place, stretch_findings
from sicp_postprocessors.moves import events_in_order
from sicp_postprocessors.options import flag
from sicp_postprocessors.rotary import axis_errors_deg
from sicp_postprocessors.text import counted
from sicp_postprocessors.val3_code import changes_tool_by_hand
from sicp_postprocessors.val3_motion import blends_mm, passed_points
from sicp_postprocessors.val3_options import Val3Options
from sicp_postprocessors.val3_poses import flange_turns_deg, rotation_matrices

__all__ = [
    "axis_findings",
    "cell_findings",
    "flange_findings",
    "spindle_findings",
    "stop_findings",
    "tool_findings",
]

_FLANGE_TURN_DEG = 30.0
_AXIS_ERROR_DEG = 1e-3
_FEW_STOPS = 10
_SIX = "x,y,z,rx,ry,rz"


def cell_findings(path: ToolPath, options: Val3Options, post: str) -> list[Finding]:
    """Tell what the program declares without knowing it: the tool, the place of the scan frame, the outputs."""
    findings = []
    if options.tool is None:
        message = (
            "the tool is declared at the flange itself; give its tip in mm and degrees with "
            f"{flag(post, 'tool', _SIX)}, or teach it on the controller"
        )
        findings.append(Finding(630, Level.WARN, message))
    if options.cell is None:
        world = "world" if options.world_origin == "shoulder" else "base plate"
        message = (
            f"no cell is given, so the scan frame is taken as the robot's {world}; give its pose there in mm and "
            f"degrees with {flag(post, 'cell', _SIX)}"
        )
        findings.append(Finding(631, Level.WARN, message))
    links = {EventKind.SPINDLE: options.spindle_link, EventKind.COOLANT: options.coolant_link}
    kinds = {event.kind for event in path.events}
    for kind, link in links.items():
        if kind in kinds and not link:
            words = flag(post, f"{kind}_link", "OUTPUT")
            message = f"the {kind} output is not linked; name it with {words}, or link it on the controller"
            findings.append(Finding(632, Level.WARN, message))
    return findings


def spindle_findings(path: ToolPath, options: Val3Options, post: str) -> list[Finding]:
    """Check the spindle: a direction that has an output, a speed that somebody sets, no cut while it stands."""
    findings = []
    starts = [event for event in path.events if event.kind is EventKind.SPINDLE and event.value != 0]
    if not options.spindle_ccw_link:
        words = flag(post, "spindle_ccw_link", "OUTPUT")
        message = f"the path turns the spindle counter-clockwise; name the output that does with {words}"
        findings += [Finding(633, Level.FAIL, message, event_place(e)) for e in starts if e.value < 0]
    if options.spindle_speed == "none" and starts:
        speeds = ", ".join(f"{abs(speed):g}" for speed in dict.fromkeys(event.value for event in starts))
        words = flag(post, "spindle_speed", "num")
        message = f"the spindle speed is not commanded: set {speeds} rev/min at the drive, or {words} (or aio)"
        findings.append(Finding(634, Level.INFO, message))
    message = "cuts with the spindle off after a tool change; start the spindle in the path after the change"
    findings += [Finding(637, Level.FAIL, message, event_place(e)) for e in _changes_without_restart(path)]
    return findings


def tool_findings(path: ToolPath, post: str) -> list[Finding]:
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


def axis_findings(path: ToolPath, angles_deg: FloatArray) -> list[Finding]:
    """Check by the controller's own formula that rx, ry, rz (n, 3) turn the tool's Z against the axis of each move."""
    errors = axis_errors_deg(path.axes, -rotation_matrices(angles_deg)[:, :, 2])
    message = f"rx, ry, rz miss the tool axis by more than {_AXIS_ERROR_DEG:g} degrees; report this"
    return stretch_findings(path, errors > _AXIS_ERROR_DEG, 640, Level.FAIL, message)


def flange_findings(path: ToolPath, angles_deg: FloatArray, post: str) -> list[Finding]:
    """Tell of moves in which the flange swings about the tool although the tool axis hardly moves."""
    swings = flange_turns_deg(angles_deg) > _FLANGE_TURN_DEG
    words = flag(post, "spin", "transport")
    message = f"the flange turns over {_FLANGE_TURN_DEG:g} degrees about the tool; prevent it with {words}"
    return stretch_findings(path, swings & ~path.rapid, 635, Level.WARN, message)


def stop_findings(path: ToolPath, options: Val3Options, post: str) -> list[Finding]:
    """Tell how often the robot stops within cuts, where nothing in the path asks for it."""
    stops = np.flatnonzero(passed_points(path) & (blends_mm(path, options) == 0.0))
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
    return [Finding(639, Level.WARN, f"{told}; let it run through with {flag(post, 'blend', 'Cartesian')}", where)]


def _changes_without_restart(path: ToolPath) -> list[Event]:
    """Return the tool changes that stop a running spindle which does not start again before the next cut."""
    cuts = np.flatnonzero(~path.rapid)
    stopped: list[Event] = []
    runs, pending = False, None
    for event in events_in_order(path):
        if pending and _cut_between(cuts, pending.before_move, event.before_move):
            stopped.append(pending)
            pending = None
        if event.kind is EventKind.SPINDLE:
            runs, pending = event.value != 0, None
        elif changes_tool_by_hand(event) and runs:
            runs, pending = False, event
    if pending and _cut_between(cuts, pending.before_move, len(path)):
        stopped.append(pending)
    return stopped


def _cut_between(cuts: np.ndarray[tuple[int], np.dtype[np.int64]], first: int, stop: int) -> bool:
    return bool(np.searchsorted(cuts, first) < np.searchsorted(cuts, stop))
