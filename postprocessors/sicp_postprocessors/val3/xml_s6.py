"""The files of a VAL3 application in the dialect of s6: a section for each type, and code as plain text.

The shape of the files is that of public s6 applications. Not tried on a controller: arrays of points with several
values in one element, and outputs that a program links by dioLink.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from sicp_postprocessors.val3.xml import Dialect, Variable, document, element, escaped

__all__ = ["S6"]

_TYPES = (
    *("aio", "bool", "configRs", "config", "dio", "frame", "jointRs", "joint"),
    *("mdesc", "num", "pointRs", "point", "sio", "string", "tool", "trsf"),
)
_POSES = {"frame": ("fFather", "tfValue"), "tool": ("tFather", "ttValue"), "point": ("pFather", "tpValue")}
_BUILT_IN = (
    Variable("world", "frame", [{**dict.fromkeys(("x", "y", "z", "rx", "ry", "rz"), "0"), "fatherId": ""}]),
    Variable("flange", "tool", [{**dict.fromkeys(("x", "y", "z", "rx", "ry", "rz"), "0"), "fatherId": ""}]),
)
"""Frame and tool that every s6 application declares, although they are the controller's own."""


class S6(Dialect):
    """The dialect of s6."""

    version = "s6.8"
    linked_in_code = True
    blend = "joint"  # the word that every version knows

    def project_file(self, version: str, programs: Iterable[str], data: str) -> bytes:
        """Return the .pjx; the inputs and outputs of the controller are the library io."""
        alias = {"name": "io", "interface": "io", "autoload": "true"}
        content = [
            *element("parameters", {"version": version, "stackSize": "5000", "millimeterUnit": "true"}),
            *element("programSection", {}, [line for file in programs for line in element("program", {"file": file})]),
            *element("dataSection", {}, element("data", {"file": data})),
            *element("aliasSection", {}, element("alias", alias)),
        ]
        return document(element("project", {"xmlns": "ProjectNameSpace"}, content))

    def data_file(self, variables: Iterable[Variable]) -> bytes:
        """Return the .dtx, in which variables stand by their types."""
        declared = [*_BUILT_IN, *variables]
        lines = ['<dataList xmlns="DataNameSpace">']
        for kind in _TYPES:
            those = [variable for variable in declared if variable.type.removesuffix("Rx") == kind]
            inner = [line for variable in those for line in _data(variable, kind)]
            lines += [f"  <{kind}Section>", *inner, f"  </{kind}Section>"] if inner else [f"  <{kind}Section />"]
        return document([*lines, "</dataList>"])

    def program_file(self, name: str, code: Sequence[str]) -> bytes:
        """Return the .pgx of one program."""
        source = escaped("\r\n  ".join(["begin", *code]) + "\r\nend")
        content = [
            *(line for each in ("description", "paramSection", "localSection") for line in element(each, {})),
            *element("source", {}, [f"<code>{source}</code>"]),
        ]
        program = element("program", {"name": name, "public": "false"}, content)
        return document(element("programList", {"xmlns": "ProgramNameSpace"}, program))

    def point_row(self, numbers: Sequence[str], configuration: Mapping[str, str], father: str) -> str:
        """Return the template of a line of an array of points; the frame stands before them."""
        words = " ".join(f'{name}="{word}"' for name, word in configuration.items())
        pose, arm = f"<tpValue {' '.join(numbers)} />", f"<cpValue {words} />"
        return f'      <valuePoint index="{{:d}}">{pose}{arm}</valuePoint>'

    def speed_row(self, attributes: Mapping[str, str]) -> str:
        """Return the template of a line of an array of speeds."""
        words = " ".join(f'{name}="{word}"' for name, word in attributes.items())
        return f'      <valueMdesc index="{{:d}}"><mdescValue {words} /></valueMdesc>'

    def number_row(self) -> str:
        """Return the template of a line of an array of numbers."""
        return '      <valueNum index="{:d}" value="{:d}" />'


def _data(variable: Variable, kind: str) -> list[str]:
    attributes = {"name": variable.name, "public": "false"}
    if kind in ("dio", "aio"):
        (line,) = element(kind, attributes | {"size": str(len(variable.values))})
        return [f"    {line}"]
    (opening,) = element(kind, attributes)
    fathers = [value["fatherId"] for value in variable.values[:1] if "fatherId" in value] or [variable.father]
    lines = [f"      {line}" for line in (*_father(kind, fathers[0]), *_values(variable, kind))]
    return [f"    {opening.removesuffix(' />')}>", *lines, *variable.lines, f"    </{kind}>"]


def _father(kind: str, father: str) -> list[str]:
    if kind not in _POSES:
        return []
    return element(_POSES[kind][0], {"alias": "", "name": father.partition("[")[0], "fatherIndex": "0"})


def _values(variable: Variable, kind: str) -> Iterator[str]:
    name = f"value{kind[0].upper()}{kind[1:]}"
    for index, value in enumerate(variable.values):
        key = {"index": str(index)}
        plain = {word: text for word, text in value.items() if word not in ("fatherId", "ioLink")}
        if kind in ("num", "bool", "string"):
            yield from element(name, key | plain)
        elif kind == "mdesc":
            yield from element(name, key, element("mdescValue", plain))
        else:
            inner = element(_POSES[kind][1], plain)
            if kind == "tool":
                gripper = {"alias": "io", "name": value.get("ioLink", "valve1"), "ioIndex": "0"}
                inner += element("io", gripper | {"open": "0", "close": "0"})
            yield from element(name, key, inner)
