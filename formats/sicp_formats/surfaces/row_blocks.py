"""Rows of numbers, a block at a time: of columns in memory, or of a file that never lies in memory as a whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_formats.source import LongFile

__all__ = ["BLOCK_ROWS", "ColumnsInMemory", "RowBlocks", "RowsInFile", "Scalars"]

Scalars: TypeAlias = Mapping[str, npt.NDArray[Any]]
"""(n,) numbers of any type by name."""

BLOCK_ROWS = 16384
"""Rows of a block, so that what is made of them stays in the cache."""


class RowBlocks(Protocol):
    """Rows that several threads may ask for, each for a part of them."""

    def __len__(self) -> int:
        """Return how many rows there are."""

    def blocks(self, begin: int, end: int) -> Iterator[Scalars]:
        """Yield the columns of the rows from `begin` to `end`, at most `BLOCK_ROWS` at a time.

        A block is only good until the next one is asked for.
        """


class ColumnsInMemory:
    """Rows of columns that are there as a whole."""

    def __init__(self, scalars: Scalars) -> None:
        self._scalars = scalars

    def __len__(self) -> int:
        return len(next(iter(self._scalars.values())))

    def blocks(self, begin: int, end: int) -> Iterator[Scalars]:
        """Yield views."""
        for first in range(begin, end, BLOCK_ROWS):
            rows = slice(first, min(first + BLOCK_ROWS, end))
            yield {name: values[rows] for name, values in self._scalars.items()}


class RowsInFile:
    """Rows of fixed size, one behind the other in a file.

    Parameters
    ----------
    file
        The file, which must have them all.
    begin
        The byte at which the first one begins.
    rows
        How many there are.
    row_type
        Type of a row.
    fields
        Its fields, by the name of their column.
    """

    def __init__(
        self, file: LongFile, begin: int, rows: int, row_type: np.dtype[Any], fields: Mapping[str, str]
    ) -> None:
        self._file, self._begin, self._rows = file, begin, rows
        self._row_type, self._fields = row_type, fields

    def __len__(self) -> int:
        return self._rows

    def blocks(self, begin: int, end: int) -> Iterator[Scalars]:
        """Read the rows.

        Raises
        ------
        FormatError
            If the file can no longer be read, or is not what it was.
        """
        size = self._row_type.itemsize
        for block in self._file.blocks(self._begin + begin * size, self._begin + end * size, BLOCK_ROWS * size):
            rows = np.frombuffer(block, self._row_type)
            yield {name: rows[field] for name, field in self._fields.items()}
