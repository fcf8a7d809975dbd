"""How many full turns each piece of a path is wound by, so that the travel of the axes is kept.

Within a cut an axis runs on from move to move; only a rapid move may turn it back. So the path falls into pieces that
begin with rapid moves, and of each piece it is to be chosen with which of the two solutions it begins and by how many
turns it is wound: a shortest path over the pieces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from sicp_cam.model import FloatArray, IntArray
from sicp_postprocessors.gcode.machine import Machine, RotaryAxis

__all__ = ["Piece", "State", "best_states", "shift_within", "turn_range"]

State: TypeAlias = tuple[int, int, int]
"""The solution that a piece begins with, and full turns added to the first and second axis."""

_PENALTY = 1e4
_SLACK_DEG = 1e-6
_LIKES_SMALL = 1e-3
"""How little it counts to begin near zero, and with the first solution: enough to decide between equals."""


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A piece of the path as it runs if it begins with one solution: (2,) angles of both axes, in degrees."""

    begin: FloatArray
    end: FloatArray
    lowest: FloatArray
    highest: FloatArray
    penalty: float


def turn_range(axis: RotaryAxis, lowest: float, highest: float) -> range:
    """Return the numbers of turns by which angles from lowest to highest can be wound within the travel of an axis.

    >>> axis = RotaryAxis("C", (0.0, 0.0, 1.0), "head", limits_deg=(-360.0, 360.0))
    >>> list(turn_range(axis, 10.0, 200.0)), list(turn_range(axis, -10.0, 800.0))
    ([-1, 0], [])
    """
    if axis.wrap != "none" or not axis.turns_on:
        return range(1)
    least, most = axis.limits_deg
    first = math.ceil((least - lowest - _SLACK_DEG) / 360.0)
    return range(first, max(first, math.floor((most - highest + _SLACK_DEG) / 360.0) + 1))


def shift_within(axis: RotaryAxis, lowest: float, highest: float) -> int | None:
    """Return the least number of turns, either way, that keeps angles within the travel of an axis; None if none does.

    >>> axis = RotaryAxis("C", (0.0, 0.0, 1.0), "head", limits_deg=(-360.0, 360.0))
    >>> shift_within(axis, 0.0, 700.0)
    -1
    """
    return min(turn_range(axis, lowest, highest), key=abs, default=None)


def best_states(machine: Machine, pieces: list[tuple[Piece, Piece]]) -> list[State]:
    """Return the state of each piece for which the axes turn least from piece to piece, and keep their travel.

    `pieces` holds each piece as it runs from either solution. One that no number of turns brings within the travel
    gets the number that leaves it least, at a penalty.
    """
    steps: list[IntArray] = []
    layers: list[list[State]] = []
    costs, ends = np.zeros(0), np.zeros((0, 2))
    for number, pair in enumerate(pieces):
        states, begins, after, price = _states(machine, pair)
        if number == 0:
            price = price + _LIKES_SMALL * (np.abs(begins).sum(axis=1) + np.array([s[0] for s in states]))
            costs = price
            steps.append(np.zeros(len(states), np.int64))
        else:
            ways = costs[:, None] + np.abs(ends[:, None] - begins[None]).sum(axis=2)
            steps.append(np.argmin(ways, axis=0))
            costs = ways.min(axis=0) + price
        layers.append(states)
        ends = after
    chosen, now = [], int(np.argmin(costs))
    for states, step in zip(reversed(layers), reversed(steps), strict=True):
        chosen.append(states[now])
        now = int(step[now])
    return chosen[::-1]


def _states(machine: Machine, pair: tuple[Piece, Piece]) -> tuple[list[State], FloatArray, FloatArray, FloatArray]:
    states, begins, ends, prices = [], [], [], []
    for solution, piece in enumerate(pair):
        ranges, price = [], piece.penalty
        for which, axis in enumerate(machine.rotaries):
            turns = turn_range(axis, piece.lowest[which], piece.highest[which])
            if not turns:
                centre = (sum(axis.limits_deg) - piece.lowest[which] - piece.highest[which]) / 720.0
                turns = range(round(centre), round(centre) + 1)
                price += _PENALTY * (piece.highest[which] - piece.lowest[which])
            ranges.append(turns)
        for first in ranges[0]:
            for second in ranges[1]:
                wound = 360.0 * np.array([first, second])
                states.append((solution, first, second))
                begins.append(piece.begin + wound)
                ends.append(piece.end + wound)
                prices.append(price)
    return states, np.array(begins), np.array(ends), np.array(prices)
