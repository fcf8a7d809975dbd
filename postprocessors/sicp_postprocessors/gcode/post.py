"""The G-code post: five-axis programs of several controls, from dialects and machines that are data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from sicp_cam.errors import OutputError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, FloatArray, Program, ToolPath
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import frame_findings, frame_name
from sicp_postprocessors.gcode.blocks import block_texts, numbered
from sicp_postprocessors.gcode.control_findings import (
    control_findings,
    feed_findings,
    named_at_start,
    number_findings,
)
from sicp_postprocessors.gcode.feeds import feeds_of
from sicp_postprocessors.gcode.findings import (
    division_findings,
    rotary_findings,
    travel_findings,
    without_tip_findings,
)
from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions, positions_of
from sicp_postprocessors.gcode.proof import prove
from sicp_postprocessors.gcode.setting import Setting
from sicp_postprocessors.gcode.site_words import length_remarks, tip_off_words, tip_on_words
from sicp_postprocessors.gcode.subprograms import with_subprograms
from sicp_postprocessors.numbers import fixed, trimmed
from sicp_postprocessors.template import LinePostprocessor, Moves
from sicp_postprocessors.text import ascii_name, file_stem, pose_words

__all__ = ["GCode"]

_LONGEST_NAME = 20
_READ_CONE_DEG = 0.001
"""Reading back asks for axes as good as this."""
_HEAD_LETTERS = {"A": (1.0, 0.0, 0.0), "B": (0.0, 1.0, 0.0), "C": (0.0, 0.0, 1.0)}
# LinuxCNC acts on comments that begin with these words: it shows them, writes files, runs Python.
_ACTIVE_COMMENT = re.compile(r"(msg|debug|print|log|probe|py|abort)", re.IGNORECASE)


class GCode(LinePostprocessor):
    """G-code of five-axis controls: absolute, millimetres or inches, feed per minute or inverse time.

    Every block states its motion and all its coordinates, so that the program can be entered anywhere by eye. What is
    written is proved, block for block, by forward kinematics of the rounded words against the path.
    """

    name = "gcode"
    summary = (
        "five-axis G-code: Fanuc, Siemens, Heidenhain, Haas, LinuxCNC, plain; vectors or rotary axes of any machine"
    )
    Options = GCodeOptions
    options: GCodeOptions
    suffix = ".nc"
    comment_drop = "()%;"

    def __init__(self, options: Mapping[str, object] | None = None) -> None:
        """Take options by name, and the machine that they name.

        Raises
        ------
        JobError
            With every option that is unknown or does not fit, and every problem of the machine's file.
        """
        super().__init__(options)
        self._control = self.options.control
        self.suffix = self._control.suffix  # type: ignore[misc]  # a default of the class, which the dialect replaces
        self.line_end = "\r\n" if self.options.line_ends == "crlf" else "\n"  # type: ignore[misc]  # as chosen
        self._setting = self._set_up() if self.options.words == "rotary" else None
        self._last: tuple[Program, Positions] | None = None

    def _set_up(self) -> Setting:
        options = self.options
        return Setting(options.rotaries(), options.tool_length_mm or 0.0, options.part_zero_mm or (0.0, 0.0, 0.0))

    def reading(self) -> Mapping[str, object] | str:
        """Return how the reader understands the rotary words, or why it cannot compare the program with the path."""
        options = self.options
        if options.axis_step_deg is not None:
            return "its moves may have been divided"
        if options.max_moves_per_program is not None:
            return "it may have subprograms"
        if self._setting is None:
            return {}
        machine = self._setting.machine
        plain = all(
            np.array_equal(axis.tool_direction, _HEAD_LETTERS[axis.letter]) for axis in machine.rotaries
        ) and machine.home_axis == (0.0, 0.0, 1.0)
        if not plain or machine.letters not in ("AC", "BC", "AB", "BA") or options.singular_cone_deg > _READ_CONE_DEG:
            return "the angles of rotary axes mean nothing without the machine"
        return {"rotary": machine.letters}

    def positions(self, program: Program) -> Positions:
        """Return what is written of each move; that of the program asked for last is kept."""
        if self._last is None or self._last[0] is not program:
            self._last = (program, positions_of(program, self.options, self._setting))
        return self._last[1]

    # --- findings ---

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, of the frame of the coordinates, and of the axes of the machine."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        findings += frame_findings(
            program, Level.WARN, "set the work offset of the control to the pose in the head of the program"
        )
        findings += control_findings(self.name, program, self.options)
        positions = self.positions(program)
        findings += division_findings(self.name, program, self.options, positions)
        if failures(findings):
            return findings
        findings += number_findings(self.name, len(self.parts(positions.program.path)), self.options)
        findings += feed_findings(program, self.options, positions, feeds_of(positions, self.options))
        if self._setting is not None:
            about = (self.name, program, self.options, self._setting, positions)
            findings += [*rotary_findings(*about), *without_tip_findings(*about), *travel_findings(*about)]
        return findings

    # --- the verbs ---

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the program, and its subprograms if it has any.

        Raises
        ------
        PathError
            If forward kinematics of the written words do not give tip and axis back.
        """
        positions = self.positions(program)
        prove(program, positions, self.options)
        whole, kind = positions.program, self._control.subprograms
        self._last = (whole, positions)
        bodies, stem = self.bodies(whole), self.program_name(whole)
        calls, parts = bodies[0], dict[str, list[str]]()
        if len(bodies) > 1 and kind is not None:
            names = (stem, self._listed_name(whole))
            calls, parts = with_subprograms(self._control, kind, names, self.options.number or 0, bodies)
        files = {stem + self.suffix: [*self.opening(whole), *calls, *self.closing(whole)], **parts}
        self._last = (program, positions)
        return {file: self.encoded(lines) for file, lines in files.items()}

    def start(self, program: Program) -> Iterator[str]:
        """Return what stands before everything else: a percent sign, a program name, an O word."""
        yield from (line.format(name=self._listed_name(program)) for line in self._control.first)
        if self.options.number is not None:
            yield self._control.number.format(self.options.number)

    def comment(self, text: str) -> str:
        """Return a comment, kept from meaning anything to a control."""
        return self._control.comment.format(f"- {text}" if _ACTIVE_COMMENT.match(text) else text)

    def remarks(self, program: Program) -> Iterator[str]:
        """Return which control the program is for, its units, and where its coordinates are valid."""
        options = self.options
        dwell = "milliseconds" if options.dwell == "P_MS" else "seconds"
        offset = f"work offset {options.work_offset}" if options.work_offset else "active work offset"
        yield options.described(self._turning())
        yield f"units {options.units}, dwell in {dwell}"
        if options.states_time:
            yield "feeds as inverse time"
        if not options.knows_tip:
            yield self._set_up_words()
        if not options.tool and not named_at_start(program):
            yield from length_remarks(options)
        yield f"coordinates in the {frame_name(program)} frame: the {offset} must hold it"
        if frame_name(program) == "part":
            yield f"its pose in the scan frame: {pose_words(program.T_scan_program)}"

    def _set_up_words(self) -> str:
        options, setting = self.options, self._setting
        zero = " ".join(trimmed(v, 4) for v in setting.zero_mm) if setting and options.part_zero_mm else ""
        length = f"tool length {trimmed(options.tool_length_mm, 4)} mm" if options.tool_length_mm is not None else ""
        origin = f"program zero at {zero} mm in the machine" if zero else ""
        return f"valid for {' and '.join(part for part in (length, origin) if part)} only"

    def _turning(self) -> Machine | None:
        return self._setting.machine if self._setting is not None else None

    def setup(self, program: Program) -> Iterator[str]:
        """Return the modes that the program relies on."""
        options, control = self.options, self._control
        unit = control.metric if options.units == "mm" else control.inch
        tolerance = trimmed(options.path_tolerance_mm / mm_per_unit(options.units), 6)
        for line in control.modes:
            yield line.format(unit=unit, feed="G93" if options.states_time else "G94", path=tolerance)
        if options.work_offset:
            yield options.work_offset

    def stops_spindle(self, event: Event) -> bool:
        """Say that M6 stops the spindle, wherever it stands."""
        return event.kind is EventKind.TOOL

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Return a tool change, or tip control alone for the tool that is in the spindle."""
        if first:
            yield from tip_on_words(self.options, self._turning(), self.options.tool)
            return
        # Tip control belongs to one tool: its length must not outlive the change.
        yield from tip_off_words(self.options)
        yield from (line.format(tool=number) for line in self._control.tool)
        yield from self.comments(text)
        yield from tip_on_words(self.options, self._turning(), number)

    def move_joint(self, moves: Moves) -> list[str]:
        """Return rapid blocks."""
        return block_texts(moves, self.options, self._turning(), rapid=True)

    def move_linear(self, moves: Moves) -> list[str]:
        """Return cutting blocks; the feed stands where it changes, and after every rapid move."""
        return block_texts(moves, self.options, self._turning(), rapid=False)

    def spindle(self, rev_min: float) -> Iterator[str]:
        """Return the words of a spindle speed."""
        if not rev_min:
            yield "M5"
        lines = self._control.spindle[0 if rev_min > 0 else 1] if rev_min else ()
        yield from (line.format(speed=trimmed(abs(rev_min), 3)) for line in lines)

    def coolant(self, on: bool) -> Iterator[str]:
        """Return the word of the coolant."""
        yield "M8" if on else "M9"

    def pause(self, seconds: float) -> Iterator[str]:
        """Return a dwell."""
        if self.options.dwell == "P_MS":
            yield f"G4 P{fixed(round(seconds * 1000.0), 0)}"
        elif self.options.dwell:
            yield f"G4 {self.options.dwell}{fixed(seconds, 3)}"
        else:
            yield from (line.format(seconds=fixed(seconds, 3)) for line in self._control.pause)

    def stop(self, text: str) -> Iterator[str]:
        """Return a program stop."""
        yield self._control.stop

    def finish(self, program: Program) -> Iterator[str]:
        """Return the end: tip control is switched off, and feeds are per minute again."""
        yield from tip_off_words(self.options)
        if self.options.states_time:
            yield "G94"
        yield from (line.format(name=self._listed_name(program)) for line in self._control.last)

    def targets(self, program: Program) -> FloatArray:
        """Return the numbers of each block (n, 6): X, Y, Z, and two angles or three components of the tool axis."""
        positions = self.positions(program)
        return np.column_stack([positions.xyz, positions.turn])

    def feeds_mm_min(self, path: ToolPath) -> FloatArray:
        """Return the numbers behind F (n,), in the unit and the feed mode of the program."""
        if self._last is None or self._last[0].path is not path:
            raise OutputError(f"post {self.name} was asked for feeds of another path; call files or write")
        return feeds_of(self._last[1], self.options)

    def assemble(self, lines: Iterable[str]) -> list[str]:
        """Return the lines with their block numbers."""
        return numbered(lines, self._control, self.options.line_numbers)

    def program_name(self, program: Program) -> str:
        """Return the name of the file, which is that of the program where it states one."""
        return self._listed_name(program) if self._control.named else super().program_name(program)

    def _listed_name(self, program: Program) -> str:
        name = re.sub("_+", "_", ascii_name(file_stem(program.name), _LONGEST_NAME, other="_")).strip("_")
        if self._control.named == "plain" and not re.match("[A-Za-z]{2}", name):
            return f"PR_{name}"
        return name.upper() if self._control.named == "upper" else name
