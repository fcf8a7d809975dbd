from __future__ import annotations

import io
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from sicp_cam.errors import ReportError
from sicp_cam.report import scenes
from sicp_cam.report.compose import PICTURES_FAILED, document, pictures
from sicp_cam.report.document import Verdict


@pytest.fixture(scope="module")
def drawn(job) -> dict[str, bytes]:
    found, findings = pictures(job.mesh, job.scan, job.registration, job.path_rigid, job.path_corrected, 0.5)
    assert findings == ()
    return found


def test_every_picture_is_there_and_has_a_content(drawn: dict[str, bytes]) -> None:
    assert set(drawn) == {
        *("error_1.png", "uncertainty_1.png", "correction_1.png"),
        *("deviation.png", "subdivision_1.png", "paths.png", "paths_enlarged.png"),
    }
    for name in ("deviation.png", "subdivision_1.png", "paths.png", "paths_enlarged.png"):
        picture = matplotlib.image.imread(io.BytesIO(drawn[name]), format="png")[:, :, :3]
        assert picture.shape == (1120, 1600, 3)
        scene = picture[110:1000].reshape(-1, 3)
        assert 0.01 < np.mean((scene < 0.99).any(axis=1)) < 0.99
        assert len(np.unique(np.round(255 * scene).astype(np.int64) @ [65536, 256, 1])) > 20


def test_the_deviation_picture_shows_the_bend_in_red(drawn: dict[str, bytes]) -> None:
    """The plate is bent outward by 1 to 3 mm: no point is below the surface, and hardly any within 0.5 mm."""
    picture = matplotlib.image.imread(io.BytesIO(drawn["deviation.png"]), format="png")[110:1000]
    red = (picture[:, :, 0] - picture[:, :, 2]) > 0.15
    blue = (picture[:, :, 2] - picture[:, :, 0]) > 0.05
    assert red.mean() > 0.05
    assert blue.mean() < 0.001


def test_a_failing_renderer_leaves_the_curves_and_a_finding(job, monkeypatch) -> None:
    monkeypatch.setattr(scenes, "_CHILD", "no_such_module_anywhere")
    found, findings = pictures(job.mesh, job.scan, job.registration, None, None, 0.5)
    assert set(found) == {"error_1.png", "uncertainty_1.png", "correction_1.png"}
    assert [finding.code for finding in findings] == [PICTURES_FAILED]
    assert "renderer failed" in findings[0].message


def test_a_contour_without_uncertainty_has_no_picture_of_it(job, monkeypatch) -> None:
    monkeypatch.setattr(scenes, "_CHILD", "no_such_module_anywhere")
    silent = replace(job.registration, contours=(job.with_contour(normal_u_mm=None, out_u_mm=None),))
    found, _ = pictures(job.mesh, job.scan, silent, None, None, 0.5)
    assert set(found) == {"error_1.png", "correction_1.png"}


def test_the_report_says_how_sure_the_contour_is_after_how_well_it_fits(result) -> None:
    titles = [table.title for table in document(result, {}, job="x").tables]
    assert titles[:4] == ["Inputs", "Residuals of the scan", "How sure the corrected contour is", "Gates"]
    made = document(result, {"uncertainty_1.png": b"", "deviation.png": b"", "error_1.png": b""}, job="x")
    captions = [picture.caption for picture in made.pictures]
    assert captions[1].startswith("Contour 1: how sure the corrected contour is. Band: 1.96 stated standard")
    assert captions[0].startswith("Contour 1: distance between")


def test_document_puts_pictures_in_reading_order(result) -> None:
    names = ["paths.png", "error_10.png", "correction_1.png", "error_2.png", "own.png", "deviation.png"]
    made = document(result, {name: name.encode() for name in names}, job="porthole", version="1.2")
    assert [picture.png.decode() for picture in made.pictures] == [
        *("error_2.png", "error_10.png", "deviation.png", "paths.png", "correction_1.png", "own.png"),
    ]
    assert made.pictures[1].caption.startswith("Contour 10: distance between scan and contour")
    assert "how well the curve fits the scan, not how true it is" in made.pictures[1].caption
    assert made.pictures[4].caption.startswith("Contour 1: what the correction adds")
    assert "are the borders of the segments. Each segment moves as one" in made.pictures[4].caption
    assert made.pictures[-1].caption == "own.png"
    assert made.verdict == Verdict.WARNINGS
    assert made.reasons[0] == "Gate axis_deg failed and was overridden: 16.25 against the limit 15."


def test_document_of_another_schema_is_refused(result) -> None:
    with pytest.raises(ReportError, match="'schema' is 'sicp-cam/9'"):
        document(result | {"schema": "sicp-cam/9"}, {}, job="x")


def test_document_does_not_depend_on_the_time_that_the_run_took(result) -> None:
    other = result | {"timing_s": {"total": 99.0}}
    assert document(result, {}, job="x") == document(other, {}, job="x")
