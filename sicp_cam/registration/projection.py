"""The paper's projection method: one smooth function over the plane of the contour for the whole deformation.

After the rigid registration the contour lies near the scan. Over the least-squares plane P of the registered model,
with unit normal n and in-plane position q, the rise of the scan's surface above the contour is the deformation, and a
function f(q) is fitted to it: the paper's parabola, or a thin-plate spline. Every point then moves by f(q) n (section
2.2 of the paper). Nothing moves in the plane: across the edge the result is about as good as the rigid pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.optimize import minimize_scalar

from sicp_cam.contour.frames import FramedCurve, at, moved, orthonormal
from sicp_cam.errors import RegistrationError
from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_cam.registration.axes import tilted
from sicp_cam.registration.edge import EdgeMeasurement, measure
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import ScanSurface
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.rigid_motion import apply

__all__ = ["project"]

ROUNDS = 2
STEEPEST = 0.2
"""Cosine between scan surface and plane below which the surface is no function over the plane."""
LEAST_STATIONS = 12
STRAIGHT = 0.01
"""Extent across over extent along below which points are taken for a straight line, which spans no plane."""
DIRECTIONS = 36
APART_SPACINGS = 8.0
"""Distance along the contour at which two measured heights share few enough points to test one another."""
FOLDS = 5
SMOOTHINGS = np.logspace(-9.0, 0.0, 10)
"""Weights of the bending energy that are tried, lengths in radii of the contour."""
GRADIENT_STEP = 1e-3
"""Step of the central difference for the gradient of f, in radii of the contour."""

Rise: TypeAlias = Callable[[FloatArray], FloatArray]
"""Height in mm over (n, d) in-plane positions, which are in radii of the contour."""


@dataclass(frozen=True, slots=True, eq=False)
class _Plane:
    """A plane in the scan frame.

    Parameters
    ----------
    origin_mm, normal
        (3,) a point of it, and its unit normal on the outward side.
    axes
        (d, 3) unit vectors in it: two, or the direction of the contour alone where that is straight.
    radius_mm
        Largest distance of the contour from the origin: the unit of in-plane positions.
    """

    origin_mm: FloatArray
    normal: FloatArray
    axes: FloatArray
    radius_mm: float

    def position(self, points_mm: FloatArray) -> FloatArray:
        """Return the (n, d) in-plane position in radii."""
        position: FloatArray = (points_mm - self.origin_mm) @ self.axes.T / self.radius_mm
        return position


def project(
    contour: NominalContour, surface: ScanSurface, T_primary: FloatArray, settings: RegistrationSettings
) -> FramedCurve:
    """Carry a contour to the scan by the rigid pose and a smooth rise over the plane of the contour.

    gamma = R C + T + f(q) n, f being fitted by least squares to the rise of the scan along the covered contour. As
    the rise is read off the scan's tangent planes, the scan is then measured anew from the result, and f fitted again.

    Parameters
    ----------
    contour
        The contour, in the part frame.
    surface
        The scan near it.
    T_primary
        (4, 4) primary registration.
    settings
        `projection_surface` and `reach_mm`.

    Returns
    -------
    The curve in the scan frame, its N normal to the scanned surface.

    Raises
    ------
    RegistrationError
        If the contour spans no plane, the surface stands upright on it, or the scan shows too little of the edge.
    """
    rigid = moved(contour.curve, T_primary)
    plane = _plane(rigid, apply(T_primary, contour.ring_points_mm))
    fitted = _parabola if settings.projection_surface == "parabola" else _spline
    curve, rise = rigid, _level()
    for _ in range(ROUNDS):
        seen = measure(curve, surface, reach_mm=settings.reach_mm, rough=True)
        rows, left_mm, cosine = _above(curve, seen, plane)
        places = plane.position(at(rigid, seen.s_mm[rows]).points_mm)
        apart = max(1, round(APART_SPACINGS * surface.spacing_mm / (seen.s_mm[1] - seen.s_mm[0])))
        rise = fitted(places, rise(places) + left_mm, cosine, apart)
        curve = _lifted(rigid, plane, rise)
    return tilted(curve, measure(curve, surface, reach_mm=settings.reach_mm, rough=True))


def _plane(rigid: FramedCurve, rings_mm: FloatArray) -> _Plane:
    """Return the least-squares plane of the registered contour and stability points."""
    model = np.concatenate([rigid.points_mm, rings_mm])
    origin = model.mean(axis=0)
    _, extents, axes = np.linalg.svd(model - origin, full_matrices=False)
    if extents[1] < STRAIGHT * extents[0]:
        raise RegistrationError("the contour is straight and spans no plane; use another --method than projection")
    normal = axes[2] if np.sum(rigid.outward @ axes[2]) > 0.0 else -axes[2]
    centred = rigid.points_mm - rigid.points_mm.mean(axis=0)
    in_plane = centred - np.outer(centred @ normal, normal)
    _, extents, axes = np.linalg.svd(in_plane, full_matrices=False)
    # A straight edge says nothing of the bend across it: f is then a function of the place along it alone.
    axes = axes[:2][extents[:2] >= STRAIGHT * extents[0]]
    return _Plane(origin, normal, axes, float(np.linalg.norm(centred, axis=1).max()))


def _above(curve: FramedCurve, seen: EdgeMeasurement, plane: _Plane) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return how far the scan's surface lies above the curve along the plane's normal, where the scan shows its edge.

    Returns
    -------
    rows, rise_mm, cosine
        (m,) indices of stations; height of the scan's tangent plane above the curve; cosine between the two planes.
    """
    foot = at(curve, seen.s_mm)
    normals = foot.outward - np.nan_to_num(seen.slope)[:, None] * foot.inward
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    cosine = normals @ plane.normal
    known = seen.covered & np.isfinite(seen.depth_mm) & np.isfinite(seen.height_mm)
    rows = np.flatnonzero(known & (cosine > STEEPEST))
    if len(rows) < max(LEAST_STATIONS, 0.5 * known.sum()):
        raise RegistrationError(
            "too little of the contour has a surface that is a height over the plane of the contour;"
            " use another --method than projection"
        )
    depth, height = seen.depth_mm[rows, None], seen.height_mm[rows, None]
    offset = depth * foot.inward[rows] + height * foot.outward[rows]
    return rows, np.sum(offset * normals[rows], axis=1) / cosine[rows], cosine[rows]


def _level() -> Rise:
    return lambda q: np.zeros(len(q))


def _parabola(places: FloatArray, rise_mm: FloatArray, cosine: FloatArray, apart: int) -> Rise:
    """Fit f = a w^2 + b u + c v + d, w = u cos phi + v sin phi; b, c and d are what the rigid pose leaves.

    For a given direction phi the rest is linear, so phi alone is searched.
    """

    def terms(q: FloatArray, phi: float) -> FloatArray:
        w = q @ np.array([np.cos(phi), np.sin(phi)])[: q.shape[1]]
        return np.column_stack([w * w, q, np.ones(len(q))])

    def solved(phi: float) -> FloatArray:
        # Where the surface stands steeply on the plane, the error of its rise grows with 1 / cosine.
        return np.asarray(np.linalg.lstsq(terms(places, phi) * cosine[:, None], rise_mm * cosine)[0])

    def misfit(phi: float) -> float:
        return float(np.sum((cosine * (terms(places, phi) @ solved(phi) - rise_mm)) ** 2))

    phi = 0.0
    if places.shape[1] == 2:
        step = np.pi / DIRECTIONS
        first = step * int(np.argmin([misfit(step * k) for k in range(DIRECTIONS)]))
        phi = float(minimize_scalar(misfit, bounds=(first - step, first + step), method="bounded").x)
    coefficients = solved(phi)
    return lambda q: np.asarray(terms(q, phi) @ coefficients)


def _spline(places: FloatArray, rise_mm: FloatArray, cosine: FloatArray, apart: int) -> Rise:
    """Fit a thin-plate spline to about every `apart`-th station, its smoothing chosen by cross-validation on those."""
    count = max(len(places) // apart, LEAST_STATIONS)
    some = np.round(np.linspace(0, len(places) - 1, count)).astype(np.int64)
    places, rise_mm, weight = places[some], rise_mm[some], cosine[some] ** 2
    fold = np.arange(count) % FOLDS

    def fit(rows: BoolArray, smoothing: float) -> Rise:
        rise: Rise = RBFInterpolator(places[rows], rise_mm[rows], smoothing=smoothing / weight[rows])
        return rise

    def misfit(smoothing: float) -> float:
        left = [(k, fit(fold != k, smoothing)(places[fold == k]) - rise_mm[fold == k]) for k in range(FOLDS)]
        return float(sum(np.sum(weight[fold == k] * rest**2) for k, rest in left))

    return fit(np.full(count, True), min(SMOOTHINGS, key=misfit))


def _lifted(rigid: FramedCurve, plane: _Plane, rise: Rise) -> FramedCurve:
    """Return the curve moved by X -> X + f(q) n: T turns with the map, N by the inverse transpose of its Jacobian."""
    q = plane.position(rigid.points_mm)
    h = GRADIENT_STEP
    slopes = [(rise(q + step) - rise(q - step)) / (2.0 * h * plane.radius_mm) for step in h * np.eye(q.shape[1])]
    gradient = np.stack(slopes, axis=1) @ plane.axes
    climb = np.sum(gradient * rigid.tangents, axis=1, keepdims=True)
    upright = (rigid.outward @ plane.normal)[:, None]
    T, B, N = orthonormal(rigid.tangents + climb * plane.normal, rigid.outward - upright * gradient)
    points = rigid.points_mm + rise(q)[:, None] * plane.normal
    return FramedCurve(rigid.s_mm, points, T, B, N, rigid.length_mm, rigid.closed)
