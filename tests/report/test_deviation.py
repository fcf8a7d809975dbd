from __future__ import annotations

import numpy as np
import pytest

from sicp_cam.model import FloatArray, TriangleMesh
from sicp_cam.report.deviation import out_of_surface
from sicp_cam.report.deviation_colours import deviation_bar, deviation_colours

RADIUS = 500.0
UP = np.array([[0.0, 0.0, 1.0]])


def barrel(exact_normals: bool) -> TriangleMesh:
    """A piece of a cylinder along y in facets of 6 degrees, each with 0.7 mm of sag."""
    phi = np.radians(np.arange(-30.0, 31.0, 6.0))
    arc = np.stack([np.sin(phi), 0 * phi, np.cos(phi)], axis=1)
    ends = [RADIUS * arc + [0.0, y, 0.0] for y in (-200.0, 200.0)]
    n = len(phi)
    a = np.arange(n - 1)
    faces = np.vstack([np.stack([a, a + 1, a + 1 + n], axis=1), np.stack([a, a + 1 + n, a + n], axis=1)])
    return TriangleMesh(np.vstack(ends), faces, np.vstack([arc, arc]) if exact_normals else None)


def points_over(height: FloatArray) -> FloatArray:
    rng = np.random.default_rng(3)
    phi = np.radians(rng.uniform(-25, 25, len(height)))
    radius = RADIUS + height
    return np.stack([radius * np.sin(phi), rng.uniform(-150, 150, len(height)), radius * np.cos(phi)], axis=1)


def test_height_over_a_curved_surface_is_right_in_spite_of_coarse_facets() -> None:
    height = np.random.default_rng(0).uniform(-6.0, 6.0, 400)
    found = out_of_surface(points_over(height), barrel(True), np.array([[0, 0, RADIUS]]), UP)
    assert np.abs(found - height).max() < 0.02


def test_without_normals_the_triangles_are_taken_as_they_are() -> None:
    found = out_of_surface(points_over(np.zeros(400)), barrel(False), np.array([[0, 0, RADIUS]]), UP)
    sag = RADIUS * (1 - np.cos(np.radians(3.0)))
    assert found.min() > -0.01
    assert found.max() == pytest.approx(sag, rel=0.05)


def test_a_sagging_scan_is_measured_against_the_outer_skin(job) -> None:
    stations, outward = job.contour.nominal.points_mm, job.contour.nominal.outward
    points = np.array([[150.0, 0.0, -5.0], [0.0, 130.0, 4.0]])
    assert out_of_surface(points, job.mesh, stations, outward) == pytest.approx([-5.0, 4.0])


def test_points_beyond_the_edge_or_out_of_reach_have_no_deviation(job) -> None:
    stations, outward = job.contour.nominal.points_mm, job.contour.nominal.outward
    points = np.array([[0.0, 0.0, 0.5], [90.0, 0.0, 0.5], [150.0, 0.0, 80.0], [230.0, 0.0, 0.0]])
    assert np.isnan(out_of_surface(points, job.mesh, stations, outward)).all()


def test_no_points_no_faces_and_an_inverted_mesh_give_no_numbers(job) -> None:
    stations, outward = job.contour.nominal.points_mm, job.contour.nominal.outward
    point = np.array([[150.0, 0.0, 1.0]])
    nothing = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    outer_only = job.mesh.faces[: len(job.mesh.faces) // 2]
    inverted = TriangleMesh(job.mesh.vertices_mm, outer_only[:, ::-1])
    assert out_of_surface(np.zeros((0, 3)), job.mesh, stations, outward).shape == (0,)
    assert np.isnan(out_of_surface(point, nothing, stations, outward)).all()
    assert np.isnan(out_of_surface(point, inverted, stations, outward)).all()


def test_one_colour_within_the_tolerance_and_opposite_ones_outside() -> None:
    bar = deviation_bar(np.array([-4.0, 4.0]), 0.5)
    colours = deviation_colours(np.array([-0.5, 0.0, 0.5, 0.51, -0.51, 99.0, -99.0]), bar)
    neutral, above, below, far_above, far_below = colours[0], colours[3], colours[4], colours[5], colours[6]
    assert (colours[:3] == neutral).all()
    assert above[0] > above[2]
    assert below[2] > below[0]
    assert far_above[0] > far_above[2]
    assert far_above.sum() < above.sum()
    assert far_below[2] > far_below[0]
    assert far_below.sum() < below.sum()


@pytest.mark.parametrize("deviation", [[], [np.nan], [0.0], [0.1, -0.1]])
def test_limits_rise_even_if_nothing_leaves_the_tolerance(deviation: list[float]) -> None:
    bar = deviation_bar(np.array(deviation), 0.2)
    assert (np.diff(bar.limits) > 0).all()
    assert -0.2 in bar.limits
    assert 0.2 in bar.limits
    assert len(bar.colours) == len(bar.limits) - 1
