"""Where a scan shows the edge of a contour: its rim, how densely points lie behind it, and the gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.contour.projection import coordinates
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.gauss_newton import tukey
from sicp_cam.registration.rigid import facing_rim
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.stations import interpolated, smoothed, sums

__all__ = ["PointsAtRim", "interior_density", "is_shown", "points_at_rim", "rim_depth", "row_gap_mm"]

RIM_WIDTH_SPACINGS = 3.0
LEAST_RIM_WEIGHT = 0.05
DENSITY_WIDTH_SPACINGS = 12.0
"""Standard deviation of the window along the contour over which the density of the interior is averaged."""
INTERIOR_SPACINGS = (2, 7)
"""Depths between which the density of the interior is counted, in slices of one spacing."""
FULL_SLICE = 0.3
"""Least density of a slice of the interior, over that of the fullest slice."""
LEAST_AREA = 0.2
"""Least area of a slice over that of a straight one: where a corner of the material is narrower, it does not count."""
COVERED_SHARE = 0.3
"""Least number of rim points around a station, over the median along the contour."""
PROBES = (((0.5, 1.25, 2.0), 2), ((3.5, 5.0, 6.5), 1))
"""Depths behind the rim at which the surface is looked for, in point spacings, and at how many it must be found."""
PROBE_RADIUS_SPACINGS = 1.2
BEFORE_RIM_SPACINGS = 3.0
ROWS_DEPTH_SPACINGS, ROWS_SLICE_SPACINGS, EMPTY_SLICE = 3.0, 0.1, 0.1
STRIPS_SPACINGS = ((10.0, 0.3), (4.0, 0.8))
"""Windows along the edge, and the width of empty strips that chance does not make in each."""


@dataclass(frozen=True, slots=True, eq=False)
class PointsAtRim:
    """Scan points seen from a curve, (n,) each, in mm.

    Parameters
    ----------
    s_mm, inward_mm, outward_mm
        Arc length, and offset along B and N, see `projection.CurveCoordinates`.
    behind_rim_mm
        Depth behind the mean rim of the scan there.
    """

    s_mm: FloatArray
    inward_mm: FloatArray
    outward_mm: FloatArray
    behind_rim_mm: FloatArray

    def taken(self, rows: BoolArray) -> PointsAtRim:
        """Return some of the points."""
        return PointsAtRim(self.s_mm[rows], self.inward_mm[rows], self.outward_mm[rows], self.behind_rim_mm[rows])


def rim_depth(
    curve: FramedCurve, surface: ScanSurface, stations: FloatArray, reach_mm: float
) -> tuple[FloatArray, BoolArray]:
    """Return the robust mean depth of the rim points around each station, and where there are any.

    The rim lies about half a point spacing behind the edge. Depths are carried linearly over stretches without rim.
    """
    chosen, s_mm = facing_rim(surface.rim, curve, reach_mm)
    depth_of_rim = coordinates(surface.rim.points_mm[chosen], curve).inward_mm
    width_mm = RIM_WIDTH_SPACINGS * surface.spacing_mm
    trust, known = tukey(depth_of_rim, 0.5 * reach_mm), np.zeros(len(stations), dtype=bool)
    depth, total = np.zeros(len(stations)), np.zeros(len(stations))
    for _ in range(5):
        total = smoothed(sums(s_mm, stations, curve, trust), stations, curve, width_mm)
        weighted = smoothed(sums(s_mm, stations, curve, trust * depth_of_rim), stations, curve, width_mm)
        known = total > LEAST_RIM_WEIGHT * surface.spacing_mm / width_mm
        if not known.any():
            return np.zeros(len(stations)), known
        period = curve.length_mm if curve.closed else None
        depth = np.interp(stations, stations[known], weighted[known] / total[known], period=period)
        deviation = depth_of_rim - interpolated(depth, stations, s_mm, curve)
        middle = float(np.median(np.abs(deviation[trust > 0.0]))) if (trust > 0.0).any() else 0.0
        trust = tukey(deviation, max(2.0 * surface.spacing_mm, 6.0 * middle))
    return depth, known & (total > COVERED_SHARE * np.median(total))


def points_at_rim(
    curve: FramedCurve, surface: ScanSurface, stations: FloatArray, rim_mm: FloatArray, depth_mm: float
) -> PointsAtRim:
    """Return the scan points seen from a curve that lie up to a depth behind the rim, or a little before it."""
    seen = coordinates(np.concatenate([surface.points_mm, surface.strays_mm]), curve)
    behind = seen.inward_mm - interpolated(rim_mm, stations, seen.s_mm, curve)
    every = PointsAtRim(seen.s_mm, seen.inward_mm, seen.outward_mm, behind)
    near = (behind > -BEFORE_RIM_SPACINGS * surface.spacing_mm) & (behind < depth_mm)
    if not curve.closed:  # what lies beyond an end is seen from no station
        near &= (seen.s_mm > 0.0) & (seen.s_mm < curve.length_mm)
    return every.taken(near)


def is_shown(
    curve: FramedCurve,
    surface: ScanSurface,
    stations: FloatArray,
    rim_mm: FloatArray,
    height_mm: Callable[[FloatArray], FloatArray],
) -> BoolArray:
    """Say at which stations the scan shows the surface behind the rim: just behind it, and further in.

    Places on it are probed along B. Densities would not do: beside a corner of the material they are lower.

    Parameters
    ----------
    rim_mm
        (k,) depth of the rim.
    height_mm
        Gives the height of the scan over the curve, (k,), at depths behind the rim, (k,).
    """
    foot = at(curve, stations)
    shown = np.ones(len(stations), dtype=bool)
    for depths, wanted in PROBES:
        behind = [np.full(len(stations), depth * surface.spacing_mm) for depth in depths]
        places = np.stack([_beside(foot, rim_mm + depth, height_mm(depth)) for depth in behind])
        distance, _ = surface.tree.query(places, distance_upper_bound=PROBE_RADIUS_SPACINGS * surface.spacing_mm)
        shown &= np.isfinite(distance).sum(axis=0) >= wanted
    return shown


def _beside(foot: FramedCurve, inward_mm: FloatArray, outward_mm: FloatArray) -> FloatArray:
    return foot.points_mm + inward_mm[:, None] * foot.inward + outward_mm[:, None] * foot.outward


def interior_density(
    seen: PointsAtRim, stations: FloatArray, curve: FramedCurve, spacing_mm: float, counted: BoolArray
) -> FloatArray:
    """Return the number of points per mm^2 behind the rim at each station, from the stations that are counted.

    Slices of one spacing are compared; those that hold far fewer points than the fullest lie beyond the other side of a
    narrow flange, or in a gap behind the edge, and are left out. At depth h a slice of ds on the curve is 1 + kappa h
    wide, kappa being how fast the curve turns in the surface.
    """
    width_mm, step = DENSITY_WIDTH_SPACINGS * spacing_mm, stations[1] - stations[0]
    turn = _turn_in_surface(curve, stations)
    slices = np.arange(*INTERIOR_SPACINGS)
    number = np.floor(seen.behind_rim_mm / spacing_mm)
    counts = np.stack([sums(seen.s_mm[number == k], stations, curve) for k in slices], axis=1)
    straight = smoothed(counted * step * spacing_mm, stations, curve, width_mm)[:, None]
    areas = (step + turn[:, None] * (slices + 0.5) * spacing_mm) * spacing_mm
    counts, areas = (smoothed(values * counted[:, None], stations, curve, width_mm) for values in (counts, areas))
    usable = areas > LEAST_AREA * straight
    density = np.divide(counts, areas, out=np.zeros_like(counts), where=usable)
    full = usable & (density >= FULL_SLICE * density.max(axis=1, keepdims=True))
    total = (areas * full).sum(axis=1)
    return np.asarray(np.divide((counts * full).sum(axis=1), total, out=np.zeros(len(stations)), where=total > 0.0))


def row_gap_mm(
    depth_mm: FloatArray,
    s_mm: FloatArray,
    per_mm: FloatArray,
    stations: FloatArray,
    curve: FramedCurve,
    spacing_mm: float,
) -> FloatArray:
    """Return the widest empty strip along the edge around each station; 0 where it is too narrow to mean rows.

    Where the rows of a scan run along a straight edge, nothing lies between them, and the edge lies somewhere between
    the last row and the one that would have come next.

    Parameters
    ----------
    depth_mm, s_mm
        (n,) depth of the points behind the edge, and their arc length.
    per_mm
        (k,) points per mm of depth that the density of the interior puts about each station.
    """
    slice_mm, slices = ROWS_SLICE_SPACINGS * spacing_mm, round(ROWS_DEPTH_SPACINGS / ROWS_SLICE_SPACINGS)
    number = np.floor(depth_mm / slice_mm)
    counts = np.stack([sums(s_mm[number == k], stations, curve) for k in range(slices)], axis=1)
    shown, gap = per_mm > 0.0, np.zeros(len(stations))
    for width, least in STRIPS_SPACINGS:
        around = partial(smoothed, stations=stations, curve=curve, width_mm=width * spacing_mm)
        empty = around(counts) < EMPTY_SLICE * slice_mm * around(per_mm)[:, None]
        widest, run = np.zeros(len(stations)), np.zeros(len(stations))
        for column in empty.T:
            run = np.where(column, run + slice_mm, 0.0)
            widest = np.maximum(widest, run)
        # In a gap of the scan there is nothing at all: that is another matter.
        whole = around(shown.astype(np.float64)) > 0.5 * around(np.ones(len(stations)))
        gap = np.maximum(gap, np.where(shown & whole & (widest >= 0.99 * least * spacing_mm), widest, 0.0))
    return gap


def _turn_in_surface(curve: FramedCurve, stations: FloatArray) -> FloatArray:
    """Return the angle by which the contour turns away from the material at each station: minus B . dT."""
    step = stations[1] - stations[0]
    turn = at(curve, stations + 0.5 * step).tangents - at(curve, stations - 0.5 * step).tangents
    angle: FloatArray = -np.sum(turn * at(curve, stations).inward, axis=1)
    return angle
