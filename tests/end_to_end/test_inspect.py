"""`sicp-cam inspect` on every file of the samples."""

import json
import math
import re

import numpy as np
import pytest

from sicp_cam.errors import InputError
from sicp_cam.inspection import inspect

FILES = [
    ("porthole", "part.step", "part", "STEP"), ("porthole", "scan.ply", "scan", "PLY"),
    ("porthole", "path.apt", "path", "APT"), ("nosecone", "scan.ply", "scan", "PLY"),
    ("nosecone", "path.apt", "path", "APT"), ("disc", "part.step", "part", "STEP"), ("disc", "scan.ply", "scan", "PLY"),
    ("disc", "scan.asc", "scan", "ASCII"), ("disc", "path.nc", "path", "G-code"),
]  # fmt: skip


@pytest.mark.parametrize(("case", "file", "role", "kind"), FILES)
def test_every_sample_file_is_described(cli, bench, case, file, role, kind):
    path = bench.SAMPLES / case / file
    done = cli("inspect", path, "--json")
    assert (done.code, done.err) == (0, "")
    document = json.loads(done.out, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert (document["role"], document["format"], document["path"]) == (role, kind, str(path))
    assert document["units"] == "mm"
    assert isinstance(document["findings"], list)
    low, high = document["bounds"]["min_mm"], document["bounds"]["max_mm"]
    assert all(math.isfinite(v) for v in (*low, *high))
    assert all(a <= b for a, b in zip(low, high, strict=True))
    assert document["count"] > 0


def described(cli, *words):
    done = cli("inspect", *words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)


def test_the_contours_of_a_part_are_numbered_as_a_run_numbers_them(cli, bench, disc_run):
    document = described(cli, bench.SAMPLES / "disc" / "part.step")
    assert [contour["number"] for contour in document["contours"]] == list(range(1, document["count"] + 1))
    (used,) = disc_run.document["registration"]["contours"]
    chosen = document["contours"][used["id"] - 1]
    assert chosen["length_mm"] == pytest.approx(2.0 * np.pi * 100.0, rel=1e-4)
    assert chosen["length_mm"] == pytest.approx(used["length_mm"], abs=1e-3)
    assert chosen["closed"] is True and chosen["corners"] == 0
    np.testing.assert_allclose(chosen["outward"], [0.0, 0.0, 1.0], atol=1e-3)
    np.testing.assert_allclose(chosen["centre_mm"][:2], 0.0, atol=0.01)
    assert (chosen["kind"], chosen["looks"]) == ("skin", "towards +Z")


def test_the_contours_of_walls_are_told_from_those_of_skins(cli, bench):
    """A sheet has an outer and an inner skin, each with an outer edge and a hole; what lies between is 3 mm wide."""
    contours = described(cli, bench.SAMPLES / "disc" / "part.step")["contours"]
    skins = [(round(c["length_mm"]), c["looks"]) for c in contours if c["kind"] == "skin"]
    assert sorted(skins) == [(628, "towards +Z"), (628, "towards -Z"), (1600, "towards +Z"), (1600, "towards -Z")]
    walls = [(round(c["length_mm"]), c["looks"]) for c in contours if c["kind"] == "wall"]
    sides = [(804, f"towards {side}") for side in ("+X", "+Y", "-X", "-Y")]
    assert sorted(walls) == [(628, "all round"), (628, "all round"), *sides]


def test_no_zero_has_a_sign(cli, bench):
    file = bench.SAMPLES / "porthole" / "part.step"
    assert not re.search(r"-0(\.0+)?(?![.\d])", cli("inspect", file, "--json").out)
    assert not re.search(r"-0(?![.\d])", cli("inspect", file).out)


def test_the_loops_and_the_spacing_of_a_scan_are_told(cli, bench):
    document = described(cli, bench.SAMPLES / "disc" / "scan.ply")
    assert document["count"] == 3069
    assert document["spacing_mm"] == pytest.approx(4.0, rel=0.1)
    assert document["normals"] is False and document["triangles"] == 0
    lengths = [loop["length_mm"] for loop in document["loops"]]
    assert lengths == sorted(lengths, reverse=True)
    assert any(length == pytest.approx(2.0 * np.pi * 102.0, rel=0.05) for length in lengths)


def test_a_path_is_told_with_its_feeds_and_events(cli, bench):
    document = described(cli, bench.SAMPLES / "disc" / "path.nc")
    assert document["feeds_mm_min"] == [600.0, 1500.0, 3000.0]
    assert document["rapid_moves"] == 1
    assert document["rapid_moves"] + document["feed_moves"] == document["count"]
    assert document["length_mm"] == pytest.approx(40.0 + 40.0 + 2.0 * np.pi * 100.0, abs=0.1)
    assert document["events"]["tool"] == 1 and document["events"]["spindle"] == 2
    assert document["name"] == "O1001"


def test_units_that_are_stated_scale_everything(cli, bench):
    document = described(cli, bench.SAMPLES / "disc" / "scan.asc", "--units", "inch")
    plain = described(cli, bench.SAMPLES / "disc" / "scan.asc")
    assert (document["units"], document["unit_stated"], plain["unit_stated"]) == ("inch", True, False)
    np.testing.assert_allclose(document["bounds"]["max_mm"], 25.4 * np.array(plain["bounds"]["max_mm"]), rtol=1e-5)
    assert document["spacing_mm"] == pytest.approx(25.4 * plain["spacing_mm"], rel=1e-3)


def test_lines_for_people_say_the_same(cli, bench):
    done = cli("inspect", bench.SAMPLES / "disc" / "path.nc")
    assert (done.code, done.err) == (0, "")
    told = {"role: path", "format: G-code", "unit: mm", "moves: 318, of which 1 rapid and 317 feed"}
    assert told <= set(done.out.splitlines())
    done = cli("inspect", bench.SAMPLES / "disc" / "scan.asc")
    told = {"unit: not stated: mm assumed (say it with --units)", "points: 3069", "triangles: none", "findings: 1"}
    assert told <= set(done.out.splitlines())


@pytest.fixture
def drawn(monkeypatch):
    """Put a stand-in for the renderer, which is tested with the report; give the scenes that it gets."""
    from sicp_cam.report import scenes

    given = []
    monkeypatch.setattr(scenes, "render", lambda wanted, *rest: [given.append(wanted[0]) or b"\x89PNG picture"])
    return given


def test_a_picture_shows_the_numbered_loops(cli, bench, drawn, tmp_path):
    file = tmp_path / "p.png"
    document = described(cli, bench.SAMPLES / "disc" / "scan.ply", "--picture", file)
    assert file.read_bytes() == b"\x89PNG picture"
    labels = [label.text for label in drawn[0].lettering.labels]
    assert labels == [str(loop["number"]) for loop in document["loops"]]


def test_the_picture_of_a_part_shows_its_skins_with_the_numbers_of_the_list(cli, bench, drawn, tmp_path):
    document = described(cli, bench.SAMPLES / "disc" / "part.step", "--picture", tmp_path / "p.png")
    labels = [label.text for label in drawn[0].lettering.labels]
    assert labels == [str(c["number"]) for c in document["contours"] if c["kind"] == "skin"]
    assert drawn[0].lettering.subtitle == "4 contours; 6 walls not drawn"


@pytest.mark.parametrize(("file", "words", "code"), [("path.nc", ["--picture", "p.png"], 3), ("gone.ply", [], 3)])
def test_what_cannot_be_inspected_is_refused(refused, bench, monkeypatch, tmp_path, file, words, code):
    monkeypatch.chdir(tmp_path)
    assert file in refused(code, "inspect", bench.SAMPLES / "disc" / file, *words)


def test_a_pose_is_no_scan(refused, bench):
    line = refused(3, "inspect", bench.SAMPLES / "porthole" / "pose_rough.txt")
    assert "pose_rough.txt: this is a pose" in line and "--align" in line
    with pytest.raises(InputError, match=r"pose_rough\.txt: this is a pose, .* --align"):
        inspect(bench.SAMPLES / "porthole" / "pose_rough.txt", role="scan")


@pytest.mark.parametrize("words", [[], ["--force"]])
def test_a_picture_never_replaces_the_file_that_it_shows(cli, bench, tmp_path, words):
    scan = tmp_path / "scan.ply"
    content = (bench.SAMPLES / "disc" / "scan.ply").read_bytes()
    scan.write_bytes(content)
    done = cli("inspect", scan, "--picture", scan, *words)
    assert (done.code, done.err.count("\n")) == (6, 1)
    assert scan.read_bytes() == content


def test_a_picture_replaces_an_existing_file_only_if_it_is_told_to(cli, bench, drawn, tmp_path):
    file = tmp_path / "somebodys.png"
    file.write_bytes(b"earlier")
    done = cli("inspect", bench.SAMPLES / "disc" / "scan.ply", "--picture", file)
    assert (done.code, done.out) == (6, "")
    assert "somebodys.png exists already; use --force" in done.err
    assert file.read_bytes() == b"earlier"
    assert cli("inspect", bench.SAMPLES / "disc" / "scan.ply", "--picture", file, "--force").code == 0
    assert file.read_bytes() == b"\x89PNG picture"


@pytest.mark.parametrize("count", [3, 4, 5, 9])
def test_a_scan_of_a_few_points_is_described_too(cli, bench, tmp_path, count):
    angle = np.linspace(0.0, 5.0, count)
    scan = bench.write_ply(tmp_path / "scan.ply", np.stack([10 * np.cos(angle), 10 * np.sin(angle), angle], axis=1))
    document = described(cli, scan)
    assert document["count"] == count
    assert (document["spacing_mm"] is None) is (count < 5)
    lines = cli("inspect", scan).out.splitlines()
    assert "loops: none" in lines
    assert ("spacing: not known, too few points" in lines) is (count < 5)
