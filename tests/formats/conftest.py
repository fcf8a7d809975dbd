"""What the tests of the CAD readers share: the child's work done here, and shapes of the CAD kernel."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sicp_cam.child_process import ChildResult
from sicp_formats.cad import part as cad_part

# Tests are imported by path (importlib mode); the programs that they share stand beside them.
sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def in_process(monkeypatch, tmp_path):
    """Let the child's work be done here: the kernel is loaded already, and a process start costs a second."""
    from sicp_formats.cad import child as step_child

    def run(module, request, arrays, *, timeout_s, memory_bytes):
        assert module == step_child.__name__
        folder = tmp_path / "child"
        folder.mkdir(exist_ok=True)
        (folder / "request.json").write_text(json.dumps({"request": request, "memory_bytes": None}))
        np.savez(folder / "arrays.npz", **arrays)
        step_child.main(folder)
        with np.load(folder / "result.npz") as stored:
            return ChildResult(json.loads((folder / "result.json").read_text()), dict(stored))

    monkeypatch.setattr(cad_part, "child_process", SimpleNamespace(**vars(cad_part.child_process) | {"run": run}))
    return run
