"""What a run says and writes: the JSON document, the files, and the same bytes each time."""

import hashlib
import json
import math
from dataclasses import fields
from datetime import datetime

import numpy as np
import pytest

from sicp_cam.summary import summary
from sicp_cam.toolpath.gates import GATE_NAMES

SUMMARY = {"mean", "sd", "rms", "p95", "max"}


def leaves(value, name=""):
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from leaves(item, f"{name}[{index}]")
    else:
        yield name, value


def test_stdout_is_exactly_one_document_and_it_is_the_result_file(disc_run):
    document, end = json.JSONDecoder().raw_decode(disc_run.stdout)
    assert disc_run.stdout[end:].strip() == ""
    assert document == json.loads((disc_run.out / "result.json").read_text(encoding="utf-8"))


def test_stderr_holds_lines_of_this_program_only(disc_run):
    assert all(line.startswith("sicp-cam: warning: ") for line in disc_run.stderr.splitlines())


def test_the_document_has_what_scripts_rely_on(disc_run):
    document = disc_run.document
    assert document["schema"] == "sicp-cam/1"
    assert document["status"] in ("ok", "warn", "fail")
    assert all(set(finding) == {"code", "level", "message", "where"} for finding in document["findings"])
    assert [entry["role"] for entry in document["inputs"]] == ["part", "scan", "path"]
    for entry in document["inputs"]:
        assert {"role", "path", "sha256", "format", "units", "count"} <= set(entry)
    assert all({"kind", "path", "sha256"} <= set(entry) for entry in document["outputs"])
    registration = document["registration"]
    keys = ["method", "T_scan_part", "contours", "spacing_mm", "noise_mm", "freedoms"]
    assert {*keys, "rigid", "corrected", "leave_out"} <= set(registration)
    assert np.shape(registration["T_scan_part"]) == (4, 4)
    assert np.shape(registration["freedoms"]) == (6,)
    (contour,) = registration["contours"]
    assert {"id", "length_mm", "segments", "coverage", "symmetric"} <= set(contour)
    for state in ("rigid", "corrected"):
        assert set(registration[state]) == {"normal", "out", "both"}
        assert all(set(summary) == SUMMARY for summary in registration[state].values())
    assert {"mean_mm", "max_mm"} <= set(document["uncertainty"])
    assert {"normal", "out"} <= set(registration["leave_out"])
    assert {"max_mm", "max_axis_deg", "max_jump_mm"} <= set(document["correction"])
    judged = [gate["name"] for gate in document["gates"]]
    assert judged == [name for name in GATE_NAMES if name in judged]
    # The start was given, so there is nothing to be found from the geometry.
    assert set(GATE_NAMES) - set(judged) <= {"symmetry"}
    assert all({"name", "value", "limit", "state"} <= set(gate) for gate in document["gates"])
    assert set(document["timing_s"]) == {"read", "contour", "register", "correct", "write", "report", "total"}
    assert {"sicp-cam", "numpy", "scipy", "python"} <= set(document["versions"])


def test_the_document_says_how_sure_the_contour_is(disc_run):
    registration, uncertainty = disc_run.document["registration"], disc_run.document["uncertainty"]
    (contour,) = registration["contours"]
    assert contour["uncertainty"] == uncertainty
    assert contour["leave_out"] == registration["leave_out"]
    assert uncertainty["bridged"] is None, "the scan shows all of the disc"
    for part in (uncertainty, uncertainty["normal"], uncertainty["out"]):
        assert 0.0 < part["mean_mm"] <= part["max_mm"]
    # A twentieth of the point spacing of 4 mm across the edge; out of it, the noise of 0.05 mm over many points.
    assert 0.02 < uncertainty["normal"]["mean_mm"] < 0.4
    assert 0.003 < uncertainty["out"]["mean_mm"] < 0.05
    values = {gate["name"]: gate["value"] for gate in disc_run.document["gates"]}
    assert values["uncertainty_mm"] == max(uncertainty[part]["max_mm"] for part in ("normal", "out"))
    assert values["leave_out_mm"] == pytest.approx(registration["leave_out"]["both"])


def test_the_table_has_the_uncertainty_of_each_cut(disc_run, bench):
    rows = bench.table(disc_run.out / "disc.csv")
    off = [row["status"] == "approach" for row in rows]
    assert any(off) and not all(off)
    assert [row["u_mm"] == "" for row in rows] == off
    stated = np.array([float(row["u_mm"]) for row in rows if row["u_mm"]])
    uncertainty = disc_run.document["uncertainty"]
    assert stated.max() <= uncertainty["max_mm"] + 1e-6
    assert stated.mean() == pytest.approx(uncertainty["mean_mm"], rel=0.1)


def test_the_operator_is_told_the_uncertainty(corrections):
    correction = corrections("disc")
    uncertainty = correction.document()["uncertainty"]
    words = f"stated uncertainty {uncertainty['mean_mm']:.3f} mm (1 sigma), largest {uncertainty['max_mm']:.3f} mm"
    first = next(summary(correction, [], []))
    assert first.endswith(f"of the edge; {words}")
    assert words in repr(correction)


def test_a_method_that_states_no_uncertainty_says_so_everywhere(corrections, tmp_path, bench):
    correction = corrections("disc", method="rigid")
    document = correction.document()
    assert document["uncertainty"] is None and document["registration"]["leave_out"] is None
    assert not {"uncertainty_mm", "leave_out_mm"} & {gate["name"] for gate in document["gates"]}
    assert next(summary(correction, [], [])).endswith("; no uncertainty stated")
    (table,) = correction.write("csv", tmp_path)
    assert "u_mm" not in bench.table(table)[0]


def test_every_number_is_finite_and_every_word_printable(disc_run):
    for name, value in leaves(disc_run.document):
        if isinstance(value, float):
            assert math.isfinite(value), name
        elif isinstance(value, str):
            assert value.isprintable(), name


def test_the_numbers_belong_to_the_disc(disc_run, bench):
    registration = disc_run.document["registration"]
    (contour,) = registration["contours"]
    assert contour["length_mm"] == pytest.approx(2.0 * np.pi * 100.0, rel=1e-4)
    assert contour["symmetric"] is True
    assert contour["coverage"] == pytest.approx(1.0, abs=0.02)
    assert contour["segments"] > 1
    assert registration["spacing_mm"] == pytest.approx(4.0, rel=0.1)
    assert registration["noise_mm"] == pytest.approx(0.05, rel=0.5)
    assert registration["method"] == "sicp"
    for name in ("rigid", "corrected"):
        for part in registration[name].values():
            assert part["rms"] ** 2 == pytest.approx(part["mean"] ** 2 + part["sd"] ** 2)
            assert part["p95"] <= part["max"]
    assert registration["corrected"]["out"]["rms"] < 0.1 * registration["rigid"]["out"]["rms"]
    counts = {entry["role"]: entry["count"] for entry in disc_run.document["inputs"]}
    assert counts["scan"] == 3069
    moves = disc_run.document["correction"]
    rows = bench.table(disc_run.out / "disc.csv")
    assert moves["moves"] == len(rows) == counts["path"] + moves["added_moves"]
    assert moves["status"] == {w: sum(r["status"] == w for r in rows) for w in ("covered", "bridged", "approach")}


def test_the_hashes_are_those_of_the_files(disc_run, bench):
    for entry in disc_run.document["inputs"]:
        file = bench.inputs("disc")[{"part": "cad"}.get(entry["role"], entry["role"])]
        assert entry["path"] == str(file)
        assert entry["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    for entry in disc_run.document["outputs"]:
        assert entry["sha256"] == hashlib.sha256((disc_run.out / entry["path"]).read_bytes()).hexdigest()


def test_the_files_are_those_that_the_document_names_and_no_other(disc_run, bench):
    named = {entry["path"] for entry in disc_run.document["outputs"]}
    assert set(bench.tree(disc_run.out)) == named | {"result.json"}
    assert {"disc.csv", "disc.nc", "disc/disc.pjx", "disc/disc.dtx", "report.pdf"} <= named
    kinds = {entry["path"]: entry["kind"] for entry in disc_run.document["outputs"]}
    assert kinds["disc.nc"] == "program" and kinds["report.pdf"] == "report"
    pictures = [name for name in named if name.startswith("report/")]
    assert pictures and all(name.endswith(".png") for name in pictures)
    assert (disc_run.out / "report.pdf").read_bytes().startswith(b"%PDF-")
    assert all((disc_run.out / name).read_bytes().startswith(b"\x89PNG") for name in pictures)


def test_the_inputs_are_not_changed(disc_run, bench):
    assert {file.name for file in (bench.SAMPLES / "disc").iterdir()} >= {"part.step", "scan.ply", "path.nc"}
    assert not any(file.name in ("out", "result.json") for file in (bench.SAMPLES / "disc").iterdir())


def test_times_add_up(disc_run):
    timing = disc_run.document["timing_s"]
    steps = sum(value for name, value in timing.items() if name != "total")
    assert all(value >= 0.0 for value in timing.values())
    assert steps <= timing["total"] <= steps + 2.0


def test_a_second_run_gives_the_same_bytes_and_is_named_in_lines(command, disc_run, bench, tmp_path):
    done = command("correct", bench.SAMPLES / "disc" / "job.toml", "--out", tmp_path / "out", "--report", "none")
    first, second = bench.tree(disc_run.out), bench.tree(tmp_path / "out")
    programs = [entry["path"] for entry in disc_run.document["outputs"] if entry["kind"] == "program"]
    assert len(programs) >= 5
    assert {name: second[name] for name in programs} == {name: first[name] for name in programs}
    lines = done.stdout.splitlines()
    assert lines[0].startswith(("OK: ", "OK, with warnings: "))
    for name in ("disc.csv", "disc.nc", "disc", "result.json"):
        assert any(line.endswith(str(tmp_path / "out" / name)) for line in lines)


def test_another_process_and_the_python_face_give_the_same_bytes(corrections, disc_run, tmp_path):
    for post in ("val3", "gcode", "csv"):
        for file in corrections("disc").write(post, tmp_path):
            assert file.read_bytes() == (disc_run.out / file.relative_to(tmp_path)).read_bytes(), file.name


def test_no_program_tells_the_time(disc_run):
    """A clock in a program would make two runs differ, and a check of what runs on the robot impossible."""
    today = datetime.now().astimezone()
    marks = [today.strftime("%Y-%m-%d").encode(), today.strftime("%d.%m.%Y").encode(), today.strftime("%H:%M").encode()]
    for entry in disc_run.document["outputs"]:
        if entry["kind"] == "program":
            content = (disc_run.out / entry["path"]).read_bytes()
            assert not any(mark in content for mark in marks), entry["path"]


def test_the_program_says_what_made_it_and_that_it_is_no_safety_function(disc_run):
    head = (disc_run.out / "disc.nc").read_text(encoding="ascii")[:2000].lower()
    for entry in disc_run.document["inputs"]:
        assert entry["sha256"][:16] in head
    assert "method sicp" in head and "scan frame" in head
    assert "not a safety function" in head


def test_document_of_a_correction_in_memory_is_finite_json(corrections):
    document = corrections("porthole").document()
    again = json.loads(json.dumps(document, allow_nan=False))
    assert again["outputs"] == []
    assert again["registration"]["contours"][0]["symmetric"] is True
    assert {field.name for field in fields(corrections("porthole"))} >= {
        "corrected",
        "registration",
        "gates",
        "findings",
    }
