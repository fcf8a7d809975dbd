import numpy as np
import pytest
from post_programs import path_of, simple_program, straight_program
from post_reread import axis_error_deg, read_csv

from sicp_cam.errors import PathError
from sicp_cam.findings import Level
from sicp_cam.model import Program, Status
from sicp_postprocessors.gcode import GCode
from sicp_postprocessors.path_csv import PathCsv
from sicp_postprocessors.val3 import Val3


def test_table_reads_back():
    program = simple_program()
    result, rows = read_csv(PathCsv().write(program))
    assert np.abs(np.array(result.tips) - program.path.tips_mm).max() <= 0.5e-4 + 1e-12
    assert axis_error_deg(np.array(result.axes), program.path.axes) < 1e-4
    assert result.feeds == program.path.feeds_mm_min.tolist()
    assert result.rapid == program.path.rapid.tolist()
    assert {row["status"] for row in rows} == {"covered"}


def test_form_of_the_table():
    path = path_of([[1, -2.00004, 3]], [[0, 0, 1]], 1200.0)
    columns = {"uncertainty_mm": np.array([0.0125]), "arc": np.array([7])}
    files = PathCsv().write(Program("part 7", path, (Status.BRIDGED,), columns=columns))
    assert files == {
        "part 7.csv": b"x,y,z,i,j,k,feed,rapid,status,uncertainty_mm,arc\n"
        b"1.0000,-2.0000,3.0000,0.0000000,0.0000000,1.0000000,1200.0000,0,bridged,0.012500,7.000000\n"
    }


def test_more_rows_than_a_chunk_keep_their_order():
    program = straight_program(10_001)
    result, _ = read_csv(PathCsv().write(program))
    assert np.array_equal(np.array(result.tips), program.path.tips_mm)


def test_a_missing_feed_is_a_warning_only():
    post, program = PathCsv(), straight_program(3, feed=0.0)
    assert [f.level for f in post.preflight(program) if f.code == 603] == [Level.WARN]
    assert post.write(program)


def test_what_a_table_cannot_hold_is_told():
    pose = np.eye(4)
    pose[0, 3] = 5.0
    codes = [f.code for f in PathCsv().preflight(simple_program(T_scan_program=pose))]
    assert codes == [610, 612]


@pytest.mark.parametrize("name", ["X", "feed", "=cmd()", "a,b", "a\nb", ""])
def test_columns_that_would_break_the_table_are_refused(name):
    with pytest.raises(PathError, match="column"):
        PathCsv().write(straight_program(2, columns={name: np.zeros(2)}))


def masked(values, none):
    return np.ma.array(values, mask=none)


def test_a_masked_number_is_an_empty_cell_and_not_a_zero():
    columns = {"u_mm": masked([-1.0, 0.05, 0.0], [True, False, False]), "w": np.array([1.0, 2.0, 3.0])}
    program = straight_program(3, columns=columns)
    (text,) = PathCsv().write(program).values()
    assert [line.split(",")[8:] for line in text.decode().splitlines()] == [
        ["status", "u_mm", "w"],
        ["covered", "", "1.000000"],
        ["covered", "0.050000", "2.000000"],
        ["covered", "0.000000", "3.000000"],
    ]


def test_the_empty_cells_stand_before_the_name_of_an_overridden_gate():
    columns = {"u_mm": masked([-1.0, 0.05], [True, False])}
    (text,) = PathCsv().write(straight_program(2, columns=columns, overridden=("gate slope",))).values()
    assert [line.split(",")[9:] for line in text.decode().splitlines()] == [
        ["u_mm", "overridden: gate slope"],
        ["", "1"],
        ["0.050000", "1"],
    ]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_only_a_mask_makes_a_cell_empty(bad):
    with pytest.raises(PathError, match="column 'u_mm' holds numbers that are not finite"):
        PathCsv().write(straight_program(2, columns={"u_mm": masked([bad, 0.05], [False, False])}))


def test_a_long_table_keeps_each_cell_in_its_row():
    count = 10_001
    u_mm = masked(np.arange(count) * 1e-3, np.arange(count) % 3 == 0)
    _, rows = read_csv(PathCsv().write(straight_program(count, columns={"u_mm": u_mm})))
    cells = [row["u_mm"] for row in rows]
    assert set(cells[::3]) == {""}
    assert cells[4] == "0.004000" and cells[-1] == f"{(count - 1) * 1e-3:.6f}"


@pytest.mark.parametrize("post", [GCode(), GCode({"orientation": "siemens"}), Val3()], ids=["gcode", "siemens", "val3"])
def test_controllers_get_the_same_bytes_with_and_without_the_column(post):
    columns = {"u_mm": masked(np.full(6, 0.05), [True, False, False, False, False, True])}
    assert post.write(simple_program(columns=columns)) == post.write(simple_program())
