"""The result of a run as one JSON document, schema `sicp-cam/1`."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from importlib import metadata
from typing import Any

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Source
from sicp_cam.registration.result import Registration
from sicp_cam.report.statistics import all_contours, leave_out_summary, residual_summary, uncertainty_summary
from sicp_cam.toolpath.gates import Gate
from sicp_cam.toolpath.transfer import CorrectedPath

__all__ = [
    "SCHEMA",
    "correction_entry",
    "findings_list",
    "gate_list",
    "input_entry",
    "output_entry",
    "registration_entry",
    "status",
    "uncertainty_words",
    "versions",
]

SCHEMA = "sicp-cam/1"


def status(findings: Iterable[Finding], gates: Iterable[Gate]) -> str:
    """Return `fail`, `warn` or `ok`: the worst of the findings and gates; an overridden gate is a warning."""
    levels = {finding.level for finding in findings}
    states = {gate.state for gate in gates}
    if Level.FAIL in levels or "fail" in states:
        return "fail"
    return "warn" if Level.WARN in levels or states & {"warn", "overridden"} else "ok"


def findings_list(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Return findings as plain data."""
    return [{"code": f.code, "level": f.level.value, "message": f.message, "where": f.where} for f in findings]


def gate_list(gates: Iterable[Gate]) -> list[dict[str, Any]]:
    """Return gates as plain data; an infinite value, of something that could not be measured, as None."""
    return [
        {
            "name": gate.name,
            "value": gate.value if np.isfinite(gate.value) else None,
            "limit": gate.limit,
            "state": gate.state,
            "text": gate.text,
        }
        for gate in gates
    ]


def input_entry(role: str, source: Source | None, count: int) -> dict[str, Any]:
    """Return one input: what it is, where it came from, and how much is in it."""
    if source is None:
        return {"role": role, "path": "", "sha256": "", "format": "memory", "units": "mm", "count": count}
    return {
        "role": role,
        "path": source.path,
        "sha256": source.sha256,
        "format": source.format,
        "units": source.unit,
        "unit_stated": source.unit_stated,
        "count": count,
    }


def output_entry(
    kind: str, path: str, content: bytes, reading: Mapping[str, Any] | str | None = None
) -> dict[str, Any]:
    """Return one output file, its path relative to the folder of the results.

    `reading` stands at the file by which a program is read: what its reader must be told, or why none reads it.
    """
    entry = {"kind": kind, "path": path, "sha256": hashlib.sha256(content).hexdigest()}
    return entry if reading is None else {**entry, "reading": reading}


def registration_entry(registration: Registration) -> dict[str, Any]:
    """Return the registration: pose, contours, residuals of the rigid pose and of the method, and how halves agree."""
    before, after, covered = all_contours(registration.contours)
    return {
        "method": registration.method,
        "T_scan_part": registration.T_scan_part.tolist(),
        "contours": [
            {
                "id": contour.number,
                "length_mm": contour.nominal.length_mm,
                "segments": len(contour.segments),
                "coverage": float(contour.covered.mean()),
                "symmetric": contour.symmetric,
                "uncertainty": uncertainty_summary([contour]),
                "leave_out": leave_out_summary([contour]),
            }
            for contour in registration.contours
        ],
        "spacing_mm": registration.spacing_mm,
        "noise_mm": registration.noise_mm,
        "freedoms": registration.freedoms.tolist(),
        "symmetry_ratio": registration.symmetry,
        "side_ratio": registration.side,
        "rigid": residual_summary(before, covered),
        "corrected": residual_summary(after, covered),
        "leave_out": leave_out_summary(registration.contours),
    }


def uncertainty_words(uncertainty: Mapping[str, Any] | None) -> str:
    """Return the stated uncertainty of the contours, see `uncertainty_summary`, in words.

    >>> uncertainty_words({"mean_mm": 0.0512, "max_mm": 0.09, "bridged": {"mean_mm": 0.2, "max_mm": 0.31}})
    'stated uncertainty 0.051 mm (1 sigma), largest 0.090 mm, where bridged 0.310 mm'
    >>> uncertainty_words(None)
    'no uncertainty stated'
    """
    if uncertainty is None:
        return "no uncertainty stated"
    if uncertainty["mean_mm"] is None:
        return "the uncertainty could not be measured"
    words = f"stated uncertainty {uncertainty['mean_mm']:.3f} mm (1 sigma), largest {uncertainty['max_mm']:.3f} mm"
    if uncertainty["bridged"] is None:
        return words
    bridged = uncertainty["bridged"]["max_mm"]
    return f"{words}, where bridged {'not known' if bridged is None else f'{bridged:.3f} mm'}"


def correction_entry(corrected: CorrectedPath) -> dict[str, Any]:
    """Return how far the path was moved beyond the rigid pose."""
    change = corrected.corrected.tips_mm - corrected.rigid.tips_mm
    cosine = np.clip(np.sum(corrected.corrected.axes * corrected.rigid.axes, axis=1), -1.0, 1.0)
    jumps = np.linalg.norm(np.diff(change, axis=0), axis=1)
    return {
        "max_mm": float(np.linalg.norm(change, axis=1).max()),
        "max_axis_deg": float(np.degrees(np.arccos(cosine)).max()),
        "max_jump_mm": float(jumps.max(initial=0.0)),
        "moves": len(corrected.nominal),
        "added_moves": int(corrected.added.sum()),
        "status": {
            name: sum(status.value == name for status in corrected.status)
            for name in ("covered", "bridged", "approach")
        },
    }


def versions() -> Mapping[str, str]:
    """Return the versions of everything that decides the numbers."""
    packages = {name: metadata.version(name) for name in ("sicp-cam", "numpy", "scipy")}
    return {**packages, "python": platform.python_version()}
