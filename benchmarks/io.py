"""Measure how fast files are read, each against the plainest way to get the same numbers, in one run.

    python benchmarks/io.py [--points N] [--triangles N] [--lines N] [--repeats N] [--json FILE]

Prints one row per format: seconds here, seconds of the reference, their ratio, and the ratio that must not be exceeded.
Both are run in turn, `repeats` times; the ratio is the median of the ratios of each turn. Programs have no reference:
their row tells lines a second, with the least that is wanted. `memory` is the most memory that a process took beyond
what it had before it read, over the size of the arrays that it got.

References: binary PLY `numpy.fromfile` and one float64 copy; text `pandas.read_csv(engine="c")`, which since pandas 3.1
parses on all cores, and again by `chunksize`, on one core; STL `trimesh.load`. Memory is measured on Linux only.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import trimesh

from sicp_cam import plugins

_MEMORY = """
import re, sys
from pathlib import Path
import pandas
from sicp_cam import plugins
import sicp_formats.ascii

def most_kib():  # ru_maxrss would be that of the process that started this one
    return int(re.search("VmHWM:\\s*([0-9]+) kB", Path("/proc/self/status").read_text()).group(1))

before = most_kib()
scan = plugins.read_scan(Path(sys.argv[1]))
print(most_kib() - before, scan.points_mm.nbytes + (0 if scan.normals is None else scan.normals.nbytes))
"""


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: `value` must not exceed `limit`, or, for lines a second, not fall below it."""

    what: str
    seconds: float
    reference_seconds: float | None
    value: float
    limit: float
    unit: str

    @property
    def kept(self) -> bool:
        """Whether the limit is kept."""
        return self.value >= self.limit if self.unit == "lines/s" else self.value <= self.limit


def compared(what: str, ours: Callable[[], object], reference: Callable[[], object], limit: float, repeats: int) -> Row:
    """Run two ways in turn and return the median of the ratios of their times."""
    times = [(seconds(ours), seconds(reference)) for _ in range(repeats)]
    return Row(
        what,
        statistics.median(own for own, _ in times),
        statistics.median(other for _, other in times),
        statistics.median(own / other for own, other in times),
        limit,
        "ratio",
    )


def seconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def sheet(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 3) points of a bent sheet in mm, and their unit normals."""
    random = np.random.default_rng(1)
    x, y = random.uniform(-1000.0, 1000.0, (2, points))
    normals = np.column_stack([-x / 1000.0, -y / 2000.0, np.ones(points)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.column_stack([x, y, x * x / 2000.0 + y * y / 4000.0]), normals


def ply(folder: Path, points: int, repeats: int) -> list[Row]:
    """Measure binary PLY, in singles and in doubles."""
    rows = []
    for name, code in (("float", "<f4"), ("double", "<f8")):
        file = folder / f"scan_{name}.ply"
        head = "".join(f"property {name} {column}\n" for column in ("x", "y", "z", "nx", "ny", "nz"))
        with file.open("wb") as stream:
            stream.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n{head}end_header\n".encode())
            begin = stream.tell()
            np.hstack(sheet(points)).astype(code).tofile(stream)

        def reference(file: Path = file, code: str = code, begin: int = begin) -> None:
            np.fromfile(file, code, offset=begin).reshape(-1, 6).astype(np.float64)

        what = f"PLY binary, {name}, {points} points with normals"
        rows.append(compared(what, lambda file=file: plugins.read_scan(file), reference, 1.5, repeats))
        file.unlink()
    return rows


def text(folder: Path, points: int, repeats: int) -> list[Row]:
    """Measure points as text, and the memory that reading them takes."""
    file = folder / "scan.xyzn"
    with file.open("w", encoding="ascii") as stream:
        for block in np.array_split(np.hstack(sheet(points)), max(1, points // 250_000)):
            np.savetxt(stream, block, fmt="%.4f %.4f %.4f %.6f %.6f %.6f")

    def reference() -> None:
        pd.read_csv(file, sep=" ", header=None, engine="c", dtype=np.float64)

    what = f"text, {points} points with normals"

    def on_one_core() -> None:
        for part in pd.read_csv(file, sep=" ", header=None, engine="c", dtype=np.float64, chunksize=100_000):
            part.to_numpy()

    rows = [compared(what, lambda: plugins.read_scan(file), reference, 1.3, repeats)]
    rows.append(compared(f"{what}: one core", lambda: plugins.read_scan(file), on_one_core, 1.3, repeats))
    if not Path("/proc/self/status").exists():
        return rows
    told = subprocess.run([sys.executable, "-c", _MEMORY, str(file)], capture_output=True, check=True, text=True)
    taken, held = map(int, told.stdout.split())
    rows.append(Row(f"{what}: memory", 0.0, None, taken * 1024 / held, 2.0, "ratio"))
    file.unlink()
    return rows


def stl(folder: Path, triangles: int, repeats: int) -> list[Row]:
    """Measure binary STL, its vertices merged."""
    side = max(2, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(np.linspace(-500.0, 500.0, side + 1), np.linspace(-500.0, 500.0, side + 1))
    vertices = np.column_stack([x.ravel(), y.ravel(), (x * x).ravel() / 2000.0]).astype(np.float32)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    faces = np.vstack([np.column_stack([corner, corner + 1, corner + side + 2]),
                       np.column_stack([corner, corner + side + 2, corner + side + 1])])  # fmt: skip
    facets = np.zeros(len(faces), [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = vertices[faces]
    file = folder / "scan.stl"
    file.write_bytes(bytes(80) + len(faces).to_bytes(4, "little") + facets.tobytes())
    what = f"STL binary, {len(faces)} triangles, vertices merged"
    rows = [compared(what, lambda: plugins.read_scan(file), lambda: trimesh.load(file), 0.5, repeats)]
    file.unlink()
    return rows


def programs(folder: Path, lines: int, repeats: int) -> list[Row]:
    """Measure programs in lines a second."""
    angle = np.linspace(0.0, 60.0, lines)
    tips = np.column_stack([500.0 * np.cos(angle), 500.0 * np.sin(angle), angle])
    axes = np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.full(lines, 0.99)])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    numbers = [(*tip, *axis) for tip, axis in zip(tips.tolist(), axes.tolist(), strict=True)]
    goto = ["GOTO/{:.4f},{:.4f},{:.4f},{:.6f},{:.6f},{:.6f}".format(*row) for row in numbers]
    three = ["X{:.4f} Y{:.4f} Z{:.4f}".format(*row[:3]) for row in numbers]
    vector = ["N1 G1 X{:.4f} Y{:.4f} Z{:.4f} I{:.6f} J{:.6f} K{:.6f}".format(*row) for row in numbers]
    siemens = ["X{:.4f} Y{:.4f} Z{:.4f} A3={:.6f} B3={:.6f} C3={:.6f}".format(*row) for row in numbers]
    heads = {
        "APT, six values": (".apt", ["UNITS/MM", "MULTAX/ON", "FEDRAT/1000,MMPM"], goto),
        "G-code, three axes": (".nc", ["G21 G90 G94", "G1 F1000."], three),
        "G-code, I J K": (".nc", ["G21 G90 G94 G43.5 H1", "G1 F1000."], vector),
        "G-code, A3= B3= C3=": (".mpf", ["G710 G90 G94", "TRAORI", "G1 F1000."], siemens),
    }
    rows = []
    for what, (suffix, head, body) in heads.items():
        file = folder / f"path{suffix}"
        file.write_text("\n".join([*head, *body, "M30" if suffix != ".apt" else "FINI", ""]), encoding="ascii")
        taken = statistics.median(seconds(lambda file=file: plugins.read_path(file)) for _ in range(repeats))
        rows.append(Row(f"{what}, {lines} lines", taken, None, lines / taken, 150_000, "lines/s"))
        file.unlink()
    return rows


def main() -> None:
    """Measure everything, print the table, and write it as JSON if that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=5_000_000)
    parser.add_argument("--triangles", type=int, default=2_000_000)
    parser.add_argument("--lines", type=int, default=200_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="sicp-cam-io-") as name:
        for measure, size in (
            (ply, given.points),
            (text, given.points),
            (stl, given.triangles),
            (programs, given.lines),
        ):
            for row in measure(Path(name), size, given.repeats):
                rows.append(row)
                against = "" if row.reference_seconds is None else f" of {row.reference_seconds:.2f} s"
                verdict = "kept" if row.kept else "MISSED"
                print(f"{row.what:55} {row.seconds:7.2f} s{against:12} {row.value:12.2f} {row.unit:8}"
                      f" limit {row.limit:g}: {verdict}", flush=True)  # fmt: skip
    if given.json:
        entries = [{**asdict(row), "kept": row.kept} for row in rows]
        given.json.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
