"""What is odd or not allowed about a path, whatever machine runs it: work box, speeds, turns of the tool, crossings.

Codes: 660 leaves the work box, 661 too fast (tip, or turn of the tool axis), 662 odd motion (the axis flips, the cut
goes back on its way, moves without motion), 663 the path crosses itself, 669 not checked. Those of an arm
(`arm.findings`) lie between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, FloatArray, Program, ToolPath
from sicp_cam.ranges import Between
from sicp_cam.rigid_motion import apply
from sicp_postprocessors.checks import move_place
from sicp_postprocessors.crossings import crossings
from sicp_postprocessors.text import counted

__all__ = ["PreflightOptions", "path_findings", "stretches_told"]

_SHORTEST_STEP_MM = 0.01
"""Steps below this have no direction, and turns are taken as if made along it."""
_STILL_MM = 1e-6
_STILL_DEG = 1e-6
_BACK = np.cos(np.radians(150.0))
"""A step that turns by more than 150 degrees goes back on the one before."""
_ALONG = np.cos(np.radians(5.0))
"""A step within 5 degrees of the tool axis plunges or lifts."""
_FLIP_DEG = 90.001
_MOST_TOLD = 10
_AXES = "xyz"


@dataclass(frozen=True, slots=True)
class PreflightOptions:
    """What every path is checked for; posts take these options beside their own."""

    work_box_mm: tuple[float, float, float, float, float, float] | None = None
    """Two opposite corners x, y, z of the box that the tip may not leave, in the machine's world; none: not checked."""
    max_feed_mm_min: Annotated[float | None, Between(0.001, 1e7)] = None
    """Tip speed that no cutting move may exceed; none: not checked."""
    max_axis_deg_mm: Annotated[float, Between(0.001, 1e6)] = 5.0
    """Turn of the tool axis per millimetre of cut above which it is told as a warning."""
    max_axis_deg_s: Annotated[float, Between(0.001, 1e6)] = 90.0
    """Turn of the tool axis per second, at the feed of the path, above which it is told as a warning."""
    check_crossings: bool = True
    """Look for places where the cut crosses itself."""


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """For each move (n,): whether it cuts on from the place before, its length, and how far the tool axis turns."""

    cuts: BoolArray
    lengths_mm: FloatArray
    turns_deg: FloatArray


def _motion_of(path: ToolPath) -> _Motion:
    cuts = ~path.rapid
    cuts[:1] = False
    lengths, turns = np.zeros(len(path)), np.zeros(len(path))
    lengths[1:] = _norms(np.diff(path.tips_mm, axis=0))
    # From the chord, not from the cosine: exact for small turns.
    turns[1:] = np.degrees(2.0 * np.arcsin(np.minimum(_norms(np.diff(path.axes, axis=0)) / 2.0, 1.0)))
    return _Motion(cuts, lengths, turns)


def _norms(vectors: FloatArray) -> FloatArray:
    norms: FloatArray = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
    return norms


def path_findings(program: Program, T_world_program: FloatArray, options: PreflightOptions) -> list[Finding]:
    """Return what is odd or not allowed about a path, each as a stretch of moves.

    Parameters
    ----------
    program
        A program whose path has passed the checks of every post: finite numbers, unit axes, feeds.
    T_world_program
        (4, 4) pose of the program frame in the machine's world, in which the work box stands.
    options
        The limits.
    """
    path = program.path
    motion = _motion_of(path)
    return [
        *_box_findings(path, T_world_program, options),
        *_feed_findings(path, options),
        *_turn_findings(path, motion, options),
        *_motion_findings(path, motion),
        *(_crossing_findings(path) if options.check_crossings else ()),
        Finding(669, Level.INFO, "collisions of tool, holder, machine and part are not checked"),
    ]


def stretches_told(
    path: ToolPath, where: BoolArray, code: int, level: Level, tell: Callable[[slice], str], most: int = _MOST_TOLD
) -> list[Finding]:
    """Return one finding for each unbroken run of moves marked in `where` (n,), with a message about that run.

    Parameters
    ----------
    path, where
        The path, and (n,) which of its moves are meant.
    code, level
        Of each finding.
    tell
        Says what is wrong about a run of moves, given as a slice.
    most
        So many are told at most; the last one says how many there are besides.
    """
    if not where.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(np.int8))).reshape(-1, 2)
    findings = [
        Finding(code, level, tell(slice(first, end)), move_place(path, first, end - 1))
        for first, end in edges[:most].tolist()
    ]
    if len(edges) > most:
        last = findings[-1]
        findings[-1] = Finding(code, level, f"{last.message}; and {len(edges) - most} more such places", last.where)
    return findings


def _box_findings(path: ToolPath, T_world_program: FloatArray, options: PreflightOptions) -> list[Finding]:
    if options.work_box_mm is None:
        return []
    corners = np.array(options.work_box_mm).reshape(2, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    tips = apply(T_world_program, path.tips_mm)
    beyond = np.maximum(low - tips, tips - high)

    def tell(run: slice) -> str:
        row, axis = np.unravel_index(int(np.argmax(beyond[run])), beyond[run].shape)
        value = f"{_AXES[axis]} = {tips[run][row, axis]:.3f}"
        return (
            f"the tip leaves the work box by up to {beyond[run].max():.3f} mm, at {value} mm in the world; change the "
            "cell or the path, or work_box_mm"
        )

    return stretches_told(path, (beyond > 0.0).any(axis=1), 660, Level.FAIL, tell)


def _feed_findings(path: ToolPath, options: PreflightOptions) -> list[Finding]:
    limit, feeds = options.max_feed_mm_min, path.feeds_mm_min
    if limit is None:
        return []

    def tell(run: slice) -> str:
        return f"the feed is {feeds[run].max():.6g} mm/min, above max_feed_mm_min = {limit:g}"

    return stretches_told(path, ~path.rapid & (feeds > limit), 661, Level.FAIL, tell)


def _turn_findings(path: ToolPath, motion: _Motion, options: PreflightOptions) -> list[Finding]:
    """Tell where the tool axis turns fast: by the way of the tip, and by time at the feed."""
    per_mm = motion.turns_deg / np.maximum(motion.lengths_mm, _SHORTEST_STEP_MM)
    per_s = per_mm * path.feeds_mm_min / 60.0

    def tell_per_mm(run: slice) -> str:
        told = f"{per_mm[run].max():.4g} degrees per mm, {motion.turns_deg[run].max():.4g} degrees in one move"
        return f"the tool axis turns {told}; the limit max_axis_deg_mm is {options.max_axis_deg_mm:g}"

    def tell_per_s(run: slice) -> str:
        told = f"{per_s[run].max():.4g} degrees per second at the feed of the path"
        return f"the tool axis turns {told}; the limit max_axis_deg_s is {options.max_axis_deg_s:g}"

    fast = motion.cuts & (per_mm > options.max_axis_deg_mm)
    moving = motion.cuts & (motion.lengths_mm > _SHORTEST_STEP_MM)
    return [
        *stretches_told(path, fast, 661, Level.WARN, tell_per_mm),
        *stretches_told(path, moving & (per_s > options.max_axis_deg_s), 661, Level.WARN, tell_per_s),
    ]


def _motion_findings(path: ToolPath, motion: _Motion) -> list[Finding]:
    """Tell where the axis flips, where the cut goes back on its way, and of moves without motion."""
    flips = motion.cuts & (motion.turns_deg > _FLIP_DEG)
    still = motion.cuts & (motion.lengths_mm < _STILL_MM) & (motion.turns_deg < _STILL_DEG)

    def tell(run: slice) -> str:
        return f"the tool axis flips: it turns {motion.turns_deg[run].max():.4g} degrees in one cutting move"

    back = "the cut goes back on its own way: it turns by more than 150 degrees"
    findings = [
        *stretches_told(path, flips, 662, Level.WARN, tell),
        *stretches_told(path, _goes_back(path, motion), 662, Level.WARN, lambda _: back),
    ]
    if still.any():
        message = f"{counted(int(still.sum()), 'cutting move')} without motion, the first one here"
        findings.append(Finding(662, Level.INFO, message, move_place(path, int(np.argmax(still)))))
    return findings


def _goes_back(path: ToolPath, motion: _Motion) -> BoolArray:
    """Return where a cutting move goes back on the cutting move before it (n,); out of a hole again is no such way."""
    back = np.zeros(len(path), np.bool_)
    steps, lengths = np.diff(path.tips_mm, axis=0), motion.lengths_mm
    cosine = np.einsum("ni,ni->n", steps[1:], steps[:-1])
    sharp = cosine < _BACK * lengths[2:] * lengths[1:-1]
    long = np.minimum(lengths[2:], lengths[1:-1]) > _SHORTEST_STEP_MM
    lifts = np.einsum("ni,ni->n", steps[1:], path.axes[1:-1]) > _ALONG * lengths[2:]
    back[2:] = motion.cuts[2:] & motion.cuts[1:-1] & long & sharp & ~lifts
    return back


def _crossing_findings(path: ToolPath) -> list[Finding]:
    found = crossings(path.tips_mm, path.axes, path.rapid)
    if found is None:
        what = "the cuts lie so close together that places where they cross were not looked for"
        return [Finding(669, Level.INFO, what)]
    findings = []
    for crossing in found[:_MOST_TOLD]:
        level = Level.WARN if crossing.same_cut else Level.INFO
        what = "the cut crosses itself" if crossing.same_cut else "the cut crosses an earlier one"
        findings.append(
            Finding(663, level, f"{what}: {move_place(path, crossing.earlier)}", move_place(path, crossing.later))
        )
    if len(found) > _MOST_TOLD:
        last = findings[-1]
        more = f"{last.message}; and {len(found) - _MOST_TOLD} more crossings"
        level = Level.WARN if any(crossing.same_cut for crossing in found) else Level.INFO
        findings[-1] = Finding(663, level, more, last.where)
    return findings
