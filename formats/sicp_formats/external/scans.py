"""Scans that a library reads, in a child process that may hang, crash or ask for all memory.

The child (`e57_child`, `las_child`) answers with points in metres, normals, columns and findings, or with one line of
what is wrong.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam import child_process
from sicp_cam.errors import FormatError, InputError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, Scan, Source
from sicp_formats.source import plain_file
from sicp_formats.surfaces.checks import Code, check_coordinates, check_registrable, origin_points, unit_normals

__all__ = ["answered", "demand", "packed", "scan_of"]

_ANSWER = tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]


def demand(path: Path, library: str, extra: str) -> None:
    """Refuse a file whose library is not installed, before anything is read.

    Raises
    ------
    InputError
        Naming the extra to install.
    """
    if importlib.util.find_spec(library) is None:
        raise InputError(f"{printable(str(path))}: needs the library {library}; install sicp-cam[{extra}]")


def packed(
    points: FloatArray,
    normals: FloatArray | None,
    columns: Mapping[str, FloatArray],
    notes: Sequence[tuple[int, str, str]],
) -> _ANSWER:
    """Return a child's answer: what it read, and (code, level, message) of what it noticed."""
    arrays = {f"column_{i}": values for i, values in enumerate(columns.values())} | {"points": points}
    if normals is not None:
        arrays["normals"] = normals
    return {"columns": list(columns), "notes": [list(note) for note in notes]}, arrays


def answered(
    path: Path, content: bytes, module: str, library: str, limits: Limits, told: Mapping[str, Any]
) -> child_process.ChildResult:
    """Let a child read the file.

    Parameters
    ----------
    path, content
        The file, and its bytes unpacked.
    module, library
        The child's module, and what it calls.
    limits
        `cad_seconds` and `child_memory_bytes` bound the child.
    told
        What the child must know besides the path.

    Raises
    ------
    FormatError
        If the child says what is wrong, crashes or takes too long.
    """
    with plain_file(path, content) as plain:
        request = {"path": str(plain.resolve()), **told}
        try:
            result = child_process.run(
                module, request, timeout_s=limits.cad_seconds, memory_bytes=limits.child_memory_bytes
            )
        except child_process.ChildTimeoutError:
            what = (
                f"{library} took longer than cad_seconds = {limits.cad_seconds:g}; it is damaged, or raise that limit"
            )
            raise FormatError(path, what) from None
        except child_process.ChildCrashError as crash:
            raise FormatError(path, f"{library} crashed on it, {crash}; the file is damaged; export it again") from None
    if "error" in result.values:
        raise FormatError(path, result.values["error"])
    return result


def scan_of(
    path: Path, result: child_process.ChildResult, source: Source, factor: float, limits: Limits, recover: bool
) -> Scan:
    """Return the scan that a child answered with, in mm, after the checks that every scan must pass.

    Raises
    ------
    FormatError
        If a point is not finite (dropped with a finding if `recover`) or beyond the limit, or the points cannot
        register.
    """
    arrays, values = result.arrays, result.values
    findings = tuple(Finding(code, Level(level), text, str(path)) for code, level, text in values["notes"])
    points, normals = arrays["points"], arrays.get("normals")
    columns = {name: arrays[f"column_{i}"] for i, name in enumerate(values["columns"])}
    finite = np.isfinite(points.sum(axis=1))
    if normals is not None:
        finite &= np.isfinite(normals.sum(axis=1))
    if not finite.all():
        count, first = int((~finite).sum()), int(np.argmin(finite))
        if not recover:
            what = f"{count} points are not finite, point {first} first; export it again, or repair it with --recover"
            raise FormatError(path, what)
        message = f"{count} of {len(finite)} points are not finite and were dropped"
        findings += (Finding(Code.POINTS_DROPPED, Level.WARN, message, f"{path}, point {first}"),)
        points, normals = points[finite], None if normals is None else normals[finite]
        columns = {name: column[finite] for name, column in columns.items()}
    with np.errstate(over="ignore"):  # the check of the coordinates tells
        points = points * factor
    check_coordinates(path, points, lambda row: {}, limits)
    if normals is not None:
        normals, found = unit_normals(path, normals, lambda row: {})
        findings += found
    check_registrable(path, points)
    findings += origin_points(path, points)
    for array in (points, *columns.values()):
        array.setflags(write=False)
    return Scan(points, normals, None, source, findings, columns)
