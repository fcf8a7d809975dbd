"""The cases of the benchmark: the samples, and parts built in closed form, so that their true edge is known exactly."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from shapes import (
    Outline,
    Sheet,
    barrel,
    bent,
    circle,
    dome,
    flat,
    frame,
    oval,
    rectangle,
    sampled,
    triangles,
    wavy_edge,
)
from truth import Truth

import sicp_cam
from sicp_cam.alignment import read_alignment
from sicp_cam.correction import choose_contours, contours_of
from sicp_cam.model import Contour, Scan
from sicp_cam.rigid_motion import apply, from_parts, rotate

__all__ = ["BUILT", "FOLDER", "SAMPLES", "Case", "Recipe", "built", "sample", "sample_truth"]

FOLDER = Path(__file__).resolve().parent.parent / "samples"
SAMPLES = {"porthole": "path.apt", "nosecone": "path.apt", "disc": "path.nc"}
"""Path file of each sample."""

STEP_MM = 2.0
DEPTH_MM = 60.0
RINGS_MM = (10.0, 30.0)
NOISE_MM = 0.05
OUTLIERS = 0.002
GAP_MM = 30.0
START_MM, START_DEG = 5.0, 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Recipe:
    """How a case is built; the seed adds the places of the points, their noise, the pose and the start."""

    about: str
    outline: Outline
    nominal: Sheet
    bent: Sheet
    sampling: str = "grid"
    spacing_mm: float = 2.0
    gaps: tuple[float, ...] = field(default=())
    """Share of the length at which a gap of 30 mm begins."""
    outliers: float = OUTLIERS


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A nominal contour, a scan of the bent part, the start pose, and the truth."""

    contour: Contour
    scan: Scan
    T_start: np.ndarray
    truth: Truth


def _twisted(rise_mm: float, size_mm: float) -> Sheet:
    """Return a dome that bends by `rise_mm` at `size_mm` from its middle, with a twist and a wave."""
    nominal = dome(1500.0, 2500.0)
    k = rise_mm / size_mm**2
    return bent(
        nominal, lambda u, w: k * (u * u + 0.3 * u * w - 0.2 * w * w) + 0.05 * rise_mm * np.sin(5.0 * u / size_mm)
    )


def _porthole(sampling: str, spacing_mm: float) -> Recipe:
    about = f"oval opening 200 x 150 mm in a dome, bent by 8 mm; {sampling}, {spacing_mm:g} mm"
    return Recipe(about, oval(100.0, 75.0), dome(1500.0, 2500.0), _twisted(8.0, 100.0), sampling, spacing_mm, (0.3,))


BUILT: dict[str, Recipe] = {
    "grid 1 mm": _porthole("grid", 1.0),
    "grid 2 mm": _porthole("grid", 2.0),
    "grid 4 mm": _porthole("grid", 4.0),
    "random 2 mm": _porthole("random", 2.0),
    "voxels 2 mm": _porthole("voxels", 2.0),
    "mesh 2 mm": _porthole("mesh", 2.0),
    "bent 20 mm": Recipe(
        "oval opening 300 x 200 mm in a dome, bent by 20 mm; voxels, 2 mm",
        oval(150.0, 100.0),
        dome(1500.0, 2500.0),
        _twisted(20.0, 150.0),
        "voxels",
        gaps=(0.1, 0.6),
    ),
    "barrel": Recipe(
        "opening 400 x 250 mm, corner radius 40 mm, in a barrel of radius 900 mm, bent by 10 mm; voxels, 2 mm",
        rectangle(400.0, 250.0, 40.0),
        barrel(900.0),
        bent(barrel(900.0), lambda u, w: 2e-4 * u * u - 1.3e-4 * w * w + 1e-4 * u * w + 0.5 * np.cos(w / 40.0)),
        "voxels",
        gaps=(0.45,),
    ),
    "circle": Recipe(
        "circle of radius 100 mm in a flat sheet rolled to a radius of 700 mm; random, 2 mm",
        circle(100.0),
        flat,
        barrel(700.0),
        "random",
        gaps=(0.7,),
    ),
    "sharp corners": Recipe(
        "opening 260 x 180 mm with sharp corners in a dome, bent by 8 mm; grid, 2 mm",
        rectangle(260.0, 180.0, 0.0),
        dome(1500.0, 2500.0),
        _twisted(8.0, 130.0),
    ),
    "open edge": Recipe(
        "edge 600 mm long that does not close, bent by 12 mm; voxels, 2 mm",
        wavy_edge(600.0, 15.0),
        dome(1500.0, 2500.0),
        bent(dome(1500.0, 2500.0), lambda u, w: 1.3e-4 * u * u + 1e-4 * u * w + 0.4 * np.sin(u / 45.0)),
        "voxels",
        gaps=(0.4,),
    ),
}
"""The built cases by name."""


def sample(name: str) -> Case:
    """Read a sample as bare arrays, for those who do not take its files."""
    folder = FOLDER / name
    path, part = sicp_cam.read_path(folder / SAMPLES[name]), sicp_cam.read_part(folder / "part.step")
    (contour,) = choose_contours(contours_of(part), path, None, path_distance_mm=5.0).values()
    start = read_alignment(folder / "pose_rough.txt").T_scan_part
    return Case(contour, sicp_cam.read_scan(folder / "scan.ply"), start, sample_truth(name))


def sample_truth(name: str) -> Truth:
    """Read where the edge of a sample really is."""
    with np.load(FOLDER / name / "truth.npz", allow_pickle=False) as t:
        return Truth(t["path"], t["axis"], t["path_true"], t["inward"], t["axis_true"], t["covered"])


def built(name: str, seed: int) -> Case:
    """Build a case: the scan has 0.05 mm of noise in all axes, 0.2 % outliers, and lies in a pose of its own."""
    recipe, rng = BUILT[name], np.random.default_rng([seed, list(BUILT).index(name)])
    outline = recipe.outline
    pose = from_parts(Rotation.random(rng=rng).as_matrix(), rng.uniform(-1000.0, 1000.0, 3))
    meshed = recipe.sampling == "mesh"
    uv = sampled(outline, "grid" if meshed else recipe.sampling, recipe.spacing_mm, DEPTH_MM, rng)
    uv = uv[~_hidden(uv, recipe, 25.0)]
    scan = _scanned(uv, recipe, pose, rng, triangles(uv, recipe.spacing_mm, outline) if meshed else None)
    start = pose @ _disturbance(rng)
    return Case(_contour(outline, recipe.nominal), scan, start, _truth(recipe, pose))


def _hidden(uv: np.ndarray, recipe: Recipe, depth_mm: float, margin_mm: float = 0.0) -> np.ndarray:
    """Say which places lie within `depth_mm` of the edge and in a gap of the scan, widened by a margin."""
    outline, hidden = recipe.outline, np.zeros(len(uv), dtype=bool)
    for share in recipe.gaps:
        i = int((share + 0.5 * GAP_MM / outline.length_mm) * len(outline.points))
        middle, along = outline.points[i], outline.tangents[i]
        near = np.abs((uv - middle) @ along) < 0.5 * GAP_MM + margin_mm
        hidden |= near & (np.abs((uv - middle) @ np.array([-along[1], along[0]])) < depth_mm)
    return hidden


def _scanned(
    uv: np.ndarray, recipe: Recipe, pose: np.ndarray, rng: np.random.Generator, faces: np.ndarray | None
) -> Scan:
    points = recipe.bent(uv) + rng.normal(0.0, NOISE_MM, (len(uv), 3))
    wild = rng.random(len(uv)) < recipe.outliers
    points[wild] += rng.uniform(-20.0, 20.0, (int(wild.sum()), 3))
    return Scan(apply(pose, points), None, faces)


def _disturbance(rng: np.random.Generator) -> np.ndarray:
    """Return a motion of 5 mm and 1 degree about the origin of the part: what a fixture leaves."""
    turn, shift = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    return from_parts(Rotation.from_rotvec(np.radians(START_DEG) * turn).as_matrix(), START_MM * shift)


def _laid(outline: Outline, sheet: Sheet, step_mm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points, unit tangents and normals of an outline laid on a sheet."""
    uv, along, _ = outline.every(step_mm)
    du, dw, normals = frame(sheet, uv)
    tangents = along[:, :1] * du + along[:, 1:] * dw
    return sheet(uv), tangents / np.linalg.norm(tangents, axis=1, keepdims=True), normals


def _contour(outline: Outline, sheet: Sheet) -> Contour:
    points, tangents, normals = _laid(outline, sheet, 0.5 * STEP_MM)
    place, _, inward = outline.every(5.0 * STEP_MM)
    ring = np.concatenate([place + depth * inward for depth in RINGS_MM])
    rings = {"ring_points_mm": sheet(ring), "ring_normals": frame(sheet, ring)[2]}
    return Contour(points, tangents, normals, outline.closed, **rings)


def _truth(recipe: Recipe, pose: np.ndarray) -> Truth:
    path, _, axes = _laid(recipe.outline, recipe.nominal, STEP_MM)
    edge, along, normals = _laid(recipe.outline, recipe.bent, STEP_MM)
    uv, _, _ = recipe.outline.every(STEP_MM)
    covered = ~_hidden(uv, recipe, 25.0, recipe.spacing_mm)
    inward = np.cross(normals, along)
    return Truth(
        path, axes, apply(pose, edge), rotate(pose, inward), rotate(pose, normals), covered, recipe.outline.closed
    )
