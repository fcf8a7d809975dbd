"""Judge a registration: what was seen, how well it fits, what holds it, and that the part was moved and bent only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg

from sicp_cam.contour.frames import FramedCurve, at, moved
from sicp_cam.contour.projection import coordinates
from sicp_cam.model import BoolArray, FloatArray
from sicp_cam.registration.result import RegisteredContour, Registration
from sicp_cam.toolpath.gates import Gate, at_least, at_most, largest
from sicp_cam.toolpath.settings import GateLimits

__all__ = ["freedom_mm", "registration_gates"]

HELD_MM = 0.1
"""How well the scan holds the contour where it shows it."""
START_MM = 10.0
"""How far the start pose may be off, at the contour's radius of gyration."""
SLOPE_ARM_MM = 10.0
"""Depth in the material at which the scan's surface holds the tilt about the edge."""


def registration_gates(
    registration: Registration, limits: GateLimits, T_start: FloatArray | None = None
) -> tuple[Gate, ...]:
    """Judge a registration.

    Parameters
    ----------
    registration
        What was found.
    limits
        The limits.
    T_start
        (4, 4) start pose T_scan_part that was given; None where it was found from the geometry.
    """
    return (
        *_fit_gates(registration, limits),
        *_confidence_gates(registration.contours, limits),
        *_pose_gates(registration, limits, T_start),
        *_deformation_gates(registration.contours, limits),
    )


def _fit_gates(registration: Registration, limits: GateLimits) -> tuple[Gate, ...]:
    contours = registration.contours
    coverage = min(float(contour.covered.mean()) for contour in contours)
    out = largest(_mean_size(contour.after.out_mm) for contour in contours)
    cut = [contour for contour in contours if not contour.uncut]  # the others have no edge to lie beside
    normal = largest([0.0, *(_mean_size(contour.after.normal_mm) for contour in cut)])
    size = largest([0.0, *(_mean_aside(contour) for contour in cut if contour.nominal.closed)])
    surface = "mean distance of scan and contour out of the surface, mm"
    return (
        at_least("coverage", coverage, limits.coverage, "fraction of the contour on which the scan shows the edge"),
        _expected(registration.method, at_most("residual_mm", out, limits.residual_mm, surface)),
        at_most("edge_residual_mm", normal, limits.edge_residual_mm, "mean distance of scan edge and contour, mm"),
        at_most("size_mm", size, limits.size_mm, "mean distance of the scanned edge to one side of the contour, mm"),
    )


def _expected(method: str, gate: Gate) -> Gate:
    """Let the rigid pose miss a bent part with a warning: that is what the operator chose it for."""
    return replace(gate, state="warn") if method == "rigid" and gate.state == "fail" else gate


def _confidence_gates(contours: Sequence[RegisteredContour], limits: GateLimits) -> tuple[Gate, ...]:
    """Judge how sure the contour is; a method that states no uncertainty or looks at no half scan has no such gate."""
    halves = [_half_difference_mm(contour) for contour in contours if not contour.uncut]
    uncertainty = [_largest_uncertainty_mm(contour) for contour in contours]
    found = (
        ("leave_out_mm", halves, limits.leave_out_mm, "difference of the contours found from two halves of the scan"),
        ("uncertainty_mm", uncertainty, limits.uncertainty_mm, "largest standard uncertainty where the scan shows it"),
    )
    return tuple(
        at_most(name, largest(np.inf if value is None else value for value in values), limit, f"{text}, mm")
        for name, values, limit, text in found
        if any(value is not None for value in values)
    )


def _half_difference_mm(contour: RegisteredContour) -> float | None:
    found = contour.leave_out
    return None if found is None else float(np.hypot(found.normal_mm, found.out_mm))


def _largest_uncertainty_mm(contour: RegisteredContour) -> float | None:
    stated = [u_mm for u_mm in (contour.normal_u_mm, contour.out_u_mm) if u_mm is not None]
    if not stated:
        return None
    if len(stated) < 2 - contour.uncut or not contour.covered.any():
        return np.inf
    return float(np.max([u_mm[contour.covered] for u_mm in stated]))


def _pose_gates(registration: Registration, limits: GateLimits, T_start: FloatArray | None) -> tuple[Gate, ...]:
    gates = [
        at_most(
            "freedom_mm",
            freedom_mm([contour for contour in registration.contours if not contour.uncut]),
            limits.freedom_mm,
            f"move of the contour across itself that the scan leaves open to a start {START_MM:g} mm off, mm",
        )
    ]
    if registration.symmetry is not None:
        text = "misfit of the next best start pose over that of the one found"
        gates.append(at_least("symmetry", registration.symmetry, limits.symmetry, text))
    if registration.side is not None:
        text = "misfit of the given pose over that of the part turned over"
        gates.append(at_most("side", registration.side, limits.side, text))
    if T_start is not None:
        ways = [_way_from(T_start, contour) for contour in registration.contours]
        shift_mm, turn_deg = (largest(values) for values in zip(*ways, strict=True))
        text = "largest distance of the contour from where the given start has it, mm"
        gates.append(at_most("pose_mm", shift_mm, limits.pose_mm, text))
        text = "turn of the contour's outer side from the given start, degrees"
        gates.append(at_most("pose_deg", turn_deg, limits.pose_deg, text))
    return tuple(gates)


def _way_from(T_start: FloatArray, contour: RegisteredContour) -> tuple[float, float]:
    """Return how far the contour went from its start: across itself, mm at most, and its outer side, degrees, median.

    What slid along itself, or a circle that turned about its axis, went nowhere.
    """
    start = moved(contour.nominal, T_start)
    seen = coordinates(contour.rigid.points_mm, start)
    turn = np.linalg.norm(at(start, seen.s_mm).outward - contour.rigid.outward, axis=1)
    degrees = np.degrees(2.0 * np.arcsin(np.minimum(0.5 * turn, 1.0)))
    return float(np.hypot(seen.inward_mm, seen.outward_mm).max()), float(np.median(degrees))


def freedom_mm(contours: Sequence[RegisteredContour]) -> float:
    """Return how far the pose can move the contours across themselves where the scan does not hold them.

    A motion xi (rotations in radii of gyration) costs xi' (A_seen / held^2 + I / start^2) xi, at most 1: the scan holds
    what it shows within 0.1 mm, and the start pose is right within 10 mm. What is returned is the largest RMS move of
    the whole contour, sqrt(xi' A_whole xi): 0.1 mm where all of it is seen. Sliding along the edge, and a circle that
    turns about its axis, move nothing across itself and count for nothing.

    Returns
    -------
    float
        In mm; infinite where a curve is not finite.
    """
    if not contours:
        return 0.0
    parts = [_held_directions(contour) for contour in contours]
    points, directions, weights, seen = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    if not np.isfinite(points).all() or not np.isfinite(directions).all():
        return np.inf
    arms = points - np.average(points, axis=0, weights=weights)
    radius = np.sqrt(np.average(np.sum(arms * arms, axis=1), weights=weights))
    J = np.concatenate([np.cross(arms, directions) / radius, directions], axis=1)
    cost = _mean_square(J, weights * seen) / HELD_MM**2 + np.eye(6) / START_MM**2
    return float(np.sqrt(scipy.linalg.eigh(_mean_square(J, weights), cost, eigvals_only=True)[-1]))


def _mean_square(J: FloatArray, weights: FloatArray) -> FloatArray:
    """Return (6, 6) A of xi' A xi: the mean over the stations of the squared moves in their three directions."""
    share = 3.0 * weights / max(float(weights.sum()), np.finfo(float).tiny)
    square: FloatArray = (J * share[:, None]).T @ J
    return square


def _held_directions(contour: RegisteredContour) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return points, directions, weights, and whether the scan holds the point in that direction; (3 k, ...) each.

    Across the edge in its surface, out of the surface, and out of it a little inside the material: its slope.
    """
    curve = contour.rigid
    edge, surface = np.isfinite(contour.after.normal_mm), np.isfinite(contour.after.out_mm)
    inside = curve.points_mm + SLOPE_ARM_MM * curve.inward
    return (
        np.concatenate([curve.points_mm, curve.points_mm, inside]),
        np.concatenate([curve.inward, curve.outward, curve.outward]),
        np.tile(_shares_mm(curve), 3),
        np.concatenate([edge, surface, surface]),
    )


def _shares_mm(curve: FramedCurve) -> FloatArray:
    """Return the (k,) length of contour that each station stands for."""
    first, last = float(curve.s_mm[0]), float(curve.s_mm[-1])
    before, after = (last - curve.length_mm, first + curve.length_mm) if curve.closed else (first, last)
    s_mm = np.concatenate([[before], curve.s_mm, [after]])
    share: FloatArray = 0.5 * (s_mm[2:] - s_mm[:-2])
    return share


def _deformation_gates(contours: Sequence[RegisteredContour], limits: GateLimits) -> tuple[Gate, ...]:
    stretch = largest(abs(_length(contour.corrected) / _length(contour.nominal) - 1.0) for contour in contours)
    aside = largest(_largest_aside(contour) for contour in contours)
    return (
        at_most("stretch", stretch, limits.stretch, "relative change of the contour's length"),
        at_most("in_surface_mm", aside, limits.in_surface_mm, "largest move of the edge in the surface, mm"),
    )


def _largest_aside(contour: RegisteredContour) -> float:
    change = contour.corrected.points_mm - contour.rigid.points_mm
    return float(np.abs(np.sum(change * contour.rigid.inward, axis=1)).max())


def _mean_aside(contour: RegisteredContour) -> float:
    """Return the mean distance, one side against the other, of the scanned edge from the rigid contour.

    A bent part keeps its size; one that is not cut to size yet, or is another part, does not.
    """
    known = contour.before.normal_mm[np.isfinite(contour.before.normal_mm)]
    return float(abs(known.mean())) if len(known) else np.inf


def _mean_size(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.abs(known).mean()) if len(known) else np.inf


def _length(curve: FramedCurve) -> float:
    points = np.vstack([curve.points_mm, curve.points_mm[:1]]) if curve.closed else curve.points_mm
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
