"""Tables and reasons in words, read from a result document (schema `sicp-cam/1`)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

from sicp_cam.errors import ReportError
from sicp_cam.report.document import Table, Verdict
from sicp_cam.report.result_values import entries, listed, number, percent, section, sequence, text, with_unit

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
    for gate in entries(result, "gates"):
        severity = _severity("gates.state", gate.get("state"))
        if severity:
            said = {"fail": "failed", "warn": "warns", "overridden": "failed and was overridden"}[_word(gate["state"])]
            value, limit = number(gate.get("value")), number(gate.get("limit"))
            reasons.append(f"Gate {gate.get('name')} {said}: {value} against the limit {limit}.")
        worst = max(worst, severity)
    for finding in entries(result, "findings"):
        severity = _severity("findings.level", finding.get("level"))
        if severity and not _repeats_a_gate(finding, result):
            told.setdefault(text(finding.get("message")), []).append(text(finding.get("where"), ""))
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
            text(row.get("role")),
            _file_name(text(row.get("path"))),
            text(row.get("format")),
            text(row.get("units")),
            text(row.get("count")),
            text(row.get("sha256"))[:12],
        )
        for row in entries(result, "inputs")
    )
    return Table("Inputs", ("role", "file", "format", "unit", "count", "sha256"), rows, (2, 7, 2, 2, 2.2, 3))


def statistics(result: Mapping[str, Any]) -> Table:
    """Return the residuals of the scan, rigid against the method, and how much of the contours was seen."""
    registration = section(result, "registration")
    method = METHODS.get(text(registration.get("method")), text(registration.get("method")))
    shown = [("rigid", METHODS["rigid"]), ("corrected", method)]
    if method == METHODS["rigid"] and registration.get("corrected") == registration.get("rigid"):
        shown = shown[:1]
    rows = tuple(
        (name, part, *(number(section(section(registration, key), part).get(n), 3) for n in _NUMBERS))
        for key, name in shown
        for part in ("normal", "out", "both")
    )
    coverage = ", ".join(
        f"contour {text(contour.get('id'))}: {percent(contour.get('coverage'))}"
        for contour in entries(registration, "contours")
    )
    note = f"{FIT} Coverage, the share of the contour that the scan shows: {coverage or '-'}."
    head = ("registration", "residual / mm", *_NUMBERS)
    return Table("Residuals of the scan", head, rows, (4, 3, 2, 2, 2, 2, 2), numeric=2, note=note)


def details(result: Mapping[str, Any]) -> Table:
    """Return the further numbers of the registration and of the correction as names and values."""
    registration = section(result, "registration")
    correction = section(result, "correction")
    rows = [("method", METHODS.get(text(registration.get("method")), text(registration.get("method"))))]
    for contour in entries(registration, "contours"):
        symmetric = "; symmetric, its start is free" if contour.get("symmetric") else ""
        length, segments = number(contour.get("length_mm"), 1), _segments(contour.get("segments"))
        rows.append((f"contour {text(contour.get('id'))}", f"{length} mm long, {segments}{symmetric}"))
    rows.append(("point spacing / noise of the scan", with_unit(registration, ("spacing_mm", "noise_mm"), "mm")))
    rows += [
        ("largest correction", with_unit(correction, ("max_mm",), "mm")),
        ("largest step of the correction between neighbouring moves", with_unit(correction, ("max_jump_mm",), "mm")),
        ("largest turn of the tool axis", with_unit(correction, ("max_axis_deg",), "deg")),
        ("freedoms of the rigid pose (1 firm, 0 free)", listed(registration.get("freedoms"), "registration.freedoms")),
    ]
    pose = registration.get("T_scan_part") or []
    rows += [
        (f"T_scan_part, row {row}", listed(values, "registration.T_scan_part", 6))
        for row, values in enumerate(sequence(pose, "registration.T_scan_part"), start=1)
    ]
    return Table("Registration and correction", ("quantity", "value"), tuple(rows), (3, 5))


def gates(result: Mapping[str, Any]) -> Table:
    """Return the table of gates, each with what its value is and its unit, as the document says them."""
    rows = tuple(
        (
            text(gate.get("name")),
            text(gate.get("text")),
            number(gate.get("value")),
            number(gate.get("limit")),
            text(gate.get("state")).upper(),
        )
        for gate in entries(result, "gates")
    )
    head = ("gate", "what it looks at", "value", "limit", "state")
    return Table("Gates", head, rows, (3, 7.4, 1.6, 1.2, 2.2), numeric=2)


def findings(result: Mapping[str, Any]) -> Table:
    """Return the table of findings, the gravest first, otherwise in the order in which they were found."""
    ordered = sorted(entries(result, "findings"), key=lambda f: -_severity("findings.level", f.get("level")))
    rows = tuple(
        (text(f.get("level")).upper(), text(f.get("code")), text(f.get("message")), text(f.get("where"), ""))
        for f in ordered
    )
    note = "" if rows else "None."
    return Table("Findings", ("level", "code", "what", "where"), rows, (1.2, 1, 9, 4), note=note)


def _repeats_a_gate(finding: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Say whether an overridden gate is told by this finding, which the gate itself tells already."""
    if finding.get("code") != _GATE_OVERRIDDEN:
        return False
    names = [gate.get("name") for gate in entries(result, "gates") if _word(gate.get("state")) == "overridden"]
    return any(f"gate {name} " in text(finding.get("message")) for name in names)


def _places(message: str, places: Sequence[str]) -> str:
    """Return the places of a message in brackets, each once, without those that the message names itself."""
    missing = [place for place in dict.fromkeys(places) if place and not _names(message, place)]
    return f" ({', '.join(missing)})" if missing else ""


def _names(message: str, place: str) -> bool:
    return re.search(rf"(?<!\w){re.escape(place)}(?!\w)", message) is not None


def _segments(count: object) -> str:
    if count == 0:
        return "one rigid motion"
    return f"{text(count)} segment{'' if count == 1 else 's'}"


def _severity(key: str, value: object) -> int:
    try:
        return _SEVERITY[_word(value)]
    except KeyError:
        raise ReportError(f"result: '{key}' is {value!r}; expected one of {', '.join(_SEVERITY)}") from None


def _word(value: object) -> str:
    return value.lower() if isinstance(value, str) else ""


def _file_name(path: str) -> str:
    return PureWindowsPath(PurePosixPath(path).name).name or path
