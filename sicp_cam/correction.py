"""The correction in memory: choose the contours, register them, carry the path."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sicp_cam.alignment import read_alignment
from sicp_cam.contour.choice import Assignment, assign
from sicp_cam.contour.frames import at, framed
from sicp_cam.contour.mesh_contours import mesh_contours
from sicp_cam.contour.projection import nearest
from sicp_cam.errors import InputError, JobError, PathError, RegistrationError, UnitError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, Contour, FloatArray, Part, Scan, Source, ToolPath
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.result import Registration
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.registration.start import congruent
from sicp_cam.rigid_motion import apply, is_rigid
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings
from sicp_cam.toolpath.steps import Steps, divided, feed_steps
from sicp_cam.toolpath.transfer import CorrectedPath, correct_path
from sicp_cam.units import MM_PER_UNIT

__all__ = [
    "PartRegistration",
    "check_units",
    "choice_findings",
    "choose_contours",
    "contours_of",
    "refuse_twins",
    "register",
    "unit_taken",
]

STEP_MM = 2.0
CLEARLY_WORSE = 0.3
"""Logarithm of a size ratio by which a unit must fit worse than the best one not to be named."""
INTO_THE_PART = -0.2
"""Cosine of tool axis and outward normal below which a tool would come through the skin."""
TWIN_SHARE, TWIN_WAY = 0.1, 0.4
"""Distance of two contours of one shape, over their diagonal, beyond which they are two places of the part, and how far
over that distance a start pose may be off."""
OTHER_SKIN_MM = 1.0
"""How much nearer another contour must be to be worth a warning."""


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

    def followed(self, path: ToolPath) -> tuple[Steps, Assignment]:
        """Return the moves of a path in the part frame as steps, and which registered contour each step follows."""
        steps = divided(path, feed_steps(path, self.toolpath.step_mm))
        curves = [contour.nominal for contour in self.result.contours]
        feed = ~path.rapid[steps.source]
        return steps, assign(steps.tips_mm, steps.axes, feed, curves, self.gates.path_distance_mm)

    def apply(self, path: ToolPath) -> CorrectedPath:
        """Return a path in the part frame corrected to the scan; nothing is judged and nothing is written."""
        steps, assignment = self.followed(path)
        T_scan_part, limit = self.result.T_scan_part, self.gates.path_distance_mm
        return correct_path(path, steps, assignment, self.result.contours, T_scan_part, self.toolpath, limit)


def contours_of(part: Part) -> tuple[Contour, ...]:
    """Return the contours of a part; for triangles only, the loops along which the mesh is open or has sharp edges.

    Raises
    ------
    InputError
        If the part has no edge that a path could follow.
    """
    contours = part.contours or mesh_contours(part.mesh)
    if not contours:
        name = part.source.path if part.source else "part"
        raise InputError(
            f"{name}: the mesh is closed and smooth, so it has no open edge and no sharp one; give a STEP file,"
            " or only the skin that is machined"
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
        Largest median distance of the feed travel from the contours it follows.

    Raises
    ------
    JobError
        If a number does not exist, or there is neither a path nor a number.
    PathError
        If the path lies nowhere near a contour, or cuts along one that is not among the wanted ones.
    """
    if wanted is not None:
        missing = [number for number in wanted if not 1 <= number <= len(contours)]
        if missing:
            raise JobError(f"contour: the part has no contour {missing[0]}; it has 1 to {len(contours)}")
        chosen = {number: contours[number - 1] for number in wanted}
        if path is not None:
            _refuse_unfollowed(contours, chosen, path, path_distance_mm)
        return chosen
    if path is None:
        raise JobError("contour: give a path, or the numbers of the contours; see sicp-cam inspect")
    steps, feed = _feed(path)
    found = _assigned(contours, steps, feed, path_distance_mm)
    distance = float(np.median(found.distance_mm[feed]))
    if distance > path_distance_mm:
        raise PathError(
            f"the path lies {distance:.1f} mm from the nearest contour of the part (limit {path_distance_mm:g} mm);"
            " check --path-units, and that path and part have one frame, or raise gates.path_distance_mm"
        )
    return {number + 1: contours[number] for number in found.used}


def _feed(path: ToolPath) -> tuple[Steps, BoolArray]:
    if path.rapid.all():
        raise PathError("the path has rapid moves only; there is nothing to correct")
    steps = divided(path, feed_steps(path, STEP_MM))
    return steps, ~path.rapid[steps.source]


def _assigned(contours: Sequence[Contour], steps: Steps, feed: BoolArray, path_distance_mm: float) -> Assignment:
    curves = [framed(contour) for contour in contours]
    narrow = [not len(contour.ring_points_mm) for contour in contours]
    return assign(steps.tips_mm, steps.axes, feed, curves, path_distance_mm, narrow)


def _refuse_unfollowed(
    contours: Sequence[Contour], chosen: Mapping[int, Contour], path: ToolPath, path_distance_mm: float
) -> None:
    """Refuse a choice of contours that leaves feed moves without theirs: they would only be carried rigidly."""
    steps, feed = _feed(path)
    best = _assigned(contours, steps, feed, path_distance_mm)
    near = [nearest(steps.tips_mm, framed(contour))[1] for contour in chosen.values()]
    further = np.min(near, axis=0) - best.distance_mm
    lost = feed & (best.distance_mm <= path_distance_mm) & (further > path_distance_mm)
    if lost.any():
        number = int(best.contour[lost][0]) + 1
        line = int(path.lines[steps.source[lost][0]])
        raise PathError(
            f"the path cuts along contour {number} too (line {line}), which is not among the chosen ones;"
            f" add it: --contour {','.join(map(str, [*chosen, number]))}"
        )


def choice_findings(contours: Sequence[Contour], chosen: Mapping[int, Contour], path: ToolPath) -> tuple[Finding, ...]:
    """Refuse tool axes that point into the part; warn where the path lies nearer to another contour than the chosen.

    On a thin part that is the other skin: the tool axis chose this one, or the operator did. The geometry cannot tell
    a tool that reaches through the part from an axis that points the wrong way.
    """
    steps, feed = _feed(path)
    _refuse_axes_into_the_part(chosen, steps, feed)
    distances = {n: nearest(steps.tips_mm[feed], framed(c))[1] for n, c in enumerate(contours, 1)}
    own = np.min([distances[number] for number in chosen], axis=0)
    median = {number: float(np.median(distance)) for number, distance in distances.items()}
    closest = min(median, key=lambda number: median[number])
    if float(np.median(own)) - median[closest] < OTHER_SKIN_MM or len(chosen) > 1:
        return ()
    (number,) = chosen
    text = (
        f"the path runs {np.median(own):.2f} mm from contour {number}, but {median[closest]:.2f} mm from contour"
        f" {closest}: the scan must show the side of contour {number}, and the tool axis must leave the part there"
    )
    return (Finding(405, Level.WARN, text, f"contour {number}"),)


def _refuse_axes_into_the_part(chosen: Mapping[int, Contour], steps: Steps, feed: BoolArray) -> None:
    for number, contour in chosen.items():
        curve = framed(contour)
        s_mm, distance = nearest(steps.tips_mm, curve)
        near = feed & (distance <= np.median(distance[feed]))
        agreement = np.sum(at(curve, s_mm[near]).outward * steps.axes[near], axis=1)
        if float(np.median(agreement)) < INTO_THE_PART:
            raise PathError(
                f"the tool axes point into the part along contour {number}: they must run from the tip to the holder;"
                " turn them in the path, or the outward side of the part (the winding of a mesh)"
            )


def check_units(scan: Scan, part: Part, contours: Mapping[int, Contour]) -> tuple[Finding, ...]:
    """Say which units were taken because the files state none, and refuse a scan that only makes sense in another.

    A scan of the contour is no smaller than most of the contour and no larger than the part; where the file states no
    unit and the one that was taken puts it outside of that, but another one inside, it is in that other unit.

    Raises
    ------
    UnitError
        Naming the likely unit.
    """
    part_size = _diagonal(part.mesh.vertices_mm)
    findings = []
    if part.source is not None and not part.source.unit_stated:
        findings.append(unit_taken(part.source, "--cad-units", f": the part is {part_size:.4g} mm across"))
    if scan.source is None or scan.source.unit_stated:
        return tuple(findings)
    size = _diagonal(scan.points_mm)
    least = 0.5 * max(_diagonal(contour.points_mm) for contour in contours.values())
    most = 1.5 * max(part_size, 2.0 * least)
    if not least <= size <= most and (fitting := _units_fitting(scan.source.unit, size, part_size, least, most)):
        options = " or ".join(f"--scan-units {unit}" for unit in fitting)
        raise UnitError(
            f"{scan.source.path}: {size:.4g} mm across, where the part has {part_size:.4g} mm;"
            f" it seems to be in {' or '.join(fitting)}: give {options}, or --scan-units {scan.source.unit} if it is"
            " not"
        )
    told = f": the scan is {size:.4g} mm across, the part {part_size:.4g} mm"
    return (*findings, unit_taken(scan.source, "--scan-units", told))


def unit_taken(source: Source, flag: str, because: str = "") -> Finding:
    """Return the warning that a file states no unit, with the one that was taken and the flag that states it."""
    message = f"the file states no unit, {source.unit} was taken{because}; state it with {flag}"
    return Finding(409, Level.WARN, message, source.path)


def _units_fitting(taken: str, size_mm: float, part_size_mm: float, least_mm: float, most_mm: float) -> list[str]:
    """Return the units, the likeliest first, in which a scan read in another one would have a size that makes sense."""
    sizes = np.array([part_size_mm, 2.0 * least_mm])
    scales = {unit: mm / MM_PER_UNIT[taken] for unit, mm in MM_PER_UNIT.items() if unit != taken}
    off = {
        unit: float(np.abs(np.log(size_mm * scale / sizes)).min())
        for unit, scale in scales.items()
        if least_mm <= size_mm * scale <= most_mm
    }
    return sorted((unit for unit in off if off[unit] <= min(off.values()) + CLEARLY_WORSE), key=lambda u: off[u])


def refuse_twins(
    contours: Sequence[Contour], chosen: Mapping[int, Contour], T_start: FloatArray | None, T_found: FloatArray | None
) -> None:
    """Refuse a pose that may lie on another place of the part with the same contour, which is not registered.

    Without a start there is nothing to tell such twins by; with one, a way of nearly half their distance is too long.

    Parameters
    ----------
    contours
        All contours of the part.
    chosen
        Those that are registered, by number.
    T_start, T_found
        (4, 4) start pose T_scan_part, and the registered one; None before either is known.

    Raises
    ------
    RegistrationError
        Naming the two contours.
    """
    others = {number: framed(c) for number, c in enumerate(contours, 1) if number not in chosen}
    for number, contour in chosen.items():
        own = framed(contour)
        middle = own.points_mm.mean(axis=0)
        for twin, other in others.items():
            apart_mm = float(np.linalg.norm(middle - other.points_mm.mean(axis=0)))
            # Nearer is the edge of the same hole on the other skin.
            if apart_mm <= TWIN_SHARE * _diagonal(own.points_mm) or not congruent(own, other):
                continue
            if T_start is None:
                raise RegistrationError(
                    f"contours {number} and {twin} have one shape, {apart_mm:.0f} mm apart: which of them the scan"
                    " shows cannot be told; give a rough pose or datum pairs with --align FILE"
                )
            way_mm = 0.0
            if T_found is not None:
                way_mm = float(np.linalg.norm(apply(T_found, middle[None]) - apply(T_start, middle[None])))
            if way_mm > TWIN_WAY * apart_mm:
                raise RegistrationError(
                    f"contour {number} was found {way_mm:.1f} mm from where the start pose has it, and contour {twin}"
                    f" of the same shape lies {apart_mm:.1f} mm from it: give a better start pose (--align FILE)"
                )


def _diagonal(points_mm: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(points_mm, axis=0))) if len(points_mm) else 0.0


def register(
    part: Part,
    scan: Scan,
    *,
    path: ToolPath | None = None,
    method: str = "sicp",
    align: FloatArray | str | os.PathLike[str] | None = None,
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
        `sicp`, `rigid`, `projection` or `paper`.
    align
        (4, 4) rough T_scan_part in mm, or a file as `--align` takes it; None finds it from the geometry.
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
    if method not in METHODS:
        raise JobError(f"method: must be one of {', '.join(METHODS)}, not {method!r}")
    if isinstance(align, str | os.PathLike):
        align = read_alignment(Path(align)).T_scan_part
    if align is not None and not is_rigid(np.asarray(align)):
        raise JobError("align: no rigid motion; a finite (4, 4) matrix T_scan_part without scale or mirror is needed")
    gates = gates or GateLimits()
    part = replace(part, contours=contours_of(part))
    chosen = choose_contours(contours_of(part), path, contours, gates.path_distance_mm)
    noticed = check_units(scan, part, chosen)
    refuse_twins(contours_of(part), chosen, align, None)
    result = register_contours(chosen, scan, align, method=method, settings=settings)
    result = replace(result, findings=(*noticed, *result.findings))
    refuse_twins(contours_of(part), chosen, result.T_scan_part if align is None else align, result.T_scan_part)
    return PartRegistration(result, toolpath or ToolPathSettings(), gates)
