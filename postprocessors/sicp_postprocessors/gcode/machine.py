"""A five-axis machine as data: the two rotary axes between the part and the tool, where they stand, how far they turn.

Everything is stated at the zero position of all axes, in the machine frame, whose X, Y, Z are the linear axes as the
tool moves relative to the part. The *gauge point* is where tool lengths are measured from; the tip is one tool length
from it, against the home axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sicp_cam.model import FloatArray

__all__ = ["ENDLESS_DEG", "NO_LIMITS_DEG", "WRAPS", "Machine", "RotaryAxis", "Vector"]

Vector = tuple[float, float, float]

ENDLESS_DEG = 360.0
"""An axis whose travel is longer than this may reach a direction in several turns."""
NO_LIMITS_DEG = (-36000.0, 36000.0)
WRAPS = ("none", "0..360", "+-180")


@dataclass(frozen=True, slots=True)
class RotaryAxis:
    """One rotary axis.

    Parameters
    ----------
    letter
        Its word: A, B or C.
    direction
        Unit vector of its line.
    on
        "head": it carries the tool; "table": it carries the part.
    sense
        What turns right-handed about `direction` at positive angles. "tool": the tool as seen from the part, which is
        ISO 841, and what a head does anyway; a table then turns left-handed. "table": the table itself, the other way
        round.
    point_mm
        A point on its line, None if not known: of a table in the machine frame, of a head from the gauge point.
    limits_deg
        Lowest and highest angle.
    wrap
        How its words are written: "none" as they come, through full turns; "0..360" or "+-180" within one turn, for
        controls that count so and go the shorter way.
    """

    letter: str
    direction: Vector
    on: str
    sense: str = "tool"
    point_mm: Vector | None = None
    limits_deg: tuple[float, float] = NO_LIMITS_DEG
    wrap: str = "none"

    @property
    def tool_direction(self) -> FloatArray:
        """Unit vector (3,) about which the tool turns right-handed relative to the part at positive angles."""
        direction = np.array(self.direction)
        return -direction if self.sense == "table" else direction

    @property
    def turns_on(self) -> bool:
        """Say whether the same direction can be reached in several turns."""
        return self.wrap != "none" or self.limits_deg[1] - self.limits_deg[0] > ENDLESS_DEG


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine with two rotary axes, in the order of the chain from the part to the tool.

    Parameters
    ----------
    name
        What the operator knows it by.
    rotaries
        The axis nearest to the part first: tables before heads, and of two heads the one that carries the other. The
        tool axis in the part is R_first R_second home_axis.
    home_axis
        Unit vector from tip to holder at zero.
    linear_limits_mm
        Lowest and highest X, Y, Z of the gauge point in the machine frame; None where they are not checked.
    """

    name: str
    rotaries: tuple[RotaryAxis, RotaryAxis]
    home_axis: Vector = (0.0, 0.0, 1.0)
    linear_limits_mm: tuple[tuple[float, float], ...] | None = None

    @property
    def letters(self) -> str:
        """Letters of the axes as they are usually named: the axis that tilts the tool, then the one that turns that."""
        return self.rotaries[1].letter + self.rotaries[0].letter

    @property
    def kind(self) -> str:
        """How the axes stand: head-head, head-table or table-table."""
        tables = sum(axis.on == "table" for axis in self.rotaries)
        return ("head-head", "head-table", "table-table")[tables]

    @property
    def has_geometry(self) -> bool:
        """Say whether it is known where both axes stand, and not only how they lie."""
        return all(axis.point_mm is not None for axis in self.rotaries)

    def limited(
        self, first: tuple[float, float] | None, second: tuple[float, float] | None, wrap: str | None
    ) -> Machine:
        """Return the machine with other limits or another way of writing turns, where those are stated."""
        one, two = self.rotaries
        one, two = _limited(one, first, wrap), _limited(two, second, wrap)
        return replace(self, rotaries=(one, two))

    def problems(self) -> list[str]:
        """Return what is wrong with the machine, in words; nothing if all is well."""
        first, second = self.rotaries
        home = np.array(self.home_axis)
        told = []
        if first.letter == second.letter:
            told.append(f"both axes are called {first.letter}")
        if _parallel(first.tool_direction, second.tool_direction):
            told.append("its axes are parallel, so that they cannot tilt the tool")
        if _parallel(second.tool_direction, home):
            told.append(f"{second.letter} lies along the tool and does not turn it; the axis next to the part is first")
        if (first.on, second.on) == ("head", "table"):
            told.append("the chain runs from the part to the tool: the table is first, then the head")
        told += [f"{a.letter} is on a head, whose sense is 'tool'" for a in self.rotaries if (a.on, a.sense) == _WRONG]
        return told


_WRONG = ("head", "table")


def _limited(axis: RotaryAxis, limits: tuple[float, float] | None, wrap: str | None) -> RotaryAxis:
    axis = axis if limits is None else replace(axis, limits_deg=limits)
    # Only what can turn round is written within one turn.
    round_deg = axis.limits_deg[1] - axis.limits_deg[0]
    return replace(axis, wrap=wrap) if wrap and round_deg >= ENDLESS_DEG and axis.turns_on else axis


def _parallel(a: FloatArray, b: FloatArray) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < 1e-3
