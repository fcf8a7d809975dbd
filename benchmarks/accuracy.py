"""Measure the error of corrected paths against known truth: every method on every case, other libraries beside them.

    python benchmarks/accuracy.py [--peers] [--docs FOLDER] [--json FILE] [CASE ...]

Prints one row per case and method, see `truth.error`: `both`, `p95`, `max`, `normal`, `bias`, `out` in mm, `axis` in
degrees; `paper/` the mean error of the method `paper` over that of the row; `time` the processor time of the
registration, `seconds`, over that of the method `rigid`. For other libraries `seconds` is wall-clock time. `--docs`
writes accuracy.md and images/accuracy.png into a folder.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from accuracy_document import document
from accuracy_picture import draw
from cases import BUILT, SAMPLES, built, sample
from methods import METHODS, from_files, in_memory
from peer_runs import PEERS, NotMeasuredError, measured, problem

from sicp_cam.errors import SicpError

SEEDS = (1, 2)
COLUMNS = ("both", "p95", "max", "normal", "bias", "out", "axis", "paper/", "time", "seconds")


def by_methods(case: str) -> dict[str, dict[str, float] | str]:
    """Return the row of each method, or why there is none; means over the seeds of a built case, the largest `max`.

    `first` is the mean error with the first seed, which is the one that the peers get.
    """
    runs: dict[str, list[dict[str, float]]] = {method: [] for method in METHODS}
    failed: dict[str, str] = {}
    for scan in [sample(case)] if case in SAMPLES else [built(case, seed) for seed in SEEDS]:
        for method in METHODS:
            try:
                run = in_memory(scan, method)
                runs[method].append(run | from_files(case, method) if case in SAMPLES else run)
            except SicpError as error:
                failed[method] = f"refused: {error}"
            except Exception as error:  # a bug of one method must not cost the numbers of all others
                failed[method] = f"failed: {type(error).__name__}: {error}"
    rows = {method: failed.get(method) or averaged(runs[method]) for method in METHODS}
    return {method: compared(row, rows) for method, row in rows.items()}


def averaged(runs: list[dict[str, float]]) -> dict[str, float]:
    """Return the mean of each number of several runs, the largest `max`, and the first `both` as `first`."""
    mean = {key: float(np.mean([run[key] for run in runs])) for key in runs[0]}
    return mean | {"max": max(run["max"] for run in runs), "first": runs[0]["both"]}


def compared(row: dict[str, float] | str, rows: dict[str, dict[str, float] | str]) -> dict[str, float] | str:
    """Return a row with its error against that of `paper`, and its time against that of `rigid`."""
    if isinstance(row, str):
        return row
    paper, rigid = rows["paper"], rows["rigid"]
    return row | {
        "seconds": row["time"],
        "paper/": float("nan") if isinstance(paper, str) else paper["both"] / row["both"],
        "time": float("nan") if isinstance(rigid, str) else row["time"] / rigid["time"],
    }


def by_peers(case: str) -> dict[str, dict[str, float | str] | str]:
    """Return the row of each peer on a case (the first seed of a built one), or why it has none."""
    scan = sample(case) if case in SAMPLES else built(case, SEEDS[0])
    given, rows = problem(scan), {}
    for peer in PEERS:
        try:
            rows[peer] = measured(peer, given, scan)
        except NotMeasuredError as error:
            rows[peer] = f"not measured: {error}"
    return rows


def show(case: str, rows: dict[str, dict[str, float | str] | str]) -> None:
    """Print the rows of a case."""
    for name, row in rows.items():
        if isinstance(row, str):
            print(f"{case:14} {name:38} {row}")
        else:
            numbers = (row.get(column, float("nan")) for column in COLUMNS)
            print(f"{case:14} {name:38} " + " ".join(f"{number:8.3f}" for number in numbers), flush=True)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"all of them: {', '.join([*SAMPLES, *BUILT])}")
    parser.add_argument("--peers", action="store_true", help="measure other libraries too; make peers installs them")
    parser.add_argument("--docs", type=Path, help="write accuracy.md and images/accuracy.png here")
    parser.add_argument("--json", type=Path, help="write every number here")
    options = parser.parse_args()
    cases = options.cases or [*SAMPLES, *BUILT]
    if unknown := set(cases) - {*SAMPLES, *BUILT}:
        parser.error(f"no case {', '.join(sorted(unknown))}; there are {', '.join([*SAMPLES, *BUILT])}")
    print(f"{'case':14} {'method':38} " + " ".join(f"{column:>8}" for column in COLUMNS))
    methods, peers = {}, {}
    for case in cases:
        methods[case] = by_methods(case)
        show(case, methods[case])
        if options.peers:
            peers[case] = by_peers(case)
            show(case, peers[case])
    if options.json:
        text = json.dumps({"methods": methods, "peers": peers}, indent=1, default=str)
        options.json.write_text(text.replace("NaN", "null") + "\n")
    if options.docs:
        (options.docs / "images").mkdir(parents=True, exist_ok=True)
        command = " ".join(["python", "benchmarks/accuracy.py", *sys.argv[1:]])
        (options.docs / "accuracy.md").write_text(document(methods, peers, command))
        draw(methods, peers, options.docs / "images" / "accuracy.png")


if __name__ == "__main__":
    main()
