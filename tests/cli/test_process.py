"""What only a process of its own shows: start-up, signals, pipes, terminals."""

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SETUP = """
import sys, time, types
import sicp_cam
def correct(job, progress):
    {body}
def outcome(lines):
    return types.SimpleNamespace(document={{}}, exit_code=0, lines=lines)
sicp_cam.pipeline = sys.modules["sicp_cam.pipeline"] = types.SimpleNamespace(correct=correct)
from sicp_cam.cli import main
main(sys.argv[1:])
"""
HEAVY = {"OCP", "cadquery", "vtk", "vtkmodules", "pyvista", "matplotlib", "reportlab", "ezdxf", "numpy", "scipy"}


def command(body, *words):
    return [sys.executable, "-c", SETUP.format(body=body), *words]


def test_the_module_is_the_command(files):
    run = subprocess.run([sys.executable, "-m", "sicp_cam", "--version"], capture_output=True, text=True, check=True)
    assert run.stdout.strip()[0].isdigit()


@pytest.mark.parametrize("words", [["--help"], ["correct", "--help"], ["correct"], ["plugins"]])
def test_nothing_heavy_is_loaded_before_there_is_work(files, words):
    script = (
        "import sys\nfrom sicp_cam.cli import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit:\n    pass\n"
        "print('loaded', *{name.split('.')[0] for name in sys.modules})"
    )
    run = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=True)
    loaded = run.stdout.splitlines()[-1].split()
    assert loaded[0] == "loaded"
    assert not HEAVY & set(loaded)


@pytest.mark.parametrize(
    ("number", "code", "told"),
    [
        (signal.SIGINT, 130, "interrupted"),
        (signal.SIGTERM, 143, "ended by SIGTERM"),
        (signal.SIGHUP, 129, "ended by SIGHUP"),
    ],
)
def test_a_signal_unwinds_the_work_and_has_its_code(files, number, code, told):
    body = "\n    ".join(
        ["try: print('working', file=sys.stderr, flush=True); time.sleep(30)", "finally: open('undone', 'w').close()"]
    )
    with subprocess.Popen(
        command(body, "correct", *files), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as p:
        assert p.stderr.readline() == "working\n"
        time.sleep(0.05)
        p.send_signal(number)
        out, err = p.communicate(timeout=10)
    assert (p.returncode, out, err) == (code, "", f"sicp-cam: error: {told}\n")
    assert Path("undone").exists()


def test_a_reader_that_goes_away_is_no_error(files):
    read_end, write_end = os.pipe()
    os.close(read_end)
    run = subprocess.run(
        command("return outcome(['x' * 100_000] * 3)", "correct", *files),
        stdout=write_end, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    os.close(write_end)
    assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.parametrize("words", [["--help"], ["plugins"]])
def test_help_and_lists_survive_a_reader_that_goes_away(files, words):
    read_end, write_end = os.pipe()
    os.close(read_end)
    run = subprocess.run(
        [sys.executable, "-m", "sicp_cam", *words], stdout=write_end, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write_end)
    assert (run.returncode, run.stderr) == (0, "")


def test_closed_streams_and_a_poor_environment_do_no_harm(files):
    variables = {
        "PATH": os.environ["PATH"],
        "LC_ALL": "C",
        "PYTHONIOENCODING": "ascii",
        "TERM": "dumb",
        "HOME": "/nowhere",
    }
    words = command("return outcome(['Türrahmen'])", "correct", *files)
    run = subprocess.run(words, capture_output=True, env=variables, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (0, b"T\\xfcrrahmen\n", b"")
    closed = subprocess.run(["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *words], env=variables, check=False)
    assert closed.returncode == 0


@pytest.mark.parametrize(("terminal", "shown"), [("xterm", True), ("dumb", False)])
def test_a_bar_shows_on_a_terminal_that_can_move_its_cursor_and_leaves_stdout_alone(files, terminal, shown):
    leader, follower = pty.openpty()
    body = "progress('register', 0.5); time.sleep(0.3); return outcome(['done'])"
    environment = {**os.environ, "TERM": terminal}
    run = subprocess.run(
        command(body, "correct", *files), stdout=subprocess.PIPE, stderr=follower, env=environment, check=False
    )
    os.close(follower)
    try:
        seen = os.read(leader, 100_000)
    except OSError:
        seen = b""
    os.close(leader)
    assert (run.returncode, run.stdout) == (0, b"done\n")
    assert (b"register" in seen) is shown
