"""What the operator of a five-axis control should know of a program, or why it may not be written.

Codes: 620 an axis is held at the pole, 621 beyond the travel, 622 a large turn in one cut, 623 no work offset,
624 a direction out of reach, 625 moves divided or not divided enough, 626 what the control must see to itself,
627 rapid moves whose tip leaves the straight line, 628 inverse time, 629 linear travel.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import BoolArray, FloatArray, IntArray, Program
from sicp_postprocessors.checks import frame_name, in_scan_frame, stretch_findings
from sicp_postprocessors.gcode.along import Angles, over_travel
from sicp_postprocessors.gcode.divide import axis_turns_deg
from sicp_postprocessors.gcode.feeds import LEAST_INVERSE
from sicp_postprocessors.gcode.forward import axes_of
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions, Setting
from sicp_postprocessors.moves import tools_in_use
from sicp_postprocessors.options import flag
from sicp_postprocessors.orientations import axis_errors_deg
from sicp_postprocessors.text import counted

__all__ = [
    "control_findings",
    "division_findings",
    "rotary_findings",
    "time_findings",
    "travel_findings",
    "without_tip_findings",
]

_ALLOWED_DEG = 2.0
"""How far the tool axis may leave the shortest way where the travel makes an axis turn back within a cut."""
_OPPOSITE_DEG = 179.9


def control_findings(post: str, program: Program, options: GCodeOptions) -> Iterator[Finding]:
    """Return what the control must hold or do that the program does not say."""
    if not options.work_offset:
        message = (
            f"no work offset is written: the coordinates are those of the {frame_name(program)} frame, and the active "
            "offset must hold that frame"
        )
        if options.control.offset:
            message += f"; name one with {flag(post, 'work_offset', options.control.offset)}"
        yield Finding(623, Level.INFO, message)
    if options.dialect == "linuxcnc" and options.knows_tip and not options.tcp_on:
        message = (
            "no words switch the kinematics that hold the tip: they must be active; if the site has words for it, name "
            f"them with {flag(post, 'tcp_on', 'M428')} and {flag(post, 'tcp_off', 'M429')}"
        )
        yield Finding(626, Level.WARN, message)


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
    steps = np.zeros(len(deg))
    steps[1:] = np.abs(np.diff(deg, axis=0)).max(axis=1, initial=0.0)
    large = (steps > options.rotary_step_deg) & ~written.rapid
    doubtful = np.flatnonzero((large | angles.forced) & (np.arange(len(deg)) > 0))
    off = np.zeros(len(deg))
    off[doubtful] = _way_errors_deg(setting, deg, written.axes, doubtful)
    turned_back = angles.forced & (off > _ALLOWED_DEG)
    yield from stretch_findings(
        program.path,
        positions.told(turned_back),
        621,
        Level.FAIL,
        f"the travel of the axes makes them turn over within a cut, where the tool axis would leave its way by up to "
        f"{float(off[turned_back].max(initial=0.0)):.1f} degrees; retract there in CAM, or choose another machine",
    )
    fast = (
        f"a rotary axis turns further than {options.rotary_step_deg:g} degrees in one cutting move, and the tool axis "
        f"leaves the shortest way by up to {float(off[large].max(initial=0.0)):.2f} degrees; divide the move with "
        f"{flag(post, 'max_axis_step_deg', '3')}, or allow it with {flag(post, 'rotary_step_deg', 'degrees')}"
    )
    yield from stretch_findings(program.path, positions.told(large & ~turned_back), 622, Level.WARN, fast)


def _way_errors_deg(setting: Setting, deg: FloatArray, axes: FloatArray, moves: IntArray) -> FloatArray:
    """Return how far the tool axis leaves the shortest way on some moves, the most of three places on it.

    Between the two axes the distance from their great circle counts, beyond them that from the nearer one.
    """
    start, end = axes[moves - 1], axes[moves]
    normal, middle = _units(np.cross(start, end)), _units(start + end)
    has_circle = np.einsum("ni,ni->n", normal, normal) > 0.5
    worst = np.zeros(len(moves))
    for share in (0.25, 0.5, 0.75):
        on_way = axes_of(setting.machine, deg[moves - 1] + share * (deg[moves] - deg[moves - 1]))
        across = np.arcsin(np.minimum(np.abs(np.einsum("ni,ni->n", on_way, normal)), 1.0))
        between = np.einsum("ni,ni->n", on_way, middle) >= np.einsum("ni,ni->n", start, middle)
        nearer = np.minimum(axis_errors_deg(on_way, start), axis_errors_deg(on_way, end))
        worst = np.maximum(worst, np.where(between & has_circle, np.degrees(across), nearer))
    return worst


def _units(vectors: FloatArray) -> FloatArray:
    """Return vectors of length 1, but for those without a direction."""
    units: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return units


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
        "an axis turns while the tool hardly does; keep the tool off the pole in CAM, or use tip control",
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


def time_findings(
    program: Program, options: GCodeOptions, positions: Positions, feeds: FloatArray
) -> Iterator[Finding]:
    """Return which cutting moves have a time that cannot be written as inverse time."""
    if not options.states_time:
        return
    written = positions.program.path
    begins = np.zeros(len(feeds), np.bool_)
    begins[:1] = ~written.rapid[:1]
    yield from stretch_findings(
        program.path,
        positions.told(begins),
        628,
        Level.FAIL,
        "the path begins with a cutting move, whose time is not known; begin with a rapid move",
    )
    long = (feeds < LEAST_INVERSE) & ~written.rapid & ~begins
    message = f"the move takes more than {1.0 / LEAST_INVERSE:g} minutes, too long for inverse time; divide it in CAM"
    yield from stretch_findings(program.path, positions.told(long), 628, Level.FAIL, message)
    short = (feeds >= (options.control.largest_inverse or np.inf)) & ~written.rapid & ~begins
    message = f"the move takes less than 1/{options.control.largest_inverse:g} minutes and is made slower"
    yield from stretch_findings(program.path, positions.told(short), 628, Level.INFO, message)
