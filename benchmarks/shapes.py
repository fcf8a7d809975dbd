"""Plane outlines, sheets in closed form, and their sampling: what the built cases are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.spatial import Delaunay, cKDTree

__all__ = [
    "Outline",
    "Sheet",
    "barrel",
    "bent",
    "circle",
    "dome",
    "flat",
    "frame",
    "oval",
    "rectangle",
    "sampled",
    "triangles",
    "wavy_edge",
]

Sheet: TypeAlias = Callable[[np.ndarray], np.ndarray]
"""(n, 2) places in the plane to (n, 3) points in mm."""

STEP_MM = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A plane curve at equal steps, with its material to the left of the travel."""

    points: np.ndarray
    tangents: np.ndarray
    length_mm: float
    closed: bool

    def every(self, step_mm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return points, tangents and inward directions about every `step_mm`."""
        count = round(self.length_mm / step_mm) + (not self.closed)
        last = len(self.points) - (not self.closed)
        i = np.round(np.linspace(0, last, count, endpoint=not self.closed)).astype(np.int64)
        return self.points[i], self.tangents[i], _left(self.tangents[i])

    def depth(self, uv: np.ndarray) -> np.ndarray:
        """Return how far (n, 2) places lie in the material; negative outside."""
        _, i = cKDTree(self.points).query(uv)
        return np.sum((uv - self.points[i]) * _left(self.tangents[i]), axis=1)


def _left(tangents: np.ndarray) -> np.ndarray:
    return np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)


def _outline(dense: np.ndarray, closed: bool) -> Outline:
    ring = np.vstack([dense, dense[:1]]) if closed else dense
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
    wanted = np.linspace(0.0, s[-1], round(s[-1] / STEP_MM) + (not closed), endpoint=not closed)
    points = np.stack([np.interp(wanted, s, ring[:, i]) for i in range(2)], axis=1)
    ahead, behind = np.roll(points, -1, axis=0), np.roll(points, 1, axis=0)
    if not closed:
        ahead[-1], behind[0] = points[-1], points[0]
    tangents = ahead - behind
    return Outline(points, tangents / np.linalg.norm(tangents, axis=1, keepdims=True), float(s[-1]), closed)


def oval(a: float, b: float) -> Outline:
    """Return an opening in the shape of an ellipse with these half axes; it runs clockwise."""
    angle = np.linspace(0.0, -2.0 * np.pi, 20_000, endpoint=False)
    return _outline(np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1), True)


def circle(radius: float) -> Outline:
    """Return a round opening."""
    return oval(radius, radius)


def rectangle(width: float, height: float, radius: float) -> Outline:
    """Return an opening with four straight sides, whose corners have this radius; 0 for sharp ones."""
    a, b = 0.5 * width - radius, 0.5 * height - radius
    turn = np.linspace(0.0, 0.5 * np.pi, 2000 if radius else 1)
    arcs = [
        np.array(centre) + radius * np.stack([np.cos(turn + start), np.sin(turn + start)], axis=1)
        for centre, start in (((a, b), 0), ((-a, b), np.pi / 2), ((-a, -b), np.pi), ((a, -b), 3 * np.pi / 2))
    ]
    return _outline(np.concatenate(arcs)[::-1], True)


def wavy_edge(length: float, amplitude: float) -> Outline:
    """Return an edge that does not close, with the material above it."""
    u = np.linspace(-0.5 * length, 0.5 * length, 100_000)
    return _outline(np.stack([u, amplitude * np.sin(2.0 * np.pi * u / length)], axis=1), False)


def flat(uv: np.ndarray) -> np.ndarray:
    """Return the plane z = 0."""
    return np.column_stack([uv, np.zeros(len(uv))])


def barrel(radius: float) -> Sheet:
    """Return the plane rolled to a cylinder, without stretch."""
    return lambda uv: np.column_stack(
        [radius * np.sin(uv[:, 0] / radius), uv[:, 1], radius * np.cos(uv[:, 0] / radius) - radius]
    )


def dome(radius_u: float, radius_w: float) -> Sheet:
    """Return a paraboloid with these radii of curvature at its top."""
    return lambda uv: np.column_stack([uv, -0.5 * (uv[:, 0] ** 2 / radius_u + uv[:, 1] ** 2 / radius_w)])


def bent(sheet: Sheet, rise: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Sheet:
    """Return a sheet pushed along its normals by rise(u, w) mm."""
    return lambda uv: sheet(uv) + rise(uv[:, 0], uv[:, 1])[:, None] * frame(sheet, uv)[2]


def frame(sheet: Sheet, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return dS/du, dS/dw and the unit normal at (n, 2) places."""
    h = 1e-2
    du, dw = ((sheet(uv + step) - sheet(uv - step)) / (2.0 * h) for step in h * np.eye(2))
    normal = np.cross(du, dw)
    return du, dw, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def sampled(
    outline: Outline, sampling: str, spacing_mm: float, depth_mm: float, rng: np.random.Generator
) -> np.ndarray:
    """Return (n, 2) places in the material within `depth_mm` of an outline.

    `sampling` is `grid` (its points shifted by up to 0.4 spacings), `random`, or `voxels` (dense, then thinned to the
    mean of the points of each cell, as scanner software does).
    """
    if sampling == "voxels":
        return _thinned(sampled(outline, "random", spacing_mm / 3.0, depth_mm, rng), spacing_mm, rng)
    low, high = outline.points.min(axis=0) - depth_mm, outline.points.max(axis=0) + depth_mm
    if not outline.closed:
        low[0], high[0] = outline.points[0, 0], outline.points[-1, 0]
    if sampling == "random":
        uv = rng.uniform(low, high, (int(np.prod((high - low) / spacing_mm)), 2))
    else:
        lines = [np.arange(a, b, spacing_mm) for a, b in zip(low, high, strict=True)]
        uv = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2) + rng.uniform(0.0, spacing_mm, 2)
        uv += rng.uniform(-0.4, 0.4, uv.shape) * spacing_mm
    depth = outline.depth(uv)
    return uv[(depth > 0.0) & (depth < depth_mm)]


def _thinned(uv: np.ndarray, cell_mm: float, rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0.0, 0.5 * np.pi)
    turned = uv @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    column, row = np.floor(turned / cell_mm).astype(np.int64).T
    _, cell, count = np.unique(column * 100_000 + row, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(cell, weights=axis) / count for axis in uv.T], axis=1)


def triangles(uv: np.ndarray, spacing_mm: float, outline: Outline) -> np.ndarray:
    """Triangulate (n, 2) places, without the triangles that span the opening or are long."""
    faces = Delaunay(uv).simplices.astype(np.int64)
    corners = uv[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    faces = faces[(outline.depth(corners.mean(axis=1)) > 0.0) & (longest < 3.0 * spacing_mm)]
    first, second = uv[faces[:, 1]] - uv[faces[:, 0]], uv[faces[:, 2]] - uv[faces[:, 0]]
    clockwise = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    faces[clockwise] = faces[clockwise][:, ::-1]
    return faces
