"""The curves of drawings, each as exactly as the drawing knows it, moved by any affine motion and then sampled.

Blocks are inserted mirrored, scaled unevenly and sheared. Points, conics given by two half axes, and control points all
stay what they are under such a motion, so a curve is placed first and sampled at its place: no piece leaves it farther
than it may.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sicp_cam.model import FloatArray

__all__ = ["Conic", "CurveError", "Nurbs", "Piece", "Straights"]

_LARGEST_STEP = math.pi / 4.0
_MOST_ROUNDS = 40
_PROBES = (0.25, 0.5, 0.75)
_LARGEST_DEGREE = 25


class CurveError(ValueError):
    """A curve that cannot be drawn; the text says what is wrong with it and what to do."""


class Piece(Protocol):
    """A stretch of a curve."""

    def placed(self, motion: FloatArray) -> Piece:
        """Return it moved by an affine (4, 4) motion."""

    def points(self, chord_mm: float, step_mm: float, most: int) -> FloatArray:
        """Return (n, 3) points from its begin to its end.

        No straight between them leaves the curve by more than `chord_mm`, or is longer than `step_mm` where it is bent.

        Raises
        ------
        CurveError
            If that takes more than `most` points.
        """


@dataclass(frozen=True, slots=True, eq=False)
class Straights:
    """Straight lines through corners (n, 3)."""

    corners: FloatArray

    def placed(self, motion: FloatArray) -> Straights:
        """Return the lines moved by an affine (4, 4) motion."""
        return Straights(self.corners @ motion[:3, :3].T + motion[:3, 3])

    def points(self, chord_mm: float, step_mm: float, most: int) -> FloatArray:
        """Return the corners."""
        if len(self.corners) > most:
            raise CurveError(_too_many(most))
        return self.corners


@dataclass(frozen=True, slots=True, eq=False)
class Conic:
    """An arc of a circle or ellipse: centre + a cos t + b sin t, for t from `start` over `sweep` (rad, either sign).

    >>> arc = Conic(np.zeros(3), np.array([2.0, 0, 0]), np.array([0, 2.0, 0]), 0.0, math.pi)
    >>> [point.round(12).tolist() for point in arc.points(0.1, 10.0, 100)[[0, -1]]]
    [[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]
    """

    centre: FloatArray
    a: FloatArray
    b: FloatArray
    start: float
    sweep: float

    def placed(self, motion: FloatArray) -> Conic:
        """Return the arc moved by an affine (4, 4) motion."""
        turn = motion[:3, :3]
        return Conic(turn @ self.centre + motion[:3, 3], turn @ self.a, turn @ self.b, self.start, self.sweep)

    def points(self, chord_mm: float, step_mm: float, most: int) -> FloatArray:
        """Return points at even steps of t, whose sagitta r (1 - cos(step / 2)) the longer half axis bounds."""
        # The half axes may be sheared; the largest singular value of (a, b) is the longer half axis.
        radius = float(np.linalg.norm(np.stack([self.a, self.b]), ord=2))
        if not math.isfinite(radius):
            raise CurveError("is too large to be drawn; correct it")
        largest = 4.0 * math.asin(math.sqrt(min(chord_mm / (2.0 * radius), 1.0))) if radius > 0.0 else math.inf
        wanted = abs(self.sweep) * max(1.0 / min(largest, _LARGEST_STEP), radius / step_mm)
        if wanted >= most:
            raise CurveError(_too_many(most))
        t = self.start + self.sweep * np.linspace(0.0, 1.0, max(1, math.ceil(wanted - 1e-9)) + 1)
        points: FloatArray = self.centre + np.cos(t)[:, None] * self.a + np.sin(t)[:, None] * self.b
        return points


@dataclass(frozen=True, slots=True, eq=False)
class Nurbs:
    """A spline: control points (n, 3), weights (n,), knots (n + degree + 1,); it runs where n basis functions add up.

    Raises
    ------
    CurveError
        If the numbers make no spline.
    """

    control: FloatArray
    weights: FloatArray
    knots: FloatArray
    degree: int

    def __post_init__(self) -> None:
        count, degree, knots = len(self.control), self.degree, self.knots
        if not 1 <= degree <= _LARGEST_DEGREE:
            raise CurveError(f"has the degree {degree}; correct it")
        if count <= degree or len(knots) != count + degree + 1:
            raise CurveError(
                f"has {len(knots)} knots for {count} control points of degree {degree}; draw the spline anew"
            )
        if (np.diff(knots) < 0.0).any() or not knots[degree] < knots[count]:
            raise CurveError("has knots that do not rise; draw the spline anew")
        if len(self.weights) != count or not (self.weights > 0.0).all():
            raise CurveError("has weights that are not one positive number for each control point; draw it anew")

    def placed(self, motion: FloatArray) -> Nurbs:
        """Return the spline moved by an affine (4, 4) motion."""
        control = self.control @ motion[:3, :3].T + motion[:3, 3]
        return Nurbs(control, self.weights, self.knots, self.degree)

    def at(self, t: FloatArray) -> FloatArray:
        """Return the points (k, 3) at some parameters (k,)."""
        from scipy.interpolate import BSpline

        weighted = np.column_stack([self.control * self.weights[:, None], self.weights])
        values: FloatArray = BSpline(self.knots, weighted, self.degree)(t)
        points: FloatArray = values[:, :3] / values[:, 3:]
        return points

    def points(self, chord_mm: float, step_mm: float, most: int) -> FloatArray:
        """Return points between which no probe of the curve lies farther than `chord_mm` from the straight."""
        spans = np.unique(self.knots[self.degree : len(self.control) + 1])
        parts = np.arange(self.degree + 1) / (self.degree + 1)
        t = np.append((spans[:-1, None] + np.diff(spans)[:, None] * parts).ravel(), spans[-1])
        for _ in range(_MOST_ROUNDS):
            if len(t) > most:
                raise CurveError(_too_many(most))
            points = self.at(t)
            split = self._bent(t, points, chord_mm, step_mm)
            if not split.any():
                return points
            t = np.sort(np.concatenate([t, (t[:-1] + t[1:])[split] / 2.0]))
        raise CurveError("jumps from one point to another; draw the spline anew")

    def _bent(self, t: FloatArray, points: FloatArray, chord_mm: float, step_mm: float) -> FloatArray:
        """Return (n - 1,) True for steps that are too long or leave the curve too far."""
        chords = np.diff(points, axis=0)
        lengths = np.linalg.norm(chords, axis=1)
        off = np.zeros(len(chords))
        for share in _PROBES:
            away = self.at(t[:-1] + share * np.diff(t)) - points[:-1]
            along = np.einsum("ij,ij->i", away, chords) / np.maximum(lengths, 1e-300) ** 2
            foot = np.clip(along, 0.0, 1.0)[:, None] * chords
            off = np.maximum(off, np.linalg.norm(away - foot, axis=1))
        bent: FloatArray = (off > chord_mm) | ((lengths > step_mm) & (self.degree > 1))
        return bent


def _too_many(most: int) -> str:
    return f"takes more than the {most} points that are left of the limit path_points; is the unit right?"
