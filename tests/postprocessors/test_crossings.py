"""Crossings of cuts: known cases, and random walks against every pair of moves."""

import time

import numpy as np
import pytest
from post_programs import path_of, program_of

from sicp_postprocessors.crossings import Crossing, crossings
from sicp_postprocessors.path_checks import PreflightOptions, path_findings

UP = (0.0, 0.0, 1.0)


def found(tips, rapid=None, axes=None):
    tips = np.asarray(tips, dtype=float)
    if tips.shape[1] == 2:
        tips = np.column_stack([tips, np.zeros(len(tips))])
    rapid = np.arange(len(tips)) == 0 if rapid is None else np.array(rapid, dtype=bool)
    return crossings(tips, np.tile(UP, (len(tips), 1)) if axes is None else axes, rapid)


def circle(turns=1.0, count=720, radius=100.0):
    t = np.linspace(0.0, 2.0 * np.pi * turns, count)
    return radius * np.column_stack([np.cos(t), np.sin(t)])


LOOP = circle()


@pytest.mark.parametrize(
    ("tips", "why"),
    [
        (LOOP, "a loop that closes"),
        (np.vstack([[[110, 0]], LOOP, [[110, 0]]]), "in and out on one line"),
        (np.vstack([[[110, -10]], LOOP, [[110, 10]]]), "in and out aslant, through the point where it closes"),
        (np.vstack([[[110, 10]], LOOP, [[110, -10]]]), "the other way round"),
        (np.vstack([[[110, -10]], circle(1.05, 761), [[101, 50]]]), "an overlap"),
        (circle(5.0, 3333), "several passes"),
        (np.vstack([LOOP, LOOP[::-1]]), "there and back"),
        (np.array([[0, 0], [50, 0], [50, 50], [0, 50]] * 4 + [[0, 0]]), "passes round corners"),
        (np.array([[0, 0], [50, 0], [50, 1], [0, 1], [0, 2], [50, 2], [50, 3], [0, 3]]), "rows"),
        (np.array([[0, 0], [50, 0]]), "one move"),
        (np.array([[0, 0], [0, 0], [0, 0]]), "no motion"),
    ],
)
def test_paths_that_do_not_cross(tips, why):
    assert found(tips) == [], why


def test_a_figure_of_eight_crosses_once():
    t = np.linspace(0.3, 2.0 * np.pi + 0.3, 999)
    tips = 80.0 * np.column_stack([np.sin(t), np.sin(2.0 * t) / 2.0])
    (crossing,) = found(tips)
    assert crossing.same_cut
    at = tips[[crossing.earlier, crossing.later]]
    assert np.linalg.norm(at, axis=1).max() < 1.0, "at its middle"


def test_two_cuts_that_cross_are_told_apart_from_one():
    tips = [[-5, 0, 9], [-5, 0, 0], [55, 0, 0], [55, 0, 9], [50, -5, 9], [50, -5, 0], [50, 55, 0]]
    assert found(tips, [1, 0, 0, 1, 1, 0, 0]) == [Crossing(2, 6, same_cut=False)]


def test_a_rapid_move_crosses_nothing():
    assert found([[0, 0], [50, 0], [25, 25], [25, -25]], [1, 0, 1, 1]) == []


@pytest.mark.parametrize(("above_mm", "count"), [(0.04, 1), (0.2, 0), (-5.0, 0)])
def test_ways_at_different_depths_do_not_cross(above_mm, count):
    tips = [[0, 0, 0], [10, 0, 0], [10, 5, above_mm], [4, 5, above_mm], [4, -5, above_mm]]
    assert len(found(tips)) == count


def test_a_wall_is_seen_along_its_tool_axis():
    # The same crossing, on a wall: the tool lies along x, and the path in y, z.
    tips = np.array([[0, 0, 0], [0, 10, 0], [0, 10, 5], [0, 4, 5], [0, 4, -5]], dtype=float)
    assert len(found(tips, axes=np.tile((1.0, 0.0, 0.0), (5, 1)))) == 1


def every_pair(tips):
    """Return all crossings of moves that do not follow each other, with the sine of their angle."""

    def area(u, v):
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    begin, way = tips[:-1], np.diff(tips, axis=0)
    across, between = area(way[:, None], way[None]), begin[None] - begin[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t, s = area(between, way[None]) / across, area(between, way[:, None]) / across
    i, j = np.nonzero(np.triu((t > 0) & (t < 1) & (s > 0) & (s < 1), 2))
    sine = np.abs(across[i, j]) / (np.linalg.norm(way[i], axis=1) * np.linalg.norm(way[j], axis=1))
    return [(int(a) + 1, int(b) + 1, float(q)) for a, b, q in zip(i, j, sine, strict=True)]


@pytest.mark.parametrize("seed", range(12))
def test_random_walks_cross_where_every_pair_of_moves_says(seed):
    rng = np.random.default_rng(seed)
    lengths = rng.choice([0.05, 0.3, 1.0, 3.0]) * rng.uniform(0.5, 1.5, 800)
    heading = np.cumsum(rng.normal(0.0, 0.15, 800))
    tips = np.cumsum(lengths[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    true, told = every_pair(tips), found(tips)
    s = np.concatenate([[0.0], np.cumsum(lengths[1:])])

    def among(a, b, others):
        return any(abs(a - x) <= 6 and abs(b - y) <= 6 for x, y in others)

    plain = [(a, b) for a, b, sine in true if sine > 0.3 and s[b - 1] - s[a] > 1.2 and a > 3]
    assert all(among(a, b, [(c.earlier, c.later) for c in told]) for a, b in plain), "none is missed"
    assert all(among(c.earlier, c.later, [(a, b) for a, b, _ in true]) for c in told), "none is invented"


def test_two_hundred_thousand_moves_are_checked_in_a_moment():
    count = 200_000
    t = np.linspace(0.0, 2.0 * np.pi, count)
    tips = 30_000.0 * np.column_stack([np.cos(t), np.sin(t), 0.0 * t])
    program = program_of(path_of(tips, np.tile(UP, (count, 1)), 3000.0))
    begin = time.process_time()
    assert [f.code for f in path_findings(program, np.eye(4), PreflightOptions())] == [669]
    assert time.process_time() - begin < 1.5, "0.15 s were measured; a path must not be looked at move by move"


def test_cuts_that_fill_space_are_not_looked_at_for_minutes():
    rng = np.random.default_rng(0)
    tips = rng.uniform(-500.0, 500.0, (10_000, 3))
    assert crossings(tips, np.tile([0.0, 0.0, 1.0], (10_000, 1)), np.arange(10_000) == 0) is None
