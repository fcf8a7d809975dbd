"""Checking of written programs: which ones, by whom, and what the document says."""

import json
import sys
from pathlib import Path

import pytest

from sicp_cam.checking.check import Check, check, programs_of
from sicp_cam.errors import InputError, JobError
from sicp_cam.limits import Limits
from sicp_cam.plugins import registry

GOLDEN = Path(__file__).parents[1] / "golden" / "posts"
NC = GOLDEN / "gcode-vector" / "porthole.nc"
CSV = GOLDEN / "csv" / "porthole.csv"
ROTARY = GOLDEN / "gcode-rotary-ac" / "porthole.nc"


def result(folder, *names, kind="program"):
    outputs = [{"kind": kind, "path": name, "sha256": ""} for name in names]
    (folder / "result.json").write_text(json.dumps({"outputs": outputs}), encoding="utf-8")


def test_a_file_and_an_application_are_programs(tmp_path):
    assert programs_of(NC) == (NC,)
    application = GOLDEN / "val3" / "porthole"
    assert programs_of(application) == (application / "porthole.pjx",)


def test_a_folder_of_results_holds_the_programs_that_readers_know(tmp_path):
    names = ["a.csv", "a/a.pjx", "a/a.dtx", "a/start.pgx", "report.pdf", "a.odd", "b.src", "b.dat"]
    result(tmp_path, *names)
    assert [str(file.relative_to(tmp_path)) for file in programs_of(tmp_path)] == ["a/a.pjx", "a.csv", "b.src"]


@pytest.mark.parametrize("names", [["../a.csv"], ["/a.csv"], ["a.odd"], []])
def test_a_result_that_names_no_program_below_its_folder_is_refused(tmp_path, names):
    result(tmp_path, *names)
    with pytest.raises(InputError, match=r"result\.json: names no program that can be read"):
        programs_of(tmp_path)


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"outputs": 3}', '{"outputs": [{"kind": "program"}]}', "[" * 5000]
)
def test_a_result_that_is_none_is_refused(tmp_path, content):
    (tmp_path / "result.json").write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=r"result\.json: is no result of a run"):
        programs_of(tmp_path)


def test_other_folders_and_what_is_not_there_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"a folder with neither a \.pjx nor a result\.json; name the programs in it"):
        programs_of(tmp_path)
    (tmp_path / "a.nc").write_bytes(b"x")
    with pytest.raises(InputError, match=r"no such file \(did you mean .*a\.nc\?\)"):
        programs_of(tmp_path / "b.nc")


def test_the_document_of_a_good_program():
    document = check(Check((NC,), against=CSV))
    assert (document["schema"], document["status"], document["exit_code"]) == ("sicp-cam/1", "ok", 0)
    assert document["findings"] == []
    (entry,) = document["inputs"]
    assert (entry["role"], entry["path"], entry["format"], entry["units"], entry["count"]) == (
        "path", str(NC), "G-code", "mm", 6
    )  # fmt: skip
    (program,) = document["programs"]
    assert program["facts"]["feeds_mm_min"] == [900.0, 2000.0]
    assert program["against"]["max_mm"] == 0.0 and program["against"]["max_axis_deg"] < 1e-4
    json.dumps(document, allow_nan=False)


def test_a_program_that_must_not_run(tmp_path):
    (tmp_path / "a.nc").write_text(NC.read_text("ascii").replace("F2000", "F0"), encoding="ascii")
    document = check(Check((tmp_path / "a.nc",)))
    assert (document["status"], document["exit_code"]) == ("fail", 3)  # the reader refuses it too
    (tmp_path / "a.nc").write_text(NC.read_text("ascii").replace("X98.0067", "X198.0067"), encoding="ascii")
    document = check(Check((tmp_path / "a.nc",), against=CSV))
    assert (document["status"], document["exit_code"]) == ("fail", 5)
    (finding,) = [f for f in document["findings"] if f["level"] == "fail"]
    assert (finding["code"], finding["where"]) == (897, f"{tmp_path / 'a.nc'}, move 1, line 17")


def test_warnings_end_a_strict_check_only(tmp_path):
    (tmp_path / "a.nc").write_text(NC.read_text("ascii").replace("M30\n", ""), encoding="ascii")
    assert check(Check((tmp_path / "a.nc",)))["exit_code"] == 0
    assert check(Check((tmp_path / "a.nc",), strict=True))["exit_code"] == 7
    assert check(Check((NC,), strict=True))["exit_code"] == 0


def test_one_unreadable_program_among_others_does_not_hide_them(tmp_path):
    document = check(Check((NC, ROTARY, CSV)))
    assert document["exit_code"] == 3
    assert [entry["facts"] is None for entry in document["programs"]] == [False, True, False]
    (finding,) = [f for f in document["findings"] if f["level"] == "fail"]
    assert finding["code"] == 903 and "--set path.rotary=AC" in finding["message"]


def test_options_go_to_those_programs_that_take_them(tmp_path):
    job = Check((ROTARY, CSV, NC), path_options={"rotary": "AC"}, check_options={"line_length": 30})
    document = check(job)
    assert document["exit_code"] == 5
    assert {f["code"] for f in document["findings"] if f["level"] == "fail"} == {870}


def test_options_that_nobody_takes_are_refused():
    with pytest.raises(JobError, match=r"path\.rotery: unknown option; did you mean rotary\?"):
        check(Check((NC,), path_options={"rotery": "AC"}))
    with pytest.raises(JobError, match=r"path\.rotery: unknown option"):
        check(Check((NC, CSV), path_options={"rotery": "AC"}))
    with pytest.raises(JobError, match=r"check\.lenght: unknown option"):
        check(Check((NC, CSV), check_options={"lenght": 3}))
    with pytest.raises(JobError, match=r"check\.axis_jump_deg: must be a number"):
        check(Check((NC,), check_options={"axis_jump_deg": "far"}))


def test_limits_are_kept():
    document = check(Check((NC,), limits=Limits(path_points=3)))
    assert document["exit_code"] == 3 and "path_points = 3" in document["findings"][0]["message"]


def test_the_reference_itself_is_not_checked():
    document = check(Check((NC, CSV), against=CSV))
    assert [entry["path"] for entry in document["programs"]] == [str(NC)]
    with pytest.raises(JobError, match="that is the only program"):
        check(Check((CSV,), against=CSV))


def test_a_program_whose_words_nobody_knows_is_judged_by_its_path():
    nci = Path(__file__).parents[1] / "corpus" / "nci"
    document = check(Check((next(iter(sorted(nci.glob("*.nci")))),)))
    assert 899 in {f["code"] for f in document["findings"]}


@pytest.fixture
def third_party(tmp_path, monkeypatch):
    """Let another distribution register something in the group of checkers."""

    def register(entry, source):
        info = tmp_path / "odd-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n", encoding="utf-8")
        (info / "entry_points.txt").write_text(f"[{registry.CHECKERS}{entry}", encoding="utf-8")
        (tmp_path / "odd_checker.py").write_text(source, encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, "odd_checker", raising=False)

    return register


FINDS = """
from sicp_cam.findings import Finding, Level

def check(path, *, limits, most: int = 0):
    return (Finding(9001, Level.FAIL, f"more than {most}", str(path)),)
"""


def test_a_third_party_can_judge_a_suffix(third_party):
    third_party("]\nnci = odd_checker:check", FINDS)
    nci = next(iter(sorted((Path(__file__).parents[1] / "corpus" / "nci").glob("*.nci"))))
    document = check(Check((nci,), check_options={"most": 7}))
    assert document["exit_code"] == 5 and document["findings"][0]["message"] == "more than 7"


def test_a_suffix_that_we_judge_is_taken_over_by_an_override_only(third_party):
    third_party("]\nnc = odd_checker:check", FINDS)
    with pytest.raises(JobError, match=r"nc: claimed by .* and "):
        check(Check((NC,)))


def test_an_override_takes_a_suffix_over(third_party):
    third_party(".override]\nnc = odd_checker:check", FINDS)
    assert [f["code"] for f in check(Check((NC,)))["findings"]] == [9001]


def test_a_checker_that_answers_anything_else_is_named(third_party):
    third_party(".override]\nnc = odd_checker:check", "def check(path, *, limits):\n    return ['x']\n")
    with pytest.raises(JobError, match="odd_checker:check answered with something else"):
        check(Check((NC,)))


def test_parts_of_a_long_program_are_checked_with_the_program_that_calls_them(tmp_path):
    names = ["trim.src", "trim_001.src", "trim_002.src", "door.pgf", "door.mod", "door_001.mod", "door.src", "X.ls"]
    names += ["X001.ls", "op_100.apt"]
    outputs = [{"kind": "program", "path": name} for name in names]
    (tmp_path / "result.json").write_text(json.dumps({"outputs": outputs}))
    assert [each.name for each in programs_of(tmp_path)] == ["X.ls", "door.pgf", "door.src", "op_100.apt", "trim.src"]


# --- what a run says of its programs ---


@pytest.fixture
def run_of(tmp_path):
    """Write programs of the golden cases into a folder, with a result that says how each is read."""

    def write(**readings):
        outputs = []
        for case, reading in readings.items():
            (source,) = (GOLDEN / case.replace("_", "-")).iterdir()
            name = f"{case}{source.suffix}"
            (tmp_path / name).write_bytes(source.read_bytes())
            outputs.append({"kind": "program", "path": name, **({} if reading is None else {"reading": reading})})
        (tmp_path / "result.json").write_text(json.dumps({"outputs": outputs}), encoding="utf-8")
        return tmp_path

    return write


def test_the_result_of_a_run_says_how_its_programs_are_read(run_of):
    folder = run_of(gcode_rotary_ac={"rotary": "AC"}, csv={}, gcode_vector=None)
    document = check(Check((folder,), against=folder / "csv.csv"))
    assert document["exit_code"] == 0
    assert [Path(each["path"]).name for each in document["programs"]] == ["gcode_rotary_ac.nc"]
    assert check(Check((folder / "gcode_rotary_ac.nc",)))["exit_code"] == 0
    wrong = check(Check((folder / "gcode_rotary_ac.nc",), path_options={"rotary": "BC"}))
    assert wrong["exit_code"] == 3  # the user knows better, and is wrong
    (folder / "result.json").write_text("[]", encoding="utf-8")
    assert check(Check((folder / "gcode_rotary_ac.nc",)))["exit_code"] == 3


def test_a_program_that_no_reader_can_follow_is_judged_by_its_text(run_of):
    folder = run_of(gcode_rotary_ac="the angles mean nothing without the machine")
    document = check(Check((folder,)))
    (program,) = document["programs"]
    assert (document["exit_code"], document["status"], program["facts"]) == (0, "ok", None)
    assert program["unread"] == "the angles mean nothing without the machine"
    assert [(f["code"], f["level"]) for f in document["findings"]] == [(899, "info")]
    file = folder / "gcode_rotary_ac.nc"
    file.write_bytes(file.read_bytes().replace(b"F2000", b"F0"))
    assert check(Check((folder,)))["exit_code"] == 5
    assert check(Check((folder,), path_options={"rotary": "AC"}))["exit_code"] == 3
