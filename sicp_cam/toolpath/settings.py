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
    side
        Largest misfit of a given pose over that of the part turned over; above 1 the other side fits better.
    stretch
        Largest relative change of the contour's length; a part that bends keeps it.
    in_surface_mm
        Largest move of the edge within the surface, beyond the rigid pose; a part that bends hardly has any.
    correction_mm
        Largest move of a point by the deformation, beyond the rigid pose.
    axis_deg
        Largest turn of a tool axis by the deformation, beyond the rigid pose.
    jump_mm
        Largest step of the correction between neighbouring points, beyond what their distance explains.
    """

    path_distance_mm: float = 20.0
    path_coverage: float = 0.5
    coverage: float = 0.5
    residual_mm: float = 0.5
    edge_residual_mm: float = 3.0
    side: float = 2.0
    stretch: float = 0.02
    in_surface_mm: float = 6.0
    correction_mm: float = 30.0
    axis_deg: float = 15.0
    jump_mm: float = 0.5
