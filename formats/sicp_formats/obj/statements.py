"""The statements of an OBJ file, sorted by what they say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.unit import StatedUnit, unit_in
from sicp_formats.tables.rows import Row, text_lines

__all__ = ["Statements", "statements"]

_LOOKS = frozenset(b"vt g o s mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj".split())
"""Texture, names and looks, which have no meaning here."""
_ELEMENTS = frozenset(b"p l".split())
_FREE_FORM = frozenset(
    b"vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con ctech stech bsp bzp cdc cdp res".split()
)
_NAMES = frozenset(b"g o usemtl mtllib usemap maplib shadow_obj trace_obj".split())
"""Statements with names, in which a backslash at the end may belong to a path."""
_COMMENT = re.compile(rb"#([^\r\n]{0,999})")


@dataclass(frozen=True, slots=True)
class Statements:
    """Rows of numbers by kind, how many vertices and normals stood before each face, and the unit of the comments."""

    vertices: list[Row] = field(default_factory=list)
    normals: list[Row] = field(default_factory=list)
    faces: list[Row] = field(default_factory=list)
    vertices_before: list[int] = field(default_factory=list)
    normals_before: list[int] = field(default_factory=list)
    unit: StatedUnit | None = None
    findings: tuple[Finding, ...] = ()


def statements(path: Path, content: bytes, limits: Limits) -> Statements:
    """Sort the lines of an OBJ file.

    Raises
    ------
    FormatError
        If a statement is unknown, a polygon has more corners than `limits.list_length`, there are no vertices or
        more than `limits.points`, or comments state two units.
    """
    vertices: list[Row] = []
    normals: list[Row] = []
    faces: list[Row] = []
    vertices_before: list[int] = []
    normals_before: list[int] = []
    others: dict[bytes, list[int]] = {}
    number = 1
    for number, text in _lines(path, content, limits):
        word, *rest = text.split(None, 1)
        row = (number, rest[0] if rest else b"")
        if not rest and word in (b"v", b"vn"):
            what = f"{word.decode('ascii')} without numbers; the file is damaged or cut short"
            raise FormatError(path, what, line=number)
        if word == b"v":
            vertices.append(row)
        elif word in (b"f", b"fo"):
            faces.append(row)
            vertices_before.append(len(vertices))
            normals_before.append(len(normals))
        elif word == b"vn":
            normals.append(row)
        elif word not in _LOOKS:
            others.setdefault(word, []).append(number)
    findings = tuple(_not_read(path, word, lines) for word, lines in others.items())
    if not vertices:
        raise FormatError(path, "no vertices (lines that begin with v); export the mesh again", line=number)
    if len(vertices) > limits.points:
        what = f"{len(vertices)} vertices are more than the limit points = {limits.points}; raise it"
        raise FormatError(path, what)
    _check_polygons(path, faces, limits)
    return Statements(vertices, normals, faces, vertices_before, normals_before, _unit(path, content), findings)


def _unit(path: Path, content: bytes) -> StatedUnit | None:
    unit = None
    line_end = b"\n" if b"\n" in content else b"\r"
    for match in _COMMENT.finditer(content):
        if b"unit" in (comment := match[1].lower()) or b"coordinates" in comment:
            line = content.count(line_end, 0, match.start()) + 1
            unit = unit_in(path, match[1].decode("utf-8", "replace"), line, unit)
    return unit


def _lines(path: Path, content: bytes, limits: Limits) -> Iterator[Row]:
    """Yield statements without comments, those that go on behind a backslash as one."""
    first_byte = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    lines: Iterable[Row] = text_lines(path, content, limits, first_byte=first_byte)
    if b"\\" in content:
        lines = _joined(path, lines, limits)
    for number, text in lines:
        statement = text.split(b"#", 1)[0] if b"#" in text else text
        if statement.strip():
            yield number, statement


def _joined(path: Path, lines: Iterable[Row], limits: Limits) -> Iterator[Row]:
    begun: tuple[int, list[bytes]] | None = None
    for number, text in lines:
        names = begun is None and (text.startswith(b"#") or text.split(None, 1)[0] in _NAMES)
        more = text.endswith(b"\\") and not names
        if begun is None and not more:
            yield number, text
            continue
        begun = begun or (number, [])
        begun[1].append(text[:-1] if more else text)
        if sum(map(len, begun[1][-2:])) > limits.line_bytes or len(begun[1]) > limits.list_length:
            raise FormatError(path, "the statement goes on over too many lines; is it damaged?", line=begun[0])
        if not more:
            yield begun[0], b" ".join(begun[1])
            begun = None
    if begun is not None:
        raise FormatError(path, "the file ends where a line should go on (\\); it is cut short", line=begun[0])


def _not_read(path: Path, word: bytes, lines: list[int]) -> Finding:
    name, where = word.decode("latin-1"), f"{path}, line {lines[0]}"
    if word in _ELEMENTS:
        kind = "lines" if word == b"l" else "points"
        message = f"{len(lines)} statements {name} ({kind} between vertices) are of no use here and were not read"
        return Finding(Code.ELEMENT_NOT_READ, Level.INFO, message, where)
    if word in _FREE_FORM:
        message = f"{len(lines)} statements {name} of free-form curves or surfaces were not read; export a mesh"
        return Finding(Code.FREE_FORM_NOT_READ, Level.WARN, message, where)
    raise FormatError(path, f"unknown statement {name!r}; the file is damaged or is no OBJ file", line=lines[0])


def _check_polygons(path: Path, faces: list[Row], limits: Limits) -> None:
    for number, text in faces:
        if len(text) > 2 * limits.list_length and (corners := len(text.split())) > limits.list_length:
            what = f"a face of {corners} corners, more than the limit list_length = {limits.list_length}; raise it"
            raise FormatError(path, what, line=number)
