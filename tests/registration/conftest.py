"""One sagging part with a gap and outliers in its scan, registered once by each method and shared by the tests."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import RegistrationSettings

REACH_MM = 25.0


def rise(u, w):
    """Bend, twist and wave: 8 mm along the rim of the opening."""
    return 6e-4 * u * u + 2e-4 * u * w + 0.5 * np.sin(u / 40.0)


@pytest.fixture(scope="session")
def sagging(synthetic):
    """An oval opening in a dome; the scan has 2 mm spacing, 0.05 mm noise, a gap of 30 mm and 0.5 % outliers."""
    outline = synthetic.oval(100.0, 75.0)
    nominal = synthetic.dome(1500.0, 2500.0)
    bent = synthetic.bent(nominal, rise)
    whole = synthetic.material([outline], depth_mm=40.0, seed=4)
    uv = synthetic.without_gaps(whole, outline, [(100.0, 130.0)])
    pose = synthetic.random_pose(4)
    return SimpleNamespace(
        outline=outline,
        nominal=nominal,
        bent=bent,
        uv=uv,
        whole=whole,
        pose=pose,
        contour=synthetic.contour(outline, nominal),
        scan=synthetic.scan(uv, bent, outliers=0.005, pose=pose),
        start=synthetic.disturbed(pose, 3, shift_mm=3.0),
        settings=RegistrationSettings(reach_mm=REACH_MM),
    )


@pytest.fixture(scope="session")
def registered(synthetic, sagging):
    """Give (registration, errors of its corrected curve) by method, each run once."""
    done = {}

    def by_method(method):
        if method not in done:
            found = register_contours(
                {1: sagging.contour}, sagging.scan, sagging.start, method=method, settings=sagging.settings
            )
            curve = found.contours[0].corrected
            done[method] = found, synthetic.errors(curve, sagging.outline, sagging.bent, sagging.pose)
        return done[method]

    return by_method
