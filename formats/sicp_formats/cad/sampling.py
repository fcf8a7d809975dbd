"""Sample the loops of a skin on their exact curves.

Runs in the child process only: it evaluates the CAD kernel's curves and surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.GCPnts import GCPnts_AbscissaPoint, GCPnts_QuasiUniformAbscissa
from OCP.GeomAbs import GeomAbs_Shape
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TColStd import TColStd_Array1OfReal

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.cad.faces import Body, EdgeUse, Face, outward_normals
from sicp_formats.cad.skins import Loop

__all__ = ["SampledLoop", "sample_loop", "unit"]

STEP_MM = 1.0
COARSE_COUNT = 20_000
"""Only a loop longer than this many `STEP_MM` has longer steps."""
SAG_MM = 0.002
TURN_DEG = 5.0
CORNER_DEG = 10.0
SHORTEST_MM = 1e-5
"""A stretch shorter than this is a point: its samples would be duplicates."""
FINEST_MM = 1e-3
"""Steps are not refined below this, whatever the curve does."""
END_NUDGE = 1e-7
"""Tangents at the ends of a stretch are taken this fraction of it inside, where they are one-sided for certain."""


@dataclass(frozen=True, slots=True, eq=False)
class SampledLoop:
    """Samples of one loop, n of them, and where they lie on the skin.

    Parameters
    ----------
    points_mm, tangents, normals
        (n, 3) each; at a corner the tangent is the bisector of the two sides.
    face, uv
        (n,) index of the face in the body, and (n, 2) the surface parameters on it.
    corners
        Indices of the samples where the tangent jumps by more than `CORNER_DEG`.
    closed
        True if the first sample follows on the last.
    gap_mm
        The largest distance between a curve and the surface that it bounds, or between two edges that meet: how exact
        the file itself is.
    """

    points_mm: FloatArray
    tangents: FloatArray
    normals: FloatArray
    face: IntArray
    uv: FloatArray
    corners: IntArray
    closed: bool
    gap_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """Samples of a smooth stretch of one edge in the order of travel, both ends included."""

    points: FloatArray
    tangents: FloatArray
    normals: FloatArray
    uv: FloatArray
    face: int
    gap: float


def sample_loop(loop: Loop, body: Body) -> SampledLoop | None:
    """Sample a loop on its exact curves, at arc-length steps of at most `STEP_MM`.

    Steps are shorter where the chord would leave the curve by more than `SAG_MM` or the curve turns by more than
    `TURN_DEG`. Where two edges meet, their samples become one, with the mean normal and the bisector of the tangents.

    Returns
    -------
    SampledLoop or None
        None for a loop with no length, or one along which the surface has no normal.
    """
    length = sum(_length(use.curve, use.first, use.last) for use in loop.uses)
    step = max(STEP_MM, length / COARSE_COUNT)
    pieces = []
    for use in loop.uses:
        for first, last in _smooth_ranges(use):
            if _length(use.curve, first, last) > SHORTEST_MM:
                pieces.append(_piece(use, body.faces[use.face], first, last, step))
    if not pieces or any(not np.isfinite(piece.normals).all() for piece in pieces):
        return None
    return _assembled(pieces, loop.closed)


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) at unit length; nan for a zero vector."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    scaled: FloatArray = vectors / np.where(size > 0.0, size, np.nan)
    return scaled


def _length(curve: Any, first: float, last: float) -> float:
    return float(GCPnts_AbscissaPoint.Length_s(curve, first, last))


def _smooth_ranges(use: EdgeUse) -> list[tuple[float, float]]:
    """Return the parameter ranges of an edge between its kinks, in the order of travel."""
    count = use.curve.NbIntervals(GeomAbs_Shape.GeomAbs_C1)
    ends = TColStd_Array1OfReal(1, count + 1)
    use.curve.Intervals(ends, GeomAbs_Shape.GeomAbs_C1)
    ranges = [(ends.Value(i), ends.Value(i + 1)) for i in range(1, count + 1)]
    return ranges if use.forward else ranges[::-1]


def _piece(use: EdgeUse, face: Face, first: float, last: float, step: float) -> _Piece:
    parameters, points, tangents = _refined(use.curve, first, last, step)
    if not use.forward:
        parameters, points, tangents = parameters[::-1], points[::-1], -tangents[::-1]
    uv = use.uv(parameters)
    normals = _filled(outward_normals(face, uv))
    return _Piece(points, tangents, normals, uv, use.face, _gap(face, uv, points))


def _refined(curve: Any, first: float, last: float, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return parameters (n,), points (n, 3) and unit tangents (n, 3) that keep the limits of `sample_loop`."""
    count = int(np.ceil(1.001 * _length(curve, first, last) / step)) + 1
    spread = GCPnts_QuasiUniformAbscissa(curve, count, first, last)
    parameters = np.array([spread.Parameter(i) for i in range(1, spread.NbPoints() + 1)])
    parameters[[0, -1]] = first, last
    points, tangents = _evaluated(curve, parameters, first, last)
    while (coarse := _too_coarse(points, tangents, step)).any():
        places = np.flatnonzero(coarse)
        middles = (parameters[places] + parameters[places + 1]) / 2
        more_points, more_tangents = _evaluated(curve, middles, first, last)
        parameters = np.insert(parameters, places + 1, middles)
        points = np.insert(points, places + 1, more_points, axis=0)
        tangents = np.insert(tangents, places + 1, more_tangents, axis=0)
    return parameters, points, tangents


def _evaluated(curve: Any, parameters: FloatArray, first: float, last: float) -> tuple[FloatArray, FloatArray]:
    point, slope = gp_Pnt(), gp_Vec()
    inside = np.clip(parameters, first + END_NUDGE * (last - first), last - END_NUDGE * (last - first))
    points, slopes = np.empty((len(parameters), 3)), np.empty((len(parameters), 3))
    for row, (exact, nudged) in enumerate(zip(parameters.tolist(), inside.tolist(), strict=True)):
        curve.D1(nudged, point, slope)
        slopes[row] = slope.X(), slope.Y(), slope.Z()
        if exact != nudged:
            curve.D0(exact, point)
        points[row] = point.X(), point.Y(), point.Z()
    return points, _filled(unit(slopes))


def _too_coarse(points: FloatArray, tangents: FloatArray, step: float) -> BoolArray:
    """Say which steps are too long, sag or turn too much, by the cubic that has their ends and tangents.

    A cubic that leaves its chord at the angles a and b rises no more than 4/27 of the chord times (a + b) above it.
    """
    chords = np.diff(points, axis=0)
    lengths = np.linalg.norm(chords, axis=1)
    along = chords / np.maximum(lengths, SHORTEST_MM)[:, None]
    swing = _angles(tangents[:-1], along) + _angles(along, tangents[1:])
    coarse = (lengths > step) | (4.0 / 27.0 * lengths * swing > SAG_MM) | (swing > np.radians(TURN_DEG))
    fine_enough: BoolArray = coarse & (lengths > FINEST_MM)
    return fine_enough


def _angles(a: FloatArray, b: FloatArray) -> FloatArray:
    angles: FloatArray = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
    return angles


def _filled(vectors: FloatArray) -> FloatArray:
    """Give samples without a direction that of the nearest ones that have it; nan throughout if none has."""
    known = np.isfinite(vectors).all(axis=1)
    if known.all() or not known.any():
        return vectors
    places = np.arange(len(vectors))
    return unit(np.column_stack([np.interp(places, places[known], column[known]) for column in vectors.T]))


def _gap(face: Face, uv: FloatArray, points: FloatArray) -> float:
    """Return the largest distance between curve and surface over a few samples of a piece."""
    largest = 0.0
    for i in np.unique(np.linspace(0, len(uv) - 1, 9).astype(int)).tolist():
        on_surface = face.surface.Value(uv[i, 0], uv[i, 1])
        largest = max(largest, on_surface.Distance(gp_Pnt(*points[i].tolist())))
    return largest


def _assembled(pieces: list[_Piece], closed: bool) -> SampledLoop:
    """Join pieces to one loop; the end of each is one sample with the start of the next."""
    counts = np.array([len(piece.points) - 1 for piece in pieces])
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    keep_last = 0 if closed else 1
    points, tangents, normals, uv = (
        np.vstack([*(getattr(p, name)[:-1] for p in pieces), getattr(pieces[-1], name)[-1:][:keep_last]])
        for name in ("points", "tangents", "normals", "uv")
    )
    corners, gap = [], max(piece.gap for piece in pieces)
    for i in range(0 if closed else 1, len(pieces)):
        before, after, row = pieces[i - 1], pieces[i], starts[i]
        gap = max(gap, float(np.linalg.norm(after.points[0] - before.points[-1])))
        points[row] = (before.points[-1] + after.points[0]) / 2
        normals[row] = _mean_direction(before.normals[-1], after.normals[0], after.normals[0])
        # Where the loop turns back on itself the bisector is lost; it goes around the tip, which is material.
        turning_back = np.cross(before.tangents[-1], normals[row])
        tangents[row] = _mean_direction(before.tangents[-1], after.tangents[0], turning_back)
        if _angles(before.tangents[-1], after.tangents[0]) > np.radians(CORNER_DEG):
            corners.append(row)
    face = np.repeat([piece.face for piece in pieces], counts)
    face = np.concatenate([face, [pieces[-1].face] * keep_last])
    return SampledLoop(
        points, tangents, normals, face.astype(np.int64), uv, np.array(corners, dtype=np.int64), closed, gap
    )


def _mean_direction(a: FloatArray, b: FloatArray, otherwise: FloatArray) -> FloatArray:
    total = a + b
    size = np.linalg.norm(total)
    mean: FloatArray = total / size if size > 1e-6 else otherwise / np.linalg.norm(otherwise)
    return mean
