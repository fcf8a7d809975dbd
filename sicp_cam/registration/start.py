"""Find the start pose from the geometry alone: the contour signature.

The nominal loop and each loop of the scan are resampled to equally many points. A fast Fourier transform gives the
cross-covariance of every cyclic shift at once, its singular value decomposition the rotation, and what is left over
the misfit. Every separate minimum is refined by the rigid registration, surface included, and only a pose that fits
clearly better than every other one is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.contour.frames import FramedCurve, at, moved
from sicp_cam.contour.loops import mesh_loops, resampled, rim_loops
from sicp_cam.contour.projection import nearest
from sicp_cam.errors import AmbiguousPoseError, RegistrationError
from sicp_cam.model import FloatArray
from sicp_cam.registration.rigid import NominalContour, register_rigidly, thinned
from sicp_cam.registration.scan_surface import ScanSurface, distances_along_normal
from sicp_cam.rigid_motion import apply, best_fit, from_parts, rotate

__all__ = [
    "Start",
    "congruent",
    "find_start",
    "is_circular",
    "is_symmetric",
    "scan_loops",
    "side_ratio",
    "signature_poses",
]

SIGNATURE_POINTS = 256
LENGTH_TOLERANCE = 0.2
POSES_PER_LOOP = 8
WORTH_REFINING = 4.0
"""Poses whose signature fits this many times worse than the best one's are not looked at further."""
REFINING_STEPS = 20
SELF_MISFIT = 0.01
"""Misfit of a contour to itself, over its size, below which it counts as falling onto itself."""
CLEAR_RATIO = 1.5
"""How much worse every other pose must fit before the best one is believed."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """A start pose and how clear it is.

    Parameters
    ----------
    T_scan_part
        (4, 4) pose, refined by the rigid registration.
    misfit_mm
        Root mean square distance of scan and part there.
    symmetry
        Misfit of the best pose that would put the path elsewhere, over this one; `WORTH_REFINING` if there is none.
    """

    T_scan_part: FloatArray
    misfit_mm: float
    symmetry: float


def scan_loops(surface: ScanSurface, length_mm: float) -> list[FloatArray]:
    """Return the closed loops of the scan whose length is within 20 % of the given one, best match first."""
    if surface.faces is not None:
        loops = [surface.points_mm[index] for index, closed in mesh_loops(surface.faces) if closed]
    else:
        loops = rim_loops(surface.rim, surface.spacing_mm, (1.0 - LENGTH_TOLERANCE) * length_mm)
    off = [abs(resampled(loop, SIGNATURE_POINTS)[1] / length_mm - 1.0) for loop in loops]
    order = np.argsort(off)
    return [loops[i] for i in order if off[i] <= LENGTH_TOLERANCE]


def signature_poses(nominal: FloatArray, measured: FloatArray) -> list[tuple[float, FloatArray]]:
    """Fit a nominal loop to a measured one at every cyclic shift and in both senses.

    Parameters
    ----------
    nominal, measured
        (n, 3) equally many points at equal arc lengths.

    Returns
    -------
    list of (misfit in mm, (4, 4) pose), one for each local minimum over the shift, best first.
    """
    found = []
    for sense in (1, -1):
        target = measured[::sense]
        misfit = _misfit_of_shifts(nominal, target)
        lowest = (misfit <= np.roll(misfit, 1)) & (misfit < np.roll(misfit, -1))
        # A flat misfit (a circle) has no minimum worth the name: any one shift stands for all.
        shifts = np.flatnonzero(lowest) if lowest.any() else np.array([int(np.argmin(misfit))])
        found += [(float(misfit[k]), best_fit(nominal, np.roll(target, -k, axis=0))) for k in shifts]
    return sorted(found, key=lambda item: item[0])


def _misfit_of_shifts(nominal: FloatArray, measured: FloatArray) -> FloatArray:
    a, b = nominal - nominal.mean(axis=0), measured - measured.mean(axis=0)
    spectrum = np.conj(np.fft.fft(a, axis=0))[:, :, None] * np.fft.fft(b, axis=0)[:, None, :]
    covariance = np.fft.ifft(spectrum, axis=0).real  # [k] = sum_i a_i b_(i+k)^T
    singular = np.linalg.svd(covariance, compute_uv=False)
    singular[:, 2] *= np.sign(np.linalg.det(covariance))
    square = np.sum(a * a) + np.sum(b * b) - 2.0 * singular.sum(axis=1)
    return np.asarray(np.sqrt(np.maximum(square, 0.0) / len(nominal)))


def find_start(
    contours: Sequence[NominalContour],
    surface: ScanSurface,
    *,
    reach_mm: float,
) -> Start:
    """Find the pose of the part in the scan from any starting pose.

    Raises
    ------
    RegistrationError
        If no loop of the scan has the length of the contour, or none fits.
    AmbiguousPoseError
        If poses that would put the path or its outward side elsewhere fit about equally well.
    """
    main = max(contours, key=lambda contour: contour.curve.length_mm)
    nominal = at(main.curve, np.arange(SIGNATURE_POINTS) * main.curve.length_mm / SIGNATURE_POINTS).points_mm
    loops = scan_loops(surface, main.curve.length_mm) if main.curve.closed else []
    if not loops:
        raise RegistrationError(
            f"no closed edge of the scan is about {main.curve.length_mm:.0f} mm long, as the contour is;"
            " give a rough pose or datum pairs with --align FILE"
        )
    poses = [pose for loop in loops[:4] for pose in _candidates(nominal, loop)]
    least = min(misfit for misfit, _ in poses)
    worth = [T for misfit, T in sorted(poses, key=lambda item: item[0]) if misfit <= WORTH_REFINING * least]
    tried = [_refined(contours, surface, T, reach_mm) for T in worth[: 2 * POSES_PER_LOOP]]
    refined = [start for start in tried if start is not None]
    if not refined:
        raise RegistrationError(
            "no edge of the scan fits the contour; check that scan and part belong together,"
            " or give a rough pose or datum pairs with --align FILE"
        )
    return _clearest(refined, main.curve, is_circular(nominal))


def is_symmetric(curve: FramedCurve) -> bool:
    """Say whether a closed contour nearly falls onto itself when it is turned or turned over."""
    if not curve.closed:
        return False
    points = at(curve, np.arange(SIGNATURE_POINTS) * curve.length_mm / SIGNATURE_POINTS).points_mm
    size = float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))
    far = slice(SIGNATURE_POINTS // 20, -(SIGNATURE_POINTS // 20))
    turned_over = _misfit_of_shifts(points, points[::-1]).min()
    return bool(min(_misfit_of_shifts(points, points)[far].min(), turned_over) < SELF_MISFIT * size)


def congruent(a: FramedCurve, b: FramedCurve) -> bool:
    """Say whether two closed contours have one shape, so that neither can be told from the other by it."""
    if not (a.closed and b.closed) or abs(a.length_mm / b.length_mm - 1.0) > SELF_MISFIT:
        return False
    shapes = [at(c, np.arange(SIGNATURE_POINTS) * c.length_mm / SIGNATURE_POINTS).points_mm for c in (a, b)]
    size = float(np.sqrt(np.mean(np.sum((shapes[0] - shapes[0].mean(axis=0)) ** 2, axis=1))))
    return bool(min(_misfit_of_shifts(shapes[0], shapes[1][::sense]).min() for sense in (1, -1)) < SELF_MISFIT * size)


def is_circular(nominal: FloatArray) -> bool:
    """Say whether a closed loop of (n, 3) evenly spaced points falls onto itself at every cyclic shift."""
    size = float(np.sqrt(np.mean(np.sum((nominal - nominal.mean(axis=0)) ** 2, axis=1))))
    return bool(_misfit_of_shifts(nominal, nominal).max() < SELF_MISFIT * size)


def _candidates(nominal: FloatArray, loop: FloatArray) -> list[tuple[float, FloatArray]]:
    measured, _ = resampled(loop, SIGNATURE_POINTS)
    return signature_poses(nominal, measured)[:POSES_PER_LOOP]


def _refined(
    contours: Sequence[NominalContour],
    surface: ScanSurface,
    T: FloatArray,
    reach_mm: float,
) -> tuple[float, FloatArray] | None:
    try:
        pose = register_rigidly(*thinned(contours, surface), T, reach_mm=reach_mm, iterations=REFINING_STEPS)
    except RegistrationError:
        return None
    if _outward_agreement(contours, surface, pose.T_scan_part) < 0.0:
        return None  # the scan's own normals say that this is the other side
    misfit = _misfit(contours, surface, pose.T_scan_part, reach_mm)
    return (misfit, pose.T_scan_part) if np.isfinite(misfit) else None


def _outward_agreement(contours: Sequence[NominalContour], surface: ScanSurface, T: FloatArray) -> float:
    """Return the mean cosine between the part's outward normals and the normals that came with the scan, 0 if none."""
    if surface.normals is None:
        return 0.0
    points = np.concatenate([contour.ring_points_mm for contour in contours])
    normals = np.concatenate([contour.ring_normals for contour in contours])
    _, index = surface.tree.query(apply(T, points))
    return float(np.sum(surface.normals[index] * rotate(T, normals), axis=1).mean()) if len(points) else 0.0


def _misfit(contours: Sequence[NominalContour], surface: ScanSurface, T: FloatArray, reach_mm: float) -> float:
    """Return the RMS distance of stability points from the scan's surface, and of contour points from its rim.

    What finds nothing counts a quarter of the reach, so that an opening that the scan does not have speaks against a
    pose; infinite where most stability points find no surface.
    """
    missing_mm = 0.25 * reach_mm
    points = np.concatenate([contour.ring_points_mm for contour in contours])
    normals = np.concatenate([contour.ring_normals for contour in contours])
    out = np.zeros(1)
    if len(points):
        out, _ = distances_along_normal(surface, apply(T, points), rotate(T, normals), reach_mm)
        if np.isnan(out).mean() > 0.5:
            return float("inf")
        out = np.where(np.isnan(out), missing_mm, np.clip(out, -missing_mm, missing_mm))
    if not len(surface.rim.points_mm):
        return float("inf")
    stations = [at(c.curve, np.linspace(0.0, c.curve.length_mm, SIGNATURE_POINTS, endpoint=False)) for c in contours]
    edge = np.concatenate([apply(T, station.points_mm) for station in stations])
    across, _ = cKDTree(surface.rim.points_mm).query(edge)
    return float(np.sqrt(np.mean(out**2) + np.mean(np.minimum(across, missing_mm) ** 2)))


def side_ratio(
    contours: Sequence[NominalContour], surface: ScanSurface, T_scan_part: FloatArray, *, reach_mm: float
) -> float:
    """Compare a given pose with the part turned over about the two axes in its contour's plane.

    The outward side of a scan of a thin sheet is not in its points. A fixture's pose decides it; but a pose typed with
    a wrong sign puts the tool on the wrong side of the part, and where the part is curved, the curvature tells.

    Returns
    -------
    float
        Misfit of the pose over that of the better turned-over one: well below 1 where the side is right.

    Raises
    ------
    AmbiguousPoseError
        If the scan's own normals point to the other side.
    """
    if _outward_agreement(contours, surface, T_scan_part) < 0.0:
        raise AmbiguousPoseError(
            "the normals of the scan point to the inner side of the part, as the start pose has it;"
            " turn the pose over in --align FILE, or the normals in the scan"
        )
    points = np.concatenate([moved(contour.curve, T_scan_part).points_mm for contour in contours])
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
    turned = [2.0 * np.outer(axis, axis) - np.eye(3) for axis in axes[:2]]
    over = [from_parts(R, centre - R @ centre) @ T_scan_part for R in turned]
    misfits = [refined[0] for T in over if (refined := _refined(contours, surface, T, reach_mm))]
    given = _misfit(contours, surface, T_scan_part, reach_mm)
    return given / max(min(misfits), 1e-9) if misfits else 0.0


def _clearest(refined: list[tuple[float, FloatArray]], curve: FramedCurve, circular: bool) -> Start:
    refined = sorted(refined, key=lambda item: item[0])
    misfit, T = refined[0]
    for other_misfit, other in refined[1:]:
        difference = _difference(T, other, curve, circular)
        if difference is None:
            continue
        ratio = other_misfit / max(misfit, 1e-9)
        if ratio < CLEAR_RATIO:
            raise AmbiguousPoseError(
                f"the contour is symmetric: a pose with {difference} fits about as well as the best one"
                f" (misfit {other_misfit:.2f} and {misfit:.2f} mm); give a rough pose or datum pairs with --align FILE"
            )
        return Start(T, misfit, ratio)
    return Start(T, misfit, WORTH_REFINING)


def _difference(T: FloatArray, other: FloatArray, curve: FramedCurve, circular: bool) -> str | None:
    """Say in what two poses differ that matters to the operator; None if they are the same pose.

    Turning a circle about its own axis moves no point off the path, so it does not matter.
    """
    a, b = moved(curve, T), moved(curve, other)
    if float(a.outward.mean(axis=0) @ b.outward.mean(axis=0)) < 0.0:
        return "the other side outward"
    apart = nearest(b.points_mm, a)[1] if circular else np.linalg.norm(a.points_mm - b.points_mm, axis=1)
    if float(np.median(apart)) < 0.005 * curve.length_mm:
        return None
    return f"the path moved or turned by {np.median(apart):.0f} mm"
