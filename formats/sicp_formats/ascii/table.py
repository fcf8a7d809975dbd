"""The rows of a table of numbers, gathered in large pieces that are given back as soon as they are used up.

While the rows come in, it is not known how many there are; in the end they become arrays of their own. Pieces of many
megabytes go back to the system one by one, so that the numbers are never in memory twice.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import chain

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["Table"]

_PIECE_BYTES = 2**26  # larger than any allocator keeps for itself
_FIRST_ROWS = 1000


class Table:
    """Rows of `width` numbers, each with the line that it stands in.

    Parameters
    ----------
    width
        Numbers in each row.
    """

    def __init__(self, width: int) -> None:
        self.width = width
        self._rows = 0
        self._pieces: list[FloatArray] = []
        self._free = 0
        self._starts: list[int] = []
        self._lines: list[int | IntArray] = []

    def __len__(self) -> int:
        return self._rows

    def append(self, values: FloatArray, lines: int | IntArray) -> None:
        """Add rows, and their lines: those of each row, or the first where each row is the next line."""
        self._starts.append(self._rows)
        self._lines.append(lines)
        self._rows += len(values)
        while len(values):
            if not self._free:
                self._free = max(1, _PIECE_BYTES // (8 * self.width))
                self._pieces.append(np.empty((self._free, self.width), order="F"))
            piece = self._pieces[-1]
            count = min(self._free, len(values))
            begin = len(piece) - self._free
            piece[begin : begin + count] = values[:count]  # both by columns, as the parser leaves them
            values = values[count:]
            self._free -= count

    def line(self, row: int) -> int:
        """Return the line that a row stands in."""
        at = bisect_right(self._starts, row) - 1
        lines, offset = self._lines[at], row - self._starts[at]
        return lines + offset if isinstance(lines, int) else int(lines[offset])

    def pieces(self) -> Iterator[FloatArray]:
        """Yield the rows, some at a time."""
        left = self._rows
        for piece in self._pieces:
            yield piece[:left]
            left -= len(piece)

    def every(self, columns: slice, test: Callable[[FloatArray], BoolArray]) -> bool:
        """Tell whether the numbers of some columns pass a test in every row."""
        first = (piece[:_FIRST_ROWS] for piece in self.pieces())  # settles most of what does not pass
        return all(bool(test(piece[:, columns]).all()) for piece in chain(first, self.pieces()))

    def share(self, columns: slice, test: Callable[[FloatArray], BoolArray]) -> float:
        """Return the share of rows whose numbers in some columns pass a test."""
        passed = sum(int(np.count_nonzero(test(piece[:, columns]))) for piece in self.pieces())
        return passed / max(1, self._rows)

    def empty_into(self, groups: Sequence[int | Sequence[int]]) -> list[FloatArray]:
        """Move columns into arrays of their own: (n,) for one, (n, k) for a group; the table is empty afterwards."""
        shapes = [(self._rows,) if isinstance(group, int) else (self._rows, len(group)) for group in groups]
        found = [np.empty(shape) for shape in shapes]
        begin = 0
        self._pieces.reverse()
        while self._pieces:
            piece = self._pieces.pop()[: self._rows - begin]
            for array, group in zip(found, groups, strict=True):
                target = array[begin : begin + len(piece)]
                if isinstance(group, int):
                    target[:] = piece[:, group]
                else:
                    for place, column in enumerate(group):
                        target[:, place] = piece[:, column]
            begin += len(piece)
        return found
