"""Generic five-axis G-code with tool tip control: the control keeps the tip on the path while the axes turn."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from sicp_cam.errors import PathError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, Program
from sicp_cam.units import mm_per_unit
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import frame_findings, frame_name, move_place, stretch_findings
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.numbers import fixed, rounded, trimmed
from sicp_postprocessors.options import flag
from sicp_postprocessors.rotary import HeadAngles, axes_from_angles, axis_errors_deg, head_angles
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.template import LinePostprocessor, Moves
from sicp_postprocessors.text import pose_words

__all__ = ["GCode", "GCodeOptions"]

_FEED_DECIMALS = {"mm": 3, "inch": 5}
_VERIFIED_DEG = 1e-4
# LinuxCNC acts on comments that begin with these words: it shows them, writes files, runs Python.
_ACTIVE_COMMENT = re.compile(r"(msg|debug|print|log|probe|py|abort)", re.IGNORECASE)


class GCode(LinePostprocessor):
    """G-code of a five-axis control: absolute, millimetres or inches, feed per minute.

    Every block states its G word and all its coordinates, so that the program can be entered anywhere by eye. Rotary
    words are checked by forward kinematics, block for block, against the axes of the path.
    """

    name = "gcode"
    summary = "five-axis G-code with tool tip control: I J K, A/B/C or Siemens A3= B3= C3="
    Options = GCodeOptions
    options: GCodeOptions
    suffix = ".nc"
    comment_drop = "()%;"

    def reading(self) -> Mapping[str, object] | str:
        """Say that rotary words mean nothing without the machine; those of vectors speak for themselves."""
        return "the angles of rotary axes mean nothing without the machine" if self._is_rotary() else {}

    def _is_rotary(self) -> bool:
        return self.options.orientation == "rotary"

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, of the frame of the coordinates, and of the rotary axes."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        findings += frame_findings(
            program, Level.WARN, "set the work offset of the control to the pose in the head of the program"
        )
        findings += self._offset_findings(program)
        if self.options.orientation == "rotary":
            findings += self._rotary_findings(program)
        return findings

    def start(self, program: Program) -> Iterator[str]:
        """Return the percent sign and the O word, where the dialect has them."""
        if self.options.dialect.percent:
            yield "%"
        if self.options.program_number is not None:
            yield f"O{self.options.program_number:04d}"

    def comment(self, text: str) -> str:
        """Return a comment, kept from meaning anything to a control."""
        return self.options.dialect.comment.format(f"- {text}" if _ACTIVE_COMMENT.match(text) else text)

    def remarks(self, program: Program) -> Iterator[str]:
        """Return which control the program is for, its units, and where its coordinates are valid."""
        options = self.options
        dwell = "milliseconds" if self._dwell_word() == "P_MS" else "seconds"
        offset = f"work offset {options.work_offset}" if options.work_offset else "active work offset"
        yield options.control
        yield f"units {options.units}, dwell in {dwell}"
        yield f"coordinates in the {frame_name(program)} frame: the {offset} must hold it"
        if frame_name(program) == "part":
            yield f"its pose in the scan frame: {pose_words(program.T_scan_program)}"

    def setup(self, program: Program) -> Iterator[str]:
        """Return the modes that the program relies on."""
        options = self.options
        unit = options.dialect.metric if options.units == "mm" else options.dialect.inch
        yield f"{unit} G90 G94 G17 G40"
        if options.work_offset:
            yield options.work_offset

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Return a tool change, or tip control alone for the tool that is in the spindle."""
        if first:
            yield self._tcp_on(self.options.tool)
            return
        # Tip control belongs to one tool: its length must not outlive the change.
        yield self.options.tcp_off or self.options.dialect.tcp_off
        yield f"T{number} M6"
        yield from self.comments(text)
        yield self._tcp_on(number)

    def move_joint(self, moves: Moves) -> list[str]:
        """Return rapid blocks."""
        return self._blocks("G0", moves)

    def move_linear(self, moves: Moves) -> list[str]:
        """Return cutting blocks; the feed stands where it changes, and after every rapid move."""
        return self._blocks("G1", moves)

    def spindle(self, rev_min: float) -> Iterator[str]:
        """Return the words of a spindle speed."""
        yield f"S{trimmed(abs(rev_min), 3)} {'M3' if rev_min > 0 else 'M4'}" if rev_min else "M5"

    def coolant(self, on: bool) -> Iterator[str]:
        """Return the word of the coolant."""
        yield "M8" if on else "M9"

    def pause(self, seconds: float) -> Iterator[str]:
        """Return a dwell."""
        if self._dwell_word() == "P_MS":
            yield f"G4 P{fixed(round(seconds * 1000.0), 0)}"
        else:
            yield f"G4 {self._dwell_word()}{fixed(seconds, 3)}"

    def stop(self, text: str) -> Iterator[str]:
        """Return a program stop."""
        yield "M0"

    def finish(self, program: Program) -> Iterator[str]:
        """Return the end: tip control is switched off."""
        yield self.options.tcp_off or self.options.dialect.tcp_off
        yield "M30"
        if self.options.dialect.percent:
            yield "%"

    def targets(self, program: Program) -> FloatArray:
        """Return the axes (n, 3) of every move, or its two rotary angles (n, 2) in degrees.

        Raises
        ------
        PathError
            If forward kinematics of the written rotary words do not give the axis back.
        """
        axes = program.path.axes
        if self.options.orientation != "rotary":
            return axes
        angles = self._rotary_angles(axes)
        self._verify(program, angles)
        return np.column_stack([angles.tilt_deg, angles.turn_deg])

    def _blocks(self, code: str, moves: Moves) -> list[str]:
        options, factor = self.options, mm_per_unit(self.options.units)
        place, vector, angle = options.position_decimals, options.vector_decimals, options.angle_decimals
        tips = f"X{{:.{place}}} Y{{:.{place}}} Z{{:.{place}}}"
        turn = {
            "vector": f"I{{:.{vector}}} J{{:.{vector}}} K{{:.{vector}}}",
            "siemens": f"A3={{:.{vector}}} B3={{:.{vector}}} C3={{:.{vector}}}",
            "rotary": f"{options.kinematics[0]}{{:.{angle}}} C{{:.{angle}}}",
        }[options.orientation]
        feeds = self._feed_words(moves)
        return rows(f"{code} {tips} {turn}{{}}", *(moves.tips_mm / factor).T, *moves.targets.T, words(feeds))

    def _feed_words(self, moves: Moves) -> list[str]:
        decimals, factor = _FEED_DECIMALS[self.options.units], mm_per_unit(self.options.units)
        stated = zip(moves.states_feed.tolist(), (moves.feeds_mm_min / factor).tolist(), strict=True)
        return [f" F{trimmed(feed, decimals)}" if states else "" for states, feed in stated]

    def assemble(self, lines: Iterable[str]) -> Iterator[str]:
        """Return the lines with numbered blocks; comments, the O word and percent signs have no number."""
        number = 0
        for line in lines:
            if self.options.line_numbers and line[0] not in "%O(;":
                number += self.options.line_numbers
                yield f"N{number} {line}"
            else:
                yield line

    def _rotary_angles(self, axes: FloatArray) -> HeadAngles:
        """Return the angles as they are written, that is rounded."""
        exact = head_angles(axes, self.options.kinematics, self.options.singular_cone_deg)
        decimals = self.options.angle_decimals
        return HeadAngles(rounded(exact.tilt_deg, decimals), rounded(exact.turn_deg, decimals), exact.held)

    def _offset_findings(self, program: Program) -> list[Finding]:
        if self.options.work_offset:
            return []
        message = (
            f"no work offset is written: the coordinates are those of the {frame_name(program)} frame, and the active "
            f"offset must hold that frame; name one with {flag(self.name, 'work_offset', 'G54')}"
        )
        return [Finding(623, Level.INFO, message)]

    def _rotary_findings(self, program: Program) -> list[Finding]:
        path, options = program.path, self.options
        angles = self._rotary_angles(path.axes)
        errors = axis_errors_deg(path.axes, axes_from_angles(angles.tilt_deg, angles.turn_deg, options.kinematics))
        cone = flag(self.name, "singular_cone_deg", f"{options.singular_cone_deg:g}")
        travel = [flag(self.name, name, "lowest,highest") for name in ("tilt_limits_deg", "turn_limits_deg")]
        first, (low, high), (least, most) = options.kinematics[0], options.tilt_limits_deg, options.turn_limits_deg
        over_tilt = (angles.tilt_deg < low) | (angles.tilt_deg > high)
        over_turn = (angles.turn_deg < least) | (angles.turn_deg > most)
        steps = np.maximum(np.abs(np.diff(angles.turn_deg)), np.abs(np.diff(angles.tilt_deg)))
        large = np.concatenate([[False], steps > options.rotary_step_deg]) & ~path.rapid
        worst = float(errors[angles.held].max(initial=0.0))
        held = f"near the pole C is held, which turns the axis by at most {worst:.4f} degrees; the cone is {cone}"
        fast = (
            f"a rotary axis turns further than {options.rotary_step_deg:g} degrees in one cutting move; "
            f"divide the move, or allow it with {flag(self.name, 'rotary_step_deg', 'degrees')}"
        )
        tilted = f"{first} leaves its travel {low:g} to {high:g} degrees; if it can, set {travel[0]}"
        turned = f"C leaves its travel {least:g} to {most:g} degrees; if it can, set {travel[1]}"
        return [
            *stretch_findings(path, angles.held, 620, Level.INFO, held),
            *stretch_findings(path, over_tilt, 621, Level.FAIL, tilted),
            *stretch_findings(path, over_turn, 621, Level.FAIL, turned),
            *stretch_findings(path, large, 622, Level.WARN, fast),
        ]

    def _verify(self, program: Program, angles: HeadAngles) -> None:
        written = axes_from_angles(angles.tilt_deg, angles.turn_deg, self.options.kinematics)
        errors = axis_errors_deg(program.path.axes, written)
        precision = max(_VERIFIED_DEG, 10.0**-self.options.angle_decimals)
        wrong = errors > precision + np.where(angles.held, self.options.singular_cone_deg, 0.0)
        if wrong.any():
            move = int(np.argmax(wrong))
            raise PathError(
                f"post {self.name}, {move_place(program.path, move)}: the rotary words miss the tool axis by "
                f"{errors[move]:.5f} degrees; set {flag(self.name, 'orientation', 'vector')} and report this"
            )

    def _tcp_on(self, tool: int) -> str:
        words = self.options.tcp_on or self.options.dialect.tcp_on
        return words.replace("{tool}", f" H{tool}" if tool else "").strip()

    def _dwell_word(self) -> str:
        return self.options.dwell or self.options.dialect.dwell
