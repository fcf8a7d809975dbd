"""One case by one method of the product: its error and the time of its registration."""

from __future__ import annotations

import time

import numpy as np
from cases import FOLDER, SAMPLES, Case, sample_truth
from truth import error

import sicp_cam
from sicp_cam.job.tables import GATES
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import RegistrationSettings

__all__ = ["METHODS", "from_files", "in_memory"]

METHODS = {
    "rigid": ("rigid", {}),
    "projection, parabola": ("projection", {"projection_surface": "parabola"}),
    "projection, spline": ("projection", {"projection_surface": "spline"}),
    "paper": ("paper", {}),
    "sicp": ("sicp", {}),
}
"""Method and settings of the registration by the name under which they are listed."""


def from_files(name: str, method: str) -> dict[str, float]:
    """Correct a sample from its files, as a user would, and measure the cutting moves."""
    word, settings = METHODS[method]
    folder = FOLDER / name
    result = sicp_cam.correct(
        cad=folder / "part.step",
        scan=folder / "scan.ply",
        path=folder / SAMPLES[name],
        align=folder / "pose_rough.txt",
        method=word,
        override=GATES,  # the rigid pose of a bent part is measured here, not used
        **{f"registration__{key}": value for key, value in settings.items()},
    )
    path = result.corrected.corrected
    cuts = np.array([status is not sicp_cam.Status.APPROACH for status in result.corrected.status])
    return error(path.tips_mm[cuts], path.axes[cuts], sample_truth(name))


def in_memory(case: Case, method: str) -> dict[str, float]:
    """Register the contour of a case in memory and measure the corrected curve; `time` is processor time in s."""
    word, settings = METHODS[method]
    begin = time.process_time()
    found = register_contours(
        {1: case.contour}, case.scan, case.T_start, method=word, settings=RegistrationSettings(**settings)
    )
    seconds = time.process_time() - begin
    curve = found.contours[0].corrected
    return error(curve.points_mm, curve.outward, case.truth) | {"time": seconds}
