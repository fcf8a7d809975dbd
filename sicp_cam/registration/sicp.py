"""The method of the product, and the paper's: Subdivision-ICP of one contour after the primary registration."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.frames import FramedCurve, at, moved
from sicp_cam.contour.subdivision import Subdivision, bends, subdivide
from sicp_cam.errors import RegistrationError
from sicp_cam.model import FloatArray
from sicp_cam.registration.axes import displaced, tilted
from sicp_cam.registration.edge import EdgeMeasurement, gaps, measure, on_curve
from sicp_cam.registration.result import Segment
from sicp_cam.registration.rigid import NominalContour, facing_rim
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.segments import Targets, blended, point_to_curve, point_to_point, register_segments
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.rigid_motion import best_fit

__all__ = ["Subdivided", "paper_s_icp", "s_icp"]

LADDER = (6, 12, 24, 48, 96)
LEAST_PIECE_SPACINGS = 6.0
GOOD_ENOUGH = 0.15
"""Mean distance out of the surface, over the scan's noise, below which no finer division is tried."""
PAPER_PIECES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Subdivided:
    """A contour registered piece by piece, in the scan frame, and what the scan shows from there."""

    curve: FramedCurve
    subdivision: Subdivision
    segments: tuple[Segment, ...]
    measured: EdgeMeasurement


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    curve: FramedCurve
    subdivision: Subdivision
    segments: tuple[Segment, ...]


def s_icp(
    contour: NominalContour,
    surface: ScanSurface,
    T_primary: FloatArray,
    settings: RegistrationSettings,
    before: EdgeMeasurement,
    *,
    uncut: bool = False,
) -> Subdivided:
    """Register a contour piece by piece to the measured edge and surface of the scan, and add the displacement field.

    The number of pieces is the least of a ladder that brings the contour onto the surface within a fraction of the
    scan's noise. The scan is then measured anew from the result; what it still shows as a smooth displacement is added.

    Parameters
    ----------
    contour
        The contour, in the part frame.
    surface
        The scan near it.
    T_primary
        (4, 4) primary registration.
    settings
        Number of pieces, overlap, and the rest.
    before
        The scan measured from the primary registration.
    uncut
        True where the scan goes on beyond the contour, so that only its surface counts.
    """
    found = _divided(contour, surface, T_primary, settings, before)
    rigid = moved(contour.curve, T_primary)
    rigid = rigid if uncut else _refitted(rigid, found.curve, before)
    shown = measure(
        found.curve,
        surface,
        reach_mm=settings.reach_mm,
        rigid=rigid,
        uncut=uncut,
        edge_offset_mm=settings.edge_offset_mm,
    )
    curve = _on_surface(found.curve, rigid, shown, settings.field)
    left = _after_field(shown, found.curve) if settings.field else shown
    return Subdivided(curve, found.subdivision, found.segments, left)


def paper_s_icp(
    contour: NominalContour, surface: ScanSurface, T_primary: FloatArray, settings: RegistrationSettings
) -> Subdivided:
    """Register a contour as the paper does: every contour point to the closest scan edge point, piece by piece.

    Corrected only where the printed text cannot work (see docs/method.md): the stability points are held on the
    scan's surface, and the weights of overlapping pieces are normalised.
    """
    chosen, _ = facing_rim(surface.rim, moved(contour.curve, T_primary), settings.reach_mm)
    edge_mm = surface.rim.points_mm[chosen]
    tree = cKDTree(edge_mm)
    pieces = settings.segments or PAPER_PIECES
    parts = subdivide(contour.curve, pieces, settings.overlap, bends(contour.curve, settings.corner_radius_mm))
    count = max(8 * pieces, round(contour.curve.length_mm / surface.spacing_mm))
    s_mm = np.linspace(0.0, contour.curve.length_mm, count, endpoint=not contour.curve.closed)
    correspondence = point_to_point(lambda points: np.asarray(edge_mm[tree.query(points)[1]]), settings.reach_mm)
    segments = register_segments(contour, parts, s_mm, correspondence, surface, T_primary, reach_mm=settings.reach_mm)
    curve = blended(contour.curve, parts, segments)
    final = measure(curve, surface, reach_mm=settings.reach_mm)
    return Subdivided(tilted(curve, final), parts, segments, final)


def _divided(
    contour: NominalContour,
    surface: ScanSurface,
    T_primary: FloatArray,
    settings: RegistrationSettings,
    measured: EdgeMeasurement,
) -> _Pieces:
    """Return the contour in the least number of pieces that meets the measured edge and surface."""
    targets = _targets(moved(contour.curve, T_primary), measured)
    sharp, hidden = bends(contour.curve, settings.corner_radius_mm), gaps(measured, contour.curve)
    found: _Pieces | None = None
    least = np.inf
    for pieces in _ladder(contour.curve, surface.spacing_mm, settings):
        parts = subdivide(contour.curve, pieces, settings.overlap, sharp, hidden)
        tried = _registered(contour, parts, targets, surface, T_primary, settings)
        misfit = _mean_out(tried.curve, targets)
        if found is None or misfit < least:
            found, least = tried, misfit
        if misfit <= GOOD_ENOUGH * measured.noise_mm:
            break
    if found is None:
        raise RegistrationError("the contour is too short to be divided; use --method rigid")
    return found


def _on_surface(curve: FramedCurve, rigid: FramedCurve, measured: EdgeMeasurement, field: bool) -> FramedCurve:
    """Return the curve with its frames on the scan's surface, and moved by the displacement field if wanted."""
    slope, lift = (on_curve(values, measured, curve)[:, None] for values in (measured.slope, measured.lift_mm))
    move = on_curve(measured.shift_mm, measured, curve) + lift * curve.outward
    return displaced(rigid, curve.points_mm + field * move, curve.inward + slope * curve.outward)


def _refitted(rigid: FramedCurve, curve: FramedCurve, measured: EdgeMeasurement) -> FramedCurve:
    """Return the rigid contour moved as a whole onto the curve where the scan shows it.

    What is smooth is the bending; the primary pose of a contour that is half seen adds a turn of its own.
    """
    shown = on_curve(measured.covered.astype(np.float64), measured, rigid)
    return moved(rigid, best_fit(rigid.points_mm, curve.points_mm, np.maximum(shown, 1e-6)))


def _after_field(measured: EdgeMeasurement, curve: FramedCurve) -> EdgeMeasurement:
    """Return what the scan shows from the curve that the field has moved: the local part of what it showed before."""
    inward = np.sum(measured.shift_mm * at(curve, measured.s_mm).inward, axis=1)
    return replace(
        measured,
        depth_mm=measured.depth_mm - inward,
        height_mm=measured.height_mm - measured.lift_mm,
        shift_mm=np.zeros_like(measured.shift_mm),
        lift_mm=np.zeros_like(measured.lift_mm),
        slope=np.zeros_like(measured.slope),
    )


def _ladder(curve: FramedCurve, spacing_mm: float, settings: RegistrationSettings) -> tuple[int, ...]:
    if settings.segments is not None:
        return (settings.segments,)
    most = curve.length_mm / (LEAST_PIECE_SPACINGS * spacing_mm)
    return tuple(n for n in LADDER if n <= most) or LADDER[:1]


def _targets(curve: FramedCurve, measured: EdgeMeasurement) -> Targets:
    foot = at(curve, measured.s_mm)
    points = foot.points_mm + measured.shift_mm + measured.lift_mm[:, None] * foot.outward
    return Targets(measured.s_mm, points, measured.covered.astype(np.float64))


def _registered(
    contour: NominalContour,
    subdivision: Subdivision,
    targets: Targets,
    surface: ScanSurface,
    T_primary: FloatArray,
    settings: RegistrationSettings,
) -> _Pieces:
    segments = register_segments(
        contour, subdivision, targets.s_mm, point_to_curve(targets), surface, T_primary, reach_mm=settings.reach_mm
    )
    return _Pieces(blended(contour.curve, subdivision, segments), subdivision, segments)


def _mean_out(curve: FramedCurve, targets: Targets) -> float:
    """Return the mean distance of the targets from the curve, out of the surface."""
    foot = at(curve, targets.s_mm)
    out = np.sum((targets.points_scan_mm - foot.points_mm) * foot.outward, axis=1)
    return float(np.average(np.abs(out), weights=targets.weights)) if targets.weights.any() else np.inf
