"""The binary kind of STL: a header of 80 bytes, a count, and 50 bytes for each triangle, little-endian."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.stl.facets import Facets, check_limit
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.unit import StatedUnit, unit_in

__all__ = ["encode", "is_binary", "read_facets", "stated_unit"]

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_UTF8_MARK = b"\xef\xbb\xbf"
_TITLE = "binary STL"  # must not begin with solid


def is_binary(content: bytes) -> bool:
    """Tell the two kinds apart; binary files may begin with `solid` too, so the size decides where it fits."""
    if len(content) >= _HEADER_BYTES and len(content) == _HEADER_BYTES + _FACET.itemsize * _declared(content):
        return True
    words = content[:1024].removeprefix(_UTF8_MARK).lstrip()
    begins_as_text = words[:5].lower() == b"solid" or words.startswith(b"#")
    return not begins_as_text or b"\0" in content[:1024]


def read_facets(path: Path, content: bytes, limits: Limits, recover: bool) -> Facets:
    """Read the triangles of a binary file.

    Parameters
    ----------
    path, content
        The file, and its bytes.
    limits
        `faces` caps the triangles.
    recover
        Read the whole triangles that are there, whatever the header declares.

    Raises
    ------
    FormatError
        If there are none, more than the limit, or not as many as declared.
    """
    count, findings = _count(path, content, recover)
    if count == 0:
        raise FormatError(path, "no triangles; export the mesh again", byte=80)
    check_limit(path, count, limits)
    facets = np.frombuffer(content, _FACET, count, _HEADER_BYTES)
    corners = np.empty((count, 3, 3), np.float32)
    corners[:] = facets["corners"]

    def place(row: int) -> dict[str, int]:
        return {"byte": _HEADER_BYTES + _FACET.itemsize * (row // 3) + 12 * (1 + row % 3)}

    findings += _colours(path, content, facets["attribute"])
    return Facets(corners.reshape(-1, 3), place, facets["normal"], findings)


def stated_unit(path: Path, content: bytes) -> StatedUnit | None:
    """Return the unit that the header states, as in `UNITS=mm`; None if it does not."""
    return unit_in(path, content[:80].split(b"\0", 1)[0].decode("latin-1"), 0, title=True)


def encode(vertices: FloatArray, faces: IntArray, normals: FloatArray, unit: str) -> bytes:
    """Return triangles as a binary file; `normals` are one for each triangle, `unit` is stated unless it is empty."""
    facets = np.zeros(len(faces), _FACET)
    facets["normal"] = normals
    facets["corners"] = vertices[faces]
    title = f"{_TITLE}, unit={unit}" if unit else _TITLE
    return title.encode("ascii").ljust(80) + len(faces).to_bytes(4, "little") + facets.tobytes()


def _declared(content: bytes) -> int:
    return int.from_bytes(content[80:84], "little")


def _count(path: Path, content: bytes, recover: bool) -> tuple[int, tuple[Finding, ...]]:
    if len(content) < _HEADER_BYTES:
        what = (
            f"has {len(content)} bytes, fewer than the {_HEADER_BYTES} of a binary STL header, and does not begin "
            "with 'solid' as a text STL does; it is cut short or is no STL file"
        )
        raise FormatError(path, what, byte=0)
    count, left = _declared(content), len(content) - _HEADER_BYTES
    size = count * _FACET.itemsize
    if size == left:
        return count, ()
    present, rest = divmod(left, _FACET.itemsize)
    if not recover:
        what = (
            f"the header declares {count} triangles x {_FACET.itemsize} B = {size} B, {left} B present; "
            "the file is damaged or is no STL file" + ("; or repair it with --recover" if present else "")
        )
        raise FormatError(path, what, byte=80)
    # What follows the declared triangles is more of them if it can be: a count is wrong more often than a tail is.
    if rest and 0 < count <= present:
        message = f"{left - size} more bytes than the declared {count} triangles; they were not read"
        return count, (Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, byte {_HEADER_BYTES + size}"),)
    message = f"the header declares {count} triangles, {present} whole ones are present and were read"
    return present, (Finding(Code.FACETS_MISCOUNTED, Level.WARN, message, f"{path}, byte 80"),)


def _colours(path: Path, content: bytes, attributes: npt.NDArray[np.uint16]) -> tuple[Finding, ...]:
    """Note colours, which some programs put into the header and into the two bytes behind each triangle."""
    header = content[:80].upper()
    named = [word.decode("ascii") for word in (b"COLOR=", b"MATERIAL=") if word in header]
    used = int(np.count_nonzero(attributes))
    if not named and not used:
        return ()
    told = [f"{word[:-1]} in the header" for word in named]
    told += [f"attribute bytes at {used} of {len(attributes)} triangles"] * bool(used)
    message = printable(f"{' and '.join(told)}, used for colours, were not read")
    return (Finding(Code.FACET_ATTRIBUTES, Level.INFO, message, str(path)),)
