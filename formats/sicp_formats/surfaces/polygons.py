"""What OBJ and OFF have in common: points with further numbers, and polygons between them, made a scan or a part."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import BoolArray, FloatArray, IntArray, Part, Scan, Source, TriangleMesh
from sicp_formats.surfaces.checks import Code, check_coordinates, check_registrable, origin_points, unit_normals
from sicp_formats.surfaces.meshes import drop_collapsed, keep_points, merge_mesh
from sicp_formats.tables.blocks import quick_columns
from sicp_formats.tables.rows import Row

__all__ = [
    "INTEGER",
    "Checked",
    "PolygonMesh",
    "Polygons",
    "as_part",
    "as_scan",
    "checked",
    "equal_rows",
    "whole_numbers",
]

INTEGER = re.compile(rb"(?<!\S)([+-]?[0-9]{1,18})(?!\S)")
_BATCH_ROWS = 100_000
_WORTH_LOADING_PANDAS = 20_000
_NO_INTEGERS = re.compile(rb"[.eE+]")
_EXACT = 2.0**53
"""Below it, doubles tell all integers apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Polygons one behind the other.

    Parameters
    ----------
    lengths
        (m,) corners of each.
    corners
        (sum of lengths,) points that the corners stand on, counted from 0; not checked.
    named
        (sum of lengths,) the same as the file names them.
    lines
        (m,) lines of the file.
    """

    lengths: IntArray
    corners: IntArray
    named: IntArray
    lines: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class PolygonMesh:
    """A mesh or a cloud as it stands in a text file: n points, their lines, and polygons (None in a cloud)."""

    points: FloatArray
    lines: IntArray
    normals: FloatArray | None
    columns: Mapping[str, FloatArray]
    polygons: Polygons | None
    findings: tuple[Finding, ...]

    def place(self, row: int) -> dict[str, int]:
        """Tell the line of a point."""
        return {"line": int(self.lines[row])}


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """What became of it: points in mm, unit normals, triangles (None in a cloud), and columns."""

    points: FloatArray
    normals: FloatArray | None
    faces: IntArray | None
    columns: Mapping[str, FloatArray]
    findings: tuple[Finding, ...]


def whole_numbers(path: Path, rows: Sequence[Row], pattern: re.Pattern[bytes] = INTEGER) -> IntArray:
    """Parse rows of integers, of any number of them each, one behind the other.

    Parameters
    ----------
    path, rows
        The file, and lines of it.
    pattern
        What a word looks like, with one group for the integer of at most 18 digits that is wanted.

    Raises
    ------
    FormatError
        If a word looks differently.
    """
    if (table := equal_rows(rows)) is not None:
        return table.ravel()
    blocks = [np.zeros(0, np.int64)]
    for start in range(0, len(rows), _BATCH_ROWS):
        batch = rows[start : start + _BATCH_ROWS]
        text = b" ".join([row for _, row in batch])
        words = pattern.findall(text)
        if len(words) != len(text.split()):
            raise _no_integer(path, batch, pattern)
        blocks.append(np.array(words, dtype="S19").astype(np.int64) if words else np.zeros(0, np.int64))
    return np.concatenate(blocks)


def equal_rows(rows: Sequence[Row]) -> IntArray | None:
    """Parse many rows that all have as many integers.

    Returns
    -------
    array or None
        (n, width) integers; None if the rows are few or anything is unusual about them, which says nothing about
        whether they can be read.
    """
    if len(rows) < _WORTH_LOADING_PANDAS:
        return None
    width, blocks = len(rows[0][1].split()), []
    for start in range(0, len(rows), _BATCH_ROWS):
        batch = rows[start : start + _BATCH_ROWS]
        text = b"\n".join([row for _, row in batch])
        found = None if _NO_INTEGERS.search(text) else quick_columns(text, width)
        if found is None or len(found[0]) != len(batch) or any(np.abs(each).max() >= _EXACT for each in found):
            return None
        blocks.append(np.stack(found, axis=1).astype(np.int64))
    return np.concatenate(blocks)


def checked(path: Path, mesh: PolygonMesh, factor: float, limits: Limits, recover: bool) -> Checked:
    """Return a mesh or cloud in mm after the checks that every scan and part must pass.

    Parameters
    ----------
    path, mesh
        The file, and what stands in it.
    factor
        Millimetres in its unit.
    limits
        Caps of coordinates and triangles.
    recover
        Drop points that are not finite, and polygons that use them or points that do not exist, with findings of
        level WARN.

    Raises
    ------
    FormatError
        If a coordinate or normal is not finite, a polygon points nowhere, or no area or too few points are left.
    """
    faces, findings = None, mesh.findings
    if mesh.polygons is not None:
        faces, found = _triangles(path, mesh.polygons, len(mesh.points), limits, recover)
        findings += found
    if recover:
        mesh, faces, found = _without_gaps(path, mesh, faces)
        findings += found
    with np.errstate(over="ignore"):  # the check of the coordinates tells the place
        points = mesh.points * factor
    check_coordinates(path, points, mesh.place, limits)
    normals, columns = mesh.normals, mesh.columns
    if normals is not None:
        normals, found = unit_normals(path, normals, mesh.place)
        findings += found
    if faces is None:
        findings += origin_points(path, points)
    else:
        points, normals, faces, columns, found = merge_mesh(path, points, normals, faces, columns)
        findings += found
        faces, found = drop_collapsed(path, points, faces)
        findings += found
    check_registrable(path, points)
    return Checked(points, normals, faces, columns, findings)


def as_scan(mesh: Checked, source: Source) -> Scan:
    """Return the scan."""
    return Scan(mesh.points, mesh.normals, mesh.faces, source, mesh.findings, mesh.columns)


def as_part(path: Path, mesh: Checked, source: Source) -> Part:
    """Return the part; a cloud is refused, since nothing tells where its edges are."""
    if mesh.faces is None:
        raise FormatError(path, "has points and no faces, and a part needs a mesh; export the surface of the CAD model")
    return Part((), TriangleMesh(mesh.points, mesh.faces, mesh.normals), source, mesh.findings)


def _no_integer(path: Path, rows: Sequence[Row], pattern: re.Pattern[bytes]) -> FormatError:
    for number, text in rows:
        for word in text.split():
            if not pattern.fullmatch(word):
                what = f"{word.decode('latin-1')!r} names no vertex; repair the face, or export the mesh again"
                return FormatError(path, what, line=number)
    return FormatError(path, "a face names no vertex; export the mesh again", line=rows[0][0])


def _triangles(
    path: Path, polygons: Polygons, points: int, limits: Limits, recover: bool
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Split polygons into fans from their first corner: (0, 1, 2), (0, 2, 3), ..."""
    lengths, corners, findings = polygons.lengths, polygons.corners, []
    good = (corners >= 0) & (corners < points)
    if not good.all():
        item = int(np.argmin(good))
        owners = np.repeat(np.arange(len(lengths)), lengths)
        line = int(polygons.lines[owners[item]])
        bad = np.bincount(owners[~good], minlength=len(lengths)) > 0
        if not recover:
            what = (
                f"the face points at vertex {polygons.named[item]} and there are {points}; the mesh is damaged; "
                "export it again, or repair it with --recover"
            )
            raise FormatError(path, what, line=line)
        message = f"{bad.sum()} of {len(lengths)} faces point at points that do not exist and were dropped"
        findings.append(Finding(Code.FACES_DROPPED, Level.WARN, message, f"{path}, line {line}"))
        corners, lengths = corners[~bad[owners]], lengths[~bad]
    if few := int((lengths < 3).sum()):
        message = f"{few} of {len(lengths)} faces have fewer than 3 corners and were dropped"
        findings.append(Finding(Code.DEGENERATE_FACES, Level.INFO, message, str(path)))
    if many := int((lengths > 3).sum()):
        message = f"{many} of {len(lengths)} faces have more than 3 corners and were split into triangles"
        findings.append(Finding(Code.POLYGONS_SPLIT, Level.INFO, message, str(path)))
    fans = np.maximum(lengths - 2, 0)
    if fans.sum() > limits.faces:
        raise FormatError(path, f"{fans.sum()} triangles are more than the limit faces = {limits.faces}; raise it")
    first = np.repeat(np.cumsum(lengths) - lengths, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    return corners[np.column_stack([first, first + step + 1, first + step + 2])], tuple(findings)


def _without_gaps(
    path: Path, mesh: PolygonMesh, faces: IntArray | None
) -> tuple[PolygonMesh, IntArray | None, tuple[Finding, ...]]:
    finite: BoolArray = np.logical_and.reduce(np.isfinite(mesh.points), axis=1)
    if mesh.normals is not None:
        finite &= np.isfinite(mesh.normals).all(axis=1)
    if finite.all():
        return mesh, faces, ()
    count, where = int((~finite).sum()), f"{path}, line {mesh.lines[np.argmin(finite)]}"
    message = f"{count} of {len(finite)} points have a number that is not finite and were dropped"
    findings = [Finding(Code.POINTS_DROPPED, Level.WARN, message, where)]
    faces, gone = keep_points(finite, faces)
    if gone:
        message = f"{gone} triangles used points that were dropped, and were dropped too"
        findings.append(Finding(Code.FACES_DROPPED, Level.WARN, message, where))
    kept = replace(
        mesh,
        points=mesh.points[finite],
        lines=mesh.lines[finite],
        normals=None if mesh.normals is None else mesh.normals[finite],
        columns={name: values[finite] for name, values in mesh.columns.items()},
    )
    return kept, faces, tuple(findings)
