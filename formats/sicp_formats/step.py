"""Read STEP files: exact contours of the skins, and a mesh for pictures.

The CAD kernel works in a child process (`sicp_formats.step_child`), because it hangs, crashes or prints on strange
files. What a look at the bytes can refuse is refused here, before the kernel is started.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam import child_process
from sicp_cam.errors import CadError, FormatError, UnitError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Contour, Part, TriangleMesh
from sicp_cam.units import mm_per_unit
from sicp_formats.source import describe, read_bytes
from sicp_formats.step_notes import as_findings

__all__ = ["read_part"]

_START = re.compile(rb"(?:\xef\xbb\xbf)?(?:\s|/\*.{0,4000}?\*/)*ISO-10303-21\s*;", re.DOTALL)
_END = b"END-ISO-10303-21"
_OTHERS = (
    (re.compile(rb"AC10\d\d"), "a DWG drawing"),
    (re.compile(rb"[^\r\n]{72}S {0,6}0*1\s*[\r\n]"), "an IGES file"),
    (re.compile(rb"solid\s|\s*facet\s"), "an STL file"),
    (re.compile(rb"ply\s"), "a PLY file"),
    (re.compile(rb"DBRep_DrawableShape|CASCADE Topology"), "an OpenCASCADE BRep file"),
    (re.compile(rb"ISO-10303-28|<\?xml"), "an XML file"),
)
# No double holds these; the kernel turns them into something else, or never ends.
_OVERFLOW = re.compile(rb"[(,]\s*([+-]?\d+\.\d*E\+?0{0,9}(?:309|3[1-9]\d|[4-9]\d\d|[1-9]\d{3,}))\s*[,)]", re.IGNORECASE)
_COMMENT = re.compile(rb"/\*.{0,65536}?\*/", re.DOTALL)


def read_part(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS) -> Part:
    """Read the contours of a STEP file, in mm, on the exact edges of its skins.

    A skin is a set of faces that meet smoothly (within 15 degrees). Each loop of edges where a skin ends is a contour:
    a thin panel gives the contours of its outer and inner skin, and of the walls between them. They are ordered by
    length, longest first, ties by position. The samples are at most 1 mm apart (20,000 of a longer loop), with a chord
    error of at most 0.002 mm and a turn of at most 5 degrees each. Stability points lie 10 and 30 mm inside the
    material, where the same skin reaches so far.

    Edges that leave their surface or miss each other by more than 0.5 mm are refused, by more than 0.05 mm a finding.
    Findings 201-210 tell units, inside-out solids, entities and faces that were not understood, inexact edges, edges
    of more than two faces, open contours, a coarse mesh, and bodies without volume.

    Parameters
    ----------
    path
        The file: Part 21 text of AP203, AP214 or AP242.
    units
        The unit of a file that states none; the file's own unit is an error to contradict.
    limits
        `cad_seconds` and `child_memory_bytes` bound the CAD kernel.

    Raises
    ------
    FormatError
        If the bytes are not a whole STEP file.
    UnitError
        If `units` is unknown, or not the unit that the file states.
    CadError
        If the kernel cannot read the file, drops a part of it, crashes or takes too long; or if there is no face or
        no sensible extent.
    """
    if units is not None:
        mm_per_unit(units)
    content = read_bytes(path, limits)
    _refuse(path, content, limits)
    request = {"units": units, "coordinate_mm": limits.coordinate_mm}
    try:
        result = child_process.run(
            "sicp_formats.step_child",
            request,
            {"content": np.frombuffer(content, dtype=np.uint8)},
            timeout_s=limits.cad_seconds,
            memory_bytes=limits.child_memory_bytes,
        )
    except child_process.ChildTimeoutError:
        raise CadError(
            f"{_name(path)}: the CAD kernel took longer than cad_seconds = {limits.cad_seconds:g};"
            " the file is damaged, or raise that limit"
        ) from None
    except child_process.ChildCrashError as crash:
        raise CadError(f"{_name(path)}: the CAD kernel crashed on it, {crash}; export the file again") from None
    return _part(path, content, result)


def _name(path: Path) -> str:
    return printable(str(path))


def _refuse(path: Path, content: bytes, limits: Limits) -> None:
    """Raise for bytes that are no whole STEP file."""
    if not _START.match(content[: limits.line_bytes]):
        kind = next((what for pattern, what in _OTHERS if pattern.match(content[:200])), "no STEP file")
        raise FormatError(path, f"is {kind} (ISO-10303-21 is not its first word); export the part as STEP", byte=0)
    if content.rfind(_END) < 0:
        raise FormatError(
            path, f"is cut short ({_END.decode()} is missing at its end); copy or export it again", byte=len(content)
        )
    overflow = _OVERFLOW.search(content)
    if overflow:
        number = overflow[1].decode("ascii")
        raise FormatError(
            path, f"holds the number {number}, too large for any computer; export it again", byte=overflow.start(1)
        )
    literal = _long_literal(content, limits.line_bytes)
    if literal is not None:
        raise FormatError(
            path, f"has a text of more than line_bytes = {limits.line_bytes} bytes; export it again", byte=literal
        )


def _long_literal(content: bytes, longest: int) -> int | None:
    """Return where a text between quotes is longer than allowed; quotes within comments do not count."""
    if b"/*" in content:
        content = _COMMENT.sub(lambda comment: b" " * len(comment[0]), content)
    quotes = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == ord("'"))
    pairs = quotes[: len(quotes) // 2 * 2].reshape(-1, 2)
    long = pairs[pairs[:, 1] - pairs[:, 0] > longest + 1]
    return int(long[0, 0]) if len(long) else None


def _part(path: Path, content: bytes, result: child_process.ChildResult) -> Part:
    values, arrays = result.values, result.arrays
    if "error" in values:
        error = UnitError if values["error"] == "UnitError" else CadError
        raise error(f"{_name(path)}: {printable(values['message'], 500)}")
    source = describe(path, content, format="STEP", unit=values["unit"], unit_stated=values["unit_stated"])
    mesh = TriangleMesh(arrays["vertices"], arrays["triangles"], arrays["vertex_normals"])
    return Part(_contours(arrays), mesh, source, as_findings(values["notes"], str(path)))


def _contours(arrays: Mapping[str, npt.NDArray[Any]]) -> tuple[Contour, ...]:
    """Cut the arrays of the child, in which all contours stand one behind the other."""
    ends = np.cumsum(arrays["counts"], axis=0)
    contours = []
    for end, start, closed in zip(ends.tolist(), (ends - arrays["counts"]).tolist(), arrays["closed"], strict=True):
        samples, corners, ring = (slice(a, b) for a, b in zip(start, end, strict=True))
        contours.append(
            Contour(
                arrays["points"][samples],
                arrays["tangents"][samples],
                arrays["normals"][samples],
                closed=bool(closed),
                corners=arrays["corners"][corners],
                ring_points_mm=arrays["ring_points"][ring],
                ring_normals=arrays["ring_normals"][ring],
            )
        )
    return tuple(contours)
