"""The rows of a table of numbers, gathered in large pieces that are given back as soon as they are used up.

While the rows come in, it is not known how many there are; in the end they become arrays of their own. Pieces of many
megabytes go back to the system one by one, so that the numbers are never in memory twice.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from threading import Lock

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, IntArray
from sicp_formats.surfaces.point_rows import PointNames
from sicp_formats.surfaces.row_blocks import BLOCK_ROWS, RowBlocks, Scalars

__all__ = ["Table", "places"]

_PIECE_BYTES = 5 * 2**23  # larger than any allocator keeps for itself
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

    def append(self, columns: Sequence[FloatArray] | FloatArray, lines: int | IntArray) -> None:
        """Add rows, and their lines.

        Parameters
        ----------
        columns
            (width, n) numbers: those of each column together, as the parser leaves them.
        lines
            (n,) lines of the rows, or that of the first where each row is the next line.
        """
        self._starts.append(self._rows)
        self._lines.append(lines)
        done, rows = 0, len(columns[0])
        self._rows += rows
        while done < rows:
            if not self._free:
                self._free = max(1, _PIECE_BYTES // (8 * self.width))
                self._pieces.append(np.empty((self._free, self.width), order="F"))
            piece = self._pieces[-1]
            begin, count = len(piece) - self._free, min(self._free, rows - done)
            for place, column in enumerate(columns):
                piece[begin : begin + count, place] = column[done : done + count]
            done += count
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

    def emptied(self) -> RowBlocks:
        """Return the rows, their columns named by their number; the table has only the lines afterwards.

        They can be asked for once: a piece is given back as soon as all of its rows have been used.
        """
        pieces, self._pieces, self._free = [*self.pieces()], [], 0
        return _Pieces(pieces)


def places(xyz: Sequence[int], normal: Sequence[int], further: Sequence[int]) -> PointNames:
    """Return columns, of which some may have no normal, as `Table.emptied` names them.

    >>> places((0, 1, 2), (), (3,))
    PointNames(xyz=('0', '1', '2'), normal=(None, None, None), further=('3',))
    """
    return PointNames(tuple(map(str, xyz)), tuple(map(str, normal)) or (None,) * 3, tuple(map(str, further)))


class _Pieces:
    """Rows in pieces, each of them dropped behind its last row."""

    def __init__(self, pieces: list[FloatArray]) -> None:
        self._pieces: list[FloatArray | None] = [*pieces]
        self._ends = np.cumsum([0, *map(len, pieces)]).tolist()
        self._left = [len(piece) for piece in pieces]
        self._lock = Lock()

    def __len__(self) -> int:
        return int(self._ends[-1])

    def blocks(self, begin: int, end: int) -> Iterator[Scalars]:
        """Yield views of the rows from `begin` to `end`."""
        while begin < end:
            number = bisect_right(self._ends, begin) - 1
            piece, first = self._pieces[number], self._ends[number]
            last = min(end, self._ends[number + 1], begin + BLOCK_ROWS)
            if piece is not None:
                yield {str(column): piece[begin - first : last - first, column] for column in range(piece.shape[1])}
            piece = None
            self._give_back(number, last - begin)
            begin = last

    def _give_back(self, number: int, rows: int) -> None:
        with self._lock:
            self._left[number] -= rows
            if not self._left[number]:
                self._pieces[number] = None
