"""The stated uncertainty against the true errors: a Monte-Carlo study over samplings and seeds."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import RegistrationSettings

SPACING = 2.0
BAND = 1.96
SEEDS = {"random": range(1, 15), "jittered": range(1, 15), "voxels": range(1, 9), "mesh": range(1, 9)}
NEAR = RegistrationSettings(reach_mm=20.0)


def sag(u, w):
    return 4e-4 * u * u + 2e-4 * u * w + 0.3 * np.sin(u / 40.0)


def one_run(lib, sampling, seed):
    """Register a bent opening of 70 mm, by seed an egg, an oval or an outer edge; return what is covered."""
    outline = (lib.egg(65.0), lib.oval(78.0, 58.0), lib.egg(65.0, hole=False))[seed % 3]
    nominal, pose = lib.dome(900.0, 1500.0), lib.random_pose(seed)
    bent = lib.bent(nominal, sag)
    grid = "jittered" if sampling == "mesh" else sampling
    uv = lib.material([outline], sampling=grid, spacing_mm=SPACING, depth_mm=24.0, seed=seed)
    faces = lib.triangles(uv, SPACING, [outline]) if sampling == "mesh" else None
    scan = lib.scan(uv, bent, pose=pose, faces=faces, seed=seed + 1000)
    part = lib.contour(outline, nominal, rings_mm=(10.0, 20.0))
    found = register_contours({1: part}, scan, lib.disturbed(pose, seed, shift_mm=2.0), settings=NEAR)
    (contour,) = found.contours
    error = lib.errors(contour.corrected, outline, bent, pose)
    c = contour.covered
    return SimpleNamespace(
        normal=error.normal[c], normal_u=contour.normal_u_mm[c], out=error.out[c], out_u=contour.out_u_mm[c]
    )


@pytest.fixture(scope="module")
def runs(synthetic):
    return {sampling: [one_run(synthetic, sampling, seed) for seed in seeds] for sampling, seeds in SEEDS.items()}


def joined(runs, name):
    return np.concatenate([getattr(run, name) for run in runs])


def share(runs, axis):
    """Return the share of stations whose error lies within the stated 95 % band."""
    return float(np.mean(np.abs(joined(runs, axis)) <= BAND * joined(runs, f"{axis}_u")))


def ratio(runs, axis):
    """Return the root mean square error over the root mean square stated uncertainty."""
    error, stated = joined(runs, axis), joined(runs, f"{axis}_u")
    return float(np.sqrt(np.mean(error**2) / np.mean(stated**2)))


@pytest.mark.parametrize("axis", ["normal", "out"])
def test_95_percent_of_the_true_errors_lie_within_the_stated_band(runs, axis):
    every = [run for some in runs.values() for run in some]
    assert len(every) >= 40
    assert 0.9 <= share(every, axis) <= 0.99


@pytest.mark.parametrize("axis", ["normal", "out"])
@pytest.mark.parametrize("sampling", SEEDS)
def test_no_sampling_makes_the_stated_uncertainty_a_lie(runs, sampling, axis):
    assert 0.85 <= share(runs[sampling], axis) <= 0.995
    assert 0.65 < ratio(runs[sampling], axis) < 1.4


@pytest.mark.parametrize("sampling", SEEDS)
def test_no_sampling_moves_the_contour_to_one_side(runs, sampling):
    assert abs(np.mean([run.normal.mean() for run in runs[sampling]])) < 0.025 * SPACING
    assert abs(np.mean([run.out.mean() for run in runs[sampling]])) < 0.005
