"""OBJ meshes and clouds as scans or nominal parts, read strictly; and the writers.

The format is that of Wavefront's "Object Files (.obj)" (Advanced Visualizer 3.0, appendix B1), with the colours that
many programs put behind the coordinates of a vertex. It states no unit of length; the writers state it in a comment,
`# unit mm`, which the readers follow.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, JobError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source
from sicp_cam.units import mm_per_unit
from sicp_formats.obj.statements import Statements, statements
from sicp_formats.source import describe, read_bytes, unit_to_state
from sicp_formats.surfaces.checks import Code, unit_normals
from sicp_formats.surfaces.ending import without_cut_line
from sicp_formats.surfaces.polygons import Checked, PolygonMesh, Polygons, as_part, as_scan, checked, whole_numbers
from sicp_formats.surfaces.unit import chosen_unit
from sicp_formats.tables.rows import numbers

__all__ = ["read_part", "read_scan", "write_part", "write_scan"]

_CORNER = re.compile(rb"(?<!\S)([+-]?[0-9]{1,18})(?:/[+-]?[0-9]{0,18}){0,2}(?!\S)")
_CORNER_NORMAL = re.compile(rb"(?<!\S)[+-]?[0-9]{1,18}/[+-]?[0-9]{0,18}/([+-]?[0-9]{1,18})(?!\S)")
_COLOURS = ("red", "green", "blue")
_COLUMNS: Mapping[int, tuple[str, ...]] = {3: (), 4: ("w",), 6: _COLOURS}


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scan from an OBJ file: a mesh, or a cloud if it has no faces.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of a comment such as
        `# unit mm`, or else millimetres.
    limits
        Caps on what the file may ask for.
    recover
        Drop vertices and normals that are not finite, and faces that use them or vertices that do not exist; each
        with a finding of level WARN. Drop a last vertex that may be cut short, too.

    Returns
    -------
    Scan
        Vertices in file order; polygons as fans of triangles. Normals are the mean of those that the corners at a
        vertex name; a cloud takes them in order. Colours behind the coordinates are columns red, green and blue. In
        a mesh, vertices that are exactly equal are merged. Texture, groups and materials have no meaning here;
        lines, points and free-form curves are told in findings.

    Raises
    ------
    FormatError
        If a statement is unknown, a number is none or not finite, a face points at a vertex that does not exist, or
        what is left cannot register; the message names the line.
    UnitError
        If the unit is unknown, or not the one that the file states.
    """
    mesh, source = _read(path, units, limits, recover)
    return as_scan(mesh, source)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Part:
    """Read a nominal part from an OBJ file: a mesh, and no contours, which the loops of the mesh must give.

    Parameters, and errors raised, are those of `read_scan`; a file without faces is an error too.
    """
    mesh, source = _read(path, units, limits, recover)
    return as_part(path, mesh, source)


def write_scan(scan: Scan, *, unit: str = "mm") -> bytes:
    """Return a scan as the bytes of an OBJ file, with all digits.

    Normals and triangles are kept, and colours (columns red, green and blue; those up to 255 become 0 to 1, as the
    format has them). It has no place for other columns.

    Raises
    ------
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan(np.eye(3))).decode().splitlines()[1]
    'v 1.0 0.0 0.0'
    """
    return _encoded(scan.points_mm, scan.normals, scan.faces, scan.columns, unit, unit_to_state(scan.source, unit))


def write_part(part: Part, *, unit: str = "mm") -> bytes:
    """Return the mesh of a part as the bytes of an OBJ file, with all digits; contours have no place in it.

    Raises
    ------
    JobError
        If the part has no triangles.
    UnitError
        If the unit is unknown.
    """
    if not len(part.mesh.faces):
        raise JobError("the part has no triangles to write")
    return _encoded(
        part.mesh.vertices_mm, part.mesh.normals, part.mesh.faces, {}, unit, unit_to_state(part.source, unit)
    )


def _read(path: Path, units: str | None, limits: Limits, recover: bool) -> tuple[Checked, Source]:
    mm_per_unit("mm" if units is None else units)
    content = read_bytes(path, limits)
    kept, cut = without_cut_line(path, content, recover=recover, keyword=b"v ")
    found = statements(path, kept, limits)
    unit, stated, findings = chosen_unit(path, found.unit, units)
    mesh = checked(path, _mesh(path, found, recover), mm_per_unit(unit), limits, recover)
    source = describe(path, content, format="OBJ", unit=unit, unit_stated=stated)
    return replace(mesh, findings=findings + cut + mesh.findings), source


def _mesh(path: Path, found: Statements, recover: bool) -> PolygonMesh:
    points, lines, columns, findings = _vertices(path, found, recover)
    findings += found.findings
    polygons = None
    if found.faces:
        lengths = np.array([len(text.split()) for _, text in found.faces], np.int64)
        named = whole_numbers(path, found.faces, _CORNER)
        before = np.repeat(np.array(found.vertices_before, np.int64), lengths)
        face_lines = np.array([number for number, _ in found.faces], np.int64)
        polygons = Polygons(lengths, _resolved(named, before), named, face_lines)
    normals, more = _normals(path, found, polygons, len(points), recover)
    return PolygonMesh(points, lines, normals, columns, polygons, findings + more)


def _vertices(
    path: Path, found: Statements, recover: bool
) -> tuple[FloatArray, IntArray, dict[str, FloatArray], tuple[Finding, ...]]:
    line, text = found.vertices[0]
    width = len(text.split())
    if width not in _COLUMNS:
        what = f"a vertex of {width} numbers; x y z, x y z w and x y z red green blue are known; export it without more"
        raise FormatError(path, what, line=line)
    values, lines = numbers(path, found.vertices, width, finite=() if recover else range(width))
    columns = {name: values[:, 3 + i] for i, name in enumerate(_COLUMNS[width])}
    if width == 4 and (columns["w"] == 1.0).all():
        columns = {}
    findings: tuple[Finding, ...] = ()
    if "w" in columns:
        message = "the weights w of the vertices are not all 1; coordinates were taken as they stand, w is a column"
        findings = (Finding(Code.WEIGHTS_NOT_USED, Level.WARN, message, f"{path}, line {line}"),)
    return values[:, :3], lines, columns, findings


def _resolved(named: IntArray, before: IntArray) -> IntArray:
    """Return indices from 0: the file counts from 1, or back from the last one before the line with negative ones."""
    back = np.where(before + named < 0, -1, before + named)
    return np.where(named > 0, named - 1, np.where(named < 0, back, -1))


def _normals(
    path: Path, found: Statements, polygons: Polygons | None, points: int, recover: bool
) -> tuple[FloatArray | None, tuple[Finding, ...]]:
    """Return one normal for each vertex, None if the file does not tell one for each."""
    if not found.normals:
        return None, ()
    values, lines = numbers(path, found.normals, 3, finite=() if recover else (0, 1, 2))
    findings: tuple[Finding, ...] = ()
    if not np.isfinite(values).all():
        bad = ~np.isfinite(values).all(axis=1)
        values[bad] = 0.0
        message = f"{bad.sum()} normals are not finite and count as not given"
        where = f"{path}, line {lines[np.argmax(bad)]}"
        findings = (Finding(Code.NORMALS_DROPPED, Level.WARN, message, where),)
    values, more = unit_normals(path, values, lambda row: {"line": int(lines[row])})
    findings += more
    if polygons is None:
        named = np.arange(points) if len(values) == points else None
        owners = np.arange(points)
    else:
        named, owners = _named_normals(path, found, polygons, len(values), recover), polygons.corners
    if named is None:
        message = f"{len(values)} normals were not used: not every {'point' if polygons is None else 'corner'} has one"
        return None, (*findings, Finding(Code.NORMALS_NOT_USED, Level.INFO, message, str(path)))
    there = (owners >= 0) & (owners < points)  # others are told of where triangles are made
    sums = np.column_stack([np.bincount(owners[there], column[named[there]], points) for column in values.T])
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    # Opposite normals at one vertex cancel; no normal is told then.
    return np.where(lengths > 1e-6, sums / np.maximum(lengths, 1e-6), 0.0), findings


def _named_normals(path: Path, found: Statements, polygons: Polygons, normals: int, recover: bool) -> IntArray | None:
    words = _CORNER_NORMAL.findall(b" ".join([text for _, text in found.faces]))
    if len(words) != len(polygons.corners):
        return None
    named = np.array(words, dtype="S19").astype(np.int64)
    index = _resolved(named, np.repeat(np.array(found.normals_before, np.int64), polygons.lengths))
    good = (index >= 0) & (index < normals)
    if good.all():
        return index
    if recover:
        return None
    item = int(np.argmin(good))
    line = int(polygons.lines[np.searchsorted(np.cumsum(polygons.lengths), item, side="right")])
    what = f"the face points at normal {named[item]} and there are {normals}; export it again"
    raise FormatError(path, f"{what}, or repair it with --recover", line=line)


def _encoded(
    points_mm: FloatArray,
    normals: FloatArray | None,
    faces: IntArray | None,
    columns: Mapping[str, FloatArray],
    unit: str,
    stated: str,
) -> bytes:
    values = points_mm / mm_per_unit(unit)
    if all(name in columns for name in _COLOURS):
        colours = np.column_stack([columns[name] for name in _COLOURS])
        values = np.hstack([values, colours / (255.0 if colours.max(initial=0.0) > 1.0 else 1.0)])
    lines = [f"# unit {stated}"] if stated else []
    lines += ["v " + " ".join(map(repr, row)) for row in values.tolist()]
    if normals is not None:
        lines += ["vn " + " ".join(map(repr, row)) for row in normals.tolist()]
    if faces is not None:
        corner = "{0}//{0}" if normals is not None else "{0}"
        face = "f " + " ".join(corner.replace("0", str(i)) for i in range(3))
        lines += [face.format(a, b, c) for a, b, c in (faces + 1).tolist()]
    return "\n".join([*lines, ""]).encode("ascii")
