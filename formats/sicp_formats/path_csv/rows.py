"""Cut the lines of a table into cells, and know where each cell stands in its line."""

from __future__ import annotations

import re

__all__ = ["cell_places", "cells_of", "delimiter_of", "without_remark"]

_SEPARATOR_LINE = re.compile(r"sep=(.)", re.IGNORECASE)
_BLANK_CELLS = re.compile(r'"[^"]*"|\S+')
_QUOTED_CELLS = {mark: re.compile(rf'(?:[^{mark}"]|"[^"]*"?)*') for mark in ";\t,"}


def delimiter_of(line: str) -> str | None:
    r"""Return the mark between the cells of a line: a semicolon, a tab or a comma; None for blanks.

    Marks in quotes do not count, and `sep=;` states the mark, as spreadsheets write it.

    >>> delimiter_of('"x, mm";"y, mm"'), delimiter_of("1 2 3"), delimiter_of("sep=\t")
    (';', None, '\t')
    """
    stated = _SEPARATOR_LINE.fullmatch(line.strip("\n "))
    if stated and stated[1] in ";\t,":
        return stated[1]
    plain = re.sub(r'"[^"]*"', "", line) if '"' in line else line
    return next((mark for mark in ";\t," if mark in plain), None)


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line without blanks and quotes around them.

    >>> cells_of(' 1; "a;b" ;3', ";"), cells_of("1  2 3", None)
    (['1', 'a;b', '3'], ['1', '2', '3'])
    """
    if '"' in line:
        return [line[start:end].strip().strip("\"'").strip() for start, end in cell_places(line, delimiter)]
    return [cell.strip().strip("'").strip() for cell in line.split(delimiter)]


def cell_places(line: str, delimiter: str | None) -> list[tuple[int, int]]:
    """Return begin and end of each cell in its line, with blanks and quotes.

    >>> cell_places("1, 2", ",")
    [(0, 1), (2, 4)]
    """
    if delimiter is None:
        return [found.span() for found in _BLANK_CELLS.finditer(line)]
    places, start = [], 0
    while True:
        found = _QUOTED_CELLS[delimiter].match(line, start)
        end = found.end() if found else start
        places.append((start, end))
        if end >= len(line):
            return places
        start = end + 1


def without_remark(line: str) -> tuple[str, str | None]:
    """Return a line without the remark behind `#` or `//`, and the remark, if there is one.

    >>> without_remark("1,2,3 # first"), without_remark("// head")
    (('1,2,3 ', 'first'), ('', 'head'))
    """
    if "#" not in line and "//" not in line:
        return line, None
    found = re.match(r'((?:[^"#/]|"[^"]*"|/(?!/))*)(?:#|//)(.*)', line, re.DOTALL)
    return (found[1], found[2].strip()) if found else (line, None)
