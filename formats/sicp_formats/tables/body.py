"""The rows of text behind a header: tables of numbers in large blocks, anything else row by row."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.tables.blocks import quick_numbers
from sicp_formats.tables.rows import Row, numbers, text_lines

__all__ = ["TextBody"]

_BLOCK_BYTES = 4 * 2**20
_WORTH_LOADING_PANDAS = 20_000
"""Rows from which the parser that is quick, and slow to load, pays."""


class TextBody:
    """A text that is taken row by row, or many rows at once.

    Parameters
    ----------
    path
        The file, for messages.
    content
        Its bytes.
    limits
        Caps on its lines.
    first_byte, first_line
        Where the body begins: 0-based offset, 1-based line.
    comments
        What lines begin with that are no rows.

    Attributes
    ----------
    skipped
        Lines of the comments met so far.
    """

    def __init__(
        self,
        path: Path,
        content: bytes,
        limits: Limits,
        *,
        first_byte: int,
        first_line: int,
        comments: Sequence[bytes] = (),
    ) -> None:
        self.skipped: list[int] = []
        self._path, self._content, self._limits = path, content, limits
        self._byte, self._line = first_byte, first_line
        # Looking at each row would take longer than reading it, and hardly any body has comments: no number has their
        # first letters.
        self._comments = tuple(comments) if any(content.find(word[:1], first_byte) >= 0 for word in comments) else ()
        self._rows: Iterator[Row] | None = None

    def rows(self, count: int | None = None) -> Iterator[Row]:
        """Return the next rows, all if no count is given."""
        if self._rows is None:
            lines = text_lines(self._path, self._content, self._limits, first_byte=self._byte, first_line=self._line)
            self._rows = (row for row in lines if not self._is_comment(row)) if self._comments else lines
        # No text has more rows than that, and islice takes no larger number.
        return islice(self._rows, None if count is None else min(count, sys.maxsize))

    def table(self, count: int, columns: int) -> tuple[FloatArray, IntArray]:
        """Return the numbers of the next rows, fewer if there are no more, and their lines.

        Raises
        ------
        FormatError
            With the line: a row with more or fewer numbers, or a cell that is none.
        """
        blocks: list[FloatArray] = []
        lines: list[IntArray] = []
        left = count
        while left >= _WORTH_LOADING_PANDAS and (block := self._quick(left, columns)) is not None:
            lines.append(np.arange(self._line - len(block), self._line))
            blocks.append(block)
            left -= len(block)
        values, places = numbers(self._path, self.rows(left), columns, finite=())
        if not blocks:
            return values, places
        return np.concatenate([*blocks, values]), np.concatenate([*lines, places])

    def _quick(self, most: int, columns: int) -> FloatArray | None:
        """Take a block of lines that are all rows and leave no doubt, and step behind it; None if there is none."""
        if self._rows is not None:
            return None  # what has been taken row by row does not tell its offset
        end = self._content.rfind(b"\n", self._byte, self._byte + _BLOCK_BYTES) + 1
        ends = np.flatnonzero(np.frombuffer(self._content[self._byte : max(end, self._byte)], np.uint8) == 10)[:most]
        if len(ends) == 0 or np.diff(ends, prepend=-1).max() > self._limits.line_bytes:
            return None
        end = self._byte + int(ends[-1]) + 1
        values = quick_numbers(self._content[self._byte : end], columns)
        if values is None or len(values) != len(ends):
            return None
        self._byte, self._line = end, self._line + len(ends)
        return values

    def _is_comment(self, row: Row) -> bool:
        if not row[1].startswith(self._comments):
            return False
        self.skipped.append(row[0])
        return True
