"""The correction in memory: choose the contours, register them, carry the path. No files here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sicp_cam.contour.choice import Assignment, assign
from sicp_cam.contour.frames import framed
from sicp_cam.contour.mesh_contours import mesh_contours
from sicp_cam.errors import InputError, JobError, PathError, UnitError
from sicp_cam.model import Contour, FloatArray, Part, Scan, ToolPath
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.result import Registration
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings
from sicp_cam.toolpath.transfer import CorrectedPath, correct_path
from sicp_cam.units import MM_PER_UNIT

__all__ = ["PartRegistration", "check_scan_unit", "choose_contours", "contours_of", "register"]


@dataclass(frozen=True, slots=True, eq=False)
class PartRegistration:
    """A part registered to a scan, ready to correct paths.

    Parameters
    ----------
    result
        The registration: pose, corrected contours, and what was measured.
    toolpath, gates
        Settings that `apply` uses.
    """

    result: Registration
    toolpath: ToolPathSettings = field(default_factory=ToolPathSettings)
    gates: GateLimits = field(default_factory=GateLimits)

    def assignment(self, path: ToolPath) -> Assignment:
        """Return which registered contour each move of a path in the part frame follows."""
        curves = [contour.nominal for contour in self.result.contours]
        return assign(path.tips_mm, path.axes, ~path.rapid, curves, self.gates.path_distance_mm)

    def apply(self, path: ToolPath) -> CorrectedPath:
        """Return a path in the part frame corrected to the scan; nothing is judged and nothing is written."""
        assignment = self.assignment(path)
        return correct_path(
            path,
            assignment,
            self.result.contours,
            self.result.T_scan_part,
            self.toolpath,
            self.gates.path_distance_mm,
        )


def contours_of(part: Part) -> tuple[Contour, ...]:
    """Return the contours of a part; for triangles only, the loops along which the mesh is open.

    Raises
    ------
    InputError
        If the part has no edge that a path could follow.
    """
    contours = part.contours or mesh_contours(part.mesh)
    if not contours:
        name = part.source.path if part.source else "part"
        raise InputError(
            f"{name}: the mesh is closed, so it has no open edge; give a STEP file, or only the skin that is machined"
        )
    return contours


def choose_contours(
    contours: Sequence[Contour], path: ToolPath | None, wanted: Sequence[int] | None, path_distance_mm: float
) -> dict[int, Contour]:
    """Return the contours to be registered, by their number from 1.

    Parameters
    ----------
    contours
        All contours of the part.
    path
        The path; its feed moves and tool axes choose where `wanted` is None.
    wanted
        Numbers that the operator gave.
    path_distance_mm
        Largest median distance of the feed moves from the contours they follow.

    Raises
    ------
    JobError
        If a number does not exist, or there is neither a path nor a number.
    PathError
        If the path lies nowhere near a contour.
    """
    if wanted is not None:
        missing = [number for number in wanted if not 1 <= number <= len(contours)]
        if missing:
            raise JobError(f"contour: the part has no contour {missing[0]}; it has 1 to {len(contours)}")
        return {number: contours[number - 1] for number in wanted}
    if path is None:
        raise JobError("contour: give a path, or the numbers of the contours; see sicp-cam inspect")
    feed = ~path.rapid
    if not feed.any():
        raise PathError("the path has rapid moves only; there is nothing to correct")
    curves = [framed(contour) for contour in contours]
    found = assign(path.tips_mm, path.axes, feed, curves, path_distance_mm)
    distance = float(np.median(found.distance_mm[feed]))
    if distance > path_distance_mm:
        raise PathError(
            f"the path lies {distance:.1f} mm from the nearest contour of the part (limit {path_distance_mm:g} mm);"
            " check --path-units, and that path and part have one frame, or raise gates.path_distance_mm"
        )
    return {number + 1: contours[number] for number in found.used}


def check_scan_unit(scan: Scan, part: Part, contours: Mapping[int, Contour]) -> None:
    """Refuse a scan whose size only makes sense in another unit.

    A scan of the contour is no smaller than most of the contour and no larger than the part; where the file states no
    unit and millimetres put it outside of that, but another unit inside, it is in that unit.

    Raises
    ------
    UnitError
        Naming the likely unit.
    """
    if scan.source is None or scan.source.unit_stated:
        return
    size = _diagonal(scan.points_mm)
    least = 0.5 * max(_diagonal(contour.points_mm) for contour in contours.values())
    most = 1.5 * max(_diagonal(part.mesh.vertices_mm), 2.0 * least)
    if least <= size <= most:
        return
    for unit, factor in MM_PER_UNIT.items():
        if unit != "mm" and least <= size * factor <= most:
            raise UnitError(
                f"{scan.source.path}: {size:.4g} mm across, where the part has {most / 1.5:.4g} mm;"
                f" it seems to be in {unit}: give --scan-units {unit}, or --scan-units mm if it is not"
            )


def _diagonal(points_mm: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(points_mm, axis=0))) if len(points_mm) else 0.0


def register(
    part: Part,
    scan: Scan,
    *,
    path: ToolPath | None = None,
    method: str = "sicp",
    align: FloatArray | None = None,
    contours: Sequence[int] | None = None,
    settings: RegistrationSettings | None = None,
    toolpath: ToolPathSettings | None = None,
    gates: GateLimits | None = None,
) -> PartRegistration:
    """Register a part to a scan.

    Parameters
    ----------
    part, scan
        What to register.
    path
        Chooses the contours: those that it follows.
    method
        `sicp`, `rigid` or `paper`.
    align
        (4, 4) rough T_scan_part in mm; None finds it from the geometry.
    contours
        Numbers of the contours, from 1, instead of a path.
    settings, toolpath, gates
        Defaults where None.

    Raises
    ------
    JobError, InputError, PathError
        If no contour can be chosen.
    RegistrationError
        If the scan cannot be registered with any confidence.
    """
    gates = gates or GateLimits()
    chosen = choose_contours(contours_of(part), path, contours, gates.path_distance_mm)
    check_scan_unit(scan, part, chosen)
    result = register_contours(chosen, scan, align, method=method, settings=settings)
    return PartRegistration(result, toolpath or ToolPathSettings(), gates)
