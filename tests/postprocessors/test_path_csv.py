import numpy as np
import pytest
from post_programs import path_of, simple_program, straight_program
from post_reread import axis_error_deg, read_csv

from sicp_cam.errors import PathError
from sicp_cam.findings import Level
from sicp_cam.model import Program, Status
from sicp_postprocessors.path_csv import PathCsv


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
