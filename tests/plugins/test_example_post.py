"""A postprocessor of a third party, as CONTRIBUTING.md describes it: one module, one entry point, and all commands."""

import json
import shutil
import subprocess
import sys
import tomllib
from email.message import Message
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from sicp_cam import plugins
from sicp_cam.cli import main
from sicp_cam.errors import JobError, PathError
from sicp_cam.model import Event, EventKind, Program, Status, ToolPath

PACKAGE = Path(__file__).parent / "example_post"
SAMPLES = Path(__file__).parents[2] / "samples"
APT = """UNITS/MM
LOADTL/4
SPINDL/9000,RPM,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/600,MMPM
GOTO/0,0,5,0,0.6,0.8
GOTO/9,0,5,0,0.6,0.8
FEDRAT/1200,MMPM
GOTO/9,9,5,0,0,1
FINI
"""
WRITTEN = """PROGRAM edge
BASE FLOOR
! edge
! sicp-cam {version}, converted and not corrected to any scan
! path edge.apt sha256 {sha}
! not a safety function: verify at reduced speed
TOOL 4
OUTPUT SPINDLE ON
GO 0.000 0.000 50.000 0.000000 0.000000 -1.000000
SPEED 10.0000
LINE 0.000 0.000 5.000 0.000000 -0.600000 -0.800000
LINE 9.000 0.000 5.000 0.000000 -0.600000 -0.800000
SPEED 20.0000
LINE 9.000 9.000 5.000 0.000000 0.000000 -1.000000
OUTPUT SPINDLE OFF
END
"""


def installed_into(folder):
    """Lay the package into a folder as an installer does: its module, and a dist-info made from its own pyproject."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text(encoding="utf-8"))
    about = project["project"]
    shutil.copy(PACKAGE / f"{project['tool']['setuptools']['py-modules'][0]}.py", folder)
    info = folder / f"{about['name'].replace('-', '_')}-{about['version']}.dist-info"
    info.mkdir()
    metadata = Message()
    for key, value in (("Metadata-Version", "2.1"), ("Name", about["name"]), ("Version", about["version"])):
        metadata[key] = value
    (info / "METADATA").write_text(metadata.as_string(), encoding="utf-8")
    groups = about["entry-points"].items()
    lines = [
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in named.items()) for group, named in groups
    ]
    (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")


@pytest.fixture
def acme(tmp_path, monkeypatch):
    """Have the package installed, and the work in a folder of its own with a path in it."""
    site, work = tmp_path / "site", tmp_path / "work"
    site.mkdir()
    work.mkdir()
    installed_into(site)
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.chdir(work)
    (work / "edge.apt").write_text(APT, encoding="ascii")
    yield site
    sys.modules.pop("acme_post", None)


@pytest.fixture
def cli(capsys):
    def call(*words):
        with pytest.raises(SystemExit) as caught:
            main([str(word) for word in words])
        out, err = capsys.readouterr()
        return caught.value.code, out, err

    return call


def program(tips=((0, 0, 50), (0, 0, 5), (9, 0, 5)), events=()):
    n = len(tips)
    rapid = np.arange(n) == 0
    path = ToolPath(tips, [[0, 0, 1]] * n, np.where(rapid, 0, 600), rapid, np.zeros(n, int), tuple(events))
    return Program("edge", path, (Status.APPROACH,) * n)


def test_it_is_listed_with_its_owner(acme, cli):
    code, out, err = cli("plugins", "--check")
    assert (code, err) == (0, "")
    assert ["post", "acme", "acme_post:Acme", "acme-post", "1.2.0"] in [line.split() for line in out.splitlines()]


def test_its_options_are_told_with_ranges_and_those_of_the_preflight(acme, cli):
    out = cli("plugins", "acme")[1]
    assert out.startswith("acme: postprocessor, acme_post:Acme, from acme-post 1.2.0\nprograms for the ACME arm\n")
    assert "--set post.acme.decimals=...  whole number from 1 to 6; default 3" in out
    assert "--set post.acme.base=...  floor or table; default floor" in out
    assert "--set post.acme.max_feed_mm_min=..." in out


@pytest.mark.parametrize("words", [[], ["--post", "acme"]])
def test_it_converts_a_path(acme, cli, words):
    code, out, err = cli("convert", "edge.apt", "edge.acme", *words)
    assert (code, err) == (0, "") and "wrote edge.acme: program, unit mm" in out
    sha = plugins.read_path(Path("edge.apt")).source.sha256[:16]
    told = Path("edge.acme").read_text(encoding="ascii")
    assert told == WRITTEN.format(version=version("sicp-cam"), sha=sha)


def test_a_process_of_its_own_finds_it(acme):
    line = [sys.executable, "-m", "sicp_cam", "convert", "edge.apt", "out.acme", "--set", "out.decimals=1", "--json"]
    done = subprocess.run(line, env={"PYTHONPATH": str(acme), "PATH": ""}, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["outputs"][0]["path"] == "out.acme"
    assert "LINE 9.0 9.0 5.0 0.0000 0.0000 -1.0000" in Path("out.acme").read_text(encoding="ascii")


def test_it_corrects_a_sample(acme, cli):
    out = acme.parent / "out"
    words = ["--post", "acme", "--out", out, "--report", "none", "--method", "rigid", "--set", "post.acme.base=table"]
    code, _, err = cli("correct", SAMPLES / "disc" / "job.toml", *words)
    assert code == 0, err
    text = (out / "disc.acme").read_text(encoding="ascii")
    document = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert text.startswith("PROGRAM disc\nBASE TABLE\n") and "corrected" not in text.splitlines()[-1]
    moves = document["correction"]["moves"]
    assert sum(line.startswith(("GO ", "LINE ")) for line in text.splitlines()) == moves
    assert [entry["path"] for entry in document["outputs"] if entry["kind"] == "program"] == ["disc.acme"]


def test_its_preflight_names_the_move(acme):
    post = plugins.postprocessor("acme", {"max_feed_mm_min": 500.0})
    short = program(tips=((0, 0, 50), (0, 0, 5), (0.01, 0, 5)), events=[Event(1, EventKind.COOLANT, 1.0)])
    found = {finding.code: finding for finding in post.preflight(short)}
    assert (found[9100].level.value, found[9100].where) == ("fail", "move 2")
    assert found[610].where.startswith("before move 1")  # coolant, for which it has no words
    assert found[661].level.value == "fail"
    with pytest.raises(PathError, match=r"post acme refuses 'edge': .*move 2: 0\.010 mm long"):
        post.write(short)
    assert [f.code for f in plugins.postprocessor("acme").preflight(program())] == [669]


def test_options_out_of_range_are_refused(acme, cli):
    with pytest.raises(JobError, match=r"decimals.*must be from 1 to 6, not 9"):
        plugins.postprocessor("acme", {"decimals": 9})
    code, _, err = cli("convert", "edge.apt", "edge.acme", "--set", "out.base=wall")
    assert code == 2 and "floor" in err and not Path("edge.acme").exists()
    with pytest.raises(JobError, match=r"no option 'decimal'; it has .*decimals"):
        plugins.postprocessor("acme", {"decimal": 2})


def test_without_it_nobody_knows_the_name(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "edge.apt").write_text(APT, encoding="ascii")
    assert cli("convert", "edge.apt", "edge.acme", "--post", "acme")[0] == 2
