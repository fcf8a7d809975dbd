from __future__ import annotations

import io

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from sicp_cam.report.figures import AFTER, BEFORE, GAP, INTO, OUT, TURN, correction_along_contour, error_along_contour


def pixels(png: bytes) -> np.ndarray:
    return np.round(255 * matplotlib.image.imread(io.BytesIO(png), format="png")[:, :, :3]).astype(int)


def count(png: bytes, colour: str) -> int:
    wanted = np.round(255 * np.array(to_rgb(colour))).astype(int)
    return int((np.abs(pixels(png) - wanted).max(axis=2) <= 2).sum())


@pytest.fixture(scope="module")
def error_png(job) -> bytes:
    return error_along_contour(job.contour, "sicp", 0.5)


def test_error_shows_both_curves_and_the_gaps(job, error_png: bytes) -> None:
    png = error_png
    picture = pixels(png)
    assert picture.shape == (1100, 1600, 3)
    assert len(np.unique(picture.reshape(-1, 3) @ [65536, 256, 1])) > 100
    gap_share = 1.0 - job.contour.covered.mean()
    assert count(png, BEFORE) > 1000
    assert count(png, AFTER) > 1000
    assert count(png, GAP) / (1100 * 1600) == pytest.approx(0.75 * gap_share, rel=0.3)


def test_a_fully_covered_contour_has_no_gap(job) -> None:
    contour = job.with_contour(covered=np.ones_like(job.contour.covered))
    assert count(error_along_contour(contour, "sicp"), GAP) == 0


def test_the_rigid_method_has_one_curve(job) -> None:
    png = error_along_contour(job.contour, "rigid")
    assert count(png, AFTER) == 0
    assert count(png, BEFORE) > 1000


def test_nothing_seen_at_all_still_makes_a_figure(job) -> None:
    contour = job.with_contour(covered=np.zeros_like(job.contour.covered))
    assert count(error_along_contour(contour, "sicp", 0.5), GAP) > 500_000


def test_correction_shows_its_three_curves(job) -> None:
    png = correction_along_contour(job.contour)
    assert pixels(png).shape == (820, 1600, 3)
    assert min(count(png, colour) for colour in (INTO, OUT, TURN)) > 200
    still = job.with_contour(corrected=job.contour.rigid)
    assert correction_along_contour(still) != png


def test_same_input_same_bytes_whatever_the_user_has_set(job, error_png: bytes) -> None:
    with matplotlib.rc_context({"axes.facecolor": "black", "font.size": 30.0, "lines.linewidth": 9.0}):
        second = error_along_contour(job.contour, "sicp", 0.5)
    assert error_png == second
    assert b"Software" not in error_png
