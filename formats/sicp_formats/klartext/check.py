"""Check the text of a Heidenhain conversational program: its frame, block numbers, tool tip control, LN, feeds, tool.

Facts: HEIDENHAIN TNC 640 and iTNC 530, User's Manual for Conversational Programming.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.klartext.text import BEGIN, END, Block, read_blocks, words_of
from sicp_formats.paths.defects import Check, Defects, check_characters
from sicp_formats.paths.text import program_lines
from sicp_formats.source import read_bytes

__all__ = ["check"]

_MOVE = re.compile(r"(LN?)(?=[ \t])(.*)", re.ASCII)
_CODE = re.compile(r"(?<![A-Z0-9.])M[ \t]*([0-9]+)", re.ASCII)
_ON = re.compile(r"FUNCTION TCPM\b", re.ASCII)
_OFF = re.compile(r"FUNCTION RESET TCPM\b", re.ASCII)
_UNIT = 1e-3


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS, rotary_step_deg: float = 180.0) -> tuple[Finding, ...]:
    """Check a conversational program: BEGIN and END PGM, block numbers, M128, LN vectors, F, TOOL CALL, M30.

    Parameters
    ----------
    path
        The .h file.
    limits
        Caps on it.
    rotary_step_deg
        Turn of a rotary axis from block to block beyond which it is told.

    Raises
    ------
    FormatError
        If the file is no text, or does not begin with BEGIN PGM.
    """
    lines = program_lines(path, read_bytes(path, limits), limits)
    blocks = read_blocks(path, lines)
    defects = Defects(path)
    check_characters(defects, lines)
    _check_frame(defects, blocks)
    _check_numbers(defects, blocks)
    program = _Program(defects, rotary_step_deg)
    for block in blocks:
        program.take(block.code, block.line)
    program.finish(blocks[-1].line)
    return defects.findings()


def _check_frame(defects: Defects, blocks: list[Block]) -> None:
    """See that END PGM closes what BEGIN PGM opens."""
    begin = BEGIN.fullmatch(next(block.code for block in blocks if block.code))
    ends = [(found, block.line) for block in blocks if (found := END.fullmatch(block.code))]
    if begin is None:
        return
    if not begin[2]:
        defects.warn(Check.UNITS, "BEGIN PGM states no unit; MM or INCH", blocks[0].line)
    if not ends:
        defects.fail(Check.FORM, "no END PGM; is the file complete?", blocks[-1].line)
        return
    end, line = ends[-1]
    if end[1] != begin[1]:
        defects.fail(Check.NAMES, f"END PGM names {end[1]}, BEGIN PGM {begin[1]}", line)
    if end[2] != begin[2]:
        defects.fail(Check.UNITS, f"END PGM states {end[2] or 'no unit'}, BEGIN PGM {begin[2] or 'none'}", line)


def _check_numbers(defects: Defects, blocks: list[Block]) -> None:
    """See that the blocks are numbered one after the other, or not at all."""
    numbered = [block for block in blocks if block.number >= 0]
    if not numbered:
        return
    for wanted, block in enumerate(blocks, blocks[0].number):
        if block.number != wanted:
            told = f"{block.number}" if block.number >= 0 else "missing"
            defects.warn(Check.NAMES, f"the block number is {told}, not {wanted}", block.line)
            return


class _Program:
    """What rules after the blocks so far, as far as it decides what is wrong with the next one."""

    def __init__(self, defects: Defects, rotary_step_deg: float) -> None:
        self._defects = defects
        self._largest_step = rotary_step_deg
        self._feed = self._tool = self._tip_control = self._was_on = self._ended = False
        self._turned_before = 0
        self._cut_before_tool = 0
        self._angles: dict[str, float] = {}

    def take(self, code: str, line: int) -> None:
        """Check one block."""
        move = _MOVE.fullmatch(code)
        codes = [int(number) for number in _CODE.findall(move[2] if move else code)]
        if 128 in codes or _ON.match(code):
            self._switch(True)
        if code.startswith("TOOL CALL") and not re.fullmatch(r"TOOL CALL[ \t]+S.*", code):
            self._take_tool(line)
        if move is not None and not {91, 92} & set(codes):
            self._move(move[1], move[2], line)
        if 129 in codes or _OFF.match(code):
            self._switch(False)
        if {2, 30} & set(codes):
            self._ended = True
            if self._tip_control:
                what = "the program ends while M128 or TCPM is on; switch it off before"
                self._defects.warn(Check.WORDS, what, line)

    def finish(self, last: int) -> None:
        """Judge what only the whole program shows."""
        if not self._ended:
            self._defects.warn(Check.FORM, "the program has no end (M2 or M30)", last)

    def _switch(self, on: bool) -> None:
        if on and not self._was_on and self._turned_before:
            what = "the tool turns in a cut before M128 or TCPM is switched on"
            self._defects.fail(Check.WORDS, what, self._turned_before)
        self._tip_control = on
        self._was_on = self._was_on or on

    def _take_tool(self, line: int) -> None:
        if self._tip_control:
            what = "the tool is changed while M128 or TCPM is on; switch it off before"
            self._defects.warn(Check.TOOL, what, line)
        if self._cut_before_tool and not self._tool:
            self._defects.warn(Check.TOOL, "cuts before the first TOOL CALL", self._cut_before_tool)
        self._tool = True

    def _move(self, word: str, text: str, line: int) -> None:
        numbers, plain, _ = words_of(text)
        words = dict(numbers)
        cuts = "FMAX" not in plain and any(letter in words for letter in ("X", "Y", "Z", "IX", "IY", "IZ"))
        if "F" in words:
            self._feed = True
            if not words["F"] > 0.0:
                self._defects.fail(Check.SPEED, f"F{words['F']:g}: a feed must be more than 0", line)
        if "FAUTO" in plain:
            self._feed = True
        if cuts and not self._feed:
            self._feed = True
            self._defects.fail(Check.SPEED, "the first cut comes before a feed (F) is stated", line)
        if cuts and not self._tool:
            self._cut_before_tool = self._cut_before_tool or line
        if word == "LN":
            self._vectors(words, line)
        turned = self._turn(words, line)
        if cuts and (turned or word == "LN") and not self._tip_control:
            if self._was_on or word == "LN":
                self._defects.fail(Check.WORDS, "the tool turns in a cut while M128 or TCPM is off", line)
            self._turned_before = self._turned_before or line

    def _vectors(self, words: dict[str, float], line: int) -> None:
        for name in "NT":
            vector = [words.get(f"{name}{axis}") for axis in "XYZ"]
            if None in vector:
                what = f"LN without {name}X {name}Y {name}Z; all three stand in every block"
                self._defects.fail(Check.ORIENTATION, what, line)
                continue
            length = math.hypot(*(value or 0.0 for value in vector))
            if abs(length - 1.0) > _UNIT:
                what = f"{name}X {name}Y {name}Z have the length {length:.6g}, not 1"
                self._defects.fail(Check.ORIENTATION, what, line)

    def _turn(self, words: dict[str, float], line: int) -> bool:
        """Follow the rotary words of a block; return whether the tool turns."""
        turned = False
        for letter in "ABC":
            before = self._angles.get(letter)
            if letter in words:
                self._angles[letter] = words[letter]
            elif f"I{letter}" in words:
                self._angles[letter] = (before or 0.0) + words[f"I{letter}"]
            step = 0.0 if before is None else abs(self._angles[letter] - before)
            turned = turned or step > 0.0
            if step > self._largest_step:
                ends = f"from {before:.6g} to {self._angles[letter]:.6g}"
                what = f"{letter} turns by {step:.6g} degrees in one block, {ends}"
                self._defects.warn(Check.ORIENTATION, what, line)
        return turned
