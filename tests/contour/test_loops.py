import numpy as np
import pytest
from scipy.spatial import cKDTree

from sicp_cam.contour.boundary import cloud_rim, local_planes, mesh_boundary_edges
from sicp_cam.contour.loops import mesh_loops, resampled, rim_loops
from sicp_cam.rigid_motion import apply

SPACING = 2.0


def rim_of(points):
    return cloud_rim(points, local_planes(points, cKDTree(points)))


def length(loop):
    return np.linalg.norm(np.diff(np.vstack([loop, loop[:1]]), axis=0), axis=1).sum()


@pytest.fixture(scope="module")
def ring_outlines(synthetic):
    return [synthetic.circle(40.0), synthetic.circle(80.0, hole=False)]


@pytest.mark.parametrize("sampling", ["jittered", "random"])
def test_an_annulus_has_two_loops_of_the_right_lengths(synthetic, ring_outlines, sampling):
    uv = synthetic.material(ring_outlines, sampling=sampling, spacing_mm=SPACING, seed=4)
    T = synthetic.random_pose(4)
    points = apply(T, synthetic.dome(500.0, 900.0)(uv))
    loops = rim_loops(rim_of(points), SPACING, 100.0)
    assert len(loops) == 2
    tolerance = 0.05 if sampling == "jittered" else 0.15
    assert length(loops[0]) == pytest.approx(2 * np.pi * 80.0, rel=tolerance)
    assert length(loops[1]) == pytest.approx(2 * np.pi * 40.0, rel=tolerance)


def test_a_walk_goes_once_around_the_centre(synthetic, ring_outlines):
    uv = synthetic.material(ring_outlines, spacing_mm=SPACING, seed=5)
    points = synthetic.plane(uv)
    for loop in rim_loops(rim_of(points), SPACING, 100.0):
        turn = np.diff(np.unwrap(np.arctan2(loop[:, 1], loop[:, 0])))
        assert abs(turn.sum()) == pytest.approx(2 * np.pi, abs=0.4)


@pytest.mark.parametrize(("gap", "around"), [(3.0, 0.0), (40.0, 50.0)])
def test_the_loop_steps_over_a_narrow_gap_and_goes_around_a_wide_one(synthetic, gap, around):
    hole = synthetic.circle(60.0)
    uv = synthetic.material([hole], spacing_mm=SPACING, seed=6)
    points = synthetic.plane(synthetic.without_gaps(uv, hole, [(100.0, 100.0 + gap)], depth_mm=25.0))
    (loop,) = [loop for loop in rim_loops(rim_of(points), SPACING, 200.0) if np.linalg.norm(loop, axis=1).max() < 100.0]
    assert length(loop) == pytest.approx(hole.length_mm + around, rel=0.06)


def test_short_loops_are_dropped(synthetic, ring_outlines):
    points = synthetic.plane(synthetic.material(ring_outlines, spacing_mm=SPACING, seed=7))
    loops = rim_loops(rim_of(points), SPACING, 400.0)
    assert len(loops) == 1
    assert length(loops[0]) > 400.0


def signed_area(loop):
    x, y = loop[:, 0], loop[:, 1]
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def test_mesh_loops_have_the_faces_on_their_left(synthetic, ring_outlines):
    uv = synthetic.material(ring_outlines, spacing_mm=SPACING, seed=8)
    faces = synthetic.triangles(uv, SPACING, ring_outlines)
    (outer, outer_closed), (inner, inner_closed) = [loop for loop in mesh_loops(faces) if len(loop[0]) > 20]
    assert outer_closed
    assert inner_closed
    assert signed_area(uv[outer]) == pytest.approx(np.pi * 80.0**2, rel=0.05)
    assert signed_area(uv[inner]) == pytest.approx(-np.pi * 40.0**2, rel=0.1)


def test_each_of_several_loops_is_found_longest_first(synthetic):
    outlines = [
        synthetic.rounded_rectangle(160.0, 80.0, 10.0),
        synthetic.circle(15.0, centre=(-40.0, 0.0)),
        synthetic.circle(25.0, centre=(35.0, 0.0)),
    ]
    uv = synthetic.material(outlines, sampling="jittered", spacing_mm=SPACING, jitter=0.3)
    loops = [loop for loop, closed in mesh_loops(synthetic.triangles(uv, SPACING, outlines)) if closed]
    areas = [signed_area(uv[loop]) for loop in loops]
    assert [len(loop) for loop in loops] == sorted((len(loop) for loop in loops), reverse=True)
    assert len(loops) == 3
    assert areas == pytest.approx([160 * 80 - (4 - np.pi) * 100, -np.pi * 25**2, -np.pi * 15**2], rel=0.15)


@pytest.mark.parametrize(
    "faces",
    [
        [[0, 1, 2]],
        [[0, 1, 2], [2, 1, 3]],
        [[0, 1, 2], [1, 2, 3]],  # wound against each other: their chains cannot close
        [[0, 1, 2], [0, 3, 4]],  # a bow tie: two loops meet in one vertex
    ],
)
def test_every_boundary_edge_is_walked_exactly_once(faces):
    walked = []
    for loop, closed in mesh_loops(np.array(faces)):
        ring = np.append(loop, loop[0]) if closed else loop
        walked += list(zip(ring[:-1].tolist(), ring[1:].tolist(), strict=True))
    assert sorted(walked) == [tuple(edge) for edge in mesh_boundary_edges(np.array(faces)).tolist()]


def test_chains_that_cannot_close_are_told_to_be_open():
    loops = mesh_loops(np.array([[0, 1, 2], [1, 2, 3]]))
    assert not all(closed for _, closed in loops)


def test_resampled_points_stand_at_equal_arcs():
    angle = np.sort(np.random.default_rng(0).uniform(0, 2 * np.pi, 5000))
    circle = 30.0 * np.stack([np.cos(angle), np.sin(angle), np.zeros(5000)], axis=1)
    points, total = resampled(circle, 100)
    steps = np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1)
    assert total == pytest.approx(2 * np.pi * 30.0, rel=1e-4)
    np.testing.assert_allclose(steps, 2 * 30.0 * np.sin(np.pi / 100), rtol=1e-3)
