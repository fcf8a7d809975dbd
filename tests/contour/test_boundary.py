import numpy as np
import pytest
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import (
    cloud_rim,
    local_planes,
    mesh_boundary_edges,
    mesh_rim,
    surface_normals,
    without,
)
from sicp_cam.model import Scan
from sicp_cam.registration.scan_surface import without_copies
from sicp_cam.rigid_motion import apply, rotate

SPACING = 2.0


def square_cloud(count=30, jitter=0.3, noise=0.03, seed=0):
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2) * SPACING
    flat = grid + rng.uniform(-jitter, jitter, grid.shape)
    on_border = ((grid == 0.0) | (grid == SPACING * (count - 1))).any(axis=1)
    return np.column_stack([flat, rng.normal(0.0, noise, len(flat))]), on_border


def rim_of(points):
    return cloud_rim(points, local_planes(points, cKDTree(points)))


@pytest.fixture(scope="module")
def annulus(synthetic):
    """A ring between radii 40 and 80 as a mesh: vertices (n, 3) and faces."""
    outlines = [synthetic.circle(40.0), synthetic.circle(80.0, hole=False)]
    uv = synthetic.material(outlines, spacing_mm=SPACING)
    return np.column_stack([uv, np.zeros(len(uv))]), synthetic.triangles(uv, SPACING, outlines)


def test_the_rim_of_a_square_cloud_is_its_border(synthetic):
    points, on_border = square_cloud()
    T = synthetic.random_pose(1)
    rim = rim_of(apply(T, points))
    found = np.zeros(len(points), dtype=bool)
    found[rim.indices] = True
    assert found[on_border].mean() > 0.95
    assert not found[~on_border].any()
    np.testing.assert_array_equal(rim.points_mm, apply(T, points)[rim.indices])


def test_the_open_side_of_a_square_cloud_looks_out_of_it(synthetic):
    points, _ = square_cloud()
    T = synthetic.random_pose(2)
    rim = rim_of(apply(T, points))
    away = points[rim.indices] - points.mean(axis=0)
    sides = np.abs(away[:, :2]).argmax(axis=1)
    outward = np.eye(3)[sides] * np.sign(away[np.arange(len(away)), sides])[:, None]
    inner = np.sort(np.abs(away[:, :2]), axis=1)[:, 0] < 0.8 * np.abs(away).max()  # at corners both sides are right
    assert np.sum(rim.open_directions * rotate(T, outward), axis=1)[inner].min() > 0.6
    np.testing.assert_allclose(np.linalg.norm(rim.open_directions, axis=1), 1.0, atol=1e-12)


def test_the_rim_of_a_cloud_lies_inside_the_material_at_hole_and_outside(synthetic):
    outlines = [synthetic.circle(40.0), synthetic.circle(80.0, hole=False)]
    uv = synthetic.material(outlines, spacing_mm=SPACING)
    points = np.column_stack([uv, np.zeros(len(uv))])
    rim = rim_of(points)
    radius = np.linalg.norm(rim.points_mm, axis=1)
    at_hole = radius < 60.0
    assert ((radius > 40.0) & (radius < 80.0)).all()
    assert np.median(radius[at_hole]) - 40.0 == pytest.approx(0.5 * SPACING, abs=0.6)
    assert 80.0 - np.median(radius[~at_hole]) == pytest.approx(0.5 * SPACING, abs=0.6)
    facing = np.sum(rim.open_directions * rim.points_mm, axis=1) / radius
    assert np.median(facing[at_hole]) < -0.9
    assert np.median(facing[~at_hole]) > 0.9
    for angle in np.arange(0.0, 2.0 * np.pi, 0.2):  # no stretch of either edge is without rim points
        for ring, r in ((at_hole, 40.0), (~at_hole, 80.0)):
            place = np.array([r * np.cos(angle), r * np.sin(angle), 0.0])
            assert np.linalg.norm(rim.points_mm[ring] - place, axis=1).min() < 3.0 * SPACING


def test_boundary_edges_run_with_their_face_on_the_left(annulus):
    vertices, faces = annulus
    edges = mesh_boundary_edges(faces)
    directed = {tuple(edge) for corner in range(3) for edge in faces[:, [corner, (corner + 1) % 3]].tolist()}
    assert all(tuple(edge) in directed and tuple(edge[::-1]) not in directed for edge in edges.tolist())
    middle = vertices[edges].mean(axis=1)
    step = vertices[edges[:, 1]] - vertices[edges[:, 0]]
    turn = middle[:, 0] * step[:, 1] - middle[:, 1] * step[:, 0]  # + counter-clockwise about the centre
    outer = np.linalg.norm(middle, axis=1) > 60.0
    assert (turn[outer] > 0.0).mean() > 0.95
    assert (turn[~outer] < 0.0).mean() > 0.95


def test_a_closed_mesh_has_no_boundary():
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert mesh_boundary_edges(tetrahedron).shape == (0, 2)
    assert len(mesh_rim(vertices, tetrahedron).indices) == 0


def test_the_open_side_of_a_mesh_rim_looks_away_from_the_faces(annulus):
    vertices, faces = annulus
    rim = mesh_rim(vertices, faces)
    radius = np.linalg.norm(rim.points_mm, axis=1)
    facing = np.sum(rim.open_directions * rim.points_mm, axis=1) / radius * np.sign(radius - 60.0)
    assert np.median(facing) > 0.9
    assert (facing > 0.3).mean() > 0.9
    assert set(rim.indices) == set(mesh_boundary_edges(faces).ravel())


def test_the_plane_through_neighbours_is_found(synthetic):
    rng = np.random.default_rng(0)
    poses = [synthetic.random_pose(seed) for seed in range(5)]
    flat = np.column_stack([rng.uniform(-5, 5, (12, 2)), np.zeros(12)])
    normals, centres = surface_normals(np.stack([apply(T, flat) for T in poses]))
    for T, normal, centre in zip(poses, normals, centres, strict=True):
        assert abs(normal @ T[:3, 2]) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(centre, apply(T, flat).mean(axis=0), atol=1e-9)


@pytest.mark.parametrize("copies", [2, 3])
def test_a_cloud_in_which_every_point_stands_several_times_keeps_its_rim(copies):
    points, on_border = square_cloud()
    once = without_copies(Scan(np.concatenate([points] * copies))).points_mm
    np.testing.assert_array_equal(once, points)
    rim = rim_of(once)
    assert np.isin(np.flatnonzero(on_border), rim.indices).mean() > 0.9


def test_planes_hold_their_neighbours_nearest_first_and_reach_to_the_furthest(synthetic):
    points, _ = square_cloud(noise=0.0)
    T = synthetic.random_pose(3)
    planes = local_planes(apply(T, points), cKDTree(apply(T, points)))
    np.testing.assert_array_equal(planes.neighbours[:, 0], np.arange(len(points)))
    assert (np.diff(planes.distances_mm, axis=1) >= 0.0).all()
    np.testing.assert_allclose(np.abs(planes.normals @ T[:3, 2]), 1.0, atol=1e-9)
    groups = apply(T, points)[planes.neighbours]
    np.testing.assert_allclose(planes.centres_mm, groups.mean(axis=1), atol=1e-9)
    away = np.linalg.norm(groups - planes.centres_mm[:, None], axis=2)
    np.testing.assert_allclose(planes.radii_mm, away.max(axis=1), atol=1e-9)


def test_planes_without_some_points_are_those_of_a_cloud_that_never_had_them():
    points, _ = square_cloud()
    dropped = np.random.default_rng(5).random(len(points)) < 0.03
    left = points[~dropped]
    found = without(local_planes(points, cKDTree(points)), left, cKDTree(left), dropped)
    exact = local_planes(left, cKDTree(left))
    np.testing.assert_array_equal(found.neighbours, exact.neighbours)
    for name in ("distances_mm", "centres_mm", "radii_mm"):
        np.testing.assert_allclose(getattr(found, name), getattr(exact, name), atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(found.normals * exact.normals, axis=1)), 1.0, atol=1e-12)
