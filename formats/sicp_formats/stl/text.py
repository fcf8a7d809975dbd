"""The text kind of STL: words, one after the other, in an order that is never left."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.stl.facets import Facets, check_limit
from sicp_formats.stl.regular import regular_corners
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.unit import StatedUnit, unit_in
from sicp_formats.tables.rows import Row, numbers, text_lines

__all__ = ["encode", "read_facets", "stated_unit"]

_UTF8_MARK = b"\xef\xbb\xbf"
_TITLE = re.compile(rb"^[ \t]*(?:solid|#)([^\r\n]{0,999})", re.IGNORECASE | re.MULTILINE)
_TITLE_BYTES = 2**16
_NEXT = {b"solid": b"facet", b"facet": b"outer", b"outer": b"vertex", b"endloop": b"endfacet", b"endfacet": b"facet"}


def read_facets(path: Path, content: bytes, limits: Limits, recover: bool) -> Facets:
    """Read the triangles of a text file, of all solids in it.

    Parameters
    ----------
    path, content
        The file, and its bytes.
    limits
        Caps of lines and triangles.
    recover
        Where the file ends too early, read the whole triangles before its end; let coordinates pass that are not
        finite, for the caller to drop.

    Raises
    ------
    FormatError
        If a word stands where another should, a coordinate is no number, or there is no triangle.
    """
    findings: list[Finding] = []
    found = regular_corners(content, limits)
    if found is None:
        rows = _corner_rows(path, _without_cut_line(content) if recover else content, limits, recover, findings)
        found = numbers(path, rows, 3, finite=() if recover else (0, 1, 2))
    corners, lines = found
    return Facets(corners, lambda row: {"line": int(lines[row])}, findings=tuple(findings))


def stated_unit(path: Path, content: bytes) -> StatedUnit | None:
    """Return the unit that the name of a solid or a comment at the beginning states; None if none does.

    Raises
    ------
    FormatError
        If they state two.
    """
    unit = None
    head = content[:_TITLE_BYTES].replace(b"\r\n", b"\n").replace(b"\r", b"\n").removeprefix(_UTF8_MARK)
    for match in _TITLE.finditer(head):
        line = head.count(b"\n", 0, match.start()) + 1
        unit = unit_in(path, match[1].decode("utf-8", "replace"), line, unit, title=True)
    return unit


def encode(vertices: FloatArray, faces: IntArray, normals: FloatArray, unit: str) -> bytes:
    """Return triangles as a text with all digits of each number.

    Parameters
    ----------
    vertices, faces
        The triangles.
    normals
        One for each triangle.
    unit
        Unit of the vertices, which the name of the solid states; "" to state none.
    """
    words = [" ".join(map(repr, row)) for row in vertices.tolist()]
    sides = [" ".join(map(repr, row)) for row in normals.tolist()]
    facets = [
        f"facet normal {side}\nouter loop\nvertex {words[a]}\nvertex {words[b]}\nvertex {words[c]}\nendloop\nendfacet\n"
        for side, (a, b, c) in zip(sides, faces.tolist(), strict=True)
    ]
    name = f"mesh unit={unit}" if unit else "mesh"
    return "".join([f"solid {name}\n", *facets, f"endsolid {name}\n"]).encode("ascii")


def _without_cut_line(content: bytes) -> bytes:
    """Return a text without a last line that does not end, unless it is the end of a solid: it may be half of one."""
    start = max(content.rfind(b"\n"), content.rfind(b"\r")) + 1
    return content if content[start:].lstrip()[:8].lower() == b"endsolid" else content[:start]


def _corner_rows(path: Path, content: bytes, limits: Limits, recover: bool, findings: list[Finding]) -> Iterator[Row]:
    """Yield the coordinates of the corners, three rows a facet, after checking the words around them."""
    expected, number, count = b"solid", 0, 0
    corners: list[Row] = []
    first_byte = len(_UTF8_MARK) if content.startswith(_UTF8_MARK) else 0
    for number, text in text_lines(path, content, limits, first_byte=first_byte):
        # Not in the specification, but some writers comment.
        words = (text.split(b"#", 1)[0] if b"#" in text else text).split(None, 1)
        if not words:
            continue
        word = words[0].lower()
        if word == b"vertex" and expected == b"vertex":
            corners.append((number, words[1] if len(words) == 2 else b""))
            if len(corners) == 3:
                expected = b"endloop"
        elif word == expected:
            _check_rest(path, number, word, words[1:])
            if word == b"endloop":
                count += 1
                check_limit(path, count, limits)
                yield from corners
                corners.clear()
            expected = _NEXT[word]
        elif expected == b"facet" and word == b"endsolid":
            expected = b"solid"
        else:
            shown, wanted = words[0].decode("latin-1"), expected.decode("ascii")
            raise FormatError(path, f"{shown!r} stands where {wanted!r} should; the file is damaged", line=number)
    if expected != b"solid":
        missing = "endsolid" if expected == b"facet" else expected.decode("ascii")
        if not recover or not count:
            what = f"the file ends before {missing!r}; it is cut short" + "; or repair it with --recover" * bool(count)
            raise FormatError(path, what, line=number)
        message = f"the file ends before {missing!r}; the {count} whole triangles before its end were read"
        findings.append(Finding(Code.FACETS_CUT, Level.WARN, message, f"{path}, line {number}"))
    if count == 0:
        raise FormatError(path, "no triangles; export the mesh again", line=max(number, 1))


def _check_rest(path: Path, number: int, word: bytes, rest: list[bytes]) -> None:
    follows = rest[0].split()[0].lower() if rest else b""
    if (word == b"outer" and follows != b"loop") or (word == b"facet" and follows not in (b"normal", b"")):
        wanted = "loop" if word == b"outer" else "normal"
        raise FormatError(path, f"{word.decode('ascii')!r} is not followed by {wanted!r}", line=number)
