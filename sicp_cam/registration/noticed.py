"""What an operator should know about a registration: findings, from remarks to warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Scan
from sicp_cam.registration.edge import EdgeMeasurement
from sicp_cam.registration.result import RegisteredContour
from sicp_cam.registration.rigid import RigidPose
from sicp_cam.registration.scan_surface import ScanSurface

__all__ = ["noticed"]

SHOWN_SHARE = 0.9
"""Coverage below which the operator is warned."""
UNSURE_SIDE = 0.67
"""Misfit of the pose over that of the part turned over above which the scan does not tell the side."""
WEAK_FREEDOM = 0.05
ROW_GAP_SPACINGS = 0.5


def noticed(
    scan: Scan,
    surface: ScanSurface,
    pose: RigidPose,
    done: Iterable[tuple[RegisteredContour, EdgeMeasurement]],
    side: float | None,
) -> tuple[Finding, ...]:
    """Return the findings of a registration.

    Parameters
    ----------
    scan, surface
        The scan as it was read, and as it was registered to.
    pose
        The primary registration.
    done
        Each contour with what the scan shows from it.
    side
        Misfit of the pose over that of the part turned over; None where the start was found from the geometry.
    """
    found = list(_of_freedoms(pose))
    for contour, measured in done:
        found += _of_contour(contour, measured, surface.spacing_mm)
    if surface.in_rows:
        text = (
            "the points of the scan lie in rows, much denser along them than across: near the contour they were thinned"
            f" to an even spacing of {surface.spacing_mm:.2f} mm"
        )
        found.append(Finding(407, Level.INFO, text, str(scan.source.path) if scan.source else ""))
    if side is not None and side >= UNSURE_SIDE and scan.normals is None:
        text = (
            "the scan fits the part turned over about as well: the start pose alone says which side is outward;"
            " check it, or scan with normals"
        )
        found.append(Finding(404, Level.INFO, text))
    return tuple(found)


def _of_freedoms(pose: RigidPose) -> Iterator[Finding]:
    for value, twist in zip(pose.freedoms, pose.twists, strict=True):
        if value < WEAK_FREEDOM:
            kind = "rotation" if np.linalg.norm(twist[:3]) > np.linalg.norm(twist[3:]) else "sliding"
            axis = twist[:3] if kind == "rotation" else twist[3:]
            direction = ", ".join(f"{x:.2f}" for x in axis / np.linalg.norm(axis))
            text = (
                f"the contour hardly holds a {kind} about or along ({direction}) in the scan frame;"
                " the start pose decides it"
            )
            yield Finding(401, Level.INFO, text)


def _of_contour(contour: RegisteredContour, measured: EdgeMeasurement, spacing_mm: float) -> Iterator[Finding]:
    where = f"contour {contour.number}"
    if contour.uncut:
        text = (
            "the part is not cut here yet: the scan goes on beyond the contour;"
            " in the surface the contour lies where the start pose has it, out of the surface where the scan lies"
        )
        yield Finding(406, Level.WARN, text, where)
    share = float(contour.covered.mean())
    if share < 1.0:
        text = f"the scan shows {100.0 * share:.1f} % of the edge; the rest is carried over from both sides"
        yield Finding(402, Level.INFO if share >= SHOWN_SHARE else Level.WARN, text, where)
    in_rows = measured.row_gap_mm > ROW_GAP_SPACINGS * spacing_mm
    if in_rows.any():
        length_mm = in_rows.mean() * contour.nominal.length_mm
        text = (
            f"along {length_mm:.0f} mm the rows of the scan run beside the edge, which may lie anywhere within"
            f" their gap of {measured.row_gap_mm.max():.2f} mm: scan it across"
        )
        yield Finding(408, Level.WARN, text, where)
