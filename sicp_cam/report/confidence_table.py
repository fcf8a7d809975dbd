"""The table that says how sure the corrected contour is: stated uncertainty, difference of half scans, their gates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sicp_cam.report.document import Table
from sicp_cam.report.result_tables import METHODS
from sicp_cam.report.result_values import entries, number, section, text
from sicp_cam.report.statistics import BAND

__all__ = ["confidence"]

_MEANING = (
    "Uncertainty: standard uncertainty (1 sigma) as the method states it; 95 % of the true edge and surface should lie "
    f"within {BAND} times as much of the corrected contour, along normal and out each. Leave-out: how far apart the "
    "contours lie that are found from the even and from the odd points of the scan."
)
_GATES = "The gate uncertainty_mm looks at normal and out, each for itself, the gate leave_out_mm at both."


def confidence(result: Mapping[str, Any]) -> Table:
    """Return the stated uncertainty, where the scan shows the edge and where it is bridged, and the leave-out check.

    With several contours all of them together come first, then each for itself. What the method does not state has no
    row, and the note says so.
    """
    registration = section(result, "registration")
    contours = entries(registration, "contours")
    rows = list(_rows("", section(result, "uncertainty"), section(registration, "leave_out"), _gates_by_name(result)))
    for contour in contours if len(contours) > 1 else []:
        prefix = f"contour {text(contour.get('id'))}: "
        rows += _rows(prefix, section(contour, "uncertainty"), section(contour, "leave_out"), {})
    head = ("quantity / mm", "normal", "out", "both", "gate", "limit", "state")
    note = _note(registration, result.get("uncertainty") is not None, registration.get("leave_out") is not None)
    return Table("How sure the corrected contour is", head, tuple(rows), (5, 1.6, 1.6, 1.6, 3, 1.4, 2.4), 1, note)


def _rows(
    prefix: str,
    uncertainty: Mapping[str, Any],
    leave_out: Mapping[str, Any],
    gates: Mapping[str, Mapping[str, Any]],
) -> Iterator[tuple[str, ...]]:
    limit = _limit(gates, "uncertainty_mm")
    if uncertainty:
        yield f"{prefix}uncertainty where seen, mean", *_parts(uncertainty, "mean_mm"), "", "", ""
        yield f"{prefix}uncertainty where seen, largest", *_parts(uncertainty, "max_mm"), *limit
    bridged = section(uncertainty, "bridged")
    if bridged:
        yield f"{prefix}uncertainty in gaps, mean", *_parts(bridged, "mean_mm"), "", "", ""
        yield f"{prefix}uncertainty in gaps, largest", *_parts(bridged, "max_mm"), "", "", ""
    if leave_out:
        apart = tuple(number(leave_out.get(part), 3) for part in ("normal", "out", "both"))
        yield f"{prefix}leave-out, rms", *apart, *_limit(gates, "leave_out_mm")


def _parts(uncertainty: Mapping[str, Any], key: str) -> tuple[str, str, str]:
    normal, out = (section(uncertainty, part).get(key) for part in ("normal", "out"))
    return number(normal, 3), number(out, 3), number(uncertainty.get(key), 3)


def _gates_by_name(result: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    return {text(gate.get("name")): gate for gate in entries(result, "gates")}


def _limit(gates: Mapping[str, Mapping[str, Any]], name: str) -> tuple[str, str, str]:
    gate = gates.get(name)
    return ("", "", "") if gate is None else (name, number(gate.get("limit")), text(gate.get("state")).upper())


def _note(registration: Mapping[str, Any], states: bool, compares: bool) -> str:
    method = text(registration.get("method"))
    missing = [
        words
        for given, words in ((states, "states no uncertainty"), (compares, "does not compare halves of the scan"))
        if not given
    ]
    if not registration:
        return "Nothing was registered."
    told = f"The method {METHODS.get(method, method)} {' and '.join(missing)}."
    return told if len(missing) == 2 else " ".join([_MEANING, _GATES, *([told] if missing else [])])
