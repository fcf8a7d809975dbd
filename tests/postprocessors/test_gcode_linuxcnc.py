"""Programs of the dialect linuxcnc as the real interpreter reads them (rs274 of Debian's package linuxcnc-uspace)."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from gcode_reread import axes_of_words, tips_of_words
from post_programs import leaning_axes, nasty_program, path_of, program_of, simple_program

from sicp_cam.model import Event, EventKind
from sicp_postprocessors.gcode import GCode

pytestmark = pytest.mark.skipif(shutil.which("rs274") is None, reason="rs274 (linuxcnc-uspace) is not installed")

CALL = re.compile(r" *[0-9]+ N\S+ +([A-Z0-9_]+)\((.*)\)$")
TABLE = [("C", (0, 0, 1), (10.0, 20.0, -30.0), "table"), ("A", (1, 0, 0), (0.0, 20.0, -75.0), "table")]
TRUNNION = """
name = "trunnion"
[[rotary]]
letter = "C"
on = "table"
direction = [0, 0, 1]
point_mm = [10, 20, -30]
[[rotary]]
letter = "A"
on = "table"
direction = [1, 0, 0]
point_mm = [0, 20, -75]
limits_deg = [-120, 120]
"""


INI = """[RS274NGC]
SUBROUTINE_PATH = {0}
REMAP = M428 modalgroup=10 ngc=site428
REMAP = M429 modalgroup=10 ngc=site429
"""


def interpreted(program, folder, loaded=0, **options):
    """Return the canonical calls of the interpreter, [(name, arguments)], for a program as it is written.

    A tool that is `loaded` is in the spindle before the program begins.
    """
    files = GCode({"dialect": "linuxcnc", **options}).write(program)
    (folder / "tool.tbl").write_text("T1 P1 Z50 D6\nT3 P3 Z120.5 D6\n", "ascii")
    (folder / "all.var").write_text("", "ascii")
    (folder / "all.ini").write_text(INI.format(folder), "ascii")
    for file, content in files.items():
        (folder / file).write_bytes(content)
    main = folder / GCode({"dialect": "linuxcnc"}).main_file(files)
    if loaded:
        main.write_bytes(main.read_bytes().replace(b"%\n", b"%%\nT%d M6\n" % loaded, 1))
    command = ["rs274", "-g", "-v", folder / "all.var", "-t", folder / "tool.tbl"]
    for code in (428, 429):
        text = f"o<site{code}> sub\n(kinematics {code})\no<site{code}> endsub [1]\nM2\n"
        (folder / f"site{code}.ngc").write_text(text, "ascii")
    # The folder of the program is that of its subprograms, as it is set up on a machine.
    command += ["-i", folder / "all.ini", main]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "error" not in ran.stderr.lower(), ran.stderr
    calls = [match.groups() for line in ran.stdout.splitlines() if (match := CALL.match(line))]
    assert ("PROGRAM_END", "") in calls
    return calls


def moves_of(calls):
    """Return positions (n, 6) and feeds of canonical moves, lengths in mm; rapid moves have no feed."""
    unit, feed, positions, feeds = 1.0, 0.0, [], []
    for name, arguments in calls:
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCHES" in arguments else 1.0
        elif name == "SET_FEED_RATE":
            feed = float(arguments) * unit
        elif name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
            numbers = [float(number) for number in arguments.split(",")]
            positions.append([*(number * unit for number in numbers[:3]), *numbers[3:]])
            feeds.append(feed if name == "STRAIGHT_FEED" else np.nan)
    return np.array(positions), np.array(feeds)


def words_of(positions, letters):
    return [{letter: row["ABC".index(letter) + 3] for letter in letters} for row in positions.tolist()]


@pytest.mark.parametrize("units", ["mm", "inch"])
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("machine", ["head-ac", "table-bc", "nutating-table-bc"])
def test_canonical_moves_are_those_of_the_path(tmp_path, units, inverse, machine):
    program = simple_program()
    calls = interpreted(program, tmp_path, units=units, inverse_time=inverse, machine=machine)
    positions, feeds = moves_of(calls)
    path = program.path
    # The interpreter prints four decimals of whatever unit it runs in.
    assert np.abs(positions[:, :3] - path.tips_mm).max() < (1e-4 if units == "mm" else 3e-3)
    slant = (0.0, 0.5**0.5, 0.5**0.5)
    tilt, letter = {"head-ac": ((1, 0, 0), "A"), "table-bc": ((0, 1, 0), "B")}.get(machine, (slant, "B"))
    axes = axes_of_words([("C", (0, 0, 1)), (letter, tilt)], words_of(positions, f"C{letter}"))
    assert np.degrees(np.abs(axes - path.axes).max()) < 1e-3
    assert np.array_equal(np.isnan(feeds), path.rapid)
    assert np.allclose(feeds[~path.rapid], path.feeds_mm_min[~path.rapid], rtol=1e-4)


def test_spindle_tool_dwell_and_stop_reach_the_machine(tmp_path):
    names = [name for name, _ in interpreted(simple_program(), tmp_path, line_numbers=10)]
    wanted = ["SELECT_TOOL", "CHANGE_TOOL", "START_SPINDLE_CLOCKWISE", "STRAIGHT_TRAVERSE", "FLOOD_ON", "STRAIGHT_FEED"]
    wanted += ["DWELL", "PROGRAM_STOP", "FLOOD_OFF", "STOP_SPINDLE_TURNING", "PROGRAM_END"]
    first = [names.index(name, names.index("SELECT_TOOL")) for name in wanted if name != "STOP_SPINDLE_TURNING"]
    assert first == sorted(first) and names.count("STOP_SPINDLE_TURNING") >= 2


def test_the_tool_length_is_on_while_the_tool_moves(tmp_path):
    calls = interpreted(simple_program(), tmp_path)
    offsets = [float(a.split()[2].rstrip(",")) for name, a in calls if name == "USE_TOOL_LENGTH_OFFSET"]
    assert offsets[0] == 0.0 and offsets[1] > 0.0 and offsets[-1] == 0.0


@pytest.mark.parametrize(("loaded", "length"), [(0, 0.0), (1, 50.0), (3, 120.5)])
def test_without_a_number_the_length_is_that_of_the_tool_in_the_spindle(tmp_path, loaded, length):
    program = program_of(path_of(np.eye(3), leaning_axes(3), 600.0, np.arange(3) == 0))
    calls = interpreted(program, tmp_path, loaded=loaded)
    lengths = [float(a.split()[2].rstrip(",")) for name, a in calls if name == "USE_TOOL_LENGTH_OFFSET"]
    # The interpreter alone, without the settings of a machine, takes its tool table to be in inches.
    assert np.allclose(lengths, [25.4 * length, 0.0])


def test_nasty_text_is_a_comment_and_does_nothing(tmp_path):
    calls = interpreted(nasty_program(), tmp_path)
    assert not {"MESSAGE", "LOGAPPEND", "LOGOPEN"} & {name for name, _ in calls}
    assert sum('Hello "Robots"' in arguments for name, arguments in calls if name == "COMMENT") == 4
    positions, _ = moves_of(calls)
    assert np.allclose(positions[:, :3], nasty_program().path.tips_mm)


def test_without_tip_control_the_axes_bring_the_tip_to_its_place_in_its_time(tmp_path):
    file = tmp_path / "trunnion.toml"
    file.write_text(TRUNNION, "ascii")
    zero = np.array([100.0, 50.0, 20.0])
    program = simple_program()
    calls = interpreted(
        program, tmp_path, machine=str(file), tip_control="off", part_zero_mm="100,50,20", tip_tolerance_mm=0.002
    )
    positions, feeds = moves_of(calls)
    turn = words_of(positions, "CA")
    tips = tips_of_words(TABLE, turn, positions[:, :3], zero, 0.0)
    axes = axes_of_words(TABLE, turn)
    path = program.path
    # Every move of the path is met, in order, and all between lies on the straight line.
    distance = np.linalg.norm(tips[:, None] - path.tips_mm[None], axis=2)
    at = distance.argmin(axis=0)
    assert (np.diff(at) > 0).all() and distance.min(axis=0).max() < 5e-4
    assert np.degrees(np.abs(axes[at] - path.axes).max()) < 1e-3
    for move in range(1, len(path)):
        way = path.tips_mm[move] - path.tips_mm[move - 1]
        between = tips[at[move - 1] : at[move] + 1] - path.tips_mm[move - 1]
        assert np.linalg.norm(np.cross(between, way / np.linalg.norm(way)), axis=1).max() < 1e-3
        if path.rapid[move]:
            assert at[move] == at[move - 1] + 1
            continue
        moved = np.linalg.norm(np.diff(positions[at[move - 1] : at[move] + 1, :3], axis=0), axis=1)
        minutes = (moved / feeds[at[move - 1] + 1 : at[move] + 1]).sum()
        assert np.isclose(minutes, np.linalg.norm(way) / path.feeds_mm_min[move], rtol=1e-3)


def test_a_turn_without_motion_of_the_tip_has_a_feed_in_degrees(tmp_path):
    axes = leaning_axes(4, turn=np.radians(30.0))
    tips = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [10, 0, 0]], float)
    program = program_of(path_of(tips, axes, 600.0, [True, False, False, False]))
    for inverse in (False, True):
        for units in ("mm", "inch"):
            calls = interpreted(program, tmp_path, inverse_time=inverse, units=units, rotary_feed_deg_min=120)
            unit = 25.4 if units == "inch" else 1.0
            _, feeds = moves_of(calls)
            assert np.allclose(feeds[1:3] / unit, 120.0, rtol=1e-3) and np.isclose(feeds[3], 600.0, rtol=1e-3)


def test_subprograms_are_found_and_run(tmp_path):
    rapid = np.arange(60) % 10 == 0
    tips = np.column_stack([np.arange(60.0), np.zeros(60), np.zeros(60)])
    events = (Event(25, EventKind.COMMENT, 0.0, "half way"),)
    program = program_of(path_of(tips, leaning_axes(60), 600.0, rapid, events), name="Übung 5")
    calls = interpreted(program, tmp_path, max_moves_per_program=20)
    positions, _ = moves_of(calls)
    assert np.allclose(positions[:, :3], tips) and ("COMMENT", '"half way"') in calls


def test_the_words_of_the_site_switch_its_kinematics_around_the_moves(tmp_path):
    calls = interpreted(simple_program(), tmp_path, tcp_on="M428", tcp_off="M429")
    told = [a.strip('"') if name == "COMMENT" else name for name, a in calls]
    on, moves = told.index("kinematics 428"), [i for i, name in enumerate(told) if name.startswith("STRAIGHT")]
    assert told.index("CHANGE_TOOL") < on < moves[0] and told[moves[-1] :].count("kinematics 429") == 1
    assert np.allclose(moves_of(calls)[0][:, :3], simple_program().path.tips_mm, atol=1e-4)
