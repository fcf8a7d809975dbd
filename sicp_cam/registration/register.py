"""Register the contours of a part to a scan: start, rigid pose, and the chosen method for each contour."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sicp_cam.contour.frames import FramedCurve, framed, moved
from sicp_cam.contour.projection import nearest
from sicp_cam.errors import RegistrationError
from sicp_cam.model import Contour, FloatArray, Scan
from sicp_cam.registration.edge import EdgeMeasurement, measure, on_curve
from sicp_cam.registration.noticed import noticed
from sicp_cam.registration.projection import project
from sicp_cam.registration.result import RegisteredContour, Registration, Residuals, Segment
from sicp_cam.registration.rigid import NominalContour, RigidPose, facing_rim, register_rigidly
from sicp_cam.registration.scan_surface import ScanSurface, cropped, prepared, without_copies
from sicp_cam.registration.segments import blended
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.registration.sicp import Subdivided, paper_s_icp, s_icp
from sicp_cam.registration.start import find_start, is_symmetric, side_ratio
from sicp_cam.registration.uncut import is_uncut, register_to_surface
from sicp_cam.rigid_motion import apply, is_rigid

__all__ = ["register_contours"]

CROP_MARGIN = 1.5
MOST_CROPS = 4
RECROP_SHARE = 0.4
"""Move of the contour by the rigid pose, over the reach, above which the scan is cut out anew."""
MIN_POINTS = 50


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
        `rigid`, `projection`, `paper` or `sicp`.
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
    surface, pose, uncut = _rigid(list(nominal.values()), scan, T_start, settings)
    side = None
    if symmetry is None:
        side = side_ratio(list(nominal.values()), surface, pose.T_scan_part, reach_mm=settings.reach_mm)
    done = [
        _registered_contour(number, contour, surface, pose, method, settings, at_start)
        for (number, contour), at_start in zip(nominal.items(), uncut, strict=True)
    ]
    registered = tuple(contour for contour, _ in done)
    return Registration(
        method,
        pose.T_scan_part,
        registered,
        surface.spacing_mm,
        float(np.mean([measured.noise_mm for _, measured in done])),
        pose.freedoms,
        symmetry,
        side,
        noticed(scan, surface, pose, done, side),
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
) -> tuple[ScanSurface, RigidPose, list[bool]]:
    """Register rigidly to the scan around the contours; again where the pose left the part of the scan looked at."""
    T = T_start
    for _ in range(MOST_CROPS):
        near = [moved(contour.curve, T) for contour in contours]
        surface = prepared(_enough(cropped(scan, near, CROP_MARGIN * settings.reach_mm), settings))
        uncut = [is_uncut(contour, surface, T, settings.reach_mm) for contour in contours]
        register_part = register_to_surface if all(uncut) else register_rigidly
        pose = register_part(contours, surface, T, reach_mm=settings.reach_mm)
        after = [moved(contour.curve, pose.T_scan_part) for contour in contours]
        shift = max(
            float(np.linalg.norm(a.points_mm - b.points_mm, axis=1).max()) for a, b in zip(near, after, strict=True)
        )
        if shift <= RECROP_SHARE * settings.reach_mm:
            break
        T = pose.T_scan_part
    return surface, pose, uncut


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
    uncut_at_start: bool,
) -> tuple[RegisteredContour, EdgeMeasurement]:
    rigid = moved(contour.curve, pose.T_scan_part)
    uncut = is_uncut(contour, surface, pose.T_scan_part, settings.reach_mm)
    if uncut and not uncut_at_start:
        raise RegistrationError(
            f"contour {number} slid off its edge onto the surface; give a better start pose (--align)"
        )
    if uncut and method not in ("sicp", "rigid"):
        raise RegistrationError(
            f"contour {number} is not cut yet, and the method {method} needs its edge; use --method sicp or rigid"
        )
    offset_mm, reach_mm = settings.edge_offset_mm, settings.reach_mm
    before = measure(rigid, surface, reach_mm=reach_mm, uncut=uncut, edge_offset_mm=offset_mm, rough=True)
    if not before.covered.any():
        raise RegistrationError(
            f"the scan shows no {'surface' if uncut else 'edge'} anywhere along contour {number};"
            " check that scan and part belong together and the start pose (--align)"
        )
    segments: tuple[Segment, ...] = ()
    splits, after = np.zeros(0), before
    corrected, stability = rigid, apply(pose.T_scan_part, contour.ring_points_mm)
    if method == "projection":
        corrected = project(contour, surface, pose.T_scan_part, settings)
        after = measure(corrected, surface, reach_mm=settings.reach_mm)
    elif method in ("sicp", "paper"):
        T = pose.T_scan_part
        if method == "sicp":
            divided = s_icp(contour, surface, T, settings, before, uncut=uncut)
        else:
            divided = paper_s_icp(contour, surface, T, settings)
        corrected, after, segments = divided.curve, divided.measured, divided.segments
        splits, stability = divided.subdivision.splits_mm, _stability(contour, divided)
    stated = method == "sicp" and settings.field
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
        on_curve(after.normal_u_mm, after, corrected) if stated and not uncut else None,
        on_curve(after.out_u_mm, after, corrected) if stated else None,
        after.leave_out if stated and not uncut else None,
        uncut,
    )
    return registered, after


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
    return Residuals(on_curve(measured.depth_mm, measured, curve), on_curve(measured.height_mm, measured, curve))
