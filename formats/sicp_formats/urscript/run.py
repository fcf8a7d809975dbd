"""Execute Universal Robots scripts as far as they are plain: movej, movel, movep and movec to stated poses, calls."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.model import EventKind, FloatArray
from sicp_formats.paths.moves import MoveList
from sicp_formats.robot.motion import RobotMoves, number_of
from sicp_formats.robot.program import Language, RobotError, Runner, without_strings
from sicp_formats.urscript.data import ASSIGNMENT, Data, arguments_of
from sicp_formats.urscript.text import BLOCK, Function

__all__ = ["UrRunner"]

_CALL = re.compile(r"(\w+)[ \t]*\((.*)\)", re.ASCII)
_CALLED = re.compile(r"\b([A-Za-z_]\w*)[ \t]*\(", re.ASCII)
_MOVES = ("movej", "movel", "movep", "movec")
_HARMLESS = re.compile(
    r"(?:set|get|read|write|is|rtde|socket|modbus|zero|textmsg|popup|sleep|sync|pose|norm|d2r|r2d|to|stop[jl]|min|max"
    r"|request|encoder|enter_critical|exit_critical|wrench|interpolate|inv|size|length|floor|ceil|sqrt|abs|a?sin|a?cos"
    r"|a?tan2?|assert|random|str|step|not|and|or|if|elif|while|power|reset)(?:_\w*|\b)",
    re.ASCII,
)
_DANGEROUS = re.compile(r"(?:set_conveyor|track|path_offset|force|teach|freedrive|servo|speed|jog|move)\w*", re.ASCII)
_WAYS = re.compile(r"(?:return|break|continue|thread|run|kill|join)\b", re.ASCII)
_DEFAULT_M_S = 0.25
_MM_MIN_PER_M_S = 60_000.0
_PLACES = {"movej": ("a", "v", "t", "r"), "movel": ("a", "v", "t", "r"), "movep": ("a", "v", "r")}


def _active(text: str) -> bool:
    """Say whether a statement may move the robot or leave the way of the script."""
    if text.startswith("#") or text in ("end", "else:", "halt", "sync()"):
        return False
    called = _CALLED.findall(without_strings(text))
    return bool(_WAYS.match(text)) or any(not _HARMLESS.fullmatch(name) or _DANGEROUS.match(name) for name in called)


class UrRunner(Runner):
    """Runs the functions of one script.

    Parameters
    ----------
    file, functions
        The file, and its functions by name.
    moves, robot
        Where its moves go.
    calls
        Names of functions that move nothing.
    """

    def __init__(
        self,
        file: Path,
        functions: Mapping[str, Function],
        moves: MoveList,
        robot: RobotMoves,
        calls: frozenset[str],
    ) -> None:
        super().__init__(moves, Language(BLOCK, re.compile("end$"), self._may_move), calls)
        self._file = file
        self._functions = functions
        self._data = Data()
        self._robot = robot

    def run_function(self, name: str) -> None:
        """Execute a function of the script."""
        self.run(self._file, self._functions[name].statements)

    def execute(self, text: str, line: int) -> None:
        """Execute one statement."""
        call = _CALL.fullmatch(text)
        if text.startswith("#"):
            self.moves.event(EventKind.COMMENT, line, 0.0, text[1:].strip())
        elif text == "halt":
            self.moves.event(EventKind.STOP, line, 0.0, text)
        elif call and call[1] in _MOVES:
            self._move(call[1], call[2], line)
        elif call:
            self._call(call[1], call[2], text, line)
        elif ASSIGNMENT.fullmatch(text):
            if self._is_active(text):
                raise RobotError(f"'{printable(text, 40)}' calls what may move the robot; write the moves out")
            self._data.assign(text)
            self.keep(text, line)
        elif _WAYS.match(text):
            raise RobotError(f"'{printable(text, 40)}' leaves the way of the script; write the moves out")
        else:
            self.unknown(text, line)

    def forget(self, text: str) -> None:
        """Take what a statement sets as not known."""
        self._data.forget(text)
        if text.startswith("set_tcp"):
            raise RobotError("set_tcp under a condition; write the script out")

    def _may_move(self, text: str) -> bool:
        """Say whether a statement moves the robot, leaves the way, or calls a function of the script."""
        return _active(text) or any(name in self._functions for name in _CALLED.findall(without_strings(text)))

    # --- motion ---

    def _move(self, word: str, arguments: str, line: int) -> None:
        places, named = arguments_of(arguments)
        points = 2 if word == "movec" else 1
        names = ("pose_via", "pose_to") if points == 2 else ("q" if word == "movej" else "pose",)
        texts = [*places[:points], *(named[name] for name in names[len(places) :] if name in named)]
        if len(texts) != points:
            raise RobotError(f"{word} lacks its points; correct the line")
        settings = dict(zip(_PLACES.get(word, ("a", "v", "r")), places[points:], strict=False)) | named
        feed = 0.0 if word == "movej" else self._feed(settings)
        poses = [self._pose(word, text, line) for text in texts]
        known = [pose for pose in poses if pose is not None]
        if len(known) < points:
            if word != "movej":
                raise RobotError(f"{word} to joint angles; write the point as p[x,y,z,rx,ry,rz]")
            self._robot.joints(line)
        elif word == "movec":
            self._robot.arc(known[0], known[1], feed, line)
        else:
            self._robot.straight(known[0], feed, word == "movej", line)

    def _pose(self, word: str, text: str, line: int) -> FloatArray | None:
        pose, frame = self._data.target(text)
        if pose is not None:
            self._robot.in_frame(frame, line)
        return pose

    def _feed(self, settings: Mapping[str, str]) -> float:
        """Return the feed in mm/min; without v it is the one of the manual."""
        if "t" in settings and self._data.number(settings["t"]) > 0.0:
            raise RobotError("the time of the move is given instead of its speed (t); write v")
        m_s = self._data.number(settings["v"]) if "v" in settings else _DEFAULT_M_S
        if not 0.0 < m_s * _MM_MIN_PER_M_S < 1e12:
            raise RobotError(f"the speed {m_s:g} m/s is not possible; correct it")
        return m_s * _MM_MIN_PER_M_S

    # --- everything else ---

    def _call(self, name: str, arguments: str, text: str, line: int) -> None:
        places, named = arguments_of(arguments)
        seconds = number_of(places[0]) if len(places) == 1 else None
        if name in self._functions:
            if places or named or self._functions[name].takes_arguments:
                raise RobotError(
                    f"the call of {printable(name, 40)} has arguments, which are not followed; write it out"
                )
            self.call(name, line, lambda: self.run_function(name))
        elif name == "sleep" and seconds is not None and seconds >= 0.0:
            self.moves.event(EventKind.DWELL, line, seconds, text)
        elif name == "popup" and "true" in named.get("blocking", places[4] if len(places) > 4 else "").lower():
            self.moves.event(EventKind.STOP, line, 0.0, text)
        elif name == "set_tcp":
            self._robot.with_tool(text, line)
        elif name.lower() in self._moving_nothing or self._is_active(text):
            self.call(name, line, None)
        else:
            self.keep(text, line)
