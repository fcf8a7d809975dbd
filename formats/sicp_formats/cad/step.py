"""Read STEP files: exact contours of the skins, and a mesh for pictures.

The CAD kernel works in a child process (`sicp_formats.cad.part`). What a look at the bytes can refuse is refused here,
before the kernel is started.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Part
from sicp_formats.cad.notes import Code
from sicp_formats.cad.part import SEW_MM, CadRequest, part_of, refuse_foreign
from sicp_formats.source import read_bytes

__all__ = ["read_part"]

_END = b"END-ISO-10303-21"
# No double holds these; the kernel turns them into something else, or never ends.
_OVERFLOW = re.compile(rb"[(,]\s*([+-]?\d+\.\d*E\+?0{0,9}(?:309|3[1-9]\d|[4-9]\d\d|[1-9]\d{3,}))\s*[,)]", re.IGNORECASE)
_COMMENT = re.compile(rb"/\*.{0,65536}?\*/", re.DOTALL)
_GEOMETRY = re.compile(
    rb"[=(]\s*(?:ADVANCED_FACE|FACE_SURFACE|\w*TRIANGULATED_\w+|TESSELLATED_\w+|\w+_SHELL|EDGE_CURVE|VERTEX_POINT"
    rb"|GEOMETRIC_\w*SET|CSG_SOLID|EXTRUDED_\w+|REVOLVED_\w+)\s*\("
)
_OTHER_FILE = re.compile(
    rb"=\s*DOCUMENT_FILE\s*\((?:\s*'([^']*)'\s*,\s*'([^']*)')?"
    rb"|APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT\s*\((?:\s*'([^']*)')?"
)
_CAD_FILE = re.compile(r"\.(?:step|stp|p21|stpz|ste?p\.gz|stpx|prt|sldprt|catpart|ipt|par|jt)$", re.IGNORECASE)
MOST_NAMES = 8


def read_part(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    body: str | None = None,
    sew_mm: float = SEW_MM,
    turned: bool = False,
) -> Part:
    """Read the contours of a STEP file, in mm, on the exact edges of its skins.

    A skin is a set of faces that meet smoothly (within 15 degrees). Each loop of edges where a skin ends is a contour:
    a thin panel gives the contours of its outer and inner skin, and of the walls between them. They are ordered by
    length, longest first, ties by position. The samples are at most 1 mm apart (20,000 of a longer loop), with a chord
    error of at most 0.002 mm and a turn of at most 5 degrees each. Stability points lie 10 and 30 mm inside the
    material, where the same skin reaches so far.

    Faces and shells of one product that belong to no solid and only touch are sewn, so that they make one skin;
    products stay apart. Of products of one face each that have no name of their own it cannot be told: they are sewn,
    with a finding. Of faces that are there twice one is read, and faces that lie on each other are not sewn. A file
    that holds triangles only gives a mesh and no contours.

    Edges that leave their surface or miss each other by more than 0.5 mm are refused, by more than 0.05 mm a finding.
    Findings 201-219 and, of repairs, 250-254 are named in `sicp_formats.cad.notes.Code`.

    Parameters
    ----------
    path
        The file: Part 21 text of AP203, AP214 or AP242.
    units
        The unit of a file that states none; the file's own unit is an error to contradict.
    limits
        `cad_seconds` and `child_memory_bytes` bound the CAD kernel.
    recover
        True to heal invalid shapes, to leave out what cannot be read, and to read a file that is cut short. Each kind
        is a finding.
    body
        Number or name of the only body that is wanted; a name takes every body of that name. All if left out.
    sew_mm
        Loose faces that are no further apart are sewn, in mm; 0 to leave them as they are.
    turned
        True if the outward side of bodies without volume is the other one.

    Raises
    ------
    FormatError
        If the bytes are not a whole STEP file, or its parts are in other files.
    UnitError
        If `units` is unknown, or not the unit that the file states; or left out, and the file's unit is missing or
        not understood.
    JobError
        If `sew_mm` is no tolerance.
    CadError
        If the kernel cannot read the file, drops a part of it, crashes or takes too long; if there is no face or
        no sensible extent; or if there is no such body.
    """
    wanted = CadRequest(units, recover, body, sew_mm, turned)
    content = read_bytes(path, limits)
    refuse_foreign(path, content, "STEP", limits)
    content, noticed = _whole(path, content, recover)
    _refuse(path, content, limits)
    noticed += _other_files(path, content)
    return part_of(path, content, "STEP", wanted, limits, noticed)


def _whole(path: Path, content: bytes, recover: bool) -> tuple[bytes, tuple[Finding, ...]]:
    """Refuse a file without its end, or end it behind its last whole entity."""
    if content.rfind(_END) >= 0:
        return content, ()
    if not recover:
        missing = f"{_END.decode()} is missing at its end"
        what = f"is cut short ({missing}); copy or export it again, or repair it with --recover"
        raise FormatError(path, what, byte=len(content))
    last = content.rfind(b";") + 1
    what = f"the file is cut short; the last {len(content) - last} bytes are no whole entity, and all before is read"
    finding = Finding(Code.END_ADDED, Level.WARN, what, str(path))
    return content[:last] + b"\nENDSEC;\n" + _END + b";\n", (finding,)


def _refuse(path: Path, content: bytes, limits: Limits) -> None:
    """Raise for bytes that the kernel would hang on or misread."""
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


def _other_files(path: Path, content: bytes) -> tuple[Finding, ...]:
    """Refuse an assembly with nothing of its own in it; note other files that this one refers to."""
    found = list(_OTHER_FILE.finditer(content))
    if not found:
        return ()
    named = [match[2] or match[1] or match[3] for match in found]
    names = dict.fromkeys(printable(name.decode("utf-8", "replace"), 80) for name in named if name)
    listed = ", ".join([*list(names)[:MOST_NAMES], *(["..."] if len(names) > MOST_NAMES else [])]) or "not named"
    if not _GEOMETRY.search(content):
        what = f"is an assembly whose parts are in other files ({listed}); give the file of the part itself"
        raise FormatError(path, what, byte=found[0].start())
    level = Level.WARN if any(_CAD_FILE.search(name) for name in names) else Level.INFO
    what = f"the file refers to other files ({listed}), which are not read; give that of the part itself"
    return (Finding(Code.OTHER_FILES, level, what, str(path)),)


def _long_literal(content: bytes, longest: int) -> int | None:
    """Return where a text between quotes is longer than allowed; quotes within comments do not count."""
    if b"/*" in content:
        content = _COMMENT.sub(lambda comment: b" " * len(comment[0]), content)
    quotes = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == ord("'"))
    pairs = quotes[: len(quotes) // 2 * 2].reshape(-1, 2)
    long = pairs[pairs[:, 1] - pairs[:, 0] > longest + 1]
    return int(long[0, 0]) if len(long) else None
