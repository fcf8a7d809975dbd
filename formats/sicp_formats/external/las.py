"""LAS and LAZ scans (ASPRS LAS 1.0 to 1.4), read by the library laspy in a child process.

Coordinates are integers with a scale and an offset. The unit is not stated but for a map projection; metres are what
the format is used with.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.external.scans import answered, demand, scan_of
from sicp_formats.source import describe, read_bytes
from sicp_formats.surfaces.checks import Code

__all__ = ["read_scan"]

_SIGNATURE = b"LASF"
_HEADER_BYTES = 227
_COMPRESSED = 0x80


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scan from a LAS or LAZ file.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; metres are assumed if left out, with a finding of
        level WARN, as the format states none.
    limits
        Caps on what the file may ask for; `cad_seconds` and `child_memory_bytes` bound the library.
    recover
        Read the whole points of a LAS file that is cut short, with a finding of level WARN.

    Returns
    -------
    Scan
        Points by scale and offset in doubles, in file order; intensity, red, green, blue, classification and whatever
        else the file has of each point are columns, those left out that are 0 throughout.

    Raises
    ------
    InputError
        If laspy is not installed.
    FormatError
        If the file is cut short, declares more points than it can hold, or the library refuses it or crashes on it.
    UnitError
        If the unit is unknown.
    """
    unit = "m" if units is None else units
    factor = mm_per_unit(unit)
    demand(path, "laspy", "las")
    content = read_bytes(path, limits)
    declared, present, kind = _check_head(path, content, limits, recover)
    result = answered(path, content, "sicp_formats.external.las_child", "laspy", limits, {"points": present})
    if len(result.arrays["points"]) != present:
        what = (
            f"{present} points should be there, {len(result.arrays['points'])} are; the file is damaged; copy it again"
        )
        raise FormatError(path, what, byte=len(content))
    source = describe(path, content, format=kind, unit=unit, unit_stated=units is not None)
    scan = scan_of(path, result, source, factor, limits, recover)
    findings = scan.findings
    if present != declared:
        message = f"the header declares {declared} points, the {present} that are present were read"
        findings += (Finding(Code.ROWS_MISSING, Level.WARN, message, f"{path}, byte {len(content)}"),)
    if units is None:
        message = f"{kind} files state no unit; metres were assumed, as is the custom; state the unit of the scan"
        findings += (Finding(Code.UNIT_BY_CONVENTION_M, Level.WARN, message, str(path)),)
    return replace(scan, findings=findings)


def _check_head(path: Path, content: bytes, limits: Limits, recover: bool) -> tuple[int, int, str]:
    """Return how many points are declared and how many can be there, and the kind of file; refuse what cannot be."""
    if not content.startswith(_SIGNATURE):
        raise FormatError(path, "is no LAS or LAZ file (LASF are not its first letters); export it again", byte=0)
    if len(content) < _HEADER_BYTES:
        what = f"has {len(content)} bytes, fewer than the {_HEADER_BYTES} of the header; it is cut short"
        raise FormatError(path, what, byte=len(content))
    start, size = int.from_bytes(content[96:100], "little"), int.from_bytes(content[105:107], "little")
    count = int.from_bytes(content[107:111], "little")
    if content[25] >= 4 and len(content) >= 255:
        count = count or int.from_bytes(content[247:255], "little")
    compressed = bool(content[104] & _COMPRESSED)
    if count == 0:
        raise FormatError(path, "no points; export the scan again", byte=107)
    if count > limits.points:
        raise FormatError(path, f"{count} points are more than the limit points = {limits.points}; raise it", byte=107)
    left = max(0, len(content) - start)
    if not compressed and recover and left >= size > 0:
        return count, min(count, left // size), "LAS"
    if count * size > left * (limits.archive_ratio if compressed else 1):
        what = f"the header declares {count} points x {size} B = {count * size} B, {left} B present; it is cut short"
        raise FormatError(path, what + "; or repair it with --recover" * (not compressed), byte=107)
    return count, count, "LAZ" if compressed else "LAS"
