"""APT cutter location data in the common words of ISO 4343, which posts and simulators of all makers read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from sicp_cam.errors import JobError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, Program
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import frame_findings, frame_name, stretch_findings
from sicp_postprocessors.numbers import fixed, trimmed
from sicp_postprocessors.options import outside
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.template import LinePostprocessor, Moves
from sicp_postprocessors.text import ascii_line, pose_words

__all__ = ["Apt", "AptOptions"]

_WORDS = {"mm": ("MM", "MMPM"), "inch": ("INCHES", "IPM")}
_DECIMALS = {"mm": 4, "inch": 6}
_LONGEST_NAME = 65  # with PARTNO/ that makes the 72 columns of a card


@dataclass(frozen=True, slots=True)
class AptOptions:
    """Options of the post `apt`."""

    units: Literal["mm", "inch"] = "mm"
    """Unit of positions, and of feeds per minute."""
    decimals: int | None = None
    """Decimals of positions and feeds: by default 4 in mm and 6 in inch."""
    vector_decimals: int = 7
    """Decimals of tool axes."""
    wrap: bool = False
    """Put the tool axis on a line of its own behind a $, for readers that take no more than 72 characters."""

    def __post_init__(self) -> None:
        problems = outside("decimals", self.position_decimals, 3, 10) + outside(
            "vector_decimals", self.vector_decimals, 5, 12
        )
        if problems:
            raise JobError(*problems)

    @property
    def position_decimals(self) -> int:
        """Decimals of positions, by the unit where none are stated."""
        return _DECIMALS[self.units] if self.decimals is None else self.decimals


class Apt(LinePostprocessor):
    """APT with MULTAX/ON: every GOTO states tip and tool axis (tip to holder), RAPID stands before every rapid one."""

    name = "apt"
    summary = "APT cutter location data (ISO 4343 words): GOTO with tool axis, for another post or a simulator"
    Options = AptOptions
    options: AptOptions
    suffix = ".apt"
    comment_drop = "$'"
    missing_feed = Level.WARN
    """CL data may leave the feeds to the post that follows, but a feed once stated would rule the moves without one."""

    def reading(self) -> Mapping[str, object]:
        """Say that the reader needs to be told nothing."""
        return {}

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and of the frame of the coordinates."""
        findings = super().preflight(program)
        feeds = program.path.feeds_mm_min
        missing = ~program.path.rapid & (feeds <= 0.0)
        if missing.any() and (feeds > 0.0).any():
            what = "cutting move with feed 0; an earlier one would rule it: state one with --set path.feed_mm_min=..."
            findings += stretch_findings(program.path, missing, 603, Level.FAIL, what)
        if failures(findings):
            return findings
        remedy = "place the part at the pose in the head of the program, or run with --frame scan"
        return [*findings, *frame_findings(program, Level.WARN, remedy)]

    def start(self, program: Program) -> Iterator[str]:
        """Name the program."""
        yield f"PARTNO/{ascii_line(program.name, drop=self.comment_drop)[:_LONGEST_NAME].rstrip()}"

    def comment(self, text: str) -> str:
        """Return a remark, kept from reading like a frame, which CATIA and Creo write into remarks."""
        return f"$$ - {text}" if text.startswith(("*", "->")) else f"$$ {text}"

    def remarks(self, program: Program) -> Iterator[str]:
        """Return in which frame the coordinates are."""
        yield f"coordinates in the {frame_name(program)} frame"
        if frame_name(program) == "part":
            yield f"its pose in the scan frame: {pose_words(program.T_scan_program)}"

    def setup(self, program: Program) -> Iterator[str]:
        """State the unit, and that every point has an axis."""
        yield f"UNITS/{_WORDS[self.options.units][0]}"
        yield "MULTAX/ON"

    def move_joint(self, moves: Moves) -> list[str]:
        """Return a GOTO with RAPID before it for each rapid move."""
        return rows(f"RAPID\n{self._goto()}", *self._targets(moves))

    def move_linear(self, moves: Moves) -> list[str]:
        """Return a GOTO for each cut, with the feed before it where it changes."""
        unit = _WORDS[self.options.units][1]
        stated = zip(
            (moves.states_feed & (moves.feeds_mm_min > 0.0)).tolist(), moves.feeds_mm_min.tolist(), strict=True
        )
        feeds = [f"FEDRAT/{self._length(feed)},{unit}\n" if states else "" for states, feed in stated]
        return rows(f"{{}}{self._goto()}", words(feeds), *self._targets(moves))

    def spindle(self, rev_min: float) -> Iterator[str]:
        """Return the spindle's speed, or that it is off."""
        sense = "CLW" if rev_min > 0 else "CCLW"
        yield f"SPINDL/{trimmed(abs(rev_min), 3)},RPM,{sense}" if rev_min else "SPINDL/OFF"

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Return the call of a tool that the path names."""
        if not first:
            yield f"LOADTL/{number}"
            yield from self.comments(text)

    def coolant(self, on: bool) -> Iterator[str]:
        """Return the coolant's statement."""
        yield "COOLNT/ON" if on else "COOLNT/OFF"

    def pause(self, seconds: float) -> Iterator[str]:
        """Return a dwell."""
        yield f"DELAY/{fixed(seconds, 3)}"

    def stop(self, text: str) -> Iterator[str]:
        """Return a stop, optional where the path calls it so."""
        yield "OPSTOP" if text.strip().upper() == "OPSTOP" else "STOP"

    def remark(self, text: str) -> Iterator[str]:
        """Return a remark of the path as text that the next processor prints."""
        yield from (f"PPRINT/{line.removeprefix('$$ ')}" for line in self.comments(text))

    def finish(self, program: Program) -> Iterator[str]:
        """End the program."""
        yield "FINI"

    def _goto(self) -> str:
        place, vector = (f"{{:.{n}}}" for n in (self.options.position_decimals, self.options.vector_decimals))
        end = ",$\n     " if self.options.wrap else ","
        return f"GOTO/{place},{place},{place}{end}{vector},{vector},{vector}"

    def _targets(self, moves: Moves) -> tuple[FloatArray, ...]:
        return (*(moves.tips_mm / mm_per_unit(self.options.units)).T, *moves.axes.T)

    def _length(self, value_mm: float) -> str:
        return fixed(value_mm / mm_per_unit(self.options.units), self.options.position_decimals)
