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
from sicp_formats.ply.header import Element
from sicp_formats.ply.table import Block, Table, gather
from sicp_formats.source import LongFile
from sicp_formats.surfaces.point_rows import OR_REPAIR
from sicp_formats.surfaces.row_blocks import RowsInFile

__all__ = ["read_element"]


def read_element(
    path: Path,
    content: bytes | LongFile,
    begin: int,
    element: Element,
    byte_order: str,
    wanted: Sequence[str],
    limits: Limits,
    *,
    recover: bool = False,
    last: bool = True,
) -> tuple[Table, int]:
    """Read the rows of one element; those that are there as a whole, to recover a file that is cut short.

    Only the `last` element with rows is recovered: where others follow, their rows would be taken for those missing.

    Rows of a fixed size are left in a long file until they are needed; to find others, it is read as a whole.

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
    left, count = len(content) - begin, element.count
    recover = recover and last
    if count * smallest > left:
        if not recover:
            what = (
                f"element {element.name} declares {count} x {smallest} B, {left} B present; the file is cut short: "
                f"copy it again{OR_REPAIR if last else ''}"
            )
            raise FormatError(path, what, byte=begin)
        count = left // smallest
    if count == 0:
        return gather(element, 0, wanted, [], lambda _: {"byte": begin}), begin
    if all(each.count_code is None for each in element.properties):
        row_type = _row_type(element, byte_order, ())
        if isinstance(content, LongFile):
            return _rows_in_file(content, begin, count, element, row_type, wanted)
        return _equal_rows(content, begin, count, element, row_type, wanted)
    content = content.whole() if isinstance(content, LongFile) else content
    walk = _Walk(path, content, element, byte_order, limits.list_length if wanted else len(content))
    if wanted and (common_type := walk.common_type(begin)) is not None:
        whole = min(count, left // common_type.itemsize)
        cut = recover and whole < count and walk.cut_at(begin + whole * common_type.itemsize)
        if (whole == count or cut) and _all_alike(content, begin, whole, element, common_type):
            return _equal_rows(content, begin, whole, element, common_type, wanted)
    return _differing_rows(begin, count, element, wanted, walk, recover=recover)


class _CutShortError(FormatError):
    """The file ends in the middle of a row."""


class _Walk:
    """Steps from row to row where only the lists themselves tell where they end."""

    def __init__(self, path: Path, content: bytes, element: Element, byte_order: str, longest: int) -> None:
        self.path, self.content, self.element, self.longest = path, content, element, longest
        self.byte_order = byte_order
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
                raise self._cut_short(begin, row, "the file is cut short")
            (length,) = count.unpack_from(self.content, end)
            if not 0 <= length <= self.longest:
                what = f"row {row} of element {self.element.name}: a list of length {length} is not possible or "
                raise FormatError(self.path, f"{what}beyond the limit list_length = {self.longest}", byte=begin)
            lengths.append(length)
            end += count.size + length * size
        end += self.fixed_at_end
        if end > len(self.content):
            raise self._cut_short(begin, row, f"it ends at byte {end}, {len(self.content)} B present")
        return tuple(lengths), end

    def common_type(self, begin: int) -> np.dtype[Any] | None:
        """Return the type of all rows if they are like the first, None if that is not there as a whole."""
        try:
            lengths, _ = self.row(begin, 0)
        except _CutShortError:
            return None
        return _row_type(self.element, self.byte_order, lengths)

    def cut_at(self, begin: int) -> bool:
        """Tell whether the file ends before the row that begins there does."""
        try:
            self.row(begin, 0)
        except FormatError as error:
            return isinstance(error, _CutShortError)
        return False

    def _cut_short(self, begin: int, row: int, what: str) -> _CutShortError:
        what = f"row {row} of element {self.element.name}: {what}; copy the file again{OR_REPAIR}"
        return _CutShortError(self.path, what, byte=begin)


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


def _all_alike(content: bytes, begin: int, count: int, element: Element, row_type: np.dtype[Any]) -> bool:
    rows = np.frombuffer(content, row_type, count, begin)
    counts = [f"count{index}" for index, each in enumerate(element.properties) if each.count_code]
    return all(bool((rows[name] == rows[name][0]).all()) for name in counts)


def _equal_rows(
    content: bytes, begin: int, count: int, element: Element, row_type: np.dtype[Any], wanted: Sequence[str]
) -> tuple[Table, int]:
    size = row_type.itemsize
    blocks: list[Block] = [(slice(None), _columns(element, np.frombuffer(content, row_type, count, begin)))]
    return gather(element, count, wanted, blocks, lambda row: {"byte": begin + row * size}), begin + count * size


def _rows_in_file(
    file: LongFile, begin: int, count: int, element: Element, row_type: np.dtype[Any], wanted: Sequence[str]
) -> tuple[Table, int]:
    size = row_type.itemsize
    fields = {each.name: f"value{index}" for index, each in enumerate(element.properties) if each.name in wanted}
    rows = RowsInFile(file, begin, count, row_type, fields)
    return Table(count, rows, {}, lambda row: {"byte": begin + row * size}), begin + count * size


def _differing_rows(
    begin: int, count: int, element: Element, wanted: Sequence[str], walk: _Walk, *, recover: bool
) -> tuple[Table, int]:
    begins = np.zeros(count, np.int64)
    lengths = np.zeros((count, len(walk.lists)), np.int64)
    end, found = begin, count
    for row in range(count):
        begins[row] = end
        try:
            lengths[row], end = walk.row(end, row)
        except _CutShortError:
            if not recover:
                raise
            found = row
            break
    blocks = _blocks(walk, begins[:found], lengths[:found]) if wanted else []
    return gather(element, found, wanted, blocks, lambda row: {"byte": int(begins[row])}), end


def _blocks(walk: _Walk, begins: IntArray, lengths: IntArray) -> list[Block]:
    if not len(begins):
        return []
    data = np.frombuffer(walk.content, np.uint8)
    kinds, kind, sizes = np.unique(lengths, axis=0, return_inverse=True, return_counts=True)
    members = np.split(np.argsort(kind.reshape(-1), kind="stable"), np.cumsum(sizes)[:-1])
    blocks: list[Block] = []
    for each, rows in zip(kinds, members, strict=True):
        row_type = _row_type(walk.element, walk.byte_order, each.tolist())
        raw = data[begins[rows][:, None] + np.arange(row_type.itemsize)]
        blocks.append((rows, _columns(walk.element, raw.view(row_type)[:, 0])))
    return blocks


def _columns(element: Element, rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    return {each.name: rows[f"value{index}"] for index, each in enumerate(element.properties)}
