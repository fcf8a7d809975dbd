import pytest

from sicp_cam.errors import InputError, JobError
from sicp_cam.roles import role_of


def made(tmp_path, name, text):
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    return file


POINTS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
MOVES = "x,y,z,i,j,k\n0,0,0,0,0,1\n5,0,0,0,0,1\n"


def test_what_the_suffix_tells_needs_no_look_into_the_file(tmp_path):
    assert role_of(made(tmp_path, "a.step", "?")) == "part"
    assert role_of(made(tmp_path, "a.nc", "?")) == "path"


def test_a_mesh_counts_as_a_scan_unless_that_makes_no_sense(tmp_path):
    mesh = made(tmp_path, "a.stl", "?")
    assert role_of(mesh) == "scan"
    assert role_of(mesh, among=("part",)) == "part"


def test_a_table_is_a_path_where_it_states_axes(tmp_path):
    assert role_of(made(tmp_path, "a.csv", MOVES)) == "path"
    assert role_of(made(tmp_path, "b.csv", "x,y,z\n0,0,0\n1,0,0\n0,1,0\n")) == "scan"
    assert role_of(made(tmp_path, "b.txt", POINTS)) == "scan"


def test_normals_and_tool_axes_are_not_told_apart_by_a_guess(tmp_path):
    table = made(tmp_path, "a.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n9,0,0,0,0,1\n0,9,0,0,0,1\n")
    with pytest.raises(JobError, match="a scan with normals or a path with tool axes; say which with --role"):
        role_of(table)


def test_a_program_in_a_text_file_is_a_path(tmp_path):
    assert role_of(made(tmp_path, "a.txt", "UNITS/MM\nGOTO/0,0,0\nGOTO/1,0,0,0,0,1\nFINI\n")) == "path"


def test_what_neither_can_read_is_what_it_was_for_longer(tmp_path):
    assert role_of(made(tmp_path, "a.txt", "UNITS/MM\nGOTO/0,0,0\nGOTO/1,0\nFINI\n")) == "path"
    assert role_of(made(tmp_path, "b.txt", POINTS + "0 0\n")) == "scan"


def test_what_cannot_be_is_refused(tmp_path):
    with pytest.raises(JobError, match="is read as a part, and that cannot become a path"):
        role_of(made(tmp_path, "a.step", "?"), among=("path",))
    with pytest.raises(InputError, match="no such file"):
        role_of(tmp_path / "none.ply")
    with pytest.raises(InputError, match="nothing reads this suffix"):
        role_of(made(tmp_path, "a.mp4", "?"))
