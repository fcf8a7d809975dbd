"""What a path asks of an arm: reach, joint limits, one configuration for the whole path, singular places, joint speeds.

Codes: 664 out of reach, 665 joint limit, 666 configuration, 667 near a singular place, 668 joint speed, 669 what was
checked and what was not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, FloatArray, IntArray, ToolPath
from sicp_postprocessors.arm.along import JointPath, Places, places_along
from sicp_postprocessors.arm.choice import Choice, choose, matching, possible
from sicp_postprocessors.arm.kinematics import Configuration
from sicp_postprocessors.arm.model import Arm
from sicp_postprocessors.checks import move_place
from sicp_postprocessors.path_checks import stretches_told
from sicp_postprocessors.text import counted

__all__ = ["arm_findings", "no_arm_finding"]

_STEP_MM = 10.0
_STEP_DEG = 1.0
_ON_AXIS = 1e-6

Ask = Callable[[Configuration], str]
"""Says how to ask for a configuration, in the words of the command line."""


def no_arm_finding(remedy: str) -> Finding:
    """Return what is told where no arm is given."""
    return Finding(669, Level.INFO, f"reach, joint limits and joint speeds are not checked; {remedy}")


def arm_findings(
    path: ToolPath,
    tips_world_mm: FloatArray,
    R_world_tool: FloatArray,
    speeds_mm_s: FloatArray,
    T_flange_tool: FloatArray,
    arm: Arm,
    *,
    asked: tuple[str, ...] = (),
    singular_deg: float = 2.0,
    ask: Ask = str,
) -> list[Finding]:
    """Return what a path asks of an arm that it cannot do, or not well.

    Parameters
    ----------
    path
        The path, for the places of the findings.
    tips_world_mm, R_world_tool
        (n, 3) tips and (n, 3, 3) rotations of the tool in the controller's world. The first move goes any way to its
        end, the others are straight.
    speeds_mm_s
        (n,) speed of the tip on each move.
    T_flange_tool
        (4, 4) pose of the tool in the flange.
    arm
        The arm.
    asked
        Words of the configuration at the first move, `lefty` and so on; what is left out may be either.
    singular_deg
        Bend of elbow or wrist below which the arm is near a singular place.
    ask
        Says how to ask for a configuration.
    """
    step_deg = min(_STEP_DEG, singular_deg / 2.0)
    joint_moves = np.zeros(len(path), np.bool_)
    places = places_along(
        tips_world_mm, R_world_tool, speeds_mm_s, joint_moves, T_flange_tool, step_mm=_STEP_MM, step_deg=step_deg
    )
    choice = choose(arm, places, matching(asked))
    followed = choice.followed
    return [
        *_spindle_findings(arm, T_flange_tool),
        *_reach_findings(path, arm, places, followed),
        *_limit_findings(path, arm, places, followed),
        *_configuration_findings(path, arm, places, choice, ask),
        *_singular_findings(path, arm, places, followed, singular_deg),
        *_speed_findings(path, arm, places, followed, speeds_mm_s),
        _summary(arm, places, choice),
    ]


def _spindle_findings(arm: Arm, T_flange_tool: FloatArray) -> list[Finding]:
    if not arm.joints[5].spindle:
        return []
    off_axis = np.abs(np.concatenate([T_flange_tool[:2, 3], T_flange_tool[:2, 2]])).max()
    if off_axis <= _ON_AXIS and T_flange_tool[2, 2] > 0.0:
        return []
    message = f"joint 6 of the {arm.name} is its spindle: the option tool must lie on its axis, as in 0,0,LENGTH,0,0,0"
    return [Finding(666, Level.FAIL, message)]


def _reach_findings(path: ToolPath, arm: Arm, places: Places, followed: JointPath) -> list[Finding]:
    beyond = places.worst(followed.solution.beyond_mm)

    def tell(run: slice) -> str:
        how = f"by up to {beyond[run].max():.3f} mm ({followed.configuration})"
        return f"out of reach of the {arm.name} {how}; move the part or the cell"

    return stretches_told(path, beyond > 0.0, 664, Level.FAIL, tell)


def _limit_findings(path: ToolPath, arm: Arm, places: Places, followed: JointPath) -> list[Finding]:
    findings = []
    for number in range(6):
        beyond = places.worst(followed.beyond_deg[:, number])
        if beyond.any():
            tell = _limit_teller(arm, places, followed, number)
            findings += stretches_told(path, beyond > 0.0, 665, Level.FAIL, tell)
    return findings


def _limit_teller(arm: Arm, places: Places, followed: JointPath, number: int) -> Callable[[slice], str]:
    joint, counts = arm.joints[number], followed.joints_deg[:, number]
    least, most = -places.worst(-counts), places.worst(counts)

    def tell(run: slice) -> str:
        low, high = float(least[run].min()), float(most[run].max())
        below = joint.lowest_deg - low > high - joint.highest_deg
        value, limit = (low, joint.lowest_deg) if below else (high, joint.highest_deg)
        more = f"; {arm.remark}" if arm.remark else ""
        turn = f"joint {number + 1} would come to {value:.3f} degrees, its limit is {limit:g}"
        return f"{turn} ({followed.configuration}){more}"

    return tell


def _configuration_findings(path: ToolPath, arm: Arm, places: Places, choice: Choice, ask: Ask) -> Iterator[Finding]:
    best = choice.followed.configuration
    if choice.good:
        if len(choice.good) < len(choice.asked):
            many = f" ({len(choice.good) - 1} more would do)" if len(choice.good) > 1 else ""
            message = (
                f"the path is followed in the configuration {best}{many}, but not in every one that the arm may be in "
                f"when it starts; bring it there, or ask for it: {ask(best)}"
            )
            yield Finding(666, Level.WARN, message, move_place(path, 0))
        yield from _start_findings(path, choice.followed)
    elif choice.others:
        told = "; ".join(str(c) for c in choice.others)
        message = f"the configuration that is asked for cannot follow the path, but these can: {told}"
        yield Finding(666, Level.FAIL, f"{message}; ask for one: {ask(choice.others[0])}", move_place(path, 0))
    else:
        yield from _change_findings(path, arm, places, choice.followed)


def _start_findings(path: ToolPath, followed: JointPath) -> Iterator[Finding]:
    """Tell from where a joint must not start, because the path turns it beyond its limit later."""
    for number, bad in enumerate(followed.bad_starts_deg):
        if bad:
            start = float(followed.joints_deg[0, number])
            wrong = " or ".join(f"{count:.1f}" for count in bad)
            message = (
                f"bring joint {number + 1} near {start:.1f} degrees before the start: from {wrong} degrees it would "
                "pass its limit on the way"
            )
            yield Finding(666, Level.WARN, message, move_place(path, 0))


def _change_findings(path: ToolPath, arm: Arm, places: Places, followed: JointPath) -> Iterator[Finding]:
    """Tell where no configuration comes, and where the arm would have to change it: within a cut, or between two."""
    cuts, cut_of_move = _cuts_of(path)
    if not cuts:
        yield Finding(666, Level.FAIL, "no configuration of the arm follows the path", move_place(path, 0))
        return
    found = possible(arm, places, cut_of_move, len(cuts))
    nowhere = places.worst(~found.places)
    told = "no configuration of the arm comes here within its joint limits"
    out_of_reach = places.worst(~followed.solution.reachable)
    yield from stretches_told(path, nowhere & ~out_of_reach, 666, Level.FAIL, lambda _: told)
    lost = np.isin(cut_of_move, np.flatnonzero(~np.any(list(found.cuts.values()), axis=0)))
    hopeless = np.isin(cut_of_move, np.unique(cut_of_move[nowhere]))
    change = "the arm would have to change its configuration within this cut: none follows the whole of it"
    yield from stretches_told(path, lost & ~hopeless, 666, Level.FAIL, lambda _: change)
    if not lost.any():
        spans = "; ".join(f"{move_place(path, *span)}: {c}" for span, c in _spans(cuts, found.cuts))
        message = f"no configuration follows the whole path; divide it at its rapid moves: {spans}"
        yield Finding(666, Level.FAIL, message, move_place(path, 0))


def _cuts_of(path: ToolPath) -> tuple[list[tuple[int, int]], IntArray]:
    """Return first and last move of each unbroken cut, and the number of the cut of each move (n,), -1 for none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~path.rapid, [False]]).astype(np.int8))).reshape(-1, 2)
    cut_of_move = np.full(len(path), -1, np.int64)
    for number, (first, end) in enumerate(edges.tolist()):
        cut_of_move[first:end] = number
    return [(first, end - 1) for first, end in edges.tolist()], cut_of_move


def _spans(
    cuts: list[tuple[int, int]], follows: dict[Configuration, BoolArray]
) -> Iterator[tuple[tuple[int, int], Configuration]]:
    """Yield spans of cuts, each as long as one configuration follows it, with that configuration."""
    first = 0
    while first < len(cuts):
        ends = {}
        for configuration, holds in follows.items():
            broken = np.flatnonzero(~holds[first:])
            ends[configuration] = first + int(broken[0]) if len(broken) else len(cuts)
        best = max(ends, key=lambda configuration: ends[configuration])
        yield (cuts[first][0], cuts[ends[best] - 1][1]), best
        first = ends[best]


def _singular_findings(
    path: ToolPath, arm: Arm, places: Places, followed: JointPath, singular_deg: float
) -> Iterator[Finding]:
    solution = followed.solution
    near_mm = math.sin(math.radians(singular_deg)) * arm.wrist_reach_mm[1]
    kinds = (
        (solution.wrist_deg, singular_deg, "the wrist is nearly straight: joint 5 bends {:.3g} degrees"),
        (solution.elbow_deg, singular_deg, "the arm is nearly stretched: the elbow bends {:.3g} degrees"),
        (solution.shoulder_mm, near_mm, "the wrist is nearly above or below axis 1: {:.3g} mm from it"),
    )
    for values, near, words in kinds:
        least = -places.worst(-np.where(solution.reachable, np.abs(values), np.inf))

        def tell(run: slice, least: FloatArray = least, words: str = words) -> str:
            return f"{words.format(float(least[run].min()))}, and joints may turn fast there"

        close = least < near
        yield from stretches_told(path, close & ~path.rapid, 667, Level.WARN, tell)
        yield from stretches_told(path, close & path.rapid, 667, Level.INFO, tell)


def _speed_findings(
    path: ToolPath, arm: Arm, places: Places, followed: JointPath, speeds_mm_s: FloatArray
) -> list[Finding]:
    """Tell where a joint would have to turn faster than it can at the speed of the move, and which speed would fit."""
    needed = np.zeros_like(followed.joints_deg)
    reached = followed.solution.reachable
    timed = np.isfinite(places.seconds[1:]) & reached[1:] & reached[:-1]
    steps = np.abs(np.diff(followed.joints_deg, axis=0))[timed]
    needed[1:][timed] = steps / places.seconds[1:][timed, None]
    needed_by_move = places.worst(needed)
    load = needed_by_move / arm.speeds_deg_s
    worst = load.max(axis=1)

    def tell(run: slice) -> str:
        row, number = np.unravel_index(int(np.argmax(load[run])), load[run].shape)
        speed = float(speeds_mm_s[run][row])
        fits = _rounded_down(speed / float(worst[run][row]) * 60.0)
        return (
            f"joint {number + 1} would have to turn {needed_by_move[run][row, number]:.4g} degrees/s, it can "
            f"{arm.joints[number].fastest_deg_s:g}: the arm will be slower than {speed * 60.0:.6g} mm/min; "
            f"{fits:g} mm/min would fit"
        )

    return stretches_told(path, worst > 1.0, 668, Level.WARN, tell)


def _rounded_down(value: float) -> float:
    """Return a number with three digits, never more than it is."""
    if value <= 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit) * unit


def _summary(arm: Arm, places: Places, choice: Choice) -> Finding:
    unknown = arm.unknown()
    margin = choice.followed.margin_deg
    near = f", {margin:.1f} degrees from the nearest joint limit" if choice.good and math.isfinite(margin) else ""
    left = f"; not checked: {', '.join(unknown)}" if unknown else ""
    left += f"; {arm.remark}" if arm.remark else ""
    message = (
        f"checked with a model of the {arm.name} at {counted(len(places.move), 'place')}, at most "
        f"{places.apart_mm:.3g} mm and {places.apart_deg:.3g} degrees apart, in the configuration "
        f"{choice.followed.configuration}{near}{left}"
    )
    return Finding(669, Level.INFO, message)
