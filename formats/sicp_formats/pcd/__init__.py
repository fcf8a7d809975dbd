"""PCD scans, the files of the Point Cloud Library: text, binary and compressed, versions 0.5 to 0.7; and the writer.

The format states no unit of length; the writer states it in a comment, `# unit mm`, which the reader follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.pcd.body import read_rows
from sicp_formats.pcd.header import PADDING, Header, parse_header
from sicp_formats.pcd.writer import write_scan
from sicp_formats.source import describe, read_bytes
from sicp_formats.surfaces.checks import Code, check_registrable, coarse_singles, origin_points
from sicp_formats.surfaces.ending import without_cut_line
from sicp_formats.surfaces.point_rows import OR_REPAIR, PointNames, point_names, point_rows
from sicp_formats.surfaces.unit import chosen_unit

__all__ = ["read_scan", "write_scan"]

_PACKED = {"rgb": ("red", "green", "blue"), "rgba": ("red", "green", "blue", "alpha")}
_SHIFTS = {"red": 16, "green": 8, "blue": 0, "alpha": 24}


def read_scan(path: Path, *, units: str | None = None, limits: Limits = DEFAULT_LIMITS, recover: bool = False) -> Scan:
    """Read a scan from a PCD file.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of a comment such as
        `# unit mm`, or else millimetres.
    limits
        Caps on what the file may ask for.
    recover
        True to drop points that are not finite and what is missing of a file that is cut short, and to ignore normals
        in part. Each is a finding.

    Returns
    -------
    Scan
        Points in file order; normals where the file has normal_x, normal_y, normal_z; all further fields of one value
        as columns, the packed colours `rgb` and `rgba` as red, green, blue and alpha. In an organised cloud, points
        that are no number are rays without return and are left out. The coordinates are those of the file, wherever
        the sensor stood.

    Raises
    ------
    FormatError
        If the file breaks its format, ends early, holds numbers that are not finite, or cannot register; the message
        names the line or byte.
    UnitError
        If the unit is unknown, or not the one that the file states.
    """
    mm_per_unit("mm" if units is None else units)
    content = read_bytes(path, limits)
    header = parse_header(path, content, limits)
    unit, stated, findings = chosen_unit(path, header.unit, units)
    mm = mm_per_unit(unit)
    findings += _said_of_sensor(path, header)
    names, found = _names(path, header, limits, len(content), recover=recover)
    findings += found
    kept = content
    if header.encoding == "ascii":
        kept, found = without_cut_line(path, content, recover=recover, begin=header.body_byte)
        findings += found
    values, place, found = read_rows(path, kept, header, limits, recover=recover)
    findings += found
    scalars = _with_colours(values)
    names = _unpacked_names(names, scalars)
    organised = header.height > 1
    rows, found = point_rows(path, scalars, names, place, mm, limits, recover=recover, no_return=organised)
    findings += found
    check_registrable(path, rows.points_mm)
    if any(each.name in names.xyz and each.code == "f4" for each in header.fields) and header.encoding != "ascii":
        findings += coarse_singles(path, np.array([[rows.low_mm, rows.high_mm]]), mm)
    findings += origin_points(path, rows.points_mm)
    source = describe(path, content, format=f"PCD {header.encoding}", unit=unit, unit_stated=stated)
    return Scan(rows.points_mm, rows.normals, None, source, findings, rows.columns)


def _names(
    path: Path, header: Header, limits: Limits, file_bytes: int, *, recover: bool
) -> tuple[PointNames, tuple[Finding, ...]]:
    """Return which fields are what, after checking that there are points, and no more than the limits allow."""
    line = header.lines["FIELDS"]
    names = point_names([each.name for each in header.fields if each.count == 1 and each.name != PADDING])
    missing = [axis for axis, name in zip("xyz", names.xyz, strict=True) if name is None]
    if missing:
        raise FormatError(path, f"no {' and no '.join(missing)} among the fields", line=line)
    count_line = header.lines.get("POINTS", header.lines.get("WIDTH", line))
    if header.points == 0:
        raise FormatError(path, "no points; export the scan again", line=count_line)
    if limits.points < header.points <= file_bytes:
        what = f"declares {header.points} points, more than the limit points = {limits.points}"
        raise FormatError(path, what, line=count_line)
    findings = []
    some = [name for name in names.normal if name is not None]
    if len(some) in (1, 2):
        if not recover:
            what = f"the normals have only {', '.join(some)}; export all or none{OR_REPAIR}"
            raise FormatError(path, what, line=line)
        message = f"the normals have only {', '.join(some)} and were ignored"
        findings.append(Finding(Code.NORMALS_DROPPED, Level.WARN, message, f"{path}, line {line}"))
        names = PointNames(names.xyz, (None, None, None), names.further)
    if several := [each.name for each in header.fields if each.count > 1 and each.name != PADDING]:
        message = f"fields of several values not used: {', '.join(several)}"
        findings.append(Finding(Code.COLUMNS_NOT_USED, Level.INFO, message, f"{path}, line {line}"))
    return names, tuple(findings)


def _said_of_sensor(path: Path, header: Header) -> tuple[Finding, ...]:
    if header.sensor[:3] == (0.0, 0.0, 0.0) and header.sensor[4:] == (0.0, 0.0, 0.0):
        return ()
    shown = " ".join(f"{value:g}" for value in header.sensor)
    message = f"the pose of the sensor, {shown}, was not applied: the points are taken as they stand in the file"
    where = f"{path}, line {header.lines['VIEWPOINT']}"
    return (Finding(Code.SENSOR_POSE_NOT_APPLIED, Level.INFO, message, where),)


def _with_colours(values: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Put the parts of packed colours beside the fields; a float holds the four bytes of an integer."""
    found = dict(values)
    for name in _PACKED.keys() & values.keys():
        packed = values[name]
        if packed.dtype.itemsize != 4:
            continue
        bits = packed.view(packed.dtype.str[0] + "u4")
        for part in _PACKED[name]:
            found.setdefault(part, ((bits >> _SHIFTS[part]) & 255).astype(np.uint8))
    return found


def _unpacked_names(names: PointNames, scalars: Mapping[str, npt.NDArray[Any]]) -> PointNames:
    further: list[str] = []
    for name in names.further:
        packed = name in _PACKED and scalars[name].dtype.itemsize == 4
        further += [part for part in (_PACKED[name] if packed else (name,)) if part not in further]
    return PointNames(names.xyz, names.normal, tuple(further))
