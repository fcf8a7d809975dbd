"""Scans of very few points, or all on a line, must not break what larger ones need."""

import numpy as np
import pytest

from sicp_cam.model import Scan
from sicp_cam.registration.evenness import evened
from sicp_cam.registration.scan_surface import prepared


def few(count, kind):
    points = np.random.default_rng(count).uniform(-100.0, 100.0, (count, 3))
    match kind:
        case "plane":
            points[:, 2] = 0.0
        case "line":
            points[:, 1:] *= 1e-5
        case "copies":
            points[count // 2 :] = points[: count - count // 2]
        case "rows":
            points[:, 1] = np.round(points[:, 1] / 50.0) * 50.0
            points[:, 2] = 0.0
        case "one apart":
            points[0] = 1e4
    return Scan(points)


@pytest.mark.parametrize("kind", ["plane", "line", "copies", "rows", "one apart", "anywhere"])
def test_any_number_of_points_has_a_surface(kind):
    for count in (5, 6, 9, 10, 12, 17, 30, 49, 50, 53, 80):
        surface = prepared(few(count, kind))
        assert len(surface.points_mm) + len(surface.strays_mm) <= count
        assert np.isfinite(surface.spacing_mm)


def test_points_on_a_line_are_not_thinned_away():
    assert len(evened(few(200, "line")).points_mm) >= 50
