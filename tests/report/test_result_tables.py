from __future__ import annotations

import copy

import pytest

from sicp_cam.errors import ReportError
from sicp_cam.report import result_tables
from sicp_cam.report.document import Table, Verdict


@pytest.mark.parametrize(
    ("status", "gate", "level", "expected"),
    [
        ("ok", "ok", "info", Verdict.OK),
        ("warn", "ok", "info", Verdict.WARNINGS),
        ("ok", "warn", "info", Verdict.WARNINGS),
        ("ok", "overridden", "info", Verdict.WARNINGS),
        ("ok", "ok", "warn", Verdict.WARNINGS),
        ("fail", "ok", "info", Verdict.FAILED),
        ("ok", "FAIL", "info", Verdict.FAILED),
        ("warn", "warn", "fail", Verdict.FAILED),
    ],
)
def test_the_verdict_is_the_worst_of_status_gates_and_findings(status, gate, level, expected) -> None:
    result = {
        "status": status,
        "gates": [{"name": "coverage", "value": 0.25, "limit": 0.5, "state": gate}],
        "findings": [{"code": 1, "level": level, "message": "m", "where": ""}],
    }
    found, reasons = result_tables.verdict(result)
    assert found == expected
    assert reasons
    if gate.lower() == "fail":
        assert reasons[0] == "Gate coverage failed: 0.25 against the limit 0.5."


def test_many_reasons_are_counted_not_lost() -> None:
    findings = [{"code": 1, "level": "warn", "message": f"finding {n}"} for n in range(20)]
    _, reasons = result_tables.verdict({"status": "warn", "findings": findings})
    assert len(reasons) == 9
    assert reasons[-1].startswith("... and 12 more")


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("status", "fine", "'status' is 'fine'"),
        ("status", None, "'status' is None"),
        ("gates", [{"state": "maybe"}], "'gates.state' is 'maybe'"),
        ("gates", [{"name": "coverage"}], "'gates.state' is None"),
        ("gates", {"a": 1}, "'gates' must be a list"),
        ("findings", [7], "'findings' must be a list of objects"),
        ("registration", [1], "'registration' must be an object"),
    ],
)
def test_a_broken_result_names_the_key(result, key: str, value: object, told: str) -> None:
    broken = copy.deepcopy(result) | {key: value}
    with pytest.raises(ReportError, match=told):
        (result_tables.verdict(broken), result_tables.statistics(broken))


def test_statistics_show_rigid_against_method_and_the_coverage(result) -> None:
    table = result_tables.statistics(result)
    assert table.rows[0] == ("rigid ICP", "normal", "1.234", "2.000", "3.000", "4.000", "5.000")
    assert table.rows[3] == ("S-ICP", "normal", "0.123", "0.200", "0.300", "0.400", "0.500")
    assert table.rows[5] == ("S-ICP", "both", "-", "-", "-", "-", "-")
    assert "contour 1: 90.5 %" in table.note


def test_inputs_show_the_name_without_its_folder_on_any_system(result) -> None:
    rows = result_tables.inputs(result).rows
    assert [row[1] for row in rows] == ["part.step", "a&b.ply"]
    assert rows[0][5] == "abababababab"


def test_the_gravest_finding_comes_first(result) -> None:
    assert [row[1] for row in result_tables.findings(result).rows] == ["410", "110"]


def test_a_run_that_failed_early_has_tables_all_the_same() -> None:
    result = {"status": "fail", "findings": [{"code": 401, "level": "fail", "message": "no pose"}]}
    assert result_tables.verdict(result) == (Verdict.FAILED, ("no pose",))
    assert result_tables.statistics(result).rows[0][2] == "-"
    assert result_tables.details(result).rows[0] == ("method", "-")
    assert result_tables.inputs(result).rows == ()


def test_small_negative_numbers_print_without_a_sign(result) -> None:
    changed = copy.deepcopy(result)
    changed["registration"]["rigid"]["normal"]["mean"] = -0.0001
    assert result_tables.statistics(changed).rows[0][2] == "0.000"


def test_a_table_checks_its_rows() -> None:
    with pytest.raises(ValueError, match="needs 2 cells"):
        Table("t", ("a", "b"), (("1",),), (1, 1))
