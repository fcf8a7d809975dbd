"""The header of a PLY file: which elements follow, how many, and what each row holds."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_formats.surfaces.unit import StatedUnit, unit_in

__all__ = ["ELEMENT_CODES", "Element", "Header", "Property", "parse_header"]

ELEMENT_CODES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
"""NumPy type code, without byte order, of each PLY type name."""

_ENCODINGS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_COUNT = re.compile(rb"[0-9]{1,20}")


@dataclass(frozen=True, slots=True)
class Property:
    """One value of a row, or a list of them if `count_code` is set; codes as in `ELEMENT_CODES`."""

    name: str
    code: str
    count_code: str | None = None


@dataclass(frozen=True, slots=True)
class Element:
    """A table in the body: name, declared rows, properties in order, and the header line that declares it."""

    name: str
    count: int
    properties: tuple[Property, ...]
    line: int

    def __contains__(self, name: str) -> bool:
        return any(each.name == name for each in self.properties)


@dataclass(frozen=True, slots=True)
class Header:
    """A parsed header.

    Parameters
    ----------
    byte_order
        "<", ">", or "" where the body is text.
    elements
        In the order of the body.
    body_byte, body_line
        Where the body begins: 0-based offset, 1-based line.
    unit
        What a comment such as `comment unit mm` says of the unit, None without one. The format itself has none.
    """

    byte_order: str
    elements: tuple[Element, ...]
    body_byte: int
    body_line: int
    unit: StatedUnit | None = None


def parse_header(path: Path, content: bytes, limits: Limits) -> Header:
    """Parse the header at the beginning of a PLY file.

    Raises
    ------
    FormatError
        With the line: no `ply` or `end_header`, too long, an unknown keyword, encoding, version or type, a count
        that is none, anything declared twice, a property outside an element, an element without properties.
    """
    byte_order: str | None = None
    elements: list[Element] = []
    unit: StatedUnit | None = None
    lines = _header_lines(path, content, limits)
    for number, words, end in lines:
        match words:
            case [b"comment" | b"obj_info", *comment]:
                unit = unit_in(path, _text(b" ".join(comment)), number, unit)
            case []:
                continue
            case [b"end_header"]:
                if byte_order is None:
                    raise FormatError(path, "the header has no format line; export the file again", line=number)
                _check_elements(path, elements)
                return Header(byte_order, tuple(elements), end, number + 1, unit)
            case [b"format", encoding, version]:
                if byte_order is not None:
                    raise FormatError(path, "a second format line; the header is damaged", line=number)
                byte_order = _byte_order(path, encoding, version, number)
            case [b"element", name, count]:
                elements.append(_element(path, name, count, number, elements))
            case [b"property", *words]:
                if not elements:
                    raise FormatError(path, "a property before any element; the header is damaged", line=number)
                elements[-1] = _with_property(path, elements[-1], words, number)
            case _:
                shown = b" ".join(words).decode("latin-1")
                raise FormatError(path, f"{shown!r} is no line of a PLY header; the header is damaged", line=number)
    raise FormatError(path, "the header has no end_header; the file is cut short or is no PLY file", byte=len(content))


def _header_lines(path: Path, content: bytes, limits: Limits) -> Iterator[tuple[int, list[bytes], int]]:
    """Yield line number, words, and the offset behind the line, from the line after `ply` on."""
    begin = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    magic = re.compile(rb"ply[ \t]*(\r\n|\n|\r|$)").match(content, begin)
    if not magic:
        raise FormatError(path, "does not begin with 'ply' and is no PLY file; check its suffix", byte=0)
    # Files with bare CR exist; a payload may begin with LF, so exactly one kind of line end counts.
    line_end = b"\r" if magic[1] == b"\r" else b"\n"
    position = magic.end()
    for number in range(2, limits.header_lines + 2):
        end = content.find(line_end, position, limits.header_bytes)
        if end < 0 and len(content) > limits.header_bytes:
            what = f"the header exceeds the limit header_bytes = {limits.header_bytes}; is it a PLY file?"
            raise FormatError(path, what, line=number)
        if end < 0:
            rest = content[position:]
            if rest.strip() == b"end_header":
                yield number, [b"end_header"], len(content)
            return
        yield number, content[position:end].split(), end + 1
        position = end + 1
    what = f"the header exceeds the limit header_lines = {limits.header_lines}; is it a PLY file?"
    raise FormatError(path, what, line=limits.header_lines + 1)


def _byte_order(path: Path, encoding: bytes, version: bytes, line: int) -> str:
    if encoding not in _ENCODINGS or version != b"1.0":
        shown = (encoding + b" " + version).decode("latin-1")
        what = f"unknown format {shown!r}; use ascii, binary_little_endian or binary_big_endian with version 1.0"
        raise FormatError(path, what, line=line)
    return _ENCODINGS[encoding]


def _element(path: Path, name: bytes, count: bytes, line: int, elements: list[Element]) -> Element:
    shown = name.decode("latin-1")
    if not _COUNT.fullmatch(count):
        what = (
            f"element {shown} declares {count[:40].decode('latin-1')!r} rows, which is no count; the header is damaged"
        )
        raise FormatError(path, what, line=line)
    if any(element.name == shown for element in elements):
        raise FormatError(path, f"element {shown} is declared twice; the header is damaged", line=line)
    return Element(shown, int(count), (), line)


def _with_property(path: Path, element: Element, words: list[bytes], line: int) -> Element:
    match [_text(word) for word in words]:
        case ["list", count_type, item_type, name]:
            count_code = _code(path, count_type, line)
            if count_code.startswith("f"):
                what = f"the length of list {name} has type {count_type}; it must be an integer type"
                raise FormatError(path, what, line=line)
            added = Property(name, _code(path, item_type, line), count_code)
        case [type_name, name] if type_name != "list":
            added = Property(name, _code(path, type_name, line))
        case _:
            raise FormatError(path, "a property needs a type and a name; the header is damaged", line=line)
    if added.name in element:
        what = f"property {added.name} of element {element.name} is declared twice; the header is damaged"
        raise FormatError(path, what, line=line)
    return Element(element.name, element.count, (*element.properties, added), element.line)


def _text(word: bytes) -> str:
    try:
        return word.decode("utf-8")
    except UnicodeDecodeError:
        return word.decode("latin-1")


def _code(path: Path, type_name: str, line: int) -> str:
    if type_name not in ELEMENT_CODES:
        raise FormatError(path, f"unknown type {type_name!r}; known are {', '.join(ELEMENT_CODES)}", line=line)
    return ELEMENT_CODES[type_name]


def _check_elements(path: Path, elements: list[Element]) -> None:
    for element in elements:
        if not element.properties:
            what = f"element {element.name} has no properties; the header is damaged"
            raise FormatError(path, what, line=element.line)
