"""The data of a PCD file, as text, as rows, or compressed field by field."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_formats.pcd.header import PADDING, Field, Header
from sicp_formats.pcd.lzf import decompress
from sicp_formats.surfaces.checks import Code, Place
from sicp_formats.surfaces.point_rows import OR_REPAIR
from sicp_formats.tables.body import TextBody

__all__ = ["read_rows"]

_SIZES = 8
"""Bytes of the two sizes before compressed data."""


def read_rows(
    path: Path, content: bytes, header: Header, limits: Limits, *, recover: bool = False
) -> tuple[Mapping[str, npt.NDArray[Any]], Place, tuple[Finding, ...]]:
    """Read the points; those that are there as a whole, to recover a file that is cut short.

    Returns
    -------
    values, place, findings
        (n,) numbers by the name of each field of one value, and where a point stands in the file.

    Raises
    ------
    FormatError
        With the line or byte: fewer points than declared, a row of the wrong width, a cell that is no number, or
        compressed data that are damaged.
    """
    if header.encoding == "ascii":
        return _text(path, content, header, limits, recover=recover)
    if header.encoding == "binary":
        return _rows(path, content, header, recover=recover)
    return _compressed(path, content, header)


def _text(
    path: Path, content: bytes, header: Header, limits: Limits, *, recover: bool
) -> tuple[Mapping[str, npt.NDArray[Any]], Place, tuple[Finding, ...]]:
    width, left = sum(each.count for each in header.fields), len(content) - header.body_byte
    line = header.lines.get("POINTS", header.lines.get("WIDTH", 1))
    if header.points * 2 * width > left + 1 and not recover:
        what = f"{header.points} points of {width} numbers are declared, {left} B present"
        raise FormatError(path, f"{what}; the file is cut short: copy it again{OR_REPAIR}", line=line)
    if recover and not content.endswith((b"\n", b"\r")):
        last = content.rfind(b"\n", header.body_byte) + 1
        if (
            sum(1 for _ in _body(path, content, header, limits).rows()) < header.points
            or len(content[last:].split()) < width
        ):
            content = content[:last]  # nobody knows how many digits of the last number are missing
    body = _body(path, content, header, limits)
    values, lines = body.table(header.points, width)
    findings = _missing(path, header, len(values), f"{path}, line {line}", line=line, recover=recover)
    if behind := [number for number, _ in body.rows()]:
        message = f"{len(behind)} more lines than the header declares; they were not read"
        findings += (Finding(Code.TRAILING_BYTES, Level.WARN, message, f"{path}, line {behind[0]}"),)
    found: dict[str, npt.NDArray[Any]] = {}
    column = 0
    for each in header.fields:
        if each.count == 1 and each.name != PADDING:
            found[each.name] = _as_packed(each, values[:, column])
        column += each.count
    return found, lambda row: {"line": int(lines[row])}, findings


def _body(path: Path, content: bytes, header: Header, limits: Limits) -> TextBody:
    return TextBody(path, content, limits, first_byte=header.body_byte, first_line=header.body_line)


def _as_packed(field: Field, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return packed colours in the four bytes that they have in binary files, other fields as they are."""
    if field.name not in ("rgb", "rgba") or np.dtype(field.code).itemsize != 4:
        return values
    with np.errstate(over="ignore", invalid="ignore"):
        if field.code == "f4":
            return values.astype("<f4")
        return values.astype(np.int64).astype("<u4")


def _rows(
    path: Path, content: bytes, header: Header, *, recover: bool
) -> tuple[Mapping[str, npt.NDArray[Any]], Place, tuple[Finding, ...]]:
    begin, size, count = header.body_byte, header.row_bytes, header.points
    left = len(content) - begin
    if count * size > left:
        what = f"{count} points x {size} B are declared, {left} B present; the file is cut short: copy it again"
        if not recover:
            raise FormatError(path, what + OR_REPAIR, byte=begin)
        count = left // size
    end = begin + count * size
    findings = _missing(path, header, count, f"{path}, byte {end}", line=0, recover=recover)
    if not findings:
        findings = _behind(path, content, end)
    rows = np.frombuffer(content, header.row_type(), count, begin)
    found = {
        each.name: rows[str(index)][:, 0]
        for index, each in enumerate(header.fields)
        if each.count == 1 and each.name != PADDING
    }
    return found, lambda row: {"byte": begin + row * size}, findings


def _missing(path: Path, header: Header, found: int, where: str, *, line: int, recover: bool) -> tuple[Finding, ...]:
    if found == header.points:
        return ()
    if not recover:
        what = f"{header.points} points are declared, {found} present; the file is cut short: copy it again{OR_REPAIR}"
        raise FormatError(path, what, line=line)
    message = f"{header.points} points are declared, only the first {found} are there"
    return (Finding(Code.ROWS_MISSING, Level.WARN, message, where),)


def _behind(path: Path, content: bytes, end: int) -> tuple[Finding, ...]:
    if end == len(content):
        return ()
    # The Point Cloud Library fills its last page with zeros.
    level = Level.WARN if content[end:].strip(b"\0") else Level.INFO
    message = f"{len(content) - end} more bytes than the header declares; they were not read"
    return (Finding(Code.TRAILING_BYTES, level, message, f"{path}, byte {end}"),)


def _compressed(
    path: Path, content: bytes, header: Header
) -> tuple[Mapping[str, npt.NDArray[Any]], Place, tuple[Finding, ...]]:
    begin = header.body_byte
    if len(content) - begin < _SIZES:
        raise FormatError(path, "the compressed data are missing; the file is cut short: copy it again", byte=begin)
    packed, unpacked = (int.from_bytes(content[begin + at : begin + at + 4], "little") for at in (0, 4))
    left = len(content) - begin - _SIZES
    if packed > left:
        what = f"{packed} B of compressed data are declared, {left} B present; the file is cut short: copy it again"
        raise FormatError(path, what, byte=begin)
    fields = _fields_in(path, header, unpacked)
    try:
        data = decompress(content[begin + _SIZES : begin + _SIZES + packed], unpacked)
    except ValueError as error:
        offset, what = error.args
        what = f"the compressed data are damaged: {what}; copy the file again"
        raise FormatError(path, what, byte=begin + _SIZES + offset) from None
    found: dict[str, npt.NDArray[Any]] = {}
    at = 0
    for each in fields:
        if each.count == 1 and each.name != PADDING:
            found[each.name] = np.frombuffer(data, f"<{each.code}", header.points, at)
        at += header.points * each.count * np.dtype(each.code).itemsize
    return found, lambda _: {"byte": begin}, _behind(path, content, begin + _SIZES + packed)


def _fields_in(path: Path, header: Header, unpacked: int) -> tuple[Field, ...]:
    """Return the fields of compressed data: the Point Cloud Library leaves padding out, others may not."""
    for fields in (header.fields, tuple(each for each in header.fields if each.name != PADDING)):
        if unpacked == header.points * sum(each.count * np.dtype(each.code).itemsize for each in fields):
            return fields
    what = (
        f"the compressed data declare {unpacked} B for {header.points} points x {header.row_bytes} B; the file is "
        "damaged: export it again"
    )
    raise FormatError(path, what, byte=header.body_byte + 4)
