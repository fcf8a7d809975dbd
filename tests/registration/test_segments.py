import numpy as np
import pytest

from sicp_cam.contour.frames import at, framed, moved
from sicp_cam.contour.subdivision import subdivide, weights
from sicp_cam.registration.result import Segment
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import prepared
from sicp_cam.registration.segments import Targets, blended, point_to_curve, point_to_point, register_segments
from sicp_cam.rigid_motion import apply, exponential, is_rigid

NONE = np.zeros(0)


@pytest.fixture(scope="module")
def flat(synthetic):
    """A rectangular opening in a plane: contour, surface and stations."""
    outline = synthetic.rounded_rectangle(160.0, 110.0, 20.0, hole=True)
    contour = synthetic.contour(outline)
    surface = prepared(synthetic.scan(synthetic.material([outline], depth_mm=40.0), synthetic.plane))
    nominal = NominalContour(framed(contour), contour.ring_points_mm, contour.ring_normals)
    return nominal, surface, np.arange(0.0, contour.length_mm, 2.0)


def register(flat, targets, pieces=8, T=None, correspondence=None):
    nominal, surface, s = flat
    parts = subdivide(nominal.curve, pieces, 0.3, NONE)
    match = correspondence or point_to_curve(targets)
    return parts, register_segments(nominal, parts, s, match, surface, np.eye(4) if T is None else T, reach_mm=25.0)


def shifted_targets(flat, move, weights=None):
    nominal, _, s = flat
    there = move(at(nominal.curve, s).points_mm)
    trust = np.ones(len(s)) if weights is None else weights
    return Targets(s, there, trust)


def test_pieces_whose_targets_are_met_stay_where_they_are(flat):
    _, segments = register(flat, shifted_targets(flat, lambda points: points))
    for segment in segments:
        assert is_rigid(segment.T_scan_part)
        np.testing.assert_allclose(
            apply(segment.T_scan_part, flat[0].curve.points_mm), flat[0].curve.points_mm, atol=0.02
        )


def test_a_common_move_across_the_contour_is_followed_by_every_piece(flat):
    nominal, _, s = flat
    targets = shifted_targets(flat, lambda points: points + np.array([1.0, -0.6, 0.0]))
    parts, segments = register(flat, targets)
    found = at(blended(nominal.curve, parts, segments), s)
    missed = targets.points_scan_mm - found.points_mm
    across = np.sum(missed * found.inward, axis=1)
    assert np.abs(across).mean() < 0.015
    straight = np.maximum(np.abs(found.tangents[:, 0]), np.abs(found.tangents[:, 1])) > 0.999
    assert np.median(np.abs(across[straight])) < 0.01


def test_a_corner_follows_a_common_move_too(flat):
    nominal, _, s = flat
    targets = shifted_targets(flat, lambda points: points + np.array([1.0, -0.6, 0.0]))
    found = at(blended(nominal.curve, *register(flat, targets)), s)
    across = np.sum((targets.points_scan_mm - found.points_mm) * found.inward, axis=1)
    assert np.abs(across).max() < 0.06


def test_a_piece_with_its_own_motion_gets_it_and_leaves_the_others(flat):
    nominal, _, s = flat
    straight = (np.abs(at(nominal.curve, s).tangents[:, 0]) > 0.999) & (at(nominal.curve, s).points_mm[:, 1] > 0)

    def push(points):
        return points + np.where(straight, 2.0, 0.0)[:, None] * at(nominal.curve, s).inward

    targets = shifted_targets(flat, push)
    parts, segments = register(flat, targets, pieces=16)
    found = at(blended(nominal.curve, parts, segments), s)
    depth = np.sum((found.points_mm - at(nominal.curve, s).points_mm) * at(nominal.curve, s).inward, axis=1)
    inside = np.convolve(straight, np.ones(25), "same") == 25
    outside = np.convolve(straight, np.ones(25), "same") == 0
    assert inside.sum() > 5
    np.testing.assert_allclose(depth[inside], 2.0, atol=0.25)
    np.testing.assert_allclose(depth[outside], 0.0, atol=0.4)


def test_pieces_do_not_slide_along_the_contour(flat):
    nominal, _, s = flat
    slid = at(nominal.curve, s + 5.0).points_mm  # along the straight sides these targets are met without sliding
    parts, segments = register(flat, Targets(s, slid, np.ones(len(s))), pieces=12)
    found = blended(nominal.curve, parts, segments)
    straight = np.maximum(np.abs(nominal.curve.tangents[:, 0]), np.abs(nominal.curve.tangents[:, 1])) > 0.9999
    along = np.sum((found.points_mm - nominal.curve.points_mm) * nominal.curve.tangents, axis=1)
    assert np.median(np.abs(along[straight])) < 0.27


def test_a_piece_without_targets_keeps_the_primary_pose(synthetic, flat):
    nominal, _, s = flat
    primary = exponential(np.array([0.0, 0.0, 0.004, 0.5, 0.0, 0.0]), np.zeros(3))
    parts = subdivide(nominal.curve, 8, 0.3, NONE)
    seen = (weights(parts, s)[:, 3] == 0.0).astype(float)
    _, segments = register(flat, shifted_targets(flat, lambda points: points, seen), T=primary)
    np.testing.assert_array_equal(segments[3].T_scan_part, primary)
    assert not np.allclose(segments[0].T_scan_part, primary, atol=1e-3)


def test_the_papers_correspondence_draws_points_to_the_closest_edge_points(flat):
    nominal, _, s = flat
    edge = at(nominal.curve, np.arange(0.0, nominal.curve.length_mm, 0.5)).points_mm + np.array([0.8, 0.5, 0.0])

    def closest(points):
        return edge[np.argmin(np.linalg.norm(points[:, None] - edge, axis=2), axis=1)]

    parts, segments = register(flat, None, correspondence=point_to_point(closest, 25.0))
    found = at(blended(nominal.curve, parts, segments), s)
    across = np.sum((closest(found.points_mm) - found.points_mm) * found.inward, axis=1)
    assert np.abs(across).mean() < 0.12  # of 0.6 mm on average; nearest points hold against sliding


def test_pairs_beyond_the_reach_weigh_nothing(flat):
    nominal, _, s = flat
    now = at(nominal.curve, s)
    rows = point_to_point(lambda points: points + np.array([30.0, 0.0, 0.0]), 25.0)(now, np.arange(len(s)))
    assert rows.weights.sum() == 0.0


def piecewise(parts, motions):
    return tuple(Segment(float(a), float(b), T, 0.0) for (a, b), T in zip(parts.ranges_mm(), motions, strict=True))


def test_equal_motions_blend_to_that_motion(synthetic, flat):
    curve = flat[0].curve
    T = synthetic.random_pose(1)
    parts = subdivide(curve, 9, 0.3, NONE)
    found = blended(curve, parts, piecewise(parts, [T] * 9))
    exact = moved(curve, T)
    for name in ("points_mm", "tangents", "inward", "outward"):
        np.testing.assert_allclose(getattr(found, name), getattr(exact, name), atol=1e-9)


def test_the_blend_of_different_motions_has_no_jump(synthetic, flat):
    curve = framed(synthetic.contour(synthetic.circle(80.0), step_mm=0.2, rings_mm=()))
    parts = subdivide(curve, 8, 0.3, NONE)
    rng = np.random.default_rng(0)
    motions = [
        exponential(np.concatenate([rng.normal(0, 0.005, 3), rng.normal(0, 1.0, 3)]), np.zeros(3)) for _ in range(8)
    ]
    found = blended(curve, parts, piecewise(parts, motions))
    move = found.points_mm - curve.points_mm
    steps = np.linalg.norm(np.diff(np.vstack([move, move[:1]]), axis=0), axis=1)
    apart = max(
        np.linalg.norm(apply(a, curve.points_mm) - apply(b, curve.points_mm), axis=1).max()
        for a in motions
        for b in motions
    )
    steepest = 0.5 * np.pi / parts.overlaps_mm.min() * apart + 0.05
    assert steps.max() < 0.25 * steepest  # of stations 0.2 mm apart
    assert np.abs(np.diff(np.vstack([found.outward, found.outward[:1]]), axis=0)).max() < 0.0005
