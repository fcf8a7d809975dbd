import json
import logging
import types

import pytest

from sicp_cam import errors

LINES = ("edge: corrected", "mean error: 0.42 -> 0.05 mm")
DOCUMENT = {"schema": "sicp-cam/1", "status": "ok", "name": "é"}


def outcome(exit_code=0):
    return types.SimpleNamespace(document=DOCUMENT, exit_code=exit_code, lines=LINES)


def raising(error):
    def correct(job, progress):
        raise error

    return correct


@pytest.mark.parametrize("code", [0, 7, 8])
def test_the_code_of_the_outcome_is_that_of_the_process(run, files, pipeline, code):
    pipeline(correct=lambda job, progress: outcome(code))
    assert run("correct", *files) == (code, "edge: corrected\nmean error: 0.42 -> 0.05 mm\n", "")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.JobError("a: wrong"), 2),
        (errors.FormatError("scan.ply", "no points", byte=12), 3),
        (errors.UnitError("unknown unit"), 3),
        (errors.CadError("the kernel crashed"), 3),
        (errors.AmbiguousPoseError("two poses fit"), 4),
        (errors.PathError("jump of 3 mm"), 5),
        (errors.OutputError("disk full"), 6),
        (errors.ReportError("no picture"), 8),
        (KeyboardInterrupt(), 130),
    ],
)
def test_each_error_is_one_line_and_its_code(run, files, pipeline, error, code):
    pipeline(correct=raising(error))
    told = str(error) or "interrupted"
    assert run("correct", *files) == (code, "", f"sicp-cam: error: {told}\n")


def test_every_problem_of_a_job_is_a_line(run, files, pipeline):
    pipeline(correct=raising(errors.JobError("a: wrong", "b: missing")))
    assert run("correct", *files)[::2] == (2, "sicp-cam: error: a: wrong\nsicp-cam: error: b: missing\n")


@pytest.mark.parametrize("error", [IndexError("list index out of range"), SystemExit(0), MemoryError()])
def test_anything_else_is_a_bug_and_says_so(run, files, pipeline, error):
    pipeline(correct=raising(error))
    code, out, err = run("correct", *files)
    assert (code, out) == (1, "")
    assert err.startswith(f"sicp-cam: bug: {type(error).__name__}")
    assert err.count("\n") == 1


def test_a_traceback_shows_with_two_v_only_and_always_stands_in_the_log_file(run, files, pipeline, tmp_path):
    pipeline(correct=raising(errors.PathError("jump")))
    assert "Traceback" not in run("correct", *files, "-v")[2]
    assert "Traceback" in run("correct", *files, "-vv")[2]
    assert "Traceback" not in run("correct", *files, "--log-file", tmp_path / "log.txt")[2]
    assert "PathError: jump" in (tmp_path / "log.txt").read_text(encoding="utf-8")


def test_a_log_file_that_cannot_be_written_is_an_output_error(run, files, pipeline, tmp_path):
    pipeline(correct=lambda job, progress: outcome())
    code, _, err = run("correct", *files, "--log-file", tmp_path)
    assert code == 6
    assert err == f"sicp-cam: error: {tmp_path}: the log cannot be written: Is a directory\n"


def test_nasty_text_of_an_error_stays_on_its_line(run, files, pipeline):
    pipeline(correct=raising(errors.InputError("scan\x1b[2J\n: odd")))
    assert run("correct", *files)[2] == "sicp-cam: error: scan\\x1b[2J\\n: odd\n"


def test_json_is_one_document_on_stdout(run, files, pipeline):
    pipeline(correct=lambda job, progress: outcome(7))
    code, out, _ = run("correct", *files, "--json", "-vv")
    assert (code, json.loads(out)) == (7, DOCUMENT)
    assert out.isascii()


@pytest.mark.parametrize("words", [["--json"], ["--json", "--frob"], ["--json", "--set", "x"]])
def test_json_is_one_document_even_where_the_run_fails(run, files, pipeline, words):
    pipeline(correct=raising(errors.PathError("jump of 3 mm")))
    code, out, err = run("correct", *files, *words)
    document = json.loads(out)
    assert (document["status"], document["exit_code"]) == ("fail", code)
    assert [f"sicp-cam: error: {finding['message']}" for finding in document["findings"]] == err.splitlines()
    assert document["findings"][0]["code"] == 900 + code


def test_numbers_that_are_not_finite_never_reach_a_reader(run, files, pipeline):
    pipeline(correct=lambda job, progress: types.SimpleNamespace(document={"x": float("nan")}, exit_code=0, lines=()))
    code, out, err = run("correct", *files, "--json")
    assert code == 1
    assert json.loads(out)["status"] == "fail"
    assert "bug: ValueError" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["corect"], 'Unknown command "corect". Did you mean "correct"?'),
        (["correct", "--frob"], "Unknown option: --frob."),
        (["correct", "--cad"], "--cad"),
        (["correct", "a.toml", "b.toml"], "b.toml"),
        (["inspect"], "file"),
        (["inspect", "a.ply", "--role", "tool"], "tool"),
        (["correct", "-q", "-v"], "-q and -v exclude each other"),
        (["correct", "nowhere.toml"], "nowhere.toml: cannot be read: no such file"),
        (["correct", "job.txt", "--override", "side", "stretch"], "stretch: one job file is taken, and flags"),
        (["correct", "part.step"], "part.step: this is a part, no job file; give it with --cad"),
        (
            ["correct", "part.step", "scan.ply", "trim.apt"],
            "give the files with --cad, --scan and --path: --cad part.step --scan scan.ply --path trim.apt",
        ),
        (
            ["correct", "scan.ply", "mesh.stl"],
            "give the files with --cad, --scan and --path: --scan scan.ply --cad mesh.stl",
        ),
        (["plugins", "vla3"], "no plug-in 'vla3'; did you mean val3?"),
        (["settings", "gate"], "no table 'gate'; did you mean gates?"),
        (["correct"], "cad: missing; give the nominal part with --cad FILE"),
    ],
)
def test_wrong_usage_is_exit_code_2_and_lines_on_stderr(run, files, words, told):
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert all(line.startswith("sicp-cam: error: ") for line in err.splitlines())
    assert told.lower() in err.lower()


def test_progress_and_log_go_to_stderr_as_loud_as_wanted(run, files, pipeline):
    log = logging.getLogger("sicp_cam.registration")

    def correct(job, progress):
        progress("read", 0.0)
        progress("read", 0.1)
        progress("register", 0.5)
        log.warning("thin %s", "scan")
        log.debug("7 iterations")
        return outcome()

    pipeline(correct=correct)
    steps = "sicp-cam: info: read ...\nsicp-cam: info: register ...\n"
    warning, debug = "sicp-cam: warning: thin scan\n", "sicp-cam: debug: 7 iterations\n"
    assert run("correct", *files)[2] == warning
    assert run("correct", *files, "-q")[2] == ""
    assert run("correct", *files, "-v")[2] == steps + warning
    assert run("correct", *files, "-vv")[2] == steps + warning + debug
    assert run("correct", *files, "-v", "-v")[2] == steps + warning + debug
    assert not log.parent.handlers


def test_the_flags_become_the_job(run, files, pipeline, tmp_path):
    jobs = []

    def correct(job, progress):
        jobs.append(job)
        return outcome()

    pipeline(correct=correct)
    words = (
        "--post val3,csv --post gcode --name edge --method rigid --contour 2,3 --align given --frame part --cad-units m"
    )
    more = "--scan-units inch --path-units cm --report none --dry-run --force --strict"
    sets = ["--override", "coverage", "--override", "jump_mm"]
    sets += ["--set", "registration.segments=14", "--set", "scan.decimal=,", "--set", "post.val3.spin_deg=-90"]
    assert run("correct", *files, *words.split(), *more.split(), *sets)[0] == 0
    job = jobs[0]
    assert (job.post, job.name, job.method, job.contour) == (("val3", "csv", "gcode"), "edge", "rigid", (2, 3))
    assert (job.align, job.frame, job.report) == ("given", "part", ())
    assert (job.cad_units, job.scan_units, job.path_units) == ("m", "inch", "cm")
    assert job.dry_run and job.force and job.strict
    assert job.override == ("coverage", "jump_mm")
    assert (job.registration.segments, job.scan_options) == (14, {"decimal": ","})
    assert job.post_options == {"val3": {"spin_deg": "-90"}}


def test_flags_beat_variables_and_those_the_job_file(run, files, pipeline, tmp_path, monkeypatch):
    jobs = []

    def correct(job, progress):
        jobs.append(job)
        return outcome()

    pipeline(correct=correct)
    (tmp_path / "sub").mkdir()
    text = 'cad = "../part.step"\nscan = "../scan.ply"\npath = "../trim.apt"\nout = "out"\nname = "a"\nframe = "part"\n'
    (tmp_path / "sub" / "job.toml").write_text(text + 'method = "rigid"\n', encoding="utf-8")
    monkeypatch.setenv("SICP_NAME", "b")
    monkeypatch.setenv("SICP_METHOD", "paper")
    assert run("correct", "sub/job.toml", "--name", "c")[0] == 0
    assert (jobs[0].name, jobs[0].method, jobs[0].frame) == ("c", "paper", "part")
    assert jobs[0].cad.resolve() == tmp_path / "part.step"
    assert jobs[0].out.resolve() == tmp_path / "sub" / "out"


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--scan", "scan.mp4"], 3, "scan.mp4: no reader for a scan with the suffix '.mp4'"),
        (["--set", "path.chrd_mm=1"], 2, "path.chrd_mm: unknown option; did you mean chord_mm?"),
        (["--set", "post.csv.decimals=1"], 2, "csv has no option 'decimals'"),
        (["--cad", "scan.ply", "--scan", "part.step"], 2, "are --cad and --scan swapped?"),
    ],
)
def test_what_the_job_alone_shows_is_told_before_a_file_is_read(run, files, tmp_path, words, code, told):
    """The files hold nothing that could be read, and the error is none of theirs."""
    (tmp_path / "scan.mp4").write_bytes(b"x")
    changed = dict(zip(files[::2], files[1::2], strict=True))
    for flag in words[::2]:
        changed.pop(flag, None)
    stated = [word for pair in changed.items() for word in pair]
    found, out, err = run("correct", *stated, *words)
    assert (found, out, err.count("\n")) == (code, "", 1)
    assert told in err
