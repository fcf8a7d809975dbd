"""Execute KUKA programs as far as they are plain: PTP, LIN and CIRC to stated points, feeds, outputs, subprograms."""

from __future__ import annotations

import re
from collections.abc import Callable

from sicp_cam.errors import printable
from sicp_cam.model import EventKind, FloatArray
from sicp_formats.krl.data import ASSIGNMENT, Aggregate
from sicp_formats.krl.text import Module
from sicp_formats.paths.moves import MoveList
from sicp_formats.robot.motion import RobotMoves, number_of, pose_zyx
from sicp_formats.robot.program import Language, RobotError, Runner, split_arguments, without_strings

__all__ = ["KrlRunner"]

_MOVE = re.compile(r"(S?PTP|S?LIN|S?CIRC)(_REL)?(?=[ \t{])[ \t]*(.*)", re.ASCII | re.IGNORECASE)
_APPROXIMATION = re.compile(r"(?:[ \t]+C_(?:DIS|VEL|ORI|PTP|SPL))+[ \t]*$", re.ASCII | re.IGNORECASE)
_WITH = re.compile(r"[ \t]WITH[ \t]", re.ASCII | re.IGNORECASE)
_SPLINE_SPEED = re.compile(r"\$VEL[ \t]*=[ \t]*SVEL_CP[ \t]*\(([^,()]*)[,)]|\$VEL\.CP[ \t]*=([^,]*)", re.ASCII | re.I)
_REFERENCE = re.compile(r"(.*\})[ \t]*#(BASE|TOOL)[ \t]*", re.ASCII | re.IGNORECASE)
_BAS = re.compile(r"BAS[ \t]*\([ \t]*#(\w+)[ \t]*,(.*)\)", re.ASCII | re.IGNORECASE)
_WAIT = re.compile(r"WAIT[ \t]+SEC[ \t]+(.*)", re.ASCII | re.IGNORECASE)
_CALL = re.compile(r"([A-Z_]\w*)[ \t]*\((.*)\)", re.ASCII | re.IGNORECASE)
_NOT_CALLED = r"(?:BAS|IF|WHILE|UNTIL|SWITCH|CASE|FOR|WAIT|PULSE|TRIGGER|CWRITE|ANOUT|SET_CD_PARAMS)\b"
_MOVING = re.compile(r"\b(?:(?:S?PTP|S?LIN|S?CIRC)(?:_REL)?|SPL(?:INE)?|PTP_SPLINE|GOTO|RETURN|EXIT)\b", re.IGNORECASE)
_CALLING = re.compile(rf"(?!{_NOT_CALLED})[A-Z_]\w*[ \t]*\(", re.IGNORECASE)
_HARMLESS = re.compile(
    r"(?:GLOBAL[ \t]+)?INTERRUPT\b|TRIGGER\b|PULSE\b|CONTINUE\b|DECL\b|EXT\b|EXTFCT\b|ENUM\b|STRUC\b|SIGNAL\b|GLOBAL\b"
    r"|(?:INT|REAL|BOOL|CHAR|E6POS|E6AXIS|POS|AXIS|FRAME)[ \t]|ANOUT\b|ANIN\b|DIGIN\b|WAIT\b|CWRITE\b|BRAKE\b"
    r"|SET_CD_PARAMS\b",
    re.ASCII | re.IGNORECASE,
)


def _active(text: str) -> bool:
    """Say whether a statement may move the robot or leave the way of the program."""
    plain = without_strings(text)
    return not text.startswith(";") and bool(_MOVING.search(plain) or _CALLING.match(plain))


_LANGUAGE = Language(
    re.compile(r"(?:IF|FOR|WHILE|LOOP|REPEAT|SWITCH|SPLINE|PTP_SPLINE)\b", re.IGNORECASE),
    re.compile(r"(?:ENDIF|ENDFOR|ENDWHILE|ENDLOOP|UNTIL|ENDSWITCH|ENDSPLINE)\b", re.IGNORECASE),
    _active,
)
_POSE = ("X", "Y", "Z", "A", "B", "C")
_JOINTS = ("A1", "A2", "A3", "A4", "A5", "A6")
_EXTERNAL = ("E1", "E2", "E3", "E4", "E5", "E6")
_MM_MIN_PER_M_S = 60_000.0
_MOST_FILES = 1000


class KrlRunner(Runner):
    """Runs the subprograms of a .src file, and those of files beside it that bear their name.

    Parameters
    ----------
    module
        The file to begin with.
    beside
        Returns the file of a name, None if there is none.
    moves, robot
        Where its moves go.
    calls
        Names of subprograms that move nothing.
    """

    def __init__(
        self,
        module: Module,
        beside: Callable[[str], Module | None],
        moves: MoveList,
        robot: RobotMoves,
        calls: frozenset[str],
    ) -> None:
        super().__init__(moves, _LANGUAGE, calls)
        self._module = module
        self._others: dict[str, Module | None] = {}
        self._beside = beside
        self._values = module.values
        self._robot = robot
        self._feed: float | None = 0.0
        self._last: Aggregate = {}

    @property
    def files(self) -> int:
        """Return from how many files statements were read."""
        return 1 + sum(module is not None for module in self._others.values())

    def run_subprogram(self, module: Module, name: str) -> None:
        """Execute a subprogram, with the variables of its own file."""
        before = self._module, self._values
        self._module, self._values = module, module.values
        self.run(module.file, module.subprograms[name].statements)
        self._module, self._values = before

    def execute(self, text: str, line: int) -> None:
        """Execute one statement."""
        if text.startswith(";"):
            self._comment(text, line)
        elif move := _MOVE.fullmatch(text):
            self._move(move[1].upper(), bool(move[2]), move[3], line)
        elif bas := _BAS.fullmatch(text):
            self._bas(bas[1].upper(), bas[2].strip(), line)
            self.keep(text, line)
        elif wait := _WAIT.fullmatch(text):
            self._wait(wait[1], text, line)
        elif text.upper() == "HALT":
            self.moves.event(EventKind.STOP, line, 0.0, text)
        elif assignment := ASSIGNMENT.fullmatch(text):
            self._assign(assignment[1].upper(), assignment[3].upper(), assignment[4].strip(), line)
            self._values.assign(text)
            self.keep(text, line)
        elif _HARMLESS.match(text):
            self.keep(text, line)
        elif call := _CALL.fullmatch(text):
            self._call(call[1], call[2], line)
        elif _active(text):
            raise RobotError(f"'{printable(text, 40)}' may move the robot or leave the program; write the moves out")
        else:
            self.unknown(text, line)

    def forget(self, text: str) -> None:
        """Take what a statement sets as not known."""
        self._values.forget(text)
        name = text.upper()
        if name.startswith(("$VEL", "BAS")):
            self._feed = None
        if name.startswith(("$BASE", "BAS", "FDAT_ACT", "$IPO_MODE")):
            raise RobotError(f"'{printable(text, 40)}' may change the base under a condition; write the program out")

    # --- motion ---

    def _move(self, word: str, relative: bool, rest: str, line: int) -> None:
        spline = word.startswith("S")
        word = word.removeprefix("S")
        feed = self._feed
        if settings := _WITH.search(rest):
            feed = self._spline_feed(rest[settings.end() :], feed)
            rest = rest[: settings.start()]
        rest = _APPROXIMATION.sub("", rest).strip()
        if relative:
            self._relative(word, rest, feed, line)
            return
        points = split_arguments(rest)
        if len(points) != (2 if word == "CIRC" else 1):
            what = "an angle CA or missing points" if word == "CIRC" else "more than a point"
            raise RobotError(f"{'S' if spline else ''}{word} with {what} is not read; write the moves out")
        aggregates = [self._values.aggregate(point) for point in points]
        if any(name in aggregates[-1] for name in _JOINTS):
            if word != "PTP":
                raise RobotError(f"{word} to joint angles; only PTP takes them")
            self._robot.joints(line)
            self._last = {}
            return
        poses = [self._pose(aggregate) for aggregate in aggregates]
        self._go(word, poses, feed, line)
        self._last = {**self._last, **{name: aggregates[-1][name] for name in _POSE if name in aggregates[-1]}}
        if any(name in aggregates[-1] for name in _EXTERNAL):
            self._robot.external_axes(tuple(aggregates[-1].get(name, 0.0) for name in _EXTERNAL), line)

    def _go(self, word: str, poses: list[FloatArray], feed: float | None, line: int) -> None:
        if word == "PTP":
            self._robot.straight(poses[-1], 0.0, True, line)
            return
        if feed is None:
            raise RobotError("the speed of the move is set under a condition or computed; write $VEL.CP as a number")
        if word == "LIN":
            self._robot.straight(poses[-1], feed, False, line)
        else:
            self._robot.arc(poses[0], poses[1], feed, line)

    def _pose(self, aggregate: Aggregate) -> FloatArray:
        """Return the pose of a point; what it leaves out stays as it was."""
        full = {**self._last, **aggregate}
        missing = [name for name in _POSE if name not in full]
        if missing:
            raise RobotError(f"the point leaves out {', '.join(missing)}, and no point before has it; state it")
        return pose_zyx(*(full[name] for name in _POSE))

    def _relative(self, word: str, rest: str, feed: float | None, line: int) -> None:
        """Move on by a translation in the base, or in the tool."""
        reference = _REFERENCE.fullmatch(rest)
        step = self._values.aggregate(reference[1] if reference else rest)
        in_tool = bool(reference and reference[2].upper() == "TOOL")
        if self._robot.pose is None or word == "CIRC" or set(step) - {"X", "Y", "Z"}:
            raise RobotError(f"{word}_REL is read with X, Y and Z behind a known point only; write the points out")
        pose = self._robot.pose.copy()
        by = [step.get(name, 0.0) for name in "XYZ"]
        pose[:3, 3] += pose[:3, :3] @ by if in_tool else by
        self._go(word, [pose], feed, line)
        self._last = {**self._last, **dict(zip("XYZ", pose[:3, 3].tolist(), strict=True))}

    def _spline_feed(self, settings: str, feed: float | None) -> float | None:
        """Return the feed that the settings behind WITH state, or the one that holds anyway."""
        if "$IPO_MODE" in settings.upper() and "#TCP" in settings.upper():
            raise RobotError("the robot carries the part past a fixed tool; the path of the tool is not in the program")
        if "$VEL" not in settings.upper():
            return feed
        match = _SPLINE_SPEED.search(settings)
        if match is None:
            raise RobotError("the speed behind WITH is computed; write it as a number")
        return self._in_mm_min(match[1] or match[2])

    # --- settings ---

    def _in_mm_min(self, text: str) -> float:
        speed = self._values.number(text.strip())
        if not 0.0 < speed * _MM_MIN_PER_M_S < 1e12:
            raise RobotError(f"the speed {speed:g} m/s is not possible; correct it")
        return speed * _MM_MIN_PER_M_S

    def _bas(self, command: str, argument: str, line: int) -> None:
        if command in ("CP_PARAMS", "VEL_CP"):
            self._feed = self._in_mm_min(argument)
        elif command == "BASE":
            self._robot.in_frame(f"BASE_DATA[{argument}]", line)
        elif command == "TOOL":
            self._robot.with_tool(f"TOOL_DATA[{argument}]", line)
        elif command == "INITMOV":
            self._feed = 0.0

    def _assign(self, name: str, component: str, value: str, line: int) -> None:
        if name == "$VEL" and component in ("", ".CP"):
            held = self._values.aggregate(value) if not component else {"CP": self._values.number(value)}
            if "CP" in held:
                self._feed = self._in_mm_min(repr(held["CP"]))
        elif name == "$BASE" and component:
            raise RobotError(f"${name[1:]}{component} is set by itself; state the whole base")
        elif name == "$BASE":
            self._robot.in_frame("$BASE = " + value, line)
        elif name == "$TOOL" and not component:
            self._robot.with_tool(value, line)
        elif name == "$IPO_MODE" and value.upper() != "#BASE":
            raise RobotError("the robot carries the part past a fixed tool; the path of the tool is not in the program")
        elif name == "FDAT_ACT":
            self._point_data(value, line)

    def _point_data(self, value: str, line: int) -> None:
        """Take base and tool of an inline form, where the .dat file tells them."""
        held = self._values.known.get(value.upper())
        if isinstance(held, dict):
            if "BASE_NO" in held:
                self._robot.in_frame(f"BASE_DATA[{held['BASE_NO']:g}]", line)
            if "TOOL_NO" in held:
                self._robot.with_tool(f"TOOL_DATA[{held['TOOL_NO']:g}]", line)

    # --- everything else ---

    def _comment(self, text: str, line: int) -> None:
        words = text[1:].partition(";%")[0].strip()
        if words and words.upper() != "ENDFOLD" and not words.upper().startswith("ENDFOLD "):
            self.moves.event(EventKind.COMMENT, line, 0.0, words)

    def _wait(self, seconds: str, text: str, line: int) -> None:
        value = number_of(seconds)
        if value == 0.0:
            self.keep(text, line)  # it only holds the interpreter until the arm is there
        elif value is None or value < 0.0:
            self.unknown(text, line)
        else:
            self.moves.event(EventKind.DWELL, line, value, text)

    def _call(self, name: str, arguments: str, line: int) -> None:
        known = name.lower() in self._moving_nothing
        module = self._module if known or name.upper() in self._module.subprograms else self._other(name.upper())
        subprogram = None if module is None else module.subprograms.get(name.upper())
        if module is None or subprogram is None:
            self.call(name, line, None)
        elif arguments.strip() or subprogram.takes_arguments:
            raise RobotError(f"the call of {printable(name, 40)} has arguments, which are not followed; write it out")
        else:
            self.call(name, line, lambda: self.run_subprogram(module, name.upper()))

    def _other(self, name: str) -> Module | None:
        """Return another file that bears the name of a subprogram, read once."""
        if name not in self._others:
            if len(self._others) >= _MOST_FILES:
                raise RobotError(f"more than {_MOST_FILES} other programs are called")
            self._others[name] = self._beside(name)
        return self._others[name]
