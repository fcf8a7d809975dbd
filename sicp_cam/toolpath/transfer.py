"""Carry a tool path from the nominal contour to the corrected one.

A tip is a place on the nominal contour and an offset in the frame there; the same offset is applied in the frame of
the corrected contour, and the tool axis turns with the frame. Moves far from the contour pass over to the rigid pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sicp_cam.contour.choice import Assignment
from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.projection import nearest
from sicp_cam.model import BoolArray, FloatArray, IntArray, Status, ToolPath
from sicp_cam.registration.result import RegisteredContour
from sicp_cam.rigid_motion import apply, rotate
from sicp_cam.toolpath.settings import ToolPathSettings
from sicp_cam.toolpath.steps import Steps, any_of

__all__ = ["CorrectedPath", "carried", "correct_path"]

AXIS_STEP = np.radians(0.1)
"""Turn of the axis between two points, away from their mean, above which points are added in between."""
HEAD_ON = 0.9
"""Change of the distance from the contour per travel above which a step approaches or retracts."""
CUTTING_SHARE = 0.6
"""Share of a move along its contour above which it cuts, though it ends elsewhere."""


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
    source_moves
        (n,) move of the path as given that each move ends or is a part of.
    added
        (n,) True for moves that are not in the source.
    feed_distance_mm
        (m,) distance of the steps of all feed moves from the contours that they follow.
    u_mm
        (n,) standard uncertainty (1 sigma) of the corrected contour across itself, hypot(normal, out), where each move
        meets it; NaN for moves off the contour. None where no contour states one.
    """

    nominal: ToolPath
    rigid: ToolPath
    corrected: ToolPath
    status: tuple[Status, ...]
    source_moves: IntArray
    added: BoolArray
    feed_distance_mm: FloatArray = field(default_factory=lambda: np.zeros(0))
    u_mm: FloatArray | None = None


def correct_path(
    path: ToolPath,
    steps: Steps,
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
    steps
        Its moves divided into steps, see `steps.feed_steps`.
    assignment
        Which of `contours` each step follows, and how far it is from it.
    contours
        The registered contours.
    T_scan_part
        (4, 4) rigid pose.
    settings
        Band, blend and chord.
    on_contour_mm
        Feed moves cut where they run no further than this from their contour; elsewhere they approach or retract.
    """
    source = steps.source
    cutting = ~path.rapid[source] & (assignment.distance_mm <= on_contour_mm)
    tips, axes = carried(steps.tips_mm, steps.axes, assignment.contour, contours, T_scan_part, settings)
    along = cutting & _along(steps, assignment.distance_mm)
    bent = any_of(along & _off_straight(tips, axes, steps, settings.chord_mm), source, len(path))
    kept = bent[source] | (steps.fraction == 1.0)
    nominal = _with_steps(path, steps, kept)
    rigid = replace(nominal, tips_mm=apply(T_scan_part, nominal.tips_mm), axes=rotate(T_scan_part, nominal.axes))
    corrected = replace(nominal, tips_mm=tips[kept], axes=axes[kept])
    cuts = np.where(bent[source], cutting, _mostly(cutting, steps, len(path))[source])[kept]
    follows = assignment.contour[kept]
    s_mm = _places(nominal, follows, contours)
    status, u_mm = _status(cuts, s_mm, follows, contours), _uncertainty(cuts, s_mm, follows, contours)
    distance = assignment.distance_mm[~path.rapid[source]]
    added = steps.fraction[kept] < 1.0
    return CorrectedPath(nominal, rigid, corrected, status, source[kept], added, distance, u_mm)


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


def _along(steps: Steps, distance_mm: FloatArray) -> BoolArray:
    """Say which steps run along their contour rather than straight towards or away from it."""
    length = np.linalg.norm(np.diff(steps.tips_mm, axis=0, prepend=steps.tips_mm[:1]), axis=1)
    nearing = np.abs(np.diff(distance_mm, prepend=distance_mm[:1]))
    return np.asarray(nearing < HEAD_ON * length)


def _off_straight(tips: FloatArray, axes: FloatArray, steps: Steps, chord_mm: float) -> BoolArray:
    """Say which corrected steps leave the straight move between the corrected ends of their move."""
    last = np.flatnonzero(steps.fraction == 1.0)
    start, end = last[np.maximum(steps.source - 1, 0)], last[steps.source]
    t = steps.fraction[:, None]
    axis = axes[start] + t * (axes[end] - axes[start])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    off = np.linalg.norm(tips - (tips[start] + t * (tips[end] - tips[start])), axis=1) > chord_mm
    return np.asarray(off | (np.linalg.norm(axes - axis, axis=1) > AXIS_STEP))


def _mostly(cutting: BoolArray, steps: Steps, moves: int) -> BoolArray:
    """Say which moves cut: those that end on the contour, or run along it for most of their way."""
    share = np.bincount(steps.source, weights=cutting, minlength=moves) / np.bincount(steps.source, minlength=moves)
    return np.asarray((share > CUTTING_SHARE) | cutting[steps.fraction == 1.0])


def _with_steps(path: ToolPath, steps: Steps, kept: BoolArray) -> ToolPath:
    """Return the path with the kept steps as moves of their own; events stay before their move's first step."""
    source = steps.source[kept]
    first = np.append(np.searchsorted(source, np.arange(len(path))), len(source))
    return replace(
        path,
        tips_mm=steps.tips_mm[kept],
        axes=steps.axes[kept],
        feeds_mm_min=path.feeds_mm_min[source],
        rapid=path.rapid[source],
        lines=path.lines[source],
        events=tuple(replace(event, before_move=int(first[event.before_move])) for event in path.events),
    )


def _places(path: ToolPath, follows: IntArray, contours: Sequence[RegisteredContour]) -> FloatArray:
    """Return the (n,) arc length of each move on the contour that it follows."""
    s_mm = np.zeros(len(path))
    for number, contour in enumerate(contours):
        rows = np.flatnonzero(follows == number)
        s_mm[rows], _ = nearest(path.tips_mm[rows], contour.nominal)
    return s_mm


def _status(
    cutting: BoolArray, s_mm: FloatArray, follows: IntArray, contours: Sequence[RegisteredContour]
) -> tuple[Status, ...]:
    seen = np.zeros(len(s_mm), dtype=bool)
    for number, contour in enumerate(contours):
        rows = np.flatnonzero(follows == number)
        station = np.searchsorted(contour.nominal.s_mm, s_mm[rows], side="right") - 1
        after = (station + 1) % len(contour.covered) if contour.nominal.closed else station + 1
        seen[rows] = contour.covered[station] & contour.covered[np.minimum(after, len(contour.covered) - 1)]
    return tuple(
        Status.APPROACH if not cuts else Status.COVERED if covered else Status.BRIDGED
        for cuts, covered in zip(cutting, seen, strict=True)
    )


def _uncertainty(
    cutting: BoolArray, s_mm: FloatArray, follows: IntArray, contours: Sequence[RegisteredContour]
) -> FloatArray | None:
    """Return the (n,) standard uncertainty of the contour at each cutting move, else NaN; None if none states it."""
    u_mm, stated = np.full(len(s_mm), np.nan), False
    for number, contour in enumerate(contours):
        if contour.normal_u_mm is None or contour.out_u_mm is None:
            continue
        stated = True
        rows = np.flatnonzero(cutting & (follows == number))
        normal, out = (_at_places(values, s_mm[rows], contour) for values in (contour.normal_u_mm, contour.out_u_mm))
        u_mm[rows] = np.hypot(normal, out)
    return u_mm if stated else None


def _at_places(values: FloatArray, s_mm: FloatArray, contour: RegisteredContour) -> FloatArray:
    """Return (k,) values of the stations linearly between them, over the seam of a closed contour too."""
    nominal = contour.nominal
    return np.interp(s_mm, nominal.s_mm, values, period=nominal.length_mm if nominal.closed else None)
