"""The tables of a job that hold settings of its steps, and the ranges that their numbers must keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any

from sicp_cam.limits import Limits
from sicp_cam.options.values import Range
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings

__all__ = ["GATES", "RANGES", "TABLES", "table_key"]

TABLES: Mapping[str, Any] = MappingProxyType(
    {
        "registration": RegistrationSettings,
        "toolpath": ToolPathSettings,
        "gates": GateLimits,
        "limits": Limits,
    }
)
"""Dataclass of each table, all fields of which have defaults."""

RANGES: Mapping[str, Mapping[str, Range]] = MappingProxyType(
    {
        "registration": {
            "segments": (1, 10_000),
            "overlap": (0.0, 0.5),
            "reach_mm": (0.01, 1e4),
            "edge_offset_mm": (-10.0, 10.0),
        },
        "toolpath": {"feed_mm_min": (1e-3, 1e6), "step_mm": (1e-3, 1e3), "chord_mm": (1e-5, 10.0)},
        "gates": {
            "coverage": (0.0, 1.0),
            "path_coverage": (0.0, 1.0),
            "pose_deg": (0.0, 180.0),
            "axis_deg": (0.0, 180.0),
            "travel": (0.0, 1.0),
        },
        "limits": {f.name: (1.0, float("inf")) for f in fields(Limits)},
    }
)
"""Least and largest value of a number, both allowed; one that is not named here must not be negative."""

GATES = tuple(f.name for f in fields(GateLimits))
"""Names of the gates, which `override` takes."""


def table_key(name: str) -> str | None:
    """Return the whole key of a setting that was named without its table.

    >>> table_key("segments")
    'registration.segments'
    """
    for table, kind in TABLES.items():
        if name in (f.name for f in fields(kind)):
            return f"{table}.{name}"
    return None
