"""Values of Universal Robots scripts: poses with rotation vectors, numbers, and the variables that hold them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from sicp_cam.errors import printable
from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import from_parts
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError, split_arguments

__all__ = ["ASSIGNMENT", "Data", "arguments_of", "pose_of_rotation_vector"]

ASSIGNMENT = re.compile(
    r"(?:global[ \t]+|local[ \t]+)?([A-Za-z_]\w*)[ \t]*(\[[^\]]*\])?[ \t]*=(?!=)[ \t]*(.*)", re.ASCII
)
"""An assignment: name, index and value."""

_POSE = re.compile(r"p[ \t]*\[(.*)\]", re.ASCII)
_CALL = re.compile(r"(\w+)[ \t]*\((.*)\)", re.ASCII)
_NAMED = re.compile(r"([A-Za-z_]\w*)[ \t]*=(?!=)(.*)", re.ASCII)
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_MM = 1000.0


def pose_of_rotation_vector(values: tuple[float, ...]) -> FloatArray:
    """Return the (4, 4) pose in mm of x, y, z in metres and a rotation vector in radians (Rodrigues).

    >>> pose_of_rotation_vector((1.0, 0.0, 0.0, 0.0, math.pi, 0.0))[:3, 2].round(9).tolist()
    [0.0, 0.0, -1.0]
    """
    x, y, z, rx, ry, rz = values
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    c, s = math.cos(angle), math.sin(angle)
    a, b, d = (rx / angle, ry / angle, rz / angle) if angle > 0.0 else (0.0, 0.0, 1.0)
    v = 1.0 - c
    R = (
        (a * a * v + c, a * b * v - d * s, a * d * v + b * s),
        (a * b * v + d * s, b * b * v + c, b * d * v - a * s),
        (a * d * v - b * s, b * d * v + a * s, d * d * v + c),
    )
    return from_parts(R, (_MM * x, _MM * y, _MM * z))


def arguments_of(text: str) -> tuple[list[str], dict[str, str]]:
    """Return the arguments of a call by place, and those by name.

    >>> arguments_of("p[1,2], 1.2, v=0.1")
    (['p[1,2]', '1.2'], {'v': '0.1'})
    """
    places, named = list[str](), dict[str, str]()
    for argument in split_arguments(text):
        match = _NAMED.fullmatch(argument)
        if match:
            named[match[1]] = match[2].strip()
        elif argument:
            places.append(argument)
    return places, named


@dataclass(slots=True)
class Data:
    """What the variables of a script hold, as text; None where it is not known."""

    known: dict[str, str | None] = field(default_factory=dict)

    def assign(self, text: str) -> bool:
        """Take an assignment; return False if the text is none."""
        match = ASSIGNMENT.fullmatch(text)
        if match is None:
            return False
        value = match[3].strip()
        plain = not match[2] and (number_of(value) is not None or self._plain_pose(value) is not None)
        self.known[match[1]] = value if plain else None
        return True

    def forget(self, text: str) -> None:
        """Take what an assignment would set as not known."""
        if match := ASSIGNMENT.fullmatch(text):
            self.known[match[1]] = None

    def number(self, text: str) -> float:
        """Return a number, or that which a variable holds.

        Raises
        ------
        RobotError
            If it would have to be computed, or is not assigned.
        """
        value = number_of(text)
        if value is None:
            value = number_of(self._named(text))
        if value is None:
            raise RobotError(f"'{printable(text, 40)}' is no number; correct the line")
        return value

    def target(self, text: str, depth: int = 0) -> tuple[FloatArray | None, str]:
        """Return the (4, 4) pose in mm that an argument means, and the frame it stands in; no pose for joint angles.

        Errors as for `number`.
        """
        text = text.strip()
        if (pose := self._plain_pose(text)) is not None:
            return pose_of_rotation_vector(pose), "base"
        if text.startswith("["):
            return None, ""
        if call := _CALL.fullmatch(text):
            places, _ = arguments_of(call[2])
            if call[1] == "pose_trans" and len(places) == 2 and _WORD.fullmatch(places[0]):
                pose_in_frame, inner = self.target(places[1], depth)
                if pose_in_frame is not None and inner == "base":
                    return pose_in_frame, places[0]
            if call[1] == "get_inverse_kin" and places:
                return self.target(places[0], depth)
            raise RobotError(f"'{printable(text, 40)}' is computed; write the point as p[x,y,z,rx,ry,rz]")
        if depth:
            raise RobotError(f"'{printable(text, 40)}' is no pose; correct the line")
        return self.target(self._named(text), depth + 1)

    def _plain_pose(self, text: str) -> tuple[float, ...] | None:
        match = _POSE.fullmatch(text)
        if match is None:
            return None
        numbers = [number_of(part) for part in split_arguments(match[1])]
        values = tuple(number for number in numbers if number is not None)
        if len(values) != len(numbers) or len(values) != 6:
            return None
        return values

    def _named(self, text: str) -> str:
        name = text.strip()
        if not _WORD.fullmatch(name):
            raise RobotError(f"'{printable(text, 40)}' is computed or incomplete; write plain numbers")
        if name not in self.known:
            raise RobotError(f"'{printable(name, 40)}' is assigned nowhere before; write plain numbers")
        value = self.known[name]
        if value is None:
            raise RobotError(f"'{printable(name, 40)}' is computed by the script; write plain numbers")
        return value
