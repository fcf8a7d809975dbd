"""Read IGES files: exact contours of the skins, and a mesh for pictures.

An IGES file has lines of 80 columns in five sections, S G D P T; the last line states how many lines each has, so that
a file which is cut short, or has lost or gained a line, is refused before the CAD kernel reads it.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Part
from sicp_formats.cad.part import SEW_MM, CadRequest, part_of, refuse_foreign
from sicp_formats.source import read_bytes

__all__ = ["read_part"]

_ORDER = b"SGDPT"
_COUNTS = re.compile(rb"S([ \d]{7})G([ \d]{7})D([ \d]{7})P([ \d]{7})")
_NUMBER_COLUMN = 72


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
    """Read the contours of an IGES file, in mm; as `sicp_formats.cad.step.read_part` reads the same shape.

    Trimmed surfaces stand alone in most IGES files and are sewn, see `sew_mm`.

    Parameters
    ----------
    path
        The file, in the text form of 80 columns.
    units
        The unit of a file that states none, or two that differ; the file's own unit is an error to contradict.
    limits
        `cad_seconds` and `child_memory_bytes` bound the CAD kernel.
    recover
        True to heal invalid shapes, and to leave out what cannot be read. Each kind is a finding.
    body
        Number of the only body that is wanted; all if left out.
    sew_mm
        Loose faces that are no further apart are sewn, in mm; 0 to leave them as they are.
    turned
        True if the outward side of bodies without volume is the other one.

    Raises
    ------
    FormatError
        If the bytes are not a whole IGES file.
    UnitError
        If `units` is unknown, or not the unit that the file states; or left out, and the file states none that can
        be read, or two that differ.
    JobError
        If `sew_mm` is no tolerance.
    CadError
        If the kernel cannot read the file, drops a part of it, crashes or takes too long; if there is no face or
        no sensible extent; or if there is no such body.
    """
    wanted = CadRequest(units, recover, body, sew_mm, turned)
    content = read_bytes(path, limits)
    refuse_foreign(path, content, "IGES", limits)
    _refuse(path, content)
    return part_of(path, content, "IGES", wanted, limits)


def _refuse(path: Path, content: bytes) -> None:
    """Raise for lines of no section, in a wrong order, or not as many as the last one states."""
    counts: Counter[int] = Counter()
    last = line = b""
    for number, line in enumerate(content.splitlines(), start=1):
        if not line.strip(b" \x00\x1a"):
            continue
        section = line[_NUMBER_COLUMN : _NUMBER_COLUMN + 1]
        if not section or section not in _ORDER or (last and _ORDER.index(section) < _ORDER.index(last)):
            what = "column 73 names no section, or one that is over (S G D P T); the file is damaged, export it again"
            raise FormatError(path, what, line=number)
        counts[section[0]] += 1
        terminate, last = line, section
        if last == b"T":
            break
    if last != b"T":
        raise FormatError(path, "is cut short (no T section ends it); copy or export it again", byte=len(content))
    stated = _COUNTS.match(terminate)
    if stated is None or any(b" " in (digits.strip() or b" ") for digits in stated.groups()):
        raise FormatError(path, "the T section states no numbers of lines; export it again", line=number)
    for section_byte, digits in zip(_ORDER, stated.groups(), strict=False):
        if int(digits) != counts[section_byte]:
            what = f"section {chr(section_byte)} has {counts[section_byte]} lines, and should have {int(digits)}"
            raise FormatError(path, f"{what}; lines are missing or doubled, export it again", line=number)
