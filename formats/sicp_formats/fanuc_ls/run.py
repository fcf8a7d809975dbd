"""Execute Fanuc programs as far as they are plain: J, L and C to taught positions, outputs, waits, calls."""

from __future__ import annotations

import re
from collections.abc import Callable

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import EventKind, FloatArray
from sicp_formats.fanuc_ls.listing import Listing, Position
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList
from sicp_formats.robot.motion import NUMBER, RobotMoves, number_of, pose_zyx
from sicp_formats.robot.program import Language, RobotError, Runner, Statement

__all__ = ["LsRunner"]

_MOVE = re.compile(r"([JLCA])[ \t]+(PR?\[.*)", re.ASCII)
_TARGET = re.compile(r"P\[[ \t]*([0-9]{1,9})[ \t]*(?::[^\]]*)?\][ \t]*", re.ASCII)
_REGISTER = r"R\[[ \t]*([0-9]{1,5})[ \t]*(?::[^\]]*)?\]"
_SPEED = re.compile(
    rf"(?:({NUMBER})|{_REGISTER})?[ \t]*(%|mm/sec|cm/min|inch/min|deg/sec|m?sec|WELD_SPEED|max_speed)[ \t]*", re.ASCII
)
_TERMINATION = re.compile(rf"(?:FINE|(?:CNT|CD)[ \t]*(?:[0-9]{{1,4}}|{_REGISTER}))(?=[ \t]|$)[ \t]*", re.ASCII)
_SHIFTED = re.compile(r"\b(?:(?:Tool_|V)?Offset|INC(?:REMENTAL)?|Skip|RTCP)\b", re.ASCII | re.IGNORECASE)
_PLAIN_OPTION = re.compile(
    rf"(?:ACC[ \t]*(?:[0-9]+|{_REGISTER})|PTH|COORD|Wjnt|MROT|BREAK|I?EV[ \t]*[0-9]+%?"
    r"|(?:PSPD|AP_LD|RT_LD|CR)[ \t]*[0-9.]+)(?:[ \t]+|$)",
    re.ASCII | re.IGNORECASE,
)
_CHOSEN = re.compile(r"(UFRAME|UTOOL)_NUM[ \t]*=[ \t]*(.*)", re.ASCII)
_FRAME_SET = re.compile(r"(UFRAME|UTOOL)\[[ \t]*([^\]]*)\][ \t]*=.*", re.ASCII)
_REGISTER_SET = re.compile(rf"{_REGISTER}[ \t]*=[ \t]*(.*)", re.ASCII)
_WAIT = re.compile(rf"WAIT[ \t]*({NUMBER})[ \t]*\([ \t]*sec[ \t]*\)", re.ASCII | re.IGNORECASE)
_CALL = re.compile(r"CALL[ \t]+([\w-]+)[ \t]*(\(.*\))?", re.ASCII)
_CONDITION = re.compile(r"(?:IF\b.*,|WHEN\b.*,)[ \t]*(.*)", re.ASCII)
_LEAVES = re.compile(r"(?:JMP|SELECT|=|ELSE[ \t]*,|END\b|ABORT\b)", re.ASCII)
_MOVING_SENSOR = re.compile(r"(?:Track|TRACK|Soft[ \t]*Float|SOFTFLOAT|LINE\[|DEFENC|SETTRIG|RCV|PRG_SHIFT)", re.ASCII)
_HARMLESS = re.compile(
    r"(?:(?:[DRSAGUW][OI]|PR|SR|R|F|M|AR|TIMER|UFRAME|UTOOL|PL)\[[^\]]*\][^=]*=|\$[\w.\[\]]+[ \t]*=|LBL\[|WAIT\b"
    r"|OVERRIDE\b|PAYLOAD\b|(?:JOINT|LINEAR)_MAX_SPEED|MESSAGE\[|UALM\[|PROMPT\w*\[|RSR\[|MONITOR\b|RUN\b|(?:UN)?LOCK\b"
    r"|(?:TOOL_)?OFFSET CONDITION|SKIP CONDITION|COL (?:DETECT|GUARD)|DIAG_|(?:Arc|Weld) (?:Start|End)|Weave\b"
    r"|STOP_TRACKING|RESUME_PROG|ERROR_PROG|MAINT_PROG|CLEAR_RESUME_PROG|STRLEN|ELSE$|ENDIF|VISION\b|TC_ONLINE)",
    re.ASCII,
)
_LANGUAGE_OPENS = re.compile(r"(?:IF\b.*\bTHEN$|FOR\b)", re.ASCII)
_LANGUAGE_CLOSES = re.compile(r"(?:ENDIF|ENDFOR)\b", re.ASCII)
_MM_MIN = {"mm/sec": 60.0, "cm/min": 10.0, "inch/min": 25.4}
_DEEPEST_FILES = 1000


def _active(text: str) -> bool:
    """Say whether a statement may move the robot or leave the way of the program."""
    if text.startswith(("!", "--", "//")):
        return False
    if condition := _CONDITION.fullmatch(text):
        return _active(condition[1].strip())
    if _LANGUAGE_OPENS.match(text):
        return False
    known = _HARMLESS.match(text) or _LANGUAGE_CLOSES.match(text) or _CHOSEN.match(text) or text == "PAUSE"
    return not known or bool(_LEAVES.match(text))


class LsRunner(Runner):
    """Runs a listing, and those beside it that it calls.

    Parameters
    ----------
    first
        The program to begin with.
    beside
        Returns the listing of a program by its name, None if there is none.
    moves, robot
        Where its moves go.
    calls
        Names of programs and macros that move nothing.
    """

    def __init__(
        self,
        first: Listing,
        beside: Callable[[str], Listing | None],
        moves: MoveList,
        robot: RobotMoves,
        calls: frozenset[str],
    ) -> None:
        super().__init__(moves, Language(_LANGUAGE_OPENS, _LANGUAGE_CLOSES, _active), calls)
        self._listings = {first.name.upper(): first}
        self._beside = beside
        self._robot = robot
        self._running_listing = first
        self._registers: dict[int, float] = {}
        self._chosen: dict[str, int] = {}

    @property
    def files(self) -> int:
        """Return from how many files statements were read."""
        return len(self._listings)

    def run_listing(self, listing: Listing) -> None:
        """Execute a listing up to its end."""
        before, self._running_listing = self._running_listing, listing
        self.run(listing.file, self._up_to_end(listing))
        self._running_listing = before

    def execute(self, text: str, line: int) -> None:
        """Execute one statement."""
        if text.startswith(("!", "--")):
            words = text[1:] if text[0] == "!" else text.partition(":")[2]
            self.moves.event(EventKind.COMMENT, line, 0.0, words.strip())
        elif text.startswith("//"):
            self.keep(text, line)
        elif move := _MOVE.fullmatch(text):
            self._move(move[1], move[2], line)
        elif chosen := _CHOSEN.fullmatch(text):
            self._choose(chosen[1], chosen[2], text, line)
        elif wait := _WAIT.fullmatch(text):
            self.moves.event(EventKind.DWELL, line, float(wait[1]), text)
        elif text in ("PAUSE", "ABORT"):
            self.moves.event(EventKind.STOP, line, 0.0, text)
        elif call := _CALL.fullmatch(text):
            self._call(call[1], bool(call[2]), line)
        elif condition := _CONDITION.fullmatch(text):
            self._condition(text, condition[1].strip(), line)
        else:
            self._setting(text, line)

    def forget(self, text: str) -> None:
        """Take what a statement sets as not known."""
        if _CHOSEN.match(text) or _FRAME_SET.match(text):
            raise RobotError(f"'{printable(text, 40)}' changes a frame under a condition; write the program out")
        if assigned := _REGISTER_SET.match(text):
            self._registers.pop(int(assigned[1]), None)

    # --- motion ---

    def _move(self, word: str, rest: str, line: int) -> None:
        positions = []
        while target := _TARGET.match(rest):
            positions.append(self._position(int(target[1])))
            rest = rest[target.end() :]
        if not positions or len(positions) != (2 if word == "C" else 1) or rest.startswith(("P[", "PR[")):
            raise RobotError(f"{word} needs P[...] with plain numbers: registers and other points are not followed")
        speed = _SPEED.match(rest)
        if speed is None:
            raise RobotError(f"'{printable(rest, 40)}' states no speed that is read; write it in mm/sec")
        rest = rest[speed.end() :]
        end = _TERMINATION.match(rest)
        if end is None:
            raise RobotError(f"{word} without FINE or CNT; correct the line")
        options = rest[end.end() :].strip()
        if shifted := _SHIFTED.search(options):
            raise RobotError(f"the move is shifted or cut short ({shifted[0]}); write the points out")
        feed = 0.0 if word == "J" else self._feed(speed)
        self._frames(positions)
        self._go(word, positions, feed, line)
        while plain := _PLAIN_OPTION.match(options):
            options = options[plain.end() :]
        if options:
            self.keep(options, line)

    def _go(self, word: str, positions: list[Position], feed: float, line: int) -> None:
        if any(position.pose is None for position in positions):
            if word != "J":
                raise RobotError(f"{word} to joint angles; only J takes them")
            self._robot.joints(line)
            return
        poses = [_pose(position) for position in positions]
        if positions[-1].external:
            self._robot.external_axes(positions[-1].external, line)
        if word == "J":
            self._robot.straight(poses[0], 0.0, True, line)
        elif word == "L":
            self._robot.straight(poses[0], feed, False, line)
        elif word == "C":
            self._robot.arc(poses[0], poses[1], feed, line)
        else:
            raise RobotError("A motions are not read; write the arc as C")

    def _position(self, number: int) -> Position:
        position = self._running_listing.positions.get(number)
        if position is None:
            raise RobotError(f"P[{number}] is not in /POS; is the file complete?")
        return position

    def _frames(self, positions: list[Position]) -> None:
        """Take the frames of positions; where others are chosen, the robot would stop with an alarm."""
        for position in positions:
            for name, stated in (("UFRAME", position.user_frame), ("UTOOL", position.tool)):
                chosen = self._chosen.setdefault(name, 0 if stated is None else stated)
                if stated not in (None, chosen):
                    raise RobotError(f"{name}_NUM is {chosen}, the position was taught in {stated}; choose that before")
        line = positions[-1].line
        self._robot.in_frame(f"UFRAME[{self._chosen['UFRAME']}]", line)
        self._robot.with_tool(f"UTOOL[{self._chosen['UTOOL']}]", line)

    def _feed(self, speed: re.Match[str]) -> float:
        """Return the feed in mm/min, 0 where the program leaves it to a schedule or to the robot."""
        number, register, unit = speed.groups()
        if unit in ("WELD_SPEED", "max_speed"):
            return 0.0
        if unit not in _MM_MIN:
            raise RobotError(f"the speed is given in {unit}, not along the path; write it in mm/sec")
        value = float(number) if number else self._registers.get(int(register or 0))
        if value is None:
            raise RobotError(f"the speed is computed (R[{register}]); write it as a number")
        if not 0.0 < value < 1e9:
            raise RobotError(f"the speed {value:g} {unit} is not possible; correct it")
        return value * _MM_MIN[unit]

    # --- everything else ---

    def _choose(self, name: str, value: str, text: str, line: int) -> None:
        number = number_of(value)
        if number is None or not number.is_integer():
            raise RobotError(f"'{printable(text, 40)}' is computed; write the number")
        self._chosen[name] = int(number)
        if name == "UTOOL":
            self._robot.with_tool(f"UTOOL[{int(number)}]", line)
        elif len(self.moves):
            self._robot.in_frame(f"UFRAME[{int(number)}]", line)

    def _setting(self, text: str, line: int) -> None:
        if (changed := _FRAME_SET.fullmatch(text)) and len(self.moves) and changed[1] == "UFRAME":
            raise RobotError(f"'{printable(text, 40)}' moves a frame within the path; split it there")
        if assigned := _REGISTER_SET.fullmatch(text):
            value = number_of(assigned[2].strip().removeprefix("(").removesuffix(")"))
            self._registers.pop(int(assigned[1]), None)
            if value is not None:
                self._registers[int(assigned[1])] = value
        if _MOVING_SENSOR.match(text):
            raise RobotError(
                f"'{printable(text, 40)}': the robot would leave the programmed points; write the path out"
            )
        if _LEAVES.match(text):
            raise RobotError(f"'{printable(text, 40)}' leaves the way of the program; write the moves out")
        if _HARMLESS.match(text):
            self.keep(text, line)
        else:
            self.call(text, line, None)  # a macro looks like any words, and may move the robot

    def _condition(self, text: str, action: str, line: int) -> None:
        if self._is_active(action):
            raise RobotError(
                f"'{printable(text, 40)}' decides about motion; conditions are not executed: write the moves out"
            )
        self.moves.note(Notice.CONDITION_LEFT_OUT, line, printable(text, 40))
        self.forget(action)
        self.keep(text, line)

    def _call(self, name: str, with_arguments: bool, line: int) -> None:
        known = name.lower() in self._moving_nothing
        found = None if known else self._listings.get(name.upper())
        if found is None and not known and (found := self._beside(name)) is not None:
            if len(self._listings) >= _DEEPEST_FILES:
                raise RobotError(f"more than {_DEEPEST_FILES} programs are called")
            self._listings[name.upper()] = found
        if found is None:
            self.call(name, line, None)
            return
        if with_arguments:
            raise RobotError(f"the call of {printable(name, 40)} has arguments, which are not followed; write it out")
        listing = found
        self.call(name, line, lambda: self.run_listing(listing))

    def _up_to_end(self, listing: Listing) -> list[Statement]:
        """Return the statements up to an END or ABORT outside of all blocks."""
        depth = 0
        for at, each in enumerate(listing.statements):
            depth += bool(_LANGUAGE_OPENS.match(each.text)) - bool(_LANGUAGE_CLOSES.match(each.text))
            if depth == 0 and each.text in ("END", "ABORT"):
                left = len(listing.statements) - at - 1
                if left:
                    self.moves.note(Notice.TEXT_AFTER_END, each.line, count=left)
                return listing.statements[:at]
        if depth:
            raise FormatError(listing.file, "IF or FOR without its end; is the file complete?", line=listing.lines)
        return listing.statements


def _pose(position: Position) -> FloatArray:
    x, y, z, w, p, r = position.pose or (0.0,) * 6
    return pose_zyx(x, y, z, r, p, w)
