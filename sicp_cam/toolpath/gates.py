"""Gates: limits that a registration and a corrected path must keep before any program is written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.model import BoolArray, FloatArray, Status
from sicp_cam.registration.result import RegisteredContour, Registration
from sicp_cam.toolpath.settings import GateLimits
from sicp_cam.toolpath.transfer import CorrectedPath

__all__ = ["GATE_NAMES", "Gate", "overridden", "path_gates", "registration_gates"]

SLOPE = 0.1
"""Change of the correction per millimetre of path that a bent part explains."""


@dataclass(frozen=True, slots=True)
class Gate:
    """One limit and how it was kept.

    Parameters
    ----------
    name
        The name that `--override` takes.
    value, limit
        In the unit that `text` names.
    state
        `ok`, `warn`, `fail` or `overridden`.
    text
        What the value is, in words.
    """

    name: str
    value: float
    limit: float
    state: str
    text: str


OUT_TEXT = "mean distance of scan and contour out of the surface, mm"
GATE_NAMES = (
    "coverage",
    "residual_mm",
    "edge_residual_mm",
    "side",
    "stretch",
    "in_surface_mm",
    "path_distance_mm",
    "path_coverage",
    "correction_mm",
    "axis_deg",
    "jump_mm",
)


def registration_gates(registration: Registration, limits: GateLimits) -> tuple[Gate, ...]:
    """Judge the registration: how much of the contour was seen, how well it fits, and that it was not stretched."""
    contours = registration.contours
    coverage = min(float(contour.covered.mean()) for contour in contours)
    out = _largest(_mean_size(contour.after.out_mm) for contour in contours)
    normal = _largest(_mean_size(contour.after.normal_mm) for contour in contours)
    stretch = _largest(abs(_length(contour.corrected) / _length(contour.nominal) - 1.0) for contour in contours)
    aside = _largest(_largest_aside(contour) for contour in contours)
    return (
        _at_least("coverage", coverage, limits.coverage, "fraction of the contour on which the scan shows the edge"),
        _expected(registration.method, _at_most("residual_mm", out, limits.residual_mm, OUT_TEXT)),
        _at_most("edge_residual_mm", normal, limits.edge_residual_mm, "mean distance of scan edge and contour, mm"),
        _at_most(
            "side",
            registration.side or 0.0,
            limits.side,
            "misfit of the given pose over that of the part turned over",
        ),
        _at_most("stretch", stretch, limits.stretch, "relative change of the contour's length"),
        _at_most("in_surface_mm", aside, limits.in_surface_mm, "largest move of the edge in the surface, mm"),
    )


def path_gates(corrected: CorrectedPath, distance_mm: FloatArray, limits: GateLimits) -> tuple[Gate, ...]:
    """Judge the corrected path: how far its points and axes were moved, and how evenly.

    Parameters
    ----------
    corrected
        The path before and after.
    distance_mm
        (m,) distance of the steps of all feed moves from the contour that they follow.
    limits
        The limits.
    """
    cuts = np.array([status is not Status.APPROACH for status in corrected.status])
    change = corrected.corrected.tips_mm - corrected.rigid.tips_mm
    size = np.linalg.norm(change, axis=1)
    cosine = np.clip(np.sum(corrected.corrected.axes * corrected.rigid.axes, axis=1), -1.0, 1.0)
    return (
        _at_most(
            "path_distance_mm",
            float(np.median(distance_mm)) if len(distance_mm) else np.inf,
            limits.path_distance_mm,
            "median distance of the feed travel from the contour, mm",
        ),
        _at_least(
            "path_coverage",
            _covered_share(corrected),
            limits.path_coverage,
            "fraction of the cut length along which the scan shows the edge",
        ),
        _at_most(
            "correction_mm", float(size.max()), limits.correction_mm, "largest correction beyond the rigid pose, mm"
        ),
        _at_most(
            "axis_deg",
            float(np.degrees(np.arccos(cosine)).max()),
            limits.axis_deg,
            "largest turn of the tool axis beyond the rigid pose, degrees",
        ),
        _at_most(
            "jump_mm",
            _largest_jump(change, corrected.nominal.tips_mm, cuts),
            limits.jump_mm,
            f"largest step of the correction between neighbouring points beyond {SLOPE:g} mm per mm of path, mm",
        ),
    )


def _expected(method: str, gate: Gate) -> Gate:
    """Let the rigid pose miss a bent part with a warning: that is what the operator chose it for."""
    return replace(gate, state="warn") if method == "rigid" and gate.state == "fail" else gate


def overridden(gates: Iterable[Gate], names: Iterable[str]) -> tuple[Gate, ...]:
    """Return the gates with those failed ones marked that the operator named."""
    allowed = set(names)
    return tuple(
        replace(gate, state="overridden") if gate.state == "fail" and gate.name in allowed else gate for gate in gates
    )


def _at_most(name: str, value: float, limit: float, text: str) -> Gate:
    return Gate(name, value, limit, "ok" if value <= limit else "fail", text)


def _at_least(name: str, value: float, limit: float, text: str) -> Gate:
    return Gate(name, value, limit, "ok" if value >= limit else "fail", text)


def _largest_aside(contour: RegisteredContour) -> float:
    change = contour.corrected.points_mm - contour.rigid.points_mm
    return float(np.abs(np.sum(change * contour.rigid.inward, axis=1)).max())


def _largest(values: Iterable[float]) -> float:
    """Return the largest of several values, NaN if one of them is: a gate must never pass what was not measured."""
    return float(np.max(list(values)))


def _mean_size(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.abs(known).mean()) if len(known) else np.inf


def _length(curve: FramedCurve) -> float:
    points = np.vstack([curve.points_mm, curve.points_mm[:1]]) if curve.closed else curve.points_mm
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _covered_share(corrected: CorrectedPath) -> float:
    """Return the length of the covered cutting moves over that of all cutting moves."""
    tips = corrected.nominal.tips_mm
    length = np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1)
    cut, covered = (
        float(sum(step for step, status in zip(length, corrected.status, strict=True) if status in wanted))
        for wanted in ({Status.COVERED, Status.BRIDGED}, {Status.COVERED})
    )
    if cut > 0.0:
        return covered / cut
    return 1.0 if Status.BRIDGED not in corrected.status else 0.0


def _largest_jump(change: FloatArray, tips_mm: FloatArray, cuts: BoolArray) -> float:
    both = cuts[1:] & cuts[:-1]
    step = np.linalg.norm(np.diff(change, axis=0), axis=1) - SLOPE * np.linalg.norm(np.diff(tips_mm, axis=0), axis=1)
    return float(np.max(step[both], initial=0.0))
