"""The JSON document's parts, from results made by hand."""

import hashlib
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from sicp_cam.contour.frames import FramedCurve
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Source, Status, ToolPath
from sicp_cam.registration.result import LeaveOut, RegisteredContour, Registration, Residuals, Segment
from sicp_cam.result_document import (
    SCHEMA,
    correction_entry,
    findings_list,
    gate_list,
    input_entry,
    output_entry,
    registration_entry,
    status,
    uncertainty_words,
    versions,
)
from sicp_cam.toolpath.gates import Gate
from sicp_cam.toolpath.transfer import CorrectedPath

NONE = np.zeros((0, 3))


def finding(level):
    return Finding(402, level, "something", "somewhere")


def gate(state, value=0.1):
    return Gate("coverage", value, 0.5, state, "words")


def dumped(value):
    """Return plain data after a trip through strict JSON: the trip itself proves that it is plain and finite."""
    return json.loads(json.dumps(value, allow_nan=False))


@pytest.mark.parametrize(
    ("levels", "states", "expected"),
    [
        ([], [], "ok"),
        ([Level.INFO], ["ok", "ok"], "ok"),
        ([Level.INFO, Level.WARN], ["ok"], "warn"),
        ([Level.INFO], ["ok", "overridden"], "warn"),
        ([Level.WARN, Level.FAIL], ["ok"], "fail"),
        ([Level.WARN], ["overridden", "fail"], "fail"),
        ([Level.FAIL], ["overridden"], "fail"),
    ],
)
def test_the_status_is_the_worst_of_findings_and_gates(levels, states, expected):
    assert status([finding(level) for level in levels], [gate(state) for state in states]) == expected
    assert status((finding(level) for level in levels), (gate(state) for state in states)) == expected


def test_findings_are_plain_data():
    assert dumped(findings_list([finding(Level.WARN)])) == [
        {"code": 402, "level": "warn", "message": "something", "where": "somewhere"}
    ]
    assert findings_list([]) == []


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_a_gate_that_could_not_be_measured_has_no_value(value):
    (entry,) = dumped(gate_list([gate("fail", value)]))
    assert entry == {"name": "coverage", "value": None, "limit": 0.5, "state": "fail", "text": "words"}


def test_a_gate_keeps_its_value():
    (entry,) = dumped(gate_list([gate("ok", 0.25)]))
    assert (entry["value"], entry["state"]) == (0.25, "ok")


def test_an_input_tells_where_it_came_from():
    source = Source("parts/a.step", "STEP", "ab" * 32, "inch", True)
    assert dumped(input_entry("part", source, 7)) == {
        "role": "part",
        "path": "parts/a.step",
        "sha256": "ab" * 32,
        "format": "STEP",
        "units": "inch",
        "unit_stated": True,
        "count": 7,
    }


def test_an_input_from_memory_has_the_same_keys_that_scripts_rely_on():
    entry = dumped(input_entry("scan", None, 3))
    assert {"role", "path", "sha256", "format", "units", "count"} <= set(entry)
    assert (entry["format"], entry["units"], entry["count"]) == ("memory", "mm", 3)


def test_an_output_has_the_hash_of_its_bytes():
    assert output_entry("program", "a/b.nc", b"G21\n") == {
        "kind": "program",
        "path": "a/b.nc",
        "sha256": hashlib.sha256(b"G21\n").hexdigest(),
    }


def curve(k, closed=True):
    x = np.arange(k, dtype=float)
    unit = [np.tile(row, (k, 1)) for row in np.eye(3)]
    return FramedCurve(x, np.stack([x, 0 * x, 0 * x], 1), *unit, float(k), closed)


def contour(number, normal, out, covered, segments=0, symmetric=False):
    k = len(covered)
    before, after = Residuals(np.ones(k), np.full(k, -2.0)), Residuals(np.array(normal, float), np.array(out, float))
    pieces = tuple(Segment(0.0, 1.0, np.eye(4), 0.1) for _ in range(segments))
    return RegisteredContour(
        number, curve(k), curve(k), curve(k), np.array(covered, bool), NONE, before, after, pieces, np.zeros(0), NONE,
        NONE, symmetric,
    )  # fmt: skip


def registration(*contours):
    T = np.eye(4)
    T[:3, 3] = [1.0, 2.0, 3.0]
    return Registration("sicp", T, contours, 2.0, 0.05, np.linspace(0.9, 0.1, 6), None)


def test_a_registration_is_told_with_its_residuals_over_what_the_scan_shows():
    first = contour(3, [0.1, -0.3, 9.0, np.nan], [0.0, 0.0, 9.0, np.nan], [1, 1, 0, 0], segments=5, symmetric=True)
    second = contour(7, [0.2], [0.4], [1])
    entry = dumped(registration_entry(registration(first, second)))
    assert np.array(entry["T_scan_part"])[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert [c["id"] for c in entry["contours"]] == [3, 7]
    assert [c["segments"] for c in entry["contours"]] == [5, 0]
    assert [c["coverage"] for c in entry["contours"]] == [0.5, 1.0]
    assert [c["symmetric"] for c in entry["contours"]] == [True, False]
    assert entry["contours"][0]["length_mm"] == 4.0
    normal, out = entry["corrected"]["normal"], entry["corrected"]["out"]
    assert normal["mean"] == pytest.approx(0.0) and normal["max"] == pytest.approx(0.3)
    assert out["max"] == pytest.approx(0.4)
    assert entry["corrected"]["both"]["max"] == pytest.approx(np.hypot(0.2, 0.4))
    assert entry["rigid"]["normal"]["mean"] == pytest.approx(1.0)
    assert entry["rigid"]["out"]["mean"] == pytest.approx(-2.0)
    assert len(entry["freedoms"]) == 6
    assert (entry["spacing_mm"], entry["noise_mm"], entry["symmetry_ratio"]) == (2.0, 0.05, None)


def test_residuals_that_nobody_measured_are_none_and_not_nan():
    entry = dumped(registration_entry(registration(contour(1, [np.nan], [np.nan], [0]))))
    assert entry["corrected"] == {"normal": None, "out": None, "both": None}


def sure(number, u_mm, covered, halves):
    k = len(covered)
    made = contour(number, np.zeros(k), np.zeros(k), covered)
    return replace(made, normal_u_mm=np.array(u_mm, float), out_u_mm=np.zeros(k), leave_out=halves)


def test_uncertainty_and_leave_out_stand_at_each_contour_and_the_worst_at_the_top():
    first = sure(3, [0.1, 0.3, 0.8], [1, 1, 0], LeaveOut(0.03, 0.04))
    second = sure(7, [0.2], [1], LeaveOut(0.06, 0.08))
    entry = dumped(registration_entry(registration(first, second)))
    assert entry["leave_out"] == {"normal": 0.06, "out": 0.08, "both": pytest.approx(0.1)}
    one, other = entry["contours"]
    assert one["leave_out"]["both"] == pytest.approx(0.05)
    assert (one["uncertainty"]["mean_mm"], one["uncertainty"]["max_mm"]) == (pytest.approx(0.2), 0.3)
    assert one["uncertainty"]["bridged"]["max_mm"] == 0.8
    assert other["uncertainty"]["bridged"] is None


def test_a_method_that_states_nothing_has_null():
    entry = dumped(registration_entry(registration(contour(1, [0.1], [0.1], [1]))))
    assert entry["leave_out"] is None
    assert entry["contours"][0]["uncertainty"] is None and entry["contours"][0]["leave_out"] is None


@pytest.mark.parametrize(
    ("uncertainty", "words"),
    [
        (None, "no uncertainty stated"),
        (
            {"mean_mm": 0.0504, "max_mm": 0.0907, "bridged": None},
            "stated uncertainty 0.050 mm (1 sigma), largest 0.091 mm",
        ),
        (
            {"mean_mm": 0.05, "max_mm": 0.09, "bridged": {"mean_mm": None, "max_mm": None}},
            "stated uncertainty 0.050 mm (1 sigma), largest 0.090 mm, where bridged not known",
        ),
        ({"mean_mm": None, "max_mm": None, "bridged": None}, "the uncertainty could not be measured"),
    ],
)
def test_the_uncertainty_in_words(uncertainty, words):
    assert uncertainty_words(uncertainty) == words


def corrected(change, axes=None, words=None, added=None):
    n = len(change)
    tips = np.stack([np.arange(n, dtype=float), np.zeros(n), np.zeros(n)], 1)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    rigid = ToolPath(tips, up, np.ones(n), np.zeros(n, bool), np.zeros(n))
    shifted = tips + np.outer(change, [0.0, 0.0, 1.0])
    moved = ToolPath(shifted, up if axes is None else axes, np.ones(n), np.zeros(n, bool), np.zeros(n))
    words = (Status.COVERED,) * n if words is None else words
    return CorrectedPath(
        rigid, rigid, moved, words, np.arange(n), np.zeros(n, bool) if added is None else np.array(added, bool)
    )


def test_a_correction_is_told_by_its_largest_move_turn_and_step():
    a = np.radians(3.0)
    axes = [[0.0, 0.0, 1.0], [np.sin(a), 0.0, np.cos(a)], [0.0, 0.0, 1.0]]
    words = (Status.APPROACH, Status.BRIDGED, Status.COVERED)
    entry = dumped(correction_entry(corrected([0.5, -2.0, 0.0], axes, words, [False, True, False])))
    assert entry["max_mm"] == pytest.approx(2.0)
    assert entry["max_axis_deg"] == pytest.approx(3.0)
    assert entry["max_jump_mm"] == pytest.approx(2.5)
    assert (entry["moves"], entry["added_moves"]) == (3, 1)
    assert entry["status"] == {"covered": 1, "bridged": 1, "approach": 1}


def test_a_path_of_one_move_has_no_step():
    assert dumped(correction_entry(corrected([0.25])))["max_jump_mm"] == 0.0


def test_the_versions_are_those_of_what_decides_the_numbers():
    found = dumped(dict(versions()))
    assert set(found) == {"sicp-cam", "numpy", "scipy", "python"}
    assert found["numpy"] == np.__version__
    assert SCHEMA == "sicp-cam/1"
