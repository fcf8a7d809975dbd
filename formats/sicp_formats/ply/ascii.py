"""The text body of a PLY file: one row a line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray, IntArray
from sicp_formats.ply.header import Element, Header
from sicp_formats.ply.table import Block, Table, gather
from sicp_formats.surfaces.point_rows import OR_REPAIR
from sicp_formats.tables.body import TextBody
from sicp_formats.tables.rows import Row, numbers

__all__ = ["read_element", "text_body"]

_COMMENTS = (b"comment", b"obj_info", b"#")


def text_body(path: Path, content: bytes, header: Header, limits: Limits, *, recover: bool = False) -> TextBody:
    """Return the body of a text file, without the comments that some writers put between the rows.

    To recover a file that is cut short, its last line is left out if it has no end: nobody knows how many digits of
    its last number are missing.
    """
    place = {"first_byte": header.body_byte, "first_line": header.body_line}
    declared = sum(element.count for element in header.elements)
    if recover and not content.endswith((b"\n", b"\r")):
        rows = TextBody(path, content, limits, **place, comments=_COMMENTS).rows()
        last = max(content.rfind(b"\n"), content.rfind(b"\r")) + 1
        least = len(header.elements[-1].properties)
        if sum(1 for _ in rows) < declared or len(content[last:].split()) < least:
            content = content[:last]
    return TextBody(path, content, limits, **place, comments=_COMMENTS)


def read_element(
    path: Path,
    body: TextBody,
    bytes_left: int,
    element: Element,
    wanted: Sequence[str],
    limits: Limits,
    *,
    recover: bool = False,
) -> Table:
    """Read the rows of one element from the lines that follow; those that are there, to recover a file cut short.

    Raises
    ------
    FormatError
        With the line: fewer rows than declared, a row of the wrong width, a cell that is no number, or a list length
        that is no count or beyond `limits.list_length`.
    """
    smallest = 2 * len(element.properties)  # a digit and a blank each
    if element.count * smallest > bytes_left + 1 and not recover:
        what = (
            f"element {element.name} declares {element.count} rows of at least {smallest} B, {bytes_left} B present; "
            f"the file is cut short: copy it again{OR_REPAIR}"
        )
        raise FormatError(path, what, line=element.line)
    if not wanted:
        found = sum(1 for _ in body.rows(element.count))
        _check_found(path, element, found, recover)
        return gather(element, found, (), [], lambda _: {})
    if any(each.count_code for each in element.properties):
        batch = list(body.rows(element.count))
        _check_found(path, element, len(batch), recover)
        return _rows_with_lists(path, batch, element, wanted, limits)
    values, lines = body.table(element.count, len(element.properties))
    _check_found(path, element, len(values), recover)
    columns = {each.name: values[:, index] for index, each in enumerate(element.properties)}
    return gather(element, len(values), wanted, [(slice(None), columns)], lambda row: {"line": int(lines[row])})


def _check_found(path: Path, element: Element, found: int, recover: bool) -> None:
    if found < element.count and not recover:
        what = (
            f"element {element.name} declares {element.count} rows, {found} present; the file is cut short: "
            f"copy it again{OR_REPAIR}"
        )
        raise FormatError(path, what, line=element.line)


def _rows_with_lists(path: Path, batch: list[Row], element: Element, wanted: Sequence[str], limits: Limits) -> Table:
    widths: dict[int, list[int]] = {}
    for index, (_, text) in enumerate(batch):
        widths.setdefault(len(text.split()), []).append(index)
    blocks: list[Block] = []
    for width, members in widths.items():
        values, lines = numbers(path, (batch[index] for index in members), width, finite=())
        blocks += _alike(path, element, np.array(members), values, lines, limits)
    return gather(element, len(batch), wanted, blocks, lambda row: {"line": batch[row][0]})


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
