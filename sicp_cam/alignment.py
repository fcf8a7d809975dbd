"""Read the start pose of a registration: a rough matrix, or pairs of datum points."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, InputError
from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import apply, best_fit, is_rigid

__all__ = ["Alignment", "read_alignment"]

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\Z")
_LARGEST_FILE = 2**20
_LARGEST_MISFIT_MM = 20.0
_ROUNDING = 1e-3
"""A matrix typed with few digits is rigid to about this; it is made exactly rigid."""


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """A start pose.

    Parameters
    ----------
    T_scan_part
        (4, 4) pose, mm.
    residuals_mm
        (n,) distance of each datum pair after the best fit; empty for a matrix.
    """

    T_scan_part: FloatArray
    residuals_mm: FloatArray


def read_alignment(path: Path) -> Alignment:
    """Read a start pose from a text file.

    Either four rows of four numbers, the matrix `T_scan_part` in mm; or at least three rows of six numbers
    `x,y,z,X,Y,Z`, a point of the part and the same point in the scan, after an optional header line. Numbers are
    separated by blanks, commas or semicolons; `#` begins a comment.

    Raises
    ------
    FormatError
        If the file is neither, or the matrix is no rigid motion, or the datum points lie on one line.
    """
    rows, lines = _rows(path)
    width = {len(row) for row in rows}
    if width == {4} and len(rows) == 4:
        return Alignment(_rigid(path, np.array(rows), lines[0]), np.zeros(0))
    if width == {6} and len(rows) >= 3:
        return _from_pairs(path, np.array(rows), lines)
    raise FormatError(
        path,
        f"{len(rows)} rows of {' or '.join(map(str, sorted(width)))} numbers; give a 4x4 matrix T_scan_part,"
        " or at least three datum pairs x,y,z,X,Y,Z",
        line=lines[0] if lines else 1,
    )


def _rows(path: Path) -> tuple[list[list[float]], list[int]]:
    try:
        content = path.read_bytes()[: _LARGEST_FILE + 1]
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(content) > _LARGEST_FILE:
        raise FormatError(path, "larger than 1 MiB; a pose or a list of datum pairs is a few lines")
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(content.decode("utf-8-sig", errors="replace").splitlines(), 1):
        words = re.split(r"[,;\s]+", line.partition("#")[0].strip())
        if words == [""]:
            continue
        if not rows and not any(_NUMBER.match(word) for word in words):
            continue  # a header line
        if not all(_NUMBER.match(word) for word in words):
            raise FormatError(path, f"'{line.strip()}' holds something that is no number", line=number)
        rows.append([float(word) for word in words])
        if not np.isfinite(rows[-1]).all():
            raise FormatError(path, "holds a number that is not finite", line=number)
        lines.append(number)
    return rows, lines


def _rigid(path: Path, matrix: FloatArray, line: int) -> FloatArray:
    if not is_rigid(matrix, _ROUNDING):
        raise FormatError(
            path,
            "the matrix is no rigid motion: its rotation must be orthonormal with determinant +1 (no scale, no mirror)"
            " and its last row 0 0 0 1",
            line=line,
        )
    exact = np.eye(4)
    U, _, Vt = np.linalg.svd(matrix[:3, :3])
    exact[:3, :3] = U @ Vt
    exact[:3, 3] = matrix[:3, 3]
    return exact


def _from_pairs(path: Path, pairs: FloatArray, lines: list[int]) -> Alignment:
    part, scan = pairs[:, :3], pairs[:, 3:]
    for name, points in (("part", part), ("scan", scan)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[1] < 1e-3 * max(float(spread[0]), 1e-9):
            raise FormatError(path, f"the datum points of the {name} lie on one line; add one beside it", line=lines[0])
    T = best_fit(part, scan)
    residuals = np.linalg.norm(apply(T, part) - scan, axis=1)
    worst = int(np.argmax(residuals))
    if residuals[worst] > _LARGEST_MISFIT_MM:
        raise FormatError(
            path,
            f"the datum pairs do not fit: pair {worst + 1} is {residuals[worst]:.1f} mm off after the best fit;"
            " check its numbers, the units, and which three columns are the part's",
            line=lines[worst],
        )
    return Alignment(T, residuals)
