"""Write docs/accuracy.md from the rows that a run of the benchmark measured."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

from cases import BUILT, SAMPLES
from methods import METHODS
from peer_runs import LIMIT_S, PEERS

__all__ = ["document"]

COLUMNS = {
    "both": "both",
    "p95": "p95",
    "max": "max",
    "normal": "normal",
    "bias": "bias",
    "out": "out",
    "axis": "axis / deg",
    "paper/": "paper / it",
    "time": "time / rigid",
}
ABOUT_SAMPLES = "see samples/{}/README.md"
HEAD = """# Accuracy

Written by `{command}`, {date}: {machine}; Python {python}, numpy {numpy}, scipy {scipy}. No number in
the tables is typed by hand.

The error is that of the corrected path against the true edge of the bent part, on the part of the edge that the
scan shows, in mm: `normal` in the surface across the edge, `out` out of the surface, both as mean sizes; `both` the
mean of hypot(normal, out), `p95` and `max` of the same; `bias` the signed mean of normal, positive into the
material; `axis` the mean angle between tool axis and true surface normal. Sliding along the edge is no error: it
does not change the part. `paper / it`: mean error of the paper's method over that of the row. `time / rigid`:
processor time of the registration over that of the method `rigid` in the same run. Every method has the same scan
and the same start, some 5 mm and 1 degree off.

![Mean error of every method on every case](images/accuracy.png)
"""
CASES = """## Cases

The truth of the samples is a finite-element solution (`disc`: exact). The built cases are exact in closed form; all
have 0.05 mm of noise in each axis, 0.2 % outliers and, but for `sharp corners`, gaps of 30 mm at the edge. Each is
run with two seeds (places of the points, noise, pose, start); numbers are means over both, `max` the larger one.
"""
PEERS_HEAD = """## Other libraries

Mean of `both` in mm on the same scans from the same start (built cases: the first seed, for `sicp` too), each
library in a process of an environment of its own (`make peers`), {limit:g} s at most a case. *edge to rim*: the
nominal path to the points at which the scan ends, as the product finds them, without small loops. *surface*: the
nominal surface up to 30 mm from the edge, with the edge, to the scan within 40 mm. Point-to-point runs coarse to
fine (pairs within 40 mm, then 15 mm) where it takes a limit. Point-to-plane and GICP start from the library's own
result for the edge, with the iterations that the library has by default, as nothing in them holds a gently curved
part against sliding in its surface. Non-rigid ones start from the library's own rigid result, edge to rim, and
yield moved points of the edge; pycpd has lengths in radii of the path, and its own stiffness.
"""


def document(methods: Mapping[str, Mapping], peers: Mapping[str, Mapping], command: str) -> str:
    """Return the document as Markdown."""
    packages = {name: version(name) for name in ("numpy", "scipy")}
    head = HEAD.format(
        command=command,
        date=datetime.date.today().isoformat(),
        machine=_machine(),
        python=platform.python_version(),
        **packages,
    )
    parts = [head, "## Mean error\n\n" + _summary(methods), CASES + "\n" + _about(methods), _rows(methods)]
    parts.append(_peers(methods, peers) if peers else "## Other libraries\n\nNot measured in this run (`--peers`).")
    return "\n".join(part.rstrip() + "\n" for part in parts)


def _machine() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else platform.machine()}, {os.cpu_count()} cores, {platform.system()}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _number(row: Mapping | str, key: str) -> str:
    if isinstance(row, str) or row[key] != row[key]:
        return "-"
    if key in ("paper/", "time"):
        return f"{row[key]:.1f}"
    return f"{row[key]:.2f}" if key == "axis" else f"{row[key]:.3f}"


def _summary(methods: Mapping[str, Mapping]) -> str:
    rows = [
        [case, *(_number(rows[method], "both") for method in METHODS), _number(rows["sicp"], "paper/")]
        for case, rows in methods.items()
    ]
    return _table(["case", *METHODS, "paper / sicp"], rows)


def _about(methods: Mapping[str, Mapping]) -> str:
    return _table(
        ["case", "what"],
        [[case, ABOUT_SAMPLES.format(case) if case in SAMPLES else BUILT[case].about] for case in methods],
    ).replace("---:", "---")


def _rows(methods: Mapping[str, Mapping]) -> str:
    table = [
        [f"{case}, {method}", *(_number(row, key) for key in COLUMNS)]
        for case, rows in methods.items()
        for method, row in rows.items()
    ]
    refused = [
        f"- {case}, {method}: {row}"
        for case, rows in methods.items()
        for method, row in rows.items()
        if isinstance(row, str)
    ]
    return "## Every number\n\n" + _table(["case, method", *COLUMNS.values()], table) + "\n" + "\n".join(refused)


def _peers(methods: Mapping[str, Mapping], peers: Mapping[str, Mapping]) -> str:
    versions = {
        peer: row["version"] for rows in peers.values() for peer, row in rows.items() if not isinstance(row, str)
    }
    own = ["**sicp**", version("sicp-cam"), *(_number(rows["sicp"], "first") for rows in methods.values())]
    table = [
        [peer, versions.get(peer, "-"), *(_number(peers[case][peer], "both") for case in methods)] for peer in PEERS
    ]
    reasons = [
        f"- {case}, {peer}: {row}" for case, rows in peers.items() for peer, row in rows.items() if isinstance(row, str)
    ]
    head = PEERS_HEAD.format(limit=LIMIT_S)
    return head + "\n" + _table(["library", "version", *methods], [own, *table]) + "\n" + "\n".join(reasons)
