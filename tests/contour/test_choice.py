import numpy as np
import pytest

from sicp_cam.contour.choice import assign
from sicp_cam.contour.frames import framed
from sicp_cam.model import Contour

UP = np.array([0.0, 0.0, 1.0])


def skin(synthetic, outline, height=0.0, up=True):
    """Return the edge of one skin of a plate; the lower one looks down and runs the other way."""
    upper = synthetic.contour(outline, lambda uv: np.column_stack([uv, np.full(len(uv), height)]), rings_mm=())
    if up:
        return framed(upper)
    return framed(Contour(upper.points_mm[::-1], -upper.tangents[::-1], -upper.normals[::-1]))


def wall(synthetic, outline, height):
    """Return the same edge as seen from the plate's wall: outward is away from the material, in its plane."""
    upper = synthetic.contour(outline, lambda uv: np.column_stack([uv, np.full(len(uv), height)]), rings_mm=())
    return framed(Contour(upper.points_mm[::-1], -upper.tangents[::-1], -framed(upper).inward[::-1]))


def path_along(curve, beside_mm=0.0, above_mm=0.0, axis=UP):
    tips = curve.points_mm - beside_mm * curve.inward + above_mm * UP
    return tips, np.tile(axis, (len(tips), 1))


@pytest.fixture(scope="module")
def plate(synthetic):
    """Both skins of a 3 mm plate and both edges of its wall, at a hole."""
    hole = synthetic.oval(150.0, 100.0)
    return [
        skin(synthetic, hole, 0.0, up=True),
        skin(synthetic, hole, -3.0, up=False),
        wall(synthetic, hole, 0.0),
        wall(synthetic, hole, -3.0),
    ]


@pytest.mark.parametrize(("beside", "above"), [(0.0, 0.0), (5.0, 0.0), (5.0, -3.0), (8.0, -4.5)])
def test_the_tool_axis_tells_the_outer_skin_from_the_inner_one_and_from_the_wall(plate, beside, above):
    tips, axes = path_along(plate[0], beside, above)
    chosen = assign(tips, axes, np.ones(len(tips), bool), plate, 20.0)
    assert chosen.used == (0,)
    assert (chosen.contour == 0).all()
    np.testing.assert_allclose(chosen.distance_mm, np.hypot(beside, above), atol=0.05)


def test_from_below_the_inner_skin_is_chosen(plate):
    tips, axes = path_along(plate[0], 5.0, -3.0, axis=-UP)
    assert assign(tips, axes, np.ones(len(tips), bool), plate, 20.0).used == (1,)


def test_an_axis_that_leans_by_thirty_degrees_still_chooses_its_skin(plate):
    lean = np.cos(np.radians(30.0)) * plate[0].outward + np.sin(np.radians(30.0)) * plate[0].tangents
    tips, _ = path_along(plate[0], 4.0, -2.0)
    assert assign(tips, lean, np.ones(len(tips), bool), plate, 20.0).used == (0,)


def test_a_path_over_two_holes_follows_both_the_longer_first(synthetic):
    holes = [
        skin(synthetic, synthetic.circle(radius, centre=centre))
        for radius, centre in ((30.0, (0.0, 0.0)), (60.0, (150.0, 0.0)), (40.0, (0.0, 200.0)))
    ]
    (first, axes_1), (second, axes_2) = path_along(holes[0], 4.0), path_along(holes[1], 4.0)
    tips, axes = np.vstack([first, second]), np.vstack([axes_1, axes_2])
    chosen = assign(tips, axes, np.ones(len(tips), bool), holes, 20.0)
    assert chosen.used == (1, 0)
    assert (chosen.contour == np.repeat([0, 1], [len(first), len(second)])).all()


def test_moves_that_do_not_cut_choose_no_contour_but_get_one(synthetic):
    holes = [skin(synthetic, synthetic.circle(30.0, centre=(x, 0.0))) for x in (0.0, 200.0)]
    cut, axes = path_along(holes[0], 3.0)
    approach = holes[1].points_mm[:20] + 50.0 * UP
    tips = np.vstack([approach, cut])
    cutting = np.arange(len(tips)) >= 20
    chosen = assign(tips, np.tile(UP, (len(tips), 1)), cutting, holes, 20.0)
    assert chosen.used == (0,)
    assert (chosen.contour == 0).all()
    assert chosen.distance_mm[:20].min() > 100.0
    assert len(axes) == cutting.sum()


def test_a_small_hole_beside_a_long_edge_is_not_dropped(synthetic):
    contours = [
        skin(synthetic, synthetic.circle(500.0, hole=False)),
        skin(synthetic, synthetic.circle(10.0)),
    ]
    (edge, axes_1), (hole, axes_2) = path_along(contours[0]), path_along(contours[1])
    hole, axes_2 = hole[::2], axes_2[::2]
    chosen = assign(
        np.vstack([edge, hole]), np.vstack([axes_1, axes_2]), np.ones(len(edge) + len(hole), bool), contours, 20.0
    )
    assert (chosen.contour[len(edge) :] == 1).all()


def test_a_path_over_sixty_holes_follows_all_of_them(synthetic):
    holes = [skin(synthetic, synthetic.circle(5.0, centre=(30.0 * i, 0.0))) for i in range(60)]
    tips = np.vstack([hole.points_mm for hole in holes])
    chosen = assign(tips, np.tile(UP, (len(tips), 1)), np.ones(len(tips), bool), holes, 20.0)
    assert sorted(chosen.used) == list(range(60))
