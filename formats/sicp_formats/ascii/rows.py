"""Read the rows of a table of text into numbers: blocks without a doubt at once, the others row by row."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.ascii.dialect import Dialect
from sicp_formats.ascii.table import Table
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.ending import TAIL_BYTES, is_cut, last_line_cut
from sicp_formats.tables.blocks import quick_columns
from sicp_formats.tables.rows import NUMBER, Row, cells, numbers, text_lines
from sicp_formats.tables.stream import Block, TextStream

__all__ = ["COUNT", "RowReader", "all_rows", "is_comment"]

COUNT = re.compile(rb"[0-9]{1,18}")
"""A line with the number of rows to come, as PTS files have it."""

# A row whose first cell is empty begins with a semicolon too, and must not pass for a comment.
_COMMENT = re.compile(rb"#|//|;(?![\s;]*[-+.,]?[0-9])")
_MARKS = b"#/;"
_WORKERS = 2
_BLOCKS_AHEAD = 4
_CURE = "or repair it with --recover"


def is_comment(text: bytes) -> bool:
    """Tell whether a line is a comment: behind `#`, `//`, or a semicolon that ends no empty cell."""
    return text[0] in _MARKS and _COMMENT.match(text) is not None


def all_rows(path: Path, block: Block, limits: Limits) -> Iterator[Row]:
    """Yield the lines of a block that are not blank.

    Raises
    ------
    FormatError
        If a line is too long or holds a zero byte; the lines before it come first.
    """
    zero = block.text.find(b"\0")
    # With an LF in it, a CR counts as a blank and not as the end of a line.
    text = (block.text if zero < 0 else block.text[:zero].rpartition(b"\n")[0]) + b"\n"
    yield from text_lines(path, text, limits, first_line=block.line)
    if zero >= 0:
        what = "holds a zero byte and is no text; check the format, or save it as UTF-8"
        raise FormatError(path, what, byte=block.byte + zero)


class RowReader:
    """Gathers the rows of a file, and what had to be repaired.

    Parameters
    ----------
    path
        The file, for messages.
    dialect
        What separates the cells, and what the decimal mark is.
    width
        Cells in each row.
    used
        Columns that hold numbers; the others may hold anything and are not kept.
    finite
        Those of them that may not hold nan or an infinity.
    limits
        The cap on points and on lines.
    recover
        True if rows that cannot be read are to be dropped.
    """

    def __init__(
        self,
        path: Path,
        dialect: Dialect,
        width: int,
        used: Sequence[int],
        finite: Sequence[int],
        limits: Limits,
        recover: bool,
    ) -> None:
        self.path, self.dialect, self.width, self.used, self.finite = path, dialect, width, tuple(used), tuple(finite)
        self.limits, self.recover = limits, recover
        self.table = Table(len(self.used))
        self.scans = 0
        self._declared: int | None = None
        self._declared_line = self._begun = 0
        self._dropped = self._first_dropped = 0
        self._wrong_counts: list[tuple[int, str]] = []
        self._tail, self._cut_line = b"", 0

    def read(self, stream: TextStream) -> None:
        """Read all rows that are left in a stream.

        Raises
        ------
        FormatError
            If a row is not like the others, a number is not finite where it must be, there are more points than the
            limit, or not as many rows as declared; if they are repaired, only if more than half of the rows are bad.
        """
        for block, columns in self._parsed(stream):
            self._tail = (block.text if len(block.text) >= TAIL_BYTES else self._tail + block.text)[-TAIL_BYTES:]
            if not block.text.endswith(b"\n") and is_cut(self._tail, self.dialect.delimiter, self.dialect.trailing):
                self._cut_line = block.line + block.lines - 1
                block, columns = self._without_cut_line(block, columns)
            self._add(block, columns)
            if len(self.table) > self.limits.points:
                what = f"more points than the limit points = {self.limits.points}; raise it"
                raise FormatError(self.path, what, line=self.table.line(self.limits.points))
        self._close_scan()
        if self._dropped > len(self.table):
            what = f"{self._dropped} of {self._dropped + len(self.table)} rows are not like the others; is it a scan?"
            raise FormatError(self.path, what, line=self._first_dropped)

    def begin_scan(self, rows: int, line: int) -> None:
        """Note that a line declares how many rows follow it."""
        self._close_scan()
        self.scans += 1
        self._declared, self._declared_line = rows, line
        self._begun = len(self.table) + self._dropped

    def findings(self) -> tuple[Finding, ...]:
        """Return what was repaired or is worth saying."""
        found = []
        if self.scans > 1:
            message = f"{self.scans} scans in one file were joined; they must share one frame"
            found.append(Finding(Code.SCANS_JOINED, Level.INFO, message, str(self.path)))
        if self._dropped:
            message = f"{self._dropped} rows that are not like the others were dropped"
            where = f"{self.path}, line {self._first_dropped}"
            found.append(Finding(Code.ROWS_DROPPED, Level.WARN, message, where))
        if self._cut_line:
            found.append(last_line_cut(self.path, self._cut_line, recover=self.recover))
        if self._wrong_counts:
            line, message = self._wrong_counts[0]
            others = f" (and {len(self._wrong_counts) - 1} more)" if len(self._wrong_counts) > 1 else ""
            message += f"{others}; all were taken, the file may be cut short"
            found.append(Finding(Code.COUNT_REPLACED, Level.WARN, message, f"{self.path}, line {line}"))
        return tuple(found)

    def _parsed(self, stream: TextStream) -> Iterator[tuple[Block, list[FloatArray] | None]]:
        """Yield the blocks in their order, with their numbers where they leave no doubt; some are parsed ahead."""
        ahead: deque[tuple[Block, Future[list[FloatArray] | None]]] = deque()
        failed: FormatError | None = None
        more = True
        with ThreadPoolExecutor(_WORKERS) as pool:
            while more or ahead:
                try:
                    block = stream.take() if more else None
                except FormatError as error:  # comes after what may be wrong with the blocks before
                    block, failed = None, error
                more = block is not None
                if block is not None:
                    ahead.append((block, pool.submit(self._quick, block.text)))
                if ahead and (len(ahead) > _BLOCKS_AHEAD or not more):
                    first, found = ahead.popleft()
                    yield first, found.result()
        if failed is not None:
            raise failed

    def _without_cut_line(
        self, block: Block, columns: list[FloatArray] | None
    ) -> tuple[Block, list[FloatArray] | None]:
        """Return the last block without its last row, if that is to be repaired."""
        if not self.recover:
            return block, columns
        if columns is not None and len(columns[0]) == block.lines:
            columns = [column[:-1] for column in columns]
        return Block(block.text[: block.text.rfind(b"\n") + 1], block.line, block.byte, block.lines - 1), columns

    def _add(self, block: Block, columns: list[FloatArray] | None) -> None:
        if columns is not None and len(columns[0]) == block.lines:
            self.table.append(columns, block.line)
            return
        batch: list[Row] = []
        try:
            for row in all_rows(self.path, block, self.limits):
                if is_comment(row[1]):
                    continue
                if self.scans and COUNT.fullmatch(row[1]):
                    self._add_rows(batch)
                    batch = []
                    self.begin_scan(int(row[1]), row[0])
                else:
                    batch.append(row)
        finally:  # if the lines end in an error, what is wrong with those before it comes first
            self._add_rows(batch)

    def _quick(self, text: bytes) -> list[FloatArray] | None:
        if self._has_long_line(text):
            return None
        if self.dialect.trailing and self.dialect.delimiter:
            last = self.dialect.delimiter.encode("ascii")
            text = text.replace(b"\r\n", b"\n").replace(last + b"\n", b"\n").removesuffix(last)
        columns = quick_columns(text, self.width, delimiter=self.dialect.delimiter, decimal=self.dialect.mark)
        return None if columns is None else [columns[column] for column in self.used]

    def _has_long_line(self, text: bytes) -> bool:
        # A line beyond the limit covers at least one whole window of half the limit.
        window = max(1, self.limits.line_bytes // 2)
        return any(text.find(b"\n", begin, begin + window) < 0 for begin in range(0, len(text) - window, window))

    def _add_rows(self, batch: list[Row]) -> None:
        if not batch:
            return
        try:
            values, lines = self._numbers(batch)
        except FormatError as error:
            if not self.recover:
                raise FormatError(self.path, f"{error.what}; {_CURE}", line=error.line, byte=error.byte) from None
            good = [row for row in batch if self._is_good(row)]
            bad = {row[0] for row in batch} - {row[0] for row in good}
            self._first_dropped = self._first_dropped or min(bad)
            self._dropped += len(bad)
            values, lines = self._numbers(good)
        self.table.append(values.T, lines)

    def _numbers(self, batch: list[Row]) -> tuple[FloatArray, IntArray]:
        rows = batch if self.dialect.is_plain else [(row[0], self.dialect.plain(self.path, row)) for row in batch]
        all_used = len(self.used) == self.width
        values, lines = numbers(
            self.path,
            rows,
            self.width,
            finite=self.finite,
            delimiter=self.dialect.delimiter,
            used=None if all_used else self.used,
        )
        return values if all_used else np.ascontiguousarray(values[:, self.used]), lines

    def _is_good(self, row: Row) -> bool:
        try:
            words = cells(self.dialect.plain(self.path, row), self.dialect.delimiter)
        except FormatError:
            return False
        if len(words) != self.width or not all(NUMBER.fullmatch(words[column]) for column in self.used):
            return False
        return all(math.isfinite(float(words[column])) for column in self.finite)

    def _close_scan(self) -> None:
        present = len(self.table) + self._dropped - self._begun
        if self._declared is None or self._declared == present:
            return
        what = f"{self._declared} rows are declared, {present} present"
        if not self.recover:
            what += f"; the file is damaged or cut short; export it again, {_CURE}"
            raise FormatError(self.path, what, line=self._declared_line)
        self._wrong_counts.append((self._declared_line, what))
