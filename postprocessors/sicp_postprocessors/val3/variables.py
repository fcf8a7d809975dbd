"""The global variables of a VAL3 application: points, speeds, tools, outputs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sicp_cam.model import EventKind, FloatArray, IntArray, ToolPath
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import Six
from sicp_postprocessors.robot_findings import changes_tool_by_hand
from sicp_postprocessors.rows import rows
from sicp_postprocessors.val3.options import Val3Options
from sicp_postprocessors.val3.xml import Variable

__all__ = ["event_variables", "point_variables", "pose_attributes", "speed_variables", "speeds_of"]

_SPEED_DECIMALS = 6


def pose_attributes(six: Six | tuple[float, ...], father: str) -> dict[str, str]:
    """Return a pose as the attributes of a frame or tool."""
    names, decimals = ("x", "y", "z", "rx", "ry", "rz"), (6, 6, 6, 9, 9, 9)
    values = {name: trimmed(v, d) for name, v, d in zip(names, six, decimals, strict=True)}
    return values | {"fatherId": father}


def point_variables(path: ToolPath, angles_deg: FloatArray, options: Val3Options) -> list[Variable]:
    """Return the arrays of points of a path: pPath, or pPath000, pPath001, ... where one would be too long."""
    place, angle = options.decimals, options.angle_decimals
    position = " ".join(f'{name}="{{:.{place}}}"' for name in "xyz")
    turn = " ".join(f'{name}="{{:.{angle}}}"' for name in ("rx", "ry", "rz"))
    keys, longest = np.arange(len(path)) % options.max_points_per_array, options.max_points_per_array
    keep = _configuration("ssame", "esame", "wsame")
    values = rows(f'<Value key="{{:d}}" {position} {turn} {keep} />', keys, *path.tips_mm.T, *angles_deg.T)
    values[0] = values[0].replace(keep, _configuration(options.shoulder, options.elbow, options.wrist))
    starts = range(0, len(values), longest)
    names = ["pPath"] if len(starts) == 1 else [f"pPath{number:03d}" for number in range(len(starts))]
    return [
        Variable(name, "pointRx", lines=values[start : start + longest])
        for name, start in zip(names, starts, strict=True)
    ]


def _configuration(shoulder: str, elbow: str, wrist: str) -> str:
    return f'shoulder="{shoulder}" elbow="{elbow}" wrist="{wrist}" fatherId="fPart[0]"'


def speeds_of(feeds_mm_min: FloatArray, zones_mm: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return which pair of feed and zone each of n cuts has, and the pairs (m, 2) in mm/s and mm as they first come."""
    pairs = np.column_stack([(feeds_mm_min / 60.0).round(_SPEED_DECIMALS), zones_mm])
    unique, first, which = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[which.reshape(-1)], unique[order]


def speed_variables(cuts: FloatArray, rapid_mm_s: float, options: Val3Options) -> list[Variable]:
    """Return the speeds: mStart for the first point, mRapid, and mCut for pairs (m, 2) of feed, mm/s, and zone, mm."""
    rapid = _mdesc(rapid_mm_s, 0.0, options)
    start = {**rapid, "vel": trimmed(options.approach_percent, 3)}
    variables = [Variable("mStart", "mdesc", [start]), Variable("mRapid", "mdesc", [rapid])]
    if len(cuts):
        variables.append(Variable("mCut", "mdesc", [_mdesc(feed, zone, options) for feed, zone in cuts.tolist()]))
    return variables


def _mdesc(speed_mm_s: float, zone_mm: float, options: Val3Options) -> dict[str, str]:
    reach = trimmed(zone_mm, 6)
    return {
        "accel": trimmed(options.accel_percent, 3),
        # Full joint speed: the tip's speed limit is then what decides.
        "vel": "100",
        "decel": trimmed(options.accel_percent, 3),
        "tmax": trimmed(speed_mm_s, _SPEED_DECIMALS),
        "rmax": trimmed(options.rotation_deg_s, 3),
        "blend": "Cartesian" if zone_mm > 0 else "off",
        "leave": reach,
        "reach": reach,
    }


def event_variables(path: ToolPath, options: Val3Options) -> list[Variable]:
    """Return the variables that the statements of the events use, and no others."""
    kinds = {event.kind for event in path.events}
    variables = []
    if EventKind.SPINDLE in kinds:
        variables.append(Variable("doSpindle", "dio", [_link(options.spindle_output)]))
        if options.spindle_ccw_output:
            variables.append(Variable("doSpindleCcw", "dio", [_link(options.spindle_ccw_output)]))
        if options.spindle_speed == "num":
            variables.append(Variable("nSpindle", "num", [{"value": "0"}]))
        if options.spindle_speed == "aio":
            variables.append(Variable("aoSpindle", "aio", [_link(options.spindle_speed_output)]))
    if EventKind.COOLANT in kinds:
        variables.append(Variable("doCoolant", "dio", [_link(options.coolant_output)]))
    if EventKind.STOP in kinds or any(changes_tool_by_hand(event) for event in path.events):
        variables.append(
            Variable("diContinue", "dio", [_link(options.continue_input)])
            if options.continue_input
            else Variable("bContinue", "bool", [{"value": "false"}])
        )
    return variables


def _link(link: str) -> Mapping[str, str]:
    return {"link": link} if link else {}
