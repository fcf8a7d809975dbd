"""Angles of the two rotary axes along a path: without jumps, the shortest way, within the travel of the machine.

Of the two solutions of each direction that is taken which makes the whole way shortest. Near the pole, where the first
axis only spins the tool, it is held, and the second comes as near to the direction as it can. Angles run on through
full turns; where the travel is not long enough for that, a rapid move may turn an axis back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_postprocessors.gcode.branches import Changes, best_changes, followed
from sicp_postprocessors.gcode.inverse import second_for_held_first, solve
from sicp_postprocessors.gcode.machine import NO_LIMITS_DEG, Machine, RotaryAxis
from sicp_postprocessors.gcode.turns import Piece, best_states, shift_within

__all__ = ["Angles", "angles_along", "over_travel"]

_EDGE_DEG = 1e-6
_PENALTY = 1e4
_FIRST_LIKED = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Angles:
    """Angles along a path of n moves.

    Parameters
    ----------
    deg
        (n, 2) of the first and second rotary axis, through full turns.
    held
        (n,) True near the pole, where the first axis was held.
    beyond_deg
        (n,) how far the direction is out of reach of the machine.
    forced
        (n,) True where the travel makes the axes turn further than they otherwise would.
    """

    deg: FloatArray
    held: BoolArray
    beyond_deg: FloatArray
    forced: BoolArray


def angles_along(machine: Machine, axes: FloatArray, rapid: BoolArray, cone_deg: float) -> Angles:
    """Return the angles for unit vectors (n, 3) from tip to holder.

    Parameters
    ----------
    machine
        Its axes, their travel, and whether they run through full turns.
    axes
        (n, 3) in the part frame.
    rapid
        (n,) True where an axis may be turned back on the way to the move.
    cone_deg
        Within this angle of the pole the first axis is held; the tool axis is then wrong by at most this angle.

    Notes
    -----
    The path begins with the solution of larger second angle, and a first angle from -180 to 180, unless the other is
    shorter or the travel asks for another. Moves at the pole before anything else take the angle that follows.
    """
    found = solve(machine, axes)
    held = found.pole_deg <= cone_deg
    free = np.flatnonzero(~held)
    deg = np.zeros((len(axes), 2))
    forced = np.zeros(len(axes), np.bool_)
    if len(free):
        both = np.stack([found.first_deg[:, free], found.second_deg[:, free]], axis=2)
        cuts_on = np.diff(np.cumsum(rapid)[free]) == 0
        deg[free], forced[free] = _free_angles(machine, both, cuts_on)
    else:
        deg[:, 0] = min(max(0.0, machine.rotaries[0].limits_deg[0]), machine.rotaries[0].limits_deg[1])
    if held.any():
        source = _sources(held, rapid)
        deg[held, 0] = deg[source[held], 0]
        second = second_for_held_first(machine, axes[held], deg[held, 0])
        near = deg[source[held], 1] if len(free) else np.zeros(len(second))
        deg[held, 1] = _nearest(machine.rotaries[1], second, near)
    return Angles(deg, held, found.beyond_deg, forced)


def over_travel(axis: RotaryAxis, angles_deg: FloatArray) -> BoolArray:
    """Return which angles (n,) lie beyond the travel of an axis; none if it turns without end."""
    if axis.wrap != "none":
        return np.zeros(len(angles_deg), np.bool_)
    least, most = axis.limits_deg
    over: BoolArray = (angles_deg < least - _EDGE_DEG) | (angles_deg > most + _EDGE_DEG)
    return over


def _free_angles(machine: Machine, both: FloatArray, cuts_on: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return the angles (m, 2) chosen from both solutions (2, m, 2), and where the travel made the way longer."""
    placed = np.stack([_placed(axis, both[:, :, i]) for i, axis in enumerate(machine.rotaries)], axis=2)
    price = np.zeros(placed.shape[:2])
    for i, axis in enumerate(machine.rotaries):
        if not axis.turns_on:
            price += np.where(over_travel(axis, placed[:, :, i].ravel()).reshape(price.shape), _PENALTY, 0.0)
    changes, (from_0, from_1) = best_changes(_ways(machine, placed), price)
    start = 0 if from_0 <= from_1 + _FIRST_LIKED else 1
    solution = followed(changes, start, np.zeros(0, np.int64))
    one_piece = np.zeros(len(cuts_on) + 1, np.bool_)
    deg = _run_on(machine, placed[solution, np.arange(len(solution))], one_piece)
    wound = [shift_within(axis, d.min(), d.max()) for axis, d in zip(machine.rotaries, deg.T, strict=True)]
    if None not in wound:
        deg = deg + 360.0 * np.array(wound, np.float64)
    elif not cuts_on.all():
        deg = _wound_by_pieces(machine, placed, price, changes, cuts_on)
    if None in wound or price.any():
        return deg, _forced(machine, both, deg, cuts_on)
    return deg, one_piece


def _wound_by_pieces(
    machine: Machine, placed: FloatArray, price: FloatArray, changes: Changes, cuts_on: BoolArray
) -> FloatArray:
    """Return angles (m, 2) that turn back between cuts where they must."""
    starts = np.concatenate([[0], np.flatnonzero(~cuts_on) + 1])
    begins = np.zeros(len(cuts_on) + 1, np.bool_)
    begins[starts] = True
    runs, prices = [], []
    for solution in (0, 1):
        chosen = followed(changes, solution, starts)
        rows = np.arange(len(chosen))
        runs.append(_run_on(machine, placed[chosen, rows], begins))
        prices.append(np.add.reduceat(price[chosen, rows], starts))
    ends = np.append(starts[1:], len(begins)) - 1
    lows = [np.minimum.reduceat(run, starts) for run in runs]
    highs = [np.maximum.reduceat(run, starts) for run in runs]
    both = [
        [
            Piece(runs[s][starts[p]], runs[s][ends[p]], lows[s][p], highs[s][p], float(prices[s][p]))
            for p in range(len(starts))
        ]
        for s in (0, 1)
    ]
    states = np.array(best_states(machine, list(zip(*both, strict=True))))[np.cumsum(begins) - 1]
    deg: FloatArray = np.where(states[:, :1] == 0, runs[0], runs[1]) + 360.0 * states[:, 1:]
    return deg


def _forced(machine: Machine, both: FloatArray, deg: FloatArray, cuts_on: BoolArray) -> BoolArray:
    """Return the moves of cuts in which the axes turn further than they would if their travel had no end."""
    endless = [replace(axis, limits_deg=NO_LIMITS_DEG, wrap="+-180") for axis in machine.rotaries]
    freely, _ = _free_angles(replace(machine, rotaries=(endless[0], endless[1])), both, np.ones_like(cuts_on))
    further = np.abs(np.diff(deg, axis=0)).sum(axis=1) > np.abs(np.diff(freely, axis=0)).sum(axis=1) + _EDGE_DEG
    return np.concatenate([[False], further & cuts_on])


def _placed(axis: RotaryAxis, angles: FloatArray) -> FloatArray:
    """Return angles of any turn as the one that an axis of less than a turn can take, or that is nearest to it."""
    if axis.turns_on:
        return angles
    least, most = axis.limits_deg
    up = least - _EDGE_DEG + np.remainder(angles - least + _EDGE_DEG, 360.0)
    result: FloatArray = np.where(up - most > least - up + 360.0, up - 360.0, up)
    return result


def _nearest(axis: RotaryAxis, angles: FloatArray, near: FloatArray) -> FloatArray:
    """Return angles of any turn as they follow on `near`."""
    close: FloatArray = near + _short(angles - near)
    if axis.turns_on:
        return close
    return np.where(over_travel(axis, close), _placed(axis, angles), close)


def _ways(machine: Machine, placed: FloatArray) -> FloatArray:
    """Return how far the axes turn from each solution of a move to each of the next (2, 2, m - 1), in degrees."""
    ways = np.zeros((2, 2, placed.shape[1] - 1))
    for i, axis in enumerate(machine.rotaries):
        before, after = placed[:, None, :-1, i], placed[None, :, 1:, i]
        turns = np.abs(after - before)
        if axis.turns_on:
            turns = np.abs(_short(turns))
        elif axis.limits_deg[1] - axis.limits_deg[0] >= 360.0 - _EDGE_DEG:
            seam = _at_seam(axis, before) | _at_seam(axis, after)
            turns = np.where(seam, np.abs(_short(turns)), turns)
        ways += turns
    return ways


def _run_on(machine: Machine, chosen: FloatArray, begins: BoolArray) -> FloatArray:
    """Return angles (m, 2) that follow on one another, from -180 to 180 where a piece begins."""
    deg = chosen.copy()
    for i, axis in enumerate(machine.rotaries):
        if axis.turns_on:
            # Whole turns are counted, not steps added up, so that no error grows along the path.
            turns = np.concatenate([[0.0], np.cumsum(-np.round(np.diff(chosen[:, i]) / 360.0))])
            starts = np.flatnonzero(begins) if begins.any() else np.zeros(1, np.int64)
            wound = np.round(chosen[starts, i] / 360.0) + turns[starts]
            piece = np.searchsorted(starts, np.arange(len(deg)), side="right") - 1
            deg[:, i] = chosen[:, i] + 360.0 * (turns - wound[piece])
        else:
            _choose_seam(axis, deg[:, i])
    return deg


def _at_seam(axis: RotaryAxis, angles: FloatArray) -> BoolArray:
    least, most = axis.limits_deg
    seam: BoolArray = (np.abs(angles - least) <= 2 * _EDGE_DEG) | (np.abs(angles - most) <= 2 * _EDGE_DEG)
    return seam


def _choose_seam(axis: RotaryAxis, angles: FloatArray) -> None:
    """Let angles at either end of a full turn of travel follow on those before (in place)."""
    if axis.limits_deg[1] - axis.limits_deg[0] < 360.0 - _EDGE_DEG:
        return
    for move in np.flatnonzero(_at_seam(axis, angles)).tolist():
        near = angles[move - 1] if move else angles[min(1, len(angles) - 1)]
        angles[move] = min(max(near + float(_short(angles[move] - near)), axis.limits_deg[0]), axis.limits_deg[1])


def _short(angles: FloatArray) -> FloatArray:
    """Return angles from -180 to 180."""
    result: FloatArray = angles - 360.0 * np.round(angles / 360.0)
    return result


def _sources(held: BoolArray, rapid: BoolArray) -> IntArray:
    """Return the free move (n,) whose first angle a held one takes: before it in its piece, behind it, or before that.

    A piece begins with a rapid move: turning to the angle that a cut leaves the pole with belongs into it.
    """
    rows = np.arange(len(held))
    before = np.maximum.accumulate(np.where(held, -1, rows))
    behind = np.minimum.accumulate(np.where(held, len(held), rows)[::-1])[::-1]
    piece = np.cumsum(rapid)
    in_piece = (before >= 0) & (piece[before] == piece)
    follows = (behind < len(held)) & (piece[np.minimum(behind, len(held) - 1)] == piece)
    source = np.where(in_piece | ~follows, before, behind)
    # Before the first free move there is only what follows.
    return np.where(source < 0, np.minimum(behind, len(held) - 1), source)
