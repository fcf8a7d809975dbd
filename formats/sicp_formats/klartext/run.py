"""Execute Heidenhain conversational programs as far as they are plain: L and LN, labels, and what stands between."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sicp_cam.errors import printable
from sicp_cam.model import EventKind
from sicp_formats.gcode.axis import axis_from_angles
from sicp_formats.klartext.machine import Machine
from sicp_formats.klartext.text import BEGIN, END, Block, words_of
from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["KlartextRunner"]

_MOVE = re.compile(r"(LN?)(?=[ \t])(.*)", re.ASCII)
_CODES = re.compile(r"(?:M[0-9]+[ \t]*)+", re.ASCII)
_TOOL = re.compile(r"TOOL CALL(?:[ \t]+([0-9]+(?:\.[0-9]+)?|\"[^\"]*\"))?(.*)", re.ASCII)
_DWELL = re.compile(r"CYCL DEF 9\.1[ \t]+(?:DWELL[ \t]*|V\.ZEIT[ \t]*)?([0-9]+(?:[.,][0-9]+)?)", re.ASCII)
_CALLED = re.compile(r"CALL LBL[ \t]+([0-9]+|\"[^\"]*\")(.*)", re.ASCII)
_LABEL = re.compile(r"LBL[ \t]+([0-9]+|\"[^\"]*\")", re.ASCII)
_KEPT = re.compile(
    r"BLK FORM|TOOL DEF|CYCL DEF (?:9\.0|32\b|32\.)|FUNCTION (?:TCPM|RESET TCPM|MODE MILL)|PLANE RESET|\*",
    re.ASCII,
)
_FRAMES = re.compile(r"CYCL DEF (?:7|8|10|11|19|26|247)\b|PLANE |TRANS |FUNCTION MODE|FUNCTION PARAXCOMP", re.ASCII)
_ARCS = re.compile(r"(?:C|CC|CP|CR|CT|LP|CTP|RND|CHF|APPR|DEP|FL|FC|FCT|FLT|FPOL|SPL)\b", re.ASCII)
_CYCLES = re.compile(r"CYCL (?:DEF|CALL)|PATTERN DEF", re.ASCII)
_PARAMETERS = re.compile(r"Q[LRS]?[0-9]+|FN[ \t]*[0-9]+", re.ASCII)
_MACHINE = frozenset({91.0, 92.0})
_DEEPEST = 8


class KlartextRunner:
    """Runs the blocks of one program.

    Parameters
    ----------
    moves
        Where its moves go.
    blocks
        What it consists of.
    rotary
        How rotary angles turn the tool, see `axis_from_angles`; None where nobody has said.
    may_lack_feed
        True if the user has stated a feed for moves that have none.
    """

    def __init__(self, moves: MoveList, blocks: Sequence[Block], rotary: str | None, *, may_lack_feed: bool) -> None:
        self.name = ""
        self._moves = moves
        self._blocks = blocks
        self._rotary = rotary
        self._may_lack_feed = may_lack_feed
        self._machine = Machine(moves, may_lack_feed=may_lack_feed)
        self._position: list[float | None] = [None, None, None]
        self._axis: Vector = (0.0, 0.0, 1.0)
        self._angles = dict.fromkeys("ABC", 0.0)
        self._depth = 0

    def run(self) -> None:
        """Execute the program to its end."""
        ended = self._run(0)
        if not ended:
            self._moves.note_missing_end(self._blocks[-1].line)

    def _run(self, at: int, *, called: bool = False) -> bool:
        """Execute blocks from a place on; return True if the program ends, False at its last block or a LBL 0."""
        while at < len(self._blocks):
            block = self._blocks[at]
            at += 1
            if block.comment:
                self._moves.event(EventKind.COMMENT, block.line, 0.0, block.comment)
            if called and re.fullmatch(r"LBL[ \t]+0", block.code):
                return False
            if called and END.fullmatch(block.code):
                raise self._moves.error("a label without LBL 0; is the program complete?", block.line)
            if block.code and self._execute(block):
                self._note_rest(at)
                return True
        return False

    def _note_rest(self, at: int) -> None:
        labels = any(_LABEL.fullmatch(block.code) for block in self._blocks[at:])
        rest = [block.line for block in self._blocks[at:] if block.code and not END.fullmatch(block.code)]
        if rest and not labels:
            self._moves.note(Notice.TEXT_AFTER_END, rest[0], count=len(rest))

    def _execute(self, block: Block) -> bool:
        """Execute one block; return True if the program ends with it."""
        code, line = block.code, block.line
        if move := _MOVE.fullmatch(code):
            return self._move(move[1], move[2], line)
        if _CODES.fullmatch(code):
            return self._machine.codes([float(number) for number in re.findall(r"[0-9]+", code)], line)
        if tool := _TOOL.fullmatch(code):
            self._machine.tool(tool[1], tool[2], line)
        elif begin := BEGIN.fullmatch(code):
            self.name = self.name or begin[1]
            if begin[2]:
                self._moves.state_unit("mm" if begin[2] == "MM" else "inch", line)
        elif END.fullmatch(code):
            return True
        elif dwell := _DWELL.match(code):
            self._moves.event(EventKind.DWELL, line, float(dwell[1].replace(",", ".")), code)
        elif code.split()[0] == "STOP":
            self._moves.event(EventKind.STOP, line, 0.0, code)
        elif call := _CALLED.fullmatch(code):
            return self._call(call[1], call[2].strip(), line)
        elif not _LABEL.fullmatch(code):
            self._other(code, line)
        return False

    def _other(self, code: str, line: int) -> None:
        if _KEPT.match(code):
            if code.startswith("FUNCTION"):
                self._machine.tip_control = "RESET" not in code
            self._moves.event(EventKind.OTHER, line, 0.0, code)
            return
        told = printable(code, 40)
        for pattern, why in (
            (_FRAMES, "it changes what the coordinates mean; post the path in the frame of the part"),
            (_ARCS, "arcs, polar moves and contours are not read; post the path as L blocks"),
            (_CYCLES, "cycles are no contour; take them out"),
            (_PARAMETERS, "parameters are not evaluated; post the path with plain numbers"),
        ):
            if pattern.match(code):
                raise self._moves.error(f"'{told}': {why}", line)
        raise self._moves.error(f"'{told}' is not known here; take it out if it does not move the tool", line)

    def _call(self, label: str, repeats: str, line: int) -> bool:
        if repeats or self._depth >= _DEEPEST:
            raise self._moves.error("CALL LBL with REP, or nested too deep, is not followed; write the moves out", line)
        wanted = f"LBL {label}"
        start = next((at for at, each in enumerate(self._blocks) if " ".join(each.code.split()) == wanted), None)
        if start is None:
            raise self._moves.error(f"LBL {printable(label, 40)} is nowhere in the program", line)
        self._depth += 1
        ended = self._run(start + 1, called=True)
        self._depth -= 1
        return ended

    # --- motion ---

    def _move(self, word: str, text: str, line: int) -> bool:
        numbers, plain, rest = words_of(text)
        if rest:
            raise self._moves.error(f"'{printable(rest, 40)}' is not understood in a move; correct the line", line)
        for compensation in ("RL", "RR", "R+", "R-"):
            if compensation in plain:
                what = f"{compensation}: tool radius compensation; post the path of the tool centre with R0"
                raise self._moves.error(what, line)
        codes = [number for letter, number in numbers if letter == "M"]
        words = {letter: number for letter, number in numbers if letter != "M"}
        if len(words) + len(codes) != len(numbers):
            raise self._moves.error("a word stands twice in the move; take one out", line)
        rapid = "FMAX" in plain
        if "F" in words:
            self._machine.take_feed(words["F"], line)
        before = [code for code in codes if code in (3.0, 4.0, 8.0, 13.0, 14.0, 126.0, 127.0, 128.0)]
        self._machine.codes(before, line)
        if _MACHINE & set(codes):
            self._leave(words, line)
        elif words.keys() - {"F"}:
            self._go(word, words, rapid, line)
        return self._machine.codes([code for code in codes if code not in before and code not in _MACHINE], line)

    def _leave(self, words: dict[str, float], line: int) -> None:
        """Forget the axes that go to a machine position."""
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                self._position[axis] = None
        self._moves.note(Notice.HOME_LEFT_OUT if len(self._moves) else Notice.POSITION_UNKNOWN, line)
        self._moves.event(EventKind.OTHER, line, 0.0, " ".join(f"{name}{value:g}" for name, value in words.items()))

    def _go(self, word: str, words: dict[str, float], rapid: bool, line: int) -> None:
        self._turn(word, words, line)
        for axis, letter in enumerate("XYZ"):
            here = self._position[axis]
            if letter in words:
                self._position[axis] = words[letter] * self._moves.mm
            elif f"I{letter}" in words:
                if here is None:
                    raise self._moves.error(f"I{letter} before the position is known; post absolute coordinates", line)
                self._position[axis] = here + words[f"I{letter}"] * self._moves.mm
        if any(letter in words for letter in ("U", "V", "W", "IU", "IV", "IW", "DL", "DR", "DR2", "S")):
            raise self._moves.error("further axes and tool deltas in a move are not read; post X Y Z alone", line)
        x, y, z = self._position
        if x is None or y is None or z is None:
            if not rapid:
                raise self._moves.error("a cutting move before X, Y and Z are known; post the whole position", line)
            self._moves.note(Notice.POSITION_UNKNOWN, line)
            return
        feed = 0.0 if rapid else self._machine.feed_mm_min
        if not rapid and feed == 0.0 and not self._may_lack_feed:
            raise self._moves.error(
                "a cutting move without a feed that is known; state F, or a feed with --set path.feed_mm_min=...", line
            )
        self._moves.move((x, y, z), self._axis, feed, rapid, line)

    def _turn(self, word: str, words: dict[str, float], line: int) -> None:
        vector = [words.get(letter) for letter in ("TX", "TY", "TZ")]
        if word == "LN" and None in vector:
            raise self._moves.error("LN without TX, TY and TZ states no tool axis; post them in every block", line)
        if None not in vector:
            i, j, k = (float(value or 0.0) for value in vector)
            if (i, j, k) == (0.0, 0.0, 0.0):
                raise self._moves.error("the tool axis TX TY TZ is (0, 0, 0); correct the line", line)
            self._axis = (i, j, k)
        turned = [letter for letter in "ABC" if letter in words or f"I{letter}" in words]
        for letter in turned:
            self._angles[letter] = words.get(letter, self._angles[letter] + words.get(f"I{letter}", 0.0))
            if self._angles[letter] and (self._rotary is None or letter not in self._rotary):
                raise self._moves.error(
                    f"{letter}{self._angles[letter]:+g}: what the rotary axes do to the tool is not known; say so with"
                    " --set path.rotary=AC (head-head, or BC, AB, BA), or post LN blocks with TX TY TZ",
                    line,
                )
        if turned and self._rotary is not None:
            self._axis = axis_from_angles(self._rotary, self._angles)
            if any(self._angles.values()) and not self._machine.tip_control:
                self._moves.note(Notice.NO_TIP_CONTROL, line)
