"""Carry a tool path from the nominal contour to the corrected one.

A tip is a place on the nominal contour and an offset in the frame there; the same offset is applied in the frame of
the corrected contour, and the tool axis turns with the frame. Moves far from the contour pass over to the rigid pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.contour.choice import Assignment
from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.projection import nearest
from sicp_cam.model import BoolArray, Event, FloatArray, IntArray, Status, ToolPath
from sicp_cam.registration.result import RegisteredContour
from sicp_cam.rigid_motion import apply, rotate
from sicp_cam.toolpath.settings import ToolPathSettings

__all__ = ["CorrectedPath", "carried", "correct_path"]

AXIS_STEP = np.radians(0.1)
"""Turn of the axis between two points, away from their mean, above which points are added in between."""


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedPath:
    """A tool path before and after its correction, move by move.

    Parameters
    ----------
    nominal
        The path in the part frame, with the points that were added between long moves.
    rigid, corrected
        The same moves in the scan frame: by the rigid pose alone, and by the corrected contour.
    status
        One per move.
    added
        (n,) True for moves that are not in the source.
    """

    nominal: ToolPath
    rigid: ToolPath
    corrected: ToolPath
    status: tuple[Status, ...]
    added: BoolArray


def correct_path(
    path: ToolPath,
    assignment: Assignment,
    contours: Sequence[RegisteredContour],
    T_scan_part: FloatArray,
    settings: ToolPathSettings,
    on_contour_mm: float,
) -> CorrectedPath:
    """Correct a tool path.

    Parameters
    ----------
    path
        The path in the part frame.
    assignment
        Which of `contours` each move follows.
    contours
        The registered contours.
    T_scan_part
        (4, 4) rigid pose.
    settings
        Band, blend and step.
    on_contour_mm
        Feed moves that end no further than this from their contour cut; all others approach or retract.
    """
    cutting = ~path.rapid & (assignment.distance_mm <= on_contour_mm)
    nominal, source, follows = _densified(path, assignment.contour, cutting, contours, T_scan_part, settings)
    tips, axes = carried(nominal.tips_mm, nominal.axes, follows, contours, T_scan_part, settings)
    rigid = replace(nominal, tips_mm=apply(T_scan_part, nominal.tips_mm), axes=rotate(T_scan_part, nominal.axes))
    status = _status(nominal, cutting[source], follows, contours)
    added = np.append(source[1:] == source[:-1], False)
    return CorrectedPath(nominal, rigid, replace(nominal, tips_mm=tips, axes=axes), status, added)


def carried(
    tips_mm: FloatArray,
    axes: FloatArray,
    follows: IntArray,
    contours: Sequence[RegisteredContour],
    T_scan_part: FloatArray,
    settings: ToolPathSettings,
) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) tips and unit axes carried from the part frame to the scan frame with their contours."""
    tips_out, axes_out = apply(T_scan_part, tips_mm), rotate(T_scan_part, axes)
    for number, contour in enumerate(contours):
        rows = np.flatnonzero(follows == number)
        if not len(rows):
            continue
        s_mm, distance = nearest(tips_mm[rows], contour.nominal)
        before, after = at(contour.nominal, s_mm), at(contour.corrected, s_mm)
        offset = tips_mm[rows] - before.points_mm
        tips = after.points_mm + _reframed(offset, before, after)
        turned = _reframed(axes[rows], before, after)
        w = 1.0 - _smoothstep((distance - settings.band_mm) / settings.blend_mm)[:, None]
        tips_out[rows] += w * (tips - tips_out[rows])
        mixed = axes_out[rows] + w * (turned - axes_out[rows])
        axes_out[rows] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return tips_out, axes_out


def _reframed(vectors: FloatArray, before: FramedCurve, after: FramedCurve) -> FloatArray:
    """Return vectors with the same components in the frame `after` that they have in the frame `before`."""
    turned = np.zeros_like(vectors)
    for old, new in (
        (before.tangents, after.tangents),
        (before.inward, after.inward),
        (before.outward, after.outward),
    ):
        turned += np.sum(vectors * old, axis=1, keepdims=True) * new
    return turned


def _smoothstep(t: FloatArray) -> FloatArray:
    """Return 6 t^5 - 15 t^4 + 10 t^3 between 0 and 1, which has no step in its second derivative."""
    t = np.clip(t, 0.0, 1.0)
    risen: FloatArray = t**3 * (t * (6.0 * t - 15.0) + 10.0)
    return risen


def _densified(
    path: ToolPath,
    follows: IntArray,
    cutting: BoolArray,
    contours: Sequence[RegisteredContour],
    T_scan_part: FloatArray,
    settings: ToolPathSettings,
) -> tuple[ToolPath, IntArray, IntArray]:
    """Add points to long cutting moves that must bend; return the path, the source and the contour of each move."""
    tips, axes = path.tips_mm, path.axes
    length = np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1)
    along = cutting & np.roll(cutting, 1) & (follows == np.roll(follows, 1))
    along[:1] = False
    counts = np.where(along, np.maximum(1, np.ceil(length / settings.step_mm - 1e-6)), 1).astype(np.int64)
    fine_tips, fine_axes, source = _interpolated(tips, axes, counts)
    moved_tips, moved_axes = carried(fine_tips, fine_axes, follows[source], contours, T_scan_part, settings)
    bent = _bends(moved_tips, moved_axes, source, counts, settings.chord_mm)
    counts = np.where(bent, counts, 1)
    fine_tips, fine_axes, source = _interpolated(tips, axes, counts)
    first = np.concatenate([[0], np.cumsum(counts)])
    events = tuple(_shifted(event, first) for event in path.events)
    dense = replace(
        path,
        tips_mm=fine_tips,
        axes=fine_axes,
        feeds_mm_min=path.feeds_mm_min[source],
        rapid=path.rapid[source],
        lines=path.lines[source],
        events=events,
    )
    return dense, source, follows[source]


def _shifted(event: Event, first: IntArray) -> Event:
    return replace(event, before_move=int(first[event.before_move]))


def _interpolated(tips: FloatArray, axes: FloatArray, counts: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return each move as `counts` equal steps, tips and axes linear between, and the move that each step is of."""
    source = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(source)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    t = (step / counts[source])[:, None]
    start = np.maximum(source - 1, 0)
    fine_tips = np.where(t == 1.0, tips[source], tips[start] + t * (tips[source] - tips[start]))
    mixed = np.where(t == 1.0, axes[source], axes[start] + t * (axes[source] - axes[start]))
    return fine_tips, mixed / np.linalg.norm(mixed, axis=1, keepdims=True), source


def _bends(tips: FloatArray, axes: FloatArray, source: IntArray, counts: IntArray, chord_mm: float) -> BoolArray:
    """Say for each source move whether its steps leave the straight move between its ends."""
    last = np.cumsum(counts) - 1
    start = np.maximum(source - 1, 0)
    step = np.arange(len(source)) - np.repeat(last + 1 - counts, counts) + 1
    t = (step / counts[source])[:, None]
    straight = tips[last[start]] + t * (tips[last[source]] - tips[last[start]])
    axis = axes[last[start]] + t * (axes[last[source]] - axes[last[start]])
    off = np.linalg.norm(tips - straight, axis=1) > chord_mm
    off |= np.linalg.norm(axes - axis, axis=1) > AXIS_STEP
    return np.asarray(np.bincount(source, weights=off, minlength=len(counts)) > 0)


def _status(
    path: ToolPath, cutting: BoolArray, follows: IntArray, contours: Sequence[RegisteredContour]
) -> tuple[Status, ...]:
    seen = np.zeros(len(path), dtype=bool)
    for number, contour in enumerate(contours):
        rows = np.flatnonzero(follows == number)
        s_mm, _ = nearest(path.tips_mm[rows], contour.nominal)
        station = np.searchsorted(contour.nominal.s_mm, s_mm, side="right") - 1
        seen[rows] = contour.covered[station] & contour.covered[(station + 1) % len(contour.covered)]
    return tuple(
        Status.APPROACH if not cuts else Status.COVERED if covered else Status.BRIDGED
        for cuts, covered in zip(cutting, seen, strict=True)
    )
