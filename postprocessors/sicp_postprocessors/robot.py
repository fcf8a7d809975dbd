"""What all robots share: straight rapid moves, zones, the spin of the tool, outputs that wait for the arm, operators.

A robot's program holds tip and full orientation in a frame, and the tool and the frame themselves. Its interpreter runs
ahead of the arm, so every output waits until the arm has come to rest.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import ClassVar

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import Event, EventKind, FloatArray, Program, ToolPath
from sicp_cam.rigid_motion import apply
from sicp_postprocessors.arm import Configuration, arm_findings, no_arm_finding
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import frame_name, in_scan_frame
from sicp_postprocessors.moves import events_in_order
from sicp_postprocessors.numbers import LARGEST, trimmed
from sicp_postprocessors.options import flag
from sicp_postprocessors.orientations import Six, angles_from_axes, pose_from_six, rotation_matrices
from sicp_postprocessors.robot_findings import changes_tool_by_hand, robot_findings
from sicp_postprocessors.robot_options import RobotOptions, output_words
from sicp_postprocessors.template import LinePostprocessor
from sicp_postprocessors.zones import passed_points, zones_mm

__all__ = ["ZERO", "RobotPostprocessor", "stop_words"]

ZERO: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_FEED_DECIMALS = 6
_SAME_HEIGHT_MM = 0.5
_CONFIGURATION = ("shoulder", "elbow", "wrist")


class RobotPostprocessor(LinePostprocessor):
    """Template of a robot: what stands here is said of the arm, and a controller adds its words.

    A controller answers `wait`, `switch`, `delay` and `operator` besides the verbs of motion; spindle, coolant,
    outputs, pauses, stops and tool changes are made of these.
    """

    Options = RobotOptions
    options: RobotOptions
    straight_rapids: ClassVar[bool] = True
    carries_frame: ClassVar[bool] = True

    # --- words of the controller ---

    @abstractmethod
    def wait(self) -> Iterable[str]:
        """Return the lines that wait until the arm has come to rest."""

    @abstractmethod
    def switch(self, signal: str, on: bool) -> Iterable[str]:
        """Return the lines that switch a digital output at once; `signal` as the options name it."""

    @abstractmethod
    def delay(self, seconds: float) -> Iterable[str]:
        """Return the lines of a pause."""

    @abstractmethod
    def operator(self, text: str) -> Iterable[str]:
        """Return the lines that hold the program until the operator lets it go on."""

    def spindle_speed(self, rev_min: float) -> Iterable[str]:
        """Return the lines that command a speed, where the controller does that; the direction is switched."""
        return ()

    def spindle_signals(self) -> tuple[str, str]:
        """Return the outputs that start the spindle clockwise and counter-clockwise; empty where there is none."""
        return self.options.spindle_output, self.options.spindle_ccw_output

    def coolant_signal(self) -> str:
        """Return the output of the coolant; empty where there is none."""
        return self.options.coolant_output

    # --- verbs made of them ---

    def tool(self, number: int, text: str, *, first: bool) -> Iterable[str]:
        """Return a remark on the tool; a change by hand has its stop behind it."""
        return () if first else self.comments(f"tool {number} {text}")

    def spindle(self, rev_min: float) -> Iterator[str]:
        """Return the switching of the spindle: the other direction off, this one on, and time to come to speed."""
        clockwise, counter = self.spindle_signals()
        yield from self.wait()
        if rev_min:
            sense = "counter-clockwise" if rev_min < 0 else "clockwise"
            yield from self.comments(f"spindle {trimmed(abs(rev_min), 3)} rev/min {sense}")
        yield from self.spindle_speed(abs(rev_min))
        wanted, other = (counter, clockwise) if rev_min < 0 else (clockwise, counter)
        for signal, on in ((other, False), (wanted, rev_min != 0.0)):
            if signal:
                yield from self.switch(signal, on)
        if rev_min:
            yield from self.delay(self.options.spindle_dwell_s)

    def coolant(self, on: bool) -> Iterator[str]:
        """Return the switching of coolant or extraction."""
        if signal := self.coolant_signal():
            yield from self.output(signal, on)

    def output(self, signal: str, on: bool) -> Iterator[str]:
        """Return the switching of an output once the arm is at rest."""
        yield from self.wait()
        yield from self.switch(signal, on)

    def pause(self, seconds: float) -> Iterator[str]:
        """Return a pause at rest."""
        yield from self.wait()
        yield from self.delay(seconds)

    def stop(self, text: str) -> Iterator[str]:
        """Return a stop at rest that the operator ends."""
        yield from self.wait()
        yield from self.comments(stop_words(text))
        yield from self.operator(text)

    # --- the path as a robot takes it ---

    def feeds_mm_min(self, path: ToolPath) -> FloatArray:
        """Return the speed of each move: rapid moves have one of their own, and a first run a limit."""
        options = self.options
        feeds = np.where(path.rapid, options.rapid_mm_s * 60.0, path.feeds_mm_min)
        limited: FloatArray = np.minimum(feeds, options.fastest_mm_s * 60.0).round(_FEED_DECIMALS)
        return limited

    def zones_mm(self, path: ToolPath) -> FloatArray:
        """Return the zones, zero where the arm must come to rest."""
        options = self.options
        if not options.blends:
            return np.zeros(len(path))
        passed = passed_points(path)
        passed[[e.before_move - 1 for e in path.events if e.before_move > 0 and self.switched(e)]] = False
        return zones_mm(path, passed, options.blend_mm, options.blend_corner_mm)

    def angles_deg(self, path: ToolPath) -> FloatArray:
        """Return rx, ry, rz (n, 3) of the tool of every move: its Z against the axis, its spin as the options say."""
        return angles_from_axes(path.axes, self.options.spin_deg, self.options.spin == "transport")

    def rotations(self, path: ToolPath) -> FloatArray:
        """Return the rotations (n, 3, 3) of the tool of every move in the program frame."""
        return rotation_matrices(self.angles_deg(path))

    def pose_of_six(self, six: Six) -> FloatArray:
        """Return the pose (4, 4) that six numbers of an option mean."""
        return pose_from_six(six)

    def pose_in_world(self, program: Program) -> FloatArray:
        """Return the pose (4, 4) of the program frame in the robot's world: the cell, and the scan frame within it."""
        pose: FloatArray = self.pose_of_six(self.options.cell or ZERO) @ program.T_scan_program
        return pose

    def tool_in_flange(self) -> FloatArray:
        """Return the pose (4, 4) of the tool in the flange."""
        return self.pose_of_six(self.options.tool or ZERO)

    def events(self, program: Program) -> list[Event]:
        """Return the events as the program tells them, with what a person must do in its place.

        A tool change by hand needs spindle and coolant off before it, and a stop behind it; then the coolant goes on.
        A spindle that no output starts is started by the operator, for whom the program stops; what no output switches
        off is told in a comment. Nor does the arm move before the operator has seen that tool or cell is not stated.
        """
        return [*self._not_stated(), *(self._told_by_hand(event) for event in self._with_tool_changes(program))]

    def _not_stated(self) -> list[Event]:
        known = {"tool": self.options.tool_is_known, "cell": self.options.cell_is_known}
        missing = " and ".join(name for name, is_known in known.items() if not is_known)
        return [Event(0, EventKind.STOP, 0.0, f"teach {missing}, not stated")] if missing else []

    def _with_tool_changes(self, program: Program) -> list[Event]:
        told: list[Event] = []
        running = dict.fromkeys((EventKind.SPINDLE, EventKind.COOLANT), 0.0)
        for event in events_in_order(program.path):
            if changes_tool_by_hand(event):
                told += self._tool_change(event, running)
                running[EventKind.SPINDLE] = 0.0
            else:
                told.append(event)
            if event.kind in running:
                running[event.kind] = event.value
        return told

    def _tool_change(self, event: Event, running: Mapping[EventKind, float]) -> list[Event]:
        """Return a tool change between what must be off for it and what goes on behind it."""
        off = [kind for kind, value in running.items() if value]
        by_hand = EventKind.SPINDLE in off and not any(self.spindle_signals()) and not self.options.commands_speed
        text = f"{'spindle off, ' if by_hand else ''}tool {int(event.value)} {event.text}".strip()
        back = [(EventKind.COOLANT, 1.0, "")] if EventKind.COOLANT in off else []
        told = [
            *((kind, 0.0, "") for kind in off),
            (EventKind.TOOL, event.value, event.text),
            (EventKind.STOP, 0.0, text),
            *back,
        ]
        return [Event(event.before_move, kind, value, words, event.line) for kind, value, words in told]

    def stops_spindle(self, event: Event) -> bool:
        """Say that a tool is changed by hand once the path has begun, and with the spindle off."""
        return changes_tool_by_hand(event)

    def _told_by_hand(self, event: Event) -> Event:
        """Return a stop or comment in place of an event that no output switches, other events as they are."""
        clockwise, counter = self.spindle_signals()
        if event.kind is EventKind.COOLANT and not self.coolant_signal():
            text = f"coolant {'on' if event.value > 0 else 'off'}: no output is named for it"
            return Event(event.before_move, EventKind.COMMENT, 0.0, text, event.line)
        if event.kind is not EventKind.SPINDLE or self.options.commands_speed:
            return event
        if (counter if event.value < 0.0 else clockwise) or (event.value == 0.0 and counter):
            return event
        if event.value == 0.0:
            text = "spindle off: no output is named for it"
            return Event(event.before_move, EventKind.COMMENT, 0.0, text, event.line)
        # Short, since pendants show 40 letters.
        text = f"start spindle {'ccw' if event.value < 0.0 else 'cw'}, {trimmed(abs(event.value), 3)} rev/min"
        return Event(event.before_move, EventKind.STOP, 0.0, text, event.line)

    def switched(self, event: Event) -> tuple[str, bool] | None:
        """Return the output that a word of the path switches, by the option `outputs`."""
        words, _ = output_words(self.options.outputs)
        return words.get("".join(event.text.split()).upper()) if event.kind is EventKind.OTHER else None

    # --- what is told ---

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and what the operator must set or know before the robot moves."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        path = program.path
        findings += robot_findings(path, self.angles_deg(path), self.zones_mm(path), self.options, self.name)
        if not np.abs(self.pose_in_world(program)[:3, 3]).max() <= LARGEST:
            words = flag(self.name, "cell", "x,y,z,rx,ry,rz")
            findings.append(Finding(605, Level.FAIL, f"the program frame lies beyond {LARGEST:g} mm; check {words}"))
        return [*findings, *self._arm_findings(program)]

    def _arm_findings(self, program: Program) -> list[Finding]:
        """Return what the path asks of the arm, if a model of it is given."""
        path, options, arm = program.path, self.options, self.options.arm()
        if arm is None:
            words = flag(self.name, "robot", "NAME")
            return [no_arm_finding(f"name the robot with {words}, or a file of it")] if program.placed else []
        if missing := [name for name in ("tool", "cell") if getattr(options, name) is None]:
            words = " and ".join(flag(self.name, name, "x,y,z,rx,ry,rz") for name in missing)
            message = f"what the {arm.name} can reach depends on {' and '.join(missing)}; give {words}, or no robot"
            return [Finding(664, Level.FAIL, message)]
        if not program.placed:
            return []
        T = self.pose_in_world(program)
        stated_mm = getattr(options, "shoulder_height_mm", 0.0)
        told = []
        if stated_mm and abs(stated_mm - arm.shoulder_height_mm) > _SAME_HEIGHT_MM:
            words = flag(self.name, "shoulder_height_mm", f"{arm.shoulder_height_mm:g}")
            message = f"shoulder_height_mm is {stated_mm:g}, but that of the {arm.name} is what {words} states"
            told.append(Finding(669, Level.WARN, message))
        return told + arm_findings(
            path,
            apply(T, path.tips_mm),
            T[:3, :3] @ self.rotations(path),
            self.feeds_mm_min(path) / 60.0,
            self.tool_in_flange(),
            arm,
            asked=tuple(str(getattr(options, word, "")) for word in _CONFIGURATION),
            singular_deg=options.singular_deg,
            ask=self._ask,
        )

    def _ask(self, configuration: Configuration) -> str:
        """Return how to ask for a configuration, where the controller can be asked."""
        if not all(hasattr(self.options, word) for word in _CONFIGURATION):
            return str(configuration)
        return " ".join(flag(self.name, word, getattr(configuration, word)) for word in _CONFIGURATION)

    def remarks(self, program: Program) -> Iterator[str]:
        """Return how the points are meant, and how fast and how exactly they are run."""
        yield self.frame_remark(program)
        yield from self.run_remarks()

    def run_remarks(self) -> Iterator[str]:
        """Return how fast and how exactly the points are run."""
        options = self.options
        if options.blends:
            reach, off = trimmed(options.blend_mm, 6), trimmed(options.blend_corner_mm, 6)
            yield f"points between cuts are blended: within {reach} mm, corners cut by {off} mm at most"
        if options.first_run:
            yield f"first run: no blending, no straight move faster than {trimmed(options.first_run_mm_s, 3)} mm/s"

    def frame_remark(self, program: Program, named: str = "the program frame") -> str:
        """Return what the program's frame is the pose of: the scan frame, or the part in it."""
        if not self.options.cell_is_known:
            pose = f"the {frame_name(program)} frame" if in_scan_frame(program) else "the part in the scan frame"
            taken = f"the {'scan' if program.corrected else 'path'} frame"
            return f"{named} is the pose of {pose}; no cell is given, so {taken} is taken as the robot's world"
        if in_scan_frame(program):
            return f"{named} is the pose of the {frame_name(program)} frame in the robot's world: the option cell"
        return f"{named} is the pose of the part in the robot's world: the option cell times its pose in the scan frame"


def stop_words(text: str) -> str:
    """Return what a stop says to the operator.

    >>> stop_words("turn the part over"), stop_words("")
    ('stop: turn the part over', 'stop')
    """
    return f"stop: {text}" if text.strip() else "stop"
