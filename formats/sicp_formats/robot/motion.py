"""What robot programs have in common: poses of the tool, joint moves that nobody can place, arcs through a point.

A pose is the (4, 4) motion T_frame_tool in millimetres; the tip is its origin, and one of its axes is the tool.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sicp_cam.errors import JobError
from sicp_cam.model import BoolArray, EventKind, FloatArray
from sicp_cam.rigid_motion import from_parts
from sicp_formats.paths.arcs import Arc, Vector, arc_between, cross, dot, minus, norm, unit
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList
from sicp_formats.robot.program import RobotError

__all__ = [
    "NUMBER",
    "RobotMoves",
    "arc_through",
    "number_of",
    "pose_of_quaternion",
    "pose_xyz",
    "pose_zyx",
    "subprograms_named",
    "tool_side",
]

NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
"""A number of a robot language, as part of a regular expression."""

_SIDES = {f"{sign}{name}": (index, value) for index, name in enumerate("xyz") for sign, value in (("", 1), ("-", -1))}
_UNIT_TOLERANCE = 1e-3
_FLAT = 1e-6


def number_of(text: str) -> float | None:
    """Return the number that a text is, or None if it is anything else or too large.

    >>> number_of(" -1.5E+01 "), number_of("1e999"), number_of("n+1")
    (-15.0, None, None)
    """
    word = text.strip()
    # A number of these characters only that Python takes is one of a robot, too; it is asked for very often.
    if word.strip("0123456789.+-eE") or not word:
        return None
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def tool_side(tool_axis: str) -> tuple[int, int]:
    """Return column and sign of the axis of a tool frame that points from the tip to the holder.

    Raises
    ------
    JobError
        If the option is none of x, -x, y, -y, z, -z.

    >>> tool_side("-z")
    (2, -1)
    """
    side = _SIDES.get(tool_axis.strip().lower().removeprefix("+"))
    if side is None:
        raise JobError(f"path.tool_axis = {tool_axis!r} must be one of {', '.join(_SIDES)}")
    return side


def subprograms_named(calls: str) -> frozenset[str]:
    """Return the names of the option `calls`, in lower case.

    >>> sorted(subprograms_named("SpindleOn, suction"))
    ['spindleon', 'suction']
    """
    return frozenset(name for word in calls.split(",") if (name := word.strip().lower()))


def pose_xyz(x: float, y: float, z: float, rx: float, ry: float, rz: float) -> FloatArray:
    """Return the pose of R = Rx(rx) Ry(ry) Rz(rz), degrees: VAL3's order.

    >>> np.round(pose_xyz(1, 2, 3, 10, 20, 30)[0], 6).tolist()
    [0.813798, -0.469846, 0.34202, 1.0]
    """
    (a, d), (b, e), (c, f) = _turn(rx), _turn(ry), _turn(rz)
    R = (
        (b * c, -b * f, e),
        (a * f + d * e * c, a * c - d * e * f, -d * b),
        (d * f - a * e * c, d * c + a * e * f, a * b),
    )
    return from_parts(R, (x, y, z))


def pose_zyx(x: float, y: float, z: float, a: float, b: float, c: float) -> FloatArray:
    """Return the pose of R = Rz(a) Ry(b) Rx(c), degrees: KUKA's order.

    >>> np.round(pose_zyx(0, 0, 0, 90, 0, 90)[:3, 2], 6).tolist()
    [1.0, 0.0, 0.0]
    """
    (ca, sa), (cb, sb), (cc, sc) = _turn(a), _turn(b), _turn(c)
    R = (
        (ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc),
        (sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc),
        (-sb, cb * sc, cb * cc),
    )
    return from_parts(R, (x, y, z))


def pose_of_quaternion(tip: Vector, w: float, x: float, y: float, z: float) -> FloatArray | None:
    """Return the pose of a quaternion with its scalar first, or None if its length is not 1.

    >>> pose_of_quaternion((0, 0, 0), 0.0, 1.0, 0.0, 0.0)[:3, 2].tolist()
    [0.0, 0.0, -1.0]
    """
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        return None
    w, x, y, z = w / length, x / length, y / length, z / length
    R = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return from_parts(R, tip)


def arc_through(start: Vector, middle: Vector, end: Vector) -> Arc | None:
    """Return the arc from start through a point in the middle to the end, or None where the three make none; mm.

    >>> arc = arc_through((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    >>> round(arc.sweep, 6), round(arc.radius_start, 6)
    (3.141593, 1.0)
    """
    a, b = minus(middle, start), minus(end, start)
    n = cross(a, b)
    normal = unit(n)
    if normal is None or norm(n) <= _FLAT * norm(a) * norm(b):
        return None
    # The circumcentre as seen from the start: (|a|^2 b - |b|^2 a) x (a x b) / (2 |a x b|^2).
    aa, bb = dot(a, a), dot(b, b)
    q = cross((aa * b[0] - bb * a[0], aa * b[1] - bb * a[1], aa * b[2] - bb * a[2]), n)
    scale = 0.5 / dot(n, n)
    centre = (start[0] + scale * q[0], start[1] + scale * q[1], start[2] + scale * q[2])
    return arc_between(start, end, centre, normal)


@dataclass(slots=True)
class RobotMoves:
    """The moves of a robot program as they are executed.

    Parameters
    ----------
    moves
        Where they go.
    side
        Column and sign of the tool frame's axis from tip to holder, see `tool_side`.
    pose
        (4, 4) pose after the last move, in mm; None before the first.
    """

    moves: MoveList
    side: tuple[int, int]
    pose: FloatArray | None = None
    _waiting: list[int] = field(default_factory=list)
    _frame: str | None = None
    _tool: str | None = None
    _external: tuple[float, ...] | None = None

    def straight(self, pose: FloatArray, feed: float, rapid: bool, line: int) -> None:
        """Append a straight move to a pose; feed in mm/min."""
        self._check(pose)
        self.moves.move(_tip(pose), self._axis(pose), 0.0 if rapid else feed, rapid, line)
        self.pose = pose

    def straight_many(self, poses: FloatArray, feeds: FloatArray, rapid: BoolArray, lines: Sequence[int]) -> bool:
        """Append straight moves to poses (n, 4, 4); none, and return False, if one of them is not sure."""
        limits, (column, sign) = self.moves.limits, self.side
        too_many = len(self.moves) + len(poses) > limits.path_points
        if self._waiting or too_many or not (np.abs(poses[:, :3, 3]) <= limits.coordinate_mm).all():
            return False
        axes = sign * poses[:, :3, column] + 0.0
        rows = np.column_stack([poses[:, :3, 3], axes, np.where(rapid, 0.0, feeds), rapid, lines])
        self.moves.rows.frombytes(np.ascontiguousarray(rows, np.float64).tobytes())
        self.pose = poses[-1]
        return True

    def arc(self, middle: FloatArray, end: FloatArray, feed: float, line: int) -> None:
        """Append an arc through the tip of one pose to another pose; feed in mm/min."""
        self._check(end)
        if self.pose is None:
            raise RobotError("an arc before the first known point; where it begins is not known")
        arc = arc_through(_tip(self.pose), _tip(middle), _tip(end))
        if arc is None:
            raise RobotError("the three points of the arc lie on a line or fall together; write it as straight moves")
        self.moves.arc(arc, (self._axis(self.pose), self._axis(end)), feed, False, line, "through a point")
        self.pose = end

    def joints(self, line: int) -> None:
        """Take a move to joint angles: it is no part of the path, if no point follows a point behind it."""
        if len(self.moves):
            self._waiting.append(line)
        else:
            self.moves.note(Notice.JOINTS_LEFT_OUT, line)

    def in_frame(self, name: str, line: int) -> None:
        """Take the frame that the points from here on are given in: one for the path, its coordinates are kept."""
        if name == self._frame:
            return
        if len(self.moves):
            raise RobotError(
                f"the frame changes from {self._frame or 'none'} to {name} within the path; split it there"
            )
        self._frame = name
        self.moves.note(Notice.FRAME_CHOSEN, line, f"points are kept as they stand in {name}")

    def with_tool(self, name: str, line: int) -> None:
        """Take the tool from here on; a change is an event, with the number that its name ends with."""
        if name == self._tool:
            return
        number = re.search(r"([0-9]{1,9})\]?$", name, re.ASCII)
        kind = EventKind.TOOL if number else EventKind.OTHER
        self.moves.event(kind, line, float(number[1]) if number else 0.0, f"tool {name}")
        self._tool = name

    def external_axes(self, values: tuple[float, ...], line: int) -> None:
        """Take the positions of external axes; that they change is noted."""
        if self._external is not None and values != self._external:
            self.moves.note(Notice.EXTERNAL_AXES, line)
        self._external = values

    def finish(self) -> None:
        """Note the joint moves that no point follows."""
        for line in self._waiting:
            self.moves.note(Notice.JOINTS_LEFT_OUT, line)

    def _check(self, pose: FloatArray) -> None:
        limits = self.moves.limits
        if self._waiting:
            where = (
                f"the move to joint angles in line {self._waiting[0]}" if self._waiting[0] else "a move to joint angles"
            )
            raise RobotError(
                f"{where} stands between two points; only the robot knows where it goes: give it as a point"
            )
        if not (np.abs(pose[:3, 3]) <= limits.coordinate_mm).all():
            raise RobotError(f"a coordinate is beyond the limit coordinate_mm = {limits.coordinate_mm:g}; correct it")
        if len(self.moves) >= limits.path_points:
            raise RobotError(
                f"the path has more moves than the limit path_points = {limits.path_points}; split it or raise it"
            )

    def _axis(self, pose: FloatArray) -> Vector:
        column, sign = self.side
        i, j, k = (sign * pose[:3, column] + 0.0).tolist()
        return (i, j, k)


def _tip(pose: FloatArray) -> Vector:
    x, y, z = pose[:3, 3].tolist()
    return (x, y, z)


def _turn(degrees: float) -> tuple[float, float]:
    """Return cosine and sine; exact for whole quarter turns, which programs are full of."""
    quarters, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters % 4)]
    angle = math.radians(math.fmod(degrees, 360.0))
    return math.cos(angle), math.sin(angle)
