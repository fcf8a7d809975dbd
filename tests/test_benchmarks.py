"""The benchmark's own measure and cases, where the answer is known without the product."""

import dataclasses
import importlib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"


@pytest.fixture
def bench_module(monkeypatch):
    """Give a function that imports a module of the benchmarks by name."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module


def ring(radius, count=400):
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    return radius * out, out, np.tile([0.0, 0.0, 1.0], (count, 1))


def test_the_error_is_that_across_the_edge_and_out_of_the_surface_and_not_along(bench_module):
    truth = bench_module("truth")
    edge, inward, outward = ring(100.0)
    known = truth.Truth(edge, outward, edge, inward, outward, np.full(len(edge), True))
    slid = np.roll(edge, 7, axis=0) + 0.3 * np.roll(inward, 7, axis=0) + 0.4 * outward
    leaning = outward + np.tan(np.radians(2.0)) * np.roll(inward, 7, axis=0)
    found = truth.error(slid, leaning, known)
    expected = {"both": 0.5, "p95": 0.5, "max": 0.5, "normal": 0.3, "bias": 0.3, "out": 0.4, "axis": 2.0}
    assert found == pytest.approx(expected, abs=1e-2)
    assert truth.error(edge - 0.3 * inward, None, known)["bias"] == pytest.approx(-0.3, abs=1e-2)


def test_an_error_where_the_scan_shows_nothing_does_not_count(bench_module):
    truth = bench_module("truth")
    edge, inward, outward = ring(100.0)
    covered = np.arange(len(edge)) >= 100
    known = truth.Truth(edge, outward, edge, inward, outward, covered)
    wrong = edge + np.where(np.arange(len(edge)) < 95, 5.0, 0.0)[:, None] * outward
    assert truth.error(wrong, outward, known)["max"] < 0.1


@pytest.mark.parametrize("name", ["grid 4 mm", "circle"])
def test_a_built_case_is_what_it_says(bench_module, name):
    cases, truth = bench_module("cases"), bench_module("truth")
    case = cases.built(name, 3)
    exact = truth.error(case.truth.edge_scan_mm, case.truth.outward, case.truth)
    assert max(exact["max"], exact["axis"]) < 1e-3
    assert 0.85 < case.truth.covered.mean() < 1.0
    # No scan point but an outlier lies beyond the true edge or off the true surface beside it.
    distance, column = cKDTree(case.truth.edge_scan_mm).query(case.scan.points_mm)
    offset = (case.scan.points_mm - case.truth.edge_scan_mm[column])[distance < 6.0]
    inward = np.sum(offset * case.truth.inward[column][distance < 6.0], axis=1)
    out = np.sum(offset * case.truth.outward[column][distance < 6.0], axis=1)
    assert np.mean(inward < -0.3) < 0.01
    assert np.mean(np.abs(out) > 0.5) < 0.02
    again = cases.built(name, 3)
    np.testing.assert_array_equal(case.scan.points_mm, again.scan.points_mm)
    assert not np.array_equal(case.scan.points_mm[:9], cases.built(name, 4).scan.points_mm[:9])


def test_peers_are_given_the_nominal_surface_and_the_scan_beside_the_edge(bench_module):
    cases, peer_runs, shapes = bench_module("cases"), bench_module("peer_runs"), bench_module("shapes")
    case = cases.built("grid 4 mm", 1)
    given = peer_runs.problem(case)
    n = len(case.truth.path_part_mm)
    np.testing.assert_allclose(given["surface"][:n], given["path"], atol=1e-9)
    T = np.linalg.inv(case.T_start)
    surface = given["surface"] @ T[:3, :3].T + T[:3, 3]
    off = surface[:, 2] - shapes.dome(1500.0, 2500.0)(surface[:, :2])[:, 2]
    assert np.abs(off).max() < 0.02
    sides = [
        np.linalg.norm(surface[given["faces"][:, i]] - surface[given["faces"][:, i - 1]], axis=1) for i in range(3)
    ]
    assert np.max(sides) < 6.0  # rows stand 2.5 mm apart, columns 2 mm and more
    assert len(given["rim"]) > 50 and len(given["scan"]) > 500


def test_a_peer_that_is_not_there_is_not_measured(bench_module, monkeypatch, tmp_path):
    peer_runs = bench_module("peer_runs")
    monkeypatch.setattr(peer_runs, "PYTHON", tmp_path / "python")
    with pytest.raises(peer_runs.NotMeasuredError, match="not installed; run make peers"):
        peer_runs.measured(peer_runs.PEERS[0], {}, None)


def test_the_names_of_the_peers_are_those_of_their_child(bench_module):
    text = (BENCHMARKS / "peers" / "register.py").read_text(encoding="utf-8")
    assert [peer for peer in bench_module("peer_runs").PEERS if f'"{peer}": (' not in text] == []
    assert text.count('": ("') == len(bench_module("peer_runs").PEERS)


# --- programs ---


def test_the_path_of_the_programs_is_what_its_text_says(bench_module):
    programs = bench_module("programs")
    made = programs.program(4 * programs.ROUND)
    path = made.path
    assert len(path) == 4 * programs.ROUND and path.rapid.sum() == 8
    step = np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1)[~path.rapid[1:] & ~path.rapid[:-1]]
    assert step.min() > 0.4 and step.max() < 0.6
    assert (np.abs(np.diff(path.axes, axis=0)).max(axis=1) > 0.0).mean() > 0.99
    assert set(path.feeds_mm_min) == {0.0, *programs.FEEDS_MM_MIN}
    assert {event.kind.value for event in path.events} == {"tool", "spindle", "comment", "coolant"}


@pytest.mark.parametrize("post", ["csv", "val3"])
def test_a_program_of_the_benchmark_is_the_path(bench_module, tmp_path, post):
    programs = bench_module("programs")
    writer, made = programs.prepared(post, 300)
    files = writer.write(made)
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    again = programs.plugins.read_path(tmp_path / writer.main_file(files), options=writer.reading())
    assert np.abs(again.tips_mm - made.path.tips_mm).max() < 1e-3


def test_a_row_tells_whether_its_limits_are_kept(bench_module):
    programs = bench_module("programs")
    row = programs.measured("csv", 600, 1)
    assert row.moves_per_s == pytest.approx(600 / row.seconds)
    assert row.limit == 300_000.0 and row.megabytes > 0.03
    fast = programs.Row("val3", 200_000, 1.0, 200_000.0, 150_000.0, 40.0, 3.0, 12.0)
    assert fast.kept and programs.told(fast).endswith("memory   3.0 x (limit 12): kept")
    for change in ({"moves_per_s": 149_999.0}, {"memory": 12.1}):
        slow = dataclasses.replace(fast, **change)
        assert not slow.kept and programs.told(slow).endswith("MISSED")
    assert dataclasses.replace(fast, limit=None, moves_per_s=1.0, memory=None).kept


def test_the_program_that_is_written_again_was_read(bench_module):
    programs = bench_module("programs")
    writer, made = programs.prepared("same", 40)
    (content,) = writer.write(made).values()
    (original,) = programs.plugins.postprocessor("apt").write(programs.program(40)).values()
    assert content.count(b"GOTO") == original.count(b"GOTO") == 40 and content != original


def test_every_limit_is_that_of_a_post(bench_module):
    programs = bench_module("programs")
    assert {*programs.LIMITS, *programs.NO_LIMIT} <= set(programs.owners(programs.POSTPROCESSORS))
