"""Programs for the ACME arm, a controller that does not exist: what a postprocessor of a third party looks like.

The ACME knows GO (as it likes) and LINE (straight) to a point and a tool direction, a speed in mm/s that holds until
the next one, and digital outputs by name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, Program
from sicp_cam.ranges import Between
from sicp_postprocessors.path_checks import PreflightOptions
from sicp_postprocessors.rows import rows
from sicp_postprocessors.template import LinePostprocessor, Moves
from sicp_postprocessors.text import ascii_line

__all__ = ["Acme"]

LEAST_MM = 0.05
TOO_SHORT = 9100
"""Code of a finding of this post; those from 9000 on are free for third parties."""


@dataclass(frozen=True, slots=True)
class AcmeOptions(PreflightOptions):
    """Options of the post: `--set post.acme.decimals=2`; those of the preflight come with their base."""

    decimals: Annotated[int, Between(1, 6)] = 3
    """Decimals of positions; directions have three more."""
    spindle_output: str = "SPINDLE"
    """Digital output that switches the spindle."""
    base: Literal["floor", "table"] = "floor"
    """What the robot stands on."""


class Acme(LinePostprocessor):
    """GO and LINE with point and tool direction, which points from the holder to the tip."""

    name = "acme"
    summary = "programs for the ACME arm"
    Options = AcmeOptions
    suffix = ".acme"
    modal_speed = True
    comment_drop = "!"
    written_events = frozenset({EventKind.COMMENT, EventKind.SPINDLE, EventKind.DWELL, EventKind.TOOL})

    def preflight(self, program: Program) -> list[Finding]:
        """Add what only this controller minds: it stops at moves that are shorter than it can interpolate."""
        findings = super().preflight(program)
        tips = program.path.tips_mm
        for move in range(1, len(tips)):
            length_mm = float(sum((tips[move] - tips[move - 1]) ** 2) ** 0.5)
            if 0.0 < length_mm < LEAST_MM:
                what = f"{length_mm:.3f} mm long, and the ACME stops at moves below {LEAST_MM} mm"
                findings.append(Finding(TOO_SHORT, Level.FAIL, what, f"move {move}"))
        return findings

    def start(self, program: Program) -> Iterator[str]:
        """Name the program and say where the robot stands."""
        yield f"PROGRAM {ascii_line(program.name)}"
        yield f"BASE {self.options.base.upper()}"

    def comment(self, text: str) -> str:
        """Write a comment."""
        return f"! {text}"

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Take a tool; the one that the program begins with, if the path does not say which, is tool 1."""
        yield f"TOOL {1 if first else number}"

    def speed(self, feed_mm_min: float) -> Iterator[str]:
        """State a speed, in mm/s."""
        yield f"SPEED {feed_mm_min / 60.0:.4f}"

    def move_joint(self, moves: Moves) -> list[str]:
        """Write rapid moves."""
        return rows(f"GO {self._point()}", *moves.tips_mm.T, *(-moves.axes).T)

    def move_linear(self, moves: Moves) -> list[str]:
        """Write cuts."""
        return rows(f"LINE {self._point()}", *moves.tips_mm.T, *(-moves.axes).T)

    def spindle(self, rev_min: float) -> Iterator[str]:
        """Switch the spindle; its speed is set at the spindle itself."""
        yield f"OUTPUT {self.options.spindle_output} {'ON' if rev_min else 'OFF'}"

    def pause(self, seconds: float) -> Iterator[str]:
        """Wait."""
        yield f"WAIT {seconds:.2f}"

    def finish(self, program: Program) -> Iterator[str]:
        """Close the program."""
        yield "END"

    def _point(self) -> str:
        decimals = self.options.decimals
        return " ".join([f"{{:.{decimals}}}"] * 3 + [f"{{:.{decimals + 3}}}"] * 3)
