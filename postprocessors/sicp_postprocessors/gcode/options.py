"""Options of the G-code post."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from sicp_cam.errors import JobError
from sicp_cam.ranges import Between
from sicp_postprocessors.gcode.dialects import DIALECTS, Dialect
from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.machines import load_machine
from sicp_postprocessors.path_checks import PreflightOptions

__all__ = ["GCodeOptions"]

_PLAIN_STEP_DEG = 3.0
_NUMBER = Between(1, 99_999_999)
_OFFSET = re.compile(
    r"G5[4-9]|G54\.1 ?P[1-9][0-9]{0,2}|G59\.[1-3]|G154 ?P[1-9][0-9]?|G5(00|0[5-9]|[1-9][0-9])", re.ASCII
)
"""Fanuc, Haas, LinuxCNC and Siemens."""


@dataclass(frozen=True, slots=True)
class GCodeOptions(PreflightOptions):
    """Options of the post `gcode`; empty strings take the words of the dialect."""

    dialect: Literal["auto", "fanuc", "siemens", "heidenhain", "haas", "linuxcnc", "plain"] = "auto"
    """Fanuc G43.4, G43.5, Siemens TRAORI, Heidenhain M128, Haas G234, LinuxCNC; plain: no tip control; auto: fanuc."""
    orientation: Literal["auto", "vector", "rotary", "siemens"] = "auto"
    """How the tool axis is stated: as a vector, or as two rotary angles; auto: as is usual; siemens: its vector."""
    kinematics: Literal["AC", "BC", "AB"] = "AC"
    """Head with both rotary axes, the second letter carrying the first; `machine` names any other."""
    machine: str = ""
    """Rotary axes: head-ac, mixed-, table-, and bc or ab; nutating-head-bc, -mixed-, -table-; FILE.toml; or empty."""
    units: Literal["mm", "inch"] = "mm"
    """Unit of positions, and of feeds per minute."""
    tcp_on: str = ""
    """Words that switch tool tip control on, such as M428; `{tool}` becomes the H word of the tool."""
    tcp_off: str = ""
    """Words that switch tool tip control off: before a tool change and at the end."""
    tip_control: Literal["auto", "on", "off"] = "auto"
    """Off: X Y Z are written as the machine must move them, which needs its geometry; auto: as the dialect has it."""
    tool_length_mm: Annotated[float | None, Between(0.0, 10_000.0)] = None
    """Length of the tool from the gauge point, for axes in the head without tip control and for linear travel."""
    part_zero_mm: tuple[float, float, float] | None = None
    """Origin of the program in the machine frame, for tables without tip control and for linear travel."""
    inverse_time: bool = False
    """Write G93 feeds, one over the minutes that a move takes; always so without tip control."""
    rotary_feed_deg_min: Annotated[float, Between(0.1, 1e6)] = 360.0
    """Feed of cutting moves on which the tool only turns."""
    max_axis_step_deg: Annotated[float | None, Between(0.01, 180.0)] = None
    """Divide cutting moves on which an axis turns further; none: 3 without tip control, or else none is divided."""
    tip_tolerance_mm: Annotated[float, Between(0.0001, 10.0)] = 0.01
    """How far the tip may leave its straight way in a block without tip control; longer ones are divided."""
    path_tolerance_mm: Annotated[float, Between(0.0001, 10.0)] = 0.01
    """How far LinuxCNC may round corners (G64 P)."""
    work_offset: str = ""
    """Word of the work offset, such as G54; without it the program runs in whatever offset is active."""
    program_number: Annotated[int | None, _NUMBER] = None
    """Number of the O word; none if left out, and 1 for Haas."""
    tool: Annotated[int, Between(0, 99_999_999)] = 0
    """Tool in the spindle at the start, for its H word, where the path does not say it; 0 writes no H word."""
    line_numbers: Annotated[int, Between(0, 100)] = 0
    """Step of the block numbers; 0 writes none, but for Heidenhain, which counts each line."""
    line_ends: Literal["lf", "crlf"] = "lf"
    """How lines end in the file."""
    decimals: Annotated[int | None, Between(3, 7)] = None
    """Decimals of positions: by default 4 in mm and 6 in inch."""
    vector_decimals: Annotated[int | None, Between(5, 9)] = None
    """Decimals of tool vectors: by default 6, for Heidenhain 7."""
    angle_decimals: Annotated[int, Between(3, 7)] = 4
    """Decimals of rotary words, in degrees."""
    dwell: Literal["", "P", "X", "P_MS", "F"] = ""
    """Word of the dwell time: P or X or F in seconds, P_MS in whole milliseconds."""
    singular_cone_deg: Annotated[float, Between(0.0, 5.0)] = 0.0005
    """Nearer than this to the pole the axis next to the part is held; the tool axis is then wrong by this at most."""
    rotary_step_deg: Annotated[float, Between(0.01, 360.0)] = 30.0
    """A rotary axis that turns further than this in one cutting move is worth a warning."""
    tilt_limits_deg: tuple[float, float] | None = None
    """Travel of the rotary axis next to the tool, A or B; none: that of the machine, -180 to 180."""
    turn_limits_deg: tuple[float, float] | None = None
    """Travel of the rotary axis next to the part, mostly C; none: that of the machine, through full turns."""
    wrap: Literal["auto", "none", "0..360", "+-180"] = "auto"
    """How angles of axes that turn round are written: through full turns, or within one; auto: as the machine does."""
    max_moves_per_program: Annotated[int | None, Between(10, 10_000_000)] = None
    """Divide longer paths into subprograms, at rapid moves; none: one program."""
    split_cuts: bool = False
    """Divide cuts that are longer than `max_moves_per_program` too."""

    def __post_init__(self) -> None:
        problems = self._word_problems()
        for name in ("tilt_limits_deg", "turn_limits_deg"):
            limits = getattr(self, name)
            if limits is not None and not limits[0] < limits[1]:
                low, high = limits
                problems.append(f"option {name!r} must be a lower and a higher angle, not {low:g}, {high:g}")
        if self.orientation == "siemens" and self.dialect not in ("auto", "siemens"):
            problems.append(f"option 'orientation' siemens is not one of dialect {self.dialect}; set vector or rotary")
        elif self.words not in self.control.orientations:
            known = " or ".join(self.control.orientations)
            problems.append(f"option 'orientation' must be {known} for dialect {self.dialect_name}")
        else:
            problems += self._meaning_problems()
        if problems:
            raise JobError(*problems)

    @property
    def control(self) -> Dialect:
        """Words of the chosen dialect, before the options that replace some of them."""
        return DIALECTS[self.dialect_name]

    @property
    def dialect_name(self) -> str:
        """Name of the chosen dialect."""
        if self.dialect != "auto":
            return self.dialect
        return "siemens" if self.orientation == "siemens" else "fanuc"

    @property
    def words(self) -> str:
        """How the tool axis is stated: "vector" or "rotary"."""
        if self.orientation == "siemens":
            return "vector"
        return next(iter(self.control.orientations)) if self.orientation == "auto" else self.orientation

    @property
    def machine_name(self) -> str:
        """Name of the machine of rotary words; without one both axes are in the head, as `kinematics` says."""
        return self.machine or f"head-{self.kinematics.lower()}"

    @property
    def knows_tip(self) -> bool:
        """Say whether the control keeps the tip on the path while the axes turn."""
        return self.control.tip_control if self.tip_control == "auto" else self.tip_control == "on"

    @property
    def states_time(self) -> bool:
        """Say whether feeds are written as inverse time."""
        return self.inverse_time or not self.knows_tip

    @property
    def axis_step_deg(self) -> float | None:
        """Largest turn in one cutting block; None where no move is divided."""
        if self.max_axis_step_deg is None and not self.knows_tip:
            return _PLAIN_STEP_DEG
        return self.max_axis_step_deg

    @property
    def position_decimals(self) -> int:
        """Decimals of positions in the chosen unit."""
        if self.decimals is not None:
            return self.decimals
        return 4 if self.units == "mm" else 6

    @property
    def axis_decimals(self) -> int:
        """Decimals of tool vectors."""
        return self.control.vector_decimals if self.vector_decimals is None else self.vector_decimals

    @property
    def number(self) -> int | None:
        """Number of the program, None where it has none."""
        return self.control.smallest_number if self.program_number is None else self.program_number

    def rotaries(self) -> Machine:
        """Return the machine of the rotary words.

        Raises
        ------
        JobError
            If it is not known, or with every problem of its file.
        """
        return load_machine(self.machine_name).limited(
            self.turn_limits_deg, self.tilt_limits_deg, None if self.wrap == "auto" else self.wrap
        )

    def described(self, machine: Machine | None) -> str:
        """Return family of controls and meaning of the orientation words, for the head of the program."""
        control = self.control
        words = control.orientations[self.words]
        words = words if machine is None else words.format(machine=f"{machine.letters}, {machine.kind}")
        if machine is not None and not self.knows_tip:
            return f"{control.family}: {words}, X Y Z for the geometry of {machine.name}"
        if self.tcp_on:
            return f"tool tip control {' '.join(self.tcp_on.replace('{tool}', '').split())}: {words}"
        kinds = {"G43.5": "Fanuc G43.5 type 2", "G43.4": "Fanuc G43.4 type 1"}
        first = "".join(control.tip_on[self.words][:1]).replace("{tool}", "")
        return f"{kinds.get(first, control.family)}: {words}"

    def _word_problems(self) -> list[str]:
        told = []
        for name in ("tcp_on", "tcp_off"):
            text = getattr(self, name)
            words = text.replace("{tool}", "") if name == "tcp_on" else text
            if text and not (words.strip() and words.isascii() and words.isprintable()):
                told.append(f"option {name!r} must be words of the control on one line, such as M428")
            if set("()%;/") & set(words):
                told.append(f"option {name!r} must be words of the control, without ( ) % ; /")
            if set("{}") & set(words):
                known = "{tool} is all that may stand in braces" if name == "tcp_on" else "braces mean nothing there"
                told.append(f"option {name!r} is not words of the control: {known}")
        if self.work_offset and not _OFFSET.fullmatch(self.work_offset):
            told.append("option 'work_offset' must be one word, such as G54, G54.1 P3, G154 P12 or G505")
        return told

    def _meaning_problems(self) -> list[str]:
        """Return the problems that only options together have."""
        control, told = self.control, []
        if self.program_number is not None and not control.number:
            told.append(f"option 'program_number' has no meaning for dialect {self.dialect_name}")
        if self.units == "inch" and control.inch is None:
            told.append(f"option 'units' must be mm for dialect {self.dialect}: its controls differ in feeds in inches")
        if self.states_time and control.largest_inverse is None:
            told.append(f"option 'inverse_time' has no meaning for dialect {self.dialect}, which knows tip control")
        if self.max_moves_per_program and control.subprograms and control.subprograms.numbered and not self.number:
            told.append("option 'max_moves_per_program' needs 'program_number', from which subprograms are counted")
        calls = self.max_moves_per_program and control.subprograms and control.subprograms.numbered
        largest = control.largest_called - 1 if calls else control.largest_program
        if (self.number or 0) > largest and control.number:
            told.append(f"option 'program_number' must be at most {largest} for dialect {self.dialect_name}")
        if self.work_offset and not control.offset:
            told.append(f"option 'work_offset' has no meaning for dialect {self.dialect_name}; set it on the control")
        if self.dwell and self.dwell not in control.dwells:
            known = f"must be {' or '.join(control.dwells)}" if control.dwells else "has no meaning"
            told.append(f"option 'dwell' {known} for dialect {self.dialect_name}")
        if self.words == "vector":
            if not self.knows_tip:
                told.append("option 'tip_control' off needs orientation rotary: the machine moves two rotary axes")
            return told
        try:
            machine = self.rotaries()
        except JobError as error:
            return told + list(error.problems)
        return told + ([] if self.knows_tip else self._geometry_problems(machine))

    def _geometry_problems(self, machine: Machine) -> list[str]:
        told = []
        if not machine.has_geometry:
            told.append(
                "without tip control X Y Z depend on where the rotary axes stand: name a machine FILE.toml with "
                f"point_mm or pivot_mm by option 'machine'; {machine.name} has none"
            )
        if machine.kind != "table-table" and self.tool_length_mm is None:
            told.append("option 'tool_length_mm' is needed without tip control, as the head carries the tool")
        if machine.kind != "head-head" and self.part_zero_mm is None:
            told.append("option 'part_zero_mm' is needed without tip control, as the table carries the part")
        return told
