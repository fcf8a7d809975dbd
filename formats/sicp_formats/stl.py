"""STL meshes as scans or nominal parts: binary and text, told apart by size, read strictly.

The formats are those of 3D Systems' "StereoLithography Interface Specification" (1989). They state no unit of length,
and repeat each vertex for each triangle; vertices that are exactly equal are merged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source, TriangleMesh
from sicp_cam.units import mm_per_unit
from sicp_formats.mesh_checks import drop_collapsed, equal_points
from sicp_formats.source import describe, read_bytes
from sicp_formats.surface_checks import Code, Place, check_coordinates, check_registrable, coarse_singles
from sicp_formats.text_rows import Row, numbers, text_lines

__all__ = ["read_part", "read_scan"]

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_UTF8_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True, eq=False)
class _Mesh:
    vertices_mm: FloatArray
    faces: IntArray
    source: Source
    findings: tuple[Finding, ...]


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS) -> Scan:
    """Read a scanned mesh from an STL file.

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
        Merged vertices and the triangles between them; the outward side is that of their winding.

    Raises
    ------
    FormatError
        If the file breaks its format, ends early, holds numbers that are not finite, or no triangle with an area;
        the message names the line or byte.
    UnitError
        If the unit is unknown.
    """
    mesh = _read(path, units, limits)
    return Scan(mesh.vertices_mm, None, mesh.faces, mesh.source, mesh.findings)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS) -> Part:
    """Read a nominal part from an STL file: a mesh, and no contours, which the loops of the mesh must give.

    Parameters, and errors raised, are those of `read_scan`.
    """
    mesh = _read(path, units, limits)
    return Part((), TriangleMesh(mesh.vertices_mm, mesh.faces), mesh.source, mesh.findings)


def _read(path: Path, units: str | None, limits: Limits) -> _Mesh:
    unit = "mm" if units is None else units
    factor = mm_per_unit(unit)
    content = read_bytes(path, limits)
    binary = _is_binary(content)
    if binary:
        corners, place, findings = _binary_corners(path, content, limits)
    else:
        corners, lines = numbers(path, _text_corners(path, content, limits), 3, finite=(0, 1, 2))
        place, findings = lambda row: {"line": int(lines[row])}, ()
    with np.errstate(over="ignore"):  # the check of the coordinates tells the place
        points = corners * factor
    check_coordinates(path, points, place, limits)
    first, merged = equal_points(points)
    vertices = points[first]
    faces, found = drop_collapsed(path, vertices, merged.reshape(-1, 3))
    findings += found
    check_registrable(path, vertices)
    if binary:
        findings += coarse_singles(path, vertices, factor)
    kind = "STL binary" if binary else "STL ascii"
    source = describe(path, content, format=kind, unit=unit, unit_stated=units is not None)
    return _Mesh(vertices, faces, source, findings)


def _is_binary(content: bytes) -> bool:
    """Tell the two kinds apart; binary files may begin with `solid` too, so the size decides where it fits."""
    if len(content) >= _HEADER_BYTES and len(content) == _HEADER_BYTES + _FACET.itemsize * _declared(content):
        return True
    words = content[:1024].removeprefix(_UTF8_MARK).lstrip()
    begins_as_text = words[:5].lower() == b"solid" or words.startswith(b"#")
    return not begins_as_text or b"\0" in content[:1024]


def _declared(content: bytes) -> int:
    return int.from_bytes(content[80:84], "little")


def _binary_corners(path: Path, content: bytes, limits: Limits) -> tuple[FloatArray, Place, tuple[Finding, ...]]:
    if len(content) < _HEADER_BYTES:
        what = (
            f"has {len(content)} bytes, fewer than the {_HEADER_BYTES} of a binary STL header, and does not begin "
            "with 'solid' as a text STL does; it is cut short or is no STL file"
        )
        raise FormatError(path, what, byte=0)
    count, left = _declared(content), len(content) - _HEADER_BYTES
    if count * _FACET.itemsize != left:
        what = (
            f"the header declares {count} triangles x {_FACET.itemsize} B = {count * _FACET.itemsize} B, {left} B "
            "present; the file is damaged or is no STL file"
        )
        raise FormatError(path, what, byte=80)
    if count == 0:
        raise FormatError(path, "no triangles; export the mesh again", byte=80)
    _check_limit(path, count, limits)
    facets = np.frombuffer(content, _FACET, count, _HEADER_BYTES)
    with np.errstate(invalid="ignore"):  # a signalling nan; the check of the coordinates tells its place
        corners = facets["corners"].reshape(-1, 3).astype(np.float64)

    def place(row: int) -> dict[str, int]:
        return {"byte": _HEADER_BYTES + _FACET.itemsize * (row // 3) + 12 * (1 + row % 3)}

    return corners, place, _against_winding(path, facets["normal"], corners)


def _against_winding(path: Path, stored: FloatArray, corners: FloatArray) -> tuple[Finding, ...]:
    """Warn where stored normals and the order of the corners tell different outward sides."""
    with np.errstate(all="ignore"):  # not checked yet; nan compares false
        a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
        crosses, normals = np.cross(b - a, c - a), stored.astype(np.float64)
        lengths = np.sqrt(np.einsum("ij,ij->i", crosses, crosses) * np.einsum("ij,ij->i", normals, normals))
        # Slivers turn either way by rounding alone, so only what is clearly opposite counts.
        against = int((np.einsum("ij,ij->i", crosses, normals) < -0.5 * lengths).sum())
    if not against:
        return ()
    message = f"{against} of {len(stored)} stored normals point against the order of the corners, which was followed"
    return (Finding(Code.NORMALS_AGAINST_WINDING, Level.WARN, message, str(path)),)


def _text_corners(path: Path, content: bytes, limits: Limits) -> Iterator[Row]:
    """Yield the coordinates of the corners, three rows a facet, after checking the words around them."""
    expected, number, corners = b"solid", 0, 0
    first_byte = len(_UTF8_MARK) if content.startswith(_UTF8_MARK) else 0
    for number, text in text_lines(path, content, limits, first_byte=first_byte):
        # Not in the specification, but some writers comment.
        words = (text.split(b"#", 1)[0] if b"#" in text else text).split(None, 1)
        if not words:
            continue
        word = words[0].lower()
        if word == b"vertex" and expected == b"vertex":
            corners += 1
            if corners % 3 == 0:
                expected = b"endloop"
            yield number, words[1] if len(words) == 2 else b""
        elif word == expected:
            _check_rest(path, number, word, words[1:])
            if word == b"facet":
                _check_limit(path, corners // 3 + 1, limits)
            expected = _NEXT[word]
        elif expected == b"facet" and word == b"endsolid":
            expected = b"solid"
        else:
            shown, wanted = words[0].decode("latin-1"), expected.decode("ascii")
            raise FormatError(path, f"{shown!r} stands where {wanted!r} should; the file is damaged", line=number)
    if expected != b"solid":
        missing = "endsolid" if expected == b"facet" else expected.decode("ascii")
        raise FormatError(path, f"the file ends before {missing!r}; it is cut short", line=number)
    if corners == 0:
        raise FormatError(path, "no triangles; export the mesh again", line=max(number, 1))


_NEXT = {b"solid": b"facet", b"facet": b"outer", b"outer": b"vertex", b"endloop": b"endfacet", b"endfacet": b"facet"}


def _check_rest(path: Path, number: int, word: bytes, rest: list[bytes]) -> None:
    follows = rest[0].split()[0].lower() if rest else b""
    if (word == b"outer" and follows != b"loop") or (word == b"facet" and follows not in (b"normal", b"")):
        wanted = "loop" if word == b"outer" else "normal"
        raise FormatError(path, f"{word.decode('ascii')!r} is not followed by {wanted!r}", line=number)


def _check_limit(path: Path, count: int, limits: Limits) -> None:
    if count > limits.faces:
        raise FormatError(path, f"{count} triangles are more than the limit faces = {limits.faces}; raise it")
