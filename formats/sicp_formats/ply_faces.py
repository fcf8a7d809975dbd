"""Faces of a PLY file as triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import IntArray
from sicp_formats.ply_table import Table
from sicp_formats.surface_checks import Code

__all__ = ["fan_triangles"]


def fan_triangles(path: Path, table: Table, name: str, vertices: int) -> tuple[IntArray, tuple[Finding, ...]]:
    """Split polygons into fans from their first corner: (0, 1, 2), (0, 2, 3), ...

    Parameters
    ----------
    table, name
        Element face, and its list of vertex indices.
    vertices
        How many vertices there are.

    Raises
    ------
    FormatError
        If a face points at a vertex that does not exist.
    """
    lengths, items = table.lists[name]
    corners = _corner_indices(path, table, lengths, items, vertices)
    findings = []
    if few := int((lengths < 3).sum()):
        message = f"{few} of {len(lengths)} faces have fewer than 3 corners and were dropped"
        findings.append(Finding(Code.DEGENERATE_FACES, Level.INFO, message, str(path)))
    if many := int((lengths > 3).sum()):
        message = f"{many} of {len(lengths)} faces have more than 3 corners and were split into triangles"
        findings.append(Finding(Code.POLYGONS_SPLIT, Level.INFO, message, str(path)))
    fans = np.maximum(lengths - 2, 0)
    first = np.repeat(np.cumsum(lengths) - lengths, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    return corners[np.column_stack([first, first + step + 1, first + step + 2])], tuple(findings)


def _corner_indices(path: Path, table: Table, lengths: IntArray, items: npt.NDArray[Any], vertices: int) -> IntArray:
    good = (items >= 0) & (items < vertices)  # false for nan too
    if items.dtype.kind == "f":
        good &= items == np.trunc(items)
    if not good.all():
        item = int(np.argmin(good))
        row = int(np.searchsorted(np.cumsum(lengths), item, side="right"))
        what = f"face {row} points at vertex {items[item]:g}; there are 0..{vertices - 1}; the mesh is damaged"
        raise FormatError(path, what, **table.place(row))
    corners: IntArray = items.astype(np.int64)
    return corners
