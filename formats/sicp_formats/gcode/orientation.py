"""Write the tool axis of a G-code program again: vector components or rotary angles, as the program states them."""

from __future__ import annotations

import math

from sicp_formats.gcode.axis import angles_near, axis_from_angles
from sicp_formats.gcode.dialect import Dialect
from sicp_formats.gcode.state import LineEdit, ReadBlock, State
from sicp_formats.gcode.style import Style, Styles
from sicp_formats.gcode.words import Word
from sicp_formats.paths.arcs import Vector, minus, norm, unit

__all__ = ["FURTHER_DEG", "Orientation"]

_SAME_VECTOR = 5e-8
_SAME_DEG = 5e-6
_VECTOR_DECIMALS = 7
_ANGLE_DECIMALS = 5
FURTHER_DEG = 10.0
_SIEMENS = ("A3", "B3", "C3")
_FANUC = ("I", "J", "K")


class Orientation:
    """The tool axis that rules in the program as it is written, and how the program states another one.

    Parameters
    ----------
    rotary
        The two rotary axes, see `gcode_axis.axis_from_angles`; None if angles say nothing.
    stated
        Letters of all words in the program.
    dialect
        How the program writes numbers.

    `axis` has length 1; `is_stated` says that the program states one somewhere. `misses_deg` is by how much the axis
    last asked for differs from it because the program has no words for it at that place, `further_deg` by how much
    further than before a rotary axis was last turned.
    """

    def __init__(self, rotary: str | None, stated: frozenset[str], dialect: Dialect) -> None:
        self.axis: Vector = (0.0, 0.0, 1.0)
        self.angles = dict.fromkeys("ABC", 0.0)
        self.misses_deg = 0.0
        self.further_deg = 0.0
        self.states_vectors = not stated.isdisjoint(_SIEMENS)
        self._rotary = rotary if rotary is not None and not stated.isdisjoint(rotary) else None
        self.is_stated = self.states_vectors or self._rotary is not None
        self._dialect = dialect

    def follow(self, after: State) -> None:
        """Take over the axis that rules after a block that stays as it is and states one."""
        self.axis, self.angles = after.axis, dict(after.angles)

    def is_as_in(self, state: State) -> bool:
        """Say whether the same axis rules as in a state of the program as it was read."""
        angles = all(abs(self.angles[letter] - angle) < _SAME_DEG for letter, angle in state.angles.items())
        return angles and _same(self.axis, state.axis)

    def states_axis(self, block: ReadBlock) -> bool:
        """Say whether a block has words for the tool axis."""
        return bool(self._letters_in(block))

    def write(self, edit: LineEdit | None, block: ReadBlock, axis: Vector, share: float, styles: Styles) -> list[str]:
        """Change the orientation words of a block, and return those that it lacks.

        Parameters
        ----------
        edit
            The line; None for a line that is added, of which all words are returned.
        block
            The block as it was read.
        axis
            Unit vector that is to rule after it.
        share
            How far the move is along that of the block, 1 for its end: rotary angles stay near those between.
        styles
            How words were written last.
        """
        self.misses_deg = self.further_deg = 0.0
        letters = self._letters_in(block) if edit is not None else ()
        if not letters:
            if _same(axis, self.axis):
                return []
            letters = self._letters_for(block.after)
        if not letters:
            self.misses_deg = math.degrees(2.0 * math.asin(min(1.0, norm(minus(axis, self.axis)) / 2.0)))
            return []
        if letters == self._angle_letters():
            return self._write_angles(edit, block, axis, share, styles)
        return self._write_vector(edit, block, letters, axis, styles)

    def _angle_letters(self) -> tuple[str, ...]:
        return tuple(self._rotary or "")

    def _letters_in(self, block: ReadBlock) -> tuple[str, ...]:
        present = {word.letter for word in block.words}
        for letters in (self._angle_letters(), _SIEMENS):
            if not present.isdisjoint(letters):
                return letters
        in_mode = block.after.vector_words and (block.after.mode or 0.0) < 2.0
        return _FANUC if in_mode and not present.isdisjoint(_FANUC) else ()

    def _letters_for(self, state: State) -> tuple[str, ...]:
        """Return the words in which a block that states no axis may state one."""
        if state.vector_words:
            return _FANUC
        if self.states_vectors:
            return _SIEMENS if state.tip_control else ()
        return self._angle_letters() if state.tip_control else ()

    def _write_vector(
        self,
        edit: LineEdit | None,
        block: ReadBlock,
        letters: tuple[str, ...],
        axis: Vector,
        styles: Styles,
    ) -> list[str]:
        self.is_stated = True
        words = [block.word(letter) if edit is not None else None for letter in letters]
        stated = _stated(words)
        if stated is None and any(words) and _same(axis, self.axis):
            return []  # (0, 0, 0) keeps the axis that rules
        if stated is not None and _same(axis, stated):
            self.axis = stated
            return []
        written, missing = [], []
        for letter, word, value in zip(letters, words, axis, strict=True):
            if edit is not None and word is not None:
                text = self._changed(edit, word, value, _SAME_VECTOR, _VECTOR_DECIMALS)
            elif any(words) and abs(value) < _SAME_VECTOR:
                text = "0"
            else:
                style = _style(styles, letter, letters)
                text = self._dialect.written(style.token, value, _VECTOR_DECIMALS)
                missing.append(f"{letter}{style.between}{text}")
            written.append(float(text.replace(",", ".")))
        self.axis = unit((written[0], written[1], written[2])) or axis
        return missing

    def _write_angles(
        self, edit: LineEdit | None, block: ReadBlock, axis: Vector, share: float, styles: Styles
    ) -> list[str]:
        rotary = self._rotary or ""
        before, after = block.before.angles, block.after.angles
        near = {letter: before[letter] + share * (after[letter] - before[letter]) for letter in rotary}
        if share == 1.0:
            near = {letter: after[letter] for letter in rotary}
        target = near if _same(axis_from_angles(rotary, near), axis) else angles_near(rotary, axis, near)
        self.further_deg = max(
            abs(target[letter] - self.angles[letter]) - abs(near[letter] - before[letter]) for letter in rotary
        )
        missing = []
        for letter in rotary:
            word = block.word(letter) if edit is not None else None
            base = self.angles[letter] if _turns_by(word, block.after) else 0.0
            if edit is not None and word is not None:
                text = self._changed(edit, word, target[letter] - base, _SAME_DEG, _ANGLE_DECIMALS)
            elif abs(target[letter] - self.angles[letter]) < _SAME_DEG:
                continue
            else:
                style = _style(styles, letter, tuple(rotary))
                text = self._dialect.written(style.token, target[letter] - base, _ANGLE_DECIMALS)
                missing.append(f"{letter}{style.between}{text}")
            self.angles[letter] = base + float(text.replace(",", "."))
        self.axis = axis_from_angles(rotary, self.angles)
        return missing

    def _changed(self, edit: LineEdit, word: Word, value: float, same: float, decimals: int) -> str:
        """Change a number unless it is right as it is; return what stands there."""
        if abs(float(word.number) - value) < same:
            return word.number
        text = self._dialect.written(edit.text[word.number_start : word.number_end], value, decimals)
        edit.number(word, text)
        return text


def _stated(words: list[Word | None]) -> Vector | None:
    i, j, k = (float(word.number) if word is not None else 0.0 for word in words)
    return unit((i, j, k))


def _turns_by(word: Word | None, state: State) -> bool:
    return word.manner == "IC" if word is not None and word.manner else not state.absolute


def _same(a: Vector, b: Vector) -> bool:
    return abs(a[0] - b[0]) < _SAME_VECTOR and abs(a[1] - b[1]) < _SAME_VECTOR and abs(a[2] - b[2]) < _SAME_VECTOR


def _style(styles: Styles, letter: str, kindred: tuple[str, ...]) -> Style:
    """Return the style of a word, of its kin, or of a coordinate; Siemens writes A3 with an equals sign."""
    style = styles.like(letter, *kindred, "X", "Y", "Z")
    return style._replace(between=style.between if "=" in style.between else "=") if letter in _SIEMENS else style
