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


def closed_plate(sides=96, half=120.0, radius=30.0, thickness=8.0):
    """Return a watertight square plate z = 0..thickness with a bore of `sides` facets, its axis at the origin."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = half * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square /= np.abs(square).max(axis=1, keepdims=True) / half  # sides divisible by 8: the corners are hit
    flat = np.vstack([circle, square])
    top, low = (np.column_stack([flat, np.full(len(flat), z)]) for z in (thickness, 0.0))
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    inner, outer, below = 0, sides, 2 * sides

    def quads(a, b, c, d):
        return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])

    skin = quads(i + inner, i + outer, j + outer, j + inner)
    outer_wall = quads(i + outer + below, j + outer + below, j + outer, i + outer)
    bore = quads(i + inner, j + inner, j + below, i + below)
    return TriangleMesh(np.vstack([top, low]), np.concatenate([skin, skin[:, ::-1] + below, outer_wall, bore]))


def sphere(radius=40.0):
    import trimesh

    ball = trimesh.creation.icosphere(3, radius)
    return TriangleMesh(ball.vertices, ball.faces)


@pytest.fixture(scope="module")
def plate():
    return mesh_contours(closed_plate())


def skins(contours):
    """Return the contours whose normal stands along z."""
    return [each for each in contours if (np.abs(each.normals[:, 2]) > 0.999).all()]


def test_the_plate_is_watertight():
    import trimesh

    mesh = closed_plate()
    solid = trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    assert solid.volume == pytest.approx((240.0**2 - 0.5 * 96 * 30.0**2 * np.sin(2 * np.pi / 96)) * 8.0)


def test_a_plate_gives_outline_and_hole_on_either_skin(plate):
    found = skins(plate)
    assert len(found) == 4
    for each in found:
        up = each.normals[0, 2]
        np.testing.assert_allclose(each.normals, np.tile([0.0, 0, np.sign(up)], (len(each.points_mm), 1)), atol=1e-12)
        np.testing.assert_allclose(each.points_mm[:, 2], 8.0 if up > 0 else 0.0, atol=1e-12)
    lengths = sorted(round(each.length_mm, 6) for each in found)
    hole = 96 * 2.0 * 30.0 * np.sin(np.pi / 96)
    np.testing.assert_allclose(lengths, [hole, hole, 960.0, 960.0], rtol=1e-9)
    holes = [each for each in found if each.length_mm < 200.0]
    for each in holes:
        radii = np.linalg.norm(each.points_mm[:, :2], axis=1)
        assert radii.max() <= 30.0 + 1e-9 and radii.min() >= 30.0 * np.cos(np.pi / 96) - 1e-9
        assert len(each.corners) == 0
    assert [len(each.corners) for each in found if each.length_mm > 200.0] == [4, 4]


def test_the_material_of_a_plate_lies_to_the_left_on_both_skins(plate):
    for each in skins(plate):
        inward = framed(each).inward
        outwards = np.sum(inward[:, :2] * framed(each).points_mm[:, :2], axis=1)
        assert (outwards > 0.0).all() if each.length_mm < 200.0 else (outwards < 0.0).all()
        assert len(each.ring_points_mm) > 0.3 * each.length_mm / 4.0
        np.testing.assert_allclose(each.ring_points_mm[:, 2], each.points_mm[0, 2], atol=1e-9)


def test_the_walls_of_a_plate_have_loops_of_their_own(plate):
    walls = [each for each in plate if each not in skins(plate)]
    around = [round(each.length_mm) for each in walls]
    assert sorted(around) == [188, 188, 496, 496, 496, 496]
    bore = [each for each in walls if each.length_mm < 200.0]
    for each in bore:
        radial = each.points_mm[:, :2] / np.linalg.norm(each.points_mm[:, :2], axis=1, keepdims=True)
        assert np.sum(each.normals[:, :2] * radial, axis=1).max() < -0.99


def test_a_plate_that_is_inside_out_gives_the_same_contours(plate):
    mesh = closed_plate()
    turned = mesh_contours(TriangleMesh(mesh.vertices_mm, mesh.faces[:, ::-1]))
    for each, other in zip(plate, turned, strict=True):
        assert each.length_mm == pytest.approx(other.length_mm)
        np.testing.assert_allclose(each.normals.mean(axis=0), other.normals.mean(axis=0), atol=1e-9)


def test_slivers_do_not_tear_a_skin_apart():
    mesh = closed_plate()
    a, b, c = mesh.faces[0]
    # a vertex a rounding error off the side that two triangles of the skin share, as exports of trimmed faces have them
    middle = 0.5 * (mesh.vertices_mm[a] + mesh.vertices_mm[c]) + [0.0, 0.0, 2e-5]
    new = len(mesh.vertices_mm)
    faces = np.vstack([mesh.faces[1:], [[a, b, new], [b, c, new], [a, new, c]]])
    found = skins(mesh_contours(TriangleMesh(np.vstack([mesh.vertices_mm, middle]), faces)))
    assert len(found) == 4


def test_a_seam_of_rounding_errors_is_no_open_edge(plate):
    mesh = closed_plate()
    bore = np.arange(len(mesh.faces) - 192, len(mesh.faces))
    used, corners = np.unique(mesh.faces[bore], return_inverse=True)
    moved = mesh.vertices_mm[used] + 3e-6  # under half a unit in the last place of 120 mm
    faces = np.vstack([mesh.faces[: bore[0]], corners.reshape(-1, 3) + len(mesh.vertices_mm)])
    torn = mesh_contours(TriangleMesh(np.vstack([mesh.vertices_mm, moved]), faces))
    assert [round(each.length_mm, 3) for each in torn] == [round(each.length_mm, 3) for each in plate]


def test_smooth_and_rough_closed_meshes_have_no_contour():
    ball = sphere()
    assert mesh_contours(ball) == ()
    rough = ball.vertices_mm + np.random.default_rng(5).normal(0.0, 3.0, ball.vertices_mm.shape)
    assert mesh_contours(TriangleMesh(rough, ball.faces)) == ()


def test_a_speck_on_a_smooth_mesh_is_no_contour():
    ball = sphere(1.0)
    points = ball.vertices_mm.copy()
    points[100] *= 1.12
    assert mesh_contours(TriangleMesh(points, ball.faces)) == ()
