"""A path in several programs: a main program that calls its parts, in the way of the control."""

from __future__ import annotations

from collections.abc import Sequence

from sicp_postprocessors.gcode.dialects import Dialect, Subprograms

__all__ = ["with_subprograms"]


def with_subprograms(
    control: Dialect, kind: Subprograms, names: tuple[str, str], number: int, bodies: Sequence[list[str]]
) -> tuple[list[str], dict[str, list[str]]]:
    """Return the lines that call the parts of a path, and the lines of each part by the name of its file.

    Parameters
    ----------
    control, kind
        The dialect, and how it divides programs.
    names
        Name of the main file without suffix, and the program's name as the control takes it.
    number
        O number of the main program; its parts have those that follow.
    bodies
        Lines of each part.

    >>> from sicp_postprocessors.gcode.dialects import DIALECTS
    >>> haas = DIALECTS["haas"]
    >>> with_subprograms(haas, haas.subprograms, ("a", "A"), 7, [["G0 X1"]])
    (['M98 P8'], {'a_1.nc': ['%', 'O00008', 'G0 X1', 'M99', '%']})
    """
    stem, listed = names
    listed = listed.lower() if kind.lower_case else listed
    # LinuxCNC finds no subprogram behind a percent sign.
    percent = ["%"] if kind.numbered else []
    calls, parts = [], {}
    for count, body in enumerate(bodies, 1):
        words = {"name": f"{listed}_{count}", "number": number + count, "o": control.number.format(number + count)}
        calls.append(kind.call.format(**words))
        first, last = ([line.format(**words) for line in lines] for lines in (kind.start, kind.end))
        file = f"{stem}_{count}" if kind.numbered else str(words["name"])
        parts[file + (kind.suffix or control.suffix)] = [*percent, *first, *body, *last, *percent]
    return calls, parts
