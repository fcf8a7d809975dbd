"""The binary body of a PLY file."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import IntArray
from sicp_formats.ply_header import Element
from sicp_formats.ply_table import Block, Table, gather

__all__ = ["read_element"]


def read_element(
    path: Path,
    content: bytes,
    begin: int,
    element: Element,
    byte_order: str,
    wanted: Sequence[str],
    limits: Limits,
) -> tuple[Table, int]:
    """Read the rows of one element.

    Returns
    -------
    Table, int
        The wanted columns, and the offset behind the last row.

    Raises
    ------
    FormatError
        With the byte: the declared rows do not fit into what is left, or a list is longer than that, of negative
        length, or (in an element of which something is wanted) longer than `limits.list_length`.
    """
    smallest = sum(np.dtype(each.count_code or each.code).itemsize for each in element.properties)
    left = len(content) - begin
    if element.count * smallest > left:
        what = (
            f"element {element.name} declares {element.count} x {smallest} B, {left} B present; the file is cut short"
        )
        raise FormatError(path, what, byte=begin)
    if element.count == 0:
        return gather(element, wanted, [], lambda _: {"byte": begin}), begin
    if all(each.count_code is None for each in element.properties):
        return _equal_rows(content, begin, element, _row_type(element, byte_order, ()), wanted)
    walk = _Walk(path, content, element, byte_order, limits.list_length if wanted else len(content))
    if wanted:
        lengths, _ = walk.row(begin, 0)
        row_type = _row_type(element, byte_order, lengths)
        if element.count * row_type.itemsize <= left and _all_alike(content, begin, element, row_type, lengths):
            return _equal_rows(content, begin, element, row_type, wanted)
    return _differing_rows(content, begin, element, byte_order, wanted, walk)


class _Walk:
    """Steps from row to row where only the lists themselves tell where they end."""

    def __init__(self, path: Path, content: bytes, element: Element, byte_order: str, longest: int) -> None:
        self.path, self.content, self.element, self.longest = path, content, element, longest
        self.lists: list[tuple[int, struct.Struct, int]] = []
        fixed = 0
        for each in element.properties:
            size = np.dtype(each.code).itemsize
            if each.count_code:
                count = struct.Struct((byte_order or "=") + np.dtype(each.count_code).char)
                self.lists.append((fixed, count, size))
                fixed = 0
            else:
                fixed += size
        self.fixed_at_end = fixed

    def row(self, begin: int, row: int) -> tuple[tuple[int, ...], int]:
        """Return the lengths of a row's lists, and the offset behind the row."""
        end, lengths = begin, []
        for fixed, count, size in self.lists:
            end += fixed
            if end + count.size > len(self.content):
                raise self._error(begin, row, "the file is cut short")
            (length,) = count.unpack_from(self.content, end)
            if not 0 <= length <= self.longest:
                raise self._error(begin, row, f"a list of length {length} is not possible or beyond list_length")
            lengths.append(length)
            end += count.size + length * size
        end += self.fixed_at_end
        if end > len(self.content):
            raise self._error(begin, row, f"it ends at byte {end}, {len(self.content)} B present")
        return tuple(lengths), end

    def _error(self, begin: int, row: int, what: str) -> FormatError:
        return FormatError(self.path, f"row {row} of element {self.element.name}: {what}", byte=begin)


def _row_type(element: Element, byte_order: str, lengths: Sequence[int]) -> np.dtype[Any]:
    left = list(lengths)
    fields: list[Any] = []
    for index, each in enumerate(element.properties):
        if each.count_code:
            fields.append((f"count{index}", byte_order + each.count_code))
            fields.append((f"value{index}", byte_order + each.code, (left.pop(0),)))
        else:
            fields.append((f"value{index}", byte_order + each.code))
    return np.dtype(fields)


def _all_alike(content: bytes, begin: int, element: Element, row_type: np.dtype[Any], lengths: Sequence[int]) -> bool:
    rows = np.frombuffer(content, row_type, element.count, begin)
    counts = [f"count{index}" for index, each in enumerate(element.properties) if each.count_code]
    return all(bool((rows[name] == length).all()) for name, length in zip(counts, lengths, strict=True))


def _equal_rows(
    content: bytes, begin: int, element: Element, row_type: np.dtype[Any], wanted: Sequence[str]
) -> tuple[Table, int]:
    size = row_type.itemsize
    rows = np.frombuffer(content, row_type, element.count, begin)
    table = gather(element, wanted, [(slice(None), _columns(element, rows))], lambda row: {"byte": begin + row * size})
    return table, begin + element.count * size


def _differing_rows(
    content: bytes, begin: int, element: Element, byte_order: str, wanted: Sequence[str], walk: _Walk
) -> tuple[Table, int]:
    begins = np.zeros(element.count, np.int64)
    lengths = np.zeros((element.count, len(walk.lists)), np.int64)
    end = begin
    for row in range(element.count):
        begins[row] = end
        lengths[row], end = walk.row(end, row)
    blocks = _blocks(content, element, byte_order, begins, lengths) if wanted else []
    return gather(element, wanted if blocks else (), blocks, lambda row: {"byte": int(begins[row])}), end


def _blocks(content: bytes, element: Element, byte_order: str, begins: IntArray, lengths: IntArray) -> list[Block]:
    data = np.frombuffer(content, np.uint8)
    kinds, kind, sizes = np.unique(lengths, axis=0, return_inverse=True, return_counts=True)
    members = np.split(np.argsort(kind.reshape(-1), kind="stable"), np.cumsum(sizes)[:-1])
    blocks: list[Block] = []
    for each, rows in zip(kinds, members, strict=True):
        row_type = _row_type(element, byte_order, each.tolist())
        raw = data[begins[rows][:, None] + np.arange(row_type.itemsize)]
        blocks.append((rows, _columns(element, raw.view(row_type)[:, 0])))
    return blocks


def _columns(element: Element, rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    return {each.name: rows[f"value{index}"] for index, each in enumerate(element.properties)}
