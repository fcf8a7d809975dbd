import numpy as np
import pytest

from sicp_cam.contour.frames import framed
from sicp_cam.registration.coverage import interior_density, is_shown, points_at_rim, rim_depth
from sicp_cam.registration.scan_surface import prepared
from sicp_cam.registration.stations import even_stations

SPACING = 2.0
REACH = 20.0
PER_MM2 = 1.0 / SPACING**2


class Seen:
    """A scan of the plane seen from a contour in it: rim, points, where it is shown, and density, at every station."""

    def __init__(self, synthetic, outline, uv, counted=None):
        self.curve = framed(synthetic.contour(outline, rings_mm=()))
        self.surface = prepared(synthetic.scan(uv, synthetic.plane))
        spacing = self.surface.spacing_mm
        self.s = even_stations(self.curve, spacing)
        self.rim_mm, self.has_rim = rim_depth(self.curve, self.surface, self.s, REACH)
        flat = np.zeros(len(self.s))
        self.shown = is_shown(self.curve, self.surface, self.s, self.rim_mm, lambda behind: flat)
        self.points = points_at_rim(self.curve, self.surface, self.s, self.rim_mm, 10.0 * spacing)
        seen = self.has_rim & self.shown if counted is None else counted(self.s)
        self.density = interior_density(self.points, self.s, self.curve, spacing, seen)

    @property
    def covered(self):
        return self.has_rim & self.shown

    def near(self, places_mm, reach_mm):
        """Say which stations lie along the contour within reach of some places."""
        apart = np.abs(self.s[:, None] - np.asarray(places_mm))
        apart = np.minimum(apart, self.curve.length_mm - apart) if self.curve.closed else apart
        return (apart < reach_mm).any(axis=1)


def sampled(synthetic, outlines, sampling="jittered", seed=0):
    return synthetic.material(outlines, sampling=sampling, spacing_mm=SPACING, depth_mm=30.0, seed=seed)


@pytest.fixture(scope="module")
def egg(synthetic):
    return synthetic.egg(60.0)


@pytest.fixture(scope="module")
def whole(synthetic, egg):
    return Seen(synthetic, egg, sampled(synthetic, [egg]))


@pytest.fixture(scope="module")
def gapped(synthetic, egg):
    uv = synthetic.without_gaps(sampled(synthetic, [egg]), egg, [(100.0, 140.0)], depth_mm=np.inf)
    return Seen(synthetic, egg, uv)


@pytest.mark.parametrize("sampling", ["random", "jittered", "voxels"])
def test_the_rim_lies_half_a_spacing_behind_the_edge(synthetic, egg, sampling):
    seen = Seen(synthetic, egg, sampled(synthetic, [egg], sampling))
    assert np.mean(seen.rim_mm) / SPACING == pytest.approx(0.5, abs=0.2)
    assert np.std(seen.rim_mm) < 0.3 * SPACING


@pytest.mark.parametrize(("sampling", "share"), [("random", 0.95), ("jittered", 1.0), ("voxels", 1.0)])
def test_a_whole_scan_is_shown_everywhere(synthetic, egg, sampling, share):
    seen = [Seen(synthetic, egg, sampled(synthetic, [egg], sampling, seed)).covered.mean() for seed in range(3)]
    assert np.mean(seen) >= share


def test_depths_behind_the_rim_are_counted_from_it(whole):
    at_rim = np.interp(whole.points.s_mm, whole.s, whole.rim_mm, period=whole.curve.length_mm)
    np.testing.assert_allclose(whole.points.inward_mm - at_rim, whole.points.behind_rim_mm, atol=1e-9)
    assert whole.points.behind_rim_mm.max() < 10.0 * whole.surface.spacing_mm
    some = whole.points.s_mm < 50.0
    np.testing.assert_array_equal(whole.points.taken(some).s_mm, whole.points.s_mm[some])


def test_strays_are_seen_too(synthetic, egg, whole):
    """They tell how many wrong points there are before the edge."""
    wild = synthetic.strays(egg, 30, reach_mm=3.0)
    seen = Seen(synthetic, egg, np.concatenate([sampled(synthetic, [egg]), wild]))
    before = [np.count_nonzero(one.points.inward_mm < -0.5) for one in (seen, whole)]
    assert before[0] > 20
    assert before[1] == 0


def test_a_gap_is_not_shown_and_what_lies_beside_it_is(gapped):
    gap = (gapped.s > 104.0) & (gapped.s < 136.0)
    beside = gapped.near([100.0, 140.0], 8.0)
    assert not gapped.covered[gap].any()
    assert gapped.covered[~gap & ~beside].all()


def test_the_rim_is_carried_straight_over_a_gap(gapped):
    gap = (gapped.s > 104.0) & (gapped.s < 136.0)
    assert np.abs(np.diff(gapped.rim_mm[gap], 2)).max() < 0.12
    assert np.abs(gapped.rim_mm[gap] - 0.5 * SPACING).max() < 0.5 * SPACING


def test_a_hole_behind_the_edge_is_no_surface(synthetic, egg):
    """A stretch with points at its rim alone, as of a burr, does not show the part."""
    uv = sampled(synthetic, [egg])
    depth, s = egg.depth(uv)
    strip = (s > 100.0) & (s < 140.0) & (depth > 2.0 * SPACING)
    seen = Seen(synthetic, egg, uv[~strip])
    assert not seen.shown[(seen.s > 108.0) & (seen.s < 132.0)].any()
    assert seen.covered[~seen.near([120.0], 35.0)].all()


def test_a_rim_that_opens_to_the_other_side_is_none(synthetic):
    """The outer edge of a ring 16 mm wide, seen from the contour of a hole at the same place."""
    ring = [synthetic.circle(60.0, hole=False), synthetic.circle(44.0)]
    seen = Seen(synthetic, synthetic.circle(60.0), sampled(synthetic, ring))
    assert not seen.has_rim.any()
    np.testing.assert_array_equal(seen.rim_mm, 0.0)


@pytest.mark.parametrize("hole", [True, False])
def test_sharp_corners_of_the_material_are_shown_but_for_their_tips(synthetic, hole):
    outline = synthetic.rounded_rectangle(160.0, 110.0, 1e-3, hole=hole)
    corners = outline.corners * outline.length_mm / len(outline.points)
    covered, tips = [], []
    for seed in range(3):
        seen = Seen(synthetic, outline, sampled(synthetic, [outline], seed=seed))
        covered.append(seen.covered[~seen.near(corners, 3.0 * SPACING)].mean())
        tips.append(seen.covered[seen.near(corners, 3.0 * SPACING)].mean())
    assert np.mean(covered) > 0.99
    assert np.mean(tips) > 0.9


def mean_density(synthetic, outline, others=(), sampling="jittered", seeds=2):
    """Return the mean over some seeds of the density at each station, as a share of the truth."""
    seen = [Seen(synthetic, outline, sampled(synthetic, [outline, *others], sampling, seed)) for seed in range(seeds)]
    least = min(len(one.s) for one in seen)
    return np.mean([one.density[:least] for one in seen], axis=0) / PER_MM2


@pytest.mark.parametrize("shape", ["hole", "outer", "sharp hole", "sharp outer", "small hole", "open edge"])
def test_the_density_is_that_of_the_interior_whatever_the_shape(synthetic, shape):
    outline = {
        "hole": lambda: synthetic.egg(60.0),
        "outer": lambda: synthetic.egg(60.0, hole=False),
        "sharp hole": lambda: synthetic.rounded_rectangle(160.0, 110.0, 1e-3, hole=True),
        "sharp outer": lambda: synthetic.rounded_rectangle(160.0, 110.0, 1e-3),
        "small hole": lambda: synthetic.circle(15.0),
        "open edge": lambda: synthetic.wavy_edge(200.0),
    }[shape]()
    density = mean_density(synthetic, outline)
    assert density.mean() == pytest.approx(1.0, abs=0.1)
    assert density.std() < 0.1


def test_the_other_side_of_a_narrow_flange_does_not_thin_it(synthetic, egg):
    """Its last slice may be cut by the other side and count all the same: hence the limit."""
    density = mean_density(synthetic, egg, [synthetic.across(egg, 9.0)])
    assert density.mean() == pytest.approx(1.0, abs=0.25)
    assert density.std() < 0.1


def test_what_is_not_counted_does_not_thin_what_lies_beside_it(synthetic, egg):
    uv = synthetic.without_gaps(sampled(synthetic, [egg], "random"), egg, [(100.0, 140.0)], depth_mm=np.inf)
    seen = Seen(synthetic, egg, uv, counted=lambda s: (s < 98.0) | (s > 142.0))
    every = Seen(synthetic, egg, uv, counted=lambda s: np.ones(len(s), dtype=bool))
    beside = seen.near([92.0, 148.0], 5.0)
    assert seen.density[beside].mean() / PER_MM2 == pytest.approx(1.0, abs=0.15)
    assert every.density[beside].mean() < 0.8 * seen.density[beside].mean()


def test_the_density_follows_a_scan_that_is_denser_on_one_half(synthetic, egg):
    uv = sampled(synthetic, [egg], "random")
    more = sampled(synthetic, [egg], "random", seed=9)
    seen = Seen(synthetic, egg, np.concatenate([uv, more[more[:, 0] > 0.0]]))
    u = np.interp(seen.s, seen.curve.s_mm, seen.curve.points_mm[:, 0])
    assert seen.density[u > 40.0].mean() / PER_MM2 == pytest.approx(2.0, rel=0.1)
    assert seen.density[u < -40.0].mean() / PER_MM2 == pytest.approx(1.0, rel=0.12)


def test_the_ends_of_an_open_edge_are_shown_and_nothing_beyond_them_is_seen(synthetic):
    edge = synthetic.stretch(synthetic.wavy_edge(300.0), 60.0, 240.0)
    seen = Seen(synthetic, edge, sampled(synthetic, [synthetic.wavy_edge(300.0)]))
    assert seen.covered.all()
    assert seen.points.s_mm.min() > 0.0
    assert seen.points.s_mm.max() < seen.curve.length_mm
    ends = seen.density[[0, -1]] / PER_MM2
    assert np.abs(ends - 1.0).max() < 0.15


def test_no_points_have_no_density(whole):
    nothing = whole.points.taken(np.zeros(len(whole.points.s_mm), dtype=bool))
    every = np.ones(len(whole.s), dtype=bool)
    assert not interior_density(nothing, whole.s, whole.curve, SPACING, every).any()
    assert not interior_density(whole.points, whole.s, whole.curve, SPACING, ~every).any()
