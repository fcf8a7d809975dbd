"""Execute RAPID procedures as far as they are plain: MoveJ, MoveL and MoveC to declared targets, outputs, own calls."""

from __future__ import annotations

import re
from collections.abc import Mapping

from sicp_cam.errors import printable
from sicp_cam.model import EventKind
from sicp_formats.paths.moves import MoveList
from sicp_formats.rapid.data import ASSIGNED, Data, Target, arguments_of
from sicp_formats.rapid.text import Routine
from sicp_formats.robot.motion import RobotMoves
from sicp_formats.robot.program import Language, RobotError, Runner

__all__ = ["RapidRunner"]

_MOVE = re.compile(r"(Move[JLC]|MoveAbsJ|Move[JLC]DO)\b[ \t]*(.*)", re.IGNORECASE | re.DOTALL)
_WORD = re.compile(r"(\w+)[ \t]*(.*)", re.ASCII | re.DOTALL)
_OVERRIDE = re.compile(r"VelSet[ \t]+(.*)", re.IGNORECASE | re.DOTALL)
_REFUSED = {
    **dict.fromkeys(
        ("pdispset", "pdispon", "eoffsset", "eoffson"),
        "it displaces the points that follow; write the points out",
    ),
    **dict.fromkeys(
        ("corrcon", "corrwrite", "conveyor", "waitwobj", "softact"),
        "the robot would leave the programmed points; write the path out",
    ),
    **dict.fromkeys(
        ("return", "goto", "exitcycle", "raise", "trynext", "retry"), "the way of the program is not followed"
    ),
}
_HARMLESS_WORDS = """
    accset actunit clkreset clkstart clkstop close confj confl connect deactunit errwrite gripload idelete incr decr add
    clear idisable ienable inverted isignaldi isleep iwatch itimer mechunitload open pathaccLim pathresol pdispoff
    eoffsoff pulsedo reset set setao setdo setgo singarea softdeact speedrefresh stopmove startmove tperase tpreadfk
    tpshow tpwrite uishow velset waitao waitdi waitdo waitgi waitrob waituntil worldacclim write writebin
"""
_HARMLESS = frozenset(_HARMLESS_WORDS.lower().split())
_STOPS = frozenset({"stop", "exit", "break", "systemstopaction"})
_KEPT = _HARMLESS | _STOPS | {"waittime", "else", "elseif", "case", "default", "endif", "endtest", "endfor", "endwhile"}
_OPENS = re.compile(r"(?:IF\b.*\bTHEN|FOR\b|WHILE\b|TEST\b)", re.IGNORECASE | re.DOTALL)
_SHORT_IF = re.compile(
    r"IF\b(?:(?!Move|Trigg|Search).)*[\s)](?:Set|Reset|SetDO|TPWrite)[ \t]+[\w\", ]+", re.I | re.DOTALL
)
_CLOSES = re.compile(r"(?:ENDIF|ENDFOR|ENDWHILE|ENDTEST)\b", re.IGNORECASE)
_LARGEST_SPEED = 1e9


def _active(text: str) -> bool:
    """Say whether a statement may move the robot: whatever is neither known, a comment nor an assignment."""
    if text.startswith("!") or ASSIGNED.fullmatch(text):
        return False
    match = _WORD.match(text)
    word = match[1].lower() if match else ""
    if word == "if" and not _OPENS.match(text):
        return not _SHORT_IF.fullmatch(text)
    return not (_OPENS.match(text) or word in _KEPT)


class RapidRunner(Runner):
    """Runs the procedures of the modules of a program.

    Parameters
    ----------
    routines, data
        Procedures by lower-case name, and the data of all modules.
    moves, robot
        Where its moves go.
    calls
        Names of procedures that move nothing.
    """

    def __init__(
        self,
        routines: Mapping[str, Routine],
        data: Data,
        moves: MoveList,
        robot: RobotMoves,
        calls: frozenset[str],
    ) -> None:
        super().__init__(moves, Language(_OPENS, _CLOSES, _active), calls)
        self._routines = routines
        self._data = data
        self._robot = robot
        self._override = 1.0
        self._fastest_mm_s = _LARGEST_SPEED

    def run_routine(self, name: str) -> None:
        """Execute a procedure of the module."""
        statements = self._routines[name].statements
        before = {own: self._data.known.get(own) for own in self._data.declared_names(each.text for each in statements)}
        self.run(self._routines[name].file, statements)
        for own, held in before.items():
            self._data.known.pop(own, None)
            if held is not None:
                self._data.known[own] = held

    def execute(self, text: str, line: int) -> None:
        """Execute one statement."""
        if text.startswith("!"):
            self.moves.event(EventKind.COMMENT, line, 0.0, text[1:].strip())
        elif move := _MOVE.fullmatch(text):
            self._move(move[1].lower(), move[2], line)
        elif self._data.declare(text):
            return
        elif kind := self._data.assign(text):
            if kind in ("wobjdata", "tooldata"):
                raise RobotError(f"'{printable(text, 40)}' changes a {kind} within the program; declare its value")
            self.keep(text, line)
        else:
            self._instruction(text, line)

    def forget(self, text: str) -> None:
        """Take what a statement sets as not known."""
        self._data.forget(text)
        if _OVERRIDE.match(text):
            raise RobotError("VelSet under a condition; write the program out")

    # --- motion ---

    def _move(self, word: str, rest: str, line: int) -> None:
        positions, switches = arguments_of(rest)
        outputs = word.endswith("do")
        word = word.removesuffix("do") if word != "moveabsj" else word
        points = 2 if word == "movec" else 1
        if len(positions) < points + 3:
            raise RobotError(f"{word} lacks points, speed, zone or tool; correct the line")
        self._robot.with_tool(positions[points + 2], line)
        if word == "moveabsj":
            self._robot.joints(line)
            return
        targets = [self._data.target(each) for each in positions[:points]]
        known = [target for target in targets if target is not None]
        if len(known) < points:
            raise RobotError(f"{word} to joint angles; only MoveAbsJ takes them")
        self._robot.in_frame(switches.get("wobj", "wobj0"), line)
        self._go(word, known, self._feed(positions[points], switches), line)
        if outputs:
            self.moves.event(EventKind.OTHER, line, 0.0, f"SetDO {', '.join(positions[points + 3 :])}")

    def _go(self, word: str, targets: list[Target], feed: float, line: int) -> None:
        self._robot.external_axes(targets[-1].external, line)
        if word == "movej":
            self._robot.straight(targets[-1].pose, 0.0, True, line)
        elif word == "movel":
            self._robot.straight(targets[-1].pose, feed, False, line)
        else:
            self._robot.arc(targets[0].pose, targets[1].pose, feed, line)

    def _feed(self, speed: str, switches: Mapping[str, str]) -> float:
        """Return the feed in mm/min, 0 where the tip's speed is not limited."""
        if "t" in switches:
            raise RobotError("the time of the move is given instead of its speed (\\T); write a speed")
        if "corr" in switches:
            raise RobotError("the move is corrected while it runs (\\Corr); write the path out")
        mm_s = self._data.number(switches["v"]) if "v" in switches else self._data.speed_mm_s(speed)
        if mm_s is None:
            return 0.0
        if not 0.0 < mm_s < _LARGEST_SPEED:
            raise RobotError(f"the speed {mm_s:g} mm/s is not possible; correct it")
        return min(mm_s * self._override, self._fastest_mm_s) * 60.0

    # --- everything else ---

    def _instruction(self, text: str, line: int) -> None:
        match = _WORD.match(text)
        word = match[1].lower() if match else ""
        if word in _REFUSED:
            raise RobotError(f"{printable(text, 40)}: {_REFUSED[word]}")
        if word == "waittime":
            self._wait(match[2] if match else "", text, line)
        elif word in _STOPS:
            self.moves.event(EventKind.STOP, line, 0.0, text)
        elif override := _OVERRIDE.fullmatch(text):
            self._set_override(override[1])
            self.keep(text, line)
        elif word in _HARMLESS:
            self.keep(text, line)
        elif word == "if" and not _active(text):
            self.forget(text)
            self.unknown(text, line)
        else:
            self._call(match[1] if match else text, match[2] if match else "", line)

    def _call(self, name: str, arguments: str, line: int) -> None:
        routine = self._routines.get(name.lower())
        if routine is not None and (arguments.strip() or routine.takes_arguments):
            raise RobotError(f"the call of {printable(name, 40)} has arguments, which are not followed; write it out")
        if name.lower() in ("if", "for", "while", "test"):
            raise RobotError(f"{name} decides about motion; loops and conditions are not executed: write the moves out")
        self.call(name, line, None if routine is None else lambda: self.run_routine(name.lower()))

    def _wait(self, arguments: str, text: str, line: int) -> None:
        positions, _ = arguments_of(arguments)
        seconds = self._data.number(positions[0]) if len(positions) == 1 else -1.0
        if seconds < 0.0:
            raise RobotError("WaitTime needs a time in seconds; correct the line")
        self.moves.event(EventKind.DWELL, line, seconds, text)

    def _set_override(self, arguments: str) -> None:
        numbers = [self._data.number(each) for each in arguments_of(arguments)[0]]
        if len(numbers) != 2 or not (0.0 < numbers[0] <= 100.0 and numbers[1] > 0.0):
            raise RobotError("VelSet needs a percentage and the highest speed; correct the line")
        self._override, self._fastest_mm_s = numbers[0] / 100.0, numbers[1]
