from __future__ import annotations

import io

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from sicp_cam.report import figures
from sicp_cam.report.figures import (
    AFTER,
    BAND_MEANS,
    BEFORE,
    GAP,
    INTO,
    OUT,
    SEGMENT_STEPS,
    SURE,
    TURN,
    correction_along_contour,
    error_along_contour,
    uncertainty_along_contour,
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


def test_error_shows_both_curves_and_the_gaps(job) -> None:
    png = error_along_contour(job.with_contour(normal_u_mm=None, out_u_mm=None), "sicp", 0.5)
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


def drawn(monkeypatch, draw) -> Figure:
    """Return the figure that `draw` makes."""
    seen: list[Figure] = []

    def read(canvas: FigureCanvasAgg) -> bytes:
        seen.append(canvas.figure)
        return b""

    with monkeypatch.context() as patch:
        patch.setattr(figures, "png", read)
        draw()
    return seen[0]


def words(monkeypatch, draw) -> list[str]:
    """Return all texts of the figure that `draw` makes."""
    return [text.get_text() for text in drawn(monkeypatch, draw).findobj(Text) if text.get_text()]


def band(panel: Axes, s_mm: float) -> tuple[float, float]:
    """Return the lower and the upper end of the band that is drawn in a panel, at one arc length."""
    (fill,) = [each for each in panel.collections if isinstance(each, FillBetweenPolyCollection)]
    s, y = fill.get_paths()[0].vertices.T
    near = np.abs(s - s_mm) < 1.5
    return float(y[near].min()), float(y[near].max())


def test_the_band_is_95_percent_about_the_contour_and_goes_on_through_the_gaps(job, monkeypatch) -> None:
    """The made contour states 0.1 mm across the edge, 0.4 mm in its gaps, and 0.02 mm out of the surface."""
    seen, gap = job.contour.nominal.s_mm[150], job.contour.nominal.s_mm[50]
    for draw, first in (
        (lambda: error_along_contour(job.contour, "sicp"), 1),
        (lambda: uncertainty_along_contour(job.contour, "sicp"), 0),
    ):
        panels = drawn(monkeypatch, draw).axes
        assert band(panels[first], seen) == pytest.approx((-0.196, 0.196))
        assert band(panels[first], gap) == pytest.approx((-0.784, 0.784))
        assert band(panels[first + 1], seen) == pytest.approx((-0.0392, 0.0392))


def test_the_band_of_a_loop_ends_where_it_began(job, monkeypatch) -> None:
    u_mm = np.linspace(0.1, 0.2, len(job.contour.covered))
    contour = job.with_contour(normal_u_mm=u_mm)
    panel = drawn(monkeypatch, lambda: uncertainty_along_contour(contour, "sicp")).axes[0]
    assert band(panel, contour.nominal.length_mm) == pytest.approx((-1.96 * 0.1, 1.96 * 0.1)), "as at its beginning"
    assert band(panel, contour.nominal.s_mm[-1])[1] == pytest.approx(1.96 * 0.2)


def test_the_uncertainty_shows_residuals_band_and_gaps_and_says_what_the_band_is(job, monkeypatch) -> None:
    png = uncertainty_along_contour(job.contour, "sicp")
    assert pixels(png).shape == (850, 1600, 3)
    assert count(png, AFTER) > 1000 and count(png, SURE) > 20_000 and count(png, GAP) > 10_000
    assert count(png, BEFORE) == 0
    found = words(monkeypatch, lambda: uncertainty_along_contour(job.with_contour(number=10), "sicp"))
    assert {"Contour 10: how sure the corrected contour is", BAND_MEANS, "S-ICP (sicp)"} <= set(found)
    assert "95 % of the true edge should lie in it" in BAND_MEANS


def test_a_method_that_states_no_uncertainty_has_no_band(job, monkeypatch) -> None:
    silent = job.with_contour(normal_u_mm=None, out_u_mm=None)
    assert count(error_along_contour(silent, "paper", 0.5), SURE) == 0
    key = "95 % band of the corrected contour"
    assert count(error_along_contour(job.contour, "sicp", 0.5), SURE) > 1000
    assert key not in words(monkeypatch, lambda: error_along_contour(silent, "paper"))
    assert key in words(monkeypatch, lambda: error_along_contour(job.contour, "sicp"))


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
