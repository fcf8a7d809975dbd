"""What the operator of a five-axis control should know of a program, or why it may not be written.

Codes: 620 an axis is held at the pole, 621 beyond the travel, 622 a tool axis that leaves its way in a cut, 624 a
direction out of reach, 625 moves divided or not divided enough, 626 what the control must see to itself, 627 rapid
moves that turn far, or whose tip leaves the straight line, 629 linear travel. More of them in `control_findings`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import BoolArray, FloatArray, Program
from sicp_postprocessors.checks import in_scan_frame, move_place, stretch_findings
from sicp_postprocessors.gcode.along import Angles, over_travel
from sicp_postprocessors.gcode.divide import axis_turns_deg
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions
from sicp_postprocessors.gcode.setting import Setting
from sicp_postprocessors.gcode.ways import axis_deviations_deg, rotary_turns_deg
from sicp_postprocessors.moves import tools_in_use
from sicp_postprocessors.options import flag
from sicp_postprocessors.text import counted

__all__ = [
    "division_findings",
    "rotary_findings",
    "travel_findings",
    "without_tip_findings",
]

_ALLOWED_DEG = 2.0
"""How far the tool axis may leave the shortest way where the travel makes an axis turn back within a cut."""
_OPPOSITE_DEG = 179.9
_BENT_DEG = 0.1
"""How far the tool axis may leave the shortest way between two blocks before that is told."""
_STRAIGHT_DEG = 6.0
"""Axes that together turn by t radians take the tool off the shortest way by t^2 / 8 at most: here 0.08 degrees."""
_REWIND_DEG = 90.0
"""A rapid move on which a rotary axis turns further than this is told."""


def rotary_findings(
    post: str, program: Program, options: GCodeOptions, setting: Setting, positions: Positions
) -> Iterator[Finding]:
    """Return what is to be told of the rotary axes: held, beyond their travel, out of reach, or turning far."""
    if positions.angles is None or positions.deg is None:
        return
    path, angles = program.path, positions.angles
    reach = positions.told(angles.beyond_deg > _reach_deg(options))
    yield from stretch_findings(
        path,
        reach,
        624,
        Level.FAIL,
        f"the machine {setting.machine.name} cannot bring the tool there: {float(angles.beyond_deg.max()):.4f} degrees "
        "are missing; change the axis in CAM, or choose the machine",
    )
    first, second = setting.machine.rotaries
    worst = float(positions.axis_errors_deg[angles.held].max(initial=0.0))
    cone = flag(post, "singular_cone_deg", f"{options.singular_cone_deg:g}")
    held = (
        f"near the pole {first.letter} is held, which turns the axis by at most {worst:.4f} degrees; the cone is {cone}"
    )
    yield from stretch_findings(path, positions.told(angles.held), 620, Level.INFO, held)
    for i, (axis, option) in enumerate(((first, "turn_limits_deg"), (second, "tilt_limits_deg"))):
        low, high = axis.limits_deg
        message = f"{axis.letter} leaves its travel {low:g} to {high:g} degrees; if it can, set " + flag(
            post, option, "lowest,highest"
        )
        if axis.turns_on:
            message += "; a rapid move between cuts lets it turn back: retract there in CAM"
        over = positions.told(over_travel(axis, positions.deg[:, i]))
        yield from stretch_findings(path, over, 621, Level.FAIL, message)
        yield from _seam_findings(post, options, axis.letter, axis.wrap != "none")
    yield from _turn_findings(post, program, options, setting, positions, angles)


def _reach_deg(options: GCodeOptions) -> float:
    return max(1e-4, 10.0**-options.angle_decimals, options.singular_cone_deg)


def _seam_findings(post: str, options: GCodeOptions, letter: str, wraps: bool) -> Iterator[Finding]:
    if wraps and not options.control.shorter_way:
        message = (
            f"{letter} is written within one turn: the control must go the shorter way; if it does not, set "
            f"{flag(post, 'wrap', 'none')}"
        )
        yield Finding(626, Level.WARN, message)


def _turn_findings(
    post: str, program: Program, options: GCodeOptions, setting: Setting, positions: Positions, angles: Angles
) -> Iterator[Finding]:
    deg, written = angles.deg, positions.program.path
    both = np.abs(rotary_turns_deg(setting.machine, deg))
    turns = both.max(axis=1, initial=0.0)
    doubtful = np.flatnonzero(~written.rapid & (both.sum(axis=1) > _STRAIGHT_DEG))
    off = np.zeros(len(deg))
    off[doubtful] = axis_deviations_deg(setting.machine, deg, written.axes, doubtful)
    turned_back = angles.forced & (off > _ALLOWED_DEG)
    yield from stretch_findings(
        program.path,
        positions.told(turned_back),
        621,
        Level.FAIL,
        f"the travel of the axes makes them turn over within a cut, where the tool axis would leave its way by up to "
        f"{float(off[turned_back].max(initial=0.0)):.1f} degrees; retract there in CAM, or choose another machine",
    )
    divide = flag(post, "max_axis_step_deg", f"{min(options.axis_step_deg or math.inf, 6.0) / 2.0:g}")
    large = (turns > options.rotary_step_deg) & ~written.rapid & ~turned_back
    message = (
        f"a rotary axis turns further than {options.rotary_step_deg:g} degrees in one cutting move, and the tool axis "
        f"leaves the shortest way by up to {float(off[large].max(initial=0.0)):.2f} degrees; divide the move with "
        f"{divide}, or allow it with {flag(post, 'rotary_step_deg', 'degrees')}"
    )
    yield from stretch_findings(program.path, positions.told(large), 622, Level.WARN, message)
    bent = (off > _BENT_DEG) & ~large & ~turned_back
    message = (
        "between the blocks the tool axis leaves the shortest way by up to "
        f"{float(off[bent].max(initial=0.0)):.2f} degrees, as both rotary axes turn; divide the moves with {divide}"
    )
    yield from stretch_findings(program.path, positions.told(bent), 622, Level.WARN, message)
    yield from _rewind_findings(program, positions, turns)


def _rewind_findings(program: Program, positions: Positions, turns_deg: FloatArray) -> Iterator[Finding]:
    """Return which rapid moves turn an axis far: the control does that at full speed, and with it tool or part."""
    rewinds = np.flatnonzero((turns_deg > _REWIND_DEG) & positions.program.path.rapid)
    for move in rewinds.tolist():
        message = (
            f"a rotary axis turns by up to {turns_deg[move]:.1f} degrees in one rapid move; see that there is room, or "
            "retract further there in CAM"
        )
        place = move_place(program.path, int(positions.origin[move]))
        yield Finding(627, Level.WARN, message, place)


def division_findings(post: str, program: Program, options: GCodeOptions, positions: Positions) -> Iterator[Finding]:
    """Return that moves were divided, and where the way of the axis between two moves is not known."""
    if options.axis_step_deg is None:
        return
    path = program.path
    opposite = (axis_turns_deg(path.axes) > _OPPOSITE_DEG) & ~path.rapid
    yield from stretch_findings(
        path,
        opposite,
        625,
        Level.FAIL,
        "the tool axis turns to its opposite in one cutting move: nothing tells which way; add a move between in CAM",
    )
    if positions.pieces.sum() > DEFAULT_LIMITS.path_points:
        message = (
            f"the divided path would have {int(positions.pieces.sum())} moves; allow larger steps with "
            f"{flag(post, 'max_axis_step_deg', 'degrees')}"
        )
        yield Finding(625, Level.FAIL, message)
        return
    more = int(positions.pieces.sum()) - len(path)
    if more:
        message = (
            f"{counted(int((positions.pieces > 1).sum()), 'cutting move')} divided by {counted(more, 'added point')}: "
            "tips on the straight line, tool axes on the great circle, steps of at most "
            f"{options.axis_step_deg:g} degrees"
        )
        yield Finding(625, Level.INFO, message)


def without_tip_findings(
    post: str, program: Program, options: GCodeOptions, setting: Setting, positions: Positions
) -> Iterator[Finding]:
    """Return where the tip leaves its straight way, because the control does not know it, and what is not checked."""
    if positions.angles is None or options.knows_tip:
        return
    written = positions.program.path
    if not in_scan_frame(program):
        message = (
            "without tip control X Y Z hold for a part that stands as in the program, and no work offset can turn it: "
            "put the whole correction into the points, by --frame scan"
        )
        yield Finding(626, Level.FAIL, message)
    if setting.machine.kind != "table-table" and len(set(tools_in_use(written).tolist()) - {-1}) > 1:
        message = (
            f"the path uses several tools, but X Y Z hold for one length, {flag(post, 'tool_length_mm', 'mm')}: "
            "write a program for each tool"
        )
        yield Finding(626, Level.FAIL, message)
    off = positions.off_way_mm
    cuts = (off > options.tip_tolerance_mm * 1.01) & ~written.rapid
    yield from stretch_findings(
        program.path,
        positions.told(cuts),
        625,
        Level.FAIL,
        f"without tip control the tip leaves its straight way by up to {float(off[cuts].max(initial=0.0)):.3f} mm, as "
        "an axis turns while the tool hardly does; keep the tool off the pole in CAM, hold the axis there with "
        f"{flag(post, 'singular_cone_deg', '0.01')}, or use tip control",
    )
    rapids = (off > 1.0) & written.rapid
    if rapids.any():
        message = (
            f"without tip control the tip leaves the straight line of {counted(int(rapids.sum()), 'rapid move')} by up "
            f"to {float(off[rapids].max()):.1f} mm, as the axes turn on the way; see that there is room"
        )
        yield Finding(627, Level.WARN, message)


def travel_findings(
    post: str, program: Program, options: GCodeOptions, setting: Setting, positions: Positions
) -> Iterator[Finding]:
    """Return where the linear axes leave their travel, as far as the machine is known."""
    limits = setting.machine.linear_limits_mm
    if limits is None or positions.deg is None:
        return
    known = setting.machine.has_geometry and options.part_zero_mm is not None and options.tool_length_mm is not None
    if not known:
        message = (
            "the travel of the linear axes is not checked: that needs point_mm of both rotary axes, and "
            f"{flag(post, 'part_zero_mm', 'x,y,z')} and {flag(post, 'tool_length_mm', 'mm')}"
        )
        yield Finding(629, Level.INFO, message)
        return
    linear = setting.linear(positions.deg, positions.program.path.tips_mm)
    gauge = linear + np.array(setting.zero_mm) + setting.tool_length_mm * np.array(setting.machine.home_axis)
    for i, (low, high) in enumerate(limits):
        over: BoolArray = (gauge[:, i] < low) | (gauge[:, i] > high)
        message = f"{'XYZ'[i]} leaves its travel {low:g} to {high:g} mm; place the part elsewhere on the machine"
        yield from stretch_findings(program.path, positions.told(over), 629, Level.FAIL, message)
