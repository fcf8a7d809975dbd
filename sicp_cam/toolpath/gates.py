"""Gates: limits that a registration and a corrected path must keep before any program is written.

What a method or a start does not state has no gate in the list; what should have been measured and could not be is
infinite or no number, and fails.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["GATE_NAMES", "Gate", "at_least", "at_most", "largest", "overridden", "value_and_limit"]


@dataclass(frozen=True, slots=True)
class Gate:
    """One limit and how it was kept.

    Parameters
    ----------
    name
        The name that `--override` takes.
    value, limit
        In the unit that `text` names; the value infinite or NaN where it could not be measured.
    state
        `ok`, `warn`, `fail` or `overridden`.
    text
        What the value is, in words.
    """

    name: str
    value: float
    limit: float
    state: str
    text: str


GATE_NAMES = (
    "coverage",
    "residual_mm",
    "edge_residual_mm",
    "size_mm",
    "leave_out_mm",
    "uncertainty_mm",
    "freedom_mm",
    "symmetry",
    "side",
    "pose_mm",
    "pose_deg",
    "stretch",
    "in_surface_mm",
    "path_distance_mm",
    "path_coverage",
    "correction_mm",
    "axis_deg",
    "jump_mm",
    "slope",
    "axis_slope",
    "travel",
    "crossing_mm",
)
"""Every gate, in the order in which they are judged."""


def at_most(name: str, value: float, limit: float, text: str) -> Gate:
    """Return a gate that passes up to its limit."""
    return Gate(name, value, limit, "ok" if value <= limit else "fail", text)


def at_least(name: str, value: float, limit: float, text: str) -> Gate:
    """Return a gate that passes from its limit on."""
    return Gate(name, value, limit, "ok" if value >= limit else "fail", text)


def largest(values: Iterable[float]) -> float:
    """Return the largest of several values, NaN if one of them is: a gate must never pass what was not measured."""
    return float(np.max(list(values)))


def overridden(gates: Iterable[Gate], names: Iterable[str]) -> tuple[Gate, ...]:
    """Return the gates with those failed ones marked that the operator named."""
    allowed = set(names)
    return tuple(
        replace(gate, state="overridden") if gate.state == "fail" and gate.name in allowed else gate for gate in gates
    )


def value_and_limit(gate: Gate) -> str:
    """Return value and limit in words.

    >>> value_and_limit(at_most("jump_mm", 0.75, 0.5, ""))
    '0.75, limit 0.5'
    >>> value_and_limit(at_most("jump_mm", np.inf, 0.5, ""))
    'could not be measured, limit 0.5'
    """
    value = f"{gate.value:.4g}" if np.isfinite(gate.value) else "could not be measured"
    return f"{value}, limit {gate.limit:g}"
