"""The XML of a VAL3 application, s7 dialect: read by CS8C controllers from s7.0 on and by CS9.

UTF-8 with byte order mark and CRLF, as the manufacturer's own tool writes it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sicp_cam.errors import OutputError, printable

__all__ = ["Variable", "data_file", "program_file", "project_file"]

_SCHEMA = "http://www.staubli.com/robotics/VAL3"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ESCAPES = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}
)


@dataclass(frozen=True, slots=True)
class Variable:
    """A global variable: its name, its VAL3 type, and the attributes of each element of its array, or their lines."""

    name: str
    type: str
    values: Sequence[Mapping[str, str]] = ()
    lines: Sequence[str] = ()
    """The elements as XML already, for arrays that are long."""


def project_file(version: str, programs: Iterable[str], data: str) -> bytes:
    """Return the .pjx that lists the program files and the data file."""
    content = [
        *_element("Parameters", {"version": version, "stackSize": "5000", "millimeterUnit": "true"}),
        *_element("Programs", {}, [line for file in programs for line in _element("Program", {"file": file})]),
        *_element("Database", {}, _element("Data", {"file": data})),
        *_element("Libraries", {}),
    ]
    return _document(_element("Project", {"xmlns": f"{_SCHEMA}/Project/3"}, content))


def data_file(variables: Iterable[Variable]) -> bytes:
    """Return the .dtx that declares the global variables."""
    datas = [line for variable in variables for line in _variable(variable)]
    root = {"xmlns:xsi": _XSI, "xmlns": f"{_SCHEMA}/Data/2"}
    return _document(_element("Database", root, _element("Datas", {}, datas)))


def program_file(name: str, code: Sequence[str]) -> bytes:
    """Return the .pgx of one program without parameters; `code` stands between begin and end.

    Raises
    ------
    OutputError
        If the code holds the end mark of an XML character section, or a character that XML forbids.
    """
    source = "\r\n".join(["begin", *(f"  {line}" for line in code), "end"])
    if "]]>" in source:
        raise OutputError(f"the VAL3 program {name} holds ]]>, which XML cannot carry in code; take it out")
    program = _element("Program", {"name": name}, [f"<Code><![CDATA[{source}]]></Code>"])
    return _document(_element("Programs", {"xmlns:xsi": _XSI, "xmlns": f"{_SCHEMA}/Program/2"}, program))


def _variable(variable: Variable) -> list[str]:
    attributes = {
        "name": variable.name,
        "access": "private",
        "xsi:type": "array",
        "type": variable.type,
        "size": str(len(variable.values) + len(variable.lines)),
    }
    values = [*variable.lines] or [
        line for key, value in enumerate(variable.values) for line in _element("Value", {"key": str(key), **value})
    ]
    return _element("Data", attributes, values)


def _element(name: str, attributes: Mapping[str, str], content: Iterable[str] = ()) -> list[str]:
    words = "".join(f' {key}="{value.translate(_ESCAPES)}"' for key, value in attributes.items())
    inner = [f"  {line}" for line in content]
    return [f"<{name}{words}>", *inner, f"</{name}>"] if inner else [f"<{name}{words} />"]


def _document(lines: Iterable[str]) -> bytes:
    text = "".join(f"{line}\r\n" for line in ('<?xml version="1.0" encoding="utf-8"?>', *lines))
    wrong = _NOT_XML.search(text)
    if wrong:
        around = printable(text[max(0, wrong.start() - 20) : wrong.end() + 20])
        raise OutputError(f"a VAL3 file would hold a character that XML forbids, at {around!r}; take it out")
    return text.encode("utf-8-sig")
