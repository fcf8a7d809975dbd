"""Measure where the scan's edge and surface lie, seen from a curve.

The points at the rim of a scan lie inside the material by about half the point spacing, because the edge falls between
points. Registering to them cuts too deep. The edge is therefore estimated from how densely *all* points lie behind it,
see `field`: the density is that of the interior, corrected by how much denser the scan is at its rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import binary_dilation

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.splines import splines_along
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.coverage import PointsAtRim, interior_density, is_shown, points_at_rim, rim_depth, row_gap_mm
from sicp_cam.registration.field import EdgePoints, fit_to_edge, moment
from sicp_cam.registration.in_surface import in_surface
from sicp_cam.registration.local_surface import LocalSurface, band_depth_mm, fit_surface
from sicp_cam.registration.result import LeaveOut
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.stations import even_stations, interpolated, nearest_station, smoothed, sums

__all__ = ["EdgeMeasurement", "gaps", "measure", "on_curve"]

SURFACE_STEP_SPACINGS, MOST_SURFACE_INTERVALS = 8.0, 200
FIELD_STEP_SPACINGS, MOST_FIELD_INTERVALS = 6.0, 96
"""Distance between the knots of surface and field, in point spacings, and most knots of a contour."""
EDGE_ZONE_SPACINGS = 4.0
"""Depth behind the rim up to which points can tell of the edge."""
GAP_MARGIN = 2
"""How many stations beside a gap do not count for the edge: somewhere there the gap begins."""
LOCAL_WIDTH_SPACINGS, LOCAL_DECAY_SPACINGS = 6.0, 0.15
LEAST_POINTS = 20
"""Points near the edge below which there is none to be seen."""
LOCAL_HEIGHT_SPACINGS = 3.0
LOCAL_SHARE = 0.5
"""Share of a local window that must be covered."""


@dataclass(frozen=True, slots=True, eq=False)
class EdgeMeasurement:
    """The scan seen from a curve at k stations.

    Parameters
    ----------
    s_mm
        (k,) arc lengths.
    depth_mm, height_mm
        (k,) scan edge along B and scan surface along N, from the points around each station alone; NaN where the scan
        shows no edge.
    shift_mm
        (k, 3) displacement in the surface from the curve to the edge, smooth along the contour, carried over gaps.
    lift_mm, slope
        (k,) height of the scan surface along N at the edge, and its slope dv/dh there; smooth, carried over gaps.
    covered
        (k,) True where the scan shows both.
    normal_u_mm, out_u_mm
        (k,) standard uncertainty of the shifted edge along B, and of the lift.
    leave_out
        How well half of the points predicts what the other half shows.
    noise_mm
        Standard deviation of single points from the fitted surface.
    row_gap_mm
        (k,) gap between rows of points that run along the edge, within which it is unknown; 0 where there are none.
    """

    s_mm: FloatArray
    depth_mm: FloatArray
    height_mm: FloatArray
    shift_mm: FloatArray
    lift_mm: FloatArray
    slope: FloatArray
    covered: BoolArray
    normal_u_mm: FloatArray
    out_u_mm: FloatArray
    leave_out: LeaveOut
    noise_mm: float
    row_gap_mm: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Since:
    """How the curve has left its rigid pose: what bends smoothly is the whole motion, not the last part of it."""

    curve: FramedCurve
    rigid: FramedCurve

    def tilt(self, s_mm: FloatArray) -> FloatArray:
        """Return dv/dh of the plane across the curve, seen from the rigid frames."""
        N, rigid = at(self.curve, s_mm).outward, at(self.rigid, s_mm)
        return np.asarray(-np.sum(N * rigid.inward, axis=1) / np.sum(N * rigid.outward, axis=1))

    def rise_mm(self, s_mm: FloatArray, g_mm: FloatArray) -> FloatArray:
        """Return how far the plane across the curve has risen, at depths behind the rim."""
        now = at(self.curve, s_mm)
        lifted = np.sum((now.points_mm - at(self.rigid, s_mm).points_mm) * now.outward, axis=1)
        return np.asarray(lifted + self.tilt(s_mm) * g_mm)


def measure(
    curve: FramedCurve,
    surface: ScanSurface,
    *,
    reach_mm: float,
    rigid: FramedCurve | None = None,
    uncut: bool = False,
    edge_offset_mm: float = 0.0,
    rough: bool = False,
) -> EdgeMeasurement:
    """Measure surface and edge of the scan along a curve in the scan frame.

    Parameters
    ----------
    curve
        Where the contour is believed to be.
    surface
        The scan; every window scales with its point spacing.
    reach_mm
        Largest distance of a rim point that can belong to the contour.
    rigid
        The rigidly registered contour, since which the displacement is smooth; `curve` where None.
    uncut
        True where the scan goes on beyond the contour: only the surface is measured, and nothing is shifted.
    edge_offset_mm
        How far the part's edge lies outside of the one that the scan shows.
    rough
        True for a first look: the edge without its last stage, no uncertainties.
    """
    spacing_mm = surface.spacing_mm
    stations = even_stations(curve, spacing_mm)
    if uncut:
        rim_mm, has_rim = np.zeros(len(stations)), np.ones(len(stations), dtype=bool)
    else:
        rim_mm, has_rim = rim_depth(curve, surface, stations, reach_mm)
    seen = points_at_rim(curve, surface, stations, rim_mm, band_depth_mm(spacing_mm))
    splines = splines_along(curve, SURFACE_STEP_SPACINGS * spacing_mm, MOST_SURFACE_INTERVALS)
    since = _Since(curve, rigid or curve)
    heights = seen.outward_mm + since.rise_mm(seen.s_mm, seen.behind_rim_mm)
    local = fit_surface(seen.s_mm, seen.behind_rim_mm, heights, splines, spacing_mm, reach_mm)
    seen = seen.taken(local.on_surface)

    def height(behind_mm: FloatArray, edge_mm: FloatArray | float = 0.0) -> FloatArray:
        behind_rim_mm = behind_mm + edge_mm
        return local.height_and_slope(stations, behind_rim_mm)[0] - since.rise_mm(stations, behind_rim_mm)

    covered = has_rim & is_shown(curve, surface, stations, rim_mm, height)
    edge = _no_edge(stations)
    for _ in range(0 if uncut else 1 if rough else 2):
        edge = _edge(seen, stations, curve, since.rigid, covered, spacing_mm, local.noise_mm, rough)
        if not edge.found:
            covered = np.zeros_like(covered)
            break
        # A gap that is not deep has a rim of its own: it shows once the edge is known.
        inward = np.sum(edge.shift_mm * at(curve, stations).inward, axis=1)
        still = covered & is_shown(curve, surface, stations, inward, partial(height, edge_mm=inward - rim_mm))
        if (still == covered).all():
            break
        covered = still
    shift = edge.shift_mm - edge_offset_mm * at(curve, stations).inward if not uncut else edge.shift_mm
    behind = np.sum(edge.shift_mm * at(curve, stations).inward, axis=1) - rim_mm
    lift = height(behind)
    return EdgeMeasurement(
        stations,
        np.where(covered, edge.depth_mm - edge_offset_mm, np.nan),
        _local_height(seen, local, since, lift, stations, curve, covered, spacing_mm),
        shift,
        lift,
        local.height_and_slope(stations, behind)[1] - since.tilt(stations),
        covered,
        edge.u_mm,
        np.full(len(stations), np.nan) if rough else local.uncertainty_mm(stations, behind),
        LeaveOut(_rms(edge.halves_mm[covered]), local.halves_mm),
        local.noise_mm,
        edge.row_gap_mm * covered,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """The edge at k stations: local depth, smooth shift, its uncertainty, difference between halves, gap of rows."""

    depth_mm: FloatArray
    shift_mm: FloatArray
    u_mm: FloatArray
    halves_mm: FloatArray
    row_gap_mm: FloatArray
    found: bool = True


def _no_edge(stations: FloatArray) -> _Edge:
    nothing = np.full(len(stations), np.nan)
    return _Edge(nothing, np.zeros((len(stations), 3)), nothing, nothing, np.zeros(len(stations)))


def _edge(
    seen: PointsAtRim,
    stations: FloatArray,
    curve: FramedCurve,
    rigid: FramedCurve,
    covered: BoolArray,
    spacing_mm: float,
    noise_mm: float,
    rough: bool,
) -> _Edge:
    points = _edge_points(seen, stations, curve, covered, spacing_mm, noise_mm)
    space = in_surface(splines_along(curve, FIELD_STEP_SPACINGS * spacing_mm, MOST_FIELD_INTERVALS), curve, rigid)
    fit = fit_to_edge(space, points, rough=rough)
    shift, rows = space.shift_mm(stations, fit.coefficients), space.rows(stations)
    inward = np.sum(shift * at(curve, stations).inward, axis=1)
    even, odd = fit.halves
    depth = _local_depth(points, inward, curve, covered)
    behind = points.depth_mm - interpolated(inward, stations, points.s_mm, curve)
    gap = row_gap_mm(behind, points.s_mm, points.per_mm, stations, curve, spacing_mm)
    # The edge may lie anywhere between the last row and the next one, which is not there.
    u = np.full(len(stations), np.nan) if rough else np.hypot(fit.uncertainty_mm(rows), gap / np.sqrt(3.0))
    return _Edge(depth, shift, u, rows.times(even - odd), gap, len(points.s_mm) >= LEAST_POINTS)


def _edge_points(
    seen: PointsAtRim,
    stations: FloatArray,
    curve: FramedCurve,
    covered: BoolArray,
    spacing_mm: float,
    noise_mm: float,
) -> EdgePoints:
    gap = np.pad(~covered, GAP_MARGIN, mode="wrap" if curve.closed else "edge")
    counted = ~binary_dilation(gap, iterations=GAP_MARGIN)[GAP_MARGIN:-GAP_MARGIN]
    density = interior_density(seen, stations, curve, spacing_mm, counted)
    ends = np.ones(len(stations)) if curve.closed else np.pad(np.ones(len(stations) - 2), 1, constant_values=0.5)
    per_mm = density * counted * ends * (stations[1] - stations[0])
    near = seen.behind_rim_mm < EDGE_ZONE_SPACINGS * spacing_mm
    near &= counted[nearest_station(seen.s_mm, stations, curve)]
    order = np.flatnonzero(near)[np.argsort(seen.s_mm[near], kind="stable")]
    rim = seen.inward_mm - seen.behind_rim_mm
    return EdgePoints(seen.s_mm[order], seen.inward_mm[order], rim[order], stations, per_mm, spacing_mm, noise_mm)


def _local_depth(points: EdgePoints, inward_mm: FloatArray, curve: FramedCurve, covered: BoolArray) -> FloatArray:
    """Return the edge at each station from the moment of the points around it alone; NaN where the scan shows none."""
    stations, width = points.stations_mm, LOCAL_WIDTH_SPACINGS * points.spacing_mm
    tau = LOCAL_DECAY_SPACINGS * points.spacing_mm
    psi = moment(points.depth_mm - interpolated(inward_mm, stations, points.s_mm, curve), tau)
    found = smoothed(sums(points.s_mm, stations, curve, psi), stations, curve, width)
    should_be = smoothed(points.per_mm, stations, curve, width)
    with np.errstate(divide="ignore", invalid="ignore"):
        # The moments' mean ratio holds the density of the rim: the field has settled that already.
        offset = -tau * np.log((found / found.sum()) / (should_be / should_be.sum()))
    whole = smoothed(np.ones(len(stations)), stations, curve, width)
    shown = covered & (smoothed(covered.astype(np.float64), stations, curve, width) > LOCAL_SHARE * whole)
    return np.where(shown & np.isfinite(offset), inward_mm + offset, np.nan)


def _local_height(
    seen: PointsAtRim,
    local: LocalSurface,
    since: _Since,
    lift_mm: FloatArray,
    stations: FloatArray,
    curve: FramedCurve,
    covered: BoolArray,
    spacing_mm: float,
) -> FloatArray:
    """Return the height at each station with the mean misfit of the points around it; NaN where the scan shows none."""
    near = seen.taken(seen.behind_rim_mm < EDGE_ZONE_SPACINGS * spacing_mm)
    fitted = local.height_and_slope(near.s_mm, near.behind_rim_mm)[0] - since.rise_mm(near.s_mm, near.behind_rim_mm)
    misfit = near.outward_mm - fitted
    width = LOCAL_HEIGHT_SPACINGS * spacing_mm
    total = smoothed(sums(near.s_mm, stations, curve, misfit), stations, curve, width)
    count = smoothed(sums(near.s_mm, stations, curve), stations, curve, width)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0.0)
    return np.where(covered, lift_mm + mean, np.nan)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("inf")


def on_curve(values: FloatArray, measured: EdgeMeasurement, curve: FramedCurve) -> FloatArray:
    """Return (k,) or (k, c) values of the measured stations at the stations of a curve."""
    return interpolated(values, measured.s_mm, curve.s_mm, curve)


def gaps(measured: EdgeMeasurement, curve: FramedCurve) -> FloatArray:
    """Return the (g, 2) start and end of each run of stations that the scan does not show, within 0 and the length."""
    step = measured.s_mm[1] - measured.s_mm[0]
    hidden = np.concatenate([[False], ~measured.covered, [False]])
    change = np.flatnonzero(np.diff(hidden.astype(np.int64)))
    edges = np.clip((change.reshape(-1, 2) - 0.5) * step, 0.0, curve.length_mm)
    if curve.closed and hidden[1] and hidden[-2]:
        edges[-1, 1] = curve.length_mm  # one gap over the seam, stated in two parts
    return np.asarray(edges, dtype=np.float64)
