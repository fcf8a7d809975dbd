import dataclasses
import json
from pathlib import Path

import pytest

from sicp_cam.cli.inspect_lines import inspect_lines
from sicp_cam.job import Job
from sicp_cam.job.tables import GATES, TABLES
from sicp_cam.limits import Limits
from sicp_cam.options.help import written
from sicp_cam.registration.settings import METHODS

HEAD = {
    "sha256": "ab",
    "units": "mm",
    "unit_stated": True,
    "bounds": {"min_mm": [0.0, 0.0, 0.0], "max_mm": [1, 2.5, 3]},
}
DOCUMENT = {
    **HEAD,
    "role": "scan",
    "path": "points.csv",
    "format": "ASCII",
    "unit_stated": False,
    "count": 3,
    "triangles": 0,
    "normals": False,
    "spacing_mm": None,
    "columns": [],
    "loops": [],
    "findings": [{"code": 101, "level": "info", "message": "odd\x1b", "where": "line 3"}],
}


@pytest.fixture
def asked(stand_in):
    calls = []

    def inspect(path, **given):
        calls.append((path, given))
        return DOCUMENT

    stand_in("inspection", inspect=inspect)
    return calls


def test_inspect_hands_on_what_is_asked(run, files, asked):
    Path("points.csv").write_bytes(b"x")
    words = [
        "--units",
        "inch",
        "--picture",
        "p.png",
        "--force",
        "--recover",
        "--set",
        "decimal=,",
        "--set",
        "scan.columns=x,y,z",
    ]
    code, out, err = run("inspect", "points.csv", "--role", "scan", *words, "--set", "limits.points=9")
    assert (code, err) == (0, "")
    assert asked == [
        (
            Path("points.csv"),
            {
                "role": "scan",
                "units": "inch",
                "options": {"decimal": ",", "columns": "x,y,z"},
                "picture": Path("p.png"),
                "recover": True,
                "force": True,
                "limits": Limits(points=9),
            },
        )
    ]
    assert out.splitlines() == [
        "role: scan",
        "path: points.csv",
        "sha256: ab",
        "format: ASCII",
        "unit: not stated: mm assumed (say it with --units)",
        "bounds: 0, 0, 0 to 1, 2.5, 3 mm",
        "points: 3",
        "triangles: none",
        "normals: none",
        "columns: none",
        "spacing: not known, too few points",
        "loops: none",
        "findings: 1",
        "  info 101: line 3: odd\\x1b",
    ]


def test_inspect_tells_of_a_part_contour_by_contour():
    contour = {
        "number": 1,
        "kind": "skin",
        "length_mm": 628.3185,
        "closed": True,
        "corners": 1,
        "centre_mm": [0, 0, 4.0],
    }
    wall = {**contour, "number": 2, "kind": "wall", "closed": False, "corners": 0, "looks": "all round"}
    document = {**HEAD, "role": "part", "path": "a.step", "format": "STEP", "triangles": 12, "findings": []}
    document["contours"] = [{**contour, "looks": "towards +Z"}, wall]
    assert list(inspect_lines(document))[4:] == [
        "unit: mm",
        "bounds: 0, 0, 0 to 1, 2.5, 3 mm",
        "triangles: 12",
        "contours: 2",
        "  1: skin, 628.3185 mm long, closed, 1 corner, centre 0, 0, 4, looks towards +Z",
        "  2: wall, 628.3185 mm long, open, no corners, centre 0, 0, 4, looks all round",
        "findings: none",
    ]


def test_inspect_tells_of_a_path_in_its_own_words():
    path = {"count": 3, "rapid_moves": 1, "feed_moves": 2, "length_mm": 12.5, "name": "", "events": {"tool": 1}}
    document = {**HEAD, **path, "role": "path", "path": "a.nc", "format": "G-code", "findings": []}
    told = list(inspect_lines({**document, "feeds_mm_min": [600.0], "different_feeds": 3}))[6:]
    assert told == [
        "name: none",
        "moves: 3, of which 1 rapid and 2 feed",
        "length: 12.5 mm",
        "feeds: 600 mm/min, the lowest of 3",
        "events: 1 tool",
        "findings: none",
    ]
    told = list(inspect_lines({**document, "feeds_mm_min": [], "different_feeds": 0, "events": {}}))
    assert {"feeds: none", "events: none"} <= set(told)


def test_inspect_finds_the_role(run, files, asked):
    assert run("inspect", "part.step", "--json")[:2] == (0, json.dumps(DOCUMENT, indent=2) + "\n")
    assert asked[0][1]["role"] == "part"
    for name in ("mesh.stl", "movie.mp4", "job.toml"):
        Path(name).write_bytes(b"x")
    assert run("inspect", "mesh.stl", "--json")[0] == 0
    assert asked[1][1]["role"] == "scan"
    code, _, err = run("inspect", "movie.mp4")
    assert (code, err) == (3, "sicp-cam: error: movie.mp4: nothing reads this suffix; see sicp-cam plugins\n")
    assert "if it is a job, give it to sicp-cam correct" in run("inspect", "job.toml")[2]
    code, _, err = run("inspect", "prt.step")
    assert (code, err) == (3, "sicp-cam: error: prt.step: no such file (did you mean part.step?)\n")


@pytest.mark.parametrize("name", ["pose.txt", "pose.csv", "pose.mat"])
def test_inspect_knows_a_pose_and_says_where_it_belongs(run, files, asked, name):
    Path(name).write_text("# T_scan_part\n1,0,0,5\n0,1,0,5\n0,0,1,5\n0,0,0,1\n", encoding="ascii")
    told = f"sicp-cam: error: {name}: this is a pose, a 4x4 matrix; give it with --align\n"
    assert run("inspect", name) == (3, "", told)
    assert not asked


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--units", "feet"], 2, "Choose from"),
        (["--set", "limits.point=1"], 2, "limits.point: unknown key; did you mean points?"),
        (["--set", "limits.points=1.5"], 2, "limits.points: must be a whole number, not '1.5'"),
    ],
)
def test_inspect_refuses_what_is_wrong(run, files, asked, words, code, told):
    assert run("inspect", "scan.ply", *words)[0] == code
    assert told in run("inspect", "scan.ply", *words)[2]
    assert not asked


def test_plugins_lists_every_reader_and_post(run, files):
    code, out, _ = run("plugins")
    rows = [line.split() for line in out.splitlines()]
    assert code == 0
    assert ["scan", ".ply", "sicp_formats.ply:read_scan", "sicp-cam"] in [row[:4] for row in rows]
    assert ["post", "val3", "sicp_postprocessors.val3:Val3", "sicp-cam"] in [row[:4] for row in rows]
    assert ["check", ".nc", "sicp_formats.gcode.check:check", "sicp-cam"] in [row[:4] for row in rows]


def test_plugins_as_json(run, files):
    code, out, _ = run("plugins", "--json")
    document = json.loads(out)
    assert (code, document["status"], document["exit_code"]) == (0, "ok", 0)
    assert {"group", "name", "value", "owner", "override"} == set(document["plugins"][0])
    assert document["findings"] == []


def test_a_post_is_told_option_by_option(run, files):
    code, out, err = run("plugins", "gcode")
    lines = out.splitlines()
    assert (code, err) == (0, "")
    assert lines[0].startswith("gcode: postprocessor, sicp_postprocessors.gcode:GCode, from sicp-cam ")
    assert "  moves: tips, tool axes and feeds" in lines and "  events: comment, coolant" in out
    assert any("[options.post.gcode]" in line for line in lines)
    at = lines.index("  --set post.gcode.kinematics=...  AC, BC or AB; default AC")
    assert lines[at + 1].startswith("      Head with both rotary axes")
    assert max(map(len, lines)) <= 120


def test_a_reader_is_told_option_by_option(run, files):
    code, out, _ = run("plugins", "path.nc")
    lines = out.splitlines()
    assert (code, lines[0].partition(",")[0]) == (0, "path.nc: reader of a path")
    assert "  --set path.rotary=...  text, or none; default none" in lines
    assert "  --set path.block_skip=...  true or false; default true" in lines
    assert "      True to leave out blocks that begin with a slash, False to read them." in lines
    assert not [line for line in lines if "path.limits" in line or "path.units" in line]
    assert "--set path.format=... " in run("plugins", "path.apt")[1]


def test_a_checker_is_told_option_by_option(run, files):
    code, out, _ = run("plugins", "check.nc")
    lines = out.splitlines()
    assert (code, lines[0].partition(",")[0]) == (0, "nc: checker of programs with that suffix")
    assert "on the command line of check:" in lines
    assert "  --set check.line_length=...  whole number; default 255" in lines


def test_a_name_that_several_have_tells_of_all(run, files):
    document = json.loads(run("plugins", "csv", "--json")[1])
    assert [(one["role"], one["name"]) for one in document["plugins"]] == [
        ("post", "csv"),
        ("scan", "scan.csv"),
        ("out", "scan.csv"),
        ("path", "path.csv"),
        ("check", "csv"),
    ]
    assert document["plugins"][0]["options"] is not None
    flags = {option["name"]: option["flag"] for option in document["plugins"][1]["options"]}
    assert flags["decimal"] == "--set scan.decimal=..."
    assert run("plugins", ".dxf")[1] == run("plugins", "path.dxf")[1]


@pytest.mark.parametrize(
    ("entry", "source", "told"),
    [
        ("[sicp_cam.formats]\nscan.odd = odd:read", "raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("[sicp_cam.formats]\nscan.ply = odd:read", "read = len", "scan.ply: claimed by "),
    ],
)
def test_check_fails_where_a_plug_in_is_of_no_use(run, files, tmp_path, monkeypatch, entry, source, told):
    info = tmp_path / "odd-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(entry, encoding="utf-8")
    (tmp_path / "odd.py").write_text(source, encoding="utf-8")
    assert run("plugins", "--check")[0] == 0
    monkeypatch.syspath_prepend(str(tmp_path))
    code, out, err = run("plugins", "--check", "-q")
    assert (code, err.count("\n")) == (2, 1)
    assert told in err and err.startswith("sicp-cam: error: ")
    assert "scan" in out
    code, out, _ = run("plugins", "--check", "--json")
    document = json.loads(out)
    assert (code, document["exit_code"], document["status"]) == (2, 2, "fail")
    assert told in document["findings"][0]["message"]
    assert run("plugins")[0] == 0


def test_settings_lists_every_setting_with_type_default_and_meaning(run, files):
    code, out, err = run("settings")
    lines = out.splitlines()
    assert (code, err) == (0, "")
    for name, kind in TABLES.items():
        assert [line for line in lines if line.startswith(f"job file, [{name}]: ")]
        for field in dataclasses.fields(kind):
            (line,) = [line for line in lines if line.startswith(f"  --set {name}.{field.name}=...  ")]
            assert line.endswith(f"; default {written(field.default)}")
    at = lines.index("  --set gates.coverage=...  number from 0 to 1; default 0.5")
    assert lines[at + 1] == "      Least fraction of the contour on which the scan must show the edge."
    assert "  --dry-run  true or false; default false" in lines
    assert "  --cad  file name; must be given" in lines


def test_settings_of_one_table_as_json(run, files):
    document = json.loads(run("settings", "registration", "--json")[1])
    (table,) = document["settings"].values()
    assert table[0] | {"text": ""} == {
        "name": "segments",
        "type": "whole number from 1 to 10000, or none",
        "default": "none",
        "text": "",
        "flag": "--set registration.segments=...",
    }


def test_doctor_names_the_package_of_a_missing_library(run, files, monkeypatch):
    from sicp_cam.cli import doctor

    missing = "raise ImportError('libGL.so.1: cannot open shared object file: No such file or directory')"
    monkeypatch.setattr(doctor, "_TRIALS", {"CAD kernel": missing, "pictures": "import os; os.abort()"})
    code, out, err = run("doctor")
    assert (code, out) == (2, "")
    kernel, pictures = err.splitlines()
    told = "CAD kernel: the system library libGL.so.1 is missing; on Debian or Ubuntu: apt-get install libgl1"
    assert kernel == f"sicp-cam: error: {told}"
    assert pictures.startswith("sicp-cam: error: pictures: ended with exit code -6; on Debian or Ubuntu try: ")


def test_doctor_lists_versions_where_all_is_well(run, files, monkeypatch):
    from sicp_cam.cli import doctor

    monkeypatch.setattr(doctor, "_TRIALS", {"CAD kernel": "print('chatter')"})
    code, out, err = run("doctor", "--json")
    document = json.loads(out)
    assert (code, err, document["trials"]) == (0, "", {"CAD kernel": "ok"})
    assert document["versions"]["numpy"][0].isdigit()
    assert run("doctor", "-q") == (0, "", "")


@pytest.mark.parametrize("words", [["--help"], ["correct", "--help"], ["inspect", "-h"], []])
def test_help_tells_of_commands_and_exit_codes(run, files, words):
    code, out, err = run(*words)
    assert (code, err) == (0, "")
    assert "Usage: sicp-cam" in out
    assert "Exit codes" in out


def test_the_help_of_correct_names_every_flag_of_the_contract(run, files):
    flags = (
        "cad scan path post out name method contour align frame cad-units scan-units path-units report set dry-run "
        "force strict override json quiet verbose log-file"
    )
    out = run("correct", "--help")[1]
    assert [flag for flag in flags.split() if f"--{flag} " not in out and f"--{flag}\n" not in out] == []
    assert "--no-" not in out and "--empty-" not in out


def test_the_help_of_correct_shows_every_default_choice_and_where_more_is_listed(run, files):
    out = " ".join(run("correct", "--help")[1].replace("\u2502", " ").split())
    flags = dict(part.partition(" ")[::2] for part in out.split(" --")[1:])
    for field in dataclasses.fields(Job):
        flag = field.name.replace("_", "-")
        if field.name in TABLES or field.name.endswith("_options") or field.default is dataclasses.MISSING:
            continue
        shown = "as the file states, else mm" if flag.endswith("units") else written(field.default)
        assert f"[default: {shown}]" in flags[flag], flag
    assert [gate for gate in GATES if gate not in flags["override"]] == []
    assert [method for method in METHODS if method not in flags["method"]] == []
    assert "'sicp-cam settings'" in out and "'sicp-cam plugins val3'" in out


def test_version(run, files):
    from importlib.metadata import version

    assert run("--version") == (0, f"{version('sicp-cam')}\n", "")
