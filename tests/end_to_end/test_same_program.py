"""A corrected path written in the words of the program that it came from; and programs converted without a change."""

import json
import re

import numpy as np
import pytest

import sicp_cam

NUMBER = re.compile(rb"[-+]?[0-9]*\.[0-9]+")


@pytest.mark.parametrize("name", ["porthole", "nosecone"])
def test_only_coordinates_and_axes_differ(corrections, bench, tmp_path, name):
    correction = corrections(name)
    (file,) = correction.write("same", tmp_path)
    before, after = bench.inputs(name)["path"].read_bytes(), file.read_bytes()
    assert file.name == f"{name}.apt"
    assert before != after
    assert NUMBER.sub(b"#", before) == NUMBER.sub(b"#", after)
    again = sicp_cam.read_path(file)
    np.testing.assert_allclose(again.tips_mm, correction.program.path.tips_mm, atol=1e-4)
    np.testing.assert_allclose(again.axes, correction.program.path.axes, atol=1e-6)


def test_an_arc_that_is_bent_becomes_straight_pieces_and_all_else_stays(corrections, bench, tmp_path):
    correction = corrections("disc")
    (file,) = correction.write("same", tmp_path)
    before, after = bench.inputs("disc")["path"].read_bytes(), file.read_bytes()
    again = sicp_cam.read_path(file)
    np.testing.assert_allclose(again.tips_mm, correction.program.path.tips_mm, atol=1e-4)
    words = [NUMBER.sub(b"#", text).split(b"\n") for text in (before, after)]
    assert words[0][:6] == words[1][:6]
    assert words[0][-4:] == words[1][-4:]
    assert b"G3" in before and b"G3" not in after


def test_a_path_that_is_not_moved_is_the_same_program_byte_for_byte(cli, bench, tmp_path):
    for name in ("porthole", "nosecone", "disc"):
        source = bench.inputs(name)["path"]
        target = tmp_path / f"{name}{source.suffix}"
        done = cli("convert", source, target, "--json")
        assert done.code == 0
        assert target.read_bytes() == source.read_bytes()
        assert json.loads(done.out)["read_back"]["largest_difference_mm"] == 0.0


def test_an_overridden_gate_has_no_place_in_the_same_program(refused, bench, tmp_path):
    words = bench.words("disc", tmp_path / "out", post="same", override="correction_mm")
    line = refused(5, *words, "--set", "gates.correction_mm=0.1")
    assert "no place to say that a gate was overridden; use another post" in line


def test_convert_says_what_it_did(cli, bench, tmp_path):
    scan = bench.inputs("disc")["scan"]
    done = cli("convert", scan, tmp_path / "scan.xyz", "--units", "mm")
    assert done.code == 0
    lines = done.out.splitlines()
    assert lines[0].startswith(f"read scan {scan}: PLY, ") and lines[0].endswith(" points, unit mm")
    assert lines[1] == "wrote scan.xyz: scan, unit mm"
    assert lines[2].startswith("read back: ") and lines[2].endswith(" points, at most 0 mm off")


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--set", "scann.decimal=,"], 2, "must begin with one of scan., part., path., out., limits."),
        (["--set", "out.encodin=ascii"], 2, "out.encodin: unknown option; did you mean encoding?"),
        (["--out-units", "furlong"], 2, "--out-units. Choose from"),
        (["--out-units", "inch"], 2, "states no unit, so there is none to be changed; state it with --units"),
        (["--role", "path"], 3, "no reader for a path"),
    ],
)
def test_convert_refuses_what_makes_no_sense(refused, bench, tmp_path, words, code, told):
    assert told in refused(code, "convert", bench.inputs("disc")["scan"], tmp_path / "b.ply", *words)
