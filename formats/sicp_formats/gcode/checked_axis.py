"""Check how a G-code program turns the tool: tip control on before and off behind it, vectors, rotary steps."""

from __future__ import annotations

from collections.abc import Mapping

from sicp_formats.gcode.keywords import TIP_CONTROL_OFF, TIP_CONTROL_ON
from sicp_formats.gcode.words import Block
from sicp_formats.paths.defects import Defects

__all__ = ["CheckedAxis"]

TIP_CONTROL, ROTARY = 876, 877
"""Codes of the findings."""

_ON, _OFF = frozenset({43.4, 43.5, 234.0, 169.0}), frozenset({49.0, 170.0})
_LENGTHS, _PLAIN_LENGTH = frozenset({43.4, 43.5, 234.0}), frozenset({43.0, 43.1})
"""G43 takes the place of those that are tool lengths too, and of no tip control that other words switch on."""
_ON_M, _OFF_M = frozenset({128.0, 428.0}), frozenset({129.0, 429.0, 430.0})


class CheckedAxis:
    """What rules over the tool axis after the blocks so far.

    Parameters
    ----------
    defects
        Where defects are noted.
    rotary_step_deg
        Turn of a rotary axis from block to block beyond which it is told.
    """

    def __init__(self, defects: Defects, rotary_step_deg: float) -> None:
        self._defects = defects
        self._largest_step = rotary_step_deg
        self._angles: dict[str, float] = {}
        self._tip_control = self._vector_words = self._was_on = False
        self._by_length = False
        self._vector: tuple[str | None, str | None] | None = None
        self._vector_before = 0
        self._turned_before = 0
        self._set_before = 0
        self._tilted_cut = 0

    def take_modes(self, block: Block, line: int) -> None:
        """Take the words of a block that switch tip control, and its tool change."""
        for code in block.g:
            if code in _ON or code in _OFF:
                self._switch(code in _ON, vector=code == 43.5)
                self._by_length = code in _LENGTHS
            elif code in _PLAIN_LENGTH and self._by_length:
                self._switch(False, vector=False)
        for code in block.m:
            if code in _ON_M or code in _OFF_M:
                self._switch(code in _ON_M, vector=False)
        for keyword in block.keywords:
            if keyword.startswith(TIP_CONTROL_ON):
                self._switch(True, vector=False)
            elif keyword == TIP_CONTROL_OFF:
                self._switch(False, vector=False)
        if 6.0 in block.m and self._tip_control:
            self._defects.warn(TIP_CONTROL, "the tool is changed while tip control is on; switch it off before", line)

    def point(self, siemens: bool, sideways: tuple[str | None, str | None], line: int) -> None:
        """Check a straight move that states a vector: A3 B3 C3 of Siemens, or I J K; `sideways` are the first two."""
        self._vector = sideways
        if self._tip_control if siemens else self._vector_words:
            return
        if self._was_on and not self._tip_control:
            self._defects.fail(TIP_CONTROL, "the tool axis is stated after tip control is switched off", line)
        elif self._was_on:
            self._defects.fail(TIP_CONTROL, "I J K in a straight move, while G43.5 is not on", line)
        else:
            self._vector_before = self._vector_before or line

    def cut(self, line: int) -> None:
        """Check a cut: while tip control is off, nothing may be left of the tilt that it has followed."""
        if self._tip_control:
            return
        if self._was_on and self._vector is not None and any(float(each or 0.0) for each in self._vector):
            what = "a cut after tip control is switched off, while the tool axis of the last vector still holds"
            self._defects.fail(TIP_CONTROL, what, line)
            self._vector = None
        held = [f"{letter}{angle:g}" for letter, angle in self._angles.items() if angle % 360.0]
        if held and self._was_on and not self._tilted_cut:
            what = f"a cut after tip control is switched off, while {' '.join(held)} still hold"
            self._defects.warn(TIP_CONTROL, what, line)
        if held:
            self._tilted_cut = self._tilted_cut or line

    def turn(
        self, words: Mapping[str, str | None], *, absolute: bool, cuts: bool, beside: bool = False, line: int
    ) -> None:
        """Check rotary words: the step from the block before, and cuts that turn while tip control is off.

        `beside` tells that they stand in a cut or beside Z; X and Y of a rapid move beside them place the tool only, as
        the examples of Haas do before G234.
        """
        for letter, text in words.items():
            if text is None:
                continue
            angle, before = float(text), self._angles.get(letter)
            if not absolute:
                angle, before = (before or 0.0) + angle, before or 0.0
            self._angles[letter], self._vector = angle, None
            if beside and angle % 360.0 and not self._was_on:
                self._set_before = self._set_before or line
            step = 0.0 if before is None else abs(angle - before)
            if step > self._largest_step:
                what = f"{letter} turns by {step:.6g} degrees in one block, from {before:.6g} to {angle:.6g}"
                self._defects.warn(ROTARY, what, line)
            if not step or not cuts or self._tip_control:
                continue
            if self._was_on:
                self._defects.fail(TIP_CONTROL, f"{letter} turns in a cut after tip control is switched off", line)
            self._turned_before = self._turned_before or line

    def forget(self) -> None:
        """Take it that nobody knows where the rotary axes are."""
        self._angles.clear()
        self._vector = None

    def end(self, line: int) -> None:
        """Take the end of the program."""
        if self._tip_control:
            self._defects.warn(TIP_CONTROL, "the program ends while tip control is on; switch it off before", line)

    def finish(self) -> None:
        """Judge what only the whole program shows."""
        if self._vector_before and not self._was_on:
            what = "the tool axis is stated as a vector, and no word switches tip control on (G43.5, TRAORI)"
            self._defects.fail(TIP_CONTROL, what, self._vector_before)
        elif self._tilted_cut and not self._was_on:
            what = (
                "cuts with turned rotary axes, and no word switches tip control on: X Y Z must be those of the machine"
            )
            self._defects.info(TIP_CONTROL, what, self._tilted_cut)

    def _switch(self, on: bool, *, vector: bool) -> None:
        first = min(filter(None, (self._vector_before, self._turned_before)), default=0)
        if on and first and not self._was_on:
            self._defects.fail(TIP_CONTROL, "the tool axis turns before tip control is switched on", first)
        elif on and self._set_before and not self._was_on:
            what = "rotary words beside X Y Z before tip control is switched on: these are no points of the tip"
            self._defects.warn(TIP_CONTROL, what, self._set_before)
        if on:
            self._tilted_cut = 0
        self._tip_control, self._vector_words = on, vector
        self._was_on = self._was_on or on
