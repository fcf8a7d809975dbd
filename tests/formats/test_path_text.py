"""Text files that may be APT, G-code or tables: the words decide, or nobody."""

from pathlib import Path

import numpy as np
import pytest

from sicp_cam.errors import FormatError, JobError, UnitError
from sicp_cam.model import ToolPath
from sicp_formats.path_text import read_path

APT = "$$ made by hand\nPARTNO/A\nUNITS/MM\nFEDRAT/100,MMPM\nGOTO/1,2,3,$\n0,0,1\nGOTO/4,5,6,0,0,1\nFINI\n"
GCODE = "%\n(made by hand)\nN10 G21 G90\nN20 G0 X1 Y2 Z3\nN30 G1 X4. Y5 Z6 F100.\nM30\n%\n"
TABLE = "x;y;z;feed\n1;2;3;100\n4;5;6;100\n"


def read(folder: Path, text: str, **options: object) -> ToolPath:
    (folder / "path.txt").write_text(text)
    return read_path(folder / "path.txt", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "format", "told"),
    [
        (APT, "APT", "APT"),
        (APT.lower(), "APT", "APT"),
        (GCODE, "G-code", "G-code"),
        ("G21\nG1 X1 Y2 Z3 F100\nX4 Y5 Z6\nM2\n", "G-code", "G-code"),
        (TABLE, "CSV", "a table"),
        ("1 2 3\n4 5 6\n", "CSV", "a table"),
        ("# c\n1,2,3,0,0,1\n4,5,6,0,0,1\n", "CSV", "a table"),
    ],
)
def test_the_words_decide(tmp_path: Path, text: str, format: str, told: str) -> None:
    path = read(tmp_path, text)
    assert path.source is not None and path.source.format == format
    assert np.array_equal(path.tips_mm[-1], [4, 5, 6])
    (finding,) = [finding for finding in path.findings if finding.code == 339]
    assert f"it was read as {told}; if that is wrong" in finding.message
    assert [f.code for f in path.findings] == sorted(f.code for f in path.findings)


@pytest.mark.parametrize(
    "text",
    [
        "dear reader,\nthis is no path\n",
        APT + GCODE,
        "1 2\n3 4\n",
        "DEF a()\nLIN {X 1,Y 2,Z 3}\nEND\n",
        "1 2 3\nthe rest is missing\nand so on\n",
        "A" + "1" * 5000 + "!\n",
        "X1" * 900 + "!\n" + "1" * 1900 + "\n",
    ],
)
def test_what_could_be_anything_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FormatError, match=r"path\.txt, line 1: .*--set path\.format=apt"):
        read(tmp_path, text)


def test_options_go_to_the_reader_in_its_types(tmp_path: Path) -> None:
    feedless = "1 2 3\n4 5 6\n"
    assert read(tmp_path, feedless, feed_mm_min="50").feeds_mm_min.tolist() == [50, 50]
    assert read(tmp_path, feedless, columns="z,y,x", units="cm").tips_mm[0].tolist() == [30, 20, 10]
    skipped = GCODE.replace("N30", "/N30 G1 X9 F9\nN30")
    assert len(read(tmp_path, skipped)) == 2
    assert len(read(tmp_path, skipped, block_skip="false")) == 3
    with pytest.raises(UnitError):
        read(tmp_path, GCODE, units="inch")
    with pytest.raises(JobError, match=r"path\.rotary: the file was read as a table"):
        read(tmp_path, TABLE, rotary="AC")
    with pytest.raises(JobError, match=r"path\.chord_mm: must be float, not 'small'"):
        read(tmp_path, TABLE, chord_mm="small")
    with pytest.raises(JobError, match=r"path\.block_skip"):
        read(tmp_path, GCODE, block_skip="maybe")


def test_errors_are_those_of_the_reader(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"path\.txt, line 7: GOTO needs 3 numbers"):
        read(tmp_path, APT.replace("GOTO/4,5,6,0,0,1", "GOTO/4,5"))
    with pytest.raises(FormatError, match=r"path\.txt, line 3: 2 cells where 3 are expected; complete the row"):
        read(tmp_path, "1,2,3\n4,5,6\n7,8", recover=True)
