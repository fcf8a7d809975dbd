"""The VAL3 post: moves to declared points, and the files of the application."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from sicp_cam.findings import Finding, Level
from sicp_cam.model import EventKind, FloatArray, IntArray, Program, ToolPath
from sicp_postprocessors.base import failures
from sicp_postprocessors.moves import Moves, events_by_move, tools_in_use
from sicp_postprocessors.options import flag
from sicp_postprocessors.orientations import six_from_pose
from sicp_postprocessors.robot import ZERO, RobotPostprocessor
from sicp_postprocessors.rows import rows, words
from sicp_postprocessors.val3.loops import COUNTER, Run, runs_of
from sicp_postprocessors.val3.names import application_name
from sicp_postprocessors.val3.variables import (
    linked_variables,
    number_variables,
    other_variables,
    payload_variables,
    point_variables,
    pose_attributes,
    speed_variables,
    speeds_of,
)
from sicp_postprocessors.val3.words import Val3Words, tool_name
from sicp_postprocessors.val3.xml import S7, Dialect, Variable
from sicp_postprocessors.val3.xml_s6 import S6

__all__ = ["Val3"]

_ARRAY, _INDEX, _SPEEDS, _SPEED, _STRETCH = range(5)
_UNVERIFIED = "the form of setPayload is that of public programs; see on the controller that it takes {:g} kg at {}"


class Val3(Val3Words):
    """VAL3 application: project, data, `start`, `stop`, and further programs where the path is long.

    One `pointRx` for each move, in the frame `fPart`; straight moves at the feed of the path; outputs after the arm has
    come to rest. Only instructions that CS8C and CS9 share. The form of setPayload, the s6 files and dioLink are those
    of public programs, and were not tried on a controller.
    """

    name = "val3"
    summary = "Staubli VAL3 application folder (s7 XML, or s6) for CS8C and CS9 controllers"
    suffix = ""

    # --- moves ---

    def targets(self, program: Program) -> FloatArray:
        """Return for each move (n, 5) its array of points, index in it, array of speeds, speed in it, and stretch.

        A number of an array is -1 where there is one only, that of a speed for rapid moves. Events end a stretch.
        """
        path = program.path
        index, starts = np.arange(len(path)), np.zeros(len(path), np.int64)
        told = events_by_move(e for e in self.events(program) if e.kind is not EventKind.OTHER or self.switched(e))
        starts[[move for move in told if move < len(path)]] = 1
        speeds, pairs = self._speeds(path)
        points, those = self._divided(index, len(path)), self._divided(speeds, len(pairs))
        those[1][speeds < 0] = -1
        return np.column_stack([*points, *those, np.cumsum(starts)])

    def move_joint(self, moves: Moves) -> list[str]:
        """Return the move to the first point, which may take any way."""
        return _statements("movej", moves, words(["mStart"] * len(moves)))

    def move_linear(self, moves: Moves) -> list[str]:
        """Return a straight move for each point; or loops, and nothing for the other moves of a loop."""
        if self.options.style != "loop":
            return _statements("movel", moves, _speed_words(moves.targets))
        texts, single = np.full(len(moves), "", dtype=object), np.ones(len(moves), np.bool_)
        for run in _runs(moves.targets, moves.tools):
            if run.loops:
                texts[run.start], single[run.start : run.stop] = _loop(moves, run), False
        alone = moves.those(single)
        texts[single] = _statements("movel", alone, _speed_words(alone.targets)) if len(alone) else []
        statements: list[str] = texts.tolist()
        return statements

    def bodies(self, program: Program) -> list[list[str]]:
        """Return the statements of each program, without the empty places of moves that a loop makes."""
        bodies = super().bodies(program)
        return [list(filter(None, body)) for body in bodies] if self.options.style == "loop" else bodies

    def parts(self, path: ToolPath) -> list[range]:
        """Return the moves of each program: all of them in one, unless the style divides them."""
        return super().parts(path) if self.options.style == "split" else [range(len(path))]

    def _divided(self, numbers: IntArray, count: int) -> tuple[IntArray, IntArray]:
        """Return the array of each of some numbers below `count`, -1 if there is one only, and the index in it."""
        longest = self.options.max_points_per_array
        arrays = numbers // longest if count > longest else np.full(len(numbers), -1)
        return arrays, numbers % longest

    def _speeds(self, path: ToolPath) -> tuple[IntArray, FloatArray]:
        """Return the number of the speed of each move (n,), -1 for rapid moves and the first, and feeds and zones."""
        cuts = ~path.rapid
        cuts[:1] = False
        numbers = np.full(len(path), -1, np.int64)
        numbers[cuts], pairs = speeds_of(self.feeds_mm_min(path)[cuts], self.zones_mm(path)[cuts])
        return numbers, pairs

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

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every robot, and what the style and the payload bring with them."""
        findings = super().preflight(program)
        options, moves = self.options, len(program.path)
        if options.style != "split":
            findings = [finding for finding in findings if finding.code != 653]
        if options.style == "per-move" and moves > options.max_moves_per_program:
            message = (
                f"{moves} moves stand in one program, more than max_moves_per_program = "
                f"{options.max_moves_per_program}; divide it with {flag(self.name, 'style', 'split')}, or shorten it "
                f"with {flag(self.name, 'style', 'loop')}"
            )
            findings.append(Finding(653, Level.WARN, message))
        if options.payload is not None and not failures(findings):
            mass, *centre = options.payload
            message = _UNVERIFIED.format(mass, " ".join(f"{value:g}" for value in centre) + " mm from the flange")
            findings.append(Finding(641, Level.INFO, message))
        return findings

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the application folder."""
        application, data, dialect = self.program_name(program), f"{self.program_name(program)}.dtx", self._dialect()
        programs = {f"{name}.pgx": dialect.program_file(name, code) for name, code in self._programs(program).items()}
        files = programs | {
            f"{application}.pjx": dialect.project_file(self.options.version or dialect.version, programs, data),
            data: dialect.data_file(self._variables(program)),
        }
        return {f"{application}/{file}": content for file, content in sorted(files.items())}

    def _dialect(self) -> Dialect:
        return S6() if self.options.dialect == "s6" else S7()

    def _programs(self, program: Program) -> dict[str, list[str]]:
        """Return the statements of every program by its name, start and stop among them."""
        bodies, links = self.bodies(program), self._linking(program)
        # What an aborted run left in the motion queue must not move the arm now.
        head, end = [*self.opening(program), *links, "resetMotion()"], self.closing(program)
        stop = [*links, *self._stopping(program)]
        if len(bodies) == 1:
            return {"start": [*head, *bodies[0], *end], "stop": stop}
        parts = {f"move{number:03d}": body for number, body in enumerate(bodies)}
        return {"start": [*head, *(f"call {name}()" for name in parts), *end], "stop": stop, **parts}

    def _linking(self, program: Program) -> list[str]:
        """Return the statements that link inputs and outputs, in the dialect whose data do not."""
        if not self._dialect().linked_in_code:
            return []
        links = linked_variables(self.events(program), self._switched_links(program), self.options).items()
        return [
            f"{variable.type}Link({variable.name},io:{link.removeprefix('io:')})" for variable, link in links if link
        ]

    def _stopping(self, program: Program) -> list[str]:
        """Return the statements that the controller runs when the application is stopped: everything off, at once.

        Outputs of the user's stay: vacuum may hold the part.
        """
        kinds = {event.kind for event in self.events(program)}
        spindle = EventKind.SPINDLE in kinds
        signals = [*(self.spindle_signals() if spindle else ())]
        signals += [self.coolant_signal()] if EventKind.COOLANT in kinds else []
        off = [line for signal in signals if signal for line in self.switch(signal, False)]
        return ["resetMotion()", *off, *(self.spindle_speed(0.0) if spindle else ())]

    def _switched_links(self, program: Program) -> set[str]:
        return {switched[0] for event in program.path.events if (switched := self.switched(event))}

    def _variables(self, program: Program) -> list[Variable]:
        path, options = program.path, self.options
        frame = pose_attributes(six_from_pose(self.pose_in_world(program)), "world[0]")
        # Every VAL3 tool names an output for a gripper; valve1 is the one that each controller has.
        tool = pose_attributes(options.tool or ZERO, "flange[0]") | {"ioLink": "valve1"}
        numbers, first = np.unique(tools_in_use(path), return_index=True)
        tools = [tool_name(number) for number in numbers[np.argsort(first)].tolist()]
        events = self.events(program)
        links = linked_variables(events, self._switched_links(program), options)
        rapid_mm_s = min(options.rapid_mm_s, options.fastest_mm_s)
        return [
            Variable("fPart", "frame", [frame]),
            *(Variable(name, "tool", [tool]) for name in tools),
            *(Variable(each.name, each.type, [{"link": link} if link else {}]) for each, link in links.items()),
            *other_variables(events, options),
            *payload_variables(options.payload),
            *speed_variables(
                self._speeds(path)[1], rapid_mm_s, options, self._dialect(), rapids=bool(path.rapid[1:].any())
            ),
            *self._loop_variables(program),
            *point_variables(path, self.angles_deg(path), options, self._dialect()),
        ]

    def _loop_variables(self, program: Program) -> list[Variable]:
        """Return the counter of the loops, and for each point the number of its speed where loops have several."""
        if self.options.style != "loop":
            return []
        targets = self.targets(program)
        loops = [run for run in _runs(targets[1:], tools_in_use(program.path)[1:]) if run.loops]
        arrays = [max(int(targets[1 + run.start, _ARRAY]), 0) for run in loops if run.varies]
        speeds = np.maximum(targets[:, _SPEED], 0).astype(np.int64)
        return [
            *([Variable(COUNTER, "num", [{"value": "0"}])] if loops else []),
            *number_variables("nCut", speeds, arrays, self.options.max_points_per_array, self._dialect()),
        ]


def _statements(word: str, moves: Moves, speeds: npt.NDArray[np.bytes_]) -> list[str]:
    points = _named(moves.targets[:, _ARRAY], lambda number: _array("pPath", number))
    tools = _named(moves.tools, tool_name)
    return rows(f"{word}({{}}[{{:d}}],{{}},{{}})", points, moves.targets[:, _INDEX], tools, speeds)


def _speed_words(targets: FloatArray) -> npt.NDArray[np.bytes_]:
    """Return the speed of each straight move, as its statement names it."""
    width = targets[:, _SPEED].max(initial=0.0) + 2.0
    return _named(
        targets[:, _SPEEDS] * width + targets[:, _SPEED] + 1.0, lambda code: _speed_word(*divmod(code, int(width)))
    )


def _speed_word(array: int, place: int) -> str:
    return f"{_array('mCut', array)}[{place - 1}]" if place > 0 else "mRapid"


def _runs(targets: FloatArray, tools: IntArray) -> list[Run]:
    """Return the runs of straight moves that a loop can make, see `runs_of`."""
    rapid = targets[:, _SPEED] < 0
    groups = [targets[:, _ARRAY], targets[:, _SPEEDS], targets[:, _STRETCH], tools, rapid]
    return runs_of(np.column_stack(groups), targets[:, _SPEED].astype(np.int64))


def _loop(moves: Moves, run: Run) -> str:
    """Return the loop that makes the moves of a run."""
    array, first, speeds, speed, _ = moves.targets[run.start].astype(np.int64).tolist()
    last, number = int(moves.targets[run.stop - 1, _INDEX]), f"{_array('nCut', array)}[{COUNTER}]"
    fast = _array("mCut", speeds) + f"[{number if run.varies else speed}]" if speed >= 0 else "mRapid"
    move = f"movel({_array('pPath', array)}[{COUNTER}],{tool_name(int(moves.tools[run.start]))},{fast})"
    return f"for {COUNTER}={first} to {last}\n  {move}\nendFor"


def _array(name: str, number: int) -> str:
    return f"{name}{number:03d}" if number >= 0 else name


def _named(numbers: IntArray | FloatArray, name: Callable[[int], str]) -> npt.NDArray[np.bytes_]:
    """Return a column of names, of which there are few different ones."""
    different, which = np.unique(numbers, return_inverse=True)
    return words([name(int(number)) for number in different.tolist()])[which.reshape(-1)]
