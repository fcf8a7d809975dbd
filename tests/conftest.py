"""Synthetic parts whose truth is known in closed form: an outline in the plane, laid on a sheet, sampled as a scan.

A part is an outline (u, w) in mm and a sheet (u, w) -> (x, y, z). The nominal sheet makes the contour, the deformed
sheet makes the scan and the true edge. Depth is measured from the outline into the material.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree
from scipy.spatial.transform import Rotation

from sicp_cam.model import Contour, Scan
from sicp_cam.rigid_motion import apply, from_parts, rotate

STEP_MM = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A plane curve, its material to the left of the travel, sampled every 0.05 mm."""

    points: np.ndarray
    tangents: np.ndarray
    length_mm: float
    closed: bool

    @property
    def inward(self):
        return np.stack([-self.tangents[:, 1], self.tangents[:, 0]], axis=1)

    def sampled(self, step_mm, start_mm=0.0):
        """Return points, tangents and inward directions about every `step_mm`."""
        i = self.samples(step_mm, start_mm)
        return self.points[i], self.tangents[i], self.inward[i]

    def samples(self, step_mm, start_mm=0.0):
        """Return the indices of the points about every `step_mm`."""
        count = round(self.length_mm / step_mm)
        s = np.linspace(0.0, self.length_mm, count + (not self.closed), endpoint=not self.closed) + start_mm
        i = np.round(s / self.length_mm * (len(self.points) - (not self.closed))).astype(int)
        return i % len(self.points) if self.closed else np.minimum(i, len(self.points) - 1)

    @property
    def corners(self):
        """Indices of the points at which the travel turns by more than 15 degrees at once."""
        step = np.diff(np.vstack([self.points, self.points[:1]]), axis=0)
        step /= np.linalg.norm(step, axis=1, keepdims=True)
        turns = np.sum(step * np.roll(step, 1, axis=0), axis=1) < np.cos(np.radians(15.0))
        return np.flatnonzero(turns) if self.closed else np.flatnonzero(turns[1:-1]) + 1

    def depth(self, uv):
        """Return depth into the material and arc length of the nearest place, for (n, 2) points.

        Further away than 5 mm the nearest of every tenth place will do: searching the middle of a hole takes long.
        """
        far, i = cKDTree(self.points[::10]).query(uv)
        i = 10 * i
        near = far < 5.0
        i[near] = cKDTree(self.points).query(uv[near])[1]
        return np.sum((uv - self.points[i]) * self.inward[i], axis=1), i * self.length_mm / len(self.points)


def outline_of(dense, closed):
    """Resample a dense (n, 2) polyline to equal arcs."""
    ring = np.vstack([dense, dense[:1]]) if closed else dense
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
    wanted = np.linspace(0.0, s[-1], round(s[-1] / STEP_MM) + (not closed), endpoint=not closed)
    points = np.stack([np.interp(wanted, s, ring[:, i]) for i in range(2)], axis=1)
    ahead, behind = (np.roll(points, k, axis=0) for k in (-1, 1))
    if not closed:
        ahead[-1], behind[0] = points[-1], points[0]
    tangents = ahead - behind
    return Outline(points, tangents / np.linalg.norm(tangents, axis=1, keepdims=True), float(s[-1]), closed)


def polar(radius, *, hole=True, centre=(0.0, 0.0)):
    """Return the closed outline r(angle): a hole runs clockwise, an outer edge counter-clockwise."""
    angle = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False) * (-1.0 if hole else 1.0)
    r = radius(angle)
    return outline_of(np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) + centre, True)


def circle(radius, **options):
    return polar(lambda angle: np.full_like(angle, radius), **options)


def oval(a, b, **options):
    return polar(lambda angle: a * b / np.hypot(b * np.cos(angle), a * np.sin(angle)), **options)


def egg(size, **options):
    """Return an outline that falls onto itself under no rotation."""
    return polar(
        lambda angle: size * (1.0 + 0.14 * np.cos(angle) + 0.12 * np.cos(2 * angle) + 0.05 * np.sin(3 * angle)),
        **options,
    )


def lopsided(size, **options):
    """Return an outline that falls onto itself neither turned nor turned over."""
    return polar(
        lambda angle: size * (1.0 + 0.15 * np.cos(2 * angle) + 0.1 * np.cos(3 * angle - 0.25 * np.pi)), **options
    )


def rounded_rectangle(width, height, radius, *, hole=False):
    a, b = 0.5 * width - radius, 0.5 * height - radius
    turn = np.linspace(0.0, 0.5 * np.pi, 2000)
    corners = [
        np.array(centre) + radius * np.stack([np.cos(turn + start), np.sin(turn + start)], axis=1)
        for centre, start in (((a, b), 0), ((-a, b), np.pi / 2), ((-a, -b), np.pi), ((a, -b), 3 * np.pi / 2))
    ]
    ring = np.concatenate(corners)
    return outline_of(ring[::-1] if hole else ring, True)


def wavy_edge(length, amplitude=6.0):
    """Return an open edge along u with the material above it."""
    u = np.linspace(-0.5 * length, 0.5 * length, 100_000)
    return outline_of(np.stack([u, amplitude * np.sin(2.0 * np.pi * u / length)], axis=1), False)


def stretch(outline, start_mm, end_mm):
    """Return the open part of an outline between two arc lengths."""
    first, last = (round(s / outline.length_mm * len(outline.points)) for s in (start_mm, end_mm))
    return Outline(outline.points[first:last], outline.tangents[first:last], end_mm - start_mm, False)


def across(outline, width_mm):
    """Return the other edge of a flange: parallel to a closed outline, its material on the other side."""
    return outline_of((outline.points + width_mm * outline.inward)[::-1], True)


def plane(uv):
    return np.column_stack([uv, np.zeros(len(uv))])


def cylinder(radius):
    """Return the isometric roll of the plane about an axis along w."""
    return lambda uv: np.column_stack(
        [radius * np.sin(uv[:, 0] / radius), uv[:, 1], radius * np.cos(uv[:, 0] / radius) - radius]
    )


def dome(radius_u, radius_w):
    return lambda uv: np.column_stack([uv, -0.5 * (uv[:, 0] ** 2 / radius_u + uv[:, 1] ** 2 / radius_w)])


def bent(sheet, rise):
    """Return a sheet pushed along its normals by rise(u, w) mm."""
    return lambda uv: sheet(uv) + rise(uv[:, 0], uv[:, 1])[:, None] * frame(sheet, uv)[2]


def shifted(sheet, by_mm):
    return lambda uv: sheet(uv) + by_mm


def frame(sheet, uv):
    """Return dS/du, dS/dw and the unit normal at (n, 2) places, by central differences."""
    h = 1e-2
    du, dw = ((sheet(uv + step) - sheet(uv - step)) / (2.0 * h) for step in (np.array([h, 0.0]), np.array([0.0, h])))
    normal = np.cross(du, dw)
    return du, dw, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def contour(outline, sheet=plane, *, step_mm=1.0, start_mm=0.0, rings_mm=(10.0, 30.0), ring_step_mm=10.0, others=()):
    """Lay an outline on a sheet, as a CAD reader would hand it over; `others` are the part's other edges."""
    uv, tangent, _ = outline.sampled(step_mm, start_mm)
    du, dw, normals = frame(sheet, uv)
    tangents = tangent[:, :1] * du + tangent[:, 1:] * dw
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    place, _, inward = outline.sampled(ring_step_mm)
    ring = np.concatenate([place + depth * inward for depth in rings_mm]) if rings_mm else np.zeros((0, 2))
    for other in others:
        ring = ring[other.depth(ring)[0] > 0.0]
    return Contour(
        sheet(uv),
        tangents,
        normals,
        outline.closed,
        corners=np.flatnonzero(np.isin(outline.samples(step_mm, start_mm), outline.corners)),
        ring_points_mm=sheet(ring),
        ring_normals=frame(sheet, ring)[2],
    )


def material(outlines, *, sampling="jittered", spacing_mm=2.0, depth_mm=60.0, seed=0, jitter=0.8):
    """Sample the plane within `depth_mm` of outlines, on their material side, as (n, 2) places.

    `sampling` is `jittered` (a grid), `random`, or `voxels` (dense, then thinned to one point per cell).
    """
    rng = np.random.default_rng(seed)
    if sampling == "voxels":
        fine = material(outlines, sampling="random", spacing_mm=spacing_mm / 3.0, depth_mm=depth_mm, seed=seed)
        return thinned(fine, spacing_mm, seed)
    bound = np.concatenate([outline.points for outline in outlines])
    low, high = bound.min(axis=0) - depth_mm, bound.max(axis=0) + depth_mm
    if not outlines[0].closed:
        low[0], high[0] = bound[:, 0].min(), bound[:, 0].max()
    if sampling == "random":
        uv = rng.uniform(low, high, (int(np.prod((high - low) / spacing_mm)), 2))
    else:
        axes = [np.arange(a, b, spacing_mm) for a, b in zip(low, high, strict=True)]
        uv = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2) + rng.uniform(0, spacing_mm, 2)
        uv += rng.uniform(-0.5, 0.5, uv.shape) * jitter * spacing_mm
    return of_material(uv, outlines, depth_mm)


def of_material(uv, outlines, depth_mm):
    """Keep the (n, 2) places inside the material of every outline, and within a depth of one of them."""
    depths = np.stack([outline.depth(uv)[0] for outline in outlines])
    return uv[(depths > 0.0).all(axis=0) & (depths.min(axis=0) < depth_mm)]


def rows(outlines, *, along_mm=0.25, gap_mm=2.0, degrees=0.0, start_mm=0.0, depth_mm=40.0, seed=0):
    """Sample the plane as a line scanner does: points close together in rows far apart, `degrees` from the u axis.

    A row lies at `start_mm` from the origin; each row starts at a place of its own.
    """
    rng = np.random.default_rng(seed)
    reach = max(np.linalg.norm(outline.points, axis=1).max() for outline in outlines) + depth_mm
    along, over = np.arange(-reach, reach, along_mm), np.arange(-reach // gap_mm, reach // gap_mm) * gap_mm + start_mm
    places = np.stack(np.meshgrid(along, over), axis=-1)
    places[..., 0] += rng.uniform(0.0, along_mm, len(over))[:, None]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return of_material(places.reshape(-1, 2) @ np.array([[c, s], [-s, c]]), outlines, depth_mm)


def strays(outline, count, *, reach_mm=3.0, seed=0):
    """Return (count, 2) places outside of the material within reach of its edge: a scanner's mixed pixels."""
    rng = np.random.default_rng(seed)
    i = rng.integers(0, len(outline.points), count)
    return outline.points[i] - rng.uniform(0.0, reach_mm, (count, 1)) * outline.inward[i]


def thinned(uv, cell_mm, seed):
    """Replace the places in each cell of a turned grid by their mean, as scanner software does."""
    turn = np.random.default_rng(seed).uniform(0.0, 0.5 * np.pi)
    turned = uv @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    column, row = np.floor(turned / cell_mm).astype(np.int64).T
    _, cell, count = np.unique(column * 100_000 + row, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(cell, weights=axis) / count for axis in uv.T], axis=1)


def without_gaps(uv, outline, gaps_mm, depth_mm=25.0):
    """Drop the places near the outline whose arc length lies in one of the (start, end) gaps; they may pass 0."""
    depth, s = outline.depth(uv)
    keep = np.ones(len(uv), dtype=bool)
    for start, end in gaps_mm:
        keep &= (depth > depth_mm) | (np.mod(s - start, outline.length_mm) > end - start)
    return uv[keep]


def triangles(uv, spacing_mm, outlines):
    """Triangulate (n, 2) places, without the triangles that span a hole or are long."""
    faces = Delaunay(uv).simplices
    corners = uv[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    middle = corners.mean(axis=1)
    inside = np.all([outline.depth(middle)[0] > 0.0 for outline in outlines], axis=0)
    faces = faces[inside & (longest < 3.0 * spacing_mm)]
    flat = uv[faces]
    first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    clockwise = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0.0
    faces[clockwise] = faces[clockwise][:, ::-1]
    return faces.astype(np.int64)


def scan(uv, sheet=plane, *, noise_mm=0.05, outliers=0.0, pose=None, normals=False, faces=None, seed=1):
    """Measure places on a sheet: noise in all three axes, outliers up to 20 mm off, then the pose T_scan_part."""
    rng = np.random.default_rng(seed)
    points = sheet(uv) + rng.normal(0.0, noise_mm, (len(uv), 3))
    wild = rng.random(len(uv)) < outliers
    points[wild] += rng.uniform(-20.0, 20.0, (int(wild.sum()), 3))
    T = np.eye(4) if pose is None else pose
    directions = rotate(T, frame(sheet, uv)[2]) if normals else None
    return Scan(apply(T, points), directions, faces)


def random_pose(seed, reach_mm=1000.0):
    rng = np.random.default_rng(seed)
    return from_parts(Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach_mm, reach_mm, 3))


def disturbed(pose, seed, degrees=1.0, shift_mm=5.0):
    """Return a pose about as wrong as a fixture leaves it: shifted and turned about its own origin."""
    rng = np.random.default_rng(seed)
    turn, shift = rng.normal(size=3), rng.normal(size=3)
    turn, shift = (v / np.linalg.norm(v) for v in (turn, shift))
    return pose @ from_parts(Rotation.from_rotvec(np.radians(degrees) * turn).as_matrix(), shift_mm * shift)


def errors(curve, outline, sheet=plane, pose=None):
    """Return how far a curve lies from the true edge: normal and out in mm, axis in degrees, at each of its stations.

    The truth is dense and the comparison independent of the package's own projection.
    """
    T = np.eye(4) if pose is None else pose
    true = contour(outline, sheet, step_mm=0.1, rings_mm=())
    points, tangents, normals = apply(T, true.points_mm), rotate(T, true.tangents), rotate(T, true.normals)
    _, i = cKDTree(points).query(curve.points_mm)
    offset = curve.points_mm - points[i]
    normal = np.sum(offset * np.cross(normals, tangents)[i], axis=1)
    out = np.sum(offset * normals[i], axis=1)
    axis = np.degrees(np.arccos(np.clip(np.sum(curve.outward * normals[i], axis=1), -1.0, 1.0)))
    return SimpleNamespace(normal=normal, out=out, both=np.hypot(normal, out), axis_deg=axis)


class Builders(SimpleNamespace):
    """The builders of this module; Hypothesis prints the arguments of a failing test, so this stays short."""

    def __repr__(self):
        return "synthetic"


@pytest.fixture(scope="session")
def synthetic():
    """Give the builders of this module to the tests."""
    return Builders(**{name: value for name, value in globals().items() if callable(value)})
