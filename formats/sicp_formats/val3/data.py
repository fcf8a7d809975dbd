"""The global variables of a VAL3 application, from its .dtx files: the s7 and s8 dialect, and that of s6 and s5.

The manufacturer's tool leaves out what has its default value; the defaults stand here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import FloatArray
from sicp_formats.robot.motion import number_of, pose_xyz
from sicp_formats.robot.program import RobotError
from sicp_formats.val3.xml import Element

__all__ = ["GEOMETRY", "ITEM", "Variable", "Variables", "declarations"]

ITEM = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)[ \t]*(?:\[((?:[^\[\]]|\[[^\[\]]*\])*)\])?", re.ASCII)
"""A variable or an element of one: name, and index if there is one."""

GEOMETRY = frozenset({"point", "joint", "frame", "tool", "trsf", "mdesc", "config"})
"""Types whose values decide where the arm goes, and how."""

_FATHER = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)[ \t]*(?:\[[ \t]*([0-9]+)[ \t]*\])?", re.ASCII)
_SIX = ("x", "y", "z", "rx", "ry", "rz")
_DEEPEST_FRAME = 32


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable: its type without the suffix of six-axis arms, its size, and the attributes of its elements by key.

    A collection is indexed by other than one number; `public` variables are seen by other applications.
    """

    name: str
    type: str
    size: int
    values: Mapping[str, tuple[int, Mapping[str, str]]]
    file: Path
    line: int
    collection: bool = False
    public: bool = False


@dataclass(slots=True)
class Variables:
    """All variables of an application; lengths in the unit of its files."""

    known: dict[str, Variable] = field(default_factory=dict)
    _frames: dict[tuple[str, str], FloatArray | None] = field(default_factory=dict)

    def read(self, file: Path, root: Element) -> None:
        """Add the variables of one .dtx file.

        Raises
        ------
        FormatError
            If the file holds none, or a size or name is wrong.
        """
        if root.name.lower() not in ("database", "datalist"):
            raise FormatError(file, f"<{printable(root.name, 40)}> is not the root of a .dtx file; is it one?", line=1)
        for declare in declarations(file, root):
            variable = declare()
            self.known[variable.name] = variable

    def type_of(self, name: str) -> str | None:
        """Return the type of a variable, None if there is none of that name."""
        return self.known[name].type if name in self.known else None

    def attributes(self, name: str, key: str) -> tuple[Variable, int, Mapping[str, str]]:
        """Return a variable, and line and attributes of one of its elements.

        Raises
        ------
        RobotError
            If there is no such variable or element.
        """
        variable = self.known.get(name)
        if variable is None:
            raise RobotError(
                f"the variable '{printable(name, 40)}' is in no .dtx file of the application; add its file"
            )
        if key not in variable.values and not (key.isdigit() and int(key) < variable.size):
            raise RobotError(f"{name}[{printable(key, 20)}] is beyond the {variable.size} elements of {name}")
        line, attributes = variable.values.get(key, (variable.line, {}))
        return variable, line, attributes

    def number(self, name: str, key: str, attribute: str, default: float) -> float:
        """Return a number of an element, or its default where the file leaves it out."""
        variable, line, attributes = self.attributes(name, key)
        text = attributes.get(attribute)
        return default if text is None else _number(variable, line, key, attribute, text)

    def pose(self, name: str, key: str) -> FloatArray:
        """Return the (4, 4) pose that an element states, in its father."""
        variable, line, attributes = self.attributes(name, key)
        x, y, z, rx, ry, rz = (
            _number(variable, line, key, each, attributes[each]) if each in attributes else 0.0 for each in _SIX
        )
        return pose_xyz(x, y, z, rx, ry, rz)

    def father(self, name: str, key: str) -> tuple[str, str]:
        """Return name and key of the frame that an element stands in."""
        _, _, attributes = self.attributes(name, key)
        text = attributes.get("fatherId", "").strip()
        if not text:
            return "world", "0"
        match = _FATHER.fullmatch(text)
        if match is None:
            raise RobotError(
                f"the frame '{printable(text, 40)}' of {name}[{key}] is not in the application; put it there"
            )
        return match[1], str(int(match[2] or "0"))

    def frame(self, name: str, key: str, depth: int = 0) -> FloatArray | None:
        """Return the (4, 4) pose of a frame in the robot's world, None if it is the world.

        Raises
        ------
        RobotError
            If it is not known, or is its own father.
        """
        if name == "world":
            return None
        if depth > _DEEPEST_FRAME:
            raise RobotError(f"the frame {name} is its own father; correct the .dtx file")
        if (name, key) not in self._frames:
            if self.type_of(name) not in ("frame", None):
                raise RobotError(f"{name} is no frame, but points stand in it; correct the .dtx file")
            pose = self.pose(name, key)
            father = self.frame(*self.father(name, key), depth + 1)
            T_world_frame = pose if father is None else father @ pose
            self._frames[name, key] = None if (T_world_frame == np.eye(4)).all() else T_world_frame
        return self._frames[name, key]

    def fathers(self, name: str, key: str) -> Iterator[str]:
        """Yield the names of the frames that an element stands in, up to the world's."""
        for _ in range(_DEEPEST_FRAME):
            name, key = self.father(name, key)
            if name == "world":
                return
            yield name


def declarations(file: Path, root: Element) -> Iterator[Callable[[], Variable]]:
    """Yield for each variable of a .dtx file what makes it; a call raises FormatError if its size is no number."""
    if root.name.lower() == "database":
        for data in root.all("data"):
            yield partial(_s7, file, data)
    else:
        for section in root.children:
            for data in section.children:
                yield partial(_s6, file, data)


def _s7(file: Path, data: Element) -> Variable:
    name, kind = data.attributes.get("name", ""), data.attributes.get("type", "")
    values = {}
    for place, value in enumerate(child for child in data.children if child.name.lower() == "value"):
        key = value.attributes.get("key", str(place)).strip()
        values[key] = (value.line, value.attributes)
    size = _size(file, data, data.attributes.get("size", str(max(len(values), 1))))
    # Neither the keys of a collection nor those of an array of arrays are plain numbers.
    collection = data.attributes.get("xsi:type") == "collection" or not data.attributes.get("size", "1").isdecimal()
    public = data.attributes.get("access", "private") == "public"
    return Variable(name, _plain(kind), size, values, file, data.line, collection, public)


def _s6(file: Path, data: Element) -> Variable:
    """Return a variable of a section such as pointSection, whose values lie one level deeper than in s7."""
    father = next((_father(child) for child in data.children if child.name.endswith("Father")), {})
    values = {}
    for place, value in enumerate(child for child in data.children if child.name.startswith("value")):
        attributes = dict(father) | value.attributes
        for inner in value.children:
            if inner.name != "io":
                attributes |= inner.attributes
        values[value.attributes.get("index", str(place)).strip()] = (value.line, attributes)
    size = _size(file, data, data.attributes.get("size", str(max(len(values), 1))))
    public = data.attributes.get("public", "false") == "true"
    return Variable(data.attributes.get("name", ""), _plain(data.name), size, values, file, data.line, False, public)


def _number(variable: Variable, line: int, key: str, attribute: str, text: str) -> float:
    value = number_of(text)
    if value is None:
        what = f"{variable.name}[{key}]: {attribute} = {printable(text, 40)!r} is no number; correct it"
        raise FormatError(variable.file, what, line=line)
    return value


def _father(element: Element) -> dict[str, str]:
    alias, name = element.attributes.get("alias", ""), element.attributes.get("name", "")
    index = element.attributes.get("fatherIndex", "0")
    return {"fatherId": f"{alias}{':' if alias else ''}{name}[{index}]"} if name else {}


def _size(file: Path, data: Element, text: str) -> int:
    """Return how many elements an array has; arrays of arrays state several sizes."""
    if not re.fullmatch(r"[0-9]{1,9}(?:[,;][0-9]{1,9}){0,2}", text.strip(), re.ASCII):
        raise FormatError(file, f"the size {printable(text, 20)!r} is no whole number; correct it", line=data.line)
    return math.prod(int(size) for size in re.split("[,;]", text.strip()))


def _plain(kind: str) -> str:
    """Return a type without the suffix Rx of six-axis arms, which s6 does not write."""
    return kind[:-2] if kind in ("pointRx", "jointRx", "configRx") else kind
