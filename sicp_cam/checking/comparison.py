"""Compare two programs of one path, move by move: tips, tool axes, feeds, and which moves are rapid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.checking.review import angles_deg, place
from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, IntArray, ToolPath
from sicp_cam.rigid_motion import apply, best_fit

__all__ = ["Comparison", "compared"]

DIFFERS, DIFFERS_IN_SPEED = 897, 898
"""Codes of the findings."""

_AXIS_ASSUMED = 303
_SAME_FEED = 0.01
_ASTRAY_DEG = 0.05
"""How much longer added moves may make a turn of the tool axis: 4e-8 for what our posts divide, on the great circle;
0.02 for pieces of 30 degrees of C at a tilt of 5, divided by rotary angles."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How far a program is from its reference.

    Parameters
    ----------
    findings
        What is beyond the tolerances.
    facts
        Plain data: compared moves, moves that were added between them, the largest differences of tips (mm), axes
        (degrees) and feeds (share); None where there is nothing to compare.
    """

    findings: tuple[Finding, ...]
    facts: dict[str, Any]


def compared(
    path: ToolPath, reference: ToolPath, file: str, *, tolerance_mm: float = 0.002, tolerance_deg: float = 0.002
) -> Comparison:
    """Compare a path with a reference in the same frame.

    The moves of the reference must be moves of the path in the same order; the path may have more, on the straight
    ways and turns between them, as where a post divides long turns; rapid ones only as parts of rapid moves.

    Parameters
    ----------
    path, reference
        What was read back, and what it should be.
    file
        Name of the program, for the places.
    tolerance_mm, tolerance_deg
        How far tips and tool axes may be off.
    """
    with_axes = not any(f.code == _AXIS_ASSUMED for f in (*path.findings, *reference.findings))
    matched = _matched(path, reference, tolerance_mm, tolerance_deg if with_axes else 360.0)
    if isinstance(matched, int):
        return Comparison((_missing(path, reference, matched, file),), _facts(path, reference, None, None, None, None))
    far = np.linalg.norm(path.tips_mm[matched] - reference.tips_mm, axis=1)
    turned = angles_deg(path.axes[matched], reference.axes) if with_axes else None
    findings = list(_geometry(path, reference, matched, far, turned, file, (tolerance_mm, tolerance_deg)))
    findings += _added(path, matched, file, tolerance_mm, with_axes=with_axes)
    findings += _kinds(path, reference, matched, file)
    speed, told = _feeds(path, reference, matched, file)
    if not with_axes:
        what = "tool axes were not compared: one of the two programs states none"
        findings.append(Finding(DIFFERS_IN_SPEED, Level.INFO, what, printable(file)))
    return Comparison((*findings, *told), _facts(path, reference, matched, far, turned, speed))


def _facts(
    path: ToolPath,
    reference: ToolPath,
    matched: IntArray | None,
    far: FloatArray | None,
    turned: FloatArray | None,
    speed: float | None,
) -> dict[str, Any]:
    return {
        "reference": reference.source.path if reference.source is not None else "memory",
        "moves": len(reference),
        "added_moves": None if matched is None else len(path) - len(np.unique(matched)),
        "max_mm": None if far is None else float(f"{far.max():.6g}"),
        "max_axis_deg": None if turned is None else float(f"{turned.max():.6g}"),
        "max_feed_share": None if speed is None else float(f"{speed:.6g}"),
    }


def _matched(path: ToolPath, reference: ToolPath, tolerance_mm: float, tolerance_deg: float) -> IntArray | int:
    """Return for each move of the reference the move of the path that is the same; or the first that has none."""
    if len(path) == len(reference):
        return np.arange(len(path))
    chord = 2.0 * np.sin(np.radians(min(tolerance_deg, 180.0)) / 2.0) + 1e-12
    tips, axes = path.tips_mm.tolist(), path.axes.tolist()
    wanted, directions = reference.tips_mm.tolist(), reference.axes.tolist()
    at, found = 0, []
    for number, (tip, axis) in enumerate(zip(wanted, directions, strict=True)):
        repeated = number > 0 and tip == wanted[number - 1] and axis == directions[number - 1]
        start = at if repeated or not number else at + 1
        hit = next(
            (i for i in range(start, len(tips)) if _near(tips[i], tip, tolerance_mm) and _near(axes[i], axis, chord)),
            None,
        )
        if hit is None:
            return number
        found.append(hit)
        at = hit
    return np.array(found, dtype=np.int64)


def _near(a: list[float], b: list[float], tolerance: float) -> bool:
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return dx * dx + dy * dy + dz * dz <= tolerance * tolerance


def _missing(path: ToolPath, reference: ToolPath, number: int, file: str) -> Finding:
    nearest = np.linalg.norm(path.tips_mm - reference.tips_mm[number], axis=1)
    what = (
        f"{len(path)} moves, the reference has {len(reference)}, and its {place(reference, number, _name(reference))},"
        f" is not among them in that order; the nearest tip is {nearest.min():.4g} mm away"
    )
    return Finding(DIFFERS, Level.FAIL, what, place(path, int(nearest.argmin()), file))


def _name(reference: ToolPath) -> str:
    return reference.source.path if reference.source is not None else "reference"


def _geometry(
    path: ToolPath,
    reference: ToolPath,
    matched: IntArray,
    far: FloatArray,
    turned: FloatArray | None,
    file: str,
    tolerances: tuple[float, float],
) -> Iterator[Finding]:
    for off, unit, noun, tolerance in ((far, "mm", "tips", tolerances[0]), (turned, "degrees", "axes", tolerances[1])):
        if off is None or off.max() <= tolerance:
            continue
        worst = int(off.argmax())
        hint = _frame_hint(path.tips_mm[matched], reference.tips_mm, tolerances[0]) if noun == "tips" else ""
        what = (
            f"{int((off > tolerance).sum())} of {len(off)} {noun} are off by more than {tolerance:g} {unit}, this one"
            f" by {off[worst]:.4g} ({place(reference, worst, _name(reference))}){hint}"
        )
        yield Finding(DIFFERS, Level.FAIL, what, place(path, int(matched[worst]), file))


def _frame_hint(tips_mm: FloatArray, reference_mm: FloatArray, tolerance_mm: float) -> str:
    """Say so where one rigid motion explains the whole difference."""
    T = best_fit(reference_mm, tips_mm)
    if np.linalg.norm(apply(T, reference_mm) - tips_mm, axis=1).max() > tolerance_mm:
        return ""
    angle = float(np.degrees(Rotation.from_matrix(T[:3, :3]).magnitude()))
    return f"; one rigid motion of {np.linalg.norm(T[:3, 3]):.4g} mm and {angle:.4g} degrees: are both in one frame?"


def _added(path: ToolPath, matched: IntArray, file: str, tolerance_mm: float, *, with_axes: bool) -> Iterator[Finding]:
    """Find added moves that are no part of a move of the reference: outside, beside its way, turned away, or rapid."""
    added = np.setdiff1d(np.arange(len(path)), matched)
    inside = added[(added > matched[0]) & (added < matched[-1])]
    outside = len(added) - len(inside)
    if outside:
        first = int(np.setdiff1d(added, inside)[0])
        what = f"{outside} moves before the first or after the last one of the reference"
        yield Finding(DIFFERS, Level.FAIL, what, place(path, first, file))
    if not len(inside):
        return
    after = np.searchsorted(matched, inside)
    start, end = matched[after - 1], matched[after]
    off = _beside_mm(path, start, inside, end)
    if off.max() > tolerance_mm:
        worst = int(off.argmax())
        what = f"an added move lies {off[worst]:.4g} mm beside the way of the reference"
        yield Finding(DIFFERS, Level.FAIL, what, place(path, int(inside[worst]), file))
    astray = _astray_deg(path, start, inside, end)
    if with_axes and astray.max() > _ASTRAY_DEG:
        worst = int(astray.argmax())
        what = f"the tool axis of an added move makes the turn of the reference {astray[worst]:.4g} degrees longer"
        yield Finding(DIFFERS, Level.FAIL, what, place(path, int(inside[worst]), file))
    hasty = path.rapid[inside] & ~path.rapid[end]
    if hasty.any():
        first = int(inside[hasty][0])
        what = f"{int(hasty.sum())} added moves are rapid amid cuts of the reference"
        yield Finding(DIFFERS, Level.FAIL, what, place(path, first, file))


def _beside_mm(path: ToolPath, start: IntArray, inside: IntArray, end: IntArray) -> FloatArray:
    """Return how far the tips of moves lie from the straight ways between those of two others."""
    tips = path.tips_mm
    way, along = tips[end] - tips[start], tips[inside] - tips[start]
    square = np.maximum(np.sum(way * way, axis=1), 1e-30)
    share = np.clip(np.sum(along * way, axis=1) / square, 0.0, 1.0)
    off: FloatArray = np.linalg.norm(along - share[:, None] * way, axis=1)
    return off


def _astray_deg(path: ToolPath, start: IntArray, inside: IntArray, end: IntArray) -> FloatArray:
    """Return how much longer the turn from one axis to another is by way of a third; 0 on the great circle."""
    axes = path.axes
    detour: FloatArray = angles_deg(axes[start], axes[inside]) + angles_deg(axes[inside], axes[end])
    return detour - angles_deg(axes[start], axes[end])


def _kinds(path: ToolPath, reference: ToolPath, matched: IntArray, file: str) -> Iterator[Finding]:
    """Compare which moves are rapid; a robot may run those of a path straight, at a speed that is stated."""
    rapid = path.rapid[matched]
    hasty, slow = rapid & ~reference.rapid, ~rapid & reference.rapid
    hasty[:1] = False  # the move to the first point comes from nowhere that is known: robots take it joint by joint
    if hasty.any():
        first = int(np.flatnonzero(hasty)[0])
        what = f"{int(hasty.sum())} cuts of the reference are rapid moves here"
        yield Finding(DIFFERS, Level.FAIL, what, place(path, int(matched[first]), file))
    if slow.any():
        first = int(np.flatnonzero(slow)[0])
        what = f"{int(slow.sum())} rapid moves of the reference are straight moves with a feed here"
        yield Finding(DIFFERS_IN_SPEED, Level.INFO, what, place(path, int(matched[first]), file))


def _feeds(
    path: ToolPath, reference: ToolPath, matched: IntArray, file: str
) -> tuple[float | None, tuple[Finding, ...]]:
    feeds, wanted = path.feeds_mm_min[matched], reference.feeds_mm_min
    both = ~path.rapid[matched] & ~reference.rapid & (feeds > 0.0) & (wanted > 0.0)
    if not both.any():
        return None, ()
    share = np.where(both, np.abs(feeds / np.where(both, wanted, 1.0) - 1.0), 0.0)
    worst = int(share.argmax())
    largest = float(share[worst])
    if largest <= _SAME_FEED:
        return largest, ()
    what = (
        f"feeds are up to {100.0 * largest:.3g} % off: {feeds[worst]:.6g} mm/min here, {wanted[worst]:.6g} in the"
        " reference"
    )
    return largest, (Finding(DIFFERS_IN_SPEED, Level.WARN, what, place(path, int(matched[worst]), file)),)
