"""A sagging part registered once by each method and shared by the tests; parts under every condition of a job."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from sicp_cam.model import Scan
from sicp_cam.registration.register import register_contours
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.rigid_motion import apply

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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Case:
    """A part, its scan, and the truth."""

    outlines: dict[int, object]
    nominal: object
    sheet: object
    scan: Scan
    pose: np.ndarray
    start: np.ndarray | None
    spacing_mm: float = 2.0
    noise_mm: float = 0.05
    contours: dict = field(default_factory=dict)
    hidden_mm: tuple = ()
    """(start, end) arc lengths of the first outline that the scan does not show."""


def sag(u, w):
    """Bend, twist and wave: about 4 mm at 80 mm from the middle."""
    return 5e-4 * u * u + 2e-4 * u * w + 0.3 * np.sin(u / 40.0)


def build(
    lib,
    outlines,
    seed,
    *,
    nominal=None,
    sheet=None,
    rise=sag,
    uv=None,
    spacing_mm=2.0,
    noise_mm=0.05,
    sampling="jittered",
    depth_mm=None,
    others=(),
    mixed=0.0,
    box=0.0,
    gaps_mm=(),
    auto=False,
    pose=None,
    single=False,
    mesh=False,
):
    """Make a case: outlines on a nominal sheet, bent by `rise` (or into `sheet`), scanned, and a rough start pose.

    Wrong points: `box`, anywhere around the scan, as a share of its points; `mixed`, on the surface up to 3 mm outside
    of the edge, as a share of the points within 20 mm of it.
    """
    outlines = outlines if isinstance(outlines, dict) else {1: outlines}
    edges = [*outlines.values(), *others]
    nominal = nominal or lib.dome(1500.0, 2500.0)
    sheet = sheet or lib.bent(nominal, rise)
    pose = lib.random_pose(seed) if pose is None else pose
    depth_mm = depth_mm or max(15.0, 16.0 * spacing_mm)
    if uv is None:
        uv = lib.material(edges, sampling=sampling, spacing_mm=spacing_mm, depth_mm=depth_mm, seed=seed)
    for gap in gaps_mm:
        uv = lib.without_gaps(uv, edges[0], [gap], depth_mm=np.inf)
    faces = lib.triangles(uv, spacing_mm, edges) if mesh else None
    near = np.concatenate([[edge.depth(uv)[0] < 20.0] for edge in outlines.values()]).any(axis=0)
    wrong = [lib.strays(edge, round(mixed * near.sum() / len(outlines)), seed=seed) for edge in outlines.values()]
    points = lib.scan(np.concatenate([uv, *wrong]), sheet, noise_mm=noise_mm, seed=seed + 100).points_mm
    low, high = points.min(axis=0) - 20.0, points.max(axis=0) + 20.0
    dust = np.random.default_rng(seed).uniform(low, high, (round(box * len(points)), 3))
    points = apply(pose, np.concatenate([points, dust]))
    points = points.astype(np.float32).astype(np.float64) if single else points
    start = None if auto else rough(lib, pose, nominal, edges[0], seed)
    step = min(1.0, spacing_mm)
    contours = {
        n: lib.contour(outline, nominal, step_mm=step, others=[e for e in edges if e is not outline])
        for n, outline in outlines.items()
    }
    return Case(
        outlines, nominal, sheet, Scan(points, faces=faces), pose, start, spacing_mm, noise_mm, contours, tuple(gaps_mm)
    )


def rough(lib, pose, nominal, outline, seed):
    """Return a pose 5 mm and 1 degree off at the contour, wherever the part's origin lies."""
    centre = np.eye(4)
    centre[:3, 3] = nominal(outline.points).mean(axis=0)
    return lib.disturbed(pose @ centre, seed) @ np.linalg.inv(centre)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Measured:
    """Errors of all stations of all contours of a case, and which of them count as covered."""

    normal: np.ndarray
    out: np.ndarray
    both: np.ndarray
    axis_deg: np.ndarray
    covered: np.ndarray
    s_mm: np.ndarray

    def mean(self, rows=None):
        return float(self.both[self.covered if rows is None else rows].mean())


def measured(lib, case, found):
    error = [lib.errors(c.corrected, case.outlines[c.number], case.sheet, case.pose) for c in found.contours]
    join = {name: np.concatenate([getattr(e, name) for e in error]) for name in ("normal", "out", "both", "axis_deg")}
    covered = np.concatenate([c.covered for c in found.contours])
    return Measured(**join, covered=covered, s_mm=np.concatenate([c.nominal.s_mm for c in found.contours]))


def holes(lib, count):
    """Return some of three openings of different shape in one part, by number."""
    some = {
        2: lib.circle(28.0, centre=(-62.0, 5.0)),
        3: lib.oval(38.0, 26.0, centre=(52.0, -5.0)),
        7: lib.egg(22.0, centre=(-4.0, 62.0)),
    }
    return dict(list(some.items())[:count])


def in_rows(lib, outline, seed, **options):
    """Make a case whose scan lies in rows 2 mm apart, see `rows`."""
    uv = lib.rows([outline], depth_mm=32.0, seed=seed, **options)
    return build(lib, outline, seed, uv=uv, rise=lambda u, w: 3e-4 * u * u)


def frame_opening(lib):
    return lib.rounded_rectangle(120.0, 80.0, 15.0, hole=True)


@pytest.fixture(scope="session")
def conditions(synthetic):
    """Give the builders of parts, with `build`, which makes a case, and `measured`, which holds it to its truth."""
    both = type(synthetic)(**vars(synthetic))
    for function in (build, measured, holes, in_rows, frame_opening):
        setattr(both, function.__name__, partial(function, both))
    return both
