"""Read BRep files, the CAD kernel's own text format: exact contours of the skins, and a mesh for pictures."""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Part
from sicp_formats.cad.part import SEW_MM, CadRequest, part_of, refuse_foreign
from sicp_formats.source import read_bytes

__all__ = ["read_part"]

_SECTIONS = (
    b"Locations",
    b"Curve2ds",
    b"Curves",
    b"Polygon3D",
    b"PolygonOnTriangulations",
    b"Surfaces",
    b"Triangulations",
    b"TShapes",
)
_SECTION = re.compile(rb"^(" + rb"|".join(_SECTIONS) + rb")[ \t]+(\d{1,18})[ \t]*\r?$", re.MULTILINE)
_END = re.compile(rb"\*\s+[+-]\d+ \d+\s*(?:0\s*)?\Z")
"""The last entity ends with a star; the number of the shape itself stands behind it."""
_LONG = 400


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
    """Read the contours of a BRep file, in mm; they are what `sicp_formats.cad.step.read_part` makes of the same shape.

    Parameters
    ----------
    path
        The file, in the text form.
    units
        Unit of its numbers, of which the file says nothing; mm if left out.
    limits
        `cad_seconds` and `child_memory_bytes` bound the CAD kernel.
    recover
        True to heal invalid shapes, and to leave out contours that are off their surface. Each kind is a finding.
    body
        Number of the only body that is wanted; all if left out.
    sew_mm
        Loose faces that are no further apart are sewn, in mm; 0 to leave them as they are.
    turned
        True if the outward side of bodies without volume is the other one.

    Raises
    ------
    FormatError
        If the bytes are not a whole BRep file.
    UnitError
        If `units` is unknown.
    JobError
        If `sew_mm` is no tolerance.
    CadError
        If the kernel cannot read the file, crashes or takes too long; if there is no face or no sensible extent; or
        if there is no such body.
    """
    wanted = CadRequest(units, recover, body, sew_mm, turned)
    content = read_bytes(path, limits)
    refuse_foreign(path, content, "BREP", limits)
    _refuse(path, content)
    return part_of(path, content, "BREP", wanted, limits)


def _refuse(path: Path, content: bytes) -> None:
    """Raise for a file that is not whole: the kernel would never end, or read past the damage."""
    found = list(_SECTION.finditer(content))
    names = [match[1] for match in found]
    if tuple(names) != _SECTIONS:
        at = next((i for i, (a, b) in enumerate(zip(names, _SECTIONS, strict=False)) if a != b), len(names))
        missing = _SECTIONS[min(at, len(_SECTIONS) - 1)].decode()
        byte = found[at].start() if at < len(found) else len(content)
        raise FormatError(path, f"has no section {missing} where it should be; it is cut short, or damaged", byte=byte)
    for match, after in zip(found, [*found[1:], None], strict=True):
        room = (after.start() if after else len(content)) - match.end()
        if int(match[2]) > room:
            what = f"states {int(match[2])} {match[1].decode()}, in {room} bytes; it is damaged, export it again"
            raise FormatError(path, what, byte=match.start())
    if not _END.search(content[-_LONG:]):
        raise FormatError(path, "is cut short (no shape ends it); copy or export it again", byte=len(content))
