"""Have the CAD kernel read a file in a child process (`sicp_formats.cad.child`), and make a part of its answer.

The kernel hangs, crashes or prints on strange files; here it can do so without harm. What a look at the bytes can
refuse is refused by the readers of STEP, IGES and BRep, before the kernel is started.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from sicp_cam import child_process
from sicp_cam.errors import CadError, FormatError, JobError, UnitError, printable
from sicp_cam.findings import Finding
from sicp_cam.limits import Limits
from sicp_cam.model import Contour, Part, TriangleMesh
from sicp_cam.units import mm_per_unit
from sicp_formats.cad.notes import as_findings
from sicp_formats.source import describe

__all__ = ["SEW_MM", "CadRequest", "part_of", "refuse_foreign"]

SEW_MM = 0.05
LARGEST_SEW_MM = 1.0
_SIGNS = {
    "STEP": (".step", "ISO-10303-21 is not its first word"),
    "IGES": (".igs", "no S section comes first"),
    "BREP": (".brep", "'CASCADE Topology' does not come first"),
}
_KINDS = (
    (re.compile(rb"(?:\xef\xbb\xbf)?(?:\s|/\*.{0,4000}?\*/)*ISO-10303-21\s*;", re.DOTALL), "a STEP file", ".step"),
    (re.compile(rb"[^\r\n]{72}S {0,6}0*1\s*[\r\n]"), "an IGES file", ".igs"),
    (re.compile(rb"\s*(?:DBRep_DrawableShape|CASCADE Topology)"), "an OpenCASCADE BRep file", ".brep"),
    (re.compile(rb"solid\s|\s*facet\s"), "an STL file", ".stl"),
    (re.compile(rb"ply\s"), "a PLY file", ".ply"),
    (re.compile(rb"[^\r\n]{72}[BC] {0,6}0*1\s*[\r\n]"), "an IGES file in its binary or compressed form", ""),
    (re.compile(rb"\s*Open CASCADE Topology"), "a binary BRep file", ""),
    (re.compile(rb"AC10\d\d"), "a DWG drawing", ""),
    (re.compile(rb"ISO-10303-28|<\?xml"), "an XML file", ""),
)
_OUT_OF_MEMORY = re.compile(r"MemoryError|bad_alloc|OutOfMemory|failed to map segment|[Cc]annot allocate memory")


@dataclass(frozen=True, slots=True)
class CadRequest:
    """What the user asks of the CAD kernel; the readers tell what each means.

    Raises
    ------
    UnitError
        If the unit is unknown.
    JobError
        If `sew_mm` is no tolerance.
    """

    units: str | None
    recover: bool
    body: str | None
    sew_mm: float
    turned: bool

    def __post_init__(self) -> None:
        if self.units is not None:
            mm_per_unit(self.units)
        if not 0.0 <= self.sew_mm <= LARGEST_SEW_MM:
            raise JobError(f"sew_mm = {self.sew_mm:g} must lie between 0 (do not sew) and {LARGEST_SEW_MM:g} mm")


def refuse_foreign(path: Path, content: bytes, format: str, limits: Limits) -> None:
    """Raise for bytes that begin like those of another format, and name its suffix.

    Parameters
    ----------
    path, content
        The file.
    format
        `STEP`, `IGES` or `BREP`, which the file should be.
    limits
        Bounds how far ahead the first word is looked for.
    """
    suffix, sign = _SIGNS[format]
    start = content[: limits.line_bytes]
    kind, other = next(((kind, other) for pattern, kind, other in _KINDS if pattern.match(start)), (None, ""))
    if other == suffix:
        return
    remedy = f"name it {other}" if other else f"export the part as {format}"
    raise FormatError(path, f"is {kind or f'no {format} file'} ({sign}); {remedy}", byte=0)


def part_of(
    path: Path, content: bytes, format: str, wanted: CadRequest, limits: Limits, noticed: tuple[Finding, ...] = ()
) -> Part:
    """Have the kernel read the bytes of a file.

    Parameters
    ----------
    path
        The file, for messages and the source.
    content
        What the kernel gets to see.
    format
        `STEP`, `IGES` or `BREP`.
    wanted
        What the user asks for.
    limits
        `cad_seconds` and `child_memory_bytes` bound the kernel.
    noticed
        What was found before; stands first.

    Raises
    ------
    UnitError, CadError
        As the kernel's side says, or if it crashes, or takes too long or too much.
    """
    request = {
        "format": format,
        "units": wanted.units,
        "coordinate_mm": limits.coordinate_mm,
        "recover": wanted.recover,
        "body": wanted.body,
        "sew_mm": wanted.sew_mm,
        "turned": wanted.turned,
    }
    try:
        result = child_process.run(
            "sicp_formats.cad.child",
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
        _refuse_crash(path, str(crash), limits)
    return _part(path, content, format, result, noticed)


def _name(path: Path) -> str:
    return printable(str(path))


def _refuse_crash(path: Path, how: str, limits: Limits) -> NoReturn:
    """Raise for a child that died; what the memory limit did is not the fault of the file."""
    cap = f"child_memory_bytes = {limits.child_memory_bytes}"
    if _OUT_OF_MEMORY.search(how):
        raise CadError(f"{_name(path)}: the CAD kernel needs more than {cap}; raise limits.child_memory_bytes")
    raise CadError(
        f"{_name(path)}: the CAD kernel crashed on it, {how}; export the file again, or raise"
        f" limits.child_memory_bytes ({limits.child_memory_bytes}) if the part is very large"
    ) from None


def _part(
    path: Path, content: bytes, format: str, result: child_process.ChildResult, noticed: tuple[Finding, ...]
) -> Part:
    values, arrays = result.values, result.arrays
    if "error" in values:
        error = UnitError if values["error"] == "UnitError" else CadError
        raise error(f"{_name(path)}: {printable(values['message'], 1000)}")
    source = describe(path, content, format=format, unit=values["unit"], unit_stated=values["unit_stated"])
    mesh = TriangleMesh(arrays["vertices"], arrays["triangles"], arrays["vertex_normals"])
    return Part(_contours(arrays), mesh, source, noticed + as_findings(values["notes"], str(path)))


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
