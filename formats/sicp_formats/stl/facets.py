"""The triangles of an STL file before they become a mesh: three corners each, and where they stand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.surfaces.checks import Code, Place

__all__ = ["Facets", "against_winding", "check_limit", "without_gaps"]

_BLOCK = 1 << 16


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """Triangles as they stand in a file.

    Parameters
    ----------
    corners
        (3n, 3) coordinates in the unit of the file: float32 of a binary file, float64 of a text.
    place
        Where a corner stands in the file.
    normals
        (n, 3) stored normals, where they were read.
    findings
        What was noticed so far.
    """

    corners: npt.NDArray[Any]
    place: Place
    normals: npt.NDArray[np.float32] | None = None
    findings: tuple[Finding, ...] = ()


def check_limit(path: Path, count: int, limits: Limits) -> None:
    """Refuse more triangles than `limits.faces`."""
    if count > limits.faces:
        raise FormatError(path, f"{count} triangles are more than the limit faces = {limits.faces}; raise it")


def without_gaps(path: Path, facets: Facets) -> Facets:
    """Drop triangles with a coordinate that is not finite, and warn of them."""
    finite = np.isfinite(facets.corners).all(axis=1)
    if finite.all():
        return facets
    whole = finite.reshape(-1, 3).all(axis=1)
    rows, place = np.flatnonzero(np.repeat(whole, 3)), facets.place
    where = " ".join(f"{kind} {number}" for kind, number in place(int(np.argmin(finite))).items())
    count = len(whole) - int(whole.sum())
    message = f"{count} of {len(whole)} triangles have a corner that is not finite and were dropped"
    finding = Finding(Code.FACETS_DROPPED, Level.WARN, message, f"{path}, {where}")
    return replace(
        facets,
        corners=facets.corners[rows],
        place=lambda row: place(int(rows[row])),
        normals=None if facets.normals is None else facets.normals[whole],
        findings=(*facets.findings, finding),
    )


def against_winding(
    path: Path, stored: npt.NDArray[np.float32], vertices_mm: FloatArray, faces: IntArray
) -> tuple[Finding, ...]:
    """Warn where stored normals and the order of the corners tell different outward sides."""
    against = 0
    for start in range(0, len(faces), _BLOCK):
        some = slice(start, start + _BLOCK)
        corners = vertices_mm[faces[some]]
        x, y, z = (corners[:, 1:] - corners[:, :1]).transpose(2, 1, 0)
        cross = y[0] * z[1] - z[0] * y[1], z[0] * x[1] - x[0] * z[1], x[0] * y[1] - y[0] * x[1]
        with np.errstate(all="ignore"):  # of stored normals nothing is known; nan compares false
            normal = stored[some].T.astype(np.float64)
            along = sum(c * n for c, n in zip(cross, normal, strict=True))
            lengths = np.sqrt(sum(c * c for c in cross) * sum(n * n for n in normal))
            # Slivers turn either way by rounding alone, so only what is clearly opposite counts.
            against += int((along < -0.5 * lengths).sum())
    if not against:
        return ()
    message = f"{against} of {len(stored)} stored normals point against the order of the corners, which was followed"
    return (Finding(Code.NORMALS_AGAINST_WINDING, Level.WARN, message, str(path)),)
