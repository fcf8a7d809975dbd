"""STL meshes as scans or nominal parts: binary and text, told apart by size, read strictly; and the writers.

The formats are those of 3D Systems' "StereoLithography Interface Specification" (1989). They state no unit of length;
the writers state it in the name or header, `unit=mm`, which the readers follow. They repeat each vertex for each
triangle; vertices that are exactly equal are merged.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from sicp_cam.errors import FormatError, JobError
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source, TriangleMesh
from sicp_cam.units import mm_per_unit
from sicp_formats.source import describe, read_bytes, unit_to_state
from sicp_formats.stl import binary as stl_binary
from sicp_formats.stl import text as stl_text
from sicp_formats.stl.facets import Facets, against_winding, without_gaps
from sicp_formats.surfaces.checks import check_coordinates, check_registrable, coarse_singles
from sicp_formats.surfaces.meshes import drop_collapsed, equal_points
from sicp_formats.surfaces.unit import chosen_unit

__all__ = ["read_part", "read_scan", "write_part", "write_scan"]


@dataclass(frozen=True, slots=True, eq=False)
class _Mesh:
    vertices_mm: FloatArray
    faces: IntArray
    source: Source
    findings: tuple[Finding, ...]


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scanned mesh from an STL file.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of a header or name such as
        `UNITS=mm`, or else millimetres.
    limits
        Caps on what the file may ask for.
    recover
        Read the whole triangles of a file that is cut short, declares another number of them or goes on behind them,
        and drop those that are not finite; each with a finding of level WARN.

    Returns
    -------
    Scan
        Merged vertices and the triangles between them; the outward side is that of their winding.

    Raises
    ------
    FormatError
        If the file breaks its format, ends early, holds numbers that are not finite, or no triangle with an area;
        the message names the line or byte.
    UnitError
        If the unit is unknown, or not the one that the file states.
    """
    mesh = _read(path, units, limits, recover)
    return Scan(mesh.vertices_mm, None, mesh.faces, mesh.source, mesh.findings)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Part:
    """Read a nominal part from an STL file: a mesh, and no contours, which the loops of the mesh must give.

    Parameters, and errors raised, are those of `read_scan`.
    """
    mesh = _read(path, units, limits, recover)
    return Part((), TriangleMesh(mesh.vertices_mm, mesh.faces), mesh.source, mesh.findings)


def write_scan(scan: Scan, *, unit: str = "mm", encoding: Literal["binary", "ascii"] = "binary") -> bytes:
    """Return the triangles of a scan as the bytes of an STL file.

    The outward side is that of the triangles' winding; the format has no place for normals and further numbers of the
    points. A binary file holds 32-bit numbers, so that coordinates are rounded by up to 3e-8 of their size (0.00003 mm
    at 1000 mm).

    Parameters
    ----------
    scan
        The triangles and their points.
    unit
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`.
    encoding
        "binary" (32-bit numbers) or "ascii" (all digits).

    Raises
    ------
    JobError
        If the scan has no triangles, or points that no triangle uses, which the file could not hold; or if the
        encoding is unknown.
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan(np.eye(3), faces=np.array([[0, 1, 2]])), encoding="ascii").decode().splitlines()[3]
    'vertex 1.0 0.0 0.0'
    """
    if scan.faces is None or not len(scan.faces):
        raise JobError("an STL file holds triangles and the scan has none; write it as .ply")
    loose = len(scan.points_mm) - len(np.unique(scan.faces))
    if loose:
        raise JobError(f"{loose} points belong to no triangle and an STL file cannot hold them; write it as .ply")
    return _encoded(scan.points_mm, scan.faces, unit, unit_to_state(scan.source, unit), encoding)


def write_part(part: Part, *, unit: str = "mm", encoding: Literal["binary", "ascii"] = "binary") -> bytes:
    """Return the mesh of a part as the bytes of an STL file; contours have no place in it.

    Parameters
    ----------
    part, unit
        As for `write_scan`.
    encoding
        "binary" (32-bit numbers) or "ascii" (all digits).

    Raises
    ------
    JobError, UnitError
        As `write_scan` does.
    """
    if not len(part.mesh.faces):
        raise JobError("an STL file holds triangles and the part has none")
    return _encoded(part.mesh.vertices_mm, part.mesh.faces, unit, unit_to_state(part.source, unit), encoding)


def _read(path: Path, units: str | None, limits: Limits, recover: bool) -> _Mesh:
    mm_per_unit("mm" if units is None else units)
    content = read_bytes(path, limits)
    binary = stl_binary.is_binary(content)
    kind = stl_binary if binary else stl_text
    facets = kind.read_facets(path, content, limits, recover)
    unit, stated, found = chosen_unit(path, kind.stated_unit(path, content), units)
    factor = mm_per_unit(unit)
    if recover:
        facets = without_gaps(path, facets)
    vertices, faces = _merged(path, facets, factor, limits)
    findings = found + facets.findings
    if facets.normals is not None:
        findings += against_winding(path, facets.normals, vertices, faces)
    faces, found = drop_collapsed(path, vertices, faces)
    findings += found
    check_registrable(path, vertices)
    if binary:
        findings += coarse_singles(path, vertices, factor)
    source = describe(path, content, format="STL binary" if binary else "STL ascii", unit=unit, unit_stated=stated)
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return _Mesh(vertices, faces, source, findings)


def _merged(path: Path, facets: Facets, factor: float, limits: Limits) -> tuple[FloatArray, IntArray]:
    """Return the different corners in mm, and the triangles between them."""
    corners = facets.corners
    if not len(corners):
        raise FormatError(path, "no triangle is left; export the mesh again")
    if not max(float(corners.max()), -float(corners.min())) * factor <= limits.coordinate_mm:
        with np.errstate(over="ignore", invalid="ignore"):  # a signalling nan; the place is told now
            check_coordinates(path, corners.astype(np.float64) * factor, facets.place, limits)
    first, merged = equal_points(corners)
    return corners[first].astype(np.float64) * factor, merged.reshape(-1, 3)


def _encoded(vertices_mm: FloatArray, faces: IntArray, unit: str, stated: str, encoding: str) -> bytes:
    if encoding not in ("binary", "ascii"):
        raise JobError(f"encoding: there is no {encoding!r} STL; use binary or ascii")
    vertices = vertices_mm / mm_per_unit(unit)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0.0, lengths, 1.0)
    if encoding == "ascii":
        return stl_text.encode(vertices, faces, normals, stated)
    return stl_binary.encode(vertices, faces, normals, stated)
