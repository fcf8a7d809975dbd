"""What robots have in common whose programs are plain text: signals, payload, speeds, poses in their own angles, parts.

Codes: 670 payload not given, 671 tool or frame must be on the controller, 672 corners are rounded by speed and not by
distance, 673 speed beyond what the language takes, 674 speed rounded, 675 analog value too large, 676
configuration not given.
"""

from __future__ import annotations

import dataclasses
import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, FloatArray, Program, ToolPath
from sicp_cam.ranges import Between
from sicp_postprocessors.base import failures
from sicp_postprocessors.checks import event_place, frame_findings, stretch_findings
from sicp_postprocessors.moves import tools_in_use
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.options import THIS_POST, flag
from sicp_postprocessors.orientations import Six, pose_from_six
from sicp_postprocessors.robot import RobotPostprocessor
from sicp_postprocessors.robot_options import RobotOptions, output_words
from sicp_postprocessors.self_test import self_test_program
from sicp_postprocessors.text import ascii_name

__all__ = ["ControllerOptions", "ControllerPostprocessor", "Payload", "labelled", "tool_numbers"]

Payload = tuple[float, float, float, float]
"""Mass in kg, and centre of gravity x, y, z in the flange in mm."""

_SHORT_NAME = 16
_HEAVIEST_KG = 1000.0
_OF_THE_FIRST_POINT = ("status", "turn", "configuration")
_WHOLE_TEST = 1000
"""More moves than a self-test has: it is never divided."""


@dataclass(frozen=True, slots=True)
class ControllerOptions(RobotOptions):
    """Options of every robot whose programs are plain text."""

    pose_angles: Literal["xyz", "own"] = "xyz"
    """How `tool` and `cell` are turned: R = Rx Ry Rz, or `own`: three numbers as the controller itself shows them."""
    payload: Payload | None = None
    """Mass in kg, and centre of gravity x, y, z in the flange in mm."""
    spindle_speed: Literal["none", "aio"] = "none"
    """Leave the speed to the spindle drive, or write it to an analog output."""
    spindle_speed_output: str = ""
    """Analog output of the spindle speed, for `spindle_speed` = aio."""
    spindle_speed_scale: Annotated[float | None, Between(1e-9, 1e3)] = None
    """Value of that output for one rev/min; must be given for aio."""
    self_test: Literal["off", "origin", "start"] = "off"
    """Also write a self-test: steps about the origin of the frame, or the first point, which show tool and frame."""
    self_test_step_mm: Annotated[float, Between(1.0, 500.0)] = 50.0
    """Length of its steps."""
    decimals: Annotated[int, Between(3, 6)] = 4
    """Decimals of positions in mm."""

    # What a digital output is called by, as a pattern and in words; and an analog one.
    signal: ClassVar[re.Pattern[str]]
    signal_words: ClassVar[str]
    analog: ClassVar[re.Pattern[str]]
    analog_words: ClassVar[str]

    def problems(self) -> list[str]:
        """Return what does not go together, one line each."""
        problems = RobotOptions.problems(self)
        words, _ = output_words(self.outputs)
        named = [(name, getattr(self, name)) for name in ("spindle_output", "spindle_ccw_output", "coolant_output")]
        problems += [
            f"option {option!r} must be {self.signal_words}, not {printable(signal)!r}"
            for option, signal in (*named, *(("outputs", signal) for signal, _ in words.values()))
            if signal and not self.signal.fullmatch(signal)
        ]
        return [*problems, *self._speed_problems(), *self._payload_problems()]

    @property
    def commands_speed(self) -> bool:
        """Whether the program states the speed of the spindle."""
        return self.spindle_speed != "none"

    def one_of(self, option: str, other: str) -> list[str]:
        """Return the problem of two options that say one thing, as a list that is empty if there is none."""
        both = getattr(self, option) is not None and getattr(self, other) is not None
        return [f"options {option!r} and {other!r} say the same thing twice; give one of them"] if both else []

    def _speed_problems(self) -> list[str]:
        wanted, output = self.spindle_speed == "aio", self.spindle_speed_output
        if wanted != bool(output):
            return ["options 'spindle_speed' = aio and 'spindle_speed_output' belong together; give both"]
        if output and not self.analog.fullmatch(output):
            return [f"option 'spindle_speed_output' must be {self.analog_words}, not {printable(output)!r}"]
        if wanted and self.spindle_speed_scale is None:
            words = flag(THIS_POST, "spindle_speed_scale", "0.00005")
            return [f"option 'spindle_speed' = aio needs the value for one rev/min, such as {words}; ask the drive"]
        return []

    def _payload_problems(self) -> list[str]:
        if self.payload is None or 0.0 < self.payload[0] <= _HEAVIEST_KG:
            return []
        return [f"option 'payload' begins with a mass from above 0 to {_HEAVIEST_KG:g} kg, not {self.payload[0]:g}"]


class ControllerPostprocessor(RobotPostprocessor):
    """Template of a robot whose programs are plain text: a main program, and parts where the path is long."""

    Options = ControllerOptions
    options: ControllerOptions
    longest_name: ClassVar[int]
    """Letters that a program's name may have."""
    reserved: ClassVar[frozenset[str]]
    """Words, in lower case, that are no names."""
    convention: ClassVar[str]
    """How positions and orientations are written, in words for the head."""
    largest_mm_s: ClassVar[float] = np.inf
    """Speed that the language takes at most."""
    smallest_mm_s: ClassVar[float] = 1e-3
    """Speed below which its words would round the feed away."""
    largest_analog: ClassVar[float] = np.inf
    """Value that an analog output takes at most."""

    @abstractmethod
    def program_files(self, program: Program, name: str) -> dict[str, bytes]:
        """Return the files of a program by that name, the one that is opened first."""

    @abstractmethod
    def frame_words(self) -> str:
        """Return what the program calls the frame of its points."""

    @abstractmethod
    def analog(self, output: str, value: float) -> Iterator[str]:
        """Return the lines that set an analog output."""

    def spindle_speed(self, rev_min: float) -> Iterator[str]:
        """Return the speed for the analog output, where the options ask for it."""
        options = self.options
        if options.spindle_speed == "aio":
            yield from self.analog(options.spindle_speed_output, rev_min * (options.spindle_speed_scale or 0.0))

    def own_pose(self, six: Six) -> FloatArray:
        """Return the pose (4, 4) of six numbers in the controller's own angles."""
        return pose_from_six(six)

    def pose_of_six(self, six: Six) -> FloatArray:
        """Return the pose that six numbers of an option mean, by `pose_angles`."""
        return self.own_pose(six) if self.options.pose_angles == "own" else pose_from_six(six)

    # --- names and files ---

    def program_name(self, program: Program) -> str:
        """Return the name as the language takes it, short enough for the endings of parts and self-test."""
        longest = self.longest_name - len(self._test_ending())
        plain = ascii_name(program.name, longest, other="_")
        return plain if plain.lower() not in self.reserved else f"P{plain}"[:longest]

    def part_names(self, name: str, count: int) -> list[str]:
        """Return the names of the parts of a program; none where it has one part only."""
        mark = "" if self.longest_name < _SHORT_NAME else "_"
        digits = max(3, len(str(count)))
        stem = name[: self.longest_name - digits - len(mark)]
        return [f"{stem}{mark}{number:0{digits}}" for number in range(1, count + 1)] if count > 1 else []

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the files of the program, and of its self-test where the options ask for one."""
        name, options = self.program_name(program), self.options
        files = self.program_files(program, name)
        if options.self_test != "off":
            called = name + self._test_ending()
            test = self_test_program(program, called, options.self_test, options.self_test_step_mm)
            files |= self._for_test().program_files(test, called)
        return files

    def _test_ending(self) -> str:
        return "TST" if self.longest_name < _SHORT_NAME else "_test"

    def _for_test(self) -> ControllerPostprocessor:
        post = type(self)()
        # What was said of the arm at the first point of the path does not hold here.
        defaults: dict[str, Any] = {field.name: field.default for field in dataclasses.fields(self.options)}
        forgotten = {name: defaults[name] for name in _OF_THE_FIRST_POINT if name in defaults}
        post.options = dataclasses.replace(
            self.options,
            self_test="off",
            first_run=True,
            spin="transport",
            max_moves_per_program=_WHOLE_TEST,
            **forgotten,
        )
        return post

    def reading(self) -> Mapping[str, object] | str:
        """Let the reader read what is written as it stands."""
        return {}

    # --- what is told ---

    def cell_on_controller(self) -> bool:
        """Say whether the controller itself knows where the scan frame is."""
        return self.options.cell is None and self.options.cell_is_known

    def payload_is_known(self) -> bool:
        """Say whether the program or the controller's tool states the payload."""
        return self.options.payload is not None

    def remarks(self, program: Program) -> Iterator[str]:
        """Return how the points are meant, and how they are run."""
        if self.cell_on_controller():
            yield f"points stand in {self.frame_words()} of the controller, which must be the scan frame"
        else:
            yield self.frame_remark(program, self.frame_words())
        yield f"points: {self.convention}; tool Z points out of the flange into the work"
        yield from self.run_remarks()

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every robot, and those about payload, speeds and what the controller must hold."""
        findings = super().preflight(program)
        if failures(findings):
            return findings
        findings += [*self._speed_findings(program.path), *self._payload_findings()]
        findings += [*self._analog_findings(program.path), *self._self_test_findings(program)]
        if self.cell_on_controller():
            remedy = "the controller has the scan frame only: run with --frame scan, or give the cell"
            findings += frame_findings(program, Level.FAIL, remedy)
        return findings

    def _speed_findings(self, path: ToolPath) -> list[Finding]:
        too_fast = self.feeds_mm_min(path) > self.largest_mm_s * 60.0
        message = f"the speed is beyond the {self.largest_mm_s:g} mm/s that the controller takes; lower the feed"
        words = f"lower it with {flag(self.name, 'rapid_mm_s', f'{self.largest_mm_s:g}')}"
        too_slow = ~path.rapid & (path.feeds_mm_min < self.smallest_mm_s * 60.0)
        slow = f"the speed is below {self.smallest_mm_s:g} mm/s, and would be rounded away; raise the feed"
        return [
            *stretch_findings(path, too_slow, 673, Level.FAIL, slow),
            *stretch_findings(path, too_fast & ~path.rapid, 673, Level.FAIL, message),
            *stretch_findings(path, too_fast & path.rapid, 673, Level.FAIL, message.replace("lower the feed", words)),
        ]

    def _self_test_findings(self, program: Program) -> list[Finding]:
        """Return what forbids the self-test, which is judged like any program."""
        options = self.options
        if options.self_test == "off":
            return []
        test = self_test_program(program, "self-test", options.self_test, options.self_test_step_mm)
        found = self._for_test().preflight(test)
        return [dataclasses.replace(f, message=f"self-test: {f.message}") for f in found if f.level is Level.FAIL]

    def _analog_findings(self, path: ToolPath) -> list[Finding]:
        options = self.options
        if options.spindle_speed != "aio":
            return []
        message = f"the spindle speed is a value beyond the {self.largest_analog:g} that the analog output takes; mend "
        words = message + flag(self.name, "spindle_speed_scale", "VALUE")
        scale = options.spindle_speed_scale or 0.0
        return [
            Finding(675, Level.FAIL, words, event_place(event))
            for event in path.events
            if event.kind is EventKind.SPINDLE and abs(event.value) * scale > self.largest_analog
        ]

    def _payload_findings(self) -> list[Finding]:
        if self.payload_is_known():
            return []
        words = flag(self.name, "payload", "KG,X,Y,Z")
        message = f"no payload is stated, and a robot moves worse without it; give it with {words}"
        return [Finding(670, Level.WARN, message)]


def tool_numbers(path: ToolPath) -> list[int]:
    """Return the numbers of the tools of a path, -1 where none is named, in the order in which they come."""
    tools = tools_in_use(path)
    numbers: list[int] = tools[np.sort(np.unique(tools, return_index=True)[1])].tolist()
    return numbers


def labelled(values: tuple[float, ...], names: str, decimals: int = 6) -> str:
    """Return numbers with their names.

    >>> labelled((1.0, 2.5), "XY")
    'X 1,Y 2.5'
    """
    return ",".join(f"{name} {trimmed(value, decimals)}" for name, value in zip(names, values, strict=True))
