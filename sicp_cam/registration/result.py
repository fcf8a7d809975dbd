"""What a registration yields: the corrected contours with everything that was measured on the way."""

from __future__ import annotations

from dataclasses import dataclass

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.findings import Finding
from sicp_cam.model import BoolArray, FloatArray

__all__ = ["LeaveOut", "RegisteredContour", "Registration", "Residuals", "Segment"]


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Where the scan lies, seen from a curve, at each of its k stations; NaN where the scan shows nothing.

    Parameters
    ----------
    normal_mm
        (k,) scan edge minus curve along B: positive where the scan edge lies further into the material.
    out_mm
        (k,) scan surface minus curve along N: positive where the scan lies outside of the curve.
    """

    normal_mm: FloatArray
    out_mm: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """One piece of the subdivided contour and its own rigid motion.

    Parameters
    ----------
    start_mm, end_mm
        Arc lengths between which it is used, overlaps included; `end_mm` may exceed the length of a closed contour.
    T_scan_part
        (4, 4) motion of this segment, mm.
    rms_mm
        Root mean square of its residuals after registration.
    """

    start_mm: float
    end_mm: float
    T_scan_part: FloatArray
    rms_mm: float


@dataclass(frozen=True, slots=True)
class LeaveOut:
    """Root mean square difference of the contours found from the even and from the odd points of the scan, mm.

    Parameters
    ----------
    normal_mm, out_mm
        Along B and along N.
    """

    normal_mm: float
    out_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class RegisteredContour:
    """A nominal contour and where the scan says that it is.

    All curves have the same k stations. `nominal` is in the part frame, everything else in the scan frame.

    Parameters
    ----------
    number
        Number of the contour in the part, from 1, as `inspect` shows it.
    nominal, rigid, corrected
        The curve as designed, after the rigid registration, and after the chosen method.
    covered
        (k,) True where the scan shows the edge.
    scan_edge_mm
        (m, 3) scan points that were taken for the edge.
    before, after
        Residuals of the scan against `rigid` and against `corrected`.
    segments
        The pieces of S-ICP in order; empty for the rigid method.
    split_s_mm
        (p,) arc lengths of the subdivision points.
    stability_part_mm, stability_scan_mm
        (q, 3) stability points as designed and as registered.
    symmetric
        True if the nominal contour falls onto itself when it is turned or turned over.
    normal_u_mm, out_u_mm
        (k,) standard uncertainty of `corrected` along B and along N; None where the method states none, and along B
        where the contour is not cut yet.
    leave_out
        How well half of the scan predicts the other half; None where the method does not look.
    uncut
        True where the scan goes on beyond the contour: in the surface it lies as the start pose has it.
    """

    number: int
    nominal: FramedCurve
    rigid: FramedCurve
    corrected: FramedCurve
    covered: BoolArray
    scan_edge_mm: FloatArray
    before: Residuals
    after: Residuals
    segments: tuple[Segment, ...]
    split_s_mm: FloatArray
    stability_part_mm: FloatArray
    stability_scan_mm: FloatArray
    symmetric: bool = False
    normal_u_mm: FloatArray | None = None
    out_u_mm: FloatArray | None = None
    leave_out: LeaveOut | None = None
    uncut: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The registration of a part to a scan.

    Parameters
    ----------
    method
        `rigid`, `projection`, `paper` or `sicp`.
    T_scan_part
        (4, 4) the rigid pose, mm.
    contours
        One entry per registered contour.
    spacing_mm, noise_mm
        Point spacing and out-of-surface noise (standard deviation) of the scan near the contours.
    freedoms
        (6,) singular values of the rigid problem, scaled by the radius of gyration, largest first, between 0 and 1.
    symmetry
        Misfit of the next best start pose over that of the one taken; None where the start was given.
    side
        Misfit of the pose over that of the part turned over, see `start.side_ratio`; None where the start was found.
    findings
        What was noticed on the way.
    """

    method: str
    T_scan_part: FloatArray
    contours: tuple[RegisteredContour, ...]
    spacing_mm: float
    noise_mm: float
    freedoms: FloatArray
    symmetry: float | None = None
    side: float | None = None
    findings: tuple[Finding, ...] = ()
