"""Read tool paths from DXF drawings: curves joined to chains and loops, each a cut after a rapid move to its begin.

A drawing knows neither tool axis nor feeds, nor how the tool comes to a curve. Unless a clearance is stated, the rapid
moves between chains are straight, whatever lies in their way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from sicp_cam.errors import FormatError, JobError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, ToolPath
from sicp_formats.dxf.chains import (
    SAME_PLACE_MM,
    BranchingError,
    Direction,
    Strand,
    directed,
    in_nearest_order,
    joined,
    near_ends,
    unrepeated,
)
from sicp_formats.dxf.loading import load
from sicp_formats.dxf.strands import strands_of
from sicp_formats.dxf.units import state_unit
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList, check_options
from sicp_formats.source import read_bytes

__all__ = ["read_path"]

_MOST_IN_NEAREST_ORDER = 20_000
_ORDERS = ("file", "nearest")


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    layers: str | None = None,
    gap_mm: float = 0.01,
    axis: tuple[float, float, float] | None = None,
    order: Literal["file", "nearest"] = "file",
    direction: Direction = "file",
    start_mm: tuple[float, float, float] | None = None,
    clearance_mm: float | None = None,
) -> ToolPath:
    """Read a DXF drawing (R12 to R2018, text or binary) into a path in mm, with one tool axis.

    The visible curves of the model space are read: LINE, ARC, CIRCLE, ELLIPSE, LWPOLYLINE, POLYLINE, SPLINE, also those
    of blocks, wherever those are inserted. A chain runs as its first curve in the file does.

    Parameters
    ----------
    path
        The file.
    units
        Unit of a drawing that states none ($INSUNITS); must not contradict one that does.
    limits
        Caps on the file and the path.
    recover
        True to repair damaged drawings; each kind of repair is a finding.
    feed_mm_min
        Feed for all cutting moves; a drawing has none.
    chord_mm, step_mm
        How far a piece of a curve may lie from it, and how long it may be.
    layers
        Layers that are read, separated by commas, with the wildcards ``*`` and ``?``; needed if several have curves.
    gap_mm
        Largest gap between the ends of two curves that are joined; 0 joins what meets exactly.
    axis
        Tool axis (tip to holder) of the whole path; (0, 0, 1) is assumed if it is left out.
    order
        ``file`` for chains as they stand in the file, ``nearest`` to go on with the one that begins nearest.
    direction
        Direction of closed chains as seen against the tool axis: ``ccw`` counter-clockwise, ``cw`` clockwise, or as in
        the ``file``. Open chains keep theirs.
    start_mm
        Closed chains begin at their point nearest to this one; with ``nearest`` the first chain is the one near it.
    clearance_mm
        How far above the highest point of all chains, along the tool axis, the rapid moves run; from there the tool
        goes down to each chain with the feed of the path, and up again behind it. Without it nothing is lifted.

    Raises
    ------
    FormatError
        With the line or the entity, if the drawing is damaged or must not be guessed at.
    UnitError
        If no unit is known, or `units` is unknown or contradicts the drawing.
    JobError
        If another option is not valid.
    """
    check_options(feed_mm_min=feed_mm_min, chord_mm=chord_mm, step_mm=step_mm)
    _check_choices(gap_mm, axis, order, direction, clearance_mm)
    start = None if start_mm is None else np.array(start_mm, dtype=np.float64)
    content = read_bytes(path, limits)
    moves = MoveList(path, limits, units, chord_mm, step_mm)
    drawing, tags = load(path, content, moves.tally, recover=recover)
    state_unit(moves, tags)
    strands = strands_of(moves, drawing, tags, layers, recover=recover)
    tool_axis: Vector = axis or (0.0, 0.0, 1.0)
    chains = [directed(chain, direction, np.array(tool_axis), start) for chain in _chains(moves, strands, gap_mm)]
    if axis is None:
        moves.note(Notice.AXIS_ASSUMED, 0)
    lift = _Lift.above(chains, tool_axis, clearance_mm)
    for chain in _in_order(path, chains, order, start):
        _append(moves, chain, tool_axis, lift)
    return moves.build(content, format="DXF", feed_mm_min=feed_mm_min)


@dataclass(frozen=True, slots=True)
class _Lift:
    """How the tool clears the part between chains: along the unit axis, up to a height (mm) measured along it."""

    axis: FloatArray
    height_mm: float

    @classmethod
    def above(cls, chains: list[Strand], axis: Vector, clearance_mm: float | None) -> _Lift | None:
        """Return the lift to a clearance above the highest point of all chains; None without a clearance."""
        if clearance_mm is None or not chains:
            return None
        up = np.array(axis) / np.abs(axis).max()
        up /= np.linalg.norm(up)
        return cls(up, max(float((chain.points @ up).max()) for chain in chains) + clearance_mm)

    def over(self, point: FloatArray) -> Vector:
        """Return the place at the height of the lift that lies over a point (3,)."""
        x, y, z = (point + (self.height_mm - point @ self.axis) * self.axis).tolist()
        return (x, y, z)


def _check_choices(gap_mm: float, axis: Vector | None, order: str, direction: str, clearance_mm: float | None) -> None:
    """Refuse options out of their range, all at once, with a JobError."""
    problems = []
    if not (math.isfinite(gap_mm) and gap_mm >= 0.0):
        problems.append(f"path.gap_mm = {gap_mm} must be 0 or a positive number")
    if clearance_mm is not None and not (math.isfinite(clearance_mm) and clearance_mm > 0.0):
        problems.append(f"path.clearance_mm = {clearance_mm} must be a positive number")
    if axis is not None and not (all(map(math.isfinite, axis)) and any(axis)):
        problems.append(f"path.axis = {axis} must be a direction")
    for key, value, choices in (("order", order, _ORDERS), ("direction", direction, get_args(Direction))):
        if value not in choices:
            problems.append(f"path.{key} = {value!r} must be one of {', '.join(choices)}")
    if problems:
        raise JobError(*problems)


def _chains(moves: MoveList, strands: list[Strand], gap_mm: float) -> list[Strand]:
    """Join the curves; refuse branchings, and note curves on top of others and ends that nearly meet."""
    strands, repeated = unrepeated(strands)
    for strand in repeated:
        moves.note(Notice.CURVE_REPEATED, int(strand.lines[0]), strand.name)
    try:
        chains = joined(strands, SAME_PLACE_MM)
        if gap_mm > SAME_PLACE_MM:
            chains = joined(chains, gap_mm)
    except BranchingError as problem:
        x, y, z = problem.place
        what = f"{problem.strand.name}: more than two curves end at ({x:.6g}, {y:.6g}, {z:.6g}) mm"
        remedy = "choose the layers of the path with --set path.layers=..., or trim the drawing"
        raise FormatError(moves.path, f"{what}; {remedy}", line=int(problem.strand.lines[0]) or None) from None
    count, widest_mm, line = near_ends(chains, gap_mm)
    if count:
        moves.note(Notice.ENDS_APART, line, f"up to {widest_mm:.4g} mm away", count=count)
    return chains


def _in_order(path: Path, chains: list[Strand], order: str, start: FloatArray | None) -> list[Strand]:
    if order == "file":
        return chains
    if len(chains) > _MOST_IN_NEAREST_ORDER:
        what = f"has {len(chains)} chains, too many for path.order = nearest; read them in the order of the file"
        raise FormatError(path, what)
    return in_nearest_order(chains, start)


def _append(moves: MoveList, chain: Strand, axis: Vector, lift: _Lift | None) -> None:
    """Append a rapid move to the begin of a chain or over it, the cuts along it, and the retract over its end."""
    first, last = int(chain.lines[0]), int(chain.lines[-1])
    if lift is None:
        moves.note(Notice.NO_RETRACT, first)
    else:
        moves.move(lift.over(chain.points[0]), axis, 0.0, True, first)
    x, y, z = chain.points[0].tolist()
    moves.move((x, y, z), axis, 0.0, lift is None, first)
    for (x, y, z), line in zip(chain.points[1:].tolist(), chain.lines.tolist(), strict=True):
        moves.move((x, y, z), axis, 0.0, False, line)
    if lift is not None:
        moves.move(lift.over(chain.points[-1]), axis, 0.0, True, last)
