"""Run a module in a child process that may hang or crash without taking us along.

CAD kernels and renderers are native code that a strange file can stop for ever or bring down. The child gets a folder
with `request.json` and `arrays.npz`, writes `result.json` and `result.npz` into it, and is ended with all its own
children when the time is up.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import printable

__all__ = ["ChildCrashError", "ChildResult", "ChildTimeoutError", "answer", "received", "run"]


class ChildCrashError(RuntimeError):
    """The child ended without an answer; the message names the signal or exit code and its last words."""


class ChildTimeoutError(RuntimeError):
    """The child did not answer in time and was ended."""


@dataclass(frozen=True, slots=True, eq=False)
class ChildResult:
    """What the child answered: JSON-like values, and arrays by name."""

    values: dict[str, Any]
    arrays: dict[str, npt.NDArray[Any]]


def run(
    module: str,
    request: Mapping[str, Any],
    arrays: Mapping[str, npt.NDArray[Any]] | None = None,
    *,
    timeout_s: float,
    memory_bytes: int | None = None,
) -> ChildResult:
    """Run `python -m module FOLDER` and return its answer.

    Parameters
    ----------
    module
        A module that calls `received` and `answer` when it is run as a script.
    request, arrays
        What the child is told: JSON values, and arrays by name.
    timeout_s
        Wall-clock limit.
    memory_bytes
        Limit on the child's address space, where the system has such a thing.

    Raises
    ------
    ChildTimeoutError, ChildCrashError
        If no answer came; everything that the child printed is kept out of our own output.
    """
    with tempfile.TemporaryDirectory(prefix="sicp-cam-") as name:
        folder = Path(name)
        told = {"request": dict(request), "memory_bytes": memory_bytes}
        (folder / "request.json").write_text(json.dumps(told, allow_nan=False), encoding="utf-8")
        np.savez(folder / "arrays.npz", allow_pickle=False, **(arrays or {}))
        with (folder / "output.txt").open("wb") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", module, str(folder)],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                code = process.wait(timeout_s)
            except subprocess.TimeoutExpired:
                raise ChildTimeoutError(f"no answer within {timeout_s:g} s") from None
            finally:
                _end(process)
        if not (folder / "result.json").exists():
            raise ChildCrashError(f"{_how_it_ended(code)}{_last_words(folder / 'output.txt')}")
        values = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        with np.load(folder / "result.npz", allow_pickle=False) as stored:
            return ChildResult(values, {key: stored[key] for key in stored.files})


def received(folder: Path) -> ChildResult:
    """Return what the parent told this child, after putting the memory limit in force."""
    told = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    if told["memory_bytes"] and sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (told["memory_bytes"], told["memory_bytes"]))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        return ChildResult(told["request"], {key: stored[key] for key in stored.files})


def answer(folder: Path, values: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]] | None = None) -> None:
    """Hand the child's answer to the parent; the JSON file is written last and whole, so half an answer is none."""
    np.savez(folder / "result.npz", allow_pickle=False, **(arrays or {}))
    draft = folder / "result.json.part"
    draft.write_text(json.dumps(dict(values), allow_nan=False), encoding="utf-8")
    draft.replace(folder / "result.json")


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _how_it_ended(code: int) -> str:
    return f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def _last_words(output: Path) -> str:
    lines = [line for line in output.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    return f": {printable(lines[-1])}" if lines else ""
