"""The neutral table: one line per move, for spreadsheets, plots and controllers without a post of their own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, Program
from sicp_postprocessors.base import Postprocessor
from sicp_postprocessors.checks import frame_findings, name_findings
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.text import ascii_line, counted, file_stem

__all__ = ["COLUMNS", "PathCsv"]

COLUMNS = ("x", "y", "z", "i", "j", "k", "feed", "rapid", "status")
_POSITION_DECIMALS, _AXIS_DECIMALS, _FEED_DECIMALS, _COLUMN_DECIMALS = 4, 7, 4, 6
_NOT_IN_A_CELL = ",;\"'"
_LONGEST_OVERRIDE = 100


class PathCsv(Postprocessor):
    """Table of tips in mm, axes from tip to holder, feeds in mm/min, rapid 0 or 1, and status.

    The columns of the program follow in their order, and, where gates were overridden, one whose name says which: a
    line before the header would be read as the header. A column that is a masked array has empty cells where it is
    masked: there is no value. Dots for decimals, commas between cells, one header line.
    """

    name = "csv"
    summary = "table x,y,z,i,j,k,feed,rapid,status and further columns"
    suffix = ".csv"
    missing_feed = Level.WARN

    def reading(self) -> Mapping[str, object]:
        """Say that the reader needs to be told nothing."""
        return {}

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and what a table cannot hold: events and the program frame."""
        findings = super().preflight(program)
        twice = [name for name in program.columns if name.lower() in COLUMNS]
        findings += [
            Finding(608, Level.FAIL, f"the column {name!r} is one of the table's own; rename it") for name in twice
        ]
        counts = Counter(event.kind for event in program.path.events)
        if counts:
            told = ", ".join(counted(count, f"{kind} event") for kind, count in sorted(counts.items()))
            findings.append(Finding(610, Level.INFO, f"a table holds moves only; not written: {told}"))
        remedy = "apply T_scan_part of the result to them, or run with --frame scan"
        return [
            *findings,
            *name_findings(program, file_stem(program.name)),
            *frame_findings(program, Level.INFO, remedy),
        ]

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one table."""
        path = program.path
        place, axis, more = (f"{{:.{n}}}" for n in (_POSITION_DECIMALS, _AXIS_DECIMALS, _COLUMN_DECIMALS))
        feed = f"{{:.{_FEED_DECIMALS}}}"
        row = ",".join([place] * 3 + [axis] * 3 + [feed, "{:d}", "{}"] + ["{}"] * len(program.columns))
        extras = [words(_column_cells(column, more)) for column in program.columns.values()]
        status = words([status.value for status in program.status])
        numbers = (*path.tips_mm.T, *path.axes.T, path.feeds_mm_min, path.rapid, status, *extras)
        lines = rows(row + ",1" * bool(program.overridden), *numbers)
        head = ",".join((*COLUMNS, *program.columns, *_overridden_column(program)))
        return {f"{file_stem(program.name)}.csv": "\n".join([head, *lines, ""]).encode("ascii")}


def _column_cells(column: FloatArray, field: str) -> list[str]:
    """Return the cells of a further column, empty where it is masked."""
    masked = np.ma.getmaskarray(column).tolist()
    cells = zip(rows(field, np.asarray(column, np.float64)), masked, strict=True)
    return ["" if none else cell for cell, none in cells]


def _overridden_column(program: Program) -> list[str]:
    """Return the name of the column that says which gates were overridden, if any, without what ends a cell."""
    lines = [ascii_line(line, drop=_NOT_IN_A_CELL)[:_LONGEST_OVERRIDE] for line in program.overridden]
    return [f"overridden: {' and '.join(lines)}"] if lines else []
