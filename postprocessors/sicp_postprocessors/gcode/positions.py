"""What is written of each move: X Y Z and the words of the tool axis, rounded, divided where needed, and proved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import BoolArray, FloatArray, IntArray, Program
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.gcode.along import Angles, angles_along
from sicp_postprocessors.gcode.divide import axis_turns_deg, divided, last_pieces
from sicp_postprocessors.gcode.forward import axes_of
from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.setting import Setting
from sicp_postprocessors.gcode.ways import tip_deviations_mm
from sicp_postprocessors.numbers import rounded
from sicp_postprocessors.orientations import axis_errors_deg

__all__ = ["Positions", "positions_of"]

_MOST_PIECES = 10_000
_PASSES = 6
_SLACK = 1e-6
_LEAST_AXIS_DEG = 0.01
"""Pieces on which the tool axis turns less are not divided: at the pole an axis may turn while the tool stays."""


@dataclass(frozen=True, slots=True, eq=False)
class Positions:
    """The m moves that are written for the n moves of a program.

    Parameters
    ----------
    program
        With the m moves.
    pieces
        (n,) how many moves each one has become.
    origin
        (m,) the move that each of them is a part of.
    xyz
        (m, 3) numbers of the linear words, rounded, in the unit of the program.
    turn
        (m, 2) rotary words in the order of their letters, or (m, 3) vectors, rounded.
    angles
        Angles along the path as they were found; None for vectors.
    deg
        (m, 2) rounded angles of the first and second axis, through full turns; None for vectors.
    tip_errors_mm, axis_errors_deg
        (m,) how far tip and tool axis of the written numbers are from the path.
    off_way_mm
        (m,) how far the tip leaves its straight way on the move; 0 where the control holds it.
    """

    program: Program
    pieces: IntArray
    origin: IntArray
    xyz: FloatArray
    turn: FloatArray
    angles: Angles | None
    deg: FloatArray | None
    tip_errors_mm: FloatArray
    axis_errors_deg: FloatArray
    off_way_mm: FloatArray

    def told(self, moves: BoolArray) -> BoolArray:
        """Return which moves of the program as given (n,) have a written move marked in `moves` (m,)."""
        marked = np.zeros(len(self.pieces), np.bool_)
        marked[self.origin[moves]] = True
        return marked


def positions_of(program: Program, options: GCodeOptions, setting: Setting | None) -> Positions:
    """Return what is written for a program; `setting` is that of rotary words, None for vectors."""
    pieces = np.ones(len(program.path), np.int64)
    whole, origin, angles = program, np.arange(len(pieces)), _angles(program, options, setting)
    off = _off_way_mm(whole, options, setting, angles)
    for _ in range(_PASSES if options.axis_step_deg is not None else 0):
        needed = _needed(whole, options, angles, off)
        more = np.maximum.reduceat(needed, np.append(0, last_pieces(pieces)[:-1] + 1)) if len(pieces) else needed
        if (more <= 1).all():
            break
        pieces = np.minimum(pieces * more, _MOST_PIECES)
        if pieces.sum() > DEFAULT_LIMITS.path_points:
            break
        whole, origin = divided(program, pieces)
        angles = _angles(whole, options, setting)
        off = _off_way_mm(whole, options, setting, angles)
    return _written(whole, pieces, origin, options, setting, angles, off)


def _angles(program: Program, options: GCodeOptions, setting: Setting | None) -> Angles | None:
    if setting is None:
        return None
    return angles_along(setting.machine, program.path.axes, program.path.rapid, options.singular_cone_deg)


def _off_way_mm(program: Program, options: GCodeOptions, setting: Setting | None, angles: Angles | None) -> FloatArray:
    if setting is None or angles is None or options.knows_tip:
        return np.zeros(len(program.path))
    return tip_deviations_mm(setting, angles.deg, program.path.tips_mm)


def _needed(program: Program, options: GCodeOptions, angles: Angles | None, off: FloatArray) -> IntArray:
    """Return into how many pieces each move should be divided (n,)."""
    path, step = program.path, options.axis_step_deg or 360.0
    turned = axis_turns_deg(path.axes)
    needed = np.ones(len(path), np.int64)
    if angles is None:
        needed = np.ceil(turned / step - _SLACK).astype(np.int64)
    else:
        steps = np.abs(np.diff(angles.deg, axis=0)).max(axis=1, initial=0.0)
        needed[1:] = np.ceil(steps / step - _SLACK)
        needed = np.minimum(needed, np.ceil(turned / _LEAST_AXIS_DEG))
        needed = np.maximum(needed, np.ceil(np.sqrt(off / options.tip_tolerance_mm) - _SLACK))
    needed = np.clip(needed, 1, _MOST_PIECES).astype(np.int64)
    needed[path.rapid] = 1
    needed[:1] = 1
    return needed


def _written(
    program: Program,
    pieces: IntArray,
    origin: IntArray,
    options: GCodeOptions,
    setting: Setting | None,
    angles: Angles | None,
    off_way_mm: FloatArray,
) -> Positions:
    path, factor = program.path, mm_per_unit(options.units)
    if setting is None or angles is None:
        xyz, turn = rounded(path.tips_mm / factor, options.position_decimals), rounded(path.axes, options.axis_decimals)
        off = np.linalg.norm(xyz * factor - path.tips_mm, axis=1)
        errors = axis_errors_deg(path.axes, turn / np.linalg.norm(turn, axis=1, keepdims=True))
        return Positions(program, pieces, origin, xyz, turn, None, None, off, errors, off_way_mm)
    deg = rounded(angles.deg, options.angle_decimals)
    words = _wrapped(setting.machine, deg, options.angle_decimals)
    # The linear axes answer to the angles as they are written, so that their rounding does not move the tip.
    linear = path.tips_mm if options.knows_tip else setting.linear(words, path.tips_mm)
    xyz = rounded(linear / factor, options.position_decimals)
    tips = xyz * factor if options.knows_tip else setting.tips(words, xyz * factor)
    order = np.argsort([axis.letter for axis in setting.machine.rotaries])
    return Positions(
        program,
        pieces,
        origin,
        xyz,
        words[:, order],
        angles,
        deg,
        np.linalg.norm(tips - path.tips_mm, axis=1),
        axis_errors_deg(path.axes, axes_of(setting.machine, words)),
        off_way_mm,
    )


def _wrapped(machine: Machine, deg: FloatArray, decimals: int) -> FloatArray:
    """Return angles (m, 2) as their words state them: through full turns, or within one."""
    words = deg.copy()
    for i, axis in enumerate(machine.rotaries):
        if axis.wrap == "0..360":
            words[:, i] = rounded(np.remainder(deg[:, i], 360.0), decimals)
            words[words[:, i] >= 360.0, i] = 0.0
        elif axis.wrap == "+-180":
            words[:, i] = rounded(deg[:, i] - 360.0 * np.ceil((deg[:, i] - 180.0) / 360.0), decimals)
    return words
