"""E57 scans (ASTM E2807), read by the library pye57 in a child process.

The format is in metres by its standard. All scans of a file are brought into one frame by their poses.
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import FormatError, UnitError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.external.scans import answered, demand, scan_of
from sicp_formats.source import describe, read_bytes

__all__ = ["read_scan"]

_SIGNATURE = b"ASTM-E57"
_HEADER_BYTES = 48


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read all scans of an E57 file as one.

    Parameters
    ----------
    path
        The file.
    units
        Metres, or left out: the standard says so.
    limits
        Caps on what the file may ask for; `cad_seconds` and `child_memory_bytes` bound the library.
    recover
        Drop points that are not finite, with a finding of level WARN.

    Returns
    -------
    Scan
        Points of all scans, each at its pose; cartesian or spherical. Points that are marked as invalid are dropped
        and counted in a finding. Normals where all scans have them. Intensity, colours (red, green, blue) and whatever
        else all scans have of each point are columns.

    Raises
    ------
    InputError
        If pye57 is not installed.
    FormatError
        If the file is cut short, declares more points than it can hold, or the library refuses it or crashes on it.
    UnitError
        If another unit than metres is stated.
    """
    if units is not None:
        mm_per_unit(units)
        if units != "m":
            raise UnitError(f"{printable(str(path))}: E57 files are in m by their standard, not {units}; drop the unit")
    demand(path, "pye57", "e57")
    content = read_bytes(path, limits)
    _check_head(path, content)
    result = answered(path, content, "sicp_formats.external.e57_child", "pye57", limits, {"points": limits.points})
    source = describe(path, content, format="E57", unit="m", unit_stated=True)
    return scan_of(path, result, source, mm_per_unit("m"), limits, recover)


def _check_head(path: Path, content: bytes) -> None:
    """Refuse what the library need not be asked about."""
    if not content.startswith(_SIGNATURE):
        raise FormatError(path, "is no E57 file (ASTM-E57 are not its first letters); export it again", byte=0)
    if len(content) < _HEADER_BYTES:
        what = f"has {len(content)} bytes, fewer than the {_HEADER_BYTES} of the header; it is cut short"
        raise FormatError(path, what, byte=len(content))
    declared = int.from_bytes(content[16:24], "little")
    if declared != len(content):
        what = f"the header declares {declared} B, {len(content)} B present; it is cut short or damaged; copy it again"
        raise FormatError(path, what, byte=16)
