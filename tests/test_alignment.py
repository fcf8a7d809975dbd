"""Start poses from text files: matrices and datum pairs, and what is wrong with bad ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sicp_cam.alignment import read_alignment
from sicp_cam.errors import FormatError, InputError
from sicp_cam.rigid_motion import apply, from_parts, is_rigid

POSE = from_parts(Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(), [1004.324478, -859.650084, 347.967501])
PART = np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 10.0], [480.0, 300.0, -20.0], [10.0, 310.0, 5.0]])
HEADER = "x,y,z,X,Y,Z\n"


@pytest.fixture
def file(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "pose.txt"
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return path

    return write


def rows(matrix, separator=" ", form="%.9f"):
    return "".join(separator.join(form % value for value in row) + "\n" for row in matrix)


def pairs(part, scan, separator=","):
    return rows(np.hstack([part, scan]), separator)


# ---- matrices ----


@pytest.mark.parametrize("separator", [" ", "   ", "\t", ",", ", ", ";", " ; "])
def test_a_matrix_with_any_separator(file, separator):
    found = read_alignment(file(rows(POSE, separator)))
    np.testing.assert_allclose(found.T_scan_part, POSE, atol=1e-8)
    assert len(found.residuals_mm) == 0


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_comments_blank_lines_and_the_line_endings_of_every_system(file, ending, encoding):
    lines = rows(POSE).splitlines()
    text = ["# T_scan_part, mm", "", f"  {lines[0]}   # first row", lines[1], "   ", "#", lines[2], lines[3], ""]
    np.testing.assert_allclose(read_alignment(file(ending.join(text), encoding)).T_scan_part, POSE, atol=1e-8)


def test_numbers_as_people_and_programs_write_them(file):
    text = "1 0. -0 +1.5e2\n0 .1e1 0 -2E+1\n0 0 1.0 30\n0 0 0 1\n"
    np.testing.assert_array_equal(read_alignment(file(text)).T_scan_part, from_parts(np.eye(3), [150.0, -20.0, 30.0]))


def test_a_header_line_above_a_matrix(file):
    np.testing.assert_allclose(read_alignment(file("r1 r2 r3 t\n" + rows(POSE))).T_scan_part, POSE, atol=1e-8)


@pytest.mark.parametrize("digits", [3, 4, 6])
def test_a_matrix_typed_with_few_digits_becomes_exactly_rigid(file, digits):
    T = read_alignment(file(rows(POSE, form=f"%.{digits}f"))).T_scan_part
    assert is_rigid(T, 1e-12)
    np.testing.assert_allclose(T[:3, :3], POSE[:3, :3], atol=2.0 * 10.0**-digits)
    np.testing.assert_allclose(T[:3, 3], POSE[:3, 3], atol=0.51 * 10.0**-digits)


def bad_matrices():
    scaled, mirrored, sheared, last_row, transposed = (POSE.copy() for _ in range(5))
    scaled[:3, :3] *= 1.01
    mirrored[:3, 0] *= -1.0
    sheared[0, 1] += 0.01
    last_row[3] = [0.0, 0.0, 0.01, 1.0]
    transposed = transposed.T
    inches = POSE.copy()
    inches[:3, :3] *= 25.4
    zero = np.zeros((4, 4))
    names = ("scaled", "mirrored", "sheared", "last_row", "transposed", "inches", "zero")
    return [
        pytest.param(matrix, id=name)
        for name, matrix in zip(names, (scaled, mirrored, sheared, last_row, transposed, inches, zero), strict=True)
    ]


@pytest.mark.parametrize("matrix", bad_matrices())
def test_a_matrix_that_is_no_rigid_motion_is_refused(file, matrix):
    path = file(rows(matrix))
    with pytest.raises(FormatError, match="no rigid motion") as caught:
        read_alignment(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_matrix_that_is_no_rigid_motion_is_refused_with_its_line(file):
    with pytest.raises(FormatError) as caught:
        read_alignment(file("# a pose\n" + rows(np.diag([1.0, 1.0, -1.0, 1.0]))))
    assert ", line 2: " in str(caught.value)


# ---- datum pairs ----


@pytest.mark.parametrize("header", ["", HEADER, "# part, then scan\n", "\ufeffx;y;z;X;Y;Z\n"])
@pytest.mark.parametrize("count", [3, 4])
def test_datum_pairs_give_the_pose(file, header, count):
    found = read_alignment(file(header + pairs(PART[:count], apply(POSE, PART[:count]))))
    np.testing.assert_allclose(found.T_scan_part, POSE, atol=1e-6)
    assert found.residuals_mm.shape == (count,)
    assert found.residuals_mm.max() < 1e-6


def test_the_residual_of_each_pair_is_told(file):
    scan = apply(POSE, PART)
    scan[2] += [0.0, 0.0, 2.0]
    found = read_alignment(file(HEADER + pairs(PART, scan)))
    assert is_rigid(found.T_scan_part, 1e-9)
    assert 0.2 < found.residuals_mm.max() < 2.0
    # The least squares pose leaves no net shift, and no pair is off by more than the error that was put in.
    left = scan - apply(found.T_scan_part, PART)
    np.testing.assert_allclose(left.sum(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(left, axis=1), found.residuals_mm, atol=1e-6)


@pytest.mark.parametrize(
    "part",
    [
        pytest.param(np.outer([0.0, 100.0, 350.0], [1.0, 2.0, -1.0]), id="on one line"),
        pytest.param(np.outer([0.0, 100.0, 350.0], [1.0, 2.0, -1.0]) + 1e5, id="on a line far off"),
        pytest.param(np.tile([5.0, 6.0, 7.0], (3, 1)), id="all the same"),
        pytest.param(np.array([[0.0, 0, 0], [0.0, 0, 0], [100.0, 0, 0]]), id="two the same"),
        pytest.param(np.array([[0.0, 0, 0], [1000.0, 0, 0], [500.0, 0.5, 0]]), id="nearly on one line"),
    ],
)
def test_datum_points_on_one_line_do_not_settle_a_pose(file, part):
    path = file(HEADER + pairs(part, apply(POSE, part)))
    with pytest.raises(FormatError, match="on one line") as caught:
        read_alignment(path)
    assert str(caught.value).startswith(str(path))


def test_datum_points_on_one_line_in_the_scan_do_not_settle_a_pose(file):
    scan = apply(POSE, np.outer([0.0, 100.0, 350.0], [1.0, 2.0, -1.0]))
    with pytest.raises(InputError, match="line"):
        read_alignment(file(HEADER + pairs(PART[:3], scan)))


def misfits():
    solid = PART + np.outer([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 250.0])
    return [
        pytest.param(PART, apply(POSE, PART) / 25.4, id="the scan in inches"),
        pytest.param(PART, apply(POSE, PART) / 1000.0, id="the scan in metres"),
        pytest.param(PART, apply(POSE, PART)[[1, 0, 2, 3]], id="two pairs swapped"),
        pytest.param(solid, apply(POSE, solid * [1.0, -1.0, 1.0]), id="mirrored"),
    ]


@pytest.mark.parametrize(("part", "scan"), misfits())
def test_datum_pairs_that_no_rigid_motion_brings_together_are_refused(file, part, scan):
    """Misfits of 90 to 290 mm on datums 580 mm apart: no start for a robot path."""
    with pytest.raises(InputError):
        read_alignment(file(HEADER + pairs(part, scan)))


# ---- neither ----


@pytest.mark.parametrize(
    ("text", "line"),
    [
        pytest.param("", 1, id="empty"),
        pytest.param("# nothing but a comment\n\n", 1, id="comments only"),
        pytest.param("hello\nthis is a text\n", 1, id="text"),
        pytest.param(rows(POSE[:3]), 1, id="three rows of a matrix"),
        pytest.param(rows(np.vstack([POSE, POSE[:1]])), 1, id="five rows"),
        pytest.param("# pose\n" + rows(POSE[:, :3]), 2, id="three columns"),
        pytest.param(HEADER + pairs(PART[:2], PART[:2]), 2, id="two pairs"),
        pytest.param(rows(POSE, form="%.4f").replace(".", ","), 1, id="decimal commas"),
        pytest.param(rows(np.eye(4)[:2]) + pairs(PART[:2], PART[:2]), 1, id="both"),
    ],
)
def test_what_is_neither_is_refused_with_its_line(file, text, line):
    path = file(text)
    with pytest.raises(FormatError) as caught:
        read_alignment(path)
    assert str(caught.value).startswith(f"{path}, line {line}: ")
    assert "4x4" in str(caught.value) and "x,y,z,X,Y,Z" in str(caught.value)


@pytest.mark.parametrize("word", ["abc", "1_0", "0x10", "nan", "inf", "-inf", "1.2.3", "1e", "--1", "1,5mm"])
def test_a_word_that_is_no_number_is_named_with_its_line(file, word):
    path = file("# pose\n\n1 0 0 0\n0 1 0 0\n0 0 1 " + word + "\n0 0 0 1\n")
    with pytest.raises(FormatError) as caught:
        read_alignment(path)
    assert str(caught.value).startswith(f"{path}, line 5: ")
    assert word in str(caught.value)


@pytest.mark.parametrize("word", ["\u0661", "\uff11", "1\u0660.5"])
def test_digits_of_other_scripts_are_no_numbers(file, word):
    path = file(f"1 0 0 {word}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    with pytest.raises(FormatError) as caught:
        read_alignment(path)
    assert ", line 1: " in str(caught.value)


def test_a_number_too_large_to_hold_is_refused(file):
    path = file("1 0 0 0\n0 1 0 1e400\n0 0 1 0\n0 0 0 1\n")
    with pytest.raises(FormatError, match="not finite") as caught:
        read_alignment(path)
    assert str(caught.value).startswith(str(path))


def test_a_number_too_large_to_hold_is_refused_with_its_line(file):
    with pytest.raises(FormatError) as caught:
        read_alignment(file("1 0 0 0\n0 1 0 1e400\n0 0 1 0\n0 0 0 1\n"))
    assert ", line 2: " in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"\xff\xfe1\x00 \x000\x00", b"\x00" * 100, b"ply\nformat binary\n" + bytes(range(256))]
)
def test_bytes_that_are_no_text_are_refused_on_one_printable_line(file, content):
    path = file(content)
    with pytest.raises(FormatError) as caught:
        read_alignment(path)
    assert str(caught.value).startswith(str(path))
    assert str(caught.value).isprintable()


def test_a_file_far_too_large_is_refused_before_it_is_read(file):
    with pytest.raises(FormatError, match="larger than 1 MiB"):
        read_alignment(file(b"1 0 0 0\n" * 200_000))


def test_a_missing_file_and_a_folder_are_told(tmp_path):
    for path in (tmp_path / "none.txt", tmp_path):
        with pytest.raises(InputError, match="cannot be read") as caught:
            read_alignment(path)
        assert str(path) in str(caught.value)
