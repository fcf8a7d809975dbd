"""KRL, RAPID, Fanuc listings, URScript and RoboDK's table, judged by readers of their own."""

import dataclasses
import re

import numpy as np
import pytest
from post_programs import NASTY, leaning_axes, path_of, program_of, simple_program, straight_program
from post_reread import axis_error_deg
from post_reread_robots import pose, read_krl, read_ls, read_rapid, read_robodk, read_ur
from scipy.spatial.transform import Rotation

from sicp_cam.checking.reading_back import read_back
from sicp_cam.errors import JobError, PathError
from sicp_cam.findings import Level
from sicp_cam.model import Event, EventKind
from sicp_cam.rigid_motion import exponential
from sicp_postprocessors.fanuc_ls import FanucLs
from sicp_postprocessors.krl import Krl
from sicp_postprocessors.orientations import euler_zyx, pose_from_six, quaternions, rotation_vectors
from sicp_postprocessors.rapid import Rapid
from sicp_postprocessors.robodk_csv import RoboDkCsv
from sicp_postprocessors.urscript import UrScript

POSE = exponential(np.array([0.1, -0.2, 0.3, 100.0, -50.0, 25.0]), np.zeros(3))
CELL, TOOL = (500.0, -20.0, 200.0, 5.0, -10.0, 90.0), (1.0, 2.0, 150.0, 0.0, 30.0, 0.0)
GIVEN = {"cell": CELL, "tool": TOOL}
READ = {
    "krl": lambda files: read_krl(files, next(iter(files)).split(".")[0]),
    "rapid": read_rapid,
    "ls": lambda files: read_ls(files, next(iter(files)).split(".")[0]),
    "ur": lambda files: read_ur(files, next(iter(files)).split(".")[0]),
    "robodk": read_robodk,
}
CONTROLLERS = [Krl, Rapid, FanucLs, UrScript]
LIMITED = pytest.mark.parametrize("post", [Krl, Rapid, FanucLs], ids=lambda post: post.name)
EACH = pytest.mark.parametrize("post", CONTROLLERS, ids=lambda post: post.name)
ALL = pytest.mark.parametrize("post", [*CONTROLLERS, RoboDkCsv], ids=lambda post: post.name)
OUTPUTS = {"krl": ("3", "4"), "rapid": ("doSpindle", "doCool"), "ls": ("3", "RO4"), "ur": ("3", "tool_1")}


def with_outputs(post, **more):
    spindle, coolant = OUTPUTS[post.name]
    return post({"spindle_output": spindle, "coolant_output": coolant, **GIVEN, **more})


def run(post, program):
    return READ[post.name](post.write(program))


def codes(post, program):
    return [f.code for f in post.preflight(program)]


def rotations_apart_deg(one, other):
    return np.degrees(Rotation.from_matrix(np.swapaxes(one, 1, 2) @ other).magnitude())


# --- turns ---


def random_rotations(count=10_000):
    """Random turns, a third of them at or near the places where the angles about z and x cannot be told apart."""
    generator = np.random.default_rng(5)
    third = count // 3
    angles = generator.uniform(-180.0, 180.0, (third, 3))
    near = 10.0 ** generator.uniform(-14.0, 0.0, third)
    angles[:, 1] = np.where(np.arange(third) % 3 == 0, 0.0, near)
    angles[:, 1] = np.where(np.arange(third) % 2 == 0, 90.0 - angles[:, 1], angles[:, 1] - 90.0)
    gimbal = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    return np.concatenate([Rotation.random(count - third, rng=generator).as_matrix(), gimbal])


def test_turns_in_every_notation_are_the_same_turn():
    R = random_rotations()
    again = {
        "A B C": Rotation.from_euler("ZYX", euler_zyx(R).round(4), degrees=True),
        "quaternion": Rotation.from_quat(np.roll(quaternions(R).round(6), -1, axis=1)),
        "rotation vector": Rotation.from_rotvec(rotation_vectors(R).round(6)),
    }
    for notation, turns in again.items():
        assert rotations_apart_deg(R, turns.as_matrix()).max() <= 1e-3, notation


def test_turns_do_not_jump_from_one_row_to_the_next():
    turn = np.linspace(0.0, 4.0 * np.pi, 721)
    R = Rotation.from_rotvec(turn[:, None] * np.array([0.6, 0.0, 0.8])).as_matrix()
    assert np.linalg.norm(np.diff(quaternions(R), axis=0), axis=1).max() < 0.02
    inside = np.linalg.norm(rotation_vectors(R), axis=1) < 2.0 * np.pi - 0.1
    steps = np.linalg.norm(np.diff(rotation_vectors(R), axis=0), axis=1)
    assert steps[inside[1:] & inside[:-1]].max() < 0.02
    tilt = Rotation.from_euler("ZYX", [[30.0, b, 0.0] for b in (89.0, 90.0, 91.0)], degrees=True).as_matrix()
    assert np.allclose(euler_zyx(tilt[:2])[:, 0], 30.0)


VECTORS = {
    "krl": ("A 0.00000,B 0.00000,C 180.00000}", "A 0.00000,B -90.00000,C 0.00000}", "A 0.00000,B 0.00000,C 135.00000}"),
    "rapid": (
        "[0.0000000,1.0000000,0.0000000,0.0000000]",
        "[0.7071068,0.0000000,-0.7071068,0.0000000]",
        "[0.3826834,0.9238795,0.0000000,0.0000000]",
    ),
    "ls": (
        "W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg",
        "W = 0.0000 deg,    P = -90.0000 deg,    R = 0.0000 deg",
        "W = 135.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg",
    ),
    "ur": ("3.1415927, 0.0000000, 0.0000000]", "0.0000000, -1.5707963, 0.0000000]", "2.3561945, 0.0000000, 0.0000000]"),
    "robodk": (",180.00000,0.00000,0.00000,", ",0.00000,-90.00000,0.00000,", ",135.00000,0.00000,0.00000,"),
}


@ALL
def test_orientations_are_written_as_the_controller_means_them(post):
    """By hand: the tool's Z lies against the axis from tip to holder, which is up, along X, and between Y and up."""
    for axis, words in zip([[0, 0, 1], [1, 0, 0], [0, 0.5**0.5, 0.5**0.5]], VECTORS[post.name], strict=True):
        files = post().write(program_of(path_of([[1, 2, 3], [2, 2, 3]], [axis] * 2, 100.0)))
        assert sum(content.decode().count(words) for content in files.values()) == 2


def random_poses(count):
    """Tips along X with all digits, and tool axes in all directions, many of them along the axes of the frame."""
    generator = np.random.default_rng(7)
    axes = generator.normal(size=(count, 3))
    axes[::40] = [0, 0, 1]
    axes[1::80], axes[41::80] = [1, 0, 0], [-1, 0, 0]
    axes[2::40, 1:] *= 1e-9
    axes[3::40] = [0, 1, 0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    tips = generator.uniform(-0.2, 0.2, (count, 3))
    tips[:, 0] += np.linspace(-2000.0, 2000.0, count)
    return program_of(path_of(tips, axes, 1200.0, np.arange(count) % 500 == 0))


@ALL
def test_ten_thousand_poses_are_read_back_by_a_reader_of_its_own(post):
    program = random_poses(10_000)
    made = post({"spin": "transport", "spin_deg": 33.0})
    again = READ[post.name](made.files(program))
    assert np.abs(np.array(again.tips) - program.path.tips_mm).max() <= 1e-3
    assert axis_error_deg(np.array(again.axes), program.path.axes) <= 1e-3
    if post is not RoboDkCsv:
        assert rotations_apart_deg(np.array(again.rotations), made.rotations(program.path)).max() <= 1e-3


@ALL
def test_poses_are_read_back_by_the_readers_of_the_product(post):
    program = random_poses(1000)
    facts = read_back(post(), program, post().write(program)).facts
    assert facts["count"] == 1000 and facts["largest_difference_mm"] <= 1e-3


# --- what happens along the path ---


@EACH
def test_moves_speeds_and_events_in_their_order(post):
    made = with_outputs(post)
    again = run(made, simple_program())
    assert np.abs(np.array(again.tips) - simple_program().path.tips_mm).max() <= 1e-3
    assert np.allclose(again.feeds[1:], [2000, 2000, 900, 900, 15_000], rtol=1e-4)
    quiet = ("comment", "message", "InPos")
    done = [kind for kind, value in again.actions if kind not in quiet and (kind, value) != ("wait", 0.0)]
    moves = {"krl": ("PTP", "LIN"), "rapid": ("MoveJ", "MoveL"), "ls": ("J", "L"), "ur": ("movej", "movel")}[post.name]
    first, straight = moves
    assert done == [
        *("output", "wait", first, "output", straight, straight, "wait", straight, "stop", straight, straight),
        *("output", "output"),
    ]
    remarks = [value for kind, value in again.actions if kind == "comment"]
    assert "first side" in remarks and "tool 3 LOADTL/3" in remarks
    assert any("spindle 12000 rev/min clockwise" in " ".join(remarks[i : i + 2]) for i in range(len(remarks)))


@EACH
def test_what_still_runs_at_the_end_is_switched_off(post):
    program = straight_program(4, events=(Event(1, EventKind.SPINDLE, 9000.0), Event(1, EventKind.COOLANT, 1.0)))
    again = run(with_outputs(post), program)
    outputs = [value for kind, value in again.actions if kind == "output"]
    assert len(outputs) == 4
    assert [value[-1] in (False, "OFF", 0.0) for value in outputs] == [False, False, True, True]


@EACH
def test_a_word_of_the_path_switches_an_output(post):
    program = straight_program(4, spacing=20.0, events=(Event(2, EventKind.OTHER, 0.0, "AUXFUN/ 50"),))
    _, signal = OUTPUTS[post.name]
    made = post({"outputs": f"auxfun/50={signal}:on"})
    again = run(made, program)
    assert [kind for kind, _ in again.actions if kind == "output"] == ["output"]
    assert (np.array(again.zones) > 0.0).tolist() == [False, False, True, False]
    assert (np.array(run(post(), program).zones) > 0.0).tolist() == [False, True, True, False]
    assert 610 not in codes(made, program) and 610 in codes(post(), program)


@EACH
def test_the_spindle_speed_goes_to_an_analog_output(post):
    output, scale, words = {
        "krl": ("2", "0.00005", "$ANOUT[2]=0.6"),
        "rapid": ("aoSpindle", "0.0005", "SetAO aoSpindle,6;"),
        "ls": ("GO2", "1", "GO[2]=12000"),
        "ur": ("1", "0.00005", "set_standard_analog_out(1, 0.6)"),
    }[post.name]
    speed = {"spindle_speed": "aio", "spindle_speed_output": output, "spindle_speed_scale": scale}
    made = with_outputs(post, **speed)
    run(made, simple_program())
    assert words in b"".join(made.write(simple_program()).values()).decode()
    assert 634 not in codes(made, simple_program()) and 634 in codes(post(), simple_program())


@EACH
def test_a_tool_change_stops_the_spindle_and_waits(post):
    events = (
        Event(0, EventKind.TOOL, 1.0, "T1"),
        Event(1, EventKind.SPINDLE, 9000.0),
        Event(3, EventKind.TOOL, 2.0, "T2"),
        Event(3, EventKind.SPINDLE, 5000.0),
    )
    again = run(with_outputs(post), straight_program(6, events=events))
    done = [kind for kind, _ in again.actions if kind in ("output", "stop")]
    assert done == ["output", "output", "stop", "output", "output"]


def test_tools_have_frames_of_their_own_where_the_language_names_them():
    events = (Event(0, EventKind.TOOL, 1.0, "T1"), Event(3, EventKind.TOOL, 2.0, "T2"))
    program = straight_program(6, events=events)
    krl, rapid = Krl(GIVEN).write(program), Rapid(GIVEN).write(program)
    assert krl["porthole.dat"].count(b"DECL FRAME PART_TOOL_") == 2
    assert krl["porthole.src"].count(b"$TOOL=PART_TOOL_2") == 1
    assert rapid["porthole.mod"].count(b",tTool1\\WObj") == rapid["porthole.mod"].count(b",tTool2\\WObj") == 3


@EACH
def test_a_tool_after_the_last_move_is_declared_too(post):
    run(post(GIVEN), straight_program(3, events=(Event(3, EventKind.TOOL, 7.0, "T7"),)))


# --- frames, tools, zones, speeds ---


@EACH
def test_tool_and_frame_are_those_of_the_options(post):
    more = {"frame_register": "7"} if post is FanucLs else {}
    again = run(post({**GIVEN, **more}), simple_program(T_scan_program=POSE))
    assert np.allclose(again.frame, pose_from_six(CELL) @ POSE, atol=1e-4)
    assert np.allclose(again.tool, pose_from_six(TOOL), atol=1e-4)


OWN = {
    "krl": lambda x: pose(x[:3], Rotation.from_euler("ZYX", x[3:], degrees=True).as_matrix()),
    "rapid": lambda x: pose(x[:3], Rotation.from_euler("ZYX", x[3:], degrees=True).as_matrix()),
    "ls": lambda x: pose(x[:3], Rotation.from_euler("xyz", x[3:], degrees=True).as_matrix()),
    "ur": lambda x: pose(x[:3], Rotation.from_rotvec(x[3:]).as_matrix()),
}


@EACH
def test_poses_may_be_given_as_the_controller_shows_them(post):
    cell, tool = (10.0, 20.0, 30.0, 0.3, -0.7, 1.1), (1.0, 2.0, 3.0, 0.2, 0.1, -0.4)
    more = {"frame_register": "7"} if post is FanucLs else {}
    again = run(post({"cell": cell, "tool": tool, "pose_angles": "own", **more}), simple_program())
    assert np.allclose(again.frame, OWN[post.name](cell), atol=1e-5)
    assert np.allclose(again.tool, OWN[post.name](tool), atol=1e-5)


def test_the_points_of_a_script_may_all_be_in_the_base():
    program = simple_program(T_scan_program=POSE)
    again = run(UrScript({**GIVEN, "points": "base"}), program)
    world = pose_from_six(CELL) @ POSE
    assert np.allclose(again.tips, program.path.tips_mm @ world[:3, :3].T + world[:3, 3], atol=1e-3)
    assert axis_error_deg(np.array(again.axes), program.path.axes @ world[:3, :3].T) < 1e-3
    back = read_back(UrScript({"points": "base"}), program, UrScript({"points": "base"}).write(program))
    assert back.facts is None and "in the base" in back.findings[0].message


@pytest.mark.parametrize(
    ("post", "options"),
    [(Krl, {"base_number": 3}), (Rapid, {"wobj_name": "wFix"}), (UrScript, {"feature": "Plane_1"}), (FanucLs, {})],
    ids=lambda value: getattr(value, "name", ""),
)
def test_a_frame_of_the_controller_is_the_scan_frame(post, options):
    made = post(options)
    text = b"".join(made.write(simple_program()).values()).decode()
    assert "which must be the" in text
    assert 631 not in codes(made, simple_program())
    with pytest.raises(PathError, match="the controller has the scan frame only: run with --frame scan"):
        made.write(simple_program(T_scan_program=POSE))


def test_tool_and_frame_of_the_controller_are_named():
    files = Krl({"tool_number": 4, "base_number": 3}).write(simple_program())
    assert b"BAS (#TOOL,4)" in files["porthole.src"] and b"BAS (#BASE,3)" in files["porthole.src"]
    assert b"FRAME" not in files["porthole.dat"]
    module = Rapid({"tool_name": "tSpindle", "wobj_name": "wFix"}).write(simple_program())["porthole.mod"]
    assert b",tSpindle\\WObj:=wFix;" in module and b"tooldata" not in module and b"wobjdata" not in module
    script = UrScript({"installation_tcp": True, "feature": "Plane_1"}).write(simple_program())["porthole.script"]
    assert b"pose_trans(Plane_1, p[" in script and b"set_tcp" not in script
    listing = FanucLs({"utool": 4, "uframe": 3, "payload_schedule": 2}).write(simple_program())["PORTHOLE.ls"]
    assert b"UF : 3, UT : 4," in listing and b"PAYLOAD[2]" in listing
    for post, options in (
        (Krl, {"tool_number": 4}),
        (Rapid, {"tool_name": "t"}),
        (UrScript, {"installation_tcp": 1 > 0}),
    ):
        assert not {630, 670} & set(codes(post(options), simple_program()))


def test_the_payload_is_stated():
    options = {"payload": "1.5,1,2,60"}
    assert b"DECL LOAD PART_LOAD={M 1.5,CM {X 1,Y 2,Z 60,A 0,B 0,C 0}," in b"".join(
        Krl(options).write(simple_program()).values()
    )
    assert b",[1.5,[1,2,60],[1,0,0,0],0,0,0]]" in b"".join(Rapid(options).write(simple_program()).values())
    assert run(UrScript(options), simple_program()).settings["payload"] == "1.5, [0.001, 0.002, 0.06]"
    for post in CONTROLLERS:
        assert 670 in codes(post(), simple_program())


@EACH
def test_zones_stay_within_half_of_the_shorter_way(post):
    generator = np.random.default_rng(3)
    tips = np.cumsum(generator.uniform(0.002, 3.0, (300, 3)) * generator.choice([0.01, 1.0], (300, 1)), axis=0)
    program = program_of(path_of(tips, leaning_axes(300), 1200.0, np.arange(300) % 60 == 0))
    options = {"rounding": "CD", "blend_mm": "50", "blend_corner_mm": "50"} if post is FanucLs else {"blend_mm": "0.8"}
    again = run(post(options), program)
    zones, steps = np.array(again.zones), np.linalg.norm(np.diff(tips, axis=0), axis=1)
    shorter = np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))
    assert (zones <= shorter / 2.0 + 1e-6).all() and (zones > 0.0).sum() > 5
    assert (zones[program.path.rapid] == 0.0).all() and zones[-1] == 0.0
    assert (np.array(run(post({"first_run": True}), program).zones) == 0.0).all()
    assert max(run(post({"first_run": True}), program).feeds) <= 3000.0


@LIMITED
def test_a_speed_that_the_language_does_not_take_is_refused(post):
    with pytest.raises(PathError, match=r"move 1, line 11: the speed is beyond the [0-9]+ mm/s"):
        post().write(straight_program(4, feed=[0, 480_000, 600, 600]))
    with pytest.raises(PathError, match="rapid_mm_s="):
        post({"rapid_mm_s": "9000"}).write(straight_program(4))


def test_listings_round_speeds_to_whole_numbers_that_are_never_faster():
    program = straight_program(7, feed=[0, 600, 2000, 1234, 37, 15, 120_000])
    made = FanucLs()
    assert run(made, program).feeds[1:] == [600, 2000, 1230, 30, 10, 120_000]
    told = [(f.code, f.where) for f in made.preflight(program) if f.code == 674]
    assert told == [(674, "moves 4 to 5, lines 14 to 15")]
    with pytest.raises(PathError, match="moves 4 to 5, lines 14 to 15: the speed is below 1 cm/min or 1 mm/sec"):
        FanucLs({"speed_unit": "mm/sec"}).write(program)
    assert run(FanucLs({"speed_unit": "mm/sec"}), straight_program(3, feed=[0, 2000, 1234])).feeds[1:] == [1980, 1200]


def test_listings_wait_long_in_pieces():
    again = run(FanucLs(), straight_program(3, events=(Event(1, EventKind.DWELL, 700.0),)))
    assert [value for kind, value in again.actions if kind == "wait"] == [300, 300, 100]


def test_the_first_point_may_have_a_configuration():
    assert (
        run(Krl({"status": 6, "turn": 27}), simple_program()).settings | {"S": 6.0, "T": 27.0}
        == run(Krl({"status": 6, "turn": 27}), simple_program()).settings
    )
    again = run(Rapid({"configuration": "0,-1,0,1"}), simple_program())
    assert again.settings["MoveJ"] == [0, -1, 0, 1] and again.settings["ConfJ"] == "ConfJ \\On;"
    assert run(FanucLs({"configuration": "F U T, 0, -1, 0"}), simple_program()).settings["CONFIG"] == "F U T, 0, -1, 0"


def test_many_different_speeds_are_written_into_the_moves():
    feeds = 600.0 + np.arange(150)
    feeds[0] = 0
    made = Rapid()
    again = run(made, straight_program(150, feed=feeds))
    assert np.allclose(again.feeds[1:], feeds[1:], atol=0.01)
    assert b"vCut0" not in b"".join(made.write(straight_program(150, feed=feeds)).values())


# --- parts, names, self-test ---


PARTS = [
    (Krl, {"split": "files"}),
    (Krl, {"split": "subprograms"}),
    (Rapid, {"split": "procedures"}),
    (Rapid, {"split": "modules"}),
    (FanucLs, {}),
    (FanucLs, {"longest_name": 8}),
    (UrScript, {}),
]


@pytest.mark.parametrize(("post", "options"), PARTS, ids=lambda value: getattr(value, "name", str(value)))
def test_long_paths_are_divided_at_retracts_and_do_the_same(post, options):
    rapid = np.arange(60) % 10 == 0
    events = (
        Event(0, EventKind.SPINDLE, 9000.0),
        Event(20, EventKind.COMMENT, 0.0, "second"),
        Event(60, EventKind.STOP),
    )
    program = program_of(
        path_of(np.cumsum(np.ones((60, 3)), axis=0), leaning_axes(60), 900.0, rapid, events, name="x"),
        name="trim of a door",
    )
    whole, divided = with_outputs(post), with_outputs(post, max_moves_per_program="20", **options)
    one, other = run(whole, program), run(divided, program)
    assert np.array_equal(one.tips, other.tips) and np.array_equal(one.zones, other.zones)
    quiet = ("comment", "message")
    assert [a for a in one.actions if a[0] not in quiet] == [a for a in other.actions if a[0] not in quiet]
    files = divided.write(program)
    text = b"".join(files.values()).decode()
    stem = re.escape(divided.program_name(program)[:5])
    assert len(set(re.findall(rf"\b({stem}\w*00[1-9])p?\b", text))) == 3
    assert read_back(divided, program, files).facts["count"] == 60


@pytest.mark.parametrize("split", ["procedures", "modules"])
def test_modules_may_have_the_suffix_of_newer_controllers(split):
    made = Rapid({"module_suffix": "modx", "split": split, "max_moves_per_program": 3, "split_cuts": True})
    files = made.write(simple_program())
    assert {file.rsplit(".", 1)[1] for file in files} == ({"modx"} if split == "procedures" else {"modx", "pgf"})
    assert read_back(made, simple_program(), files).facts["count"] == 6


@EACH
def test_a_cut_is_divided_only_where_that_is_asked_for(post):
    program = straight_program(30)
    assert 653 in codes(post({"max_moves_per_program": 10}), program)
    made = post({"max_moves_per_program": 10, "split_cuts": True})
    assert 653 not in codes(made, program)
    assert run(made, program).zones[9] == run(made, program).zones[19]


@EACH
@pytest.mark.parametrize("name", ["main", "end", "2nd tür_a", NASTY, "x" * 100, "MOVEL", "for", "return", "😀"])
def test_names_are_those_of_the_language(post, name):
    program = dataclasses.replace(simple_program(), name=name)
    made = post({"max_moves_per_program": 3, "self_test": "start"})
    files = made.write(program)
    stems = {file.rsplit(".", 1)[0] for file in files}
    longest = made.longest_name
    assert all(re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{longest - 1}}}", stem) for stem in stems)
    assert not {stem.lower() for stem in stems} & made.reserved
    assert len({stem.lower() for stem in stems}) == len(stems)
    READ[post.name](files) if post is not Rapid else read_rapid({k: v for k, v in files.items() if "_test" not in k})
    assert read_back(made, program, files).facts["count"] == 6


@EACH
@pytest.mark.parametrize("where", ["origin", "start"])
def test_the_self_test_shows_frame_and_tool(post, where):
    more = {"frame_register": "7"} if post is FanucLs else {}
    program = simple_program(T_scan_program=POSE)
    made = post({"self_test": where, "self_test_step_mm": 40, **GIVEN, **more})
    files = made.write(program)
    tested = {name: content for name, content in files.items() if "_test" in name.lower()}
    assert set(files) - set(tested) == set(post({**GIVEN, **more}).write(program))
    again = READ[post.name](tested)
    axes, upright = np.array(again.axes), np.array([0, 0, 1]) if where == "origin" else program.path.axes[0]
    begin = np.zeros(3) if where == "origin" else program.path.tips_mm[0]
    steps = np.array(again.tips) - begin - 40.0 * upright
    assert np.allclose(steps[[0, 2, 4, 5, 6, 7, 8]], 0.0, atol=1e-3)
    # Square to the tool, so that no step goes towards the part.
    assert np.allclose(np.linalg.norm(steps[[1, 3]], axis=1), 40.0, atol=1e-3)
    assert np.allclose(steps @ upright, 0.0, atol=1e-3) and steps[1, 0] > 30.0 and steps[3, 1] > 30.0
    assert np.allclose(axes[[0, 1, 2, 3, 4, 6, 8]], upright, atol=1e-6)
    assert np.degrees(np.arccos(axes[[5, 7]] @ upright)) == pytest.approx([15.0, 15.0], abs=1e-3)
    assert axes[5, 0] > upright[0] + 0.1 and axes[7, 1] > upright[1] + 0.1
    assert [kind for kind, _ in again.actions].count("stop") == 10
    kinds = [kind for kind, _ in again.actions if kind in ("stop", "PTP", "MoveJ", "J", "movej")]
    assert kinds[0] == "stop"
    assert max(again.feeds) <= 3000 and np.allclose(again.frame, pose_from_six(CELL) @ POSE, atol=1e-4)
    assert np.allclose(again.tool, pose_from_six(TOOL), atol=1e-4)
    text = b"".join(tested.values()).decode()
    assert "not a safety function" in text and "self-test: manual mode" in text


@pytest.mark.parametrize("axis", [[-1.0, 0, 0], [0, 1, 0], [0, 0, -1], [0.6, 0, 0.8]])
def test_the_self_test_never_steps_towards_the_part(axis):
    path = path_of([[0, 0, 0], [10, 0, 0]], [axis] * 2, [0, 600], [True, False])
    again = run_test(Krl(GIVEN | {"self_test": "start", "status": 2, "turn": 35}), program_of(path))
    assert np.allclose(np.array(again.tips) @ axis, 50.0, atol=1e-3)
    assert np.degrees(np.arccos(np.array(again.axes) @ axis)).max() == pytest.approx(15.0, abs=1e-3)


def test_the_self_test_is_judged_like_a_program():
    program, box = simple_program(), {"work_box_mm": "-600,-600,-600,600,600,600"}
    near = {"tool": TOOL, "cell": "0,0,0,0,0,0"}
    assert not [f for f in Krl(near | box).preflight(program) if f.level is Level.FAIL]
    made = Krl(near | box | {"self_test": "origin", "self_test_step_mm": 500})
    assert not [f for f in made.preflight(program) if f.level is Level.FAIL]
    narrow = {"work_box_mm": "50,-600,-600,600,600,600"}
    (failed,) = [f for f in Krl(near | narrow | {"self_test": "origin"}).preflight(program) if f.level is Level.FAIL][
        :1
    ]
    assert failed.message.startswith("self-test: ")


def run_test(made, program):
    files = made.write(program)
    return READ[made.name]({name: content for name, content in files.items() if "_test" in name.lower()})


@EACH
def test_an_analog_spindle_is_stopped_for_a_change_and_at_the_end(post):
    output = {"krl": "1", "rapid": "aoSpindle", "ls": "1", "ur": "0"}[post.name]
    scale = 0.05 if post is FanucLs else 0.00005  # a listing's analog values are whole numbers
    analog = GIVEN | {"spindle_speed": "aio", "spindle_speed_output": output, "spindle_speed_scale": scale}
    events = (
        Event(0, EventKind.SPINDLE, 9000.0),
        Event(2, EventKind.TOOL, 2.0, "drill"),
        Event(2, EventKind.SPINDLE, 5000.0),
    )
    program = straight_program(5, events=events)
    text = b"".join(post(analog).write(program).values()).decode()
    words = {"krl": r"\$ANOUT\[1\]=", "rapid": "SetAO aoSpindle,", "ls": r"AO\[1\]=", "ur": r"_out\(0, "}[post.name]
    values = [float(value) for value in re.findall(words + r"([0-9.]+)", text)]
    assert values == [9000 * scale, 0.0, 5000 * scale, 0.0]
    assert 632 not in codes(post(analog), program)
    assert (675 in codes(post(analog | {"spindle_speed_scale": 0.0005}), program)) is (post.name in ("krl", "ur"))


@EACH
def test_coolant_is_off_while_a_tool_is_changed_by_hand(post):
    events = (Event(0, EventKind.COOLANT, 1.0), Event(2, EventKind.TOOL, 2.0, "drill"))
    again = run(with_outputs(post), straight_program(5, events=events))
    done = [kind for kind, _ in again.actions if kind in ("output", "stop")]
    assert done == ["output", "output", "stop", "output", "output"]
    switched = [value for kind, value in again.actions if kind == "output"]
    assert switched[0] == switched[2] != switched[1] == switched[3]


@EACH
def test_feeds_that_would_be_rounded_to_nothing_are_refused(post):
    assert 673 in codes(post(GIVEN), straight_program(4, feed=[0, 0.03, 600, 600]))
    assert 673 not in codes(post(GIVEN), straight_program(4, feed=[0, 60.0, 600, 600]))


# --- what is told, and what is refused ---


def test_frames_of_a_listing_must_be_on_the_controller_or_are_set():
    told = FanucLs(GIVEN)
    assert 671 in codes(told, simple_program())
    head = told.write(simple_program())["PORTHOLE.ls"].decode()
    remarks = " ".join(re.findall(r"\d+:  !(.*) ;", head))
    assert "UFRAME[1] X=500 Y=-20 Z=200 W=0" not in remarks  # the angles are W, P, R and not those of the option
    assert "UTOOL[1] X=1 Y=2 Z=150 W=0 P=30 R=0" in remarks
    assert 671 not in codes(FanucLs({**GIVEN, "frame_register": 7}), simple_program())


def test_listings_say_that_cnt_does_not_keep_a_distance():
    program = straight_program(9, spacing=5.0)
    assert 672 in codes(FanucLs(), program)
    assert 672 not in codes(FanucLs({"rounding": "CD"}), program)
    assert 672 not in codes(FanucLs({"blend": False}), program)


@pytest.mark.parametrize(
    ("post", "options", "words"),
    [
        (Krl, {"spindle_output": "doSpindle"}, r"'spindle_output' must be the number n of \$OUT\[n\]"),
        (Rapid, {"coolant_output": "3"}, "'coolant_output' must be the name of a digital output, not '3'"),
        (FanucLs, {"outputs": "M50=DI3:on"}, "'outputs' must be the number of a digital output"),
        (UrScript, {"spindle_output": "standard_9"}, "such as 3, standard_3"),
        (Krl, {"status": 2}, "'status' and 'turn' belong together"),
        (Krl, {"tool_number": 2, "tool": "0,0,0,0,0,0"}, "'tool_number' and 'tool' say the same thing twice"),
        (Krl, {"base_number": 2, "cell": "0,0,0,0,0,0"}, "'base_number' and 'cell' say the same thing twice"),
        (Rapid, {"wobj_name": "w", "cell": "0,0,0,0,0,0"}, "'wobj_name' and 'cell'"),
        (Rapid, {"tool_name": "9x"}, "'tool_name' must be a name"),
        (Rapid, {"configuration": "0,0,0"}, "must be cf1,cf4,cf6,cfx"),
        (UrScript, {"feature": "a b"}, "'feature' must be a name"),
        (UrScript, {"feature": "a", "points": "base"}, "needs the cell in numbers"),
        (FanucLs, {"configuration": "NUT"}, "must look like N U T"),
        (FanucLs, {"frame_register": 3}, "give 'tool', 'cell'"),
        (FanucLs, {"payload": "1,0,0,0"}, "payload_schedule"),
        (Rapid, {"payload": "0,0,0,0"}, "a mass from above 0 to 1000 kg"),
        (Krl, {"spindle_speed": "aio"}, "belong together; give both"),
        (Krl, {"spindle_speed": "aio", "spindle_speed_output": "40"}, r"the number n of \$ANOUT"),
        (Krl, {"spindle_speed": "aio", "spindle_speed_output": "4"}, "needs the value for one rev/min"),
    ],
)
def test_options_that_do_not_fit_are_refused(post, options, words):
    with pytest.raises(JobError, match=words):
        post(options)


@EACH
def test_a_counter_clockwise_spindle_needs_an_output(post):
    program = straight_program(3, events=(Event(1, EventKind.SPINDLE, -500.0),))
    with pytest.raises(PathError, match=f"--set post.{post.name}.spindle_ccw_output="):
        with_outputs(post).write(program)


def test_comments_open_no_fold_and_end_no_statement():
    remarks = (Event(1, EventKind.COMMENT, 0.0, "FOLD x;%{PE}"), Event(1, EventKind.COMMENT, 0.0, "a; b; c"))
    program = straight_program(3, events=remarks)
    krl = Krl().write(program)["porthole.src"].decode()
    assert krl.upper().count(";FOLD") == 1 and krl.count("%{") == 1
    again = run(FanucLs(), program)
    assert "a, b, c" in [value for kind, value in again.actions if kind == "comment"]


def test_messages_hold_nothing_that_ends_a_text():
    program = straight_program(3, events=(Event(1, EventKind.STOP, 0.0, NASTY),))
    for post in CONTROLLERS:
        again = run(post(GIVEN), program)
        assert [kind for kind, _ in again.actions].count("stop") == 1
        assert post().preflight(program)[0].level is not Level.FAIL


def test_a_table_for_robodk_says_in_its_first_row_what_it_is():
    files = RoboDkCsv().write(simple_program(overridden=("gate, x",)))
    rows = files["porthole_robodk.csv"].decode().splitlines()
    assert rows[0].endswith(",porthole / corrected by sicp_cam / gates: all passed / gate x / not a safety function: "
                            "verify at reduced speed")  # fmt: skip
    assert rows[1].endswith(",1,33.33333,0,") and rows[0].count(",") == rows[1].count(",") == 9


def test_a_listing_names_in_its_head_the_gates_that_were_overridden():
    again = run(FanucLs(), simple_program(overridden=("gate jump_mm; 0.75, limit 0.5", "gate halves")))
    head = " ".join(value for kind, value in again.actions[:20] if kind == "comment")
    assert head.index("gate jump_mm, 0.75, limit 0.5") < head.index("gate halves") < head.index("not a safety function")


def test_a_configuration_that_nobody_gave_is_told():
    assert 676 in codes(FanucLs(), straight_program(3))
    assert 676 not in codes(FanucLs({"configuration": "F U T, 0, 0, 0"}), straight_program(3))


@pytest.mark.parametrize(("post", "name"), [(UrScript, "sin"), (UrScript, "force"), (Krl, "sqrt")])
def test_names_of_functions_are_not_taken(post, name):
    assert post().program_name(dataclasses.replace(straight_program(3), name=name)) == f"P{name}"
