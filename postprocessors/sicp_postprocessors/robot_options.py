"""Options that all robots share; a controller adds its own to them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.errors import JobError, printable
from sicp_cam.ranges import Between
from sicp_postprocessors.arm import ArmOptions
from sicp_postprocessors.orientations import Six

__all__ = ["RobotOptions", "Six", "output_words"]

_FIRST_RUN_PERCENT = 1.0
_SWITCH = re.compile(r"\s*(\S.*?)\s*=\s*([^=:\s]+)\s*:\s*(on|off)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class RobotOptions(ArmOptions):
    """Options of every robot. Poses are x, y, z in mm and rx, ry, rz in degrees, R = Rx Ry Rz."""

    tool: Six | None = None
    """Pose of the tool tip in the flange, Z out of the flange into the work; zero, with a warning, if left out."""
    cell: Six | None = None
    """Pose of the scan frame in the robot's world; the identity, with a warning, if left out."""
    spin_deg: Annotated[float, Between(-360.0, 360.0)] = 0.0
    """Angle rz of the tool about its own axis."""
    spin: Literal["fixed", "transport"] = "fixed"
    """Keep rz along the path, or turn the tool no more than its axis turns."""
    approach_percent: Annotated[float, Between(0.1, 100.0)] = 10.0
    """Joint speed of the move to the first point, of what the robot can do."""
    rapid_mm_s: Annotated[float, Between(0.1, 10_000.0)] = 250.0
    """Tip speed of rapid moves, which are straight."""
    blend: bool = True
    """Round the points between two cutting moves; false: come to rest at every point."""
    blend_mm: Annotated[float, Between(0.001, 1000.0)] = 0.5
    """Where rounding leaves and reaches the path, at most; never more than half of the shorter neighbouring segment."""
    blend_corner_mm: Annotated[float, Between(0.001, 1000.0)] = 0.05
    """How far rounding may cut a corner, at most: where the path turns sharply, it begins later for that."""
    first_run: bool = False
    """Write a program for the first run: no rounding, no straight move above `first_run_mm_s`, a slow approach."""
    first_run_mm_s: Annotated[float, Between(0.1, 250.0)] = 50.0
    """Speed that no straight move of a first run exceeds; the joint speed of its approach is at most 1 percent."""
    spindle_output: str = ""
    """Digital output that starts the spindle clockwise, as the controller names or numbers it."""
    spindle_ccw_output: str = ""
    """Digital output that starts it counter-clockwise; without it such a path is refused."""
    spindle_dwell_s: Annotated[float, Between(0.0, 600.0)] = 2.0
    """Pause after a start of the spindle."""
    coolant_output: str = ""
    """Digital output of coolant or extraction."""
    outputs: str = ""
    """Words of the path that switch an output, divided by semicolons: AUXFUN/50=7:on; AUXFUN/51=7:off."""
    max_moves_per_program: Annotated[int, Between(1, 1_000_000)] = 2000
    """Longer paths are divided into programs at rapid moves; what a controller takes depends on its memory."""
    split_cuts: bool = False
    """True divides a cut that is longer than that too, within the cut."""

    def __post_init__(self) -> None:
        if problems := self.problems():
            raise JobError(*problems)

    def problems(self) -> list[str]:
        """Return what does not go together, one line each; a controller adds its own."""
        return [*output_words(self.outputs)[1], *self.arm_problems()]

    @property
    def tool_is_known(self) -> bool:
        """Whether the user says what the tool is; a controller may have it in its own memory."""
        return self.tool is not None

    @property
    def cell_is_known(self) -> bool:
        """Whether the user says where the scan frame is; a controller may have it in its own memory."""
        return self.cell is not None

    @property
    def blends(self) -> bool:
        """Whether points between cutting moves are rounded."""
        return self.blend and not self.first_run

    @property
    def cell_origin(self) -> str:
        """What `cell` is measured from, in words."""
        return "world"

    @property
    def commands_speed(self) -> bool:
        """Whether the program states the speed of the spindle; a controller that has words for it says so."""
        return False

    @property
    def joint_percent(self) -> float:
        """Joint speed of the move to the first point: a first run creeps, wherever the arm then stands."""
        return min(self.approach_percent, _FIRST_RUN_PERCENT) if self.first_run else self.approach_percent

    @property
    def fastest_mm_s(self) -> float:
        """Speed that no move exceeds."""
        return self.first_run_mm_s if self.first_run else float("inf")


def output_words(text: str) -> tuple[dict[str, tuple[str, bool]], list[str]]:
    """Return the outputs that words of a path switch, by the word without blanks in upper case; and what is wrong.

    >>> output_words("AUXFUN/50 = vacuum:on; M51=7:off")
    ({'AUXFUN/50': ('vacuum', True), 'M51': ('7', False)}, [])
    >>> output_words("AUXFUN/50")[1]
    ["option 'outputs' must be words of the path and outputs, such as AUXFUN/50=7:on, not 'AUXFUN/50'"]
    """
    words: dict[str, tuple[str, bool]] = {}
    problems = []
    for piece in filter(str.strip, text.split(";")):
        match = _SWITCH.fullmatch(piece)
        if match is None:
            told = printable(repr(piece.strip()))
            example = "must be words of the path and outputs, such as AUXFUN/50=7:on"
            problems.append(f"option 'outputs' {example}, not {told}")
        else:
            words["".join(match[1].split()).upper()] = (match[2], match[3].lower() == "on")
    return words, problems
