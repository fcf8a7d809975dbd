"""Values of RAPID programs: nested lists of numbers, declared robtargets, speeds and frames, Offs and RelTool."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from sicp_cam.errors import printable
from sicp_cam.model import FloatArray
from sicp_formats.robot.motion import number_of, pose_of_quaternion, pose_xyz
from sicp_formats.robot.program import RobotError, split_arguments

__all__ = ["ASSIGNED", "DECLARED", "PREDEFINED_MM_S", "Data", "Target", "arguments_of", "parsed_list"]

Nested: TypeAlias = "float | str | list[Nested]"

ASSIGNED = re.compile(r"(\w+)[ \t]*(\{[^}]*\})?((?:\.\w+)*)[ \t]*:=(.*)", re.ASCII | re.DOTALL)
"""An assignment: name, index, component and value."""

DECLARED = re.compile(
    r"(?:(?:LOCAL|TASK)[ \t]+)?(CONST|PERS|VAR)[ \t]+(\w+)[ \t]+(\w+)[ \t]*(?:\{[^}]*\}[ \t]*)?(?::=(.*))?",
    re.ASCII | re.IGNORECASE | re.DOTALL,
)
"""A declaration: storage, type, name and value."""

_CALL = re.compile(r"(\w+)[ \t]*\((.*)\)[ \t]*", re.ASCII | re.DOTALL)
_ELEMENT = re.compile(r"(\w+)[ \t]*\{[ \t]*([0-9]{1,9})[ \t]*\}", re.ASCII)
_SWITCH = re.compile(r"[ \t]*(\w+)[ \t]*(?::=(.*))?", re.ASCII | re.DOTALL)
_DEEPEST = 8
PREDEFINED_MM_S = (
    *(5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800),
    *(1000, 1500, 2000, 2500, 3000, 4000, 5000, 6000, 7000),
)
"""Speeds that every controller knows: v5 to v7000."""


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A robtarget: its (4, 4) pose in the work object, mm, and the positions of external axes."""

    pose: FloatArray
    external: tuple[float, ...]


def parsed_list(text: str, depth: int = 0) -> list[Nested]:
    """Return a list in square brackets, with numbers, lists and other words.

    Raises
    ------
    RobotError
        If it is no list.

    >>> parsed_list("[[1,2.5],TRUE]")
    [[1.0, 2.5], 'TRUE']
    """
    text = text.strip()
    if not (text.startswith("[") and text.endswith("]")) or depth > _DEEPEST:
        raise RobotError(f"'{printable(text, 40)}' is no list of values; correct it")
    return [_value(part, depth) for part in split_arguments(text[1:-1])]


def _value(text: str, depth: int) -> Nested:
    if text.startswith("["):
        return parsed_list(text, depth + 1)
    number = number_of(text)
    return text if number is None else number


def arguments_of(text: str) -> tuple[list[str], dict[str, str]]:
    r"""Return the arguments of an instruction or function by place, and its switches by lower-case name.

    >>> arguments_of(r"p,1,-2\Rz:=30\Conc")
    (['p', '1', '-2'], {'rz': '30', 'conc': ''})
    """
    places: list[str] = []
    switches: dict[str, str] = {}
    for argument in split_arguments(text):
        parts = split_arguments(argument, "\\")
        if parts[0]:
            places.append(parts[0])
        for part in parts[1:]:
            match = _SWITCH.fullmatch(part)
            if match is None:
                raise RobotError(f"'\\{printable(part, 40)}' is not understood; correct the line")
            switches[match[1].lower()] = (match[2] or "").strip()
    return places, switches


@dataclass(slots=True)
class Data:
    """What the data of a module hold, by lower-case name: type and text of the value, None where it is not known."""

    known: dict[str, tuple[str, str | None]] = field(default_factory=dict)

    def declare(self, text: str) -> bool:
        """Take a declaration; return False if the text is none."""
        match = DECLARED.fullmatch(text)
        if match is None:
            return False
        value = match[4]
        self.known[match[3].lower()] = (match[2].lower(), value.strip() if value is not None else None)
        return True

    def declared_names(self, texts: Iterable[str]) -> list[str]:
        """Return the lower-case names that some of the statements declare."""
        return [match[3].lower() for text in texts if (match := DECLARED.fullmatch(text))]

    def assign(self, text: str) -> str | None:
        """Take an assignment; return the type of what it changes, None if the text is no assignment."""
        match = ASSIGNED.fullmatch(text)
        if match is None:
            return None
        name = match[1].lower()
        kind, _ = self.known.get(name, ("", None))
        plain = not match[2] and not match[3] and kind in ("robtarget", "speeddata", "num")
        try:
            value = self._settled(kind, match[4].strip()) if plain else None
        except RobotError:
            value = None  # computed: not known any more, and refused where it is used
        self.known[name] = (kind, value)
        return kind

    def forget(self, text: str) -> None:
        """Take what an assignment would set as not known."""
        match = ASSIGNED.fullmatch(text)
        if match is not None:
            name = match[1].lower()
            self.known[name] = (self.known.get(name, ("", None))[0], None)

    def target(self, text: str, depth: int = 0) -> Target | None:
        """Return the robtarget that an argument means, None for joint angles.

        Raises
        ------
        RobotError
            If it is computed from more than constants, is not declared, or is not what it should be.
        """
        text = text.strip()
        if depth > _DEEPEST:
            raise RobotError("the point is made of others more than 8 deep; write it out")
        if text.startswith("["):
            return _target(parsed_list(text))
        call = _CALL.fullmatch(text)
        if call is None:
            kind, value = self._named(text)
            if kind == "jointtarget":
                return None
            if kind != "robtarget":
                raise RobotError(f"'{printable(text, 40)}' is a {kind} and no robtarget; correct the line")
            return self.target(value, depth + 1)
        function, (places, switches) = call[1].lower(), arguments_of(call[2])
        turns = set(switches) <= ({"rx", "ry", "rz"} if function == "reltool" else set())
        if function not in ("offs", "reltool") or len(places) != 4 or not turns:
            raise RobotError(f"'{printable(text, 40)}' is computed; write the point as a robtarget")
        base = self.target(places[0], depth + 1)
        if base is None:
            raise RobotError(f"'{printable(text, 40)}' needs a robtarget; correct the line")
        x, y, z = (self.number(each) for each in places[1:])
        rx, ry, rz = (self.number(switches.get(name, "0")) for name in ("rx", "ry", "rz"))
        if function == "reltool":
            return Target(base.pose @ pose_xyz(x, y, z, rx, ry, rz), base.external)
        pose = base.pose.copy()
        pose[:3, 3] += (x, y, z)
        return Target(pose, base.external)

    def number(self, text: str) -> float:
        """Return a number, or a declared one; errors as for `target`."""
        value = number_of(text)
        if value is None:
            kind, held = self._named(text)
            value = number_of(held) if kind == "num" else None
        if value is None:
            raise RobotError(f"'{printable(text, 40)}' is no plain number; nothing is computed here")
        return value

    def speed_mm_s(self, text: str) -> float | None:
        """Return the speed of the tip that speeddata state, None if they do not limit it (vmax)."""
        text = text.strip()
        name = text.lower()
        if text.startswith("["):
            numbers = parsed_list(text)
            if len(numbers) != 4 or not isinstance(numbers[0], float):
                raise RobotError(f"'{printable(text, 40)}' is no speeddata of four numbers; correct it")
            return numbers[0]
        if name not in self.known:
            if name == "vmax":
                return None
            if name in [f"v{speed}" for speed in PREDEFINED_MM_S]:
                return float(name[1:])
        kind, value = self._named(text)
        if kind == "speeddata" and not value.startswith("["):
            raise RobotError(f"'{printable(text, 40)}' is no list of four numbers; write it out")
        if kind != "speeddata":
            raise RobotError(f"'{printable(text, 40)}' is a {kind} and no speeddata; correct the line")
        return self.speed_mm_s(value)

    def _named(self, text: str) -> tuple[str, str]:
        element = _ELEMENT.fullmatch(text.strip())
        name = (element[1] if element else text.strip()).lower()
        if not re.fullmatch(r"\w+", name, re.ASCII):
            raise RobotError(f"'{printable(text, 40)}' is computed; write plain values")
        if name not in self.known:
            raise RobotError(f"'{printable(text, 40)}' is declared nowhere in the module; add its declaration")
        kind, value = self.known[name]
        if value is None or value.lower() == name:
            raise RobotError(f"'{printable(text, 40)}' is computed by the program; write plain values")
        if element is None:
            return kind, value
        parts = split_arguments(value[1:-1]) if value.startswith("[") else []
        if not 1 <= int(element[2]) <= len(parts):
            raise RobotError(f"'{printable(text, 40)}' is beyond the array; correct the line")
        return kind, parts[int(element[2]) - 1]

    def _settled(self, kind: str, text: str) -> str | None:
        """Return the text of a value that does not change when its parts do later."""
        if kind == "robtarget" and not text.startswith("["):
            target = self.target(text)
            return None if target is None else _written(target)
        if kind == "speeddata" and not text.startswith("["):
            speed = self.speed_mm_s(text)
            return None if speed is None else f"[{speed!r},500,5000,1000]"
        return repr(self.number(text)) if kind == "num" else text


def _target(values: list[Nested]) -> Target:
    groups = [[v for v in each if isinstance(v, float)] if isinstance(each, list) else [] for each in values]
    if [len(group) for group in groups] != [3, 4, 4, 6]:
        raise RobotError("a robtarget needs [[x,y,z],[q1,q2,q3,q4],[4 numbers],[6 numbers]], all plain; correct it")
    x, y, z = groups[0]
    pose = pose_of_quaternion((x, y, z), *groups[1])
    if pose is None:
        length = float(np.linalg.norm(groups[1]))
        raise RobotError(f"the quaternion of the point has the length {length:.6g} and not 1; correct it")
    return Target(pose, tuple(groups[3]))


def _written(target: Target) -> str:
    """Return a target as a list whose orientation is the same to the last digits."""
    x, y, z, w = Rotation.from_matrix(target.pose[:3, :3]).as_quat().tolist()
    return f"[{target.pose[:3, 3].tolist()},{[w, x, y, z]},[0,0,0,0],{list(target.external)}]"
