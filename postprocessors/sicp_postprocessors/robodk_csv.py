"""Targets for RoboDK: a table X, Y, Z, W, P, R and more, as its macros for CSV files load it.

Facts: RoboDK's macro ImportCSV_XYZWPR: no header, mm and degrees, pose = transl(X, Y, Z) Rz(R) Ry(P) Rx(W), the seventh
column numbers the targets; further columns are not read. Here they are the speed in mm/s, 1 for rapid moves, and a note
in the first row. Tool and frame are those that are active in RoboDK.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, Program, ToolPath
from sicp_cam.ranges import Between
from sicp_postprocessors.base import Postprocessor, failures, head_remarks
from sicp_postprocessors.checks import frame_findings, name_findings
from sicp_postprocessors.orientations import angles_from_axes, euler_zyx, rotation_matrices
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.text import ascii_line, counted, file_stem

__all__ = ["RoboDkCsv", "RoboDkCsvOptions"]

_NOT_IN_A_CELL = ",;\"'|"
_LONGEST_NOTE = 300


@dataclass(frozen=True, slots=True)
class RoboDkCsvOptions:
    """Options of the post `robodk`."""

    spin_deg: Annotated[float, Between(-360.0, 360.0)] = 0.0
    """Angle of the tool about its own axis."""
    spin: Literal["fixed", "transport"] = "fixed"
    """Keep that angle along the path, or turn the tool no more than its axis turns."""
    rapid_mm_s: Annotated[float, Between(0.1, 10_000.0)] = 250.0
    """Speed of rapid moves."""
    decimals: Annotated[int, Between(3, 6)] = 4
    """Decimals of positions in mm."""
    angle_decimals: Annotated[int, Between(3, 9)] = 5
    """Decimals of angles in degrees."""


class RoboDkCsv(Postprocessor):
    """One row for each move; events have no place in it and are told."""

    name = "robodk"
    summary = "table X,Y,Z,W,P,R,number,mm/s,rapid for RoboDK, without a header"
    Options = RoboDkCsvOptions
    options: RoboDkCsvOptions
    suffix = "_robodk.csv"
    """Beside the table of the post `csv`, which has the plain name."""

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and what a table cannot hold: events and the program frame."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        counts = Counter(event.kind for event in program.path.events)
        if counts:
            told = ", ".join(counted(count, f"{kind} event") for kind, count in sorted(counts.items()))
            findings.append(Finding(610, Level.INFO, f"a table of targets holds moves only; not written: {told}"))
        remedy = "give the frame in RoboDK the pose of the part, or run with --frame scan"
        return [
            *findings,
            *name_findings(program, file_stem(program.name)),
            *frame_findings(program, Level.WARN, remedy),
        ]

    def reading(self) -> Mapping[str, object]:
        """Name the columns, which have no header."""
        return {"columns": "x_mm,y_mm,z_mm,w,p,r,-,speed_mm_s,rapid,-", "euler": "zyx"}

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one table."""
        path, options = program.path, self.options
        d, a = options.decimals, options.angle_decimals
        feeds = np.where(path.rapid, options.rapid_mm_s, path.feeds_mm_min / 60.0)
        notes = words([self._note(program), *[""] * (len(path) - 1)])
        template = ",".join([f"{{:.{d}}}"] * 3 + [f"{{:.{a}}}"] * 3 + ["{:d}", "{:.5}", "{:d}", "{}"])
        columns = (*path.tips_mm.T, *self.angles_deg(path).T, np.arange(len(path)), feeds, path.rapid, notes)
        text = "\n".join([*rows(template, *columns), ""])
        return {f"{file_stem(program.name)}{self.suffix}": text.encode("ascii")}

    def angles_deg(self, path: ToolPath) -> FloatArray:
        """Return W, P, R (n, 3) of the tool of every move, its Z against the axis."""
        options = self.options
        R = rotation_matrices(angles_from_axes(path.axes, options.spin_deg, options.spin == "transport"))
        return euler_zyx(R)[:, ::-1]

    def _note(self, program: Program) -> str:
        """Return what other programs say in their heads, as one cell."""
        told = [ascii_line(remark, drop=_NOT_IN_A_CELL) for remark in head_remarks(program)]
        return " / ".join(line[:_LONGEST_NOTE] for line in told if line)
