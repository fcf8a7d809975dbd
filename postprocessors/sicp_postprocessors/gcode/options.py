"""Options of the G-code post, and what the three dialects differ in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sicp_cam.errors import JobError
from sicp_postprocessors.options import outside
from sicp_postprocessors.path_checks import PreflightOptions

__all__ = ["DIALECTS", "Dialect", "GCodeOptions"]


@dataclass(frozen=True, slots=True)
class Dialect:
    """Words that a family of controls expects; `{tool}` in `tcp_on` is the H word of the tool, or nothing."""

    family: str
    orientation: str
    tcp_on: str
    tcp_off: str
    metric: str
    inch: str
    comment: str
    dwell: str
    percent: bool


_PARENTHESES, _SEMICOLON = "({})", "; {}"
_VECTOR = "points from the tip to the holder"
DIALECTS = {
    "vector": Dialect(
        "Fanuc G43.5 type 2", f"I J K {_VECTOR}", "G43.5{tool}", "G49", "G21", "G20", _PARENTHESES, "P", True
    ),
    # LinuxCNC knows neither G43.4 nor G43.5; there tcp_on is M428 and tcp_off M429 by convention.
    "rotary": Dialect(
        "Fanuc G43.4 type 1",
        "rotary words {kinematics}, head-head",
        "G43.4{tool}",
        "G49",
        "G21",
        "G20",
        _PARENTHESES,
        "P",
        True,
    ),
    # G710 and G700 are Siemens' own metric and inch, feeds included; comments there begin with a semicolon.
    "siemens": Dialect(
        "Siemens 840D TRAORI", f"A3 B3 C3 {_VECTOR}", "TRAORI", "TRAFOOF", "G710", "G700", _SEMICOLON, "F", False
    ),
}


@dataclass(frozen=True, slots=True)
class GCodeOptions(PreflightOptions):
    """Options of the post `gcode`; empty strings take the word of the dialect that `orientation` chooses."""

    orientation: Literal["vector", "rotary", "siemens"] = "vector"
    """I J K tool vector under G43.5; A C or B C rotary words under G43.4; or A3= B3= C3= under TRAORI."""
    kinematics: Literal["AC", "BC"] = "AC"
    """Head with both rotary axes, C carrying A or B; for `rotary` only. Tables turn the other way: not covered."""
    units: Literal["mm", "inch"] = "mm"
    """Unit of positions, and of feeds per minute."""
    tcp_on: str = ""
    """Words that switch tool tip control on; `{tool}` becomes the H word of the tool."""
    tcp_off: str = ""
    """Words that switch tool tip control off: before a tool change and at the end."""
    work_offset: str = ""
    """Word of the work offset, such as G54; without it the program runs in whatever offset is active."""
    program_number: int | None = None
    """Number of the O word; none if left out."""
    tool: int = 0
    """Tool in the spindle at the start, for its H word, where the path does not say it; 0 writes no H word."""
    line_numbers: int = 0
    """Step of the N words; 0 writes none."""
    decimals: int | None = None
    """Decimals of positions: by default 4 in mm and 6 in inch."""
    vector_decimals: int = 6
    """Decimals of tool vectors."""
    angle_decimals: int = 4
    """Decimals of rotary words, in degrees."""
    dwell: Literal["", "P", "X", "P_MS", "F"] = ""
    """Word of the dwell time: P or X or F in seconds, P_MS in whole milliseconds."""
    singular_cone_deg: float = 0.0005
    """Nearer than this to the pole of the rotary axes C is held; the axis is then wrong by at most this angle."""
    rotary_step_deg: float = 30.0
    """A rotary axis that turns further than this in one cutting move is worth a warning."""
    tilt_limits_deg: tuple[float, float] = (-180.0, 180.0)
    """Travel of A or B."""
    turn_limits_deg: tuple[float, float] = (-36000.0, 36000.0)
    """Travel of C, which is written unwrapped."""

    def __post_init__(self) -> None:
        problems = [
            *outside("program_number", 1 if self.program_number is None else self.program_number, 1, 99_999_999),
            *outside("tool", self.tool, 0, 99_999_999),
            *outside("line_numbers", self.line_numbers, 0, 100),
            *outside("decimals", self.position_decimals, 3, 7),
            *outside("vector_decimals", self.vector_decimals, 5, 9),
            *outside("angle_decimals", self.angle_decimals, 3, 7),
            *outside("singular_cone_deg", self.singular_cone_deg, 0.0, 5.0),
            *outside("rotary_step_deg", self.rotary_step_deg, 0.01, 360.0),
        ]
        problems += [
            f"option {name!r} must be words of the control, without ( ) % ; /"
            for name in ("tcp_on", "tcp_off", "work_offset")
            if set("()%;/") & set(getattr(self, name))
        ]
        for name in ("tilt_limits_deg", "turn_limits_deg"):
            low, high = getattr(self, name)
            if not low < high:
                problems.append(f"option {name!r} must be a lower and a higher angle, not {low:g}, {high:g}")
        if self.program_number is not None and not self.dialect.percent:
            problems.append(f"option 'program_number' has no meaning for orientation {self.orientation}")
        if problems:
            raise JobError(*problems)

    @property
    def position_decimals(self) -> int:
        """Decimals of positions in the chosen unit."""
        if self.decimals is not None:
            return self.decimals
        return 4 if self.units == "mm" else 6

    @property
    def control(self) -> str:
        """Family of controls and meaning of the orientation words, for the head of the program."""
        words = self.dialect.orientation.format(kinematics=self.kinematics)
        if self.tcp_on:
            return f"tool tip control {' '.join(self.tcp_on.replace('{tool}', '').split())}: {words}"
        return f"{self.dialect.family}: {words}"

    @property
    def dialect(self) -> Dialect:
        """Words of the chosen dialect, before the options that replace some of them."""
        return DIALECTS[self.orientation]
