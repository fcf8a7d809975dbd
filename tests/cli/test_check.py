"""The command `check`: its lines, its exit codes, its one document."""

import json
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden" / "posts"
NC = GOLDEN / "gcode-vector" / "porthole.nc"
CSV = GOLDEN / "csv" / "porthole.csv"
WHAT = "G-code, 6 moves, 4 of them cuts, 99.834 mm, feeds 900, 2000 mm/min, tools 3, unit mm"


@pytest.fixture
def program(files):
    """A good program in the current folder, with something in it replaced."""

    def write(old="", new=""):
        text = NC.read_text("ascii")
        assert old in text
        Path("a.nc").write_text(text.replace(old, new), encoding="ascii")
        return "a.nc"

    return write


def test_a_good_program_is_told_in_two_lines(run, program):
    assert run("check", program()) == (0, f"a.nc: {WHAT}\nfindings: none\n", "")


def test_a_warning_is_told_and_may_run(run, program):
    name = program("M30\n", "")
    code, out, err = run("check", name)
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        f"a.nc: {WHAT}",
        "findings: 1",
        "  warn 871: a.nc, line 28: the program has no end (M2 or M30); is the file complete?",
    ]
    assert run("check", name, "--strict")[::2] == (7, "sicp-cam: error: a.nc: 1 warning under --strict\n")


def test_a_program_that_must_not_run(run, program):
    code, out, err = run("check", program("G49\nM30", "M30"), "--set", "check.line_length=50")
    assert (code, err) == (5, "sicp-cam: error: a.nc: must not run: 5 findings of level fail\n")
    assert "  fail 870: a.nc, line 17: the line has 65 characters, more than 50" in out.splitlines()


def test_a_program_that_cannot_be_read(run, program):
    code, out, err = run("check", program("Y19.8669", "Y19.8669 Y1"), CSV)
    assert (code, err) == (3, "sicp-cam: error: a.nc, line 17: multiple Y words on one line; take one out\n")
    assert out.splitlines()[0] == "a.nc: cannot be read"
    assert out.splitlines()[-3].startswith(f"{CSV}: CSV, 6 moves")


@pytest.mark.parametrize("old", ["", "M30\n", "Y19.8669"])
def test_there_is_exactly_one_document(run, program, old):
    code, out, _ = run("check", program(old, "" if old == "M30\n" else f"{old} {old}" if old else ""), "--json")
    document = json.loads(out)
    assert document["exit_code"] == code
    assert document["status"] == {"": "ok", "M30\n": "warn", "Y19.8669": "fail"}[old]


def test_a_program_is_compared_with_another(run, program):
    code, out, _ = run("check", program(), "--against", CSV)
    assert (code, out.splitlines()[1]) == (
        0,
        f"against {CSV}: 6 moves, tips at most 0 mm off, axes at most 3.18e-05 degrees, feeds at most 0 %",
    )
    code, out, _ = run("check", program("X92.1061", "X92.2061"), "--against", CSV)
    assert code == 5 and "  fail 897: a.nc, move 2, line 19: 1 of 6 tips are off by more than 0.002 mm" in out
    assert run("check", "a.nc", "--against", CSV, "--tolerance-mm", "0.2")[0] == 0


def test_a_folder_of_results_is_checked_program_by_program(run, files):
    Path("out").mkdir()
    Path("out/a.nc").write_bytes(NC.read_bytes())
    Path("out/a.csv").write_bytes(CSV.read_bytes())
    outputs = [{"kind": "program", "path": name} for name in ("a.nc", "a.csv")]
    Path("out/result.json").write_text(json.dumps({"outputs": outputs}))
    code, out, err = run("check", "out", "--against", "out/a.csv")
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == f"out/a.nc: {WHAT}" and "out/a.csv: CSV" not in out


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        ([], 2, "name at least one program to check"),
        (["a.nc", "--tolerance-mm", "-1"], 2, "must be numbers of at least 0"),
        (["a.nc", "--tolerance-mm", "nan"], 2, "must be numbers of at least 0"),
        (["a.nc", "--set", "line_length=3"], 2, "must begin with one of path., check., against., limits."),
        (["a.nc", "--set", "check.line_lenght=3"], 2, "check.line_lenght: unknown option; did you mean line_length?"),
        (["a.nc", "--set", "check.line_length=x"], 2, "check.line_length: must be a whole number"),
        (["a.nc", "--units", "feet"], 2, "Choose from"),
        (["b.nc"], 3, "b.nc: no such file (did you mean a.nc?)"),
        (["a.nc", "--against", "b.csv"], 3, "b.csv: no such file"),
        (["."], 3, "a folder with neither a .pjx nor a result.json"),
    ],
)
def test_what_is_wrong_is_refused_in_one_line(run, program, words, code, told):
    program()
    got, out, err = run("check", *words)
    assert (got, out, err.count("\n")) == (code, "", 1)
    assert told in err


def test_words_of_a_program_are_made_safe(run, files):
    Path("a.apt").write_text("PARTNO/x\x1b]0;y\nUNITS/MM\nFEDRAT/5\nGOTO/0,0,0\nGOTO/9,0,0\nODD\x1b/1\nFINI\n")
    code, out, _ = run("check", "a.apt")
    assert code == 0 and "\x1b" not in out and "ODD\\x1b" in out


def test_a_program_that_nobody_reads_is_told_so(run, files):
    Path("a.nc").write_bytes(NC.read_bytes())
    outputs = [{"kind": "program", "path": "a.nc", "reading": "only its machine\x1b knows"}]
    Path("result.json").write_text(json.dumps({"outputs": outputs}))
    code, out, err = run("check", "a.nc")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "a.nc: not read, only its machine\\x1b knows",
        "findings: 1",
        "  info 899: a.nc: no path was read, so none was judged: only its machine\\x1b knows",
    ]
