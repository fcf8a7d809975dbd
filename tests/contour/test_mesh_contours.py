import numpy as np
import pytest

from sicp_cam.contour.frames import framed
from sicp_cam.contour.mesh_contours import mesh_contours
from sicp_cam.model import TriangleMesh


def grid_mesh(hole_cells=6, cells=24, size=240.0, curved=0.0):
    """Return a square sheet z = curved x^2 with a square hole, in triangles of 10 mm."""
    axis = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    x, y = (a.ravel() for a in np.meshgrid(axis, axis, indexing="ij"))
    quads = [(i, j) for i in range(cells) for j in range(cells)]
    low, high = (cells - hole_cells) // 2, (cells + hole_cells) // 2
    faces = []
    for i, j in quads:
        if low <= i < high and low <= j < high:
            continue
        a, b, c, d = (k * (cells + 1) + m for k, m in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
        faces += [(a, b, c), (a, c, d)]
    return TriangleMesh(np.column_stack([x, y, curved * x * x]), np.array(faces))


@pytest.fixture(scope="module")
def sheet():
    return mesh_contours(grid_mesh())


def test_the_outer_edge_and_the_hole_are_found_longest_first(sheet):
    assert [round(contour.length_mm, 6) for contour in sheet] == [960.0, 240.0]
    assert all(contour.closed for contour in sheet)


def test_the_material_lies_to_the_left_of_the_travel(sheet):
    for contour, sign in zip(sheet, (1.0, -1.0), strict=True):
        curve = framed(contour)
        area = 0.5 * np.sum(np.cross(curve.points_mm, np.roll(curve.points_mm, -1, axis=0))[:, 2])
        assert np.sign(area) == sign
        middle = np.sum(curve.inward * -curve.points_mm, axis=1) * sign
        assert (middle > 0.0).all()
        np.testing.assert_allclose(curve.outward, np.tile([0.0, 0, 1], (len(curve), 1)), atol=1e-12)


def test_samples_stand_on_the_sides_at_most_a_millimetre_apart(sheet):
    for contour, half in zip(sheet, (120.0, 30.0), strict=True):
        steps = np.linalg.norm(np.diff(np.vstack([contour.points_mm, contour.points_mm[:1]]), axis=0), axis=1)
        assert steps.max() <= 1.0 + 1e-9
        np.testing.assert_allclose(np.abs(contour.points_mm[:, :2]).max(axis=1), half, atol=1e-9)


def test_the_corners_are_marked_and_have_the_bisector(sheet):
    for contour, half in zip(sheet, (120.0, 30.0), strict=True):
        assert len(contour.corners) == 4
        np.testing.assert_allclose(np.abs(contour.points_mm[contour.corners, :2]), half, atol=1e-9)
        np.testing.assert_allclose(np.abs(contour.tangents[contour.corners, :2]), np.sqrt(0.5), atol=1e-9)


def test_stability_points_lie_on_the_surface_ten_and_thirty_millimetres_inside():
    for contour in mesh_contours(grid_mesh(curved=4e-4)):
        points, normals = contour.ring_points_mm, contour.ring_normals
        cell = 10.0
        left = np.floor(points[:, 0] / cell) * cell  # the sheet is a polygon between its vertices
        chord = 4e-4 * (left**2 + (2 * left + cell) * (points[:, 0] - left))
        np.testing.assert_allclose(points[:, 2], chord, atol=1e-6)
        assert (np.sum(normals * [0.0, 0.0, 1.0], axis=1) > 0.99).all()
        inside = np.abs(points[:, None] - contour.points_mm).max(axis=2).min(axis=1)
        assert np.isin(np.round(inside), [10.0, 9.0, 30.0, 29.0, 28.0]).mean() > 0.8
        assert len(points) > 0.3 * contour.length_mm / 4.0


def test_on_a_narrow_strip_no_stability_point_hangs_in_the_air():
    strip = mesh_contours(grid_mesh(hole_cells=22))  # 10 mm of material between hole and edge
    for contour in strip:
        reach = np.abs(contour.ring_points_mm[:, :2]).max(axis=1)
        assert ((reach >= 110.0 - 1e-6) & (reach <= 120.0 + 1e-6)).all()


def test_a_fine_circle_has_no_corner_and_smooth_tangents(synthetic):
    outlines = [synthetic.circle(40.0)]
    angle = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
    inner, outer = (r * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) for r in (40.0, 80.0))
    i = np.arange(90)
    j = (i + 1) % 90
    faces = np.concatenate([np.stack([i, i + 90, j + 90], axis=1), np.stack([i, j + 90, j], axis=1)])
    contours = mesh_contours(TriangleMesh(np.vstack([inner, outer]), faces))
    hole = contours[1]
    assert hole.length_mm == pytest.approx(outlines[0].length_mm, rel=1e-3)
    assert len(hole.corners) == 0
    radial = hole.points_mm / np.linalg.norm(hole.points_mm, axis=1, keepdims=True)
    assert np.degrees(np.arcsin(np.abs(np.sum(radial * hole.tangents, axis=1)))).max() < 1.2
    assert np.sum(framed(hole).inward * radial, axis=1).min() > 0.999


def test_a_watertight_mesh_has_no_contour():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert mesh_contours(TriangleMesh(vertices, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))) == ()
