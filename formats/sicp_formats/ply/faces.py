"""Faces of a PLY file as triangles: polygons split into fans, strips taken apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import BoolArray, IntArray
from sicp_formats.ply.table import Table
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.point_rows import OR_REPAIR, where

__all__ = ["fan_triangles", "strip_triangles"]


def fan_triangles(
    path: Path, table: Table, name: str, vertices: int, limits: Limits, *, recover: bool = False
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Split polygons into fans from their first corner: (0, 1, 2), (0, 2, 3), ...

    Parameters
    ----------
    path
        The file, for messages.
    table, name
        Element face, and its list of vertex indices.
    vertices
        How many vertices there are.
    limits
        Caps on the triangles.
    recover
        True to drop faces that point at a vertex that does not exist.

    Raises
    ------
    FormatError
        If a face points at a vertex that does not exist, or there are more triangles than `limits.faces`.
    """
    lengths, items = table.lists[name]
    good = _corners_that_exist(items, vertices)
    lengths, items, dropped = _whole_faces(path, table, lengths, items, good, vertices, recover=recover)
    findings = [*dropped]
    if few := int((lengths < 3).sum()):
        message = f"{few} of {len(lengths)} faces have fewer than 3 corners and were dropped"
        findings.append(Finding(Code.DEGENERATE_FACES, Level.INFO, message, str(path)))
    if many := int((lengths > 3).sum()):
        message = f"{many} of {len(lengths)} faces have more than 3 corners and were split into triangles"
        findings.append(Finding(Code.POLYGONS_SPLIT, Level.INFO, message, str(path)))
    corners: IntArray = items.astype(np.int64)
    if not few and not many:
        return corners.reshape(-1, 3), tuple(findings)
    fans = np.maximum(lengths - 2, 0)
    _check_limit(path, int(fans.sum()), limits)
    first = np.repeat(np.cumsum(lengths) - lengths, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    return corners[np.column_stack([first, first + step + 1, first + step + 2])], tuple(findings)


def strip_triangles(
    path: Path, table: Table, name: str, vertices: int, limits: Limits, *, recover: bool = False
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Take strips apart: each corner but the first two of a strip makes a triangle with the two before it.

    Every other triangle is turned, so that all show the same side. The index -1 begins a new strip, as each row does.
    Parameters, and errors raised, are those of `fan_triangles`.
    """
    lengths, items = table.lists[name]
    good = _corners_that_exist(items, vertices) | (items == -1)
    lengths, items, findings = _whole_faces(path, table, lengths, items, good, vertices, recover=recover)
    corners: IntArray = np.insert(items.astype(np.int64), np.cumsum(lengths)[:-1], -1)
    triangles = np.lib.stride_tricks.sliding_window_view(corners, 3) if len(corners) >= 3 else corners[:0].reshape(0, 3)
    apart = np.flatnonzero(corners == -1)
    starts = np.concatenate([[-1], apart])[np.searchsorted(apart, np.arange(len(triangles)), side="right")] + 1
    odd: BoolArray = (np.arange(len(triangles)) - starts) % 2 == 1
    turned = np.where(odd[:, None], triangles[:, [1, 0, 2]], triangles)[(triangles >= 0).all(axis=1)]
    # Strips are bridged by repeating a corner; these triangles were never meant to be seen.
    a, b, c = turned.T
    turned = turned[(a != b) & (b != c) & (c != a)]
    _check_limit(path, len(turned), limits)
    return turned, findings


def _corners_that_exist(items: npt.NDArray[Any], vertices: int) -> BoolArray:
    good: BoolArray = (items >= 0) & (items < vertices)  # false for nan too
    if items.dtype.kind == "f":
        good &= items == np.trunc(items)
    return good


def _whole_faces(
    path: Path,
    table: Table,
    lengths: IntArray,
    items: npt.NDArray[Any],
    good: BoolArray,
    vertices: int,
    *,
    recover: bool,
) -> tuple[IntArray, npt.NDArray[Any], tuple[Finding, ...]]:
    """Return the faces of which all corners are good, and what is said of the others."""
    if good.all():
        return lengths, items, ()
    item = int(np.argmin(good))
    faces = np.repeat(np.arange(len(lengths)), lengths)
    place = table.place(int(faces[item]))
    if not recover:
        what = (
            f"face {faces[item]} points at vertex {items[item]:g}; there are 0..{vertices - 1}; the mesh is damaged: "
            f"export it again{OR_REPAIR}"
        )
        raise FormatError(path, what, **place)
    bad = np.bincount(faces[~good], minlength=len(lengths)) > 0
    message = f"{bad.sum()} of {len(lengths)} faces point at vertices that do not exist and were dropped"
    finding = Finding(Code.FACES_DROPPED, Level.WARN, message, where(path, place))
    return lengths[~bad], items[~bad[faces]], (finding,)


def _check_limit(path: Path, count: int, limits: Limits) -> None:
    if count > limits.faces:
        raise FormatError(path, f"{count} triangles are more than the limit faces = {limits.faces}; raise it")
