from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from sicp_cam.model import ToolPath
from sicp_cam.report.camera import pixels
from sicp_cam.report.path_view import largest_correction, paths_scene
from sicp_cam.report.scenes import Arrows, Dots, Line
from sicp_cam.report.views import SHOWN_POINTS, deviation_scene, sample, subdivision_scene


def pieces(scene) -> list[Line]:
    return [layer for layer in scene.layers if isinstance(layer, Line) and layer.width_px == 8.0]


def length(line: Line) -> float:
    return float(np.linalg.norm(np.diff(line.points_mm, axis=0), axis=1).sum())


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 6, 7])
def test_pieces_cover_the_contour_and_neighbours_differ_in_colour(job, closed: bool, count: int) -> None:
    nominal = replace(job.contour.nominal, closed=closed)
    corrected = replace(job.contour.corrected, closed=closed)
    splits = (np.arange(count) + 0.5) / max(count, 1) * 600.0
    contour = job.with_contour(nominal=nominal, corrected=corrected, split_s_mm=splits)
    drawn = pieces(subdivision_scene(contour, job.registration))
    whole = np.vstack([corrected.points_mm, corrected.points_mm[:1]]) if closed else corrected.points_mm
    assert sum(length(line) for line in drawn) == pytest.approx(length(Line(whole, "", 1.0)), rel=1e-3)
    neighbours = [*pairwise(drawn), (drawn[-1], drawn[0])] if closed and len(drawn) > 1 else pairwise(drawn)
    assert all(a.colour != b.colour for a, b in neighbours)


def test_every_subdivision_and_stability_point_has_its_dot(job) -> None:
    dots = [layer for layer in subdivision_scene(job.contour, job.registration).layers if isinstance(layer, Dots)]
    assert [len(layer.points_mm) for layer in dots] == [len(job.contour.stability_scan_mm), 6]


def test_the_correction_is_true_to_scale_unless_the_title_says_otherwise(job) -> None:
    plain = paths_scene(job.mesh, job.path_rigid, job.path_corrected, job.registration)
    larger = paths_scene(job.mesh, job.path_rigid, job.path_corrected, job.registration, 10.0)
    assert "true to scale" in plain.lettering.subtitle
    assert "10 times larger" in larger.lettering.title
    assert "NOT true to scale" in larger.lettering.subtitle
    starts = [[layer.starts_mm for layer in scene.layers if isinstance(layer, Arrows)] for scene in (plain, larger)]
    assert starts[1][0] == pytest.approx(starts[0][0])
    assert starts[1][1] - starts[1][0] == pytest.approx(10.0 * (starts[0][1] - starts[0][0]))


def test_arrows_stand_on_cutting_moves_only_and_are_few(job) -> None:
    scene = paths_scene(job.mesh, job.path_rigid, job.path_corrected, job.registration)
    for layer in scene.layers:
        if isinstance(layer, Arrows):
            assert 20 <= len(layer.starts_mm) <= 44
    assert largest_correction(job.path_rigid, job.path_corrected) == pytest.approx(3.0, abs=1e-6)


def test_all_cutting_moves_are_drawn_and_in_view(job) -> None:
    scene = paths_scene(job.mesh, job.path_rigid, job.path_corrected, job.registration)
    drawn = np.vstack([layer.points_mm for layer in scene.layers if isinstance(layer, Line)])
    for path in (job.path_rigid, job.path_corrected):
        fed = path.tips_mm[:-1]  # with the start of the first feed move
        assert max(np.linalg.norm(drawn - tip, axis=1).min() for tip in fed) < 2.0 * scene.camera.mm_per_px
        placed = pixels(scene.camera, fed)
        assert ((placed > 0) & (placed < [1600, 900])).all()


def rapid_dots(scene) -> np.ndarray:
    dots = [layer.points_mm for layer in scene.layers if isinstance(layer, Dots)]
    assert (len(dots) == 1) == any("rapid" in key.text for key in scene.lettering.keys)
    return np.vstack([np.zeros((0, 3)), *dots])


def with_moves(path: ToolPath, tips: np.ndarray, rapid: list[bool]) -> ToolPath:
    count = len(tips)
    axes = np.tile(path.axes[0], (count, 1))
    return ToolPath(tips, axes, np.where(rapid, 0.0, 1200.0), np.array(rapid), np.arange(count))


def test_rapid_moves_are_dotted_from_where_they_start_to_where_they_end(job) -> None:
    scene = paths_scene(job.mesh, job.path_rigid, job.path_corrected, job.registration)
    dots = rapid_dots(scene)
    tips = job.path_corrected.tips_mm
    assert len(dots) > 5
    assert dots[[0, -1]] == pytest.approx(tips[-2:])
    steps = np.linalg.norm(np.diff(pixels(scene.camera, dots), axis=0), axis=1)
    assert steps == pytest.approx(np.full(len(steps), 13.0), rel=0.1)
    assert scene.lettering.keys[-1].colour not in ("#8a8a8a", "#d4d4d4", "#d0761f", "#1f4fa3")


@pytest.mark.parametrize("again", [0, 1])
def test_a_rapid_move_without_a_known_way_is_neither_drawn_nor_in_the_legend(job, again: int) -> None:
    """The first move comes from nobody knows where; a rapid to the same place has no length."""
    tips = job.path_corrected.tips_mm[:-1]
    tips = np.vstack([*[tips[:1]] * again, tips])
    rapid = [True] * (1 + again) + [False] * (len(tips) - 1 - again)
    path = with_moves(job.path_corrected, tips, rapid)
    assert len(rapid_dots(paths_scene(job.mesh, path, path, job.registration))) == 0


def test_rapid_moves_out_of_view_do_not_shrink_the_picture(job) -> None:
    tips = job.path_corrected.tips_mm[:-1]
    cut = with_moves(job.path_corrected, tips, [True] + [False] * (len(tips) - 1))
    home = np.array([[5e3, 0, 0], [5e3, 1e3, 0]])
    far = with_moves(job.path_corrected, np.vstack([home, tips]), [True] * 3 + [False] * (len(tips) - 1))
    away = with_moves(job.path_corrected, np.vstack([home, home[:1], tips]), [True] * 3 + [False] * len(tips))
    scenes = [paths_scene(job.mesh, path, path, job.registration) for path in (cut, far)]
    assert scenes[1].camera.mm_per_px == pytest.approx(scenes[0].camera.mm_per_px)
    placed = pixels(scenes[1].camera, rapid_dots(scenes[1]))
    assert len(placed) > 5
    assert ((placed >= 0) & (placed <= [1600, 900])).all()
    # Fed all the way from home, the whole way is wanted in view.
    assert paths_scene(job.mesh, away, away, job.registration).camera.mm_per_px > 3.0


def test_stability_points_are_counted_in_words(job) -> None:
    for count, told in ((1, "1 stability point,"), (2, "2 stability points,"), (0, "0 stability points,")):
        points = job.contour.stability_scan_mm[:count]
        contour = job.with_contour(stability_scan_mm=points)
        assert told in subdivision_scene(contour, job.registration).lettering.subtitle


def test_a_large_scan_is_thinned_evenly_and_the_picture_says_so(job) -> None:
    chosen = sample(SHOWN_POINTS * 3)
    assert len(np.unique(chosen)) == SHOWN_POINTS
    assert chosen.mean() == pytest.approx(1.5 * SHOWN_POINTS, rel=0.01)
    assert sample(10).tolist() == list(range(10))
    points = job.scan.points_mm
    deviation = np.zeros(len(points))
    whole = deviation_scene(job.mesh, points, deviation, job.registration, 0.5, len(points))
    part = deviation_scene(job.mesh, points, deviation, job.registration, 0.5, 9_000_000)
    assert "drawn" not in whole.lettering.subtitle
    assert f"{len(points):,} of the scan's 9,000,000 points drawn" in part.lettering.subtitle


def test_a_scan_without_points_near_the_contour_makes_a_scene_all_the_same(job) -> None:
    scene = deviation_scene(job.mesh, np.zeros((0, 3)), np.zeros(0), job.registration, 0.5, 100)
    assert "0 of the scan's 100 points drawn" in scene.lettering.subtitle
