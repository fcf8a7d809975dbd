"""The example scripts do what the README says of them."""

import re
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "cam_script.py"


def test_the_cam_script_corrects_its_own_path_and_writes_the_programs(tmp_path):
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), str(tmp_path / "made")], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    told = re.search(r"mean distance from the bent sheet: rigid ([\d.]+) mm, corrected ([\d.]+) mm", done.stdout)
    assert told is not None, done.stdout
    assert float(told[1]) > 1.0  # the sheet is bent by far more than any tolerance
    assert float(told[2]) < 0.05
    program = tmp_path / "made" / "program"
    names = {path.relative_to(program).as_posix() for path in program.rglob("*") if path.is_file()}
    assert {"corrected.csv", "corrected.nc", "corrected/corrected.pjx", "corrected/start.pgx"} <= names
