"""Ten thousand poses and more through every dialect of G-code, and back by a reader of another hand."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "postprocessors"))

from gcode_reread import CHAINS, axes_of_words, read_program, tips_of_words, vectors_of
from post_programs import path_of, program_of
from post_reread import axis_error_deg

from sicp_postprocessors.gcode import GCode

COUNT = 1000
TRUNNION = [("C", (0, 0, 1), (10.0, 20.0, -30.0), "table"), ("A", (1, 0, 0), (0.0, 20.0, -75.0), "table")]
FORK = [("C", (0, 0, 1), (0.5, -0.25, 0.0), "head"), ("B", (0, 1, 0), (0.0, 0.0, 215.5), "head")]
CASES = {
    "fanuc vector": ({}, None),
    "fanuc inch": ({"units": "inch"}, None),
    "fanuc head-ac": ({"orientation": "rotary"}, "head-ac"),
    "fanuc mixed-bc": ({"orientation": "rotary", "machine": "mixed-bc", "units": "inch"}, "mixed-bc"),
    "siemens vector": ({"dialect": "siemens", "line_numbers": 5}, None),
    "siemens table-ab": ({"dialect": "siemens", "orientation": "rotary", "machine": "table-ab"}, "table-ab"),
    "heidenhain table-bc": ({"dialect": "heidenhain", "machine": "table-bc", "wrap": "0..360"}, "table-bc"),
    "heidenhain vector": ({"dialect": "heidenhain", "orientation": "vector"}, None),
    "haas mixed-ac": ({"dialect": "haas", "machine": "mixed-ac", "wrap": "+-180"}, "mixed-ac"),
    "linuxcnc head-ab": ({"dialect": "linuxcnc", "machine": "head-ab", "inverse_time": True}, "head-ab"),
    "linuxcnc nutating": ({"dialect": "linuxcnc", "machine": "nutating-mixed-bc"}, "nutating-mixed-bc"),
}
POLES = np.vstack([np.eye(3), -np.eye(3)])


def poses(seed, upwards=False):
    """Random tips and axes; a third of the axes at the poles of all machines or right beside them."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(COUNT, 3))
    near = rng.random(COUNT) < 0.33
    beside = rng.normal(size=(COUNT, 3)) * 10.0 ** rng.uniform(-14, -1, (COUNT, 1)) * (rng.random((COUNT, 1)) < 0.7)
    axes[near] = (POLES[rng.integers(0, 6, COUNT)] + beside)[near]
    axes[:, 2] = np.abs(axes[:, 2]) if upwards else axes[:, 2]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return rng.uniform(-5000.0, 5000.0, (COUNT, 3)), axes


@pytest.mark.parametrize("case", CASES)
def test_poses_are_read_back(case):
    options, chain = CASES[case]
    tips, axes = poses(len(case), upwards="nutating" in case)
    rapid = np.arange(COUNT) % 3 == 0
    post = GCode({**options, "check_crossings": False})
    blocks = read_program(post.write(program_of(path_of(tips, axes, 1200.0, rapid))), options.get("dialect", "fanuc"))
    xyz, turn, feeds, again = blocks.arrays()
    assert np.abs(xyz - tips).max() <= 1e-3
    read = vectors_of(turn) if chain is None else axes_of_words(CHAINS[chain], turn)
    assert axis_error_deg(read, axes) <= 1e-3
    assert np.array_equal(again, rapid)
    lengths = np.concatenate([[1.0], np.linalg.norm(np.diff(tips, axis=0), axis=1)])
    stated = feeds * lengths if blocks.inverse else feeds
    assert np.allclose(stated[~rapid], 1200.0, rtol=1e-3 if blocks.inverse else 1e-6)


@pytest.mark.parametrize(("kind", "chain"), [("table", TRUNNION), ("head", FORK)])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_without_tip_control_the_tip_is_where_the_path_has_it(tmp_path, kind, chain, units):
    file = tmp_path / "machine.toml"
    text = 'name = "m"\n'
    for letter, direction, point, on in chain:
        text += f'[[rotary]]\nletter = "{letter}"\non = "{on}"\ndirection = {list(direction)}\n'
        text += f"point_mm = {list(point)}\n"
    file.write_text(text, "ascii")
    tips, axes = poses(7)
    tips = tips / 10.0
    options = {"dialect": "plain", "machine": str(file), "units": units, "check_crossings": False}
    options |= {"tool_length_mm": 120.25} if kind == "head" else {"part_zero_mm": "100,-50,20"}
    zero = np.array([100.0, -50.0, 20.0]) if kind == "table" else np.zeros(3)
    post = GCode(options)
    blocks = read_program(post.write(program_of(path_of(tips, axes, 0.0, True))), "plain")
    xyz, turn, _, _ = blocks.arrays()
    again = tips_of_words(chain, turn, xyz, zero, 120.25 if kind == "head" else 0.0)
    assert np.linalg.norm(again - tips, axis=1).max() <= 1e-3
    assert axis_error_deg(axes_of_words(chain, turn), axes) <= 1e-3
