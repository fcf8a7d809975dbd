"""A synthetic job with known truth: a circular opening in a flat plate that is bent outward as 2 + cos(2 phi)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve, at, moved, orthonormal
from sicp_cam.model import FloatArray, Scan, ToolPath, TriangleMesh
from sicp_cam.registration.result import LeaveOut, RegisteredContour, Registration, Residuals, Segment
from sicp_cam.rigid_motion import apply, exponential

RADIUS, STATIONS, SEGMENTS = 100.0, 314, 6
U_SEEN, U_GAP, U_OUT = 0.1, 0.4, 0.02


def _spread(mean: float, largest: float) -> dict[str, float]:
    return {"mean_mm": mean, "max_mm": largest}


UNCERTAINTY = {
    **_spread(0.05, 0.1),
    "normal": _spread(0.04, 0.08),
    "out": _spread(0.03, 0.06),
    "bridged": {**_spread(0.25, 0.5), "normal": _spread(0.2, 0.4), "out": _spread(0.15, 0.3)},
}
LEAVE_OUT = {"normal": 0.03, "out": 0.04, "both": 0.05}
POSE = exponential(np.array([0.1, -0.05, 0.3, 40.0, -20.0, 10.0]), np.zeros(3))


@dataclass(frozen=True)
class Job:
    mesh: TriangleMesh
    scan: Scan
    registration: Registration
    path_rigid: ToolPath
    path_corrected: ToolPath

    @property
    def contour(self) -> RegisteredContour:
        return self.registration.contours[0]

    def with_contour(self, **changes: object) -> RegisteredContour:
        return replace(self.contour, **changes)


def _circle() -> FramedCurve:
    phi = 2 * np.pi * np.arange(STATIONS) / STATIONS
    zero = np.zeros(STATIONS)
    points = RADIUS * np.stack([np.cos(phi), np.sin(phi), zero], axis=1)
    # The material lies outside of the circle: seen from above it must be on the left, so the travel is clockwise.
    points[:, 1] *= -1
    tangents = np.stack([-np.sin(phi), -np.cos(phi), zero], axis=1)
    T, B, N = orthonormal(tangents, np.tile([0.0, 0.0, 1.0], (STATIONS, 1)))
    return FramedCurve(RADIUS * phi, points, T, B, N, 2 * np.pi * RADIUS, True)


def _bend(points_part: FloatArray) -> FloatArray:
    phi = np.arctan2(points_part[:, 1], points_part[:, 0])
    lifted = points_part.copy()
    lifted[:, 2] += 2.0 + np.cos(2 * phi)
    return lifted


def _plate() -> TriangleMesh:
    """A plate of 3 mm with a round hole, both skins, the outer one on top at z = 0."""
    phi = 2 * np.pi * np.arange(96) / 96
    ring = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    flat = np.vstack([RADIUS * ring, 200.0 * ring])
    top = np.column_stack([flat, np.zeros(len(flat))])
    a, b = np.arange(96), (np.arange(96) + 1) % 96
    faces = np.vstack([np.stack([a, a + 96, b + 96], axis=1), np.stack([a, b + 96, b], axis=1)])
    return TriangleMesh(np.vstack([top, top - [0, 0, 3.0]]), np.vstack([faces, faces[:, ::-1] + len(top)]))


def _path(tips: FloatArray, axes: FloatArray) -> ToolPath:
    tips = np.vstack([tips[:1] + 60 * axes[:1], tips, tips[:1] + 60 * axes[:1]])
    axes = np.vstack([axes[:1], axes, axes[:1]])
    rapid = np.zeros(len(tips), np.bool_)
    rapid[[0, -1]] = True
    return ToolPath(tips, axes, np.where(rapid, 0.0, 1200.0), rapid, np.arange(len(tips)))


@pytest.fixture(scope="session")
def result() -> dict[str, Any]:
    """Return a result document as a run writes it, with a warning."""
    numbers = {"mean": 0.1234, "sd": 0.2, "rms": 0.3, "p95": 0.4, "max": 0.5}
    worse = {name: 10 * value for name, value in numbers.items()}
    return {
        "schema": "sicp-cam/1",
        "status": "warn",
        "findings": [
            {"code": 110, "level": "info", "message": "coordinates are float32", "where": "scan.ply"},
            {"code": 410, "level": "warn", "message": "two stretches are bridged", "where": "contour 1"},
        ],
        "inputs": [
            {
                "role": "part",
                "path": "/data/part.step",
                "sha256": "ab" * 32,
                "format": "step",
                "units": "mm",
                "count": 3,
            },
            {
                "role": "scan",
                "path": "C:\\scans\\a&b.ply",
                "sha256": "cd" * 32,
                "format": "ply",
                "units": "m",
                "count": 9,
            },
        ],
        "registration": {
            "method": "sicp",
            "T_scan_part": POSE.tolist(),
            "contours": [
                {
                    "id": 1,
                    "length_mm": 628.3,
                    "segments": 6,
                    "coverage": 0.9045,
                    "symmetric": True,
                    "uncertainty": UNCERTAINTY,
                    "leave_out": LEAVE_OUT,
                }
            ],
            "spacing_mm": 4.0,
            "noise_mm": 0.05,
            "freedoms": [1.0, 0.9, 0.8, 0.5, 0.3, 0.2],
            "rigid": {"normal": worse, "out": worse, "both": worse},
            "corrected": {"normal": numbers, "out": numbers, "both": None},
            "leave_out": LEAVE_OUT,
        },
        "uncertainty": UNCERTAINTY,
        "correction": {"max_mm": 3.0, "max_axis_deg": 1.5, "max_jump_mm": 0.01},
        "gates": [
            {
                "name": "coverage",
                "value": 0.9045,
                "limit": 0.5,
                "state": "ok",
                "text": "fraction of the contour on which the scan shows the edge",
            },
            {
                "name": "leave_out_mm",
                "value": 0.05,
                "limit": 0.6,
                "state": "ok",
                "text": "difference of the contours found from two halves of the scan, mm",
            },
            {
                "name": "uncertainty_mm",
                "value": 0.08,
                "limit": 1.0,
                "state": "ok",
                "text": "largest standard uncertainty where the scan shows it, mm",
            },
            {
                "name": "axis_deg",
                "value": 16.25,
                "limit": 15.0,
                "state": "overridden",
                "text": "largest turn of the tool axis beyond the rigid pose, degrees",
            },
        ],
        "timing_s": {"total": 1.0},
        "versions": {"sicp_cam": "0.1.0"},
    }


@pytest.fixture(scope="session")
def job() -> Job:
    nominal = _circle()
    rigid = moved(nominal, POSE)
    bent = _bend(nominal.points_mm)
    corrected = replace(rigid, points_mm=apply(POSE, bent))
    covered = np.ones(STATIONS, np.bool_)
    covered[40:60] = False
    covered[[*range(5), *range(STATIONS - 5, STATIONS)]] = False
    noise = np.random.default_rng(7).normal(0.0, 0.05, (2, STATIONS))
    before = Residuals(np.where(covered, 0.3, np.nan), np.where(covered, bent[:, 2] - 0.0, np.nan))
    after = Residuals(np.where(covered, noise[0], np.nan), np.where(covered, noise[1], np.nan))
    length = nominal.length_mm / SEGMENTS
    splits = length * np.arange(SEGMENTS)
    segments = tuple(Segment(s - 0.15 * length, s + 1.15 * length, POSE, 0.05) for s in splits)
    stability = apply(POSE, at(nominal, np.arange(0.0, nominal.length_mm, 20.0)).points_mm * 1.1)
    contour = RegisteredContour(
        1,
        nominal,
        rigid,
        corrected,
        covered,
        corrected.points_mm,
        before,
        after,
        segments,
        splits,
        stability,
        stability,
        normal_u_mm=np.where(covered, U_SEEN, U_GAP),
        out_u_mm=np.full(STATIONS, U_OUT),
        leave_out=LeaveOut(0.03, 0.04),
    )
    registration = Registration("sicp", POSE, (contour,), 4.0, 0.05, np.array([1.0, 0.9, 0.8, 0.5, 0.3, 0.2]))
    radius, phi = np.meshgrid(np.arange(101.0, 160.0, 4.0), np.linspace(0, 2 * np.pi, 160, endpoint=False))
    surface = np.stack([radius * np.cos(phi), radius * np.sin(phi), 0 * phi], axis=2).reshape(-1, 3)
    scan = Scan(apply(POSE, _bend(surface)))
    return Job(
        _plate(),
        scan,
        registration,
        _path(rigid.points_mm, rigid.outward),
        _path(corrected.points_mm, corrected.outward),
    )
