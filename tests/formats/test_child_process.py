"""A child process that hangs, crashes, prints or asks for too much memory must not take the parent along."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from textwrap import dedent, indent

import numpy as np
import pytest

from sicp_cam import child_process
from sicp_cam.child_process import ChildCrashError, ChildTimeoutError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and memory limits are POSIX")


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Return a function that makes an importable module whose `main(folder, told)` has the given body."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))

    def made(body: str) -> str:
        head = "import os, signal, sys, time\nfrom pathlib import Path\nimport numpy as np\n"
        head += "from sicp_cam.child_process import answer, received\n"
        main = f"folder = Path(sys.argv[1])\ntold = received(folder)\n{dedent(body)}"
        (tmp_path / "made_child.py").write_text(f"{head}if __name__ == '__main__':\n{indent(main, '    ')}\n")
        return "made_child"

    return made


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_values_and_arrays_go_there_and_back(module):
    name = module("answer(folder, {'twice': told.values['n'] * 2}, {'double': told.arrays['a'] * 2})")
    sent = np.array([[1.0, 1e-300], [-0.0, 3.0]])
    result = child_process.run(name, {"n": 21}, {"a": sent}, timeout_s=30)
    assert result.values == {"twice": 42}
    np.testing.assert_array_equal(result.arrays["double"], sent * 2)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_hang_ends_in_time_with_all_its_children(module, tmp_path):
    pids = tmp_path / "pids"
    name = module(f"""
        import subprocess
        other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        Path({str(pids)!r}).write_text(f"{{os.getpid()}} {{other.pid}}")
        time.sleep(60)
    """)
    began = time.monotonic()
    with pytest.raises(ChildTimeoutError, match=r"no answer within 2 s"):
        child_process.run(name, {}, timeout_s=2)
    assert time.monotonic() - began < 6
    for pid in map(int, pids.read_text().split()):
        deadline = time.monotonic() + 5
        while is_alive(pid) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert not is_alive(pid)


@pytest.mark.parametrize("signal_name", ["SIGSEGV", "SIGABRT"])
def test_death_by_signal_is_named(module, signal_name):
    name = module(f"os.kill(os.getpid(), signal.{signal_name})")
    with pytest.raises(ChildCrashError, match=f"ended by {signal_name}"):
        child_process.run(name, {}, timeout_s=30)


def test_exit_code_and_last_words_are_told_on_one_safe_line(module):
    name = module("print('first'); print('bad \\x1b[31mnews', file=sys.stderr, flush=True); sys.exit(3)")
    with pytest.raises(ChildCrashError) as caught:
        child_process.run(name, {}, timeout_s=30)
    assert str(caught.value).startswith("ended with exit code 3: ")
    assert "news" in str(caught.value)
    assert str(caught.value).isprintable()


def test_end_without_answer_is_a_crash(module):
    with pytest.raises(ChildCrashError, match="ended with exit code 0"):
        child_process.run(module("pass"), {}, timeout_s=30)


def test_half_an_answer_is_none(module):
    name = module("(folder / 'result.json.part').write_text('{'); os.kill(os.getpid(), signal.SIGKILL)")
    with pytest.raises(ChildCrashError, match="SIGKILL"):
        child_process.run(name, {}, timeout_s=30)


def test_crash_after_the_answer_loses_nothing(module):
    name = module("answer(folder, {'done': True}); os.kill(os.getpid(), signal.SIGSEGV)")
    assert child_process.run(name, {}, timeout_s=30).values == {"done": True}


def test_answer_that_is_not_finite_is_a_crash(module):
    with pytest.raises(ChildCrashError, match="not JSON compliant"):
        child_process.run(module("answer(folder, {'x': float('nan')})"), {}, timeout_s=30)


def test_memory_limit_holds(module):
    name = module("answer(folder, {'n': len(np.ones(400_000_000))})")
    with pytest.raises(ChildCrashError, match="Unable to allocate"):
        child_process.run(name, {}, timeout_s=30, memory_bytes=2 * 2**30)


def test_output_of_the_child_stays_off_ours(module, capfd):
    name = module("print('chatter', flush=True); os.write(1, b'more'); os.write(2, b'noise'); answer(folder, {})")
    child_process.run(name, {}, timeout_s=30)
    assert capfd.readouterr() == ("", "")


def test_folder_is_removed(module):
    result = child_process.run(module("answer(folder, {'folder': str(folder)})"), {}, timeout_s=30)
    assert not Path(result.values["folder"]).exists()
