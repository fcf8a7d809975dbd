"""The rows of one PLY element as columns, put together from blocks of rows that have lists of the same lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_cam.model import IntArray
from sicp_formats.ply.header import Element
from sicp_formats.surfaces.checks import Place
from sicp_formats.surfaces.row_blocks import RowBlocks, Scalars

__all__ = ["Block", "Table", "gather"]

Block: TypeAlias = tuple[IntArray | slice, Mapping[str, npt.NDArray[Any]]]
"""Which rows, and by property their values: (k,) for a scalar, (k, length) for a list."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The wanted columns of one element.

    Parameters
    ----------
    rows
        How many there are: fewer than declared where a file that is cut short is repaired.
    scalars
        (n,) by property, of any number type; views of the file where its rows are all alike, or its rows themselves
        where they are read later.
    lists
        By property: (n,) lengths, and all items one list behind the other.
    place
        Where each row stands in the file.
    """

    rows: int
    scalars: Scalars | RowBlocks
    lists: Mapping[str, tuple[IntArray, npt.NDArray[Any]]]
    place: Place


def gather(element: Element, rows: int, wanted: Sequence[str], blocks: Sequence[Block], place: Place) -> Table:
    """Put the blocks of an element of so many rows together in their order."""
    scalars: dict[str, npt.NDArray[Any]] = {}
    lists: dict[str, tuple[IntArray, npt.NDArray[Any]]] = {}
    for each in element.properties:
        if each.name not in wanted:
            continue
        parts = [(rows, columns[each.name]) for rows, columns in blocks]
        if each.count_code:
            lists[each.name] = _list_column(rows, parts)
        elif len(parts) == 1 and isinstance(parts[0][0], slice):
            scalars[each.name] = parts[0][1]
        else:
            scalars[each.name] = np.empty(rows, parts[0][1].dtype if parts else np.float64)
            for members, values in parts:
                scalars[each.name][members] = values
    return Table(rows, scalars, lists, place)


def _list_column(
    count: int, parts: Sequence[tuple[IntArray | slice, npt.NDArray[Any]]]
) -> tuple[IntArray, npt.NDArray[Any]]:
    lengths = np.zeros(count, np.int64)
    for rows, values in parts:
        lengths[rows] = values.shape[1]
    if len(parts) == 1:
        return lengths, parts[0][1].reshape(-1)
    begins = np.cumsum(lengths) - lengths
    items = np.zeros(int(lengths.sum()), np.result_type(*(values for _, values in parts)) if parts else np.int64)
    for rows, values in parts:
        items[begins[rows][:, None] + np.arange(values.shape[1])] = values
    return lengths, items
