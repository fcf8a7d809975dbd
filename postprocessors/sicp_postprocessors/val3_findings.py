"""What a robot operator must know or set before a VAL3 program runs.

Codes: 630 tool not given, 631 cell not given, 632 output not linked, 633 spindle direction, 634 spindle speed not
commanded, 635 flange turns further than the tool axis, 636 tool change by hand, 637 cutting with the spindle off,
638 several tools.
"""

from __future__ import annotations

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, ToolPath
from sicp_postprocessors.base import events_in_order
from sicp_postprocessors.checks import event_place, stretch_findings
from sicp_postprocessors.val3_code import changes_tool_by_hand
from sicp_postprocessors.val3_motion import path_angles
from sicp_postprocessors.val3_options import Val3Options
from sicp_postprocessors.val3_poses import flange_turns_deg

__all__ = ["cell_findings", "flange_findings", "spindle_findings", "tool_findings"]

_FLANGE_TURN_DEG = 30.0


def cell_findings(path: ToolPath, options: Val3Options) -> list[Finding]:
    """Tell what the program declares without knowing it: the tool, the place of the scan frame, the outputs."""
    findings = []
    if options.tool is None:
        message = "the tool is declared at the flange itself; set post option tool, or teach it on the controller"
        findings.append(Finding(630, Level.WARN, message))
    if options.cell is None:
        message = "the scan frame is taken as the robot's world; set post option cell to its pose there"
        findings.append(Finding(631, Level.WARN, message))
    links = {EventKind.SPINDLE: options.spindle_link, EventKind.COOLANT: options.coolant_link}
    kinds = {event.kind for event in path.events}
    for kind, link in links.items():
        if kind in kinds and not link:
            message = f"the {kind} output is not linked; set post option {kind}_link, or link it on the controller"
            findings.append(Finding(632, Level.WARN, message))
    return findings


def spindle_findings(path: ToolPath, options: Val3Options) -> list[Finding]:
    """Check the spindle: a direction that has an output, a speed that somebody sets, no cut while it stands."""
    findings = []
    starts = [event for event in path.events if event.kind is EventKind.SPINDLE and event.value != 0]
    if not options.spindle_ccw_link:
        message = "the path turns the spindle counter-clockwise; set post option spindle_ccw_link to its output"
        findings += [Finding(633, Level.FAIL, message, event_place(e)) for e in starts if e.value < 0]
    if options.spindle_speed == "none" and starts:
        speeds = ", ".join(f"{abs(speed):g}" for speed in dict.fromkeys(event.value for event in starts))
        message = f"the spindle speed is not commanded: set {speeds} rev/min at the drive, or post option spindle_speed"
        findings.append(Finding(634, Level.INFO, message))
    message = "cuts with the spindle off after a tool change; start the spindle in the path after the change"
    findings += [Finding(637, Level.FAIL, message, event_place(e)) for e in _changes_without_restart(path)]
    return findings


def tool_findings(path: ToolPath) -> list[Finding]:
    """Tell of tool changes, which a person makes, and of tools that share one declared pose."""
    calls = [event for event in events_in_order(path) if event.kind is EventKind.TOOL]
    message = "tool change: the program waits until the operator has changed the tool"
    findings = [Finding(636, Level.INFO, message, event_place(e)) for e in calls if changes_tool_by_hand(e)]
    numbers = sorted({int(event.value) for event in calls})
    if len(numbers) > 1:
        told = ", ".join(map(str, numbers))
        message = f"tools {told} are declared with one pose, that of post option tool; set each on the controller"
        findings.append(Finding(638, Level.WARN, message))
    return findings


def flange_findings(path: ToolPath, options: Val3Options) -> list[Finding]:
    """Tell of moves in which the flange swings about the tool although the tool axis hardly moves."""
    swings = flange_turns_deg(path_angles(path, options)) > _FLANGE_TURN_DEG
    message = f"the flange turns over {_FLANGE_TURN_DEG:g} degrees about the tool; set post option spin to transport"
    return stretch_findings(path, swings & ~path.rapid, 635, Level.WARN, message)


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
