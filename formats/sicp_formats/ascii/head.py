"""What stands before the first row of a table of text: comments, names of columns, the number of rows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_formats.ascii.columns import COLUMN_HINT, Columns, known_names, named_columns, split_header
from sicp_formats.ascii.dialect import DELIMITERS, Dialect
from sicp_formats.ascii.rows import COUNT, all_rows, is_comment
from sicp_formats.surfaces.unit import StatedUnit, unit_in
from sicp_formats.tables.rows import NUMBER, Row
from sicp_formats.tables.stream import Block

__all__ = ["Head", "check_comments", "columns_of_header", "read_head", "stated_unit"]

_SAMPLE_ROWS = 200
_TITLE = re.compile(
    r"[#/;\s]*(?:(?:the|of|column|point|scan|data|file)\s+)*"
    r"(?:columns?|fields?|formats?|header|layout|order|coordinates|names|axes|points?|data)\s*[:=]\s*",
    re.IGNORECASE,
)
_HINT = "mark comments with '#', or name the columns with --set scan.columns=x,y,z,..."


@dataclass(frozen=True, slots=True)
class Head:
    """What stands before the first row, and the first rows.

    Parameters
    ----------
    comments, texts
        Lines that are comments, and lines that are neither comments nor rows.
    count, count_line
        Number of rows that the file declares, None if it does not, and its line.
    sample
        The first rows, at least one.
    """

    comments: tuple[Row, ...]
    texts: tuple[Row, ...]
    count: int | None
    count_line: int
    sample: tuple[Row, ...]

    @property
    def line(self) -> int:
        """Line of the first row."""
        return self.sample[0][0]


def read_head(path: Path, block: Block, limits: Limits) -> Head:
    """Take apart what stands before the first row.

    Raises
    ------
    FormatError
        If there is no row within `limits.header_lines`.
    """
    comments: list[Row] = []
    texts: list[Row] = []
    rows = all_rows(path, block, limits)
    for row in rows:
        if is_comment(row[1]):
            comments.append(row)
        elif not _names_points(row[1]) and _holds_number(row[1]):
            return _sampled(path, row, tuple(comments), tuple(texts), rows)
        else:
            texts.append(row)
        if len(comments) + len(texts) > limits.header_lines:
            what = f"no row of numbers within the limit header_lines = {limits.header_lines}; is it a scan?"
            raise FormatError(path, what, line=row[0])
    what = "holds no row of numbers; is it a scan?"
    raise FormatError(path, what, line=texts[0][0] if texts else 1)


def columns_of_header(path: Path, head: Head, units: str | None, recover: bool) -> Columns | None:
    """Place the columns by the last text, or the last comment that names as many columns as the rows have.

    Parameters
    ----------
    path, head
        The file and its head.
    units
        What the user states, so that a unit in the header does not matter.
    recover
        True if text that names no columns is to be passed over.

    Raises
    ------
    FormatError
        If there is text that does not name the columns.
    """
    if head.texts and not recover:
        line, text = head.texts[-1]
        found = named_columns(path, split_header(_decoded(text)), line, unit_matters=units is None)
        if found is None or len(head.texts) > 1:
            line, text = head.texts[0]
            what = f"{_decoded(text)[:60]!r} neither is a row of numbers nor names the columns x, y, z; {_HINT}"
            raise FormatError(path, what, line=line)
        return found
    widths = {len(Dialect(delimiter, ".", quoted=True).words(head.sample[0][1])) for delimiter in DELIMITERS}
    placed: Columns | None = None
    for line, text in sorted(head.comments + head.texts, reverse=True):
        names = split_header(_TITLE.sub("", _decoded(text), count=1))
        if len(names) in widths and {"x", "y", "z"} <= {*known_names(names)}:
            found = named_columns(path, names, line, unit_matters=units is None)
            if placed and found and found.xyz != placed.xyz:
                what = f"the comment names other columns than line {placed.line}; remove one, or {COLUMN_HINT}"
                raise FormatError(path, what, line=line)
            placed = placed or found
    return placed


def check_comments(path: Path, head: Head, columns: int) -> None:
    """Refuse comments that name x, y and z and do not fit x y z in the first columns, where nothing else names them.

    Of three columns they may say anything that keeps this order; of more, nothing may stand before x.

    Parameters
    ----------
    path, head
        The file and its head.
    columns
        Columns of each row.

    Raises
    ------
    FormatError
        With the line of the comment.
    """
    for line, text in head.comments + head.texts:
        shown = _decoded(text)
        names = known_names(re.findall(r"[^\W\d]\w*", _TITLE.sub("", shown, count=1)))
        if not {"x", "y", "z"} <= {*names}:
            continue
        first = [names.index(axis) for axis in "xyz"]
        more = columns == 3 and {"nx", "ny", "nz", "i", "intensity", "r", "red"} & {*names}
        if first != sorted(first) or (columns > 3 and first[0]) or more:
            what = f"the comment {shown[:60]!r} does not fit the {columns} columns taken as x y z and more"
            raise FormatError(path, f"{what}; {COLUMN_HINT}", line=line)


def stated_unit(path: Path, head: Head) -> StatedUnit | None:
    """Return the unit that the lines before the first row state, None if they state none.

    Raises
    ------
    FormatError
        If they state two.
    """
    unit = None
    for line, text in sorted(head.comments + head.texts):
        unit = unit_in(path, _decoded(text).lstrip("#/; \t"), line, unit)
    return unit


def _names_points(text: bytes) -> bool:
    return {"x", "y", "z"} <= {*known_names(split_header(_decoded(text)))}


def _holds_number(text: bytes) -> bool:
    words = re.split(r"[\s;,]+", text.decode("latin-1"))
    return any(NUMBER.fullmatch(word.strip('"')) for word in words)


def _sampled(path: Path, row: Row, comments: tuple[Row, ...], texts: tuple[Row, ...], rows: Iterator[Row]) -> Head:
    """Tell a first line with the number of rows from a first row, and take the first rows."""
    counted = COUNT.fullmatch(row[1]) is not None
    rows = (each for each in rows if not is_comment(each[1]))
    if counted:
        following = next(rows, None)
        if following is not None and COUNT.fullmatch(following[1]):
            what = "two lines with one number each begin a PTX file; name it .ptx"
            raise FormatError(path, what, line=row[0])
        rest = chain([following] if following else [], rows)
        sample = tuple(islice((each for each in rest if not COUNT.fullmatch(each[1])), _SAMPLE_ROWS))
    else:
        sample = (row, *islice(rows, _SAMPLE_ROWS - 1))
    if not sample:
        raise FormatError(path, "no points; export the scan again", line=row[0])
    return Head(comments, texts, int(row[1]) if counted else None, row[0] if counted else 0, sample)


def _decoded(text: bytes) -> str:
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")
