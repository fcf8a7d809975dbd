"""The header of a PCD file: what each point holds, how many there are, and how the data are written."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_formats.surfaces.unit import StatedUnit, unit_in

__all__ = ["PADDING", "Field", "Header", "parse_header"]

PADDING = "_"
"""Name of fields that only fill up the row."""

_KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
_VERSIONS = frozenset({"0.5", "0.6", "0.7", ".5", ".6", ".7"})
_ENCODINGS = ("ascii", "binary", "binary_compressed")
_TYPES = {f"{kind}{size}": f"{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)} | {"F4": "f4", "F8": "f8"}
_MOST_VALUES = 2**16
_WHOLE = re.compile(r"[0-9]{1,18}")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


@dataclass(frozen=True, slots=True)
class Field:
    """One value of a point, or `count` of them; `code` is the NumPy type."""

    name: str
    code: str
    count: int


@dataclass(frozen=True, slots=True)
class Header:
    """A parsed header.

    Parameters
    ----------
    fields
        In order of the file.
    points, height
        Points in all, and rows of an organised cloud; 1 if it is none.
    sensor
        Pose of the sensor: tx ty tz qw qx qy qz.
    encoding
        "ascii", "binary" or "binary_compressed".
    body_byte, body_line
        Where the data begin: 0-based offset, 1-based line.
    lines
        Line of each key.
    unit
        What a comment such as `# unit mm` says of the unit, None without one. The format itself has none.
    """

    fields: tuple[Field, ...]
    points: int
    height: int
    sensor: tuple[float, ...]
    encoding: str
    body_byte: int
    body_line: int
    lines: Mapping[str, int]
    unit: StatedUnit | None

    @property
    def row_bytes(self) -> int:
        """Bytes of one point in binary data."""
        return sum(np.dtype(each.code).itemsize * each.count for each in self.fields)

    def row_type(self) -> np.dtype[Any]:
        """Return the type of one point in binary data; the fields are named by their index."""
        return np.dtype([(str(index), f"<{each.code}", (each.count,)) for index, each in enumerate(self.fields)])


def parse_header(path: Path, content: bytes, limits: Limits) -> Header:
    """Parse the header at the beginning of a PCD file, of version 0.5 to 0.7.

    Raises
    ------
    FormatError
        With the line: no DATA, an unknown or repeated key, a missing one, an unknown version, type or encoding, lists
        of different lengths, or numbers of points that do not fit each other.
    """
    keys: dict[str, list[str]] = {}
    lines: dict[str, int] = {}
    unit: StatedUnit | None = None
    position, number = 3 if content.startswith(b"\xef\xbb\xbf") else 0, 0
    while "DATA" not in keys:
        end = content.find(b"\n", position, limits.header_bytes)
        number += 1
        _check_line(path, content, position, end, number, limits)
        raw = content[position : end if end >= 0 else len(content)]
        position = end + 1 if end >= 0 else len(content)
        text = raw.strip()
        if text.startswith(b"#"):
            unit = unit_in(path, text.lstrip(b"#").decode("utf-8", "replace"), number, unit)
        elif text:
            _take(path, text, number, keys, lines)
    return _header(path, keys, lines, position, number + 1, unit)


def _check_line(path: Path, content: bytes, position: int, end: int, number: int, limits: Limits) -> None:
    if number > limits.header_lines:
        what = f"the header exceeds the limit header_lines = {limits.header_lines}; is it a PCD file?"
        raise FormatError(path, what, line=number)
    if end < 0 and len(content) > limits.header_bytes:
        what = f"the header exceeds the limit header_bytes = {limits.header_bytes}; is it a PCD file?"
        raise FormatError(path, what, line=number)
    if position >= len(content):
        raise FormatError(path, "the header has no DATA line; the file is cut short or is no PCD file", line=number)


def _take(path: Path, text: bytes, number: int, keys: dict[str, list[str]], lines: dict[str, int]) -> None:
    words = [word.decode("utf-8", "replace") for word in text.split()]
    key = "FIELDS" if words[0] == "COLUMNS" else words[0]  # its name before version 0.6
    if key not in _KEYS:
        what = f"{words[0][:40]!r} is no key of a PCD header; the header is missing or damaged"
        raise FormatError(path, what, line=number)
    if key in keys:
        raise FormatError(path, f"a second {key} line; the header is damaged", line=number)
    keys[key], lines[key] = words[1:], number


def _header(
    path: Path,
    keys: Mapping[str, list[str]],
    lines: Mapping[str, int],
    position: int,
    body_line: int,
    unit: StatedUnit | None,
) -> Header:
    for key in ("FIELDS", "SIZE", "TYPE"):
        if key not in keys:
            raise FormatError(path, f"the header has no {key} line; export the file again", line=lines["DATA"])
    version = keys.get("VERSION", [".7"])
    if len(version) != 1 or version[0] not in _VERSIONS:
        shown = " ".join(version)[:40]
        raise FormatError(path, f"unknown version {shown!r}; versions 0.5 to 0.7 are read", line=lines["VERSION"])
    if len(keys["DATA"]) != 1 or keys["DATA"][0] not in _ENCODINGS:
        shown = " ".join(keys["DATA"])[:40]
        raise FormatError(path, f"unknown data {shown!r}; known are {', '.join(_ENCODINGS)}", line=lines["DATA"])
    points, height = _points(path, keys, lines)
    sensor = _sensor(path, keys, lines)
    fields = _fields(path, keys, lines)
    return Header(fields, points, height, sensor, keys["DATA"][0], position, body_line, lines, unit)


def _fields(path: Path, keys: Mapping[str, list[str]], lines: Mapping[str, int]) -> tuple[Field, ...]:
    names = keys["FIELDS"]
    if not names:
        raise FormatError(path, "no fields; export the file again", line=lines["FIELDS"])
    counts = keys.get("COUNT", ["1"] * len(names))
    for key, values in (("SIZE", keys["SIZE"]), ("TYPE", keys["TYPE"]), ("COUNT", counts)):
        if len(values) != len(names):
            what = f"{key} has {len(values)} values for {len(names)} fields; the header is damaged"
            raise FormatError(path, what, line=lines[key])
    fields: list[Field] = []
    for name, size, kind, count in zip(names, keys["SIZE"], keys["TYPE"], counts, strict=True):
        if kind + size not in _TYPES:
            what = f"field {name[:40]} has the type {kind[:9]} of size {size[:9]}; known are {', '.join(_TYPES)}"
            raise FormatError(path, what, line=lines["TYPE"])
        if not _WHOLE.fullmatch(count) or not 0 < int(count) <= _MOST_VALUES:
            what = f"field {name[:40]} has the count {count[:40]!r}, which is none; the header is damaged"
            raise FormatError(path, what, line=lines.get("COUNT", lines["FIELDS"]))
        if name != PADDING and any(each.name == name for each in fields):
            raise FormatError(path, f"field {name[:40]} is there twice; the header is damaged", line=lines["FIELDS"])
        fields.append(Field(name, _TYPES[kind + size], int(count)))
    if (in_all := sum(each.count for each in fields)) > _MOST_VALUES:
        what = f"{in_all} values a point are more than {_MOST_VALUES}; the header is damaged"
        raise FormatError(path, what, line=lines.get("COUNT", lines["FIELDS"]))
    return tuple(fields)


def _points(path: Path, keys: Mapping[str, list[str]], lines: Mapping[str, int]) -> tuple[int, int]:
    """Return the points in all, and the rows that they are organised in."""
    found = {key: _whole(path, key, keys[key], lines[key]) for key in ("WIDTH", "HEIGHT", "POINTS") if key in keys}
    if "POINTS" not in found and "WIDTH" not in found:
        what = "the header has neither POINTS nor WIDTH; export the file again"
        raise FormatError(path, what, line=lines["DATA"])
    height = found.get("HEIGHT", 1)
    width = found.get("WIDTH", found.get("POINTS", 0))
    points = found.get("POINTS", width * height)
    if width * height != points:
        what = f"WIDTH {width} x HEIGHT {height} are not POINTS {points}; the header is damaged"
        raise FormatError(path, what, line=lines["POINTS"])
    return points, height


def _whole(path: Path, key: str, values: list[str], line: int) -> int:
    if len(values) != 1 or not _WHOLE.fullmatch(values[0]):
        shown = " ".join(values)[:40]
        raise FormatError(path, f"{key} is {shown!r}, which is no count; the header is damaged", line=line)
    return int(values[0])


def _sensor(path: Path, keys: Mapping[str, list[str]], lines: Mapping[str, int]) -> tuple[float, ...]:
    values = keys.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"])
    if len(values) != 7 or not all(_NUMBER.fullmatch(value) for value in values):
        shown = " ".join(values)[:60]
        what = f"VIEWPOINT is {shown!r} instead of 7 numbers, tx ty tz qw qx qy qz; the header is damaged"
        raise FormatError(path, what, line=lines["VIEWPOINT"])
    return tuple(float(value) for value in values)
