import json
from pathlib import Path

import pytest

from sicp_cam.limits import Limits

DOCUMENT = {
    "role": "scan",
    "count": 3,
    "bounds_mm": [[0.0, 0.0, 0.0], [1.0, 2.5, 3.0]],
    "units": None,
    "findings": [{"code": 101, "message": "odd\x1b"}],
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
    words = ["--units", "inch", "--picture", "p.png", "--set", "decimal=,", "--set", "scan.columns=x,y,z"]
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
                "limits": Limits(points=9),
            },
        )
    ]
    assert out.splitlines() == [
        "role: scan",
        "count: 3",
        "bounds_mm:",
        "  1: 0, 0, 0",
        "  2: 1, 2.5, 3",
        "units: -",
        "findings:",
        "  1:",
        "    code: 101",
        "    message: odd\\x1b",
    ]


def test_inspect_finds_the_role_or_asks_for_it(run, files, asked):
    assert run("inspect", "part.step", "--json")[:2] == (0, json.dumps(DOCUMENT, indent=2) + "\n")
    assert asked[0][1]["role"] == "part"
    code, _, err = run("inspect", "mesh.stl")
    assert (code, err) == (2, "sicp-cam: error: mesh.stl: may be a scan or a part; say which with --role\n")
    code, _, err = run("inspect", "movie.mp4")
    assert (code, err) == (3, "sicp-cam: error: movie.mp4: nothing reads this suffix; see sicp-cam plugins\n")


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--units", "feet"], 3, "unknown unit 'feet'"),
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


def test_plugins_as_json(run, files):
    code, out, _ = run("plugins", "--json")
    document = json.loads(out)
    assert code == 0
    assert {"group", "name", "value", "owner", "override"} == set(document["plugins"][0])
    assert document["findings"] == []


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


def test_version(run, files):
    from importlib.metadata import version

    assert run("--version") == (0, f"{version('sicp-cam')}\n", "")
