"""Write a block of a G-code program again with another tip and tool axis: words, modes and numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sicp_formats.gcode.codes import HOMING, MOTION
from sicp_formats.gcode.dialect import Dialect
from sicp_formats.gcode.machine import END_CODES
from sicp_formats.gcode.orientation import Orientation
from sicp_formats.gcode.state import LineEdit, Piece, ReadBlock, State
from sicp_formats.gcode.style import Styles
from sicp_formats.gcode.words import Word
from sicp_formats.paths.arcs import Vector

__all__ = ["BlockWriter"]

_SAME_MM = 5e-5
_SAME_FEED = 5e-4
_COORDINATES = ("X", "Y", "Z")
_ORIENTATIONS = ("A3", "B3", "C3", "A", "B", "C")
_ARC_LETTERS = frozenset("IJKRP")
_AFTER_MOTION = frozenset({0.0, 1.0, *END_CODES})
_NO_COORDINATES = frozenset({4.0, 31.0, *HOMING})  # G31: the blank in Heidenhain's dialect


class BlockWriter:
    """Writes blocks one after the other, and keeps in mind what rules in the program as it is written.

    `position`, `mode` and `orientation` are what a control would have after the blocks so far: where the written
    numbers put the tool, rounding included, so that no error adds up.
    """

    def __init__(self, orientation: Orientation, dialect: Dialect) -> None:
        self.position: list[float | None] = [None, None, None]
        self.mode: float | None = None
        self.orientation = orientation
        self._dialect = dialect
        self._styles = Styles(dialect.decimal)
        self._blank = " "

    def note_style(self, text: str, words: Sequence[Word]) -> None:
        """Learn from a line how the program writes its words."""
        before: Word | None = None
        for word in words:
            if before is not None and not text[before.end : word.start].strip(" \t"):
                self._blank = text[before.end : word.start]
            if word.letter != "G" or float(word.number) in MOTION:
                self._styles.see(word, text)
            before = word

    def is_as_in(self, state: State) -> bool:
        """Say whether exactly the same rules as in a state of the program as it was read."""
        return (
            self.mode == state.mode
            and tuple(self.position) == state.position
            and self.orientation.axis == state.axis
            and self.orientation.angles == state.angles
        )

    def follow(self, after: State) -> None:
        """Take over all that rules after a block, where `is_as_in` was true before it and it stays as it is."""
        self.mode, self.position = after.mode, list(after.position)
        self.orientation.follow(after)

    def follow_text(self, block: ReadBlock) -> None:
        """Take over what a block without a move says: modes, and the coordinates and axis that it states."""
        self.note_style(block.text, block.words)
        for axis, letter in enumerate(_COORDINATES):
            if block.after.position[axis] is None or letter in self.coordinates(block):
                self.position[axis] = block.after.position[axis]
        if self.orientation.states_axis(block) and not _codes(block) & _NO_COORDINATES:
            self.orientation.follow(block.after)
        stated = _codes(block) & MOTION
        if stated:
            mode = stated.pop()
            self.mode = None if mode == 80.0 else mode

    def coordinates(self, block: ReadBlock) -> list[str]:
        """Return the letters of the coordinates that a block states, if they are some."""
        if _codes(block) & _NO_COORDINATES:
            return []
        return [letter for letter in _COORDINATES if block.word(letter)]

    def arc_may_stay(self, block: ReadBlock) -> bool:
        """Say whether the tool is where an arc began when it was read."""
        started = all(
            here is not None and there is not None and abs(here - there) < _SAME_MM
            for here, there in zip(self.position, block.before.position, strict=True)
        )
        return started and self.orientation.is_as_in(block.before)

    def keep_arc(self, block: ReadBlock) -> str:
        """Return an arc as it was, with its G word if the one that it relied on is gone."""
        self.note_style(block.text, block.words)
        edit = LineEdit(block.text)
        self._state_mode(edit, block, block.after.mode or 0.0)
        for axis, letter in enumerate(_COORDINATES):
            word, here = block.word(letter), self.position[axis]
            if word is not None:
                base = here or 0.0 if _is_incremental(word, block.after) else 0.0
                self.position[axis] = base + float(word.number) * block.after.mm
        if self.orientation.states_axis(block):
            self.orientation.follow(block.after)
        return edit.result()

    def write(self, block: ReadBlock, pieces: Sequence[Piece]) -> tuple[list[str], list[float]]:
        """Return the lines of a block, itself with the first piece and a line for each further one.

        With them comes for each piece the angle in degrees by which the tool axis is missed, where the program has no
        words for it.
        """
        self.note_style(block.text, block.words)
        first, arc = pieces[0], (block.after.mode or 0.0) >= 2.0
        edit = LineEdit(block.text)
        self._state_mode(edit, block, 1.0 if arc else block.after.mode or 0.0)
        added = self._tip(edit, block, first.tip)
        added += self.orientation.write(edit, block, first.axis, first.share, self._styles)
        missed = [self.orientation.misses_deg]
        for word in (word for word in block.words if arc and word.letter in _ARC_LETTERS):
            edit.remove(word)
        self._inverse_time(edit, block, first)
        if added:
            edit.insert(_behind_coordinates(block), "".join(self._blank + word for word in added))
        last = [word for word in block.words if _stops(word)] if len(pieces) > 1 else []
        for word in last:
            edit.remove(word)
        lines = [edit.result()]
        for piece in pieces[1:]:
            lines.append(self._added_line(block, piece))
            missed.append(self.orientation.misses_deg)
        lines[-1] += "".join(self._blank + block.text[word.start : word.end] for word in last)
        return [lines[0], *(line + _block_end(block.text) for line in lines[1:])], missed

    def restate(self, block: ReadBlock, tip: dict[str, float], axis: Vector | None) -> str:
        """Return a block without a move, its coordinates and axis being those that lead to the next move."""
        edit = LineEdit(block.text)
        for letter, target in tip.items():
            word = block.word(letter)
            if word is not None and not _is_incremental(word, block.after):
                self.position["XYZ".index(letter)] = self._coordinate(edit, word, block.after, target, 0.0)
        if axis is not None:
            for word_text in self.orientation.write(edit, block, axis, 1.0, self._styles):
                edit.insert(_behind_coordinates(block), self._blank + word_text)
        return edit.result()

    # --- words ---

    def _state_mode(self, edit: LineEdit, block: ReadBlock, mode: float) -> None:
        """See to it that a block moves as it should: by its own motion word, or by one that is put in."""
        stated = [word for word in block.words if word.letter == "G" and float(word.number) in MOTION]
        before, self.mode = self.mode, mode
        for word in stated:
            if float(word.number) != mode:
                edit.number(word, f"{'0' if word.number.startswith('0') else ''}{mode:g}")
        if not stated and before != mode:
            leading_zero = self._styles.like("G").token.startswith("0")
            first = next(word for word in block.words if word.letter not in "NO")
            edit.put_before(first, f"G{'0' if leading_zero else ''}{mode:g}", self._blank)

    def _tip(self, edit: LineEdit, block: ReadBlock, tip: Vector) -> list[str]:
        """Change the coordinates of a block, and return those that it lacks."""
        missing = []
        for axis, letter in enumerate(_COORDINATES):
            word, here = block.word(letter), self.position[axis]
            if word is not None:
                base = here or 0.0 if _is_incremental(word, block.after) else 0.0
                self.position[axis] = self._coordinate(edit, word, block.after, tip[axis], base)
            elif here is None or abs(here - tip[axis]) > 1.001 * _SAME_MM:
                missing.append(self._further(axis, block.after, tip[axis]))
        return missing

    def _coordinate(self, edit: LineEdit, word: Word, state: State, target: float, base: float) -> float:
        """Change one word unless it is right as it is; return where it puts the tool."""
        value = float(word.number) * state.mm
        if abs(base + value - target) < _SAME_MM:
            return base + value
        token = edit.text[word.number_start : word.number_end]
        text = self._dialect.written(token, (target - base) / state.mm, _decimals(state.mm))
        edit.number(word, text)
        return base + float(text.replace(",", ".")) * state.mm

    def _further(self, axis: int, state: State, target: float) -> str:
        """Return a coordinate word that a block has not, in the style of the last one."""
        letter, here = _COORDINATES[axis], self.position[axis]
        base = 0.0 if state.absolute or here is None else here
        style = self._styles.like(letter, *_COORDINATES)
        text = self._dialect.written(style.token, (target - base) / state.mm, _decimals(state.mm))
        self.position[axis] = base + float(text.replace(",", ".")) * state.mm
        return f"{letter}{style.between}{text}"

    def _inverse_time(self, edit: LineEdit, block: ReadBlock, piece: Piece) -> None:
        """Change F under G93, so that the speed along the path stays what it was."""
        word = block.word("F")
        if word is None or not piece.inverse_time or abs(piece.inverse_time / float(word.number) - 1.0) < _SAME_FEED:
            return
        token = edit.text[word.number_start : word.number_end]
        edit.number(word, self._dialect.written(token, piece.inverse_time, _digits(piece.inverse_time)))

    def _added_line(self, block: ReadBlock, piece: Piece) -> str:
        words = [self._further(axis, block.after, piece.tip[axis]) for axis in range(3)]
        words += self.orientation.write(None, block, piece.axis, piece.share, self._styles)
        if piece.inverse_time:
            style = self._styles.like("F")
            text = self._dialect.written(style.token, piece.inverse_time, _digits(piece.inverse_time))
            words.append(f"F{style.between}{text}")
        return f"{'/' if block.text.lstrip().startswith('/') else ''}{self._blank.join(words)}"


def _codes(block: ReadBlock) -> set[float]:
    return {float(word.number) for word in block.words if word.letter == "G"}


def _is_incremental(word: Word, state: State) -> bool:
    return word.manner == "IC" if word.manner else not state.absolute


def _stops(word: Word) -> bool:
    return word.letter == "M" and float(word.number) in _AFTER_MOTION


def _behind_coordinates(block: ReadBlock) -> int:
    for letters in (_COORDINATES, _ORIENTATIONS, ("G",)):
        found = [word.end for word in block.words if word.letter in letters]
        if found:
            return max(found)
    return max(word.end for word in block.words)


def _decimals(mm: float) -> int:
    """Return the decimals that state a length to 0.1 um."""
    return max(0, math.ceil(4.0 + math.log10(mm) - 1e-9))


def _digits(value: float) -> int:
    """Return the decimals that state a number to five digits."""
    return max(0, 4 - math.floor(math.log10(value)))


def _block_end(text: str) -> str:
    """Return the mark that ends a block, with the blanks before it, where the dialect writes one."""
    code = text.rstrip(" \t")
    return text[len(code[:-1].rstrip(" \t")) :] if code.endswith("*") else ""
