from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.report.stretches import clipped, covered_twice, marked


def ring(closed: bool) -> FramedCurve:
    s = np.arange(10.0) * 10.0
    zero = np.zeros((10, 3))
    return FramedCurve(s, zero, zero, zero, zero, 100.0 if closed else 90.0, closed)


def mask(*marks: int) -> np.ndarray:
    found = np.zeros(10, np.bool_)
    found[list(marks)] = True
    return found


def test_a_stretch_reaches_halfway_to_its_neighbours() -> None:
    assert marked(ring(True), mask(2, 3, 7)) == [(15.0, 35.0), (65.0, 75.0)]


def test_a_stretch_over_the_seam_of_a_loop_is_one() -> None:
    assert marked(ring(True), mask(9, 0)) == [(85.0, 105.0)]
    assert marked(ring(True), mask(0)) == [(-5.0, 5.0)]
    assert marked(ring(True), mask(9)) == [(85.0, 95.0)]


def test_an_open_contour_has_no_seam() -> None:
    assert marked(ring(False), mask(9, 0)) == [(0.0, 5.0), (85.0, 90.0)]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.booleans(), min_size=10, max_size=10), st.booleans())
def test_marked_and_unmarked_together_are_the_whole_contour(marks: list[bool], closed: bool) -> None:
    curve = ring(closed)
    stretches = marked(curve, np.array(marks)) + marked(curve, ~np.array(marks))
    assert sum(end - start for start, end in stretches) == pytest.approx(curve.length_mm)
    pieces = sorted(piece for stretch in stretches for piece in clipped(stretch, curve.length_mm))
    ends = [0.0, *(end for _, end in pieces)]
    assert [start for start, _ in pieces] == pytest.approx(ends[:-1])
    assert ends[-1] == pytest.approx(curve.length_mm)


def test_overlaps_lie_about_the_borders(job) -> None:
    contour = job.contour
    length = contour.nominal.length_mm / 6
    s = np.array([0.0, 0.10, 0.20, 0.5, 0.8, 0.9, 1.0, 5.9]) * length
    found = covered_twice(contour.segments, contour.corrected, s)
    assert found.tolist() == [True, True, False, False, False, True, True, True]
    once = replace(contour, segments=contour.segments[:1])
    assert not covered_twice(once.segments, contour.corrected, s).any()
