"""What an operator may set about the corrected path, and the limits of its gates."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GateLimits", "ToolPathSettings"]


@dataclass(frozen=True, slots=True)
class ToolPathSettings:
    """Settings of the correction of a path.

    Parameters
    ----------
    feed_mm_min
        Feed for cutting moves to which the path file gives none; None leaves them without.
    step_mm
        Longest cutting move that is corrected as one piece; longer ones get points in between where they must bend.
    chord_mm
        How far the corrected polyline may leave the corrected curve between its points.
    band_mm
        Distance from the contour up to which a move follows the deformed contour fully.
    blend_mm
        Further distance over which a move passes from the deformed contour to the rigid pose.
    """

    feed_mm_min: float | None = None
    step_mm: float = 2.0
    chord_mm: float = 0.01
    band_mm: float = 30.0
    blend_mm: float = 60.0


@dataclass(frozen=True, slots=True)
class GateLimits:
    """Limits that the registration and the corrected path must keep; a broken one means no program.

    Parameters
    ----------
    path_distance_mm
        Distance from its contour up to which a feed move cuts; also the limit of the median over the feed travel.
    path_coverage
        Least fraction of the cut length along which the scan must show the edge.
    coverage
        Least fraction of the contour on which the scan must show the edge.
    residual_mm
        Largest mean distance between scan and corrected contour, out of the surface.
    edge_residual_mm
        Largest mean distance between scan edge and corrected contour, in the surface.
    size_mm
        Largest mean distance of the scanned edge to one side of a closed contour: more is not bent but not cut to size.
    leave_out_mm
        Largest difference (RMS) of the contours found from two halves of the scan, where the method compares them.
    uncertainty_mm
        Largest standard uncertainty of the contour where the scan shows it, where the method states one.
    freedom_mm
        Largest move of the contour across itself, RMS, that the scan leaves open to a start pose 10 mm off.
    symmetry
        Least misfit of the next best start pose over that of the one found; 1.5 is demanded in any case.
    side
        Largest misfit of a given pose over that of the part turned over; above 1 the other side fits better.
    pose_mm
        Largest distance of the registered contour from where the given start pose has it; a border of the scan that is
        no edge of the part pulls the part along. Sliding along the edge does not count.
    pose_deg
        Largest turn of the contour's outer side from the given start pose, the median along the contour.
    stretch
        Largest relative change of the contour's length; a part that bends keeps it.
    in_surface_mm
        Largest move of the edge within the surface, beyond the rigid pose; a part that bends hardly has any.
    correction_mm
        Largest move of a point by the deformation, beyond the rigid pose.
    axis_deg
        Largest turn of a tool axis by the deformation, beyond the rigid pose.
    jump_mm
        Largest step of the correction between neighbouring points, or where the path returns to a place, beyond what
        their distance explains.
    slope
        Largest change of the correction over 10 mm of cut, in mm per mm.
    axis_slope
        Largest turn of the tool axis over 10 mm of cut, beyond that of the rigid pose, in degrees per mm.
    travel
        Least way of a corrected cutting move along its nominal direction, over its nominal way; below 0 the cut would
        run backwards.
    crossing_mm
        Largest nominal distance of two places of the cut that touch after the correction: the cut crosses itself.
    """

    path_distance_mm: float = 20.0
    path_coverage: float = 0.5
    coverage: float = 0.5
    residual_mm: float = 0.5
    edge_residual_mm: float = 3.0
    size_mm: float = 1.0
    leave_out_mm: float = 0.6
    uncertainty_mm: float = 1.0
    freedom_mm: float = 1.0
    symmetry: float = 1.5
    side: float = 2.0
    pose_mm: float = 25.0
    pose_deg: float = 8.0
    stretch: float = 0.02
    in_surface_mm: float = 6.0
    correction_mm: float = 30.0
    axis_deg: float = 15.0
    jump_mm: float = 0.5
    slope: float = 0.3
    axis_slope: float = 0.5
    travel: float = 0.25
    crossing_mm: float = 3.0
