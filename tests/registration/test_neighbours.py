"""What lies beside a contour and is not its edge: other holes, a table under an opening, the wall of the cut-out."""

from __future__ import annotations

import numpy as np
import pytest

from sicp_cam.correction import refuse_twins
from sicp_cam.errors import RegistrationError
from sicp_cam.model import Scan
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.scan_surface import without_copies
from sicp_cam.rigid_motion import from_parts
from sicp_cam.toolpath.registration_gates import registration_gates
from sicp_cam.toolpath.settings import GateLimits

SHIFT = from_parts(np.eye(3), [5.0, 2.0, 0.0])


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_small_hole_is_not_left_for_its_neighbour(synthetic, seed):
    holes = [synthetic.egg(6.0, centre=(24.0 * k, 0.0)) for k in (-1, 0, 1)]
    scan = synthetic.scan(synthetic.material(holes, depth_mm=40.0, spacing_mm=1.0, seed=seed), seed=seed)
    contour = synthetic.contour(holes[1], others=[holes[0], holes[2]], step_mm=0.5)
    found = register_contours({1: contour}, scan, np.eye(4)).contours[0]
    assert synthetic.errors(found.corrected, holes[1]).both.mean() < 0.15


@pytest.mark.parametrize("below_mm", [2.0, 5.0])
def test_a_table_seen_through_an_opening_is_not_the_part(synthetic, below_mm):
    """Either the edge is found in spite of it, or the scan is refused; never is the opening taken for uncut."""
    hole = synthetic.egg(20.0)
    part = synthetic.scan(synthetic.material([hole], depth_mm=40.0, seed=1))
    side = np.arange(-30.0, 30.0, 2.0)
    table = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    table = np.column_stack([table[hole.depth(table)[0] < 0.0], np.full((hole.depth(table)[0] < 0.0).sum(), -below_mm)])
    scan = Scan(np.concatenate([part.points_mm, table]))
    try:
        found = register_contours({1: synthetic.contour(hole)}, scan, SHIFT).contours[0]
    except RegistrationError as error:
        assert "rim" in str(error)
        return
    assert not found.uncut
    assert synthetic.errors(found.corrected, hole).both.mean() < 0.2


def test_the_wall_of_a_cut_out_does_not_tilt_the_surface(synthetic):
    hole = synthetic.egg(60.0)
    part = synthetic.scan(synthetic.material([hole], depth_mm=40.0, seed=2))
    rng = np.random.default_rng(1)
    places = rng.choice(hole.points, 250)
    wall = np.column_stack([places, rng.uniform(-6.0, 0.0, len(places))]) + rng.normal(0.0, 0.05, (len(places), 3))
    scan = Scan(np.concatenate([part.points_mm, wall]))
    found = register_contours({1: synthetic.contour(hole)}, scan, SHIFT).contours[0]
    error = synthetic.errors(found.corrected, hole)
    assert np.abs(error.out).max() < 0.1
    assert error.axis_deg.mean() < 0.5


def test_a_cut_and_an_uncut_contour_pass_together(synthetic):
    cut, uncut = synthetic.circle(30.0), synthetic.circle(30.0, centre=(150.0, 0.0))
    uv = synthetic.material([cut], depth_mm=300.0, spacing_mm=2.0, seed=1)
    uv = uv[(uv[:, 0] > -90.0) & (uv[:, 0] < 260.0) & (np.abs(uv[:, 1]) < 90.0)]
    contours = {1: synthetic.contour(cut), 2: synthetic.contour(uncut)}
    found = register_contours(contours, synthetic.scan(uv), np.eye(4))
    assert [contour.uncut for contour in found.contours] == [False, True]
    assert [gate.name for gate in registration_gates(found, GateLimits(), np.eye(4)) if gate.state != "ok"] == []
    assert 406 in {finding.code for finding in found.findings}


def test_twins_need_a_start_that_tells_them_apart(synthetic):
    pair = [synthetic.contour(synthetic.egg(20.0, centre=(x, 0.0))) for x in (0.0, 100.0)]
    other = synthetic.contour(synthetic.oval(30.0, 20.0, centre=(200.0, 0.0)))
    with pytest.raises(RegistrationError, match="contours 1 and 2 have one shape, 100 mm apart"):
        refuse_twins(pair, {1: pair[0]}, None, None)
    refuse_twins(pair, {1: pair[0], 2: pair[1]}, None, None)
    refuse_twins([pair[0], other], {1: pair[0]}, None, None)
    refuse_twins(pair, {1: pair[0]}, np.eye(4), from_parts(np.eye(3), [30.0, 0.0, 0.0]))
    with pytest.raises(RegistrationError, match=r"contour 1 was found 60\.0 mm"):
        refuse_twins(pair, {1: pair[0]}, np.eye(4), from_parts(np.eye(3), [60.0, 0.0, 0.0]))


def test_the_other_skins_edge_is_no_twin(synthetic):
    hole = synthetic.egg(20.0)
    skins = [synthetic.contour(hole, lambda uv, z=z: np.column_stack([uv, np.full(len(uv), z)])) for z in (0.0, -3.0)]
    refuse_twins(skins, {1: skins[0]}, None, None)


def test_merged_exports_that_differ_by_rounding_are_one_scan(synthetic):
    part = synthetic.scan(synthetic.material([synthetic.egg(40.0)], depth_mm=30.0, seed=3))
    twice = np.concatenate([part.points_mm, np.round(part.points_mm, 2)])
    assert len(without_copies(Scan(twice)).points_mm) == len(part.points_mm)
    assert len(without_copies(part).points_mm) == len(part.points_mm)
