import os
import sys
import types

import pytest

import sicp_cam


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Inputs that exist, in the current folder, and no SICP_* variables."""
    for name in [name for name in os.environ if name.startswith("SICP_")]:
        monkeypatch.delenv(name)
    for name in ("part.step", "scan.ply", "trim.apt"):
        (tmp_path / name).write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    return ["--cad", "part.step", "--scan", "scan.ply", "--path", "trim.apt", "--out", "out"]


@pytest.fixture
def stand_in(monkeypatch):
    """Put functions of this test in place of those of a heavy module."""

    def put(module, **functions):
        stand_in = types.SimpleNamespace(**functions)
        monkeypatch.setattr(sicp_cam, module, stand_in, raising=False)
        monkeypatch.setitem(sys.modules, f"sicp_cam.{module}", stand_in)

    return put


@pytest.fixture
def pipeline(stand_in):
    """Put a function of this test in place of `pipeline.correct`."""
    return lambda correct: stand_in("pipeline", correct=correct)


@pytest.fixture
def run(capsys):
    """Run the command line in this process; give exit code, stdout and stderr."""

    def call(*words):
        from sicp_cam.cli import main

        with pytest.raises(SystemExit) as caught:
            main([str(word) for word in words])
        captured = capsys.readouterr()
        return caught.value.code, captured.out, captured.err

    return call
