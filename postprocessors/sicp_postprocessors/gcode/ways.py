"""What happens between two blocks, where all axes move evenly: how far they turn, and where tool and tip go."""

from __future__ import annotations

import numpy as np

from sicp_cam.model import FloatArray, IntArray
from sicp_postprocessors.gcode.forward import axes_of
from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.setting import Setting
from sicp_postprocessors.orientations import axis_errors_deg

__all__ = ["axis_deviations_deg", "rotary_turns_deg", "tip_deviations_mm"]

_QUARTER_DEG = 60.0
"""A move is looked at in quarters and finer, so that its axes turn by no more than a quarter of this between."""
_SMALL_DEG = 3.01
"""Where both axes turn less, the way is an arc whose middle is the furthest off, but for less than a hundredth."""


def rotary_turns_deg(machine: Machine, deg: FloatArray) -> FloatArray:
    """Return the way of both axes on each move (n, 2), the first one having none.

    Axes whose words stay within a turn go the shorter way.
    """
    turns = np.zeros_like(deg)
    turns[1:] = np.diff(deg, axis=0)
    for i, axis in enumerate(machine.rotaries):
        if axis.wrap != "none":
            turns[:, i] -= 360.0 * np.round(turns[:, i] / 360.0)
    return turns


def axis_deviations_deg(machine: Machine, deg: FloatArray, axes: FloatArray, moves: IntArray) -> FloatArray:
    """Return how far the tool axis leaves the shortest way on some moves, the most of three places on it.

    Between the two axes the distance from their great circle counts, beyond them that from the nearer one.

    Parameters
    ----------
    machine
        Its rotary axes.
    deg
        (n, 2) angles of all moves.
    axes
        (n, 3) unit vectors of all moves.
    moves
        (m,) moves to look at; none of them the first.
    """
    start, end = axes[moves - 1], axes[moves]
    turns = rotary_turns_deg(machine, deg)[moves]
    normal, middle = _units(np.cross(start, end)), _units(start + end)
    has_circle = np.einsum("ni,ni->n", normal, normal) > 0.5
    worst = np.zeros(len(moves))
    for share in (0.25, 0.5, 0.75):
        on_way = axes_of(machine, deg[moves - 1] + share * turns)
        across = np.arcsin(np.minimum(np.abs(np.einsum("ni,ni->n", on_way, normal)), 1.0))
        between = np.einsum("ni,ni->n", on_way, middle) >= np.einsum("ni,ni->n", start, middle)
        nearer = np.minimum(axis_errors_deg(on_way, start), axis_errors_deg(on_way, end))
        worst = np.maximum(worst, np.where(between & has_circle, np.degrees(across), nearer))
    return worst


def tip_deviations_mm(setting: Setting, deg: FloatArray, tips_mm: FloatArray) -> FloatArray:
    """Return how far the tip gets from its straight way on each move (n,) if all axes move evenly and no control helps.

    It is measured half way, where an axis turns further than `_SMALL_DEG` at each quarter, and in more places where one
    turns far.
    """
    linear = setting.linear(deg, tips_mm)
    turns = rotary_turns_deg(setting.machine, deg)
    worst = np.zeros(len(deg))
    furthest = np.abs(turns).max(axis=1, initial=0.0)
    places = np.where(furthest <= _SMALL_DEG, 2, 4 * np.ceil(furthest / _QUARTER_DEG).astype(np.int64))
    places[:1] = 0
    for count in np.unique(places[places > 0]).tolist():
        moves = np.flatnonzero(places == count)
        for share in np.arange(1, count) / count:
            at = deg[moves - 1] + share * turns[moves]
            tips = setting.tips(at, linear[moves - 1] + share * (linear[moves] - linear[moves - 1]))
            straight = tips_mm[moves - 1] + share * (tips_mm[moves] - tips_mm[moves - 1])
            worst[moves] = np.maximum(worst[moves], np.linalg.norm(tips - straight, axis=1))
    return worst


def _units(vectors: FloatArray) -> FloatArray:
    """Return vectors of length 1, but for those without a direction."""
    units: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return units
