"""The files of a VAL3 application as XML: what the dialects share, and that of s7, for CS8C from s7.0 on and CS9.

UTF-8 with byte order mark and CRLF, as the manufacturer's own tool writes it.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from sicp_cam.errors import OutputError, printable

__all__ = ["S7", "Dialect", "Variable", "document", "element", "escaped"]

_SCHEMA = "http://www.staubli.com/robotics/VAL3"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"}
_IN_TEXT = str.maketrans(_ESCAPES)
_IN_ATTRIBUTE = str.maketrans(_ESCAPES | {"\t": "&#9;", "\n": "&#10;", "\r": "&#13;"})
_PLAIN = bytes(range(0x20, 0x7F)) + b"\t\r\n"
_STACK = "5000"


@dataclass(frozen=True, slots=True)
class Variable:
    """A global variable: its name, its VAL3 type, and the attributes of each element of its array, or their lines."""

    name: str
    type: str
    values: Sequence[Mapping[str, str]] = ()
    lines: Sequence[str] = ()
    """The elements as XML already, by a template of the dialect, for arrays that are long."""
    father: str = ""
    """The frame that such lines stand in; `values` hold it themselves."""


class Dialect(ABC):
    """How the files of an application are written."""

    version: ClassVar[str]
    """What the project says it was written for, unless the user says otherwise."""
    linked_in_code: ClassVar[bool]
    """True: outputs are linked by a statement; False: by the data."""
    blend: ClassVar[str] = "Cartesian"
    """Word of points that are run through."""

    @abstractmethod
    def project_file(self, version: str, programs: Iterable[str], data: str) -> bytes:
        """Return the .pjx that lists the program files and the data file."""

    @abstractmethod
    def data_file(self, variables: Iterable[Variable]) -> bytes:
        """Return the .dtx that declares the global variables."""

    @abstractmethod
    def program_file(self, name: str, code: Sequence[str]) -> bytes:
        """Return the .pgx of one program without parameters; `code` stands between begin and end.

        Raises
        ------
        OutputError
            If the code holds what XML cannot carry.
        """

    @abstractmethod
    def point_row(self, numbers: Sequence[str], configuration: Mapping[str, str], father: str) -> str:
        """Return the template of a line of an array of points: fields for its index and the six `numbers`."""

    @abstractmethod
    def speed_row(self, attributes: Mapping[str, str]) -> str:
        """Return the template of a line of an array of speeds: a field for its index, and those in `attributes`."""

    @abstractmethod
    def number_row(self) -> str:
        """Return the template of a line of an array of numbers: fields for its index and its value."""


class S7(Dialect):
    """The dialect of s7 and s8, whose namespaces are the same."""

    version = "s7.10.2"
    linked_in_code = False

    def project_file(self, version: str, programs: Iterable[str], data: str) -> bytes:
        """Return the .pjx that lists the program files and the data file."""
        content = [
            *element("Parameters", {"version": version, "stackSize": _STACK, "millimeterUnit": "true"}),
            *element("Programs", {}, [line for file in programs for line in element("Program", {"file": file})]),
            *element("Database", {}, element("Data", {"file": data})),
            *element("Libraries", {}),
        ]
        return document(element("Project", {"xmlns": f"{_SCHEMA}/Project/3"}, content))

    def data_file(self, variables: Iterable[Variable]) -> bytes:
        """Return the .dtx that declares the global variables."""
        root = f'<Database xmlns:xsi="{_XSI}" xmlns="{_SCHEMA}/Data/2">'
        datas = [line for variable in variables for line in _data(variable)]
        return document([root, "  <Datas>", *datas, "  </Datas>", "</Database>"])

    def program_file(self, name: str, code: Sequence[str]) -> bytes:
        """Return the .pgx of one program; its code is a character section, which ]]> would end."""
        source = "\r\n  ".join(["begin", *code]) + "\r\nend"
        if "]]>" in source:
            raise OutputError(f"the VAL3 program {name} holds ]]>, which XML cannot carry in code; take it out")
        program = element("Program", {"name": name}, [f"<Code><![CDATA[{source}]]></Code>"])
        return document(element("Programs", {"xmlns:xsi": _XSI, "xmlns": f"{_SCHEMA}/Program/2"}, program))

    def point_row(self, numbers: Sequence[str], configuration: Mapping[str, str], father: str) -> str:
        """Return the template of a line of an array of points."""
        words = " ".join(f'{name}="{word}"' for name, word in configuration.items())
        return f'      <Value key="{{:d}}" {" ".join(numbers)} {words} fatherId="{father}[0]" />'

    def speed_row(self, attributes: Mapping[str, str]) -> str:
        """Return the template of a line of an array of speeds."""
        words = " ".join(f'{name}="{word}"' for name, word in attributes.items())
        return f'      <Value key="{{:d}}" {words} />'

    def number_row(self) -> str:
        """Return the template of a line of an array of numbers."""
        return '      <Value key="{:d}" value="{:d}" />'


def escaped(text: str) -> str:
    """Return text as it stands between tags.

    >>> escaped('if a<1 and b>"')
    'if a&lt;1 and b&gt;&quot;'
    """
    return text.translate(_IN_TEXT)


def element(name: str, attributes: Mapping[str, str], content: Iterable[str] = ()) -> list[str]:
    """Return the lines of an element and of what it holds, which is moved in."""
    words = "".join(f' {key}="{value.translate(_IN_ATTRIBUTE)}"' for key, value in attributes.items())
    inner = [f"  {line}" for line in content]
    return [f"<{name}{words}>", *inner, f"</{name}>"] if inner else [f"<{name}{words} />"]


def document(lines: Iterable[str]) -> bytes:
    """Return the bytes of a file.

    Raises
    ------
    OutputError
        If it would hold a character that XML forbids.
    """
    text = "\r\n".join(['<?xml version="1.0" encoding="utf-8"?>', *lines, ""])
    content = text.encode("utf-8-sig", "surrogatepass")
    # Files are long: only one with other than plain text is searched.
    if content[3:].translate(None, _PLAIN) and (wrong := _NOT_XML.search(text)):
        around = printable(text[max(0, wrong.start() - 20) : wrong.end() + 20])
        raise OutputError(f"a VAL3 file would hold a character that XML forbids, at {around!r}; take it out")
    return content


def _data(variable: Variable) -> list[str]:
    """Return a variable as it stands in its file: arrays may be long, and are not moved in line by line."""
    attributes = {
        "name": variable.name,
        "access": "private",
        "xsi:type": "array",
        "type": variable.type,
        "size": str(len(variable.values) + len(variable.lines)),
    }
    values = [
        line for key, value in enumerate(variable.values) for line in element("Value", {"key": str(key), **value})
    ]
    (opening,) = element("Data", attributes)
    lines = [*(f"      {line}" for line in values), *variable.lines]
    return [f"    {opening.removesuffix(' />')}>", *lines, "    </Data>"]
