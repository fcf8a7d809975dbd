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


def warned(*findings: tuple[int, str, str]) -> tuple[str, ...]:
    rows = [{"code": code, "level": "warn", "message": message, "where": where} for code, message, where in findings]
    gates = [{"name": "jump_mm", "value": 0.9, "limit": 0.5, "state": "overridden"}]
    return result_tables.verdict({"status": "warn", "findings": rows, "gates": gates})[1]


def test_an_overridden_gate_is_one_reason() -> None:
    only = ("Gate jump_mm failed and was overridden: 0.9 against the limit 0.5.",)
    assert warned((501, "gate jump_mm was overridden: 0.9, limit 0.5", "")) == only
    other = "gate jump_mm_of_another was overridden: 3, limit 1"
    assert warned((501, other, "")) == (*only, other)


def test_one_text_is_told_once_with_all_its_places() -> None:
    found = warned((1, "bridged", "contour 1"), (1, "bridged", "contour 2"), (2, "no cell", ""), (2, "no cell", ""))
    assert found[1:] == ("bridged (contour 1, contour 2)", "no cell")


def test_a_place_that_the_text_names_is_not_told_again() -> None:
    found = warned((1, "scan.ply: no unit", "scan.ply"), (1, "contour 10 is bridged", "contour 1"))
    assert found[1:] == ("scan.ply: no unit", "contour 10 is bridged (contour 1)")


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
    assert table.rows[3] == ("S-ICP (sicp)", "normal", "0.123", "0.200", "0.300", "0.400", "0.500")
    assert table.rows[5] == ("S-ICP (sicp)", "both", "-", "-", "-", "-", "-")
    assert "contour 1: 90.5 %" in table.note
    assert "how well the curve fits the scan, not how true it is" in table.note


@pytest.mark.parametrize(
    ("method", "name"),
    [
        ("sicp", "S-ICP (sicp)"),
        ("paper", "S-ICP as published (paper)"),
        ("rigid", "rigid ICP"),
        ("projection", "projection"),
        ("other", "other"),
    ],
)
def test_a_method_has_one_name(result, method: str, name: str) -> None:
    changed = copy.deepcopy(result)
    changed["registration"]["method"] = method
    assert result_tables.details(changed).rows[0] == ("method", name)
    assert {row[0] for row in result_tables.statistics(changed).rows} == {"rigid ICP", name}


def test_the_rigid_method_is_not_listed_twice(result) -> None:
    changed = copy.deepcopy(result)
    changed["registration"] |= {"method": "rigid", "corrected": changed["registration"]["rigid"]}
    assert [row[1] for row in result_tables.statistics(changed).rows] == ["normal", "out", "both"]
    changed["registration"] |= {"corrected": {"normal": None, "out": None, "both": None}}
    assert len(result_tables.statistics(changed).rows) == 6


def test_gates_say_what_they_look_at_and_in_which_unit(result) -> None:
    rows = result_tables.gates(result).rows
    said = "largest turn of the tool axis beyond the rigid pose, degrees"
    assert rows[-1] == ("axis_deg", said, "16.25", "15", "OVERRIDDEN")
    older = {"gates": [{"name": "coverage", "value": 0.25, "limit": 0.5, "state": "fail"}]}
    assert result_tables.gates(older).rows == (("coverage", "-", "0.25", "0.5", "FAIL"),)


def test_gate_and_correction_do_not_call_two_things_a_jump(result) -> None:
    rows = dict(result_tables.details(result).rows)
    assert rows["largest correction"] == "3.000 mm"
    assert rows["largest step of the correction between neighbouring moves"] == "0.010 mm"
    assert not any("jump" in name for name in rows)


@pytest.mark.parametrize(
    ("count", "told"), [(0, "one rigid motion"), (1, "1 segment"), (6, "6 segments"), (None, "- segments")]
)
def test_segments_are_counted_in_words(result, count: int | None, told: str) -> None:
    changed = copy.deepcopy(result)
    changed["registration"]["contours"][0] |= {"segments": count, "symmetric": False}
    assert dict(result_tables.details(changed).rows)["contour 1"] == f"628.3 mm long, {told}"


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
