from __future__ import annotations

import io

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.text import Text

from sicp_cam.report import figures
from sicp_cam.report.figures import (
    AFTER,
    BEFORE,
    GAP,
    INTO,
    OUT,
    SEGMENT_STEPS,
    TURN,
    correction_along_contour,
    error_along_contour,
)
from sicp_cam.report.result_tables import FIT


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
    assert picture.shape == (1130, 1600, 3)
    assert len(np.unique(picture.reshape(-1, 3) @ [65536, 256, 1])) > 100
    gap_share = 1.0 - job.contour.covered.mean()
    assert count(png, BEFORE) > 1000
    assert count(png, AFTER) > 1000
    assert count(png, GAP) / (1130 * 1600) == pytest.approx(0.75 * gap_share, rel=0.3)


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
    assert pixels(png).shape == (850, 1600, 3)
    assert min(count(png, colour) for colour in (INTO, OUT, TURN)) > 200
    still = job.with_contour(corrected=job.contour.rigid)
    assert correction_along_contour(still) != png


def words(monkeypatch, draw) -> list[str]:
    """Return all texts of the figure that `draw` makes."""
    seen: list[str] = []

    def read(canvas: FigureCanvasAgg) -> bytes:
        seen.extend(text.get_text() for text in canvas.figure.findobj(Text) if text.get_text())
        return b""

    with monkeypatch.context() as patch:
        patch.setattr(figures, "png", read)
        draw()
    return seen


@pytest.mark.parametrize(
    ("method", "name"), [("sicp", "S-ICP (sicp)"), ("paper", "S-ICP as published (paper)"), ("own", "own")]
)
def test_error_names_contour_directions_and_method_and_says_what_it_is_not(job, monkeypatch, method, name) -> None:
    contour = job.with_contour(number=10)
    found = words(monkeypatch, lambda: error_along_contour(contour, method, 0.5))
    assert "Contour 10: distance to the scan along the contour" in found
    assert "both = sqrt(normal² + out²)\n/ mm" in found
    assert "normal (across the edge)\n+ into the material / mm" in found
    assert "out (of the surface)\n+ outward / mm" in found
    assert {"rigid ICP", name, FIT} <= set(found)
    assert "not how true it is" in FIT


def test_correction_names_the_contour_and_says_what_its_steps_are(job, monkeypatch) -> None:
    contour = job.with_contour(number=10)
    found = words(monkeypatch, lambda: correction_along_contour(contour))
    assert "Contour 10: correction of the path beyond the rigid pose" in found
    assert {"normal (across the edge), + into the material", "out (of the surface), + outward"} <= set(found)
    assert {SEGMENT_STEPS, "ticks: borders of the segments"} <= set(found)
    whole = job.with_contour(split_s_mm=np.zeros(0), segments=())
    assert not {SEGMENT_STEPS, "ticks: borders of the segments"} & set(
        words(monkeypatch, lambda: correction_along_contour(whole))
    )


def test_same_input_same_bytes_whatever_the_user_has_set(job, error_png: bytes) -> None:
    with matplotlib.rc_context({"axes.facecolor": "black", "font.size": 30.0, "lines.linewidth": 9.0}):
        second = error_along_contour(job.contour, "sicp", 0.5)
    assert error_png == second
    assert b"Software" not in error_png
