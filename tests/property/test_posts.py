"""Any pose that is written is read back to a micrometre and a thousandth of a degree, by readers of another hand."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1] / "postprocessors"))

from post_programs import path_of, program_of
from post_reread import axis_error_deg, read_csv, read_gcode, read_val3

from sicp_cam.model import Event, EventKind
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.path_csv import PathCsv
from sicp_postprocessors.text import ascii_line, ascii_name, file_stem
from sicp_postprocessors.val3 import Val3

POLES = [sign * np.eye(3)[axis] for axis in range(3) for sign in (1.0, -1.0)]


@st.composite
def unit_vectors(draw):
    """Any direction, the poles of every convention, and directions just beside them."""
    vector = np.array(draw(st.tuples(*[st.floats(-1.0, 1.0)] * 3)))
    if draw(st.booleans()):
        vector = draw(st.sampled_from(POLES)) + vector * draw(st.sampled_from([0.0, 1e-9, 1e-6, 1e-5, 1e-4, 1e-2]))
    length = np.linalg.norm(vector)
    return vector / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


POSES = st.lists(st.tuples(st.tuples(*[st.floats(-20_000.0, 20_000.0)] * 3), unit_vectors()), min_size=8, max_size=12)
READERS = {
    "csv": lambda program: read_csv(PathCsv().write(program))[0],
    "gcode vector": lambda program: read_gcode(GCode().write(program)),
    "gcode inch": lambda program: read_gcode(GCode({"units": "inch"}).write(program)),
    "gcode AC": lambda program: read_gcode(GCode({"orientation": "rotary"}).write(program), "AC"),
    "gcode BC": lambda program: read_gcode(GCode({"orientation": "rotary", "kinematics": "BC"}).write(program), "BC"),
    "gcode siemens": lambda program: read_gcode(GCode({"orientation": "siemens"}).write(program)),
    "val3": lambda program: read_val3(Val3({"max_points_per_array": 5, "max_moves_per_program": 4}).write(program))[1],
    "val3 transport": lambda program: read_val3(Val3({"spin": "transport", "spin_deg": 70}).write(program))[1],
}


@pytest.mark.parametrize("reader", READERS)
@settings(deadline=None, max_examples=40)
@given(poses=POSES, feed=st.floats(0.01, 1e5))
def test_poses_read_back(reader, poses, feed):
    tips, axes = np.array([tip for tip, _ in poses]), np.array([axis for _, axis in poses])
    rapid = np.arange(len(poses)) == 0
    result = READERS[reader](program_of(path_of(tips, axes, feed, rapid)))
    assert np.abs(np.array(result.tips) - tips).max() < 1e-3
    assert axis_error_deg(np.array(result.axes), axes) < 1e-3
    assert result.rapid == rapid.tolist()
    # Where the tip stays, controls read a feed as that of the rotary axes: it is not that of the path then.
    moves = np.abs(np.diff(tips, axis=0)).max(axis=1) > 1e-3
    assert np.allclose(np.array(result.feeds)[1:][moves], feed, rtol=0, atol=1.3e-3 if "inch" in reader else 1e-3)


@settings(deadline=None, max_examples=60)
@given(
    steps=st.lists(st.sampled_from([0.0, 1e-4, 0.003, 0.02, 0.4, 0.9, 2.0, 30.0]), min_size=3, max_size=20),
    rapid=st.lists(st.booleans(), min_size=21, max_size=21),
    events=st.lists(st.tuples(st.integers(0, 20), st.sampled_from(list(EventKind))), max_size=3),
    blend_mm=st.sampled_from([0.001, 0.05, 0.5, 20.0]),
)
def test_blends_never_meet_and_never_skip_a_point_that_must_be_reached(steps, rapid, events, blend_mm):
    x = np.cumsum([0.0, *steps])
    told = [Event(min(before, len(x)), kind, 0.0, "x") for before, kind in events]
    path = path_of(np.column_stack([x, 0 * x, 0 * x]), [[0, 0, 1]] * len(x), 600.0, rapid[: len(x)], told)
    _, result = read_val3(Val3({"blend_mm": blend_mm}).write(program_of(path)))
    moves = [value["mdesc"] for kind, value in result.actions if kind in ("movej", "movel")]
    waits = {e.before_move - 1 for e in told if e.kind not in (EventKind.COMMENT, EventKind.OTHER)}
    for i, (move, run_on) in enumerate(zip(moves, np.append(~path.rapid[1:], False), strict=True)):
        reach = float(move["reach"])
        assert move["leave"] == move["reach"] and move["blend"] == ("Cartesian" if reach else "off")
        exact = i in waits or i == 0 or path.rapid[i] or not run_on
        room = 0.0 if exact else min(blend_mm, steps[i - 1] / 2, steps[i] / 2)
        assert reach <= room + 1e-9 and (reach > room / 2 - 1e-6 or room < 0.002)


@settings(deadline=None, max_examples=100)
@given(text=st.text(max_size=60))
def test_any_text_becomes_safe(text):
    assert ascii_line(text).isascii() and ascii_line(text).isprintable() and "(" not in ascii_line(text, drop="()")
    assert ascii_name(text, 15).isalnum() and len(ascii_name(text, 15)) <= 15
    stem = file_stem(text)
    assert stem and Path(stem).name == stem and stem == file_stem(stem)
