"""PLY scans: text and both byte orders, points or mesh, read strictly; and the writer.

The format is that of Turk, "The PLY Polygon File Format" (1994). It states no unit of length.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Scan
from sicp_cam.units import mm_per_unit
from sicp_formats import ply_ascii, ply_binary
from sicp_formats.mesh_checks import drop_collapsed, merge_vertices
from sicp_formats.ply_faces import fan_triangles
from sicp_formats.ply_header import Element, Header, parse_header
from sicp_formats.ply_table import Table
from sicp_formats.source import describe, read_bytes
from sicp_formats.surface_checks import (
    Code,
    check_coordinates,
    check_registrable,
    coarse_singles,
    origin_points,
    unit_normals,
)
from sicp_formats.text_rows import text_lines

__all__ = ["encode", "read_scan"]

_XYZ = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_CORNERS = ("vertex_indices", "vertex_index")


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS) -> Scan:
    """Read a scan from a PLY file.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; millimetres are assumed if left out.
    limits
        Caps on what the file may ask for.

    Returns
    -------
    Scan
        Points in file order; normals where the file has nx, ny, nz; polygons as fans of triangles. In a mesh,
        vertices that are exactly equal are merged, so that seams do not look like rims.

    Raises
    ------
    FormatError
        If the file breaks its format, ends early, holds numbers that are not finite, points at vertices that it does
        not have, or cannot register; the message names the line or byte.
    UnitError
        If the unit is unknown.
    """
    unit = "mm" if units is None else units
    factor = mm_per_unit(unit)
    content = read_bytes(path, limits)
    header = parse_header(path, content, limits)
    wanted = _wanted(path, header, len(content), limits)
    tables, findings = _read_body(path, content, header, wanted, limits)
    vertices = tables["vertex"]
    points = np.column_stack([vertices.scalars[name] for name in _XYZ])
    if factor != 1.0:
        with np.errstate(over="ignore"):  # the check of the coordinates tells the place
            points *= factor
    check_coordinates(path, points, vertices.place, limits)
    normals = None
    if "nx" in wanted["vertex"]:
        normals = np.column_stack([vertices.scalars[name] for name in _NORMAL])
        normals, found = unit_normals(path, normals, vertices.place)
        findings += found
    faces = None
    if "face" in wanted:
        faces, found = fan_triangles(path, tables["face"], wanted["face"][0], len(points))
        findings += found
        points, normals, faces, found = merge_vertices(path, points, normals, faces)
        findings += found
        faces, found = drop_collapsed(path, points, faces)
        findings += found
    check_registrable(path, points)
    if any(each.name in _XYZ and each.code == "f4" for each in _element(header, "vertex").properties):
        findings += coarse_singles(path, points, factor)
    findings += origin_points(path, points) if faces is None else ()
    source = describe(path, content, format="PLY", unit=unit, unit_stated=units is not None)
    return Scan(points, normals, faces, source, findings)


def encode(
    scan: Scan,
    *,
    encoding: Literal["ascii", "binary_little_endian", "binary_big_endian"] = "binary_little_endian",
) -> bytes:
    """Return a scan as the bytes of a PLY file, in mm, with doubles, so that nothing is lost.

    >>> encode(Scan(np.eye(3)), encoding="ascii").decode().splitlines()[-1]
    '0.0 0.0 1.0'
    """
    columns = scan.points_mm if scan.normals is None else np.hstack([scan.points_mm, scan.normals])
    names = _XYZ if scan.normals is None else _XYZ + _NORMAL
    faces = np.zeros((0, 3), np.int64) if scan.faces is None else scan.faces
    lines = ["ply", f"format {encoding} 1.0", "comment unit mm", f"element vertex {len(columns)}"]
    lines += [f"property double {name}" for name in names]
    if len(faces):
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head = "\n".join([*lines, "end_header", ""]).encode("ascii")
    if encoding == "ascii":
        rows = [" ".join(map(repr, row)) for row in columns.tolist()]
        rows += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
        return head + "".join(f"{row}\n" for row in rows).encode("ascii")
    order = "<" if encoding == "binary_little_endian" else ">"
    corners = np.zeros(len(faces), [("count", "u1"), ("corners", f"{order}i4", (3,))])
    corners["count"], corners["corners"] = 3, faces
    return head + columns.astype(f"{order}f8").tobytes() + corners.tobytes()


def _element(header: Header, name: str) -> Element:
    return next(element for element in header.elements if element.name == name)


def _wanted(path: Path, header: Header, file_bytes: int, limits: Limits) -> dict[str, tuple[str, ...]]:
    """Return the properties to read of each element, after checking that the header offers them."""
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        raise FormatError(path, "the header has no element vertex, hence no points", line=header.body_line - 1)
    vertex = _element(header, "vertex")
    scalars = [each.name for each in vertex.properties if each.count_code is None]
    missing = [name for name in _XYZ if name not in scalars]
    if missing:
        raise FormatError(path, f"no {' and no '.join(missing)} among the vertex properties", line=vertex.line)
    if vertex.count == 0:
        raise FormatError(path, "no points: element vertex has 0 rows; export the scan again", line=vertex.line)
    normals = [name for name in _NORMAL if name in scalars]
    if len(normals) not in (0, 3):
        raise FormatError(path, f"the normals have only {', '.join(normals)}; export all or none", line=vertex.line)
    wanted = {"vertex": (*_XYZ, *normals)}
    face = _element(header, "face") if "face" in names else None
    if face is not None and face.count:
        wanted["face"] = _corner_list(path, face)
    for element, limit, key in ((vertex, limits.points, "points"), (face, limits.faces, "faces")):
        # A row takes a byte at least: a count beyond the file is refused below, with the bytes that are there.
        if element is not None and limit < element.count <= file_bytes:
            what = f"element {element.name} declares {element.count} rows, more than the limit {key} = {limit}"
            raise FormatError(path, what, line=element.line)
    return wanted


def _corner_list(path: Path, face: Element) -> tuple[str]:
    lists = [each for each in face.properties if each.name in _CORNERS and each.count_code]
    if len(lists) != 1:
        what = f"element face needs one list vertex_indices and has {len(lists)}; export as a plain mesh or as points"
        raise FormatError(path, what, line=face.line)
    if lists[0].code.startswith("f"):
        raise FormatError(path, f"list {lists[0].name} must hold integers, not floats", line=face.line)
    return (lists[0].name,)


def _read_body(
    path: Path, content: bytes, header: Header, wanted: dict[str, tuple[str, ...]], limits: Limits
) -> tuple[dict[str, Table], tuple[Finding, ...]]:
    tables: dict[str, Table] = {}
    findings: list[Finding] = []
    position = header.body_byte
    lines = text_lines(path, content, limits, first_byte=position, first_line=header.body_line)
    for element in header.elements:
        names = wanted.get(element.name, ())
        if header.byte_order:
            read = ply_binary.read_element(path, content, position, element, header.byte_order, names, limits)
            tables[element.name], position = read
        else:
            left = len(content) - position
            tables[element.name] = ply_ascii.read_element(path, lines, left, element, names, limits)
        if not names and element.count:
            level = Level.WARN if element.name == "tristrips" else Level.INFO
            message = f"{element.count} rows of element {element.name} are of no use here and were not read"
            findings.append(Finding(Code.ELEMENT_NOT_READ, level, message, f"{path}, line {element.line}"))
    if not header.byte_order:
        extra = [number for number, _ in lines]
        if extra:
            message = f"{len(extra)} more lines than the header declares; they were not read"
            findings.append(Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, line {extra[0]}"))
    elif position < len(content):
        message = f"{len(content) - position} more bytes than the header declares; they were not read"
        findings.append(Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, byte {position}"))
    return tables, tuple(findings)
