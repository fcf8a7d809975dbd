"""The text of moves: columns of numbers into blocks of a dialect, and block numbers before them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import OutputError
from sicp_postprocessors.gcode.dialects import Dialect
from sicp_postprocessors.gcode.feeds import feed_decimals
from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.moves import Moves
from sicp_postprocessors.rows import rows

__all__ = ["block_texts", "numbered"]

_BETWEEN = ("; ", "M126", "M127", "M128", "FUNCTION TCPM")
"""What may stand between a tool call of Heidenhain and the speed that belongs to it."""


def block_texts(moves: Moves, options: GCodeOptions, machine: Machine | None, *, rapid: bool) -> list[str]:
    """Return one block for each move: its code, X Y Z, the words of the tool axis, and the feed where it is stated.

    Parameters
    ----------
    moves
        Their `targets` hold X, Y, Z and the numbers of the tool axis; their `feeds_mm_min` the numbers behind F.
    options
        Dialect and decimals.
    machine
        Whose rotary axes are stated; None for vectors.
    rapid
        Whether these are rapid moves.
    """
    control = options.control
    place = f"{{:{control.sign}.{options.position_decimals}}}"
    columns = list(moves.targets.T)
    if machine is None:
        codes, count = control.vector_codes or control.codes, control.vector.count("{}")
        turn = control.vector.format(*[f"{{:{control.sign}.{options.axis_decimals}}}"] * count)
        columns = columns[:3] + columns[3:] * (count // 3)
    else:
        codes, letters = control.codes, sorted(axis.letter for axis in machine.rotaries)
        turn = " ".join(f"{letter}{{:{control.sign}.{options.angle_decimals}}}" for letter in letters)
    code, feed, end = codes[1], "", ""
    if rapid:
        code, end = codes[0], codes[2]
    elif options.states_time:
        feed = f" F{_feed_format(options)}"
        columns.append(moves.feeds_mm_min)
    else:
        feed = "{}"
        columns.append(_feed_words(moves, _feed_format(options)))
    tips = f"X{place} Y{place} Z{place}"
    return rows(control.block.format(code=code, tips=tips, turn=turn, feed=feed, end=end), *columns)


def numbered(lines: Iterable[str], control: Dialect, step: int) -> list[str]:
    """Return lines with block numbers; numbers begin again where the control has no larger ones.

    Raises
    ------
    OutputError
        If a line is longer than the control reads.

    >>> from sicp_postprocessors.gcode.dialects import DIALECTS
    >>> numbered(["%", "G90", "(x)", "M30"], DIALECTS["fanuc"], 10)
    ['%', 'N10 G90', '(x)', 'N20 M30']
    """
    told = list(lines)
    longest = max(map(len, told), default=0)
    if longest > control.longest_line:
        raise OutputError(f"a block has {longest} characters, too many for {control.family}; write fewer decimals")
    before = control.block_number
    if control.always_numbered:
        return [before.format(number) + line for number, line in enumerate(_with_speeds(told))]
    if not step:
        return told
    within, free = control.largest_number // step, frozenset(control.unnumbered)
    count = itertools.count()
    return [line if line[0] in free else before.format((next(count) % within + 1) * step) + line for line in told]


def _feed_format(options: GCodeOptions) -> str:
    return f"{{:.{feed_decimals(options)}{'p' if options.control.feed_point else 't'}}}"


def _feed_words(moves: Moves, form: str) -> npt.NDArray[np.bytes_]:
    stated = np.flatnonzero(moves.states_feed)
    texts = rows(f" F{form}", moves.feeds_mm_min[stated])
    column = np.zeros(len(moves), f"S{max(map(len, texts), default=1)}")
    column[stated] = texts
    return column


def _with_speeds(lines: list[str]) -> list[str]:
    """Join the speed of a spindle to the tool call before it, where nothing moves between: `TOOL CALL 3 Z S12000`."""
    joined = list(lines)
    for call in [i for i, line in enumerate(lines) if line.startswith("TOOL CALL ") and line[10:11] != "S"]:
        speed = call + 1
        while speed < len(lines) and lines[speed].startswith(_BETWEEN):
            speed += 1
        if speed < len(lines) and lines[speed].startswith("TOOL CALL S"):
            joined[call] += lines[speed].removeprefix("TOOL CALL")
            joined[speed] = ""
    return [line for line in joined if line]
