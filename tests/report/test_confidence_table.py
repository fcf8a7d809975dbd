"""What the report says of how sure the contour is: what is stated, its gates, and what is not stated."""

from __future__ import annotations

import copy

import pytest

from sicp_cam.errors import ReportError
from sicp_cam.report.confidence_table import confidence

NO_GATE = ("", "", "")


def changed(result, registration=(), **top):
    found = copy.deepcopy(result) | top
    found["registration"] |= dict(registration)
    return found


def test_it_tells_parts_gaps_halves_and_the_gates(result) -> None:
    assert confidence(result).rows == (
        ("uncertainty where seen, mean", "0.040", "0.030", "0.050", *NO_GATE),
        ("uncertainty where seen, largest", "0.080", "0.060", "0.100", "uncertainty_mm", "1", "OK"),
        ("uncertainty in gaps, mean", "0.200", "0.150", "0.250", *NO_GATE),
        ("uncertainty in gaps, largest", "0.400", "0.300", "0.500", *NO_GATE),
        ("leave-out, rms", "0.030", "0.040", "0.050", "leave_out_mm", "0.6", "OK"),
    )


def test_the_note_says_what_the_numbers_are(result) -> None:
    note = confidence(result).note
    assert "95 % of the true edge and surface should lie within 1.96 times" in note
    assert "even and from the odd points" in note
    assert "The method" not in note


def test_a_gate_that_failed_is_told_as_it_is(result) -> None:
    gates = [{"name": "leave_out_mm", "value": 0.75, "limit": 0.6, "state": "overridden"}]
    rows = confidence(result | {"gates": gates}).rows
    assert [row[4:] for row in rows if row[4]] == [("leave_out_mm", "0.6", "OVERRIDDEN")]


def test_a_contour_without_gaps_has_no_row_for_them(result) -> None:
    whole = result | {"uncertainty": result["uncertainty"] | {"bridged": None}}
    assert [row[0] for row in confidence(whole).rows] == [
        "uncertainty where seen, mean",
        "uncertainty where seen, largest",
        "leave-out, rms",
    ]


def test_several_contours_are_told_one_by_one_after_all_together(result) -> None:
    (first,) = result["registration"]["contours"]
    second = first | {"id": 7, "leave_out": {"normal": 0.5, "out": 0.0, "both": 0.5}}
    rows = confidence(changed(result, {"contours": [first, second]})).rows
    assert len(rows) == 15
    assert rows[:5] == confidence(result).rows
    assert [row[0].split(":")[0] for row in rows[5:]] == ["contour 1"] * 5 + ["contour 7"] * 5
    assert rows[-1][:4] == ("contour 7: leave-out, rms", "0.500", "0.000", "0.500")
    assert all(row[4:] == NO_GATE for row in rows[5:]), "the gates judge all contours together"


def test_a_method_that_states_nothing_is_named(result) -> None:
    silent = changed(result, {"method": "rigid", "leave_out": None}, uncertainty=None)
    table = confidence(silent)
    assert table.rows == ()
    assert table.note == "The method rigid ICP states no uncertainty and does not compare halves of the scan."


def test_half_a_statement_is_told_and_the_other_half_named(result) -> None:
    table = confidence(changed(result, {"leave_out": None}))
    assert len(table.rows) == 4
    assert table.note.endswith("The method S-ICP (sicp) does not compare halves of the scan.")


def test_numbers_that_are_not_known_are_a_dash(result) -> None:
    unknown = {"mean_mm": None, "max_mm": None}
    rows = confidence(result | {"uncertainty": unknown | {"normal": unknown, "out": unknown, "bridged": None}}).rows
    assert rows[0][1:4] == rows[1][1:4] == ("-", "-", "-")


@pytest.mark.parametrize("broken", [3, "0.05", [0.05]])
def test_a_broken_result_names_the_key(result, broken) -> None:
    with pytest.raises(ReportError, match="'uncertainty' must be an object"):
        confidence(result | {"uncertainty": broken})


def test_a_run_that_failed_early_has_the_table_all_the_same() -> None:
    table = confidence({"status": "fail"})
    assert (table.rows, table.note) == ((), "Nothing was registered.")
