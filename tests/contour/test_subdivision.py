import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import framed
from sicp_cam.contour.subdivision import Subdivision, bends, subdivide, weights
from sicp_cam.model import Contour

NONE = np.zeros(0)


@pytest.fixture(scope="module")
def ring(synthetic):
    return framed(synthetic.contour(synthetic.circle(100.0), rings_mm=()))


@pytest.fixture(scope="module")
def edge(synthetic):
    return framed(synthetic.contour(synthetic.wavy_edge(600.0), rings_mm=()))


@st.composite
def divisions(draw):
    """Pieces, overlap, bends and gaps as fractions of the length, the gaps apart from one another."""
    cuts = sorted(draw(st.lists(st.floats(0.02, 0.98), min_size=0, max_size=6, unique=True)))
    gaps = [(a, min(b, a + 0.15)) for a, b in zip(cuts[::2], cuts[1::2], strict=False) if b - a > 1e-3]
    corners = draw(st.lists(st.floats(0.0, 0.999), max_size=5, unique=True))
    return draw(st.integers(2, 40)), draw(st.floats(0.2, 0.4)), np.array(corners), np.array(gaps).reshape(-1, 2)


@settings(deadline=None, max_examples=80)
@given(division=divisions(), closed=st.booleans(), seed=st.integers(0, 2**32 - 1))
def test_weights_sum_to_one_everywhere(ring, edge, division, closed, seed):
    pieces, overlap, corners, gaps = division
    curve = ring if closed else edge
    parts = subdivide(curve, pieces, overlap, corners * curve.length_mm, gaps * curve.length_mm)
    s = np.random.default_rng(seed).uniform(0.0, curve.length_mm, 200)
    if closed:
        s = s + np.random.default_rng(seed).integers(-2, 3, 200) * curve.length_mm
    W = weights(parts, np.concatenate([s, parts.splits_mm, [0.0, curve.length_mm]]))
    assert W.shape[1] == len(parts.ranges_mm())
    assert (W >= 0.0).all()
    np.testing.assert_allclose(W.sum(axis=1), 1.0, atol=1e-12)


@settings(deadline=None, max_examples=40)
@given(division=divisions(), closed=st.booleans())
def test_a_piece_has_weight_only_within_its_range(ring, edge, division, closed):
    pieces, overlap, corners, gaps = division
    curve = ring if closed else edge
    parts = subdivide(curve, pieces, overlap, corners * curve.length_mm, gaps * curve.length_mm)
    s = np.linspace(0.0, curve.length_mm, 500, endpoint=False)
    for column, (start, end) in zip(weights(parts, s).T, parts.ranges_mm(), strict=True):
        some = s[column > 0.0]
        inside = (some >= start - 1e-9) & (some <= end + 1e-9)
        if closed:
            for turn in (-curve.length_mm, curve.length_mm):
                inside |= (some + turn >= start - 1e-9) & (some + turn <= end + 1e-9)
        assert inside.all()


def test_weights_do_not_jump_along_the_contour(ring):
    parts = subdivide(ring, 9, 0.3, NONE)
    s = np.linspace(-10.0, ring.length_mm + 10.0, 20_000)
    steepest = 0.5 * np.pi / parts.overlaps_mm.min()
    assert np.abs(np.diff(weights(parts, s), axis=0)).max() <= 1.01 * steepest * (s[1] - s[0])


@pytest.mark.parametrize("overlap", [0.2, 0.3, 0.4])
def test_through_an_overlap_the_weights_go_as_cos_and_sin_squared(ring, overlap):
    parts = subdivide(ring, 8, overlap, NONE)
    split, width = parts.splits_mm[3], parts.overlaps_mm[3]
    assert width == pytest.approx(overlap * ring.length_mm / 8)
    t = np.linspace(0.0, 1.0, 21)
    W = weights(parts, split + (t - 0.5) * width)
    np.testing.assert_allclose(W[:, 2], np.cos(0.5 * np.pi * t) ** 2, atol=1e-12)
    np.testing.assert_allclose(W[:, 3], np.sin(0.5 * np.pi * t) ** 2, atol=1e-12)
    middle = 0.5 * (parts.splits_mm[3] + parts.splits_mm[4])
    assert weights(parts, np.array([middle]))[0, 3] == 1.0


def test_the_overlap_at_the_seam_is_like_every_other(ring):
    parts = subdivide(ring, 8, 0.3, NONE)
    t = np.linspace(0.0, 1.0, 21)
    W = weights(parts, parts.splits_mm[0] + (t - 0.5) * parts.overlaps_mm[0])
    np.testing.assert_allclose(W[:, -1], np.cos(0.5 * np.pi * t) ** 2, atol=1e-12)
    np.testing.assert_allclose(W[:, 0], np.sin(0.5 * np.pi * t) ** 2, atol=1e-12)


@pytest.mark.parametrize("radius", [8.0, 15.0])
def test_the_bends_of_a_rounded_rectangle_are_its_corners(synthetic, radius):
    outline = synthetic.rounded_rectangle(300.0, 200.0, radius)
    curve = framed(synthetic.contour(outline, start_mm=60.0, rings_mm=()))
    found = bends(curve, 20.0)
    quarter = 0.5 * np.pi * radius
    sides = np.array([200.0, 300.0, 200.0]) - 2 * radius
    middles = np.cumsum([0.5 * quarter, *(sides[[1, 0, 1]] + quarter)]) - 60.0
    middles = np.sort(np.mod(middles, outline.length_mm))
    assert len(found) == 4
    np.testing.assert_allclose(found, middles, atol=0.5 * quarter + 5.0)


def test_a_contour_without_bends_has_none(ring, edge):
    assert len(bends(ring, 20.0)) == 0
    assert len(bends(edge, 20.0)) == 0


def test_a_bend_across_the_seam_counts_once(synthetic):
    outline = synthetic.rounded_rectangle(300.0, 200.0, 8.0)
    curve = framed(synthetic.contour(outline, start_mm=0.25 * np.pi * 8.0, rings_mm=()))
    assert len(bends(curve, 20.0)) == 4


def test_every_bend_that_stands_alone_becomes_a_split(ring):
    corners = np.array([40.0, 250.0, 400.0])
    parts = subdivide(ring, 10, 0.3, corners)
    assert all(np.abs(parts.splits_mm - corner).min() < 1e-9 for corner in corners)
    lengths = np.diff(np.append(parts.splits_mm, parts.splits_mm[0] + ring.length_mm))
    assert lengths.max() <= ring.length_mm / 10 + 1e-9
    assert lengths.min() > 0.4 * ring.length_mm / 10


@pytest.mark.parametrize("pieces", [1, 2, 6, 48])
def test_without_bends_the_arcs_are_equal(ring, edge, pieces):
    for curve in (ring, edge):
        parts = subdivide(curve, pieces, 0.3, NONE)
        ends = np.append(parts.splits_mm, curve.length_mm) if curve.closed else parts.splits_mm
        np.testing.assert_allclose(np.diff(ends), curve.length_mm / pieces, rtol=1e-9)
        assert len(parts.ranges_mm()) == pieces


def test_an_open_contour_begins_and_ends_with_whole_weight(edge):
    parts = subdivide(edge, 6, 0.3, NONE)
    W = weights(parts, np.array([0.0, edge.length_mm]))
    assert (W[0, 0], W[1, -1]) == (1.0, 1.0)
    assert (parts.overlaps_mm[0], parts.overlaps_mm[-1]) == (0.0, 0.0)
    assert parts.ranges_mm()[0, 0] == 0.0
    assert parts.ranges_mm()[-1, 1] == edge.length_mm


def splits_in_gaps(parts: Subdivision, gaps):
    inside = (parts.splits_mm[:, None] > gaps[:, 0] + 1e-6) & (parts.splits_mm[:, None] < gaps[:, 1] - 1e-6)
    return parts.splits_mm[inside.any(axis=1)]


@settings(deadline=None, max_examples=60)
@given(division=divisions(), closed=st.booleans())
def test_no_split_lies_in_a_gap_and_every_gap_is_held_on_both_sides(ring, edge, division, closed):
    pieces, overlap, _, gaps = division
    curve = ring if closed else edge
    gaps = gaps * curve.length_mm
    parts = subdivide(curve, pieces, overlap, NONE, gaps)
    assert len(splits_in_gaps(parts, gaps)) == 0


def test_arcs_hold_equal_lengths_of_seen_contour(edge):
    gaps = np.array([[100.0, 180.0], [300.0, 310.0]])
    parts = subdivide(edge, 5, 0.3, NONE, gaps)
    seen = [
        end - start - sum(max(0.0, min(end, b) - max(start, a)) for a, b in gaps)
        for start, end in zip(parts.splits_mm[:-1], parts.splits_mm[1:], strict=True)
    ]
    np.testing.assert_allclose(seen, (edge.length_mm - 90.0) / 5, rtol=1e-9)


def test_a_gap_across_the_seam_lies_within_one_piece(ring):
    gaps = np.array([[0.0, 30.0], [ring.length_mm - 30.0, ring.length_mm]])
    splits = subdivide(ring, 8, 0.3, NONE, gaps).splits_mm
    assert not ((splits < 29.9) | (splits > ring.length_mm - 29.9)).any()


def test_a_bend_within_a_gap_does_not_divide_it(ring):
    gaps = np.array([[100.0, 160.0]])
    assert len(splits_in_gaps(subdivide(ring, 8, 0.3, np.array([130.0]), gaps), gaps)) == 0


def test_the_last_station_of_an_open_contour_has_a_weight():
    for seed in range(50):
        x = np.sort(np.random.default_rng(seed).uniform(0.0, 500.0, 700))
        line = np.column_stack([x, np.zeros((700, 2))])
        curve = framed(Contour(line, np.tile([1.0, 0, 0], (700, 1)), np.tile([0.0, 0, 1], (700, 1)), closed=False))
        with np.errstate(invalid="ignore"):
            W = weights(subdivide(curve, 6, 0.3, NONE), curve.s_mm)
        assert np.isfinite(W).all()
