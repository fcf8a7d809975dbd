"""The projection method follows what is a function over the plane of the contour, and nothing else."""

import numpy as np
import pytest

from sicp_cam.contour.frames import framed, moved
from sicp_cam.errors import RegistrationError
from sicp_cam.options.values import table
from sicp_cam.registration.projection import project
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.rigid import NominalContour
from sicp_cam.registration.scan_surface import prepared
from sicp_cam.registration.settings import RegistrationSettings

PARABOLA = RegistrationSettings(reach_mm=25.0, projection_surface="parabola")
SPLINE = RegistrationSettings(reach_mm=25.0, projection_surface="spline")


def barrel(u, w):
    """Bend about an axis at 30 degrees: 10 mm at the rim of an opening of 100 mm radius."""
    return 1e-3 * (np.cos(np.pi / 6.0) * u + np.sin(np.pi / 6.0) * w) ** 2


def saddle(u, w):
    """Bend both ways, with a wave: no parabola over one direction follows it."""
    return 8e-4 * u * u - 5e-4 * w * w + 0.8 * np.sin(u / 35.0)


@pytest.fixture(scope="module")
def followed(synthetic):
    """Give a function that registers a nominal sheet's contour to its bent scan: (contour, its errors)."""

    def register(nominal, bent, settings, *, outline=None, seed=5, method="projection", gaps=(), **scanned):
        outline = outline or synthetic.oval(100.0, 75.0)
        pose = synthetic.random_pose(seed)
        uv = synthetic.without_gaps(synthetic.material([outline], depth_mm=40.0, seed=seed), outline, gaps)
        scan = synthetic.scan(uv, bent, pose=pose, **scanned)
        start = synthetic.disturbed(pose, seed, shift_mm=3.0)
        nominal_contour = synthetic.contour(outline, nominal)
        found = register_contours({1: nominal_contour}, scan, start, method=method, settings=settings)
        (contour,) = found.contours
        return contour, synthetic.errors(contour.corrected, outline, bent, pose)

    return register


def test_a_barrel_bend_is_followed_by_the_parabola_whatever_its_direction(synthetic, followed):
    bent = synthetic.bent(synthetic.plane, barrel)
    _, rigid = followed(synthetic.plane, bent, PARABOLA, method="rigid")
    contour, error = followed(synthetic.plane, bent, PARABOLA)
    assert np.abs(rigid.out).mean() > 1.0
    assert np.abs(error.out).mean() < 0.03
    assert np.abs(error.out).max() < 0.1
    assert error.axis_deg.mean() < 0.2
    assert contour.segments == () and len(contour.split_s_mm) == 0


@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_a_sheet_rolled_to_a_cylinder_is_followed(synthetic, followed, settings):
    """The roll is an isometry, so the edge also moves in the plane, where this method does nothing."""
    _, error = followed(synthetic.plane, synthetic.cylinder(900.0), settings, outline=synthetic.circle(100.0))
    assert np.abs(error.out).mean() < 0.04
    assert np.abs(error.out).max() < 0.1
    assert error.axis_deg.mean() < 0.2


def test_a_saddle_on_a_dome_is_followed_by_the_spline_and_not_by_the_parabola(synthetic, followed):
    nominal = synthetic.dome(1500.0, 2500.0)
    bent = synthetic.bent(nominal, saddle)
    _, spline = followed(nominal, bent, SPLINE)
    _, parabola = followed(nominal, bent, PARABOLA)
    assert np.abs(spline.out).mean() < 0.03
    assert np.abs(spline.out).max() < 0.1
    assert spline.axis_deg.mean() < 0.25
    assert np.abs(parabola.out).mean() > 0.2


@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_a_part_that_is_not_bent_is_left_where_it_is(synthetic, followed, settings):
    contour, error = followed(synthetic.plane, synthetic.plane, settings)
    move = np.linalg.norm(contour.corrected.points_mm - contour.rigid.points_mm, axis=1)
    assert move.max() < 0.05  # the scan's noise
    assert np.abs(error.out).mean() < 0.02
    assert error.axis_deg.mean() < 0.2


@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_outliers_and_a_gap_do_not_lead_it_astray(synthetic, followed, settings):
    bent = synthetic.bent(synthetic.plane, barrel)
    contour, error = followed(synthetic.plane, bent, settings, gaps=[(100.0, 140.0)], outliers=0.02)
    assert not contour.covered.all()
    assert np.abs(error.out[contour.covered]).mean() < 0.04
    assert np.abs(error.out).max() < 0.3


@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_nothing_moves_in_the_plane_of_the_contour(synthetic, followed, settings):
    contour, _ = followed(synthetic.plane, synthetic.bent(synthetic.plane, barrel), settings)
    move = contour.corrected.points_mm - contour.rigid.points_mm
    _, extents, axes = np.linalg.svd(move, full_matrices=False)
    assert extents[1] < 1e-9 * extents[0]
    np.testing.assert_allclose(np.abs(contour.rigid.outward @ axes[0]), 1.0, atol=1e-6)


@pytest.mark.parametrize("amplitude", [0.0, 6.0])
@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_an_open_edge_is_followed_straight_or_not(synthetic, followed, settings, amplitude):
    nominal = synthetic.dome(1500.0, 2500.0)
    bent = synthetic.bent(nominal, lambda u, w: 4e-4 * u * u)
    edge = synthetic.wavy_edge(300.0, amplitude)
    contour, error = followed(nominal, bent, settings, outline=edge)
    inner = (contour.nominal.s_mm > 15.0) & (contour.nominal.s_mm < edge.length_mm - 15.0)
    assert np.abs(error.out[inner]).mean() < 0.04
    assert np.abs(error.out[inner]).max() < 0.12
    assert error.axis_deg[inner].mean() < 0.3


@pytest.mark.parametrize("settings", [PARABOLA, SPLINE])
def test_the_frames_turn_with_the_bend_where_the_scan_shows_nothing(synthetic, settings):
    """Within a gap the slope of the scan is unknown: T and N there come from the slope of f."""
    outline, bent = synthetic.circle(100.0), synthetic.bent(synthetic.plane, barrel)
    uv = synthetic.without_gaps(synthetic.material([outline], depth_mm=40.0, seed=8), outline, [(200.0, 250.0)])
    nominal = synthetic.contour(outline)
    surface = prepared(synthetic.scan(uv, bent))
    model = NominalContour(framed(nominal), nominal.ring_points_mm, nominal.ring_normals)
    curve = project(model, surface, np.eye(4), settings)
    steps = np.roll(curve.points_mm, -1, axis=0) - np.roll(curve.points_mm, 1, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.minimum(np.sum(steps * curve.tangents, axis=1), 1.0))).max() < 0.1
    error = synthetic.errors(curve, outline, bent)
    assert error.axis_deg[205:245].max() < 1.5


def test_a_surface_that_stands_upright_on_the_plane_is_refused(synthetic):
    """The end of a tube: its edge lies in a plane, its surface across it."""

    def tube(uv):
        angle = uv[:, 0] / 60.0
        return np.column_stack([60.0 * np.cos(angle), 60.0 * np.sin(angle), uv[:, 1]])

    edge = synthetic.wavy_edge(2.0 * np.pi * 60.0 - 1.0, 0.0)
    nominal = synthetic.contour(edge, tube, rings_mm=())
    surface = prepared(synthetic.scan(synthetic.material([edge], depth_mm=30.0, seed=7), tube))
    model = NominalContour(framed(nominal), nominal.ring_points_mm, nominal.ring_normals)
    with pytest.raises(RegistrationError, match="use another --method than projection"):
        project(model, surface, np.eye(4), SPLINE)


def test_a_straight_edge_without_stability_points_is_refused(synthetic):
    edge = synthetic.wavy_edge(300.0, 0.0)
    nominal = synthetic.contour(edge, rings_mm=())
    surface = prepared(synthetic.scan(synthetic.material([edge], depth_mm=30.0, seed=7)))
    model = NominalContour(framed(nominal), nominal.ring_points_mm, nominal.ring_normals)
    with pytest.raises(RegistrationError, match="straight and spans no plane"):
        project(model, surface, np.eye(4), SPLINE)


def test_the_curve_keeps_its_stations_and_its_inputs(synthetic):
    outline = synthetic.oval(100.0, 75.0)
    nominal = synthetic.contour(outline)
    model = NominalContour(framed(nominal), nominal.ring_points_mm, nominal.ring_normals)
    surface = prepared(
        synthetic.scan(synthetic.material([outline], depth_mm=40.0), synthetic.bent(synthetic.plane, barrel))
    )
    before = surface.points_mm.copy(), model.curve.points_mm.copy()
    curve = project(model, surface, np.eye(4), PARABOLA)
    np.testing.assert_array_equal(curve.s_mm, moved(model.curve, np.eye(4)).s_mm)
    np.testing.assert_array_equal(surface.points_mm, before[0])
    np.testing.assert_array_equal(model.curve.points_mm, before[1])


def test_the_form_of_the_surface_is_one_of_two_words():
    settings, problems = table(RegistrationSettings, {"projection_surface": "parabola"})
    assert settings is not None and settings.projection_surface == "parabola" and not problems
    settings, problems = table(RegistrationSettings, {"projection_surface": "parabla"})
    assert settings is None
    assert "must be one of parabola, spline" in problems["projection_surface"]
