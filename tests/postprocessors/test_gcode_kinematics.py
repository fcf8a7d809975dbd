"""Two rotary axes of any machine: forward and inverse kinematics, turns along a path, files of machines."""

import dataclasses

import numpy as np
import pytest
from gcode_reread import CHAINS, axes_of_words, tips_of_words
from post_programs import leaning_axes

from sicp_cam.errors import JobError
from sicp_postprocessors.gcode.along import angles_along, over_travel
from sicp_postprocessors.gcode.branches import best_changes, followed
from sicp_postprocessors.gcode.forward import axes_of, linear_positions, tips_of
from sicp_postprocessors.gcode.inverse import solve
from sicp_postprocessors.gcode.machines import load_machine, machine_from_text, machine_names

POLES = np.vstack([np.eye(3), -np.eye(3)])
MACHINES = [name for name in CHAINS if "nutating" not in name]
HEADS = ["head-ac", "head-bc"]


def directions(count, seed=1):
    """Random directions, and such as lie at the poles of every machine and just beside them."""
    rng = np.random.default_rng(seed)
    near = POLES[rng.integers(0, 6, count)] + rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-14, -1, (count, 1))
    axes = np.vstack([rng.normal(size=(count, 3)), near, POLES])
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def words(machine, deg):
    letters = [axis.letter for axis in machine.rotaries]
    return [dict(zip(letters, row, strict=True)) for row in deg.tolist()]


def still(axes):
    return np.zeros(len(axes), bool)


def error_deg(axes, others):
    return np.degrees(2 * np.arcsin(np.minimum(np.linalg.norm(axes - others, axis=1) / 2, 1))).max()


def test_all_machines_of_the_package_are_tested():
    assert set(machine_names()) == set(CHAINS)


class TestInverse:
    @pytest.mark.parametrize("name", CHAINS)
    def test_both_solutions_bring_the_tool_to_the_direction(self, name):
        machine, axes = load_machine(name), directions(4000)
        found = solve(machine, axes)
        reached = found.beyond_deg == 0.0
        assert reached.all() or (name.startswith("nutating") and np.array_equal(reached, axes[:, 2] > -1e-16))
        for branch in (0, 1):
            deg = np.column_stack([found.first_deg[branch], found.second_deg[branch]])[reached]
            assert np.abs(axes_of(machine, deg) - axes[reached]).max() < 1e-12
            assert np.abs(axes_of_words(CHAINS[name], words(machine, deg)) - axes[reached]).max() < 1e-9

    def test_known_angles(self):
        axes = np.array([[0.0, -0.5, np.sqrt(0.75)], [0.5, 0.0, np.sqrt(0.75)]])
        ac, bc = solve(load_machine("head-ac"), axes), solve(load_machine("head-bc"), axes)
        assert np.allclose(ac.second_deg[0], 30) and np.allclose(ac.first_deg[0], [0, 90])
        assert np.allclose(bc.second_deg[0], 30) and np.allclose(bc.first_deg[0] % 360, [270, 0])
        assert np.allclose(ac.second_deg[1], -30) and np.allclose(ac.first_deg[1] % 360, [180, 270])

    def test_half_a_turn_of_a_nutating_axis_lays_the_tool_level(self):
        level = solve(load_machine("nutating-head-bc"), np.array([[0.0, 1.0, 0.0], [0.6, 0.0, -0.8]]))
        assert np.allclose(np.abs(level.second_deg[:, 0]), 180.0) and np.allclose(level.beyond_deg[0], 0.0)
        assert np.isclose(level.beyond_deg[1], np.degrees(np.arcsin(0.8)))

    def test_a_table_of_the_other_sense_turns_the_other_way(self):
        machine = load_machine("table-ac")
        other = dataclasses.replace(
            machine, rotaries=tuple(dataclasses.replace(axis, sense="table") for axis in machine.rotaries)
        )
        axes = directions(200)
        found, back = solve(machine, axes), solve(other, axes)
        for branch in (0, 1):
            deg = -np.column_stack([back.first_deg[branch], back.second_deg[branch]])
            assert np.abs(axes_of(machine, deg) - axes).max() < 1e-12
            assert np.abs(axes_of(other, -deg) - axes).max() < 1e-12
        assert not np.allclose(found.first_deg, back.first_deg)

    def test_axes_in_any_direction(self):
        rng = np.random.default_rng(5)
        for _ in range(50):
            first, second, home = rng.normal(size=(3, 3)) + np.diag([3, 3, 3])
            text = f"""
                name = "askew"
                home_axis = {home.tolist()}
                [[rotary]]
                letter = "C"
                on = "table"
                direction = {first.tolist()}
                [[rotary]]
                letter = "A"
                on = "head"
                direction = {second.tolist()}
            """
            machine = machine_from_text(text, "askew.toml")
            axes = directions(100, seed=6)
            found = solve(machine, axes)
            reached = found.beyond_deg == 0.0
            assert reached.any()
            for branch in (0, 1):
                deg = np.column_stack([found.first_deg[branch], found.second_deg[branch]])[reached]
                assert np.abs(axes_of(machine, deg) - axes[reached]).max() < 1e-11


POINTS = {
    "head-head": [("C", (0, 0, 1), (3.0, -2.0, 250.0), "head"), ("A", (1, 0, 0), (0.0, 5.0, 180.0), "head")],
    "head-table": [("C", (0, 0, 1), (10.0, 20.0, -30.0), "table"), ("B", (0, 1, 0), (0.0, 0.0, 140.0), "head")],
    "table-table": [("C", (0, 0, 1), (10.0, 20.0, -30.0), "table"), ("A", (1, 0, 0), (0.0, 20.0, -75.0), "table")],
}


class TestLinear:
    @staticmethod
    def machine(kind):
        text = 'name = "m"\n'
        for letter, direction, point, on in POINTS[kind]:
            text += f'[[rotary]]\nletter = "{letter}"\non = "{on}"\ndirection = {list(direction)}\n'
            text += f"point_mm = {list(point)}\n"
        return machine_from_text(text, "m.toml")

    @pytest.mark.parametrize("kind", POINTS)
    def test_the_linear_axes_bring_the_tip_to_its_place(self, kind):
        rng = np.random.default_rng(3)
        machine, zero = self.machine(kind), np.array([100.0, -50.0, 20.0])
        assert machine.kind == kind and machine.has_geometry
        tips, deg = rng.uniform(-300, 300, (500, 3)), rng.uniform(-720, 720, (500, 2))
        linear = linear_positions(machine, deg, tips, 120.0, zero)
        assert np.abs(tips_of(machine, deg, linear, 120.0, zero) - tips).max() < 1e-9
        again = tips_of_words(POINTS[kind], words(machine, deg), linear, zero, 120.0)
        assert np.abs(again - tips).max() < 1e-9

    @pytest.mark.parametrize("kind", POINTS)
    def test_at_zero_the_words_are_the_tip(self, kind):
        tips = np.array([[1.0, 2.0, 3.0]])
        linear = linear_positions(self.machine(kind), np.zeros((1, 2)), tips, 120.0, np.array([7.0, 8.0, 9.0]))
        assert np.allclose(linear, tips)

    def test_a_fork_head_swings_its_pivot_over_the_tip(self):
        machine = machine_from_text(
            'name = "fork"\n[[rotary]]\nletter = "C"\non = "head"\ndirection = [0, 0, 1]\npoint_mm = [0, 0, 0]\n'
            '[[rotary]]\nletter = "B"\non = "head"\ndirection = [0, 1, 0]\npivot_mm = 200\n',
            "fork.toml",
        )
        linear = linear_positions(machine, np.array([[0.0, 90.0]]), np.zeros((1, 3)), 100.0, np.zeros(3))
        # Level along +X: the pivot stands 300 mm beside the tip instead of above it.
        assert np.allclose(linear, [[300.0, 0.0, -300.0]])

    def test_without_points_there_are_no_positions(self):
        with pytest.raises(ValueError, match="no point for its axis"):
            linear_positions(load_machine("table-ac"), np.zeros((1, 2)), np.zeros((1, 3)), 0.0, np.zeros(3))


class TestAlong:
    @pytest.mark.parametrize("name", MACHINES)
    def test_any_path_is_followed(self, name):
        machine, axes = load_machine(name), directions(1500, seed=2)
        angles = angles_along(machine, axes, still(axes), 1e-3)
        assert error_deg(axes_of(machine, angles.deg), axes) <= 1e-3
        assert not over_travel(machine.rotaries[1], angles.deg[:, 1]).any()

    @pytest.mark.parametrize("name", ["head-bc", "mixed-bc", "table-bc", "nutating-table-bc"])
    def test_turns_run_on_through_half_a_turn(self, name):
        axes = leaning_axes(200, turn=6 * np.pi)
        angles = angles_along(load_machine(name), axes, still(axes), 1e-3)
        assert np.abs(np.diff(angles.deg, axis=0)).max() < 6.0
        assert np.isclose(angles.deg[-1, 0] - angles.deg[0, 0], 1080.0)

    def test_no_error_grows_over_many_turns(self):
        axes = leaning_axes(100_000, turn=2000.0)
        machine = load_machine("head-ac").limited((-1e7, 1e7), None, None)
        angles = angles_along(machine, axes, still(axes), 1e-3)
        assert np.abs(axes_of(machine, angles.deg) - axes).max() < 1e-11

    def test_through_the_pole_the_head_tilts_on_without_turning(self):
        lean = np.radians(np.linspace(20, -20, 41))
        axes = np.column_stack([np.sin(lean), np.zeros(41), np.cos(lean)])
        angles = angles_along(load_machine("head-bc"), axes, still(axes), 1e-3)
        assert np.allclose(angles.deg[:, 0], 0.0) and np.allclose(angles.deg[:, 1], np.degrees(lean))
        assert angles.held.sum() == 1

    @pytest.mark.parametrize("name", HEADS)
    def test_at_the_pole_the_turn_is_held_and_the_tool_within_the_cone(self, name):
        axes = leaning_axes(400, lean=1e-4, turn=40.0)
        machine = load_machine(name)
        angles = angles_along(machine, axes, still(axes), 0.01)
        assert angles.held.all() and np.ptp(angles.deg[:, 0]) == 0.0
        assert error_deg(axes_of(machine, angles.deg), axes) <= 0.01

    def test_moves_at_the_pole_take_the_turn_that_follows(self):
        axes = np.vstack([[[0.0, 0.0, 1.0]] * 3, leaning_axes(2, turn=0.0)])
        assert np.allclose(angles_along(load_machine("head-ac"), axes, still(axes), 1e-3).deg[:, 0], 90.0)

    def test_a_rapid_move_to_the_pole_turns_to_where_the_cut_goes_on(self):
        axes = np.vstack([leaning_axes(2, turn=0.0), [[0.0, 0.0, 1.0]], [[-0.3, 0.0, 0.954]], [[-0.4, 0.0, 0.917]]])
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        up = np.array([0.0, 0.3, 0.954]) / np.linalg.norm([0.0, 0.3, 0.954])
        axes[3:] = up
        rapid = np.array([True, False, True, False, False])
        deg = angles_along(load_machine("head-bc"), axes, rapid, 1e-3).deg
        assert np.allclose(deg[:2, 0], 0.0) and np.ptp(deg[2:, 0]) == 0.0 and np.isclose(abs(deg[2, 0]), 90.0)

    @pytest.mark.parametrize("lean", [-1e-9, 0.0, 1e-9])
    @pytest.mark.parametrize("name", HEADS)
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_an_axis_that_turns_round_between_the_poles_is_followed(self, name, lean, sign):
        axes = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [lean, 0.0, 1.0], [0.0, 1.0, 0.0], [lean, lean, -1.0]])
        axes[1:, 2] *= sign
        machine = load_machine(name)
        angles = angles_along(machine, axes, still(axes), 1e-3)
        assert error_deg(axes_of(machine, angles.deg), axes) < 1e-3
        assert np.abs(angles.deg[:, 1]).max() <= 180.0 + 1e-6

    def test_the_whole_path_is_wound_into_the_travel(self):
        axes = leaning_axes(500, turn=np.radians(600.0))
        machine = load_machine("head-bc").limited((-400.0, 300.0), None, None)
        deg = angles_along(machine, axes, still(axes), 1e-3).deg
        assert not over_travel(machine.rotaries[0], deg[:, 0]).any() and np.isclose(np.ptp(deg[:, 0]), 600.0)

    def test_rapid_moves_turn_back_where_the_travel_ends(self):
        axes = leaning_axes(3000, turn=36.0)
        rapid = np.arange(3000) % 500 == 0
        machine = load_machine("head-ac").limited((-360.0, 360.0), None, None)
        deg = angles_along(machine, axes, rapid, 1e-3).deg
        assert not over_travel(machine.rotaries[0], deg[:, 0]).any()
        assert np.abs(np.diff(deg, axis=0))[~rapid[1:]].max() < 1.0
        assert error_deg(axes_of(machine, deg), axes) < 1e-6

    def test_a_cut_is_never_turned_back(self):
        axes = leaning_axes(3000, turn=36.0)
        machine = load_machine("head-ac").limited((-360.0, 360.0), None, None)
        deg = angles_along(machine, axes, still(axes), 1e-3).deg
        assert np.abs(np.diff(deg, axis=0)).max() < 1.0 and over_travel(machine.rotaries[0], deg[:, 0]).any()

    def test_the_solution_that_the_travel_allows_is_taken(self):
        axes = leaning_axes(50, turn=0.5)
        machine = load_machine("head-ac").limited(None, (-60.0, 5.0), None)
        angles = angles_along(machine, axes, still(axes), 1e-3)
        assert np.allclose(angles.deg[:, 1], -np.degrees(np.arctan(0.3))) and not angles.forced.any()
        assert error_deg(axes_of(machine, angles.deg), axes) < 1e-6

    def test_a_travel_that_makes_the_head_turn_over_within_a_cut_is_told(self):
        axes = leaning_axes(300, turn=3.0)
        machine = load_machine("head-bc").limited((-100.0, 100.0), None, None)
        angles = angles_along(machine, axes, still(axes), 1e-3)
        assert angles.forced.sum() == 1 and not over_travel(machine.rotaries[0], angles.deg[:, 0]).any()

    def test_the_whole_way_counts_and_not_the_next_step(self):
        # A bruteforce search over all choices of the two solutions finds no shorter way.
        rng = np.random.default_rng(4)
        for _ in range(40):
            way, price = rng.uniform(0, 10, (2, 2, 6)), rng.choice([0.0, 3.0], (2, 7))
            changes, lengths = best_changes(way, price)
            for start in (0, 1):
                chosen = followed(changes, start, np.zeros(0, np.int64)).tolist()
                every = [[start, *(code >> i & 1 for i in range(6))] for code in range(64)]
                cost = [
                    sum(way[c[i], c[i + 1], i] for i in range(6)) + sum(price[c[i], i] for i in range(7)) for c in every
                ]
                assert np.isclose(cost[every.index(chosen)], min(cost)) and np.isclose(lengths[start], min(cost))


class TestMachineFiles:
    GOOD = 'name = "m"\n[[rotary]]\nletter = "C"\non = "table"\ndirection = [0, 0, 2]\n'
    AXIS = '[[rotary]]\nletter = "A"\non = "table"\ndirection = [1, 0, 0]\n'

    def test_directions_may_have_any_length(self):
        assert machine_from_text(self.GOOD + self.AXIS, "m.toml").rotaries[0].direction == (0.0, 0.0, 1.0)

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("name = 3\n", "name must be a text"),
            ("x y\n", "line 1"),
            (GOOD, "rotary must be two tables"),
            (GOOD + AXIS.replace('"A"', '"C"'), "both axes are called C"),
            (GOOD + AXIS.replace('"A"', '"U"'), "rotary 2: letter must be one of A, B, C"),
            (GOOD + AXIS.replace("[1, 0, 0]", "[0, 0, 1]"), "its axes are parallel"),
            (GOOD + AXIS.replace("[1, 0, 0]", "[0, 0, 0]"), "rotary 2: direction has no length"),
            (GOOD + AXIS.replace("[1, 0, 0]", "[1, nan, 0]"), "rotary 2: direction must be three numbers"),
            (AXIS + GOOD.replace('name = "m"\n', ""), "name must be a text"),
            (GOOD.replace('"table"', '"head"') + AXIS, "the table is first, then the head"),
            (GOOD + AXIS.replace('"table"', '"head"') + 'sense = "table"\n', "A is on a head"),
            (GOOD + AXIS + "limits_deg = [5, 5]\n", "rotary 2: limits_deg must be a lower and a higher number"),
            (GOOD + AXIS + "speed = 5\n", "rotary 2: speed is not known here"),
            (GOOD + AXIS + "pivot_mm = 5\n", "rotary 2: pivot_mm is a number for a head"),
            (GOOD + AXIS + 'wrap = "360"\n', "rotary 2: wrap must be one of none, 0..360, +-180"),
            (GOOD + AXIS + "[linear_limits_mm]\nX = [0, 1]\n", "linear_limits_mm must state X, Y and Z"),
        ],
    )  # fmt: skip
    def test_problems_are_told_with_their_place(self, text, told):
        with pytest.raises(JobError) as caught:
            machine_from_text(text, "m.toml")
        assert told in str(caught.value) and "machine file m.toml" in str(caught.value)

    def test_files_that_cannot_be_read(self, tmp_path):
        with pytest.raises(JobError, match="machine 'x' is not known; known are head-ab"):
            load_machine("x")
        with pytest.raises(JobError, match="cannot be read: No such file"):
            load_machine(str(tmp_path / "none.toml"))
        wrong = tmp_path / "wrong.toml"
        wrong.write_bytes(b"name = '\xff'")
        with pytest.raises(JobError, match="byte 8: it is not UTF-8"):
            load_machine(str(wrong))
        wrong.write_bytes(b"#" * 70_000)
        with pytest.raises(JobError, match="has more than 65536 bytes"):
            load_machine(str(wrong))
