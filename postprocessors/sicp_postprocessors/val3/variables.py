"""The global variables of a VAL3 application: points, speeds, tools, outputs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from sicp_cam.model import Event, EventKind, FloatArray, IntArray, ToolPath
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import Six
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.val3.options import Val3Options
from sicp_postprocessors.val3.xml import Dialect, Variable

__all__ = [
    "array_names",
    "linked_variables",
    "number_variables",
    "other_variables",
    "payload_variables",
    "point_variables",
    "pose_attributes",
    "speed_variables",
    "speeds_of",
]

_SPEED_DECIMALS = 6
_SIX = ("x", "y", "z", "rx", "ry", "rz")


def pose_attributes(six: Six | tuple[float, ...], father: str) -> dict[str, str]:
    """Return a pose as the attributes of a frame or tool."""
    values = {name: trimmed(v, d) for name, v, d in zip(_SIX, six, (6, 6, 6, 9, 9, 9), strict=True)}
    return values | {"fatherId": father}


def array_names(name: str, count: int, longest: int) -> list[str]:
    """Return the names of the arrays that `count` elements need: one, or name000, name001, ...

    >>> array_names("pPath", 4, 4), array_names("pPath", 5, 4)
    (['pPath'], ['pPath000', 'pPath001'])
    """
    arrays = -(-count // longest)
    return [name] if arrays <= 1 else [f"{name}{number:03d}" for number in range(arrays)]


def point_variables(path: ToolPath, angles_deg: FloatArray, options: Val3Options, dialect: Dialect) -> list[Variable]:
    """Return the arrays of points of a path, in the frame fPart."""
    place, angle, longest = options.decimals, options.angle_decimals, options.max_points_per_array
    numbers = [f'{name}="{{:.{angle if name[0] == "r" else place}}}"' for name in _SIX]
    keep = {"shoulder": "ssame", "elbow": "esame", "wrist": "wsame"}
    chosen = {"shoulder": options.shoulder, "elbow": options.elbow, "wrist": options.wrist}
    columns = [np.arange(len(path)) % longest, *path.tips_mm.T, *angles_deg.T]
    lines = rows(dialect.point_row(numbers, keep, "fPart"), *columns)
    lines[0] = rows(dialect.point_row(numbers, chosen, "fPart"), *(column[:1] for column in columns))[0]
    return _arrays("pPath", "pointRx", lines, longest, "fPart")


def number_variables(
    name: str, numbers: IntArray, wanted: Iterable[int], longest: int, dialect: Dialect
) -> list[Variable]:
    """Return those arrays of whole numbers, parallel to the points, that are `wanted` by their number."""
    lines = rows(dialect.number_row(), np.arange(len(numbers)) % longest, numbers)
    arrays = _arrays(name, "num", lines, longest)
    return [arrays[which] for which in sorted(set(wanted))]


def _arrays(name: str, kind: str, lines: Sequence[str], longest: int, father: str = "") -> list[Variable]:
    names = array_names(name, len(lines), longest)
    return [
        Variable(each, kind, lines=lines[start * longest : (start + 1) * longest], father=father)
        for start, each in enumerate(names)
    ]


def speeds_of(feeds_mm_min: FloatArray, zones_mm: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return which pair of feed and zone each of n cuts has, and the pairs (m, 2) in mm/s and mm as they first come."""
    feeds, feed = np.unique((feeds_mm_min / 60.0).round(_SPEED_DECIMALS), return_inverse=True)
    zones, zone = np.unique(zones_mm, return_inverse=True)
    codes, first, which = np.unique(feed * max(len(zones), 1) + zone, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    chosen = codes[order]
    pairs = np.column_stack([feeds[chosen // max(len(zones), 1)], zones[chosen % max(len(zones), 1)]])
    return rank[which.reshape(-1)], pairs


def speed_variables(
    cuts: FloatArray, rapid_mm_s: float, options: Val3Options, dialect: Dialect, *, rapids: bool
) -> list[Variable]:
    """Return the speeds: mStart for the first point, mRapid, and mCut for pairs (m, 2) of feed, mm/s, and zone, mm."""
    speed = trimmed(rapid_mm_s, _SPEED_DECIMALS)
    rapid = _mdesc(options, tmax=speed, blend="off", zone="0")
    variables = [Variable("mStart", "mdesc", [{**rapid, "vel": trimmed(options.joint_percent, 3)}])]
    if rapids:
        variables.append(Variable("mRapid", "mdesc", [rapid]))
    if not len(cuts):
        return variables
    longest, (feeds, zones) = options.max_points_per_array, cuts.T
    template = dialect.speed_row(_mdesc(options, tmax=f"{{:.{_SPEED_DECIMALS}t}}", blend="{}", zone="{:.6t}"))
    blends = words(["off", dialect.blend])[(zones > 0).astype(np.int64)]
    lines = rows(template, np.arange(len(cuts)) % longest, feeds, blends, zones, zones)
    return variables + _arrays("mCut", "mdesc", lines, longest)


def _mdesc(options: Val3Options, *, tmax: str, blend: str, zone: str) -> dict[str, str]:
    return {
        "accel": trimmed(options.accel_percent, 3),
        # Full joint speed: the tip's speed limit is then what decides.
        "vel": "100",
        "decel": trimmed(options.accel_percent, 3),
        "tmax": tmax,
        "rmax": trimmed(options.rotation_deg_s, 3),
        "blend": blend,
        "leave": zone,
        "reach": zone,
    }


def linked_variables(events: Collection[Event], switched: Collection[str], options: Val3Options) -> dict[Variable, str]:
    """Return the variables of inputs and outputs that the statements of the events use, and what they are linked to."""
    kinds = {event.kind for event in events}
    links: dict[Variable, str] = {}
    if EventKind.SPINDLE in kinds:
        if options.spindle_output:
            links[Variable("doSpindle", "dio")] = options.spindle_output
        if options.spindle_ccw_output:
            links[Variable("doSpindleCcw", "dio")] = options.spindle_ccw_output
        if options.spindle_speed == "aio":
            links[Variable("aoSpindle", "aio")] = options.spindle_speed_output
    if EventKind.COOLANT in kinds:
        links[Variable("doCoolant", "dio")] = options.coolant_output
    links |= {Variable(name, "dio"): link for link, name in options.user_outputs.items() if link in switched}
    if options.continue_input and _waits_for_operator(events):
        links[Variable("diContinue", "dio")] = options.continue_input
    return links


def other_variables(events: Collection[Event], options: Val3Options) -> list[Variable]:
    """Return the numbers and truth values that the statements of the events use."""
    variables = []
    if options.spindle_speed == "num" and any(event.kind is EventKind.SPINDLE for event in events):
        variables.append(Variable("nSpindle", "num", [{"value": "0"}]))
    if not options.continue_input and _waits_for_operator(events):
        variables.append(Variable("bContinue", "bool", [{"value": "false"}]))
    return variables


def payload_variables(payload: tuple[float, float, float, float] | None) -> list[Variable]:
    """Return the mass in kg, its centre in the flange in mm, and an inertia of zero, for setPayload."""
    if payload is None:
        return []
    mass, *centre = payload
    pose: Mapping[str, str] = {name: trimmed(value, 6) for name, value in zip("xyz", centre, strict=True)}
    return [
        Variable("nMass", "num", [{"value": trimmed(mass, 6)}]),
        Variable("trMass", "trsf", [pose]),
        Variable("nInertia", "num", [{"value": "0"}]),
    ]


def _waits_for_operator(events: Iterable[Event]) -> bool:
    return any(event.kind is EventKind.STOP for event in events)
