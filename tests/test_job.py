import dataclasses
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sicp_cam import plugins
from sicp_cam.errors import JobError
from sicp_cam.job import Job, build
from sicp_cam.job import layers as job_layers
from sicp_cam.job.layers import Layer, environment, load
from sicp_cam.job.tables import GATES, RANGES, TABLES
from sicp_cam.limits import Limits
from sicp_cam.options.values import Word, converted, table
from sicp_cam.registration.settings import RegistrationSettings
from sicp_cam.toolpath.settings import GateLimits, ToolPathSettings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ("part.step", "scan.ply", "trim.apt", "pose.txt"):
        (tmp_path / name).write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    return tmp_path


FILES = {"cad": "part.step", "scan": "scan.ply", "path": "trim.apt", "out": "results"}


def command_line(*pairs, **flags):
    return job_layers.settings({**FILES, **flags}, pairs)


def job_file(folder, text, head=True):
    path = folder / "job.toml"
    path.write_text(("".join(f'{k} = "{v}"\n' for k, v in FILES.items()) if head else "") + text, encoding="utf-8")
    return path


def problems(*layers):
    with pytest.raises(JobError) as caught:
        build(*layers)
    assert caught.value.exit_code == 2
    return caught.value.problems


def test_four_files_make_a_job_of_defaults(folder):
    job = build(command_line())
    assert job == Job(Path("part.step"), Path("scan.ply"), Path("trim.apt"), Path("results"))
    assert (job.registration, job.toolpath) == (RegistrationSettings(), ToolPathSettings())
    assert (job.gates, job.limits) == (GateLimits(), Limits())
    assert (job.post, job.report, job.contour, job.align, job.name) == (
        ("csv",),
        ("pdf", "png"),
        "auto",
        "auto",
        "corrected",
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        job.name = "other"
    with pytest.raises(TypeError):
        job.scan_options["x"] = 1


def test_a_job_file_can_say_everything(folder, monkeypatch):
    path = job_file(
        folder,
        """
        post = ["val3", "csv"]
        name = "porthole"
        method = "rigid"
        contour = [1, 4]
        align = "pose.txt"
        frame = "part"
        cad_units = "inch"
        report = []
        force = true
        override = ["coverage"]
        [registration]
        segments = 14
        overlap = 0.25
        reach_mm = 60
        [toolpath]
        feed_mm_min = 1500
        [gates]
        coverage = 0.75
        [limits]
        points = 10
        [options.scan]
        decimal = ","
        [options.post.val3]
        spin_deg = 90.0
        robot = "cells/our.toml"
        """,
    )
    monkeypatch.chdir("/")
    job = build(load(path))
    assert job.cad == folder / "part.step" and job.out == folder / "results" and job.align == folder / "pose.txt"
    assert (job.post, job.name, job.method, job.contour) == (("val3", "csv"), "porthole", "rigid", (1, 4))
    assert (job.frame, job.cad_units, job.report, job.force) == ("part", "inch", (), True)
    assert job.override == ("coverage",)
    assert job.registration == RegistrationSettings(14, 0.25, reach_mm=60.0)
    assert isinstance(job.registration.reach_mm, float)
    assert (job.toolpath.feed_mm_min, job.gates.coverage, job.limits.points) == (1500.0, 0.75, 10)
    assert job.scan_options == {"decimal": ","}
    assert job.post_options == {"val3": {"spin_deg": 90.0, "robot": str(folder / "cells/our.toml")}}


def test_the_command_line_beats_the_environment_and_that_the_job_file(folder):
    layers = [
        load(
            job_file(folder, 'name = "a"\nmethod = "rigid"\nframe = "part"\n[gates]\ncoverage = 0.1\njump_mm = 0.1\n')
        ),
        environment({"SICP_NAME": "b", "SICP_METHOD": "paper", "SICP_GATES__COVERAGE": "0.2", "OTHER": "x"}),
        job_layers.settings({"name": "c"}, ["gates.coverage=0.3"]),
    ]
    job = build(*layers)
    assert (job.name, job.method, job.frame) == ("c", "paper", "part")
    assert (job.gates.coverage, job.gates.jump_mm) == (0.3, 0.1)
    assert build(*layers[:2]).gates.coverage == 0.2


def test_words_of_the_command_line_become_the_types_wanted(folder):
    job = build(
        command_line(
            "registration.segments=14",
            "registration.corner_radius_mm=1.5e1",
            "toolpath.feed_mm_min=none",
            "scan.decimal=,",
            "path.feed_mm_min=1500",
            "part.body=",
            "post.val3.dio=a=b",
            "dry_run=yes",
            post="val3,csv",
            contour="3,1",
            align="given",
            report="none",
            strict=True,
        )
    )
    assert (job.registration.segments, job.registration.corner_radius_mm) == (14, 15.0)
    assert (job.toolpath.feed_mm_min, job.dry_run, job.strict) == (None, True, True)
    assert (job.scan_options, job.path_options) == ({"decimal": ","}, {"feed_mm_min": "1500"})
    assert (job.part_options, job.post_options) == ({"body": ""}, {"val3": {"dio": "a=b"}})
    assert (job.post, job.contour, job.align, job.report) == (("val3", "csv"), (3, 1), "given", ())
    assert isinstance(job.path_options["feed_mm_min"], Word)


def test_every_problem_is_told_at_once_with_its_place(folder):
    (folder / "results").write_bytes(b"a file")
    path = job_file(
        folder,
        """
        cad = "nowhere.step"
        scan = "."
        path = 5
        out = "results"
        post = ["csv", "csv"]
        name = "../x"
        methd = "sicp"
        method = "magic"
        contour = [true]
        frame = "world"
        force = 1
        report = ["pdf", "exe"]
        [registration]
        stabilty = 1
        overlap = -0.3
        segments = 1.5
        reach_mm = "40"
        corner_radius_mm = true
        [gates]
        coverage = nan
        jump_mm = inf
        axis_deg = -1
        [limits]
        points = 0
        [options.scn]
        decimal = ","
        """,
        head=False,
    )
    told = problems(load(path))
    assert all(problem.startswith(f"{path}: ") for problem in told)
    assert sorted(problem.removeprefix(f"{path}: ") for problem in told) == sorted(
        [
            f"cad: {folder}/nowhere.step: no such file",
            f"scan: {folder} is a folder; give a file",
            "path: must be a file name, not 5",
            f"out: {folder}/results is not a folder",
            "post: names something twice; leave one out",
            "name: '../x' must not contain / \\ : * ? \" < > | or control characters",
            "methd: unknown key; did you mean method?",
            "method: no method 'magic'; known: paper, projection, rigid, sicp",
            "contour: must be auto or numbers of contours from 1, such as 1,2; see sicp-cam inspect",
            "frame: must be one of scan, part, not the text 'world'",
            "force: must be true or false, not 1",
            "report: must be one of pdf, png, not the text 'exe'; or none for no report",
            "registration.stabilty: unknown key;"
            " known: corner_radius_mm, edge_offset_mm, field, overlap, projection_surface, reach_mm, segments",
            "registration.overlap: must be from 0 to 0.5, not -0.3",
            "registration.segments: must be a whole number, not 1.5",
            "registration.reach_mm: must be a number, not the text '40'",
            "registration.corner_radius_mm: must be a number, not true",
            "gates.coverage: must be a finite number, not nan",
            "gates.jump_mm: must be a finite number, not inf",
            "gates.axis_deg: must be from 0 to 180, not -1",
            "limits.points: must be at least 1, not 0",
            "options.scn.decimal: unknown table; did you mean scan?",
        ]
    )


def test_what_is_missing_is_told_with_its_remedy(folder):
    told = problems(environment({}))
    assert [problem.partition(":")[0] for problem in told] == ["cad", "scan", "path", "out"]
    assert told[1] == "scan: missing; give the scan of the part with --scan FILE, or as scan in the job file"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("registration = 5", "registration: must be a table, not 5"),
        ("options = 5", "options: must be a table, not 5"),
        ("[options]\nscan = 5", "options.scan: must be a table, not 5"),
        ("[options.post]\ncsv = 5", "options.post.csv: must be a table of the post's options"),
        ("[[gates]]\ncoverage = 1", "gates: must be a table, not [{'coverage': 1}]"),
        ("[name]\nfirst = 1", "name.first: name takes a value, not a table"),
        ("[frob]", "frob: unknown key; known: "),
        (
            "[post.val3]\nspin_deg = 1",
            "post.val3.spin_deg: post takes a value; the options of its reader or post stand",
        ),
        ("[options.post.val3]\nspin_deg = 1", "options.post.val3.spin_deg: val3 is not among the posts of this job"),
        ("name = 2026-01-01", "name: must be a text, not 2026-01-01"),
        ('name = "CON"', "name: 'CON' is a reserved name on Windows"),
        (f'name = "{"x" * 130}"', "name: is longer than 120 bytes"),
        ('align = ""', "align: must be a file name, not empty"),
        ('align = "nowhere.txt"', "align: "),
        ('post = "none"', "post: names no postprocessor"),
        ("contour = 0", "contour: must be auto or numbers"),
        ("contour = [1, 1]", "contour: names something twice"),
        ("contour = []", "contour: must be auto or numbers"),
        ('"a\\u001b[2J" = 1', r"a\x1b[2J: unknown key"),
        ("cad_units = 1", "cad_units: must be one of mm, cm, m, inch, not 1"),
    ],
)
def test_a_misplaced_or_wrong_value_is_told(folder, text, problem):
    path = job_file(folder, text)
    told = problems(load(path))
    assert len(told) == 1
    assert told[0].startswith(f"{path}: {problem}")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"cad = [1,\n2\nx", "not TOML: .*line 3"),
        (b'cad = "\xff"', "byte 7: not UTF-8"),
        (b"a = 1\na = 2\nb = 3", "not TOML: .*line 2"),
        (b"#" * (2**20 + 1), "larger than 1048576 bytes"),
        (b"a = " + b"[" * 50_000, "nested too deeply|not TOML"),
    ],
    ids=["syntax", "encoding", "twice", "large", "deep"],
)
def test_a_file_that_is_no_job_is_refused_with_its_name(folder, content, expected):
    path = folder / "job.toml"
    path.write_bytes(content)
    with pytest.raises(JobError, match=expected) as caught:
        load(path)
    assert str(path) in str(caught.value)


def test_a_job_file_that_cannot_be_read_is_named(folder):
    for path, reason in ((folder / "nowhere.toml", "no such file"), (folder, "Is a directory; give a job file")):
        with pytest.raises(JobError, match=reason) as caught:
            load(path)
        assert str(path) in str(caught.value)


def test_a_byte_order_mark_does_no_harm(folder):
    path = job_file(folder, "")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert build(load(path)).scan == folder / "scan.ply"


def test_a_wrong_variable_of_the_environment_is_told(folder):
    assert problems(command_line(), environment({"SICP_FORCED": "1", "SICP_GATES__COVERAGE": "2"})) == (
        "environment: forced: unknown key; did you mean force?",
        "environment: gates.coverage: must be from 0 to 1, not 2",
    )


def test_wrong_pairs_of_the_command_line_are_told_together():
    with pytest.raises(JobError) as caught:
        job_layers.settings({"out": "x"}, ["registration.segments", "=5", "out=y", "a=b"])
    assert [problem.partition(":")[0] for problem in caught.value.problems] == [
        "--set registration.segments",
        "--set =5",
        "--set out",
    ]


def test_of_two_equal_keys_the_later_one_holds(folder):
    assert build(command_line("gates.coverage=0.1", "gates.coverage=0.2")).gates.coverage == 0.2


def test_options_of_a_post_that_the_command_line_leaves_out_do_no_harm(folder):
    path = job_file(folder, 'post = ["val3", "csv"]\n[options.post.val3]\nspin_deg = 1')
    assert build(load(path), job_layers.settings({"post": "csv"})).post_options == {}
    assert problems(load(path), job_layers.settings({}, ["post.vla3.spin_deg=1"])) == (
        "command line: options.post.vla3.spin_deg: vla3 is not among the posts of this job; did you mean val3?",
    )


def test_python_values_make_a_layer_too(folder):
    layer = Layer("arguments", {**FILES, "cad": folder / "part.step", "contour": (1, 2)}, Path())
    assert (build(layer).cad, build(layer).contour) == (folder / "part.step", (1, 2))


@pytest.mark.parametrize(
    ("stated", "told"),
    [
        ({"post": "VAL3"}, "post: no postprocessor 'VAL3'; did you mean val3?"),
        (
            {"post": "csv,fanuc"},
            "post: no postprocessor 'fanuc'; known: apt, csv, dxf, gcode, krl, ls, rapid, robodk, same, ur, val3",
        ),
        ({"method": "rigd"}, "method: no method 'rigd'; did you mean rigid?"),
        ({"report": "pfd"}, "report: must be one of pdf, png, not 'pfd' (did you mean pdf?); or none for no report"),
        ({"frame": "Part"}, "frame: must be one of scan, part, not 'Part' (did you mean part?)"),
        ({"override": "coverge"}, "override: no gate 'coverge'; did you mean coverage?"),
        ({"cad": "part.stp"}, "cad: part.stp: no such file (did you mean part.step?)"),
        ({"cad": "prats/part.step"}, "cad: prats/part.step: no such file; there is no folder prats"),
        ({"align": "atuo"}, "align: atuo: no such file (did you mean auto?)"),
        ({"align": "pos.txt"}, "align: pos.txt: no such file (did you mean pose.txt?)"),
    ],
)
def test_what_is_nearly_right_is_answered_with_what_was_meant(folder, stated, told):
    assert problems(command_line(**stated)) == (f"command line: {told}",)


@pytest.mark.parametrize(
    ("pair", "meant"),
    [
        ("segments=14", "registration.segments"),
        ("coverge=0.5", "gates.coverage"),
        ("regstration.segments=14", "registration"),
        ("val3.spin_deg=90", "options.post.val3.spin_deg"),
        ("methd=rigid", "method"),
    ],
)
def test_a_key_without_its_table_is_answered_with_the_whole_one(folder, pair, meant):
    key = pair.partition("=")[0]
    assert problems(command_line(pair)) == (f"command line: {key}: unknown key; did you mean {meant}?",)


@pytest.mark.parametrize(
    ("stated", "told"),
    [
        (
            {"cad": "scan.ply", "scan": "part.step"},
            "scan: part.step is read as a part, not as a scan: are --cad and --scan swapped?",
        ),
        (
            {"scan": "trim.apt", "path": "scan.ply"},
            "scan: trim.apt is read as a path, not as a scan: are --scan and --path swapped?",
        ),
        ({"path": "part.step"}, "path: part.step is read as a part, not as a path; give another file with --path"),
    ],
)
def test_files_in_each_others_place_are_told_before_any_is_read(folder, stated, told):
    assert problems(command_line(**stated)) == (f"command line: {told}",)


def test_a_stated_format_has_precedence_over_the_suffix(folder):
    assert build(command_line("scan.format=csv", scan="trim.apt")).scan == Path("trim.apt")


def test_a_suffix_that_nobody_reads_is_left_to_the_reader(folder):
    (folder / "scan.e57").write_bytes(b"x")
    assert build(command_line(scan="scan.e57")).scan == Path("scan.e57")


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("part.step", b"ISO-10303-21;\n", "this is a part, no job file; give it with --cad"),
        ("mesh.stl", b"\xff\xfe", "this is a scan or a part, no job file; give it with --scan or --cad"),
        ("path.nc", b"%\nG0 X1\n", "this is a path, no job file; give it with --path"),
    ],
)
def test_an_input_in_place_of_the_job_file_is_told(folder, name, content, told):
    (folder / name).write_bytes(content)
    with pytest.raises(JobError) as caught:
        load(Path(name))
    assert caught.value.problems == (f"{name}: {told}",)


def test_a_job_file_may_have_any_suffix(folder):
    path = job_file(folder, "")
    assert build(load(path.rename(folder / "job.txt"))).scan == folder / "scan.ply"


def test_the_gates_that_may_be_overridden_are_those_that_judge():
    from sicp_cam.toolpath.gates import GATE_NAMES

    assert sorted(GATES) == sorted(GATE_NAMES)


def test_every_setting_has_its_default_within_its_range():
    for name, kind in TABLES.items():
        assert RANGES[name].keys() <= {f.name for f in dataclasses.fields(kind)}
        assert table(kind, dataclasses.asdict(kind()), RANGES[name]) == (kind(), {})


def test_the_block_of_the_sample_job_holds_when_its_marks_are_taken_away(tmp_path):
    sample = Path(__file__).resolve().parents[1] / "samples" / "porthole"
    lines = (sample / "job.toml").read_text(encoding="utf-8").splitlines()
    block = lines.index("# [options.post.val3]")
    for name in ("part.step", "scan.ply", "path.apt", "pose_rough.txt"):
        (tmp_path / name).write_bytes(b"x")
    text = "\n".join([*lines[:block], *(line.removeprefix("# ") for line in lines[block:])])
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    options = build(load(tmp_path / "job.toml")).post_options["val3"]
    assert list(options) == ["tool", "cell", "spindle_output", "first_run"]
    made = plugins.postprocessor("val3", options).options
    assert made.tool == (0.0, 0.0, 185.0, 0.0, 0.0, 0.0)
    assert (made.spindle_output, made.first_run) == ("BasicIO-1\\%Q0", True)


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=5,
)
SOME_KEYS = st.sampled_from(
    [*(f.name for f in dataclasses.fields(Job)), "registration.segments", "gates.coverage", "options.post.csv", "a.b"]
)


@settings(deadline=None, max_examples=150)
@given(st.dictionaries(SOME_KEYS, JUNK | st.text(max_size=8).map(Word), max_size=4))
def test_whatever_is_stated_gives_a_job_or_a_job_error(values):
    try:
        job = build(Layer("junk", values, Path()))
    except JobError as error:
        assert error.problems
        assert all(problem.isprintable() for problem in error.problems)
    else:
        assert isinstance(job, Job)


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300))
def test_a_number_survives_the_command_line(number):
    assert converted(Word(repr(number)), float) == number


@pytest.mark.parametrize("word", ["1_000", "\u0661", "0x10", " 1", "1,5", "nan", "inf", "1e999", "", "1 2", "True"])
def test_what_is_not_plainly_a_number_is_none(word):
    with pytest.raises(ValueError, match="number"):
        converted(Word(word), float)
    with pytest.raises(ValueError, match="whole number"):
        converted(Word(word), int)
