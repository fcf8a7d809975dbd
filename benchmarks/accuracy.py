"""Measure the error of corrected paths against the known truth of the samples, method by method.

    python benchmarks/accuracy.py [--json FILE] [SAMPLE ...]

Prints one row per sample and method: the error across the contour (`normal`) and out of the surface (`out`), both
together, and of the tool axis, over the cutting moves where the scan shows the edge. Sliding along the contour is not
an error: it does not change the part.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

import sicp_cam
from sicp_cam.registration.settings import METHODS

SAMPLES = Path(__file__).resolve().parent.parent / "samples"
FILES = {"porthole": "path.apt", "nosecone": "path.apt", "disc": "path.nc"}


def errors(sample: str, method: str) -> dict[str, float]:
    """Return mean, 95th percentile and largest error of one sample and method, in mm and degrees."""
    folder = SAMPLES / sample
    result = sicp_cam.correct(
        cad=folder / "part.step",
        scan=folder / "scan.ply",
        path=folder / FILES[sample],
        align=str(folder / "pose_rough.txt"),
        method=method,
        gates__residual_mm=100.0,  # the rigid pose of a bent part is measured here, not used
    )
    cuts = np.array([status is not sicp_cam.Status.APPROACH for status in result.corrected.status])
    path = result.corrected.corrected
    with np.load(folder / "truth.npz", allow_pickle=False) as truth:
        return against_truth(path.tips_mm[cuts], path.axes[cuts], dict(truth))


def against_truth(tips: np.ndarray, axes: np.ndarray, truth: dict[str, np.ndarray]) -> dict[str, float]:
    """Compare a corrected path with the true edge: from each true point to the nearest place on the path."""
    points, covered = truth["path_true"], truth["covered"]
    start, step = tips[:-1], np.diff(tips, axis=0)
    length2 = np.maximum(np.sum(step * step, axis=1), 1e-18)
    offset = points[:, None] - start
    t = np.clip(np.sum(offset * step, axis=2) / length2, 0.0, 1.0)
    feet = start + t[..., None] * step
    rows = np.arange(len(points))
    best = np.argmin(np.sum((feet - points[:, None]) ** 2, axis=2), axis=1)
    error = feet[rows, best] - points
    fraction = t[rows, best][:, None]
    axis = axes[best] * (1.0 - fraction) + axes[best + 1] * fraction
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    normal = np.sum(error * truth["inward"], axis=1)[covered]
    out = np.sum(error * truth["axis_true"], axis=1)[covered]
    angle = np.degrees(np.arccos(np.clip(np.sum(axis * truth["axis_true"], axis=1), -1.0, 1.0)))[covered]
    both = np.hypot(normal, out)
    return {
        "both_mean_mm": float(both.mean()),
        "both_p95_mm": float(np.percentile(both, 95)),
        "both_max_mm": float(both.max()),
        "normal_mean_mm": float(np.abs(normal).mean()),
        "normal_bias_mm": float(normal.mean()),
        "out_mean_mm": float(np.abs(out).mean()),
        "axis_mean_deg": float(angle.mean()),
    }


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("samples", nargs="*", default=list(FILES))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    table = {}
    heads = ("both", "p95", "max", "normal", "bias", "out", "axis/deg")
    print(f"{'sample':10} {'method':7} " + " ".join(f"{head:>8}" for head in heads))
    for sample in options.samples:
        for method in METHODS:
            row = table[f"{sample} {method}"] = errors(sample, method)
            print(f"{sample:10} {method:7} " + " ".join(f"{value:8.3f}" for value in row.values()))
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
