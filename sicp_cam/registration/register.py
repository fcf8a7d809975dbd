"""Register the contours of a part to a scan: start, rigid pose, and the chosen method for each contour."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sicp_cam.contour.frames import FramedCurve, framed, moved
from sicp_cam.contour.projection import nearest
from sicp_cam.errors import RegistrationError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Contour, FloatArray, Scan
from sicp_cam.registration.edge import EdgeMeasurement, measure, on_curve
from sicp_cam.registration.result import RegisteredContour, Registration, Residuals, Segment
from sicp_cam.registration.rigid import NominalContour, RigidPose, facing_rim, register_rigidly
from sicp_cam.registration.scan_surface import ScanSurface, cropped, prepared, without_copies
from sicp_cam.registration.segments import blended
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.registration.sicp import Subdivided, paper_s_icp, s_icp
from sicp_cam.registration.start import find_start, is_symmetric, side_ratio
from sicp_cam.rigid_motion import apply, is_rigid

__all__ = ["register_contours"]

CROP_MARGIN = 1.5
MOST_CROPS = 4
RECROP_SHARE = 0.4
"""Move of the contour by the rigid pose, over the reach, above which the scan is cut out anew."""
MIN_POINTS = 50
SHOWN_SHARE = 0.9
"""Coverage below which the operator is warned."""
UNSURE_SIDE = 0.67
"""Misfit of the pose over that of the part turned over above which the scan does not tell the side."""
WEAK_FREEDOM = 0.05


def register_contours(
    contours: Mapping[int, Contour],
    scan: Scan,
    T_start: FloatArray | None,
    *,
    method: str = "sicp",
    settings: RegistrationSettings | None = None,
) -> Registration:
    """Register the given contours of one part, all together rigidly and then each by the chosen method.

    Parameters
    ----------
    contours
        The contours in the part frame, by their number in the part.
    scan
        The scan.
    T_start
        (4, 4) rough T_scan_part; None to find it from the geometry.
    method
        `rigid`, `paper` or `sicp`.
    settings
        Defaults where None.

    Raises
    ------
    RegistrationError
        If the scan does not show the contours, or the pose is ambiguous.
    """
    _check(contours, T_start, method)
    settings = settings or RegistrationSettings()
    nominal = {n: NominalContour(framed(c), c.ring_points_mm, c.ring_normals) for n, c in contours.items()}
    symmetry = None
    if T_start is None:
        whole = prepared(_enough(scan, settings))
        start = find_start(list(nominal.values()), whole, reach_mm=settings.reach_mm)
        T_start, symmetry = start.T_scan_part, start.symmetry
    surface, pose = _rigid(list(nominal.values()), scan, T_start, settings)
    side = None
    if symmetry is None:
        side = side_ratio(list(nominal.values()), surface, pose.T_scan_part, reach_mm=settings.reach_mm)
    done = tuple(
        _registered_contour(number, contour, surface, pose, method, settings) for number, contour in nominal.items()
    )
    noise = float(np.mean([noise_mm for _, noise_mm in done]))
    return Registration(
        method,
        pose.T_scan_part,
        tuple(contour for contour, _ in done),
        surface.spacing_mm,
        noise,
        pose.freedoms,
        symmetry,
        side,
        _findings(pose, done) + _side_findings(side, scan.normals is not None),
    )


def _check(contours: Mapping[int, Contour], T_start: FloatArray | None, method: str) -> None:
    if method not in METHODS:
        raise ValueError(f"unknown method {method!r}; use one of {', '.join(METHODS)}")
    if not contours:
        raise RegistrationError("no contour to register; choose one with --contour")
    if T_start is not None and not is_rigid(T_start):
        raise RegistrationError(
            "the start pose is no rigid motion: a finite 4x4 matrix without scale or mirror is needed"
        )


def _rigid(
    contours: list[NominalContour], scan: Scan, T_start: FloatArray, settings: RegistrationSettings
) -> tuple[ScanSurface, RigidPose]:
    """Register rigidly to the scan around the contours; again where the pose left the part of the scan looked at."""
    T = T_start
    for _ in range(MOST_CROPS):
        near = [moved(contour.curve, T) for contour in contours]
        surface = prepared(_enough(cropped(scan, near, CROP_MARGIN * settings.reach_mm), settings))
        pose = register_rigidly(contours, surface, T, reach_mm=settings.reach_mm)
        after = [moved(contour.curve, pose.T_scan_part) for contour in contours]
        shift = max(
            float(np.linalg.norm(a.points_mm - b.points_mm, axis=1).max()) for a, b in zip(near, after, strict=True)
        )
        if shift <= RECROP_SHARE * settings.reach_mm:
            break
        T = pose.T_scan_part
    return surface, pose


def _enough(scan: Scan, settings: RegistrationSettings) -> Scan:
    scan = without_copies(scan)
    if len(scan.points_mm) < MIN_POINTS:
        raise RegistrationError(
            f"only {len(scan.points_mm)} scan points lie within {CROP_MARGIN * settings.reach_mm:g} mm of the contour;"
            " check that scan and part belong together, their units, and the start pose (--align)"
        )
    return scan


def _registered_contour(
    number: int,
    contour: NominalContour,
    surface: ScanSurface,
    pose: RigidPose,
    method: str,
    settings: RegistrationSettings,
) -> tuple[RegisteredContour, float]:
    rigid = moved(contour.curve, pose.T_scan_part)
    before = measure(rigid, surface, reach_mm=settings.reach_mm)
    if not before.covered.any():
        raise RegistrationError(
            f"the scan shows no edge anywhere along contour {number};"
            " check that scan and part belong together and the start pose (--align)"
        )
    if method == "rigid":
        segments: tuple[Segment, ...] = ()
        corrected, splits = rigid, np.zeros(0)
        stability = apply(pose.T_scan_part, contour.ring_points_mm)
    else:
        divided = (s_icp if method == "sicp" else paper_s_icp)(contour, surface, pose.T_scan_part, settings)
        corrected, segments, splits = divided.curve, divided.segments, divided.subdivision.splits_mm
        stability = _stability(contour, divided)
    after = measure(corrected, surface, reach_mm=settings.reach_mm)
    chosen, _ = facing_rim(surface.rim, corrected, 3.0 * surface.spacing_mm)
    registered = RegisteredContour(
        number,
        contour.curve,
        rigid,
        corrected,
        on_curve(after.covered.astype(np.float64), after, corrected) >= 0.5,
        surface.rim.points_mm[chosen],
        _residuals(before, rigid),
        _residuals(after, corrected),
        segments,
        splits,
        contour.ring_points_mm,
        stability,
        is_symmetric(contour.curve),
    )
    return registered, after.noise_mm


def _stability(contour: NominalContour, divided: Subdivided) -> FloatArray:
    """Return the stability points carried along with the pieces that they belong to, (q, 3) in the scan frame."""
    if not len(contour.ring_points_mm):
        return contour.ring_points_mm
    s_mm, _ = nearest(contour.ring_points_mm, contour.curve)
    axes = np.eye(3)[np.zeros(len(s_mm), dtype=np.int64)], np.eye(3)[np.ones(len(s_mm), dtype=np.int64)]
    points = FramedCurve(
        s_mm, contour.ring_points_mm, axes[0], axes[1], np.cross(*axes), contour.curve.length_mm, contour.curve.closed
    )
    return blended(points, divided.subdivision, divided.segments).points_mm


def _residuals(measured: EdgeMeasurement, curve: FramedCurve) -> Residuals:
    normal = np.where(measured.edge_trusted, measured.depth_mm, np.nan)
    out = np.where(measured.covered, measured.height_mm, np.nan)
    return Residuals(on_curve(normal, measured, curve), on_curve(out, measured, curve))


def _findings(pose: RigidPose, done: tuple[tuple[RegisteredContour, float], ...]) -> tuple[Finding, ...]:
    found = []
    for value, twist in zip(pose.freedoms, pose.twists, strict=True):
        if value < WEAK_FREEDOM:
            kind = "rotation" if np.linalg.norm(twist[:3]) > np.linalg.norm(twist[3:]) else "sliding"
            axis = twist[:3] if kind == "rotation" else twist[3:]
            axis = axis / np.linalg.norm(axis)
            direction = ", ".join(f"{x:.2f}" for x in axis)
            found.append(
                Finding(
                    401,
                    Level.INFO,
                    f"the contour hardly holds a {kind} about or along ({direction}) in the scan frame;"
                    " the start pose decides it",
                )
            )
    for contour, _ in done:
        share = float(contour.covered.mean())
        if share < 1.0:
            found.append(
                Finding(
                    402,
                    Level.INFO if share >= SHOWN_SHARE else Level.WARN,
                    f"the scan shows {100.0 * share:.1f} % of the edge; the rest is carried over from both sides",
                    f"contour {contour.number}",
                )
            )
    return tuple(found)


def _side_findings(side: float | None, has_normals: bool) -> tuple[Finding, ...]:
    if side is None or side < UNSURE_SIDE or has_normals:
        return ()
    text = (
        "the scan fits the part turned over about as well: the start pose alone says which side is outward;"
        " check it, or scan with normals"
    )
    return (Finding(404, Level.INFO, text),)
