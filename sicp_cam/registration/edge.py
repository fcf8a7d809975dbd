"""Measure where the scan's edge lies, seen from a curve, station by station.

The points at the rim of a scan lie inside the material by about half the point spacing, because the edge falls between
points. Registering to them cuts too deep. The edge is therefore estimated from *all* points behind it: over a surface
covered with density rho and ending at depth delta, the points of a window of standard deviation W sum up to
sum G exp(-h / tau) = rho tau W sqrt(2 pi) exp(-delta / tau), which is solved for delta. The density rho is that of the
interior, corrected by how much denser the scan is at its rim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.projection import CurveCoordinates, coordinates
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.gauss_newton import tukey
from sicp_cam.registration.local_surface import fit_surface
from sicp_cam.registration.rigid import facing_rim
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.stations import even_stations, interpolated, windows

__all__ = ["EdgeMeasurement", "gaps", "measure", "on_curve"]

RIM_WIDTH_SPACINGS = 3.0
EDGE_WIDTH_SPACINGS = 12.0
"""Standard deviation of the edge window along the contour, in point spacings."""
DECAY_SPACINGS = 0.15
INTERIOR_SPACINGS = (2, 7)
"""Depths between which the density of the interior is counted, in slices of one spacing."""
FULL_SLICE = 0.3
"""Least number of points of a slice of the interior, over that of the fullest slice."""
RIM_ZONE_SPACINGS = (0.05, 0.45)
"""Depths behind the edge between which the density of the rim is counted."""
RIM_ROUNDS = 30
BEFORE_RIM_SPACINGS = 1.5
"""Points further outside of the rim than this are no part of the surface."""
GAP_MARGIN_SPACINGS = 5.0
"""How far from a gap the edge is trusted: nearer, much of its window lies in the gap."""
COVERED_SHARE = 0.3
"""Least density of points behind the edge, over the median density along the contour."""


@dataclass(frozen=True, slots=True, eq=False)
class EdgeMeasurement:
    """The scan seen from a curve at k stations.

    Parameters
    ----------
    s_mm
        (k,) arc lengths.
    depth_mm
        (k,) scan edge along B; NaN where the scan shows no edge.
    height_mm, slope
        (k,) scan surface along N at the scan's edge, and its slope dv/dh there; NaN where the scan shows no surface.
    covered
        (k,) True where the scan shows both.
    edge_trusted
        (k,) True where, besides, the window of the edge reaches into no gap: the depth holds there.
    noise_mm
        Standard deviation of single points from the fitted surface.
    """

    s_mm: FloatArray
    depth_mm: FloatArray
    height_mm: FloatArray
    slope: FloatArray
    covered: BoolArray
    edge_trusted: BoolArray
    noise_mm: float


def measure(curve: FramedCurve, surface: ScanSurface, *, reach_mm: float) -> EdgeMeasurement:
    """Measure surface and edge of the scan along a curve in the scan frame.

    Parameters
    ----------
    curve
        Where the contour is believed to be.
    surface
        The scan; every window scales with its point spacing.
    reach_mm
        Largest distance of a rim point that can belong to the contour.
    """
    spacing_mm = surface.spacing_mm
    stations = even_stations(curve, spacing_mm)
    seen = coordinates(surface.points_mm, curve)
    rim_depth, rim_weight = _rim_depth(curve, surface, stations, reach_mm)
    local = fit_surface(seen, stations, curve, spacing_mm, reach_mm)
    depth = _edge_depth(_only(seen, local.on_surface), rim_depth, stations, curve, spacing_mm)
    at_edge = np.nan_to_num(depth)
    height = local.height_mm(at_edge)
    covered = np.isfinite(depth) & np.isfinite(height) & (rim_weight > COVERED_SHARE * np.median(rim_weight))
    covered &= _dense(_only(seen, local.on_surface), at_edge, stations, curve, spacing_mm)
    trusted = _away_from_gaps(covered, stations, curve, GAP_MARGIN_SPACINGS * spacing_mm)
    return EdgeMeasurement(stations, depth, height, local.slope(at_edge), covered, trusted, local.noise_mm)


def _only(seen: CurveCoordinates, rows: BoolArray) -> CurveCoordinates:
    return CurveCoordinates(seen.s_mm[rows], seen.along_mm[rows], seen.inward_mm[rows], seen.outward_mm[rows])


def _rim_depth(
    curve: FramedCurve, surface: ScanSurface, stations: FloatArray, reach_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Return the robust mean depth of the rim points around each station, NaN where there are none, and its weight."""
    chosen, s_mm = facing_rim(surface.rim, curve, reach_mm)
    depth_of_rim = coordinates(surface.rim.points_mm[chosen], curve).inward_mm
    (G,) = windows(s_mm, stations, curve, RIM_WIDTH_SPACINGS * surface.spacing_mm)
    depth = np.full(len(stations), np.nan)
    trust = tukey(depth_of_rim, 0.5 * reach_mm)
    for _ in range(5):
        total = G @ trust
        depth = np.divide(G @ (trust * depth_of_rim), total, out=np.full(len(total), np.nan), where=total > 0.05)
        deviation = depth_of_rim - interpolated(np.nan_to_num(depth), stations, s_mm, curve)
        middle = float(np.median(np.abs(deviation[trust > 0.0]))) if (trust > 0.0).any() else 0.0
        trust = tukey(deviation, max(2.0 * surface.spacing_mm, 6.0 * middle))
    return depth, G @ trust


def _edge_depth(
    seen: CurveCoordinates, rim_depth: FloatArray, stations: FloatArray, curve: FramedCurve, spacing_mm: float
) -> FloatArray:
    """Return the depth of the edge at each station by the exponential moment; NaN where there is no rim."""
    width, tau = EDGE_WIDTH_SPACINGS * spacing_mm, DECAY_SPACINGS * spacing_mm
    rim = interpolated(np.nan_to_num(rim_depth), stations, seen.s_mm, curve)
    h = seen.inward_mm - rim
    near = (h > -BEFORE_RIM_SPACINGS * spacing_mm) & (h < 12.0 * spacing_mm)
    s, h, rim = seen.s_mm[near], h[near], rim[near]
    # At depth h a slice of ds on the curve is 1 + kappa h wide: each point stands for that much less length.
    narrow = 1.0 / np.clip(1.0 + interpolated(_geodesic_curvature(curve, stations), stations, s, curve) * h, 0.5, 2.0)
    (G,) = windows(s, stations, curve, width)
    area = width * np.sqrt(2.0 * np.pi) * spacing_mm
    density = _interior_density(G, h / spacing_mm, narrow) / area
    moment = G @ (narrow * np.exp(-h / tau))
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = -tau * np.log(moment * spacing_mm / (density * tau * area))
        depth -= 1.0 / (8.0 * np.sqrt(np.pi) * width * density)  # mean of the logarithm of a noisy sum
        # The rim wanders from point to point; what h was counted from is its mean over the window.
        depth += (G @ (narrow * rim)) / (G @ narrow)
    depth += tau * np.log(_rim_density(seen.inward_mm[near], depth, s, stations, curve, narrow, spacing_mm, tau))
    return np.where(np.isfinite(depth) & np.isfinite(rim_depth), depth, np.nan)


def _interior_density(G: sparse.csr_array, h_spacings: FloatArray, narrow: FloatArray) -> FloatArray:
    """Return the weighted number of points per spacing of depth at each station, behind the edge.

    Slices of one spacing are counted; those that hold far fewer points than the fullest lie beyond the other side of a
    narrow flange, or in a gap behind the edge, and do not count.
    """
    slices = range(*INTERIOR_SPACINGS)
    counts = np.stack([G @ (narrow * ((h_spacings >= k) & (h_spacings < k + 1))) for k in slices], axis=1)
    full = counts >= FULL_SLICE * counts.max(axis=1, keepdims=True)
    return np.asarray((counts * full).sum(axis=1) / np.maximum(full.sum(axis=1), 1))


def _rim_density(
    inward_mm: FloatArray,
    depth: FloatArray,
    s_mm: FloatArray,
    stations: FloatArray,
    curve: FramedCurve,
    narrow: FloatArray,
    spacing_mm: float,
    tau: float,
) -> float:
    """Return the density of points just behind the edge over that of the interior, pooled over all stations.

    Scanners that thin their points to one per voxel leave up to twice the density at the rim, because a voxel that the
    edge cuts keeps its point too. Taken for the interior's density this would put the edge outside of the material.
    The ratio r and the depth it corrects depend on each other, and are found by iteration.
    """
    low, high = RIM_ZONE_SPACINGS
    first, last = INTERIOR_SPACINGS
    ratio = 1.0
    for _ in range(RIM_ROUNDS):
        edge = interpolated(np.nan_to_num(depth + tau * np.log(ratio)), stations, s_mm, curve)
        x = (inward_mm - edge) / spacing_mm
        rim = narrow[(x > low) & (x < high)].sum() / (high - low)
        slices = [narrow[(x >= k) & (x < k + 1)].sum() for k in range(first, last)]
        full = [count for count in slices if count >= FULL_SLICE * max(slices)]
        if not full or not sum(full):
            return 1.0
        ratio = 0.5 * ratio + 0.5 * float(np.clip(rim / (sum(full) / len(full)), 0.5, 2.5))
    return ratio


def _geodesic_curvature(curve: FramedCurve, stations: FloatArray) -> FloatArray:
    """Return how fast the width of the material grows with depth at each station, 1/mm: minus B . dT/ds."""
    step = stations[1] - stations[0]
    turn = at(curve, stations + 0.5 * step).tangents - at(curve, stations - 0.5 * step).tangents
    curvature: FloatArray = -np.sum(turn * at(curve, stations).inward, axis=1) / step
    return curvature


def _dense(
    seen: CurveCoordinates, at_edge: FloatArray, stations: FloatArray, curve: FramedCurve, spacing_mm: float
) -> BoolArray:
    """Say where points lie both just behind the edge (0-3 spacings) and further in (3-7), as densely as elsewhere."""
    h = (seen.inward_mm - interpolated(at_edge, stations, seen.s_mm, curve)) / spacing_mm
    dense = np.ones(len(stations), dtype=bool)
    for near, far in ((-0.5, 3.0), (3.0, 7.0)):
        inside = (h >= near) & (h < far)
        (G,) = windows(seen.s_mm[inside], stations, curve, spacing_mm)
        density = G.sum(axis=1)
        dense &= density > COVERED_SHARE * np.median(density)
    return dense


def _away_from_gaps(covered: BoolArray, stations: FloatArray, curve: FramedCurve, distance_mm: float) -> BoolArray:
    """Return the covered stations further than a distance from every gap; all of them where that leaves too few."""
    reach = int(np.ceil(distance_mm / (stations[1] - stations[0])))
    wide = np.pad(~covered, reach, mode="wrap" if curve.closed else "constant")
    near_gap = np.convolve(wide, np.ones(2 * reach + 1), mode="valid") > 0.5
    away = covered & ~near_gap
    return away if away.sum() >= 0.5 * covered.sum() else covered


def on_curve(values: FloatArray, measured: EdgeMeasurement, curve: FramedCurve, *, bridge: bool = False) -> FloatArray:
    """Return (k,) values of the measured stations at the stations of a curve.

    Parameters
    ----------
    values
        One per measured station; NaN where there is none.
    bridge
        True: carry the values linearly over every gap, 0 if there is no value at all. False: NaN in gaps.
    """
    if not bridge:
        return interpolated(values, measured.s_mm, curve.s_mm, curve)
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(len(curve))
    period = curve.length_mm if curve.closed else None
    return np.asarray(np.interp(curve.s_mm, measured.s_mm[known], values[known], period=period))


def gaps(measured: EdgeMeasurement, curve: FramedCurve, shown: BoolArray | None = None) -> FloatArray:
    """Return the (g, 2) start and end of each run of stations that the scan does not show, within 0 and the length.

    Parameters
    ----------
    shown
        (k,) what counts as shown; where the scan covers the edge if left out.
    """
    step = measured.s_mm[1] - measured.s_mm[0]
    hidden = np.concatenate([[False], ~(measured.covered if shown is None else shown), [False]])
    change = np.flatnonzero(np.diff(hidden.astype(np.int64)))
    edges = np.clip((change.reshape(-1, 2) - 0.5) * step, 0.0, curve.length_mm)
    if curve.closed and hidden[1] and hidden[-2]:
        edges[-1, 1] = curve.length_mm  # one gap over the seam, stated in two parts
    return np.asarray(edges, dtype=np.float64)
