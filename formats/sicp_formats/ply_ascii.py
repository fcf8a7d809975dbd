"""The text body of a PLY file: one row a line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.ply_header import Element
from sicp_formats.ply_table import Block, Table, gather
from sicp_formats.text_rows import Row, numbers

__all__ = ["read_element"]


def read_element(
    path: Path, rows: Iterator[Row], bytes_left: int, element: Element, wanted: Sequence[str], limits: Limits
) -> Table:
    """Read the rows of one element from the lines that follow.

    Raises
    ------
    FormatError
        With the line: fewer rows than declared, a row of the wrong width, a cell that is no number, a wanted value
        that is not finite, or a list length that is no count or beyond `limits.list_length`.
    """
    smallest = 2 * len(element.properties)  # a digit and a blank each
    if element.count * smallest > bytes_left + 1:
        what = (
            f"element {element.name} declares {element.count} rows of at least {smallest} B, {bytes_left} B present; "
            "the file is cut short"
        )
        raise FormatError(path, what, line=element.line)
    if not wanted:
        _check_found(path, element, sum(1 for _ in islice(rows, element.count)))
        return gather(element, (), [], lambda _: {})
    if any(each.count_code for each in element.properties):
        return _rows_with_lists(path, list(islice(rows, element.count)), element, wanted, limits)
    finite = [index for index, each in enumerate(element.properties) if each.name in wanted]
    values, lines = numbers(path, islice(rows, element.count), len(element.properties), finite=finite)
    _check_found(path, element, len(values))
    columns = {each.name: values[:, index] for index, each in enumerate(element.properties)}
    return gather(element, wanted, [(slice(None), columns)], lambda row: {"line": int(lines[row])})


def _check_found(path: Path, element: Element, found: int) -> None:
    if found < element.count:
        what = f"element {element.name} declares {element.count} rows, {found} present; the file is cut short"
        raise FormatError(path, what, line=element.line)


def _rows_with_lists(path: Path, batch: list[Row], element: Element, wanted: Sequence[str], limits: Limits) -> Table:
    _check_found(path, element, len(batch))
    widths: dict[int, list[int]] = {}
    for index, (_, text) in enumerate(batch):
        widths.setdefault(len(text.split()), []).append(index)
    blocks: list[Block] = []
    for width, members in widths.items():
        values, lines = numbers(path, (batch[index] for index in members), width, finite=())
        blocks += _alike(path, element, np.array(members), values, lines, limits)
    return gather(element, wanted, blocks, lambda row: {"line": batch[row][0]})


def _alike(
    path: Path, element: Element, rows: IntArray, values: FloatArray, lines: IntArray, limits: Limits
) -> Iterator[Block]:
    """Split rows of one width by the lengths of their lists, which may differ where a row has several."""
    while len(rows):
        columns, counts = _layout(path, element, values[0], int(lines[0]), limits)
        alike = (values[:, counts] == values[0, counts]).all(axis=1)
        block: dict[str, npt.NDArray[Any]] = {name: values[alike][:, cells] for name, cells in columns.items()}
        yield rows[alike], block
        rows, values, lines = rows[~alike], values[~alike], lines[~alike]


def _layout(
    path: Path, element: Element, row: FloatArray, line: int, limits: Limits
) -> tuple[dict[str, int | slice], list[int]]:
    """Return where each property stands in a row, and where the lengths of its lists stand."""
    columns: dict[str, int | slice] = {}
    counts: list[int] = []
    cell = 0
    for each in element.properties:
        if each.count_code is None:
            columns[each.name] = cell
            cell += 1
            continue
        length = row[cell] if cell < len(row) else 0
        if not (0 <= length <= limits.list_length and length == int(length)):
            what = f"list {each.name} has the length {length:g}, which is not possible or beyond list_length"
            raise FormatError(path, what, line=line)
        counts.append(cell)
        columns[each.name] = slice(cell + 1, cell + 1 + int(length))
        cell += 1 + int(length)
    if cell != len(row):
        what = f"the row of element {element.name} has {len(row)} columns instead of {cell}; the file is damaged"
        raise FormatError(path, what, line=line)
    return columns, counts
