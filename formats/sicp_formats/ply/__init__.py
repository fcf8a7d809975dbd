"""PLY scans and meshes: text and both byte orders, points or mesh, read strictly or repaired; and the writers.

The format is that of Turk, "The PLY Polygon File Format" (1994). It states no unit of length; the writers state it in
a comment, `comment unit mm`, which the readers follow.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source, TriangleMesh
from sicp_cam.units import mm_per_unit
from sicp_formats.ply import ascii as ply_ascii
from sicp_formats.ply import binary as ply_binary
from sicp_formats.ply.faces import fan_triangles, strip_triangles
from sicp_formats.ply.header import Element, Header, parse_header
from sicp_formats.ply.table import Table
from sicp_formats.ply.wanted import Wanted, wanted
from sicp_formats.ply.writer import write_part, write_scan
from sicp_formats.source import LongFile, describe, read_bytes
from sicp_formats.surfaces.checks import Code, check_registrable, coarse_singles, no_return_points
from sicp_formats.surfaces.ending import without_cut_line
from sicp_formats.surfaces.meshes import drop_collapsed, keep_points, merge_mesh
from sicp_formats.surfaces.point_rows import PointRows, locked, point_rows
from sicp_formats.surfaces.unit import chosen_unit
from sicp_formats.tables.body import TextBody

__all__ = ["read_part", "read_scan", "write_part", "write_scan"]

_LONG_BYTES = 2**22
"""Size from which a binary file is read in places."""


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    points_mm: FloatArray
    normals: FloatArray | None
    faces: IntArray | None
    columns: Mapping[str, FloatArray]
    findings: tuple[Finding, ...]


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scan from a PLY file.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of a comment such as
        `comment unit mm`, or else millimetres.
    limits
        Caps on what the file may ask for.
    recover
        True to drop points that are not finite with the faces on them, faces that point nowhere, and what is missing
        of the last element of a file that is cut short, and to ignore normals in part. Each is a finding.

    Returns
    -------
    Scan
        Points in file order; normals where the file has nx, ny, nz or normal_x, normal_y, normal_z; all further
        scalars of the vertices as columns; polygons as fans of triangles, and the triangles of strips. In a mesh,
        vertices that are exactly equal are merged, so that seams do not look like rims.

    Raises
    ------
    FormatError
        If the file breaks its format, ends early, holds numbers that are not finite, points at vertices that it does
        not have, or cannot register; the message names the line or byte.
    UnitError
        If the unit is unknown, or not the one that the file states.
    """
    surface, source = _read(path, units, limits, recover)
    return Scan(surface.points_mm, surface.normals, surface.faces, source, surface.findings, surface.columns)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Part:
    """Read a nominal part from a PLY file: a mesh, and no contours, which the loops of the mesh must give.

    Parameters, and errors raised, are those of `read_scan`; points without faces are refused too.
    """
    surface, source = _read(path, units, limits, recover)
    if surface.faces is None:
        what = "has points and no faces, and a part needs a mesh; export the surface of the CAD model"
        raise FormatError(path, what)
    return Part((), TriangleMesh(surface.points_mm, surface.faces, surface.normals), source, surface.findings)


def _read(path: Path, units: str | None, limits: Limits, recover: bool) -> tuple[_Surface, Source]:
    mm_per_unit("mm" if units is None else units)
    content, header = _opened(path, limits)
    unit, stated, findings = chosen_unit(path, header.unit, units)
    read = wanted(path, header, len(content), limits, recover=recover)
    with ThreadPoolExecutor(1) as beside:  # the hash takes as long as all the rest
        source = beside.submit(describe, path, content, format="PLY", unit=unit, unit_stated=stated)
        kept: bytes | LongFile = content
        if isinstance(content, bytes) and not header.byte_order and header.elements[-1].name == "vertex":
            kept, cut = without_cut_line(path, content, recover=recover, begin=header.body_byte)
            findings += cut
        tables, found = _read_body(path, kept, header, read, limits, recover)
        try:
            surface = _surface(path, tables, read, mm_per_unit(unit), limits, recover)
        except FormatError as error:
            raise _blaming_counts(path, error, found) from None
    findings += read.findings + found + surface.findings
    return replace(surface, findings=findings), source.result()


def _blaming_counts(path: Path, error: FormatError, found: tuple[Finding, ...]) -> FormatError:
    """Return the error with what stands behind the declared rows, if anything does: the cause is there then."""
    for each in found:
        if each.code == Code.TRAILING_BYTES:
            behind = each.message.split(";")[0]
            what = f"{error.what}; there are {behind}, so its counts are probably wrong"
            return FormatError(path, what, line=error.line, byte=error.byte)
    return error


def _opened(path: Path, limits: Limits) -> tuple[bytes | LongFile, Header]:
    """Return a file and its header: a long one that is binary to be read in places, any other one as its bytes."""
    if path.suffix.lower() != ".gz":
        file = LongFile(path, limits)
        # All that the parser of the header looks at, whatever the size of the file.
        header = parse_header(path, file.head(limits.header_bytes + 1), limits)
        if header.byte_order and len(file) >= _LONG_BYTES:
            return file, header
    content = read_bytes(path, limits)
    return content, parse_header(path, content, limits)


def _surface(
    path: Path, tables: Mapping[str, Table], read: Wanted, mm: float, limits: Limits, recover: bool
) -> _Surface:
    vertices = tables["vertex"]
    rows, findings = point_rows(path, vertices.scalars, read.points, vertices.place, mm, limits, recover=recover)
    faces, found = _faces(path, tables, read, rows, limits, recover)
    findings += found
    points, normals, columns = rows.points_mm, rows.normals, rows.columns
    if faces is None:
        findings += no_return_points(path, rows.at_origin)
    else:
        points, normals, faces, columns, found = merge_mesh(path, points, normals, faces, columns)
        findings += found
        faces, found = drop_collapsed(path, points, faces)
        findings += found
    check_registrable(path, points)
    if read.singles:
        findings += coarse_singles(path, np.array([[rows.low_mm, rows.high_mm]]), mm)
    normals = None if normals is None else locked(normals)
    faces = None if faces is None else locked(faces)
    return _Surface(locked(points), normals, faces, columns, findings)


def _faces(
    path: Path, tables: Mapping[str, Table], read: Wanted, rows: PointRows, limits: Limits, recover: bool
) -> tuple[IntArray | None, tuple[Finding, ...]]:
    """Return the triangles of all faces and strips, None if there are none."""
    if not read.corners:
        return None, ()
    vertices = tables["vertex"].rows
    findings: tuple[Finding, ...] = ()
    parts = [np.zeros((0, 3), np.int64)]
    for element, name in read.corners.items():
        split = fan_triangles if element == "face" else strip_triangles
        triangles, found = split(path, tables[element], name, vertices, limits, recover=recover)
        parts.append(triangles)
        findings += found
    faces: IntArray | None = parts[1] if len(parts) == 2 else np.concatenate(parts)
    rows_of_faces = sum(tables[element].rows for element in read.corners)
    if rows_of_faces and not sum(map(len, parts)) and all(each.code != Code.FACES_DROPPED for each in findings):
        what = (
            f"none of the {rows_of_faces} faces has 3 corners; a count of the header is wrong, or the file is damaged"
        )
        raise FormatError(path, what)
    if rows.kept is not None:
        kept = np.zeros(vertices, np.bool_)
        kept[rows.kept] = True
        faces, dropped = keep_points(kept, faces)
        if dropped:
            message = f"{dropped} triangles used points that were dropped, and were dropped too"
            findings += (Finding(Code.FACES_DROPPED, Level.WARN, message, str(path)),)
    return (None if recover and faces is not None and not len(faces) else faces), findings


def _read_body(
    path: Path, content: bytes | LongFile, header: Header, read: Wanted, limits: Limits, recover: bool
) -> tuple[dict[str, Table], tuple[Finding, ...]]:
    tables: dict[str, Table] = {}
    findings: list[Finding] = []
    position = header.body_byte
    body = (
        ply_ascii.text_body(path, content, header, limits, recover=recover)
        if isinstance(content, bytes) and not header.byte_order
        else None
    )
    for number, element in enumerate(header.elements):
        names = read.of(element.name)
        last = not any(behind.count for behind in header.elements[number + 1 :])
        # One list holds all strips; its triangles are counted afterwards.
        caps = limits if element.name != "tristrips" else replace(limits, list_length=len(content))
        if body is None:
            table, position = ply_binary.read_element(
                path, content, position, element, header.byte_order, names, caps, recover=recover, last=last
            )
            end = f"{path}, byte {position}"
            if table.rows < element.count:
                position = len(content)
        else:
            left, end = len(content) - position, f"{path}, line {element.line}"
            table = ply_ascii.read_element(path, body, left, element, names, caps, recover=recover and last)
        tables[element.name] = table
        findings += _told(path, element, table, end, used=bool(names))
    findings += _bytes_behind(path, content, position) if body is None else _rows_behind(path, body)
    return tables, tuple(findings)


def _told(path: Path, element: Element, table: Table, end: str, *, used: bool) -> list[Finding]:
    """Tell of rows that are missing, and of an element that is not used."""
    findings = []
    if table.rows < element.count:
        message = f"element {element.name} declares {element.count} rows, only the first {table.rows} are there"
        findings.append(Finding(Code.ROWS_MISSING, Level.WARN, message, end))
    if not used and element.count:
        message = f"{element.count} rows of element {element.name} are of no use here and were not read"
        findings.append(Finding(Code.ELEMENT_NOT_READ, Level.INFO, message, f"{path}, line {element.line}"))
    return findings


def _bytes_behind(path: Path, content: bytes | LongFile, position: int) -> list[Finding]:
    if position == len(content):
        return []
    message = f"{len(content) - position} more bytes than the header declares; they were not read"
    return [Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, byte {position}")]


def _rows_behind(path: Path, body: TextBody) -> list[Finding]:
    """Tell of what stands behind the last declared row, and of comments between the rows."""
    findings = []
    if lines := [number for number, _ in body.rows()]:
        message = f"{len(lines)} more lines than the header declares; they were not read"
        findings.append(Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, line {lines[0]}"))
    if body.skipped:
        message = f"{len(body.skipped)} comments between the rows were skipped"
        findings.append(Finding(Code.LINES_SKIPPED, Level.INFO, message, f"{path}, line {body.skipped[0]}"))
    return findings
