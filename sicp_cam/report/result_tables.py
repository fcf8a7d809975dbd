"""Tables and reasons in words, read from a result document (schema `sicp-cam/1`).

The document may come from an earlier run or another version: what it does not state is printed as "-", what has the
wrong type is an error that names the key.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

from sicp_cam.errors import ReportError
from sicp_cam.report.document import Table, Verdict

__all__ = ["FIT", "METHODS", "details", "findings", "gates", "inputs", "statistics", "verdict"]

METHODS = {
    "sicp": "S-ICP (sicp)",
    "paper": "S-ICP as published (paper)",
    "rigid": "rigid ICP",
    "projection": "projection",
}
"""How the methods are called in reports."""

FIT = "Distance to the measured edge and surface: how well the curve fits the scan, not how true it is."
"""What a residual can not say, printed wherever residuals are shown."""

_GATE_OVERRIDDEN = 501
"""Code of the finding that repeats an overridden gate."""

_SEVERITY = {"ok": 0, "info": 0, "warn": 1, "overridden": 1, "fail": 2}
_VERDICTS = (Verdict.OK, Verdict.WARNINGS, Verdict.FAILED)
_SHOWN_REASONS = 8
_NUMBERS = ("mean", "sd", "rms", "p95", "max")


def verdict(result: Mapping[str, Any]) -> tuple[Verdict, tuple[str, ...]]:
    """Return the verdict and its reasons: the worst of status, gates and findings, so that no failure is painted over.

    Raises
    ------
    ReportError
        If a status, state or level is none of those that the schema knows.
    """
    reasons = []
    told: dict[str, list[str]] = {}
    worst = _severity("status", result.get("status"))
    for gate in _rows(result, "gates"):
        severity = _severity("gates.state", gate.get("state"))
        if severity:
            said = {"fail": "failed", "warn": "warns", "overridden": "failed and was overridden"}[_word(gate["state"])]
            value, limit = _number(gate.get("value")), _number(gate.get("limit"))
            reasons.append(f"Gate {gate.get('name')} {said}: {value} against the limit {limit}.")
        worst = max(worst, severity)
    for finding in _rows(result, "findings"):
        severity = _severity("findings.level", finding.get("level"))
        if severity and not _repeats_a_gate(finding, result):
            told.setdefault(_text(finding.get("message")), []).append(_text(finding.get("where"), ""))
        worst = max(worst, severity)
    reasons += [message + _places(message, places) for message, places in told.items()]
    if not reasons:
        word = ("All gates passed; no warnings.", "The run ended with a warning.", "The run failed.")[worst]
        reasons.append(word)
    if len(reasons) > _SHOWN_REASONS:
        more = len(reasons) - _SHOWN_REASONS
        reasons = [*reasons[:_SHOWN_REASONS], f"... and {more} more; see the gates and findings below."]
    return _VERDICTS[worst], tuple(reasons)


def inputs(result: Mapping[str, Any]) -> Table:
    """Return the table of input files: role, name, format, unit, count, start of the hash."""
    rows = tuple(
        (
            _text(row.get("role")),
            _file_name(_text(row.get("path"))),
            _text(row.get("format")),
            _text(row.get("units")),
            _text(row.get("count")),
            _text(row.get("sha256"))[:12],
        )
        for row in _rows(result, "inputs")
    )
    return Table("Inputs", ("role", "file", "format", "unit", "count", "sha256"), rows, (2, 7, 2, 2, 2.2, 3))


def statistics(result: Mapping[str, Any]) -> Table:
    """Return the residuals of the scan, rigid against the method, and how much of the contours was seen."""
    registration = _section(result, "registration")
    method = METHODS.get(_text(registration.get("method")), _text(registration.get("method")))
    shown = [("rigid", METHODS["rigid"]), ("corrected", method)]
    if method == METHODS["rigid"] and registration.get("corrected") == registration.get("rigid"):
        shown = shown[:1]
    rows = tuple(
        (name, part, *(_number(_section(_section(registration, key), part).get(n), 3) for n in _NUMBERS))
        for key, name in shown
        for part in ("normal", "out", "both")
    )
    coverage = ", ".join(
        f"contour {_text(contour.get('id'))}: {_percent(contour.get('coverage'))}"
        for contour in _rows(registration, "contours")
    )
    note = f"{FIT} Coverage, the share of the contour that the scan shows: {coverage or '-'}."
    head = ("registration", "residual / mm", *_NUMBERS)
    return Table("Residuals of the scan", head, rows, (4, 3, 2, 2, 2, 2, 2), numeric=2, note=note)


def details(result: Mapping[str, Any]) -> Table:
    """Return the further numbers of the registration and of the correction as names and values."""
    registration = _section(result, "registration")
    leave_out, uncertainty = _section(registration, "leave_out"), _section(result, "uncertainty")
    correction = _section(result, "correction")
    rows = [("method", METHODS.get(_text(registration.get("method")), _text(registration.get("method"))))]
    for contour in _rows(registration, "contours"):
        symmetric = "; symmetric, its start is free" if contour.get("symmetric") else ""
        length, segments = _number(contour.get("length_mm"), 1), _segments(contour.get("segments"))
        rows.append((f"contour {_text(contour.get('id'))}", f"{length} mm long, {segments}{symmetric}"))
    rows.append(("point spacing / noise of the scan", _units(registration, ("spacing_mm", "noise_mm"), "mm")))
    if _stated(leave_out):
        rows.append(("left-out points, rms: normal / out", _units(_rms(leave_out), ("normal", "out"), "mm")))
    if _stated(uncertainty):
        rows.append(("uncertainty: mean / max", _units(uncertainty, ("mean_mm", "max_mm"), "mm")))
    rows += [
        ("largest correction", _units(correction, ("max_mm",), "mm")),
        ("largest step of the correction between neighbouring moves", _units(correction, ("max_jump_mm",), "mm")),
        ("largest turn of the tool axis", _units(correction, ("max_axis_deg",), "deg")),
        ("freedoms of the rigid pose (1 firm, 0 free)", _list(registration.get("freedoms"), "registration.freedoms")),
    ]
    pose = registration.get("T_scan_part") or []
    rows += [
        (f"T_scan_part, row {row}", _list(values, "registration.T_scan_part", 6))
        for row, values in enumerate(_sequence(pose, "registration.T_scan_part"), start=1)
    ]
    return Table("Registration and correction", ("quantity", "value"), tuple(rows), (3, 5))


def gates(result: Mapping[str, Any]) -> Table:
    """Return the table of gates, each with what its value is and its unit, as the document says them."""
    rows = tuple(
        (
            _text(gate.get("name")),
            _text(gate.get("text")),
            _number(gate.get("value")),
            _number(gate.get("limit")),
            _text(gate.get("state")).upper(),
        )
        for gate in _rows(result, "gates")
    )
    head = ("gate", "what it looks at", "value", "limit", "state")
    return Table("Gates", head, rows, (3, 7.4, 1.6, 1.2, 2.2), numeric=2)


def findings(result: Mapping[str, Any]) -> Table:
    """Return the table of findings, the gravest first, otherwise in the order in which they were found."""
    ordered = sorted(_rows(result, "findings"), key=lambda f: -_severity("findings.level", f.get("level")))
    rows = tuple(
        (_text(f.get("level")).upper(), _text(f.get("code")), _text(f.get("message")), _text(f.get("where"), ""))
        for f in ordered
    )
    note = "" if rows else "None."
    return Table("Findings", ("level", "code", "what", "where"), rows, (1.2, 1, 9, 4), note=note)


def _repeats_a_gate(finding: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Say whether an overridden gate is told by this finding, which the gate itself tells already."""
    if finding.get("code") != _GATE_OVERRIDDEN:
        return False
    names = [gate.get("name") for gate in _rows(result, "gates") if _word(gate.get("state")) == "overridden"]
    return any(f"gate {name} " in _text(finding.get("message")) for name in names)


def _places(message: str, places: Sequence[str]) -> str:
    """Return the places of a message in brackets, each once, without those that the message names itself."""
    missing = [place for place in dict.fromkeys(places) if place and not _names(message, place)]
    return f" ({', '.join(missing)})" if missing else ""


def _names(message: str, place: str) -> bool:
    return re.search(rf"(?<!\w){re.escape(place)}(?!\w)", message) is not None


def _segments(count: object) -> str:
    if count == 0:
        return "one rigid motion"
    return f"{_text(count)} segment{'' if count == 1 else 's'}"


def _severity(key: str, value: object) -> int:
    try:
        return _SEVERITY[_word(value)]
    except KeyError:
        raise ReportError(f"result: '{key}' is {value!r}; expected one of {', '.join(_SEVERITY)}") from None


def _word(value: object) -> str:
    return value.lower() if isinstance(value, str) else ""


def _section(parent: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = parent.get(key)
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ReportError(f"result: '{key}' must be an object, not {type(value).__name__}; repeat the run")
    return value


def _rows(parent: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    rows = _sequence(parent.get(key) or [], key)
    if not all(isinstance(row, Mapping) for row in rows):
        raise ReportError(f"result: '{key}' must be a list of objects; repeat the run")
    return list(rows)


def _sequence(value: Any, key: str) -> Sequence[Any]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise ReportError(f"result: '{key}' must be a list, not {type(value).__name__}; repeat the run")
    return value


def _stated(section: Mapping[str, Any]) -> bool:
    return any(value is not None for value in section.values())


def _rms(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the section with each summary replaced by its rms."""
    return {key: value.get("rms") if isinstance(value, Mapping) else value for key, value in section.items()}


def _text(value: object, absent: str = "-") -> str:
    return absent if value is None or value == "" else str(value)


def _number(value: object, decimals: int | None = None) -> str:
    """Format a number: with fixed decimals, or with four significant digits; anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return _text(value)
    if not math.isfinite(value):
        return str(value)
    if decimals is None:
        return f"{value:.4g}"
    shown = f"{value:.{decimals}f}"
    return shown[1:] if float(shown) == 0.0 and shown.startswith("-") else shown


def _percent(value: object) -> str:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{_number(100.0 * float(str(value)), 1)} %" if is_number else _text(value)


def _units(section: Mapping[str, Any], keys: Sequence[str], unit: str) -> str:
    return " / ".join(_number(section.get(key), 3) for key in keys) + f" {unit}"


def _list(values: Any, key: str, decimals: int = 3) -> str:
    return "   ".join(_number(value, decimals) for value in _sequence(values or [], key)) or "-"


def _file_name(path: str) -> str:
    return PureWindowsPath(PurePosixPath(path).name).name or path
