"""Execute VAL3 programs as far as they are plain: moves to declared points, counted loops, calls, outputs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import EventKind, FloatArray
from sicp_formats.paths.moves import MoveList
from sicp_formats.robot.motion import RobotMoves, number_of, pose_xyz
from sicp_formats.robot.program import Language, RobotError, Runner, Statement, split_arguments, without_strings
from sicp_formats.val3.data import GEOMETRY
from sicp_formats.val3.project import Program, Project
from sicp_formats.val3.scope import Scope
from sicp_formats.val3.stretch import Stretch, loop_stretch, plain_moves, poses_of
from sicp_formats.val3.words import MOVES_NOTHING

__all__ = ["Val3Runner"]

_MOVE = re.compile(r"(?:([A-Za-z_]\w*)(?:\[[^\]]*\])?[ \t]*=[ \t]*)?(move[jlc])[ \t]*\((.*)\)", re.ASCII)
_CALL = re.compile(r"call[ \t]+([A-Za-z_][\w:]*)[ \t]*\((.*)\)", re.ASCII)
_FOR = re.compile(r"for[ \t]+([A-Za-z_]\w*)[ \t]*=(.+?)[ \t]to[ \t](.+?)(?:[ \t]step[ \t](.+))?", re.ASCII | re.I)
_ASSIGNMENT = re.compile(r"([A-Za-z_]\w*)[ \t]*(?:\[([^\]]*)\])?((?:\.\w+)*)[ \t]*=(?!=)(.*)", re.ASCII)
_FUNCTION = re.compile(r"([A-Za-z_$][\w:]*)[ \t]*\(", re.ASCII)
_DELAY = re.compile(r"delay[ \t]*\((.*)\)", re.ASCII)
_POINT_FUNCTION = re.compile(r"([A-Za-z_]\w*)[ \t]*\((.*)\)", re.ASCII)
_NAMES = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_ACTIVE = re.compile(r"\b(?:call|return)\b|\btask[a-z]|move[jlc]\b|\balter[a-z]", re.ASCII | re.I)
_DEEPEST_APPRO = 8
_SPEED_NOT_LIMITED = 9999.0
_LANGUAGE = Language(
    re.compile(r"(?:if|for|while|do|switch)\b", re.I),
    re.compile(r"(?:endIf|endFor|endWhile|until|endSwitch)\b", re.I),
    lambda text: bool(_ACTIVE.search(without_strings(text))) and not text.startswith("//"),
)


class Val3Runner(Runner):
    """Runs the programs of one application.

    Parameters
    ----------
    project
        The application.
    moves, robot
        Where its moves go.
    keep_frame
        True to leave points in their frame, False to bring them to the robot's world.
    rapid
        Names of the mdesc whose straight moves are rapid.
    calls
        Names of programs that move nothing.
    """

    def __init__(
        self,
        project: Project,
        moves: MoveList,
        robot: RobotMoves,
        keep_frame: bool,
        rapid: frozenset[str],
        calls: frozenset[str],
    ) -> None:
        super().__init__(moves, _LANGUAGE, calls)
        self.files: list[Path] = []
        self.frames: set[str] = set()
        self._project = project
        self._variables = project.variables
        self._robot = robot
        self._keep_frame = keep_frame
        self._rapid = rapid
        self._scope = Scope(project.variables)
        self._speeds: dict[tuple[str, str], float] = {}
        self._file = project.file

    def run_program(self, program: Program) -> None:
        """Execute a program from begin to end."""
        with self._scope.within(program.own_names):
            before, self._file = self._file, program.file
            self.run(program.file, program.statements)
            self._file = before

    def run(self, file: Path, statements: Sequence[Statement]) -> None:
        """Execute statements in order; stretches of plain moves in one go, where nothing is out of the ordinary."""
        done = 0
        for first, stop, stretch in plain_moves(statements, _LANGUAGE):
            super().run(file, statements[done:first])
            if not self._take(stretch):
                super().run(file, statements[first:stop])
            done = stop
        super().run(file, statements[done:])

    def execute(self, text: str, line: int) -> None:
        """Execute one statement."""
        if text.startswith("//"):
            self.moves.event(EventKind.COMMENT, line, 0.0, text[2:].strip())
        elif move := _MOVE.fullmatch(text):
            self._move(move[2], split_arguments(move[3]), line)
            if move[1]:
                self._scope.set(move[1], None)
        elif call := _CALL.fullmatch(text):
            self._call(call[1], call[2], line)
        elif _LANGUAGE.active(text):
            raise RobotError(f"'{printable(text, 40)}' may move the robot or leave the program; write the moves out")
        elif assignment := _ASSIGNMENT.fullmatch(text):
            self._assign(assignment[1], assignment[2], assignment[3], assignment[4])
            self.keep(text, line)
        else:
            self._function(text, line)

    def block(self, file: Path, statements: Sequence[Statement]) -> None:
        """Execute a counted loop; leave out any other block, if it moves nothing."""
        loop = _FOR.fullmatch(statements[0].text)
        if loop is None or not any(_LANGUAGE.active(each.text) for each in statements[1:-1]):
            super().block(file, statements)
            return
        first, last, step = (self._scope.whole(text) for text in (loop[2], loop[3], loop[4] or "1"))
        if step == 0:
            raise RobotError("the loop has a step of 0 and would not end; correct it")
        turns = range(first, last + (1 if step > 0 else -1), step)
        stretch = loop_stretch(loop[1], turns, statements[1], self._scope) if len(statements) == 3 else None
        if stretch is not None and self._take(stretch):
            self._scope.set(loop[1], turns[-1])
            return
        for value in turns:
            self._count()
            self._scope.set(loop[1], value)
            self.run(file, statements[1:-1])

    def forget(self, text: str) -> None:
        """Take what a statement sets, or may change, as not known."""
        if assigned := _ASSIGNMENT.fullmatch(text) or _FOR.fullmatch(text):
            self._scope.set(assigned[1], None)
        elif not (_LANGUAGE.opens.match(text) or _LANGUAGE.closes.match(text)):  # a condition changes nothing
            self._scope.changed.update(
                name for name in _NAMES.findall(without_strings(text)) if self._variables.type_of(name) in GEOMETRY
            )

    # --- motion ---

    def _take(self, stretch: Stretch) -> bool:
        """Take a stretch of straight moves as a whole; False if a line of it needs a look of its own."""
        if len(stretch.points) > self._left or stretch.names() & (self._scope.changed | self._scope.own_names):
            return False
        try:
            feeds = {speed: self._feed(f"{speed[0]}[{speed[1]}]") for speed in set(stretch.speeds)}
        except (RobotError, FormatError):
            return False
        found = poses_of(stretch, self._variables, self._scope, keep_frame=self._keep_frame)
        if found is None or (self._keep_frame and self.frames - {found[1]}):
            return False
        poses, told, applied = found
        poses[:, :3, 3] *= self.moves.mm
        rapid = np.array([name.lower() in self._rapid for name, _ in stretch.speeds], np.bool_)
        self._robot.with_tool(stretch.tool, stretch.lines[0])
        if not self._robot.straight_many(poses, np.array([feeds[s] for s in stretch.speeds]), rapid, stretch.lines):
            return False
        self._left -= len(stretch.points)
        if applied or self._keep_frame:
            self.frames.add(told)
        self._met()
        return True

    def _met(self) -> None:
        """Keep the file that moves are in."""
        if not self.files or self.files[-1] is not self._file:
            self.files = [*dict.fromkeys([*self.files, self._file])]

    def _move(self, word: str, arguments: list[str], line: int) -> None:
        if len(arguments) != (4 if word == "movec" else 3):
            raise RobotError(f"{word} does not have its {4 if word == 'movec' else 3} arguments; correct the line")
        poses = [self._point(each) for each in arguments[:-2]]
        tool, speed = arguments[-2:]
        known = [pose for pose in poses if pose is not None]
        self._robot.with_tool(tool, line)
        self._met()
        if len(known) < len(poses) and word != "movej":
            raise RobotError(f"{word} to joint angles; only movej takes them")
        if not known:
            self._robot.joints(line)
        elif word == "movej":
            self._robot.straight(known[0], 0.0, True, line)
        elif word == "movel":
            name, _ = self._scope.item(speed)
            self._robot.straight(known[0], self._feed(speed), name.lower() in self._rapid, line)
        else:
            self._robot.arc(known[0], known[1], self._feed(speed), line)

    def _feed(self, speed: str) -> float:
        """Return the feed in mm/min, 0 where the tip's speed is not limited."""
        name, key = self._scope.item(speed)
        if self._variables.type_of(name) != "mdesc":
            raise RobotError(f"'{printable(speed, 40)}' is no declared mdesc; the speed of the move is not known")
        limit = self._speeds.get((name, key))
        if limit is None:
            limit = self._variables.number(name, key, "tmax", _SPEED_NOT_LIMITED)
        if not limit > 0.0:
            raise RobotError(f"the speed tmax of {printable(speed, 40)} is not positive; correct it")
        return 0.0 if limit >= _SPEED_NOT_LIMITED else limit * 60.0 * self.moves.mm

    def _point(self, text: str, depth: int = 0) -> FloatArray | None:
        """Return the pose that an argument means, in mm; None for joint angles."""
        function = _POINT_FUNCTION.fullmatch(text)
        if function is None:
            return self._declared_point(text)
        arguments = split_arguments(function[2])
        if function[1] != "appro" or len(arguments) != 2 or depth > _DEEPEST_APPRO:
            raise RobotError(f"'{printable(text, 40)}' is computed; write the point into the .dtx file")
        pose = self._point(arguments[0], depth + 1)
        return None if pose is None else pose @ self._transformation(arguments[1])

    def _declared_point(self, text: str) -> FloatArray | None:
        name, key = self._scope.item(text)
        kind = self._variables.type_of(name)
        if kind == "joint":
            return None
        if kind not in ("point", None):
            raise RobotError(f"'{printable(text, 40)}' is a {printable(kind, 20)} and no point; correct the line")
        pose = self._variables.pose(name, key)
        father = self._variables.father(name, key)
        told = f"{father[0]}[{father[1]}]"
        if self._keep_frame:
            if self.frames - {told}:
                raise RobotError(f"{text} stands in {told}, points before in another frame; set path.frame to apply")
            self.frames.add(told)
        else:
            if self._scope.changed:
                self._scope.refuse_changed(list(self._variables.fathers(name, key)))
            T_world_frame = self._variables.frame(*father)
            if T_world_frame is not None:
                self.frames.add(told)
                pose = T_world_frame @ pose
        return self._in_mm(pose)

    def _transformation(self, text: str) -> FloatArray:
        if text.startswith("{") and text.endswith("}"):
            numbers = [number_of(each) for each in split_arguments(text[1:-1])]
            known = [number for number in numbers if number is not None]
            if len(known) != 6 or len(numbers) != 6:
                raise RobotError(f"'{printable(text, 40)}' is not six numbers; nothing is computed here")
            x, y, z, rx, ry, rz = known
            return self._in_mm(pose_xyz(x, y, z, rx, ry, rz))
        name, key = self._scope.item(text)
        if self._variables.type_of(name) not in ("trsf", None):
            raise RobotError(f"'{printable(text, 40)}' is no trsf; correct the line")
        return self._in_mm(self._variables.pose(name, key))

    def _in_mm(self, pose: FloatArray) -> FloatArray:
        pose = pose.copy()
        pose[:3, 3] *= self.moves.mm
        return pose

    # --- everything else ---

    def _call(self, name: str, arguments: str, line: int) -> None:
        program = self._project.program(name)
        if arguments.strip() and program is not None:
            raise RobotError(f"call {printable(name, 40)} has arguments, which are not followed; write the moves out")
        self.call(name, line, None if program is None else lambda: self.run_program(program))

    def _assign(self, name: str, index: str | None, attribute: str, value: str) -> None:
        number = number_of(value)
        if self._variables.type_of(name) == "mdesc" and attribute and name not in self._scope.changed:
            if attribute == ".tvel":
                if number is None:
                    raise RobotError(f"the speed {name}.tvel is computed; write a number")
                self._speeds[name, str(self._scope.whole(index or "0"))] = number
            return
        whole = int(number) if number is not None and number.is_integer() and not (index or attribute) else None
        self._scope.set(name, whole)

    def _function(self, text: str, line: int) -> None:
        if delay := _DELAY.fullmatch(text):
            seconds = number_of(delay[1])
            if seconds is not None and seconds >= 0.0:
                self.moves.event(EventKind.DWELL, line, seconds, text)
                return
        function = _FUNCTION.match(text)
        if function is not None and function[1] in MOVES_NOTHING:
            self.keep(text, line)
        else:
            self.forget(text)
            self.unknown(text, line)
