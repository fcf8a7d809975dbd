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


@pytest.mark.parametrize("words", [["--help"], ["correct", "--help"], ["correct"], ["plugins"], ["settings"]])
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


PLUGIN = """
import time
from sicp_cam import child_process
from sicp_cam.model import Part, TriangleMesh

def read_part(path, *, units=None, limits=None):
    child_process.run("slow_child", {}, timeout_s=60)

def read_small_part(path, *, units=None, limits=None):
    return Part((), TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))

def read_scan(path, *, units=None, limits=None):
    open("working", "w").write("0")
    time.sleep(60)
"""
CHILD = "import os, time\nopen('working', 'w').write(str(os.getpid()))\ntime.sleep(60)"


@pytest.mark.parametrize(
    "readers", ["part.step = slow:read_part", "part.step = slow:read_small_part\nscan.ply = slow:read_scan"]
)
def test_an_interrupt_ends_the_reading_of_a_slow_file_at_once(files, tmp_path, readers):
    """The part is read in a child process, which is ended; the scan in a thread beside it, which is not waited for."""
    plugin = tmp_path / "plugin"
    info = plugin / "slow-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: slow\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[sicp_cam.formats.override]\n{readers}\n", encoding="utf-8")
    (plugin / "slow.py").write_text(PLUGIN, encoding="utf-8")
    (plugin / "slow_child.py").write_text(CHILD, encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    line = [sys.executable, "-B", "-m", "sicp_cam", "correct", *files]
    variables = {**os.environ, "PYTHONPATH": str(plugin)}
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True, env=variables) as process:
        child = int(content_of(Path("working")))
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        err = process.communicate(timeout=30)[1]
        seconds = time.monotonic() - start
    assert (process.returncode, err) == (130, "sicp-cam: error: interrupted\n")
    assert seconds < 2.0
    if child:
        with pytest.raises(ProcessLookupError):
            os.kill(child, 0)
    Path("working").unlink()
    assert sorted(tmp_path.iterdir()) == before


def content_of(file):
    """Wait for a file that another process writes, and return what it holds."""
    end = time.monotonic() + 30.0
    while not (file.exists() and file.read_text(encoding="ascii")):
        assert time.monotonic() < end
        time.sleep(0.02)
    return file.read_text(encoding="ascii")


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
