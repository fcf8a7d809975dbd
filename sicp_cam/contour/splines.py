"""Cubic B-splines along a curve: the smooth functions of arc length that a scan is described with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["CurveSplines", "LocalRows", "splines_along"]

LEAST_INTERVALS = 8
MANY_ROWS = 10
"""Rows per unknown above which the sum of outer products is taken block by block."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalRows:
    """Linear equations of which each knows few unknowns: n rows with p entries.

    Parameters
    ----------
    columns, values
        (n, p) which unknown, a different one in each entry of a row, and its factor; the first tells all others.
    size
        Number of unknowns.
    """

    columns: IntArray
    values: FloatArray
    size: int

    def times(self, unknowns: FloatArray) -> FloatArray:
        """Return the (n,) or (n, c) products with (size,) or (size, c) unknowns."""
        return np.asarray(np.einsum("np,np...->n...", self.values, unknowns[self.columns]))

    def summed(self, factors: FloatArray) -> FloatArray:
        """Return the (size,) sum of all rows, each times its factor."""
        weighted = self.values * factors[:, None]
        return np.bincount(self.columns.ravel(), weights=weighted.ravel(), minlength=self.size).astype(np.float64)

    def gram(self, weights: FloatArray) -> FloatArray:
        """Return the (size, size) weighted sum of the outer product of each row with itself."""
        if len(self.columns) < MANY_ROWS * self.size:
            pairs = self.columns[:, :, None] * self.size + self.columns[:, None, :]
            products = (self.values * weights[:, None])[:, :, None] * self.values[:, None, :]
            flat = np.bincount(pairs.ravel(), weights=products.ravel(), minlength=self.size**2)
            return np.asarray(flat.reshape(self.size, self.size), dtype=np.float64)
        # Many rows have the same columns: they are multiplied as one block.
        order = np.argsort(self.columns[:, 0], kind="stable")
        total: FloatArray = np.zeros((self.size, self.size))
        for rows in np.split(order, np.flatnonzero(np.diff(self.columns[order, 0])) + 1):
            columns, block = self.columns[rows[0]], self.values[rows]
            total[columns[:, None], columns] += (block * weights[rows, None]).T @ block
        return total

    def taken(self, rows: BoolArray) -> LocalRows:
        """Return some of the rows."""
        return LocalRows(self.columns[rows], self.values[rows], self.size)

    def dense(self) -> FloatArray:
        """Return the rows as an (n, size) matrix."""
        full = np.zeros((len(self.columns), self.size))
        np.put_along_axis(full, self.columns, self.values, axis=1)
        return full


@dataclass(frozen=True, slots=True)
class CurveSplines:
    """Evenly spaced cubic B-splines over the arc length of a curve, periodic where it is closed.

    Parameters
    ----------
    intervals
        Number of equal intervals between knots.
    length_mm
        Arc length of the curve.
    closed
        True for a periodic basis.
    """

    intervals: int
    length_mm: float
    closed: bool

    def __len__(self) -> int:
        return self.intervals if self.closed else self.intervals + 3

    @property
    def step_mm(self) -> float:
        """Distance between knots."""
        return self.length_mm / self.intervals

    @property
    def centres_mm(self) -> FloatArray:
        """(K,) arc length at which each spline is largest; the outermost of an open curve lie beyond its ends."""
        return (np.arange(len(self), dtype=np.float64) - 1.0) * self.step_mm

    def at(self, s_mm: FloatArray) -> LocalRows:
        """Return the values of the four splines that are not zero at each of n arc lengths."""
        knots = np.arange(-3, self.intervals + 4) * self.step_mm
        wanted = np.mod(s_mm, self.length_mm) if self.closed else np.clip(s_mm, 0.0, self.length_mm)
        if not len(s_mm):
            return LocalRows(np.zeros((0, 4), dtype=np.int64), np.zeros((0, 4)), len(self))
        values = BSpline.design_matrix(np.minimum(wanted, self.length_mm * (1.0 - 1e-12)), knots, 3)
        columns = values.indices.reshape(-1, 4).astype(np.int64)
        return LocalRows(columns % len(self) if self.closed else columns, values.data.reshape(-1, 4), len(self))

    def second_differences(self) -> FloatArray:
        """Return the (m, K) matrix D for which |D c|^2 is the integral of the squared second derivative, in 1/mm^3."""
        unit = np.eye(len(self))
        rows = np.roll(unit, -1, axis=0) - 2.0 * unit + np.roll(unit, 1, axis=0)
        return np.asarray((rows if self.closed else rows[1:-1]) / self.step_mm**1.5)


def splines_along(curve: FramedCurve, step_mm: float, most: int) -> CurveSplines:
    """Return splines along a curve with knots about `step_mm` apart, but at most so many intervals."""
    intervals = int(np.clip(round(curve.length_mm / step_mm), LEAST_INTERVALS, most))
    return CurveSplines(intervals, curve.length_mm, curve.closed)
