"""Check the text of a CSV path: the columns that this package writes, and what stands in them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_formats.path_csv.columns import OWN_HEADER
from sicp_formats.path_csv.rows import cells_of, delimiter_of, without_remark
from sicp_formats.paths.defects import Check, Defects, check_characters
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.motion import number_of
from sicp_formats.source import read_bytes

__all__ = ["check"]

_STATUS = ("covered", "bridged", "approach")
_UNIT_AXIS = 1e-6


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a table with the columns x,y,z,i,j,k,feed,rapid,status; of other tables only that they have others.

    Parameters
    ----------
    path
        The file.
    limits
        Caps on it.

    Raises
    ------
    FormatError
        If the file is no text.
    """
    lines = program_lines(path, read_bytes(path, limits), limits)
    defects = Defects(path)
    rows = [(number, text) for number, line in enumerate(lines, 1) if (text := without_remark(line)[0]).strip()]
    if not rows:
        return ()
    delimiter = delimiter_of(rows[0][1])
    header = [cell.lower() for cell in cells_of(rows[0][1], delimiter)]
    if tuple(header[: len(OWN_HEADER)]) != OWN_HEADER:
        _check_other(defects, header, rows[0][0])
        return defects.findings()
    check_characters(defects, lines)
    if delimiter != ",":
        defects.warn(Check.FORM, "the cells are not separated by commas", rows[0][0])
    for number, text in rows[1:]:
        for code, problem in _problems(cells_of(text, delimiter)):
            defects.fail(code, problem, number)
    return defects.findings()


def _check_other(defects: Defects, header: Sequence[str], line: int) -> None:
    wanted = ",".join(OWN_HEADER)
    if set(OWN_HEADER) <= set(header):
        defects.warn(Check.FORM, f"the columns are not in the order {wanted}", line)
    else:
        defects.info(Check.FORM, f"a table with other columns than {wanted}; only the path in it was judged", line)


def _problems(cells: Sequence[str]) -> Iterator[tuple[Check, str]]:
    """Yield code and text of what is wrong with a row."""
    if len(cells) < len(OWN_HEADER):
        yield Check.FORM, f"{len(cells)} cells, at least {len(OWN_HEADER)} are wanted"
        return
    if cells[8] not in _STATUS:
        yield Check.WORDS, f"the status is {printable(cells[8], 40)!r}, not one of {', '.join(_STATUS)}"
    if cells[7] not in ("0", "1"):
        yield Check.WORDS, f"rapid is {printable(cells[7], 40)!r}, not 0 or 1"
    numbers = [number_of(cell) for cell in cells[3:7]]
    axis, feed = [number for number in numbers[:3] if number is not None], numbers[3]
    if len(axis) == 3 and abs(math.hypot(*axis) - 1.0) > _UNIT_AXIS:
        yield Check.ORIENTATION, f"the tool axis has the length {math.hypot(*axis):.7g}, not 1"
    if feed is not None and cells[7] == "1" and feed != 0.0:
        yield Check.SPEED, f"a rapid move with the feed {feed:g}"
    elif feed is not None and cells[7] == "0" and not feed > 0.0:
        yield Check.SPEED, f"a cut with the feed {feed:g}"
