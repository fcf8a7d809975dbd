"""Rows of numbers in text files: split, parsed at C speed, and refused with their line.

Parsers in C do the work: `quick_numbers` where the rows leave no doubt, else that of NumPy, because `float` and `int`
accept far too much (`1_0`, digits of other scripts). Only when both refuse a block does a slow third look find out
which line and which word is to blame.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import TypeAlias

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.tables.blocks import quick_numbers

__all__ = ["BLANKS", "NUMBER", "Row", "cells", "numbers", "text_lines"]

Row: TypeAlias = tuple[int, bytes]
"""A line that is not blank: its 1-based number, and its text without the blanks around it."""

BLANKS = b" \t\n\r\x0b\x0c\x1c\x1d\x1e\x1f\x85\xa0"
"""What separates words: the same characters that `str.split` and `numpy.loadtxt` take for blanks in Latin-1."""

NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
"""A decimal number, or a marker that the parser knows and the check for finite numbers refuses afterwards."""

_COMMA_NUMBER = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_BATCH_ROWS = 100_000
_WORTH_LOADING_PANDAS = 20_000


def text_lines(
    path: Path, content: bytes, limits: Limits, *, first_byte: int = 0, first_line: int = 1
) -> Iterator[Row]:
    """Yield the lines of a text that are not blank, whatever its line ends are (LF, CRLF or CR).

    Raises
    ------
    FormatError
        If a line is longer than `limits.line_bytes`.
    """
    stream = BytesIO(content)
    stream.seek(first_byte)
    if content.find(b"\n", first_byte) < 0:
        stream = BytesIO(content[first_byte:].replace(b"\r", b"\n"))
    for number, line in enumerate(stream, first_line):
        if len(line) > limits.line_bytes:
            what = f"the line has {len(line)} bytes, more than the limit line_bytes = {limits.line_bytes}; is it text?"
            raise FormatError(path, what, line=number)
        text = line.strip(BLANKS)
        if text:
            yield number, text


def cells(text: bytes, delimiter: str | None) -> list[str]:
    """Return the cells of one row; a delimiter of None means any run of blanks."""
    return [cell.strip() for cell in text.decode("latin-1").split(delimiter)]


def numbers(
    path: Path,
    rows: Iterable[Row],
    columns: int,
    *,
    finite: Sequence[int],
    delimiter: str | None = None,
    used: Sequence[int] | None = None,
) -> tuple[FloatArray, IntArray]:
    """Parse rows that all have the same number of columns.

    Parameters
    ----------
    path
        The file, for messages.
    rows
        Lines of cells with decimal points.
    columns
        Cells in each row.
    finite
        Columns that may not hold nan or an infinity.
    delimiter
        One character, or None for any run of blanks.
    used
        Columns that must be numbers, where some hold text; all if left out. The others read as nan.

    Returns
    -------
    values, lines
        (n, columns) numbers, and the (n,) lines that they stand in.

    Raises
    ------
    FormatError
        If a row has more or fewer cells, a cell is no number, or a column in `finite` holds one that is not finite.
    """
    rows = iter(rows)
    blocks, places = [np.zeros((0, columns))], [np.zeros(0, np.int64)]
    while batch := list(islice(rows, _BATCH_ROWS)):
        blocks.append(_block(path, batch, columns, finite, delimiter, used))
        places.append(np.fromiter((number for number, _ in batch), np.int64, len(batch)))
    return np.concatenate(blocks), np.concatenate(places)


def _block(
    path: Path,
    batch: list[Row],
    columns: int,
    finite: Sequence[int],
    delimiter: str | None,
    used: Sequence[int] | None,
) -> FloatArray:
    texts = [text for _, text in batch]
    if used is None and len(batch) >= _WORTH_LOADING_PANDAS:
        quick = quick_numbers(b"\n".join(texts), columns, delimiter=delimiter)
        if quick is not None and len(quick) == len(batch):
            return quick
    if used is not None:
        for number, text in batch:
            _check_count(path, number, cells(text, delimiter), columns)
    try:
        found = np.loadtxt(texts, delimiter=delimiter, comments=None, ndmin=2, encoding="latin-1", usecols=used)
    except ValueError as error:
        raise _blame(path, batch, columns, delimiter, used, str(error)) from None
    if found.shape != (len(batch), columns if used is None else len(used)):
        raise _blame(path, batch, columns, delimiter, used, f"the rows do not have {columns} columns each")
    values = found
    if used is not None:
        values = np.full((len(batch), columns), np.nan)
        values[:, list(used)] = found
    bad_rows, bad_columns = np.nonzero(~np.isfinite(values[:, list(finite)]))
    if len(bad_rows):
        number, text = batch[bad_rows[0]]
        word = cells(text, delimiter)[finite[bad_columns[0]]]
        what = f"{word!r} is not a finite number that fits a double; remove or repair the row"
        raise FormatError(path, what, line=number)
    return values


def _blame(
    path: Path, batch: list[Row], columns: int, delimiter: str | None, used: Sequence[int] | None, otherwise: str
) -> FormatError:
    for number, text in batch:
        words = cells(text, delimiter)
        for word in words if used is None else [words[column] for column in used]:
            if _COMMA_NUMBER.fullmatch(word):
                return FormatError(path, f"decimal comma in {word!r}; export with decimal points", line=number)
            if not NUMBER.fullmatch(word):
                return FormatError(path, f"{word!r} is not a number; remove or repair the row", line=number)
        try:
            _check_count(path, number, words, columns)
        except FormatError as error:
            return error
    return FormatError(path, otherwise, line=batch[0][0])


def _check_count(path: Path, number: int, words: list[str], columns: int) -> None:
    if len(words) != columns:
        what = f"the row has {len(words)} columns instead of {columns}; the file is damaged or cut short"
        raise FormatError(path, what, line=number)
