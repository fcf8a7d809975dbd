"""Measure how fast programs are written: every post, from a path to the bytes of its files, preflight included.

    python benchmarks/programs.py [--moves N] [--repeats N] [--only POST,...] [--json FILE]

Prints one row per post: moves, seconds (the best of the repeats: other work of the machine only adds), moves a second
and the least that is wanted, the size of what was written, and the most memory that a process took while it wrote, over
that size. Memory is measured on Linux only, in a process of its own. Ends with exit code 1 if a limit is missed.

The path is one as a correction leaves it: closed rounds at 0.5 mm a move, 4 mm above each other, tips and axes that
change with every move, three feeds, a retract after each round, and the events of a program. `same` writes the APT
program again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import plugins
from sicp_cam.model import Event, EventKind, Program, Status, ToolPath
from sicp_cam.plugins.registry import POSTPROCESSORS, owners

LIMITS = {"csv": 300_000.0, "gcode": 300_000.0, "val3": 150_000.0}
"""Moves a second that must not be missed; of the others `OTHER_LIMIT`, but for those that are no programs of moves."""
OTHER_LIMIT = 100_000.0
NO_LIMIT = ("dxf", "same")
MEMORY_LIMIT = 12.0
"""Most memory over the size of the files; `same` has none, as it holds the program that was read too."""

ROUND = 1_500
"""Moves from retract to retract."""
FEEDS_MM_MIN = (600.0, 1500.0, 3000.0)
STEP_MM, LEVEL_MM = 0.5, 4.0

_MEMORY = """
import re, sys
from pathlib import Path
sys.path.insert(0, sys.argv[3])
import programs

post, program = programs.prepared(sys.argv[1], int(sys.argv[2]))

def status(name):
    return int(re.search(name + ":\\\\s*([0-9]+) kB", Path("/proc/self/status").read_text()).group(1))

try:
    Path("/proc/self/clear_refs").write_text("5")  # so that the peak begins here
except OSError:
    pass
before = max(status("VmRSS"), status("VmHWM"))
files = post.write(program)
print(status("VmHWM") - before, sum(map(len, files.values())))
"""


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: `moves_per_s` must not fall below `limit`, `memory` not exceed `memory_limit`."""

    post: str
    moves: int
    seconds: float
    moves_per_s: float
    limit: float | None
    megabytes: float
    memory: float | None
    memory_limit: float | None

    @property
    def kept(self) -> bool:
        """Whether the limits are kept."""
        fast = self.limit is None or self.moves_per_s >= self.limit
        return fast and (self.memory is None or self.memory_limit is None or self.memory <= self.memory_limit)


def program(moves: int) -> Program:
    """Return a program of that many moves, as a correction leaves it."""
    index = np.arange(moves)
    angle = 2.0 * np.pi * (index % ROUND) / ROUND
    radius = STEP_MM * ROUND / (2.0 * np.pi) + 3.0 * np.sin(3.0 * angle)
    height = 2.0 * np.sin(2.0 * angle) + LEVEL_MM * (index // ROUND)
    tips = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    lean = 0.3 + 0.05 * np.sin(5.0 * angle)
    axes = np.column_stack([np.sin(lean) * np.cos(angle), np.sin(lean) * np.sin(angle), np.cos(lean)])
    turn = index % ROUND
    rapid = (turn == 0) | (turn == ROUND - 1)
    tips[rapid] += 20.0 * axes[rapid]
    feeds = np.where(rapid, 0.0, np.asarray(FEEDS_MM_MIN)[index * 7 // ROUND % len(FEEDS_MM_MIN)])
    path = ToolPath(tips, axes, feeds, rapid, index + 1, tuple(_events(moves)), name="opening")
    status = tuple(Status.APPROACH if fast else Status.COVERED for fast in rapid.tolist())
    return Program(
        "opening",
        path,
        status,
        notes=("a benchmark",),
        columns={"u_mm": 0.05 + 0.01 * np.sin(angle)},
        source_moves=index,
    )


def _events(moves: int) -> Iterator[Event]:
    yield Event(0, EventKind.TOOL, 1.0)
    yield Event(0, EventKind.SPINDLE, 12_000.0)
    for start in range(0, moves, ROUND):
        yield Event(start, EventKind.COMMENT, text=f"round {start // ROUND + 1}")
        yield Event(min(start + 1, moves), EventKind.COOLANT, 1.0)
        yield Event(min(start + ROUND - 1, moves), EventKind.COOLANT, 0.0)
    yield Event(moves, EventKind.SPINDLE, 0.0)


def prepared(name: str, moves: int) -> tuple[Any, Program]:
    """Return a post and the program that it is to write."""
    made = program(moves)
    post = plugins.postprocessor(name)
    if name != "same":
        return post, made
    with tempfile.TemporaryDirectory(prefix="sicp-cam-programs-") as folder:
        file = Path(folder) / "opening.apt"
        (content,) = plugins.postprocessor("apt").write(made).values()
        file.write_bytes(content)
        read = plugins.read_path(file)
    moved = replace(read, tips_mm=read.tips_mm + np.array([0.1, -0.2, 0.3]))
    return post, replace(made, path=moved, source_moves=np.arange(len(moved)), columns={})


def measured(name: str, moves: int, repeats: int) -> Row:
    """Measure one post."""
    post, made = prepared(name, moves)
    times = []
    for _ in range(repeats if name != "same" else 1):  # which keeps what it has written once
        start = time.perf_counter()
        files = post.write(made)
        times.append(time.perf_counter() - start)
    seconds = min(times)
    limit = None if name in NO_LIMIT else LIMITS.get(name, OTHER_LIMIT)
    size = sum(map(len, files.values()))
    most = None if name == "same" else MEMORY_LIMIT
    return Row(name, moves, seconds, moves / seconds, limit, size / 1e6, memory(name, moves), most)


def memory(name: str, moves: int) -> float | None:
    """Return the most memory that writing took, over the size of the files; None where it cannot be measured."""
    if not Path("/proc/self/status").exists():
        return None
    line = [sys.executable, "-c", _MEMORY, name, str(moves), str(Path(__file__).resolve().parent)]
    told = subprocess.run(line, capture_output=True, check=True, text=True)
    taken_kib, written = map(int, told.stdout.split())
    return taken_kib * 1024 / written


def told(row: Row) -> str:
    """Return a measurement as one line."""
    wanted = "no limit" if row.limit is None else f"limit {row.limit:,.0f}"
    most = "no limit" if row.memory_limit is None else f"limit {row.memory_limit:g}"
    memory_used = "" if row.memory is None else f"  memory {row.memory:5.1f} x ({most})"
    return (
        f"{row.post:8} {row.moves:9,} moves {row.seconds:7.2f} s {row.moves_per_s:12,.0f} moves/s  {wanted:15}"
        f" {row.megabytes:7.1f} MB{memory_used}: {'kept' if row.kept else 'MISSED'}"
    )


def main() -> None:
    """Measure every post, print the table, and write it as JSON if that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=200_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", help="names of posts, separated by commas")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    names = given.only.split(",") if given.only else sorted(owners(POSTPROCESSORS))
    rows = []
    for name in names:
        rows.append(measured(name, given.moves, given.repeats))
        print(told(rows[-1]), flush=True)
    if given.json:
        entries = [{**asdict(row), "kept": row.kept} for row in rows]
        given.json.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")
    if not all(row.kept for row in rows):
        sys.exit(1)


if __name__ == "__main__":
    main()
