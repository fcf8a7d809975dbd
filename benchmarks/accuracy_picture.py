"""Draw the mean error of every method on every case, other libraries in grey behind them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

__all__ = ["draw"]

MARKS = {
    "rigid": ("#7a7a7a", "s"),
    "projection, parabola": ("#c9a227", "v"),
    "projection, spline": ("#d9731a", "^"),
    "paper": ("#a83279", "D"),
    "sicp": ("#1668b3", "o"),
}
INK, FAINT = "#222222", "#dddddd"
LIMITS_MM = (0.01, 20.0)


def draw(methods: Mapping[str, Mapping], peers: Mapping[str, Mapping], file: Path) -> None:
    """Write a PNG: one line per case, one mark per method, on a logarithmic axis of millimetres."""
    figure = Figure(figsize=(9.0, 1.6 + 0.36 * len(methods)), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for line, case in enumerate(methods):
        _peers(axes, line, peers.get(case, {}), first=line == 0)
        for name, (colour, mark) in MARKS.items():
            row = methods[case][name]
            if not isinstance(row, str):
                size = 62 if name == "sicp" else 38
                label = name if line == 0 else None
                axes.scatter(row["both"], line, s=size, c=colour, marker=mark, label=label, zorder=3, linewidths=0)
    axes.set_yticks(range(len(methods)), list(methods))
    axes.set_ylim(len(methods) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlim(*LIMITS_MM)
    ticks = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("mean error of the corrected path against the true edge / mm", color=INK)
    axes.grid(color=FAINT, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, colors=INK)
    axes.spines[:].set_visible(False)
    figure.legend(loc="outside upper center", ncols=6, frameon=False, handletextpad=0.2, columnspacing=1.4)
    figure.savefig(file, metadata={"Software": None})


def _peers(axes, line: int, rows: Mapping, *, first: bool) -> None:
    found = [row["both"] for row in rows.values() if not isinstance(row, str)]
    shown = [value for value in found if value <= LIMITS_MM[1]]
    label = "other libraries" if first else None
    if found:
        axes.scatter(shown, [line] * len(shown), s=26, c="none", edgecolors="#b5b5b5", zorder=2, label=label)
    if len(found) > len(shown):
        axes.text(LIMITS_MM[1], line, f" +{len(found) - len(shown)}", va="center", color="#8a8a8a", fontsize=8)
