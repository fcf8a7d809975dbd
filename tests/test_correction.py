"""The correction in memory: which contours, which unit, and a registration that corrects any path."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from sicp_cam.correction import PartRegistration, check_units, choose_contours, contours_of, register
from sicp_cam.errors import InputError, JobError, PathError, RegistrationError, SicpError, UnitError
from sicp_cam.findings import Level
from sicp_cam.model import Contour, Part, Scan, Source, ToolPath, TriangleMesh
from sicp_cam.rigid_motion import apply, from_parts, rotate

SAG_MM = 3.0
POSE = from_parts(Rotation.from_rotvec([0.2, -0.1, 0.5]).as_matrix(), [300.0, -200.0, 150.0])


def square(side=400.0):
    half = 0.5 * side
    return TriangleMesh(
        [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]], [[0, 1, 2], [0, 2, 3]]
    )


def source(path, stated=False, unit="mm"):
    return Source(path, "PLY", "0" * 64, unit, stated)


def path_on(contour, *, rapid=(), every=2, beside_mm=0.0):
    inward = np.cross(contour.normals, contour.tangents)
    tips = (contour.points_mm - beside_mm * inward)[::every]
    n = len(tips)
    fast = np.zeros(n, dtype=bool)
    fast[list(rapid)] = True
    return ToolPath(tips, contour.normals[::every], np.where(fast, 0.0, 1200.0), fast, np.arange(n))


def sagging(u, w):
    return -SAG_MM * np.cos(np.pi * u / 300.0) * np.cos(np.pi * w / 300.0)


@pytest.fixture(scope="module")
def holes(synthetic):
    """Two openings far apart in one sheet, and both of its skins."""
    outlines = [synthetic.egg(60.0, centre=(-150.0, 0.0)), synthetic.egg(40.0, centre=(150.0, 0.0))]
    upper = [synthetic.contour(outline) for outline in outlines]
    lower = [
        Contour(c.points_mm[::-1] - [0.0, 0.0, 3.0], -c.tangents[::-1], -c.normals[::-1]) for c in upper
    ]  # fmt: skip
    return (*upper, *lower)


# ---- contours of a part ----


def test_exact_contours_have_precedence_over_those_of_the_mesh(holes):
    assert contours_of(Part(holes, square())) is holes


def test_a_mesh_gives_its_open_loops():
    (contour,) = contours_of(Part((), square()))
    assert contour.length_mm == pytest.approx(1600.0)


@pytest.mark.parametrize("named", [True, False])
def test_a_smooth_closed_mesh_has_nothing_to_follow(named):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=25.0)
    part = Part((), TriangleMesh(ball.vertices, ball.faces), source("ball.stl") if named else None)
    with pytest.raises(InputError, match="no open edge and no sharp one; give a STEP file") as caught:
        contours_of(part)
    assert str(caught.value).startswith("ball.stl: " if named else "part: ")


# ---- the choice ----


@pytest.mark.parametrize(("followed", "number"), [(0, 1), (1, 2), (2, 3), (3, 4)])
def test_the_path_chooses_the_contour_it_follows(holes, followed, number):
    chosen = choose_contours(holes, path_on(holes[followed], beside_mm=4.0), None, 20.0)
    assert list(chosen) == [number]
    assert chosen[number] is holes[followed]


def test_a_path_through_both_openings_chooses_both_the_most_cut_first(holes):
    there, back = path_on(holes[1], every=1), path_on(holes[0], every=4)
    both = ToolPath(*(np.concatenate([getattr(there, n), getattr(back, n)]) for n in _COLUMNS))
    assert list(choose_contours(holes, both, None, 20.0)) == [2, 1]


_COLUMNS = ("tips_mm", "axes", "feeds_mm_min", "rapid", "lines")


def test_a_small_opening_beside_a_large_one_is_not_left_out(holes):
    """10 moves round a small hole after 1000 round a large one: they would be moved by the rigid pose alone."""
    there, back = path_on(holes[0], every=1), path_on(holes[1], every=30)
    many = ToolPath(*(np.concatenate([getattr(there, n)] * 2 + [getattr(back, n)]) for n in _COLUMNS))
    assert 5 < len(back) < 0.02 * len(many)
    assert set(choose_contours(holes, many, None, 20.0)) == {1, 2}


def test_rapid_moves_choose_nothing(holes):
    there, away = path_on(holes[0]), path_on(holes[1], rapid=range(len(holes[1].points_mm) // 2 + 1))
    both = ToolPath(*(np.concatenate([getattr(there, n), getattr(away, n)]) for n in _COLUMNS))
    assert list(choose_contours(holes, both, None, 20.0)) == [1]


def test_numbers_of_the_operator_have_precedence_over_the_path(holes):
    chosen = choose_contours(holes, path_on(holes[1]), [4, 2], 20.0)
    assert list(chosen) == [4, 2]
    assert chosen[2] is holes[1]


def test_a_choice_that_leaves_cuts_without_their_contour_is_refused(holes):
    with pytest.raises(PathError, match=r"cuts along contour 1 too \(line \d+\).*add it: --contour 4,2,1"):
        choose_contours(holes, path_on(holes[0]), [4, 2], 20.0)


@pytest.mark.parametrize("number", [0, 5, -1])
def test_a_number_that_does_not_exist_is_a_job_error_that_says_which_do(holes, number):
    with pytest.raises(JobError, match=f"no contour {number}; it has 1 to 4"):
        choose_contours(holes, None, [1, number], 20.0)


def test_neither_path_nor_number_is_a_job_error(holes):
    with pytest.raises(JobError, match="give a path, or the numbers"):
        choose_contours(holes, None, None, 20.0)


def test_a_path_of_rapid_moves_only_has_nothing_to_correct(holes):
    tool_path = path_on(holes[0])
    tool_path = replace(tool_path, rapid=np.ones(len(tool_path), dtype=bool))
    with pytest.raises(PathError, match="rapid moves only"):
        choose_contours(holes, tool_path, None, 20.0)


@pytest.mark.parametrize(("shift", "refused"), [(15.0, False), (25.0, True)])
def test_a_path_away_from_every_contour_is_refused_with_its_distance(holes, shift, refused):
    tool_path = path_on(holes[0])
    tool_path = replace(tool_path, tips_mm=tool_path.tips_mm + np.array([0.0, 0.0, shift]))
    if not refused:
        assert list(choose_contours(holes, tool_path, None, 20.0)) == [1]
        return
    with pytest.raises(PathError, match=f"{shift:.1f} mm from the nearest contour") as caught:
        choose_contours(holes, tool_path, None, 20.0)
    assert "--path-units" in str(caught.value)


# ---- the unit of the scan ----


def whole_scan(factor, stated=False, half=200.0):
    grid = np.linspace(-half, half, 21)
    x, y = (a.ravel() for a in np.meshgrid(grid, grid))
    return Scan(np.stack([x, y, 0.0 * x], 1) * factor, source=source("scan.ply", stated))


def round_hole(synthetic):
    return {1: synthetic.contour(synthetic.circle(130.0), rings_mm=())}


@pytest.mark.parametrize("unit", ["cm", "m", "inch"])
def test_a_scan_in_another_unit_is_refused_and_the_unit_named(synthetic, unit):
    factor = {"cm": 0.1, "m": 0.001, "inch": 1 / 25.4}[unit]
    with pytest.raises(UnitError, match=f"seems to be in {unit}: give --scan-units {unit}") as caught:
        check_units(whole_scan(factor), Part((), square()), round_hole(synthetic))
    assert str(caught.value).startswith("scan.ply: ")


@pytest.mark.parametrize("factor", [0.1, 1 / 25.4, 0.001])
def test_a_scan_in_another_unit_is_refused_whatever_the_guess(synthetic, factor):
    with pytest.raises(
        UnitError, match=r"give --scan-units \w+( or --scan-units \w+)*, or --scan-units mm if it is not"
    ):
        check_units(whole_scan(factor), Part((), square()), round_hole(synthetic))


@pytest.mark.parametrize(
    "scan",
    [
        pytest.param(whole_scan(1.0), id="in millimetres"),
        pytest.param(whole_scan(0.001, stated=True), id="stated, so it is not guessed"),
        pytest.param(whole_scan(1.0, half=140.0), id="the opening and its surroundings only"),
        pytest.param(whole_scan(1.0, half=95.0), id="three quarters of the opening"),
        pytest.param(Scan(whole_scan(0.001).points_mm), id="from memory, in mm by contract"),
        pytest.param(whole_scan(30.0), id="a hall around the part"),
    ],
)
def test_a_scan_whose_unit_may_be_right_passes(synthetic, scan):
    noticed = check_units(scan, Part((), square()), round_hole(synthetic))
    assert all(finding.code == 409 for finding in noticed)


def test_a_unit_that_was_taken_is_told_with_the_sizes_that_speak_for_it(synthetic):
    part = Part((), square(), source("part.stl"))
    (of_part, of_scan) = check_units(whole_scan(1.0), part, round_hole(synthetic))
    assert (of_part.level, of_part.where) == (Level.WARN, "part.stl")
    assert of_part.message == (
        "the file states no unit, mm was taken: the part is 565.7 mm across; state it with --cad-units"
    )
    assert of_scan.message == (
        "the file states no unit, mm was taken: the scan is 565.7 mm across, the part 565.7 mm; state it with"
        " --scan-units"
    )
    stated = Part((), square(), source("part.stl", stated=True))
    assert check_units(whole_scan(1.0, stated=True), stated, round_hole(synthetic)) == ()


def test_a_unit_that_a_format_has_by_convention_is_doubted_too(synthetic):
    """A PTX file is taken for metres; one that an exporter wrote in millimetres is a thousand times too large."""
    scan = Scan(whole_scan(1000.0).points_mm, source=source("scan.ptx", unit="m"))
    with pytest.raises(UnitError, match="seems to be in mm: give --scan-units mm, or --scan-units m if it is not"):
        check_units(scan, Part((), square()), round_hole(synthetic))


# ---- registration ----


@pytest.fixture(scope="module")
def sagged(synthetic):
    """A part with one opening of unique shape, and its sagging scan in an unknown pose."""
    outline = synthetic.egg(90.0)
    sheet = synthetic.dome(900.0, 1500.0)
    bent = synthetic.bent(sheet, sagging)
    scan = synthetic.scan(synthetic.material([outline], spacing_mm=2.5, depth_mm=45.0), bent, noise_mm=0.03, pose=POSE)
    contour = synthetic.contour(outline, sheet)
    other = synthetic.contour(synthetic.oval(140.0, 60.0), sheet)
    other = Contour(other.points_mm + np.array([2000.0, 0.0, 0.0]), other.tangents, other.normals)
    true = synthetic.contour(outline, bent, rings_mm=())
    moved = Contour(apply(POSE, true.points_mm), rotate(POSE, true.tangents), rotate(POSE, true.normals))
    return Part((other, contour), square()), scan, moved


@pytest.fixture(scope="module")
def registration(sagged):
    part, scan, _ = sagged
    return register(part, scan, contours=[2], align=POSE)


def test_a_registration_corrects_a_path_to_the_bent_edge(sagged, registration):
    """The path is the nominal contour itself; sample by sample the truth is the same place of the bent sheet."""
    part, _, true = sagged
    tool_path = path_on(part.contours[1], every=1)
    done = registration.apply(tool_path)
    moved, turned = done.corrected.tips_mm[~done.added], done.corrected.axes[~done.added]
    offset = moved - true.points_mm
    across = offset - np.sum(offset * true.tangents, axis=1, keepdims=True) * true.tangents
    out = np.abs(np.sum(offset * true.normals, axis=1))
    assert np.linalg.norm(across, axis=1).mean() < 0.5
    assert out.mean() < 0.05
    assert np.degrees(np.arccos(np.clip(np.sum(turned * true.normals, axis=1), -1, 1))).mean() < 0.5
    rigid = done.rigid.tips_mm[~done.added] - true.points_mm
    assert np.abs(np.sum(rigid * true.normals, axis=1)).mean() > 4.0 * out.mean()


def test_the_start_is_found_where_none_is_given(sagged, registration):
    part, scan, _ = sagged
    found = register(part, scan, path=path_on(part.contours[1]))
    assert [contour.number for contour in found.result.contours] == [2]
    assert found.result.symmetry is not None
    np.testing.assert_allclose(found.result.T_scan_part, registration.result.T_scan_part, atol=0.05)


def test_numbers_and_path_choose_the_same(sagged, registration):
    part, scan, _ = sagged
    by_path = register(part, scan, path=path_on(part.contours[1]), align=POSE)
    np.testing.assert_array_equal(by_path.result.T_scan_part, registration.result.T_scan_part)
    np.testing.assert_array_equal(
        by_path.result.contours[0].corrected.points_mm, registration.result.contours[0].corrected.points_mm
    )


def test_the_settings_are_those_that_apply_uses(registration):
    assert isinstance(registration, PartRegistration)
    assert registration.toolpath.band_mm == 30.0
    assert registration.gates.path_distance_mm == 20.0


def test_the_assignment_tells_contour_and_distance(sagged, registration):
    _, assignment = registration.followed(path_on(sagged[0].contours[1], beside_mm=5.0))
    assert assignment.used == (0,)
    np.testing.assert_allclose(assignment.distance_mm, 5.0, atol=0.05)


def test_nothing_is_judged_by_apply(sagged, registration):
    away = path_on(sagged[0].contours[1])
    away = replace(away, tips_mm=away.tips_mm + np.array([0.0, 0.0, 500.0]))
    done = registration.apply(away)
    assert {status.value for status in done.status} == {"approach"}
    np.testing.assert_allclose(done.corrected.tips_mm, done.rigid.tips_mm, atol=1e-9)


def test_an_unknown_method_is_a_typed_error(sagged):
    part, scan, _ = sagged
    with pytest.raises(SicpError, match="sicp"):
        register(part, scan, contours=[2], align=POSE, method="best")


@pytest.mark.parametrize(
    "align", [np.diag([1.0, 1.0, -1.0, 1.0]), 25.4 * np.eye(4), np.full((4, 4), np.nan), np.eye(3)]
)
def test_a_start_that_is_no_rigid_motion_is_a_typed_error_about_the_start(sagged, align):
    part, scan, _ = sagged
    with pytest.raises(SicpError, match="rigid"):
        register(part, scan, contours=[2], align=align)


def test_a_scan_elsewhere_is_refused(sagged):
    part, scan, _ = sagged
    with pytest.raises(RegistrationError, match="--align"):
        register(part, Scan(scan.points_mm + 5000.0), contours=[2], align=POSE)


def test_a_scan_in_inches_is_refused_before_it_is_registered(sagged):
    part, scan, _ = sagged
    inches = Scan(scan.points_mm / 25.4, source=source("scan.ply"))
    with pytest.raises(UnitError):
        register(part, inches, contours=[2], align=POSE)
