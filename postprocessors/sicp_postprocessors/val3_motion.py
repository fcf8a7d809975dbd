"""Points, speeds and blends of a VAL3 program, as the variables that its statements name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.model import BoolArray, EventKind, FloatArray, ToolPath
from sicp_postprocessors.numbers import fixed, trimmed
from sicp_postprocessors.val3_options import Val3Options
from sicp_postprocessors.val3_poses import angles_from_axes
from sicp_postprocessors.val3_xml import Variable

__all__ = ["Motion", "blends_mm", "motion_of", "passed_points", "path_angles"]

_SPEED_DECIMALS = 6
_SMALLEST_BLEND_MM = 1e-3
_PASSED = (EventKind.COMMENT, EventKind.OTHER)
"""Events that the motion does not wait for."""


@dataclass(frozen=True, slots=True)
class Motion:
    """For each move the names of its point and its speed, and the variables that declare them."""

    points: list[str]
    speeds: list[str]
    variables: list[Variable]


def motion_of(path: ToolPath, options: Val3Options) -> Motion:
    """Return points and speeds of every move of a path whose feeds are checked."""
    points, point_variables = _points(path, options)
    speeds, speed_variables = _speeds(path, options)
    return Motion(points, speeds, [*speed_variables, *point_variables])


def path_angles(path: ToolPath, options: Val3Options) -> FloatArray:
    """Return rx, ry, rz (n, 3) in degrees of every move."""
    return angles_from_axes(path.axes, options.spin_deg, options.spin == "transport")


def _points(path: ToolPath, options: Val3Options) -> tuple[list[str], list[Variable]]:
    angles = path_angles(path, options)
    keep = {"shoulder": "ssame", "elbow": "esame", "wrist": "wsame"}
    values = [
        {
            **{name: fixed(v, options.decimals) for name, v in zip("xyz", tip, strict=True)},
            **{name: fixed(v, options.angle_decimals) for name, v in zip(("rx", "ry", "rz"), turn, strict=True)},
            **keep,
            "fatherId": "fPart[0]",
        }
        for tip, turn in zip(path.tips_mm.tolist(), angles.tolist(), strict=True)
    ]
    values[0] |= {"shoulder": options.shoulder, "elbow": options.elbow, "wrist": options.wrist}
    longest = options.max_points_per_array
    starts = range(0, len(values), longest)
    names = ["pPath"] if len(starts) == 1 else [f"pPath{number:03d}" for number in range(len(starts))]
    variables = [
        Variable(name, "pointRx", values[start : start + longest]) for name, start in zip(names, starts, strict=True)
    ]
    return [f"{names[i // longest]}[{i % longest}]" for i in range(len(values))], variables


def _speeds(path: ToolPath, options: Val3Options) -> tuple[list[str], list[Variable]]:
    """Give one mdesc to each pair of feed and blend; VAL3 counts in mm/s, the path in mm/min."""
    fastest = options.first_run_mm_s if options.first_run else np.inf
    rapid = _mdesc(min(options.rapid_mm_s, fastest), 0.0, options)
    start = {**rapid, "vel": trimmed(options.approach_vel_percent, 3)}
    cuts: dict[tuple[float, float], str] = {}
    names = ["mStart"]
    feeds = np.minimum(path.feeds_mm_min / 60.0, fastest).round(_SPEED_DECIMALS).tolist()
    later = zip(path.rapid.tolist()[1:], feeds[1:], blends_mm(path, options).tolist()[1:], strict=True)
    for is_rapid, feed, blend in later:
        names.append("mRapid" if is_rapid else cuts.setdefault((feed, blend), f"mCut[{len(cuts)}]"))
    variables = [Variable("mStart", "mdesc", [start]), Variable("mRapid", "mdesc", [rapid])]
    if cuts:
        variables.append(Variable("mCut", "mdesc", [_mdesc(feed, blend, options) for feed, blend in cuts]))
    return names, variables


def _mdesc(speed_mm_s: float, blend_mm: float, options: Val3Options) -> dict[str, str]:
    reach = trimmed(blend_mm, 6)
    return {
        "accel": trimmed(options.accel_percent, 3),
        # Full joint speed: the tip's speed limit is then what decides.
        "vel": "100",
        "decel": trimmed(options.accel_percent, 3),
        "tmax": trimmed(speed_mm_s, _SPEED_DECIMALS),
        "rmax": trimmed(options.rotation_deg_s, 3),
        "blend": "Cartesian" if blend_mm > 0 else "off",
        "leave": reach,
        "reach": reach,
    }


def passed_points(path: ToolPath) -> BoolArray:
    """Return where a move may run on into the next (n,): between two cutting moves, unless an event waits for its end.

    The first move never may, because it is a joint move; nor may the last.
    """
    cutting = ~path.rapid
    passed = np.zeros(len(path), np.bool_)
    passed[1:-1] = cutting[1:-1] & cutting[2:]
    passed[[e.before_move - 1 for e in path.events if e.before_move > 0 and e.kind not in _PASSED]] = False
    return passed


def blends_mm(path: ToolPath, options: Val3Options) -> FloatArray:
    """Return the blend distance of each move (n,), zero where the tool must come to its point.

    No blend is longer than half of the shorter neighbouring segment. It stays within the triangle of the point and the
    two places that lie the distance d before and behind it; where the path turns by t, the far side of that triangle
    passes the point at d sin(t / 2), and `blend_corner_mm` holds that down. Distances are `blend_mm` or go down by
    halves, so that a path of uneven spacing does not need one mdesc for every point; below a micrometre there is none.
    """
    blends = np.zeros(len(path))
    if not options.blends or len(path) < 3:
        return blends
    steps_mm = np.diff(path.tips_mm, axis=0)
    lengths = np.linalg.norm(steps_mm, axis=1)
    turns = np.diff(steps_mm / np.maximum(lengths, 1e-9)[:, None], axis=0)
    corner = options.blend_corner_mm / np.maximum(np.linalg.norm(turns, axis=1) / 2.0, 1e-9)
    longest = np.minimum(np.minimum(lengths[:-1], lengths[1:]) / 2.0, corner)
    halvings = np.ceil(np.log2(options.blend_mm / np.maximum(longest, 1e-9)))
    blends[1:-1] = options.blend_mm / 2.0 ** np.maximum(halvings, 0.0)
    blends[~passed_points(path) | (blends < _SMALLEST_BLEND_MM)] = 0.0
    return blends
