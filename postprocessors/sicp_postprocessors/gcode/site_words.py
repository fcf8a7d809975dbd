"""Words that switch tip control and tool length, those of the dialect or of the site, and what may be such a word."""

from __future__ import annotations

from collections.abc import Iterator

from sicp_postprocessors.gcode.machine import Machine
from sicp_postprocessors.gcode.options import GCodeOptions

__all__ = ["lacks_length", "length_remarks", "tip_off_words", "tip_on_words"]

_TOOL = "{tool}"


def tip_on_words(options: GCodeOptions, machine: Machine | None, tool: int) -> list[str]:
    """Return the lines that switch on the length of a tool, by its H word, and tip control.

    Parameters
    ----------
    options
        Dialect, and the words that replace its own.
    machine
        Whose rotary axes are stated; None for vectors.
    tool
        Number of the tool, 0 if it is not known.

    >>> tip_on_words(GCodeOptions(), None, 3), tip_on_words(GCodeOptions(dialect="linuxcnc", tcp_on="M428"), None, 0)
    (['G43.5 H3'], ['G43', 'M428'])
    """
    control, lines = options.control, []
    if _states_length(options):
        lines.append(control.length_on.replace(_TOOL, f" H{tool}") if tool else control.loaded_length)
    if machine is not None:
        wraps = any(axis.wrap != "none" for axis in machine.rotaries)
        lines.append(control.shorter_way if wraps else control.stated_way)
    lines += [line.replace(_TOOL, f" H{tool}" if tool else "").strip() for line in _tip_lines(options)]
    return [line for line in lines if line]


def tip_off_words(options: GCodeOptions) -> list[str]:
    """Return the lines that switch tip control and tool length off."""
    control = options.control
    tip = options.tcp_off.strip() or (control.tip_off if options.knows_tip else "")
    return [line for line in (tip, control.length_off if _states_length(options) else "") if line]


def lacks_length(options: GCodeOptions) -> bool:
    """Say whether the words need the number of a tool: without it, nothing says which length is in force."""
    length = _states_length(options) and not options.control.loaded_length
    return length or any(_TOOL in line for line in _tip_lines(options))


def length_remarks(options: GCodeOptions) -> Iterator[str]:
    """Return what the head of a program says of the tool length where the number of the tool is not known."""
    if lacks_length(options):
        yield "no H word: the tool length that is active must be that of the tool"
    elif _states_length(options):
        yield "the length of the tool in the spindle is taken"


def _tip_lines(options: GCodeOptions) -> tuple[str, ...]:
    # What a control with tip control would switch on, a program without it does itself.
    if options.tcp_on:
        return (options.tcp_on,)
    return options.control.tip_on[options.words] if options.knows_tip else ()


def _states_length(options: GCodeOptions) -> bool:
    """Say whether the tool length has a word of its own, because that of tip control does not hold it."""
    control = options.control
    return bool(control.length_on) and not (options.knows_tip and control.tip_on[options.words])
