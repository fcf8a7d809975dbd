"""Feeds as a control reads them: per minute, in degrees where the tool only turns, or as inverse time (G93)."""

from __future__ import annotations

import numpy as np

from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.gcode.divide import axis_turns_deg
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions
from sicp_postprocessors.numbers import rounded

__all__ = ["feed_decimals", "feeds_of", "least_feed", "only_turns"]

_DECIMALS = {"mm": 3, "inch": 4}
_LEAST_STEPS = 100
"""Below so many units of the last decimal the decimals do not state an inverse time well."""


def feed_decimals(options: GCodeOptions) -> int:
    """Return the decimals of F."""
    return options.control.inverse_decimals if options.states_time else _DECIMALS[options.units]


def least_feed(options: GCodeOptions) -> float:
    """Return the least number behind F that its decimals state: smaller ones of inverse time lose too much."""
    step: float = 10.0 ** -feed_decimals(options)
    return _LEAST_STEPS * step if options.states_time else step / 2.0


def feeds_of(positions: Positions, options: GCodeOptions) -> FloatArray:
    """Return the number behind F of each written move (m,); 0 for rapid moves.

    Per minute: the speed of the tip in the unit of the program; where the tip stays, the speed of the fastest rotary
    axis in degrees per minute, which is how controls read F then. Inverse time: 1 / T with T in minutes from the true
    length of the way of the tip, or from the turn where the tip stays.
    """
    path = positions.program.path
    feeds, turning = path.feeds_mm_min, only_turns(positions, options)
    if not options.states_time:
        feeds = np.where(turning, options.rotary_feed_deg_min, feeds / mm_per_unit(options.units))
        return np.where(path.rapid, 0.0, feeds)
    lengths = np.zeros(len(path))
    lengths[1:] = np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1)
    turning_minutes = np.where(turning, _turns(positions) / options.rotary_feed_deg_min, 0.0)
    minutes = np.maximum(turning_minutes, lengths / np.maximum(feeds, 1e-12))
    most = options.control.largest_inverse or 1.0
    return np.where(path.rapid, 0.0, 1.0 / np.maximum(minutes, 1.0 / most))


def only_turns(positions: Positions, options: GCodeOptions) -> BoolArray:
    """Return the cutting moves (m,) on which the tip stays where it is, as far as the decimals of the program tell."""
    path = positions.program.path
    tips = rounded(path.tips_mm / mm_per_unit(options.units), options.position_decimals)
    stays = np.zeros(len(path), np.bool_)
    stays[1:] = (np.diff(tips, axis=0) == 0.0).all(axis=1)
    return stays & ~path.rapid


def _turns(positions: Positions) -> FloatArray:
    """Return how far the axis that turns furthest turns on each move (m,), in degrees."""
    if positions.deg is None:
        return axis_turns_deg(positions.program.path.axes)
    turns = np.zeros(len(positions.deg))
    turns[1:] = np.abs(np.diff(positions.deg, axis=0)).max(axis=1)
    return turns
