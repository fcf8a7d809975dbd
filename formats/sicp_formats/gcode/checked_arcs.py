"""Check the arcs of a G-code program: start and end must be as far from the centre, and a radius must reach."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sicp_formats.paths.defects import Defects

__all__ = ["CheckedArcs"]

ARC = 878
"""Code of the findings."""

_PLANES = {17.0: ("X", "Y", "I", "J"), 18.0: ("X", "Z", "I", "K"), 19.0: ("Y", "Z", "J", "K")}
_TOLERANCE_MM = 0.01


class CheckedArcs:
    """Where the tool is, in the unit of the program; None where that is not known.

    `mm` is the length of that unit, `plane` the G code of the plane, `centre_absolute` tells of G90.1.
    """

    def __init__(self, defects: Defects) -> None:
        self.mm = 1.0
        self.plane = 17.0
        self.centre_absolute = False
        self._defects = defects
        self._at: dict[str, float | None] = dict.fromkeys("XYZ")

    def forget(self) -> None:
        """Take it that nobody knows where the tool is."""
        self._at = dict.fromkeys("XYZ")

    def straight(self, x: str | None, y: str | None, z: str | None, absolute: bool) -> None:
        """Follow a straight move."""
        at = self._at
        if x is not None:
            at["X"] = self._target("X", x, absolute)
        if y is not None:
            at["Y"] = self._target("Y", y, absolute)
        if z is not None:
            at["Z"] = self._target("Z", z, absolute)

    def block(self, words: Mapping[str, str | None], mode: float, absolute: bool, line: int) -> None:
        """Follow a block with coordinates, and check it if it is an arc."""
        start = dict(self._at)
        self.straight(words.get("X"), words.get("Y"), words.get("Z"), absolute)
        if mode >= 2.0:
            self._check(start, words, line)

    def _target(self, letter: str, text: str, absolute: bool) -> float | None:
        here = self._at[letter]
        return float(text) if absolute else None if here is None else here + float(text)

    def _check(self, start: Mapping[str, float | None], words: Mapping[str, str | None], line: int) -> None:
        first, second, i, j = _PLANES[self.plane]
        a, b, c, d = start[first], start[second], self._at[first], self._at[second]
        if a is None or b is None or c is None or d is None:
            return
        radius, tolerance = words.get("R"), _TOLERANCE_MM / self.mm
        if radius is not None:
            chord = math.hypot(c - a, d - b)
            if chord > 2.0 * abs(float(radius)) + tolerance or chord < tolerance:
                what = f"the radius R{radius} makes no arc between ends that are {chord:.6g} apart"
                self._defects.fail(ARC, what, line)
            return
        if words.get(i) is None and words.get(j) is None:
            self._defects.fail(ARC, f"an arc with neither R nor {i} {j}", line)
            return
        x, y = float(words.get(i) or 0.0), float(words.get(j) or 0.0)
        centre = (x, y) if self.centre_absolute else (a + x, b + y)
        begin, end = math.dist((a, b), centre), math.dist((c, d), centre)
        if abs(begin - end) > tolerance:
            what = f"an arc that begins {begin:.6g} and ends {end:.6g} from its centre"
            self._defects.fail(ARC, what, line)
