"""The result must move with the scan, grow with the scale, and depend on no order that means nothing."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam.model import Contour, Scan
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import METHODS, RegistrationSettings
from sicp_cam.rigid_motion import apply, inverse, rotate

NEAR = RegistrationSettings(reach_mm=20.0, segments=12)
SEEDS = st.integers(0, 2**32 - 1)


class Part(SimpleNamespace):
    """Hypothesis prints the arguments of a failing test, so this stays short."""

    def __repr__(self):
        return "part"


class Curves(dict):
    def __repr__(self):
        return "reference"


@pytest.fixture(scope="module")
def part(synthetic):
    """A small egg-shaped opening in a sagging dome, scanned in a band narrower than the crop."""
    outline, nominal = synthetic.egg(45.0), synthetic.dome(400.0, 700.0)
    bent = synthetic.bent(nominal, lambda u, w: 8e-4 * u * u + 3e-4 * u * w)
    pose = synthetic.random_pose(41)
    uv = synthetic.material([outline], depth_mm=22.0, seed=41)
    return Part(
        contour=synthetic.contour(outline, nominal, rings_mm=(6.0, 15.0)),
        scan=synthetic.scan(uv, bent, pose=pose, outliers=0.002),
        start=synthetic.disturbed(pose, 41, shift_mm=2.0),
        outline=outline,
        bent=bent,
        pose=pose,
    )


@pytest.fixture(scope="module")
def reference(part):
    return Curves({method: corrected(part.contour, part.scan, part.start, method) for method in METHODS})


def corrected(contour, scan, start, method="sicp", options=NEAR):
    return register_contours({1: contour}, scan, start, method=method, settings=options).contours[0].corrected


def carried(contour, T):
    return Contour(
        apply(T, contour.points_mm),
        rotate(T, contour.tangents),
        rotate(T, contour.normals),
        contour.closed,
        ring_points_mm=apply(T, contour.ring_points_mm),
        ring_normals=rotate(T, contour.ring_normals),
    )


@pytest.mark.parametrize("method", METHODS)
@settings(deadline=None, max_examples=3)
@given(seed=SEEDS)
def test_a_motion_of_the_scan_moves_the_result_with_it(synthetic, part, reference, method, seed):
    Q = synthetic.random_pose(seed)
    moved = corrected(part.contour, Scan(apply(Q, part.scan.points_mm)), Q @ part.start, method)
    np.testing.assert_allclose(moved.points_mm, apply(Q, reference[method].points_mm), atol=1e-4)
    np.testing.assert_allclose(moved.outward, rotate(Q, reference[method].outward), atol=1e-5)


@settings(deadline=None, max_examples=3)
@given(seed=SEEDS)
def test_a_motion_of_the_part_changes_nothing(synthetic, part, reference, seed):
    Q = synthetic.random_pose(seed)
    found = corrected(carried(part.contour, Q), part.scan, part.start @ inverse(Q))
    np.testing.assert_allclose(found.points_mm, reference["sicp"].points_mm, atol=1e-6)
    np.testing.assert_allclose(found.outward, reference["sicp"].outward, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@settings(deadline=None, max_examples=3)
@given(seed=SEEDS)
def test_the_order_of_the_points_changes_nothing(part, reference, method, seed):
    order = np.random.default_rng(seed).permutation(len(part.scan.points_mm))
    found = corrected(part.contour, Scan(part.scan.points_mm[order]), part.start, method)
    np.testing.assert_allclose(found.points_mm, reference[method].points_mm, atol=1e-4)


@settings(deadline=None, max_examples=4)
@given(seed=SEEDS)
def test_the_order_of_the_stability_points_changes_nothing(part, reference, seed):
    order = np.random.default_rng(seed).permutation(len(part.contour.ring_points_mm))
    c = part.contour
    shuffled = Contour(
        c.points_mm, c.tangents, c.normals, ring_points_mm=c.ring_points_mm[order], ring_normals=c.ring_normals[order]
    )
    np.testing.assert_allclose(
        corrected(shuffled, part.scan, part.start).points_mm, reference["sicp"].points_mm, atol=1e-6
    )


@settings(deadline=None, max_examples=4)
@given(factor=st.floats(0.3, 30.0))
def test_the_result_grows_with_the_scale(part, reference, factor):
    c = part.contour
    larger = Contour(
        factor * c.points_mm,
        c.tangents,
        c.normals,
        ring_points_mm=factor * c.ring_points_mm,
        ring_normals=c.ring_normals,
    )
    start = part.start.copy()
    start[:3, 3] *= factor
    options = RegistrationSettings(reach_mm=20.0 * factor, segments=12, corner_radius_mm=1e-3)
    found = corrected(larger, Scan(factor * part.scan.points_mm), start, options=options)
    np.testing.assert_allclose(found.points_mm / factor, reference["sicp"].points_mm, atol=5e-3)


@settings(deadline=None, max_examples=4)
@given(share=st.floats(0.05, 0.95))
def test_where_the_contour_begins_changes_the_curve_by_less_than_its_noise(part, reference, share):
    c = part.contour
    k = int(share * len(c.points_mm))
    elsewhere = Contour(
        *(np.roll(values, -k, axis=0) for values in (c.points_mm, c.tangents, c.normals)),
        ring_points_mm=c.ring_points_mm,
        ring_normals=c.ring_normals,
    )
    found = np.roll(corrected(elsewhere, part.scan, part.start).points_mm, k, axis=0)
    offset = found - reference["sicp"].points_mm
    across, out = (
        np.abs(np.sum(offset * axis, axis=1)) for axis in (reference["sicp"].inward, reference["sicp"].outward)
    )
    assert across.mean() < 0.1
    assert out.mean() < 0.1
    assert max(across.max(), out.max()) < 0.4


def test_the_other_skin_of_the_same_edge_gets_the_same_curve_and_the_other_axis(part, reference):
    """Seen from the other side the contour runs backwards, its material still to the left."""
    c = part.contour
    other = Contour(
        c.points_mm[::-1],
        -c.tangents[::-1],
        -c.normals[::-1],
        ring_points_mm=c.ring_points_mm,
        ring_normals=-c.ring_normals,
    )
    found = corrected(other, part.scan, part.start)
    offset = found.points_mm[::-1] - reference["sicp"].points_mm
    for axis in (reference["sicp"].inward, reference["sicp"].outward):
        assert np.abs(np.sum(offset * axis, axis=1)).mean() < 0.1
    assert np.sum(found.outward[::-1] * reference["sicp"].outward, axis=1).max() < -0.99


def test_another_start_within_reach_leads_to_the_same_curve(synthetic, part, reference):
    for seed in (1, 2):
        found = corrected(part.contour, part.scan, synthetic.disturbed(part.pose, seed, degrees=1.5, shift_mm=3.0))
        assert np.linalg.norm(found.points_mm - reference["sicp"].points_mm, axis=1).max() < 0.01


def test_the_reference_itself_is_right(synthetic, part, reference):
    error = synthetic.errors(reference["sicp"], part.outline, part.bent, part.pose)
    assert np.abs(error.out).mean() < 0.05
    assert np.abs(error.normal).mean() < 0.3
