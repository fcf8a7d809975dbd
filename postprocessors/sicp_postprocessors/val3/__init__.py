"""Stäubli VAL3: an application folder for CS8C (s7) and CS9 (s8) controllers.

The rigid part of a correction can stay in the frame `fPart`, where the operator sees it; the points then hold the rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from sicp_cam.model import EventKind, FloatArray, IntArray, Program, ToolPath
from sicp_postprocessors.moves import Moves, tools_in_use
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.orientations import six_from_pose
from sicp_postprocessors.robot import ZERO, RobotPostprocessor
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.text import ascii_line, ascii_name
from sicp_postprocessors.val3.options import Val3Options
from sicp_postprocessors.val3.variables import (
    event_variables,
    point_variables,
    pose_attributes,
    speed_variables,
    speeds_of,
)
from sicp_postprocessors.val3.xml import Variable, data_file, program_file, project_file

__all__ = ["Val3", "Val3Options", "application_name"]

_LONGEST_NAME = 15
# The language's own words, and the names that Windows keeps for devices: the folder is copied with it.
_RESERVED = re.compile(
    r"begin|end(if|for|while|switch)?|if|then|else(if)?|for|to|step|do|while|until|switch|case|default|break|call|return"
    r"|and|or|xor|not|true|false|world|flange|start|stop|global|void|num|bool|string|dio|aio|sio|frame|tool|trsf"
    r"|(point|joint)(rx|rs)?|mdesc|config|con|prn|aux|nul|(com|lpt)[1-9]",
    re.IGNORECASE,
)


class Val3(RobotPostprocessor):
    """VAL3 application: project, data, `start`, `stop`, and further programs where the path is long.

    One `pointRx` for each move, in the frame `fPart`; straight moves at the feed of the path; outputs after the arm has
    come to rest. Only instructions that CS8C and CS9 share.
    """

    name = "val3"
    summary = "Staubli VAL3 application folder (s7 XML) for CS8C and CS9 controllers"
    Options = Val3Options
    options: Val3Options
    suffix = ""

    # --- words ---

    def comment(self, text: str) -> str:
        """Return a comment."""
        return f"// {text}"

    def comments(self, text: str) -> list[str]:
        """Return text as comments, without the mark that ends an XML character section."""
        return RobotPostprocessor.comments(self, text.replace("]]>", "]] >"))

    def wait(self) -> Iterator[str]:
        """Return the wait for the arm."""
        yield "waitEndMove()"

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the assignment that switches an output."""
        yield f"{signal}={'true' if on else 'false'}"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause."""
        yield f"delay({trimmed(seconds, 3)})"

    def operator(self, text: str) -> Iterator[str]:
        """Return the wait for an input, or for a variable that the operator sets."""
        if self.options.log_messages:
            yield f'logMsg("{ascii_line(f"stop {text}", drop=chr(34) + chr(92))[:60]}")'
        if self.options.continue_input:
            # A whole press: an input that is still on from the stop before does not count.
            yield "wait(diContinue==false)"
            yield "wait(diContinue==true)"
        else:
            yield "bContinue=false"
            yield "wait(bContinue)"

    def spindle_signals(self) -> tuple[str, str]:
        """Return the names of the spindle's outputs, which are declared also where they are linked later."""
        return "doSpindle", "doSpindleCcw" if self.options.spindle_ccw_output else ""

    def coolant_signal(self) -> str:
        """Return the name of the coolant's output."""
        return "doCoolant"

    def spindle_speed(self, rev_min: float) -> Iterator[str]:
        """Return the speed as a number or analog output, where the options ask for it."""
        value = trimmed(rev_min * self.options.speed_scale, 6)
        if self.options.spindle_speed == "num":
            yield f"nSpindle={value}"
        if self.options.spindle_speed == "aio":
            yield f"aioSet(aoSpindle,{value})"

    def targets(self, program: Program) -> FloatArray:
        """Return for each move (n, 3) the number of its array of points, its index in it, and the number of its speed.

        One array has the number -1; the speeds of rapid moves have it too.
        """
        path, longest = program.path, self.options.max_points_per_array
        index = np.arange(len(path))
        arrays = index // longest if len(path) > longest else np.full(len(path), -1)
        return np.column_stack([arrays, index % longest, self._speeds(path)[0]])

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point, which may take any way."""
        return _statements("movej", moves, ["mStart"] * len(moves))

    def move_linear(self, moves: Moves) -> list[str]:
        """Return a straight move for each point."""
        return _statements("movel", moves, [f"mCut[{n}]" if n >= 0 else "mRapid" for n in _whole(moves.targets[:, 2])])

    # --- the files ---

    def program_name(self, program: Program) -> str:
        """Return the name of the application."""
        return application_name(program.name)

    def pose_in_world(self, program: Program) -> FloatArray:
        """Return the pose of the program frame in VAL3's world, whose origin is the shoulder."""
        pose = RobotPostprocessor.pose_in_world(self, program)
        pose[2, 3] -= self.options.shoulder_height_mm
        return pose

    def main_file(self, files: Mapping[str, bytes]) -> str:
        """Return the project file."""
        return next(name for name in files if name.endswith(".pjx"))

    def reading(self) -> Mapping[str, object]:
        """Let the reader keep the points as they stand in fPart."""
        return {"frame": "keep"}

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the application folder."""
        application, data = self.program_name(program), f"{self.program_name(program)}.dtx"
        programs = {f"{name}.pgx": program_file(name, code) for name, code in self._programs(program).items()}
        files = programs | {
            f"{application}.pjx": project_file(self.options.version, programs, data),
            data: data_file(self._variables(program)),
        }
        return {f"{application}/{file}": content for file, content in sorted(files.items())}

    def _programs(self, program: Program) -> dict[str, list[str]]:
        """Return the statements of every program by its name, start and stop among them."""
        bodies = self.bodies(program)
        # What an aborted run left in the motion queue must not move the arm now.
        head, end = [*self.opening(program), "resetMotion()"], self.closing(program)
        stop = self._stopping(program.path)
        if len(bodies) == 1:
            return {"start": [*head, *bodies[0], *end], "stop": stop}
        parts = {f"move{number:03d}": body for number, body in enumerate(bodies)}
        return {"start": [*head, *(f"call {name}()" for name in parts), *end], "stop": stop, **parts}

    def finish(self, program: Program) -> Iterator[str]:
        """Wait for the last move: the application ends when its program does."""
        yield from self.wait()

    def _stopping(self, path: ToolPath) -> list[str]:
        """Return the statements that the controller runs when the application is stopped: everything off, at once."""
        kinds = {event.kind for event in path.events}
        signals = self.spindle_signals() if EventKind.SPINDLE in kinds else ()
        coolant = (self.coolant_signal(),) if EventKind.COOLANT in kinds else ()
        return [line for signal in (*signals, *coolant) if signal for line in self.switch(signal, False)]

    def _variables(self, program: Program) -> list[Variable]:
        path, options = program.path, self.options
        frame = pose_attributes(six_from_pose(self.pose_in_world(program)), "world[0]")
        # Every VAL3 tool names an output for a gripper; valve1 is the one that each controller has.
        tool = pose_attributes(options.tool or ZERO, "flange[0]") | {"ioLink": "valve1"}
        tools = dict.fromkeys(_tool_name(number) for number in _whole(tools_in_use(path)))
        return [
            Variable("fPart", "frame", [frame]),
            *(Variable(name, "tool", [tool]) for name in tools),
            *event_variables(path, options),
            *speed_variables(self._speeds(path)[1], min(options.rapid_mm_s, options.fastest_mm_s), options),
            *point_variables(path, self.angles_deg(path), options),
        ]

    def _speeds(self, path: ToolPath) -> tuple[IntArray, FloatArray]:
        """Return the number of the speed of each move (n,), -1 for rapid moves and the first, and feeds and zones."""
        cuts = ~path.rapid
        cuts[:1] = False
        numbers = np.full(len(path), -1, np.int64)
        numbers[cuts], pairs = speeds_of(self.feeds_mm_min(path)[cuts], self.zones_mm(path)[cuts])
        return numbers, pairs

    def remarks(self, program: Program) -> Iterator[str]:
        """Return how the points are meant."""
        options, world = self.options, "the robot's world is at the shoulder (axes 1 and 2), not on the base plate"
        yield self.frame_remark(program, "fPart")
        if options.world_origin == "base_plate":
            pose = "the scan frame is taken to lie there" if options.cell is None else "cell was measured from there"
            height = trimmed(options.shoulder_height_mm, 3)
            yield f"{world}, which is {height} mm below; {pose}, and fPart is shifted by that"
        else:
            yield world if options.cell is None else f"{world}; cell was measured from the shoulder"
        yield "points: mm and degrees, R = Rx Ry Rz, in frame fPart; tool Z points out of the flange into the work"
        yield from self.run_remarks()


def application_name(name: str) -> str:
    """Return a program name as VAL3 takes it for an application: 15 letters and digits, a letter first.

    >>> application_name("trim_porthole-left side 2"), application_name("start")
    ('trimportholelef', 'startApp')
    """
    plain = ascii_name(name, _LONGEST_NAME)
    return f"{plain}App" if _RESERVED.fullmatch(plain) else plain


def _statements(word: str, moves: Moves, speeds: list[str]) -> list[str]:
    arrays = words([f"{number:03d}" if number >= 0 else "" for number in _whole(moves.targets[:, 0])])
    tools = words([_tool_name(number) for number in _whole(moves.tools)])
    return rows(f"{word}(pPath{{}}[{{:d}}],{{}},{{}})", arrays, moves.targets[:, 1], tools, words(speeds))


def _tool_name(number: int) -> str:
    return f"tTool{number}" if number >= 0 else "tTool"


def _whole(numbers: FloatArray | IntArray) -> list[int]:
    whole: list[int] = numbers.astype(np.int64).tolist()
    return whole
