"""OFF meshes and clouds as scans or nominal parts, read strictly; and the writers.

The format is that of the Geometry Center's Geomview: a keyword, counts, rows of vertices, rows of faces. It states no
unit of length.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, JobError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source
from sicp_cam.units import mm_per_unit
from sicp_formats.source import describe, read_bytes
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.polygons import (
    Checked,
    PolygonMesh,
    Polygons,
    as_part,
    as_scan,
    checked,
    equal_rows,
    whole_numbers,
)
from sicp_formats.tables.rows import Row, numbers, text_lines

__all__ = ["read_part", "read_scan", "write_part", "write_scan"]

_KEYWORD = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF(.*)")
_COUNT = re.compile(rb"[0-9]{1,18}")
_COLOURS = ("red", "green", "blue", "alpha")
_COLOUR_WORDS = (0, 1, 3, 4)
_LEAST_ROW_BYTES = 2


@dataclass(frozen=True, slots=True)
class _Header:
    """What the head of a file declares."""

    texture: bool
    colours: bool
    normals: bool
    vertices: int
    faces: int
    line: int


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scan from an OFF file: a mesh, or a cloud if it has no faces.

    Parameters
    ----------
    path
        The file, with one of the keywords OFF, COFF, NOFF, CNOFF, and each of these behind ST.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; millimetres are assumed if left out.
    limits
        Caps on what the file may ask for.
    recover
        Read the whole rows of a file that is cut short; drop vertices that are not finite, and faces that use them or
        vertices that do not exist; each with a finding of level WARN.

    Returns
    -------
    Scan
        Vertices in file order; polygons as fans of triangles; normals of NOFF; colours of COFF as columns red, green,
        blue and alpha, texture of STOFF as columns s and t. In a mesh, vertices that are exactly equal are merged.

    Raises
    ------
    FormatError
        If the file is of the binary kind or has another number of dimensions, breaks its format, declares more than
        it has, holds numbers that are not finite, or cannot register; the message names the line.
    UnitError
        If the unit is unknown.
    """
    mesh, source = _read(path, units, limits, recover)
    return as_scan(mesh, source)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Part:
    """Read a nominal part from an OFF file: a mesh, and no contours, which the loops of the mesh must give.

    Parameters, and errors raised, are those of `read_scan`; a file without faces is an error too.
    """
    mesh, source = _read(path, units, limits, recover)
    return as_part(path, mesh, source)


def write_scan(scan: Scan, *, unit: str = "mm") -> bytes:
    """Return a scan as the bytes of an OFF file, with all digits.

    Normals, triangles and colours (columns red, green, blue, and alpha if there is one) are kept. The format has no
    place for other columns.

    Raises
    ------
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan(np.eye(3))).decode().splitlines()[1:3]
    ['3 0 0', '1.0 0.0 0.0']
    """
    return _encoded(scan.points_mm, scan.normals, scan.faces, scan.columns, unit)


def write_part(part: Part, *, unit: str = "mm") -> bytes:
    """Return the mesh of a part as the bytes of an OFF file, with all digits; contours have no place in it.

    Raises
    ------
    JobError
        If the part has no triangles.
    UnitError
        If the unit is unknown.
    """
    if not len(part.mesh.faces):
        raise JobError("the part has no triangles to write")
    return _encoded(part.mesh.vertices_mm, part.mesh.normals, part.mesh.faces, {}, unit)


def _read(path: Path, units: str | None, limits: Limits, recover: bool) -> tuple[Checked, Source]:
    unit = "mm" if units is None else units
    factor = mm_per_unit(unit)
    content = read_bytes(path, limits)
    mesh = checked(path, _mesh(path, content, limits, recover), factor, limits, recover)
    source = describe(path, content, format="OFF", unit=unit, unit_stated=units is not None)
    return mesh, source


def _mesh(path: Path, content: bytes, limits: Limits, recover: bool) -> PolygonMesh:
    rows = _rows(path, content, limits)
    header = _header(path, rows, len(content), limits, recover)
    # The last line of a file that is cut may hold half of a number.
    whole_end = content.endswith((b"\n", b"\r"))
    vertices, findings = _declared_rows(path, rows, header.vertices, "vertices", header.line, recover, whole_end)
    if not vertices:
        raise FormatError(path, "no points: 0 vertices; export it again", line=header.line)
    points, normals, columns, lines = _vertices(path, vertices, header, recover)
    faces, more = _declared_rows(path, rows, header.faces, "faces", vertices[-1][0], recover, whole_end)
    findings += more
    polygons, more = _polygons(path, faces, limits) if faces else (None, ())
    findings += more
    extra = [number for number, _ in rows]
    if extra:
        message = f"{len(extra)} more lines than the header declares; they were not read"
        findings += (Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, line {extra[0]}"),)
    return PolygonMesh(points, lines, normals, columns, polygons, findings)


def _rows(path: Path, content: bytes, limits: Limits) -> Iterator[Row]:
    """Yield lines without comments."""
    first_byte = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    for number, line in text_lines(path, content, limits, first_byte=first_byte):
        text = line.split(b"#", 1)[0].strip() if b"#" in line else line
        if text:
            yield number, text


def _header(path: Path, rows: Iterator[Row], size: int, limits: Limits, recover: bool) -> _Header:
    line, text = next(rows, (1, b""))
    keyword, *words = text.split() or [b""]
    match = _KEYWORD.fullmatch(keyword) or _KEYWORD.fullmatch(keyword.upper())
    if not match:
        raise FormatError(path, "does not begin with OFF, COFF, NOFF or another such keyword", line=line)
    texture, colours, normals, four, many, glued = match.groups()
    if four or many:
        raise FormatError(path, f"{keyword.decode('ascii')} holds points that are not of x y z; export 3-D", line=line)
    if b"BINARY" in words:
        raise FormatError(
            path, "is of the binary kind of OFF, of which nothing tells the byte order; export it as text", line=line
        )
    if glued:
        if not recover:
            what = f"{keyword.decode('latin-1')!r}: a line break is missing behind OFF; insert it, or use --recover"
            raise FormatError(path, what, line=line)
        words.insert(0, glued)
    if not words:
        line, text = next(rows, (line, b""))
        words = text.split()
    if len(words) not in (2, 3) or not all(_COUNT.fullmatch(word) for word in words):
        what = "the counts of vertices, faces and edges should stand here; the file is damaged"
        raise FormatError(path, what, line=line)
    counts = int(words[0]), int(words[1])
    _check_counts(path, *counts, size, line, limits, recover)
    return _Header(bool(texture), bool(colours), bool(normals), *counts, line)


def _check_counts(path: Path, vertices: int, faces: int, size: int, line: int, limits: Limits, recover: bool) -> None:
    least = _LEAST_ROW_BYTES * (vertices + faces)
    if least > size + 1 and not recover:
        what = (
            f"the header declares {vertices} vertices and {faces} faces, at least {least} B, and the file has {size} B"
        )
        raise FormatError(path, f"{what}; it is cut short or damaged; or repair it with --recover", line=line)
    for count, limit, key in ((vertices, limits.points, "points"), (faces, limits.faces, "faces")):
        if count > limit and not recover:
            raise FormatError(path, f"{count} declared, more than the limit {key} = {limit}; raise it", line=line)


def _declared_rows(
    path: Path, rows: Iterator[Row], count: int, what: str, line: int, recover: bool, whole_end: bool
) -> tuple[list[Row], tuple[Finding, ...]]:
    """Return as many rows as the header declares; a last line without an end may be half of one."""
    found = list(islice(rows, count))
    if len(found) == count:
        return found, ()
    end = found[-1][0] if found else line
    message = f"the header declares {count} {what}, {len(found)} rows are present"
    if not recover:
        raise FormatError(path, f"{message}; it is cut short; or repair it with --recover", line=end)
    if found and not whole_end:
        found.pop()
    finding = Finding(Code.ROWS_MISSING, Level.WARN, f"{message}; {len(found)} were read", f"{path}, line {end}")
    return found, (finding,)


def _vertices(
    path: Path, rows: list[Row], header: _Header, recover: bool
) -> tuple[FloatArray, FloatArray | None, dict[str, FloatArray], IntArray]:
    line, text = rows[0]
    width = len(text.split())
    normals = ("nx", "ny", "nz") if header.normals else ()
    texture = ("s", "t") if header.texture else ()
    choices = [normals + colours + texture for colours in ((_COLOURS[:3], _COLOURS) if header.colours else ((),))]
    names = next((names for names in choices if 3 + len(names) == width), None)
    if names is None:
        wanted = " or ".join(str(3 + len(names)) for names in choices)
        what = f"a vertex of {width} numbers where the keyword asks for {wanted}; COFF has colours, NOFF normals"
        raise FormatError(path, what, line=line)
    try:
        values, lines = numbers(path, rows, width, finite=() if recover else range(width))
    except FormatError as error:
        if all(len(text.split()) == width for _, text in rows):
            raise
        what = f"{error.what}; if it is a face, the header declares too many vertices ({header.vertices}): correct it"
        raise FormatError(path, what, line=error.line) from None
    columns = {name: values[:, 3 + i] for i, name in enumerate(names) if name not in normals}
    return values[:, :3], values[:, 3:6] if normals else None, columns, lines


def _polygons(path: Path, rows: list[Row], limits: Limits) -> tuple[Polygons, tuple[Finding, ...]]:
    """Return the polygons; the colour that may stand behind the corners is left out."""
    lines = np.array([line for line, _ in rows], np.int64)
    table = equal_rows(rows)
    if table is not None and (table[:, 0] == table.shape[1] - 1).all() and table.shape[1] <= limits.list_length:
        named = table[:, 1:].ravel()
        return Polygons(table[:, 0], named, named, lines), ()
    lengths, corners, coloured = np.empty(len(rows), np.int64), [], 0
    for row, (line, text) in enumerate(rows):
        count, *words = text.split()
        corner_count = int(count) if _COUNT.fullmatch(count) else -1
        more = len(words) - corner_count
        if corner_count < 0 or more not in _COLOUR_WORDS:
            what = f"the face {text.decode('latin-1')!r} has not as many corners as its first number says"
            raise FormatError(path, f"{what}; it is damaged or cut short", line=line)
        if corner_count > limits.list_length:
            what = f"a face of {corner_count} corners, more than the limit list_length = {limits.list_length}; raise it"
            raise FormatError(path, what, line=line)
        lengths[row] = corner_count
        coloured += more > 0
        corners.append((line, b" ".join(words[:corner_count])))
    named = whole_numbers(path, corners)
    findings: tuple[Finding, ...] = ()
    if coloured:
        message = f"colours of {coloured} of {len(rows)} faces were not read"
        findings = (Finding(Code.COLUMNS_NOT_USED, Level.INFO, message, str(path)),)
    return Polygons(lengths, named, named, lines), findings


def _encoded(
    points_mm: FloatArray,
    normals: FloatArray | None,
    faces: IntArray | None,
    columns: Mapping[str, FloatArray],
    unit: str,
) -> bytes:
    values, keyword = points_mm / mm_per_unit(unit), "OFF"
    if normals is not None:
        values, keyword = np.hstack([values, normals]), "NOFF"
    if all(name in columns for name in _COLOURS[:3]):
        colours = [columns[name] for name in _COLOURS if name in columns]
        values, keyword = np.column_stack([values, *colours]), f"C{keyword}"
    triangles = [] if faces is None else faces.tolist()
    lines = [keyword, f"{len(values)} {len(triangles)} 0"]
    lines += [" ".join(map(repr, row)) for row in values.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in triangles]
    return "\n".join([*lines, ""]).encode("ascii")
