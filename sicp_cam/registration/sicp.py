"""The method of the product, and the paper's: Subdivision-ICP of one contour after the primary registration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.frames import FramedCurve, at, moved
from sicp_cam.contour.subdivision import Subdivision, bends, subdivide
from sicp_cam.errors import RegistrationError
from sicp_cam.model import FloatArray
from sicp_cam.registration.axes import tilted
from sicp_cam.registration.edge import EdgeMeasurement, gaps, measure
from sicp_cam.registration.result import Segment
from sicp_cam.registration.rigid import NominalContour, facing_rim
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.segments import Targets, blended, point_to_curve, point_to_point, register_segments
from sicp_cam.registration.settings import RegistrationSettings

__all__ = ["Subdivided", "paper_s_icp", "s_icp"]

LADDER = (6, 8, 12, 16, 24, 32, 48, 64, 96)
LEAST_PIECE_SPACINGS = 6.0
GOOD_ENOUGH = 0.15
"""Mean distance out of the surface, over the scan's noise, below which no finer division is tried."""
ROUNDS = 2
PAPER_PIECES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Subdivided:
    """A contour registered piece by piece, in the scan frame."""

    curve: FramedCurve
    subdivision: Subdivision
    segments: tuple[Segment, ...]


def s_icp(
    contour: NominalContour, surface: ScanSurface, T_primary: FloatArray, settings: RegistrationSettings
) -> Subdivided:
    """Register a contour piece by piece to the measured edge and surface of the scan.

    The number of pieces is the least of a ladder that brings the contour onto the surface within a fraction of the
    scan's noise. The scan is then measured anew from the result, and the pieces registered again.

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
    """
    measured = measure(moved(contour.curve, T_primary), surface, reach_mm=settings.reach_mm)
    targets = _targets(moved(contour.curve, T_primary), measured)
    sharp = bends(contour.curve, settings.corner_radius_mm)
    found: Subdivided | None = None
    least = np.inf
    hidden = gaps(measured, contour.curve, measured.edge_trusted)
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
    for _ in range(ROUNDS):
        targets = _targets(found.curve, measure(found.curve, surface, reach_mm=settings.reach_mm))
        found = _registered(contour, found.subdivision, targets, surface, T_primary, settings)
    final = measure(found.curve, surface, reach_mm=settings.reach_mm)
    return Subdivided(tilted(found.curve, final), found.subdivision, found.segments)


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
    return Subdivided(tilted(curve, final), parts, segments)


def _ladder(curve: FramedCurve, spacing_mm: float, settings: RegistrationSettings) -> tuple[int, ...]:
    if settings.segments is not None:
        return (settings.segments,)
    most = curve.length_mm / (LEAST_PIECE_SPACINGS * spacing_mm)
    return tuple(n for n in LADDER if n <= most) or LADDER[:1]


def _targets(curve: FramedCurve, measured: EdgeMeasurement) -> Targets:
    foot = at(curve, measured.s_mm)
    depth, height = np.nan_to_num(measured.depth_mm)[:, None], np.nan_to_num(measured.height_mm)[:, None]
    points = foot.points_mm + depth * foot.inward + height * foot.outward
    trusted, covered = measured.edge_trusted.astype(np.float64), measured.covered.astype(np.float64)
    return Targets(measured.s_mm, points, trusted, covered)


def _registered(
    contour: NominalContour,
    subdivision: Subdivision,
    targets: Targets,
    surface: ScanSurface,
    T_primary: FloatArray,
    settings: RegistrationSettings,
) -> Subdivided:
    segments = register_segments(
        contour, subdivision, targets.s_mm, point_to_curve(targets), surface, T_primary, reach_mm=settings.reach_mm
    )
    return Subdivided(blended(contour.curve, subdivision, segments), subdivision, segments)


def _mean_out(curve: FramedCurve, targets: Targets) -> float:
    """Return the mean distance of the targets from the curve, out of the surface."""
    foot = at(curve, targets.s_mm)
    out = np.sum((targets.points_scan_mm - foot.points_mm) * foot.outward, axis=1)
    return float(np.average(np.abs(out), weights=targets.surface_weights)) if targets.surface_weights.any() else np.inf
