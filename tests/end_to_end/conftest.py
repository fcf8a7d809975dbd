"""Runs of the sample jobs, shared by the tests of this room, and the measure of a corrected path against the truth."""

import csv
import json
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import sicp_cam
from sicp_cam import plugins
from sicp_cam.cli import main

SAMPLES = Path(__file__).parents[2] / "samples"
PATHS = {"porthole": "path.apt", "nosecone": "path.apt", "disc": "path.nc"}


def inputs(name):
    folder = SAMPLES / name
    return {"cad": folder / "part.step", "scan": folder / "scan.ply", "path": folder / PATHS[name]}


def words(name, out, **changes):
    """Return the words of a run with one job, its options from `changes`; None leaves one out."""
    stated = {**inputs(name), "align": SAMPLES / name / "pose_rough.txt", "name": name, "post": "csv", "report": "none"}
    stated["scan-units"] = "mm"
    stated |= {key.replace("_", "-"): value for key, value in changes.items()}
    return ["correct", *(str(w) for k, v in stated.items() if v is not None for w in (f"--{k}", v)), "--out", str(out)]


# ---- the measure ----


def table(file):
    with Path(file).open(newline="", encoding="ascii") as stream:
        return list(csv.DictReader(stream))


def moves(rows, cutting=True):
    chosen = [row for row in rows if not cutting or row["status"] != "approach"]
    numbers = np.array([[float(row[c]) for c in "xyzijk"] for row in chosen])
    return numbers[:, :3], numbers[:, 3:]


def deviation(tips, axes, true):
    """Compare a path with the true edge: at each true point, the nearest place of the polyline through the tips.

    `normal` is the distance across the edge in the surface, + into the material, `out` that out of the surface, `both`
    their hypotenuse, in mm; `axis` the angle between tool axis and true normal in degrees. Sliding along is no error.
    """
    q = true["path_true"]
    tips, axes = np.vstack([tips, tips[:1]]), np.vstack([axes, axes[:1]])
    _, near = cKDTree(tips).query(q, k=4)
    best, foot, axis = np.full(len(q), np.inf), np.zeros_like(q), np.zeros_like(q)
    for left in np.clip(np.concatenate([near - 1, near], axis=1), 0, len(tips) - 2).T:
        step = tips[left + 1] - tips[left]
        t = np.sum((q - tips[left]) * step, axis=1) / np.maximum(np.sum(step * step, axis=1), 1e-18)
        t = np.clip(t, 0.0, 1.0)[:, None]
        place = tips[left] + t * step
        distance = np.linalg.norm(place - q, axis=1)
        nearer = distance < best
        best[nearer], foot[nearer] = distance[nearer], place[nearer]
        axis[nearer] = (axes[left] + t * (axes[left + 1] - axes[left]))[nearer]
    offset = foot - q
    normal, out = np.sum(offset * true["inward"], axis=1), np.sum(offset * true["axis_true"], axis=1)
    cosine = np.sum(axis * true["axis_true"], axis=1) / np.linalg.norm(axis, axis=1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return SimpleNamespace(normal=normal, out=np.abs(out), both=np.hypot(normal, out), axis=angle)


@cache
def truth(name):
    with np.load(SAMPLES / name / "truth.npz", allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


# ---- runs ----


@pytest.fixture(scope="session", autouse=True)
def parts_read_once():
    """Let the CAD kernel read each STEP file once; how it reads them is tested with the formats."""
    read, known = plugins.read_part, {}

    def read_once(path, **options):
        file = Path(path)
        if not file.exists():
            return read(path, **options)
        stated = tuple(sorted((name, repr(value)) for name, value in options.items() if value))
        key = (file.resolve(), file.stat().st_mtime_ns, stated)
        if key not in known:
            known[key] = read(path, **options)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plugins, "read_part", read_once)
        yield


@pytest.fixture(scope="session")
def corrections():
    """Correct a sample through the Python face, once for each set of settings."""
    known = {}

    def correction(name, **settings):
        if name != "nosecone":
            settings = {"align": SAMPLES / name / "pose_rough.txt", **settings}
        key = (name, repr(sorted(settings.items())))
        if key not in known:
            stated = {**inputs(name), "name": name, **settings}
            known[key] = sicp_cam.correct(**stated)
        return known[key]

    return correction


@pytest.fixture(scope="session")
def command(tmp_path_factory):
    """Run the command in a process of its own."""

    def run(*arguments, folder=None, check=True):
        line = [sys.executable, "-m", "sicp_cam", *(str(argument) for argument in arguments)]
        done = subprocess.run(
            line, capture_output=True, text=True, check=False, cwd=folder or tmp_path_factory.mktemp("cwd")
        )
        assert not check or done.returncode == 0, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def disc_run(command, tmp_path_factory):
    """The disc as its job file says, with all programs, the report and its pictures."""
    out = tmp_path_factory.mktemp("disc") / "out"
    done = command("correct", SAMPLES / "disc" / "job.toml", "--out", out, "--json")
    return SimpleNamespace(out=out, document=json.loads(done.stdout), stdout=done.stdout, stderr=done.stderr)


def tree(folder):
    """Return every file below a folder with its bytes."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


@pytest.fixture
def cli(capfd):
    """Run the command line in this process, which spares it the start; what native code writes counts too."""

    def call(*arguments):
        capfd.readouterr()
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        captured = capfd.readouterr()
        return SimpleNamespace(code=caught.value.code, out=captured.out, err=captured.err)

    return call


@pytest.fixture
def refused(cli, tmp_path):
    """Run the command line and demand what every failure promises: its code, one clear line, and nothing written."""

    def call(code, *arguments):
        before = tree(tmp_path)
        done = cli(*arguments)
        assert done.code == code, done.err
        assert done.out == ""
        assert done.err.startswith("sicp-cam: error: ")
        assert done.err.count("\n") == 1 and done.err.endswith("\n")
        assert done.err[:-1].isprintable()
        assert tree(tmp_path) == before
        assert not (tmp_path / "out").exists()
        return done.err

    return call


def write_ply(file, points, normals=None):
    columns = "xyz" if normals is None else ("x", "y", "z", "nx", "ny", "nz")
    rows = points if normals is None else np.hstack([points, normals])
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property double {column}" for column in columns] + ["end_header\n"]
    file.write_bytes("\n".join(head).encode() + rows.astype("<f8").tobytes())
    return file


def write_stl(file, mesh):
    a, b, c = (mesh.vertices_mm[mesh.faces[:, i]] for i in range(3))
    facets = np.zeros(len(a), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    facets["c"] = np.stack([a, b, c], axis=1)
    file.write_bytes(b"made by a test".ljust(80) + struct.pack("<I", len(facets)) + facets.tobytes())
    return file


@pytest.fixture(scope="session")
def bench():
    """Give the functions of this module to the tests."""
    return SimpleNamespace(
        SAMPLES=SAMPLES, inputs=inputs, words=words, table=table, moves=moves, deviation=deviation, truth=truth,
        tree=tree, write_ply=write_ply, write_stl=write_stl,
    )  # fmt: skip
