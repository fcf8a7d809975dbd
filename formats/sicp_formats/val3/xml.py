"""Parse the XML of VAL3 applications into elements that know their lines; nothing is expanded, nothing fetched."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_formats.paths.text import program_text
from sicp_formats.source import read_bytes

__all__ = ["Element", "parse_xml", "read_xml"]

_DECLARATION = re.compile(r"\s*<\?xml[^>]*\?>")
_DEEPEST = 32


@dataclass(slots=True)
class Element:
    """An element: its name without a prefix, attributes, children and text, with 1-based lines."""

    name: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    text_line: int = 0

    def all(self, *names: str) -> Iterator[Element]:
        """Yield this element and those within it that have one of the names, in the order of the file."""
        if self.name.lower() in names:
            yield self
        for child in self.children:
            yield from child.all(*names)


def read_xml(path: Path, limits: Limits) -> tuple[Element, bytes]:
    """Return the root of an XML file, and the bytes of the file.

    Raises
    ------
    FormatError
        If the file cannot be read, is not well-formed, is nested too deep, or defines entities.
    """
    content = read_bytes(path, limits)
    return parse_xml(path, content), content


def parse_xml(path: Path, content: bytes) -> Element:
    """Return the root of an XML file whose bytes are read already; errors as those of `read_xml`."""
    text = program_text(path, content)
    declared = text.find("<!DOCTYPE")
    if declared >= 0:
        raise FormatError(
            path, "has a DOCTYPE, which no VAL3 file has; take it out", line=text.count("\n", 0, declared) + 1
        )
    return _Tree(path).parse(text)


class _Tree:
    """Builds the elements as the parser meets them."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._open: list[Element] = []
        self._root: Element | None = None
        self._parser = parser = expat.ParserCreate("utf-8")
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters

    def parse(self, text: str) -> Element:
        # The text is decoded already, so that what the declaration says about its bytes does not hold any more.
        declaration = _DECLARATION.match(text)
        if declaration:
            text = "\n" * declaration[0].count("\n") + text[declaration.end() :]
        try:
            self._parser.Parse(text.encode("utf-8", "surrogatepass"), True)
        except expat.ExpatError as error:
            what = f"is no well-formed XML ({expat.ErrorString(error.code)}); copy it from the controller again"
            raise FormatError(self._path, what, line=error.lineno) from None
        if self._root is None:
            raise FormatError(self._path, "is no XML; is this a VAL3 file?", line=1)
        return self._root

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        element = Element(name.rpartition(":")[2], attributes, self._parser.CurrentLineNumber)
        if len(self._open) >= _DEEPEST:
            raise FormatError(self._path, "its elements are nested too deep; is this a VAL3 file?", line=element.line)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, name: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        element = self._open[-1]
        element.text_line = element.text_line or self._parser.CurrentLineNumber
        element.text.append(text)
