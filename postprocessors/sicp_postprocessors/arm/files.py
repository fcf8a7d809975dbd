"""Arms from kinematics files: those of this package by name, or a file of the user's, in TOML.

::

    name = "My arm"
    world = "base_plate"            # where the controller's world lies: shoulder (height of axis 2), or base_plate
    [geometry_mm]                   # see `Arm`
    shoulder_height = 478.0
    shoulder_forward = 50.0
    elbow_side = 50.0               # 0 if left out
    upper_arm = 425.0
    forearm_offset = 0.0            # 0 if left out
    forearm = 425.0
    flange = 100.0
    [joint.1]                       # joint.1 to joint.6; what is left out is not checked
    lowest_deg = -180
    highest_deg = 180
    fastest_deg_s = 400
    sign = 1                        # -1 where the controller counts the other way than `Arm`; 1 if left out
    straight_up_deg = 0             # what the controller counts with the arm straight up; 0 if left out
    spindle = false                 # joint 6 only: it is a spindle
    [sources]                       # where the numbers are from, any keys; and at the top, remark = "what to know"
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from typing import Any

from sicp_cam.errors import JobError, printable
from sicp_postprocessors.arm.model import Arm, Joint
from sicp_postprocessors.data_files import read_toml, toml_from_text

__all__ = ["arm_from_text", "arm_names", "load_arm"]

_LONGEST_MM = 100_000.0
_WORLDS = ("shoulder", "base_plate")
_LENGTHS = {
    "shoulder_height": None,
    "shoulder_forward": None,
    "elbow_side": 0.0,
    "upper_arm": None,
    "forearm_offset": 0.0,
    "forearm": None,
    "flange": None,
}
"""Lengths, and what holds where one is left out; None where it must be given."""
_POSITIVE = ("upper_arm", "forearm")
_JOINT_NUMBERS = ("lowest_deg", "highest_deg", "fastest_deg_s", "sign", "straight_up_deg")
_LARGEST_DEG = 36_000.0


def arm_names() -> list[str]:
    """Return the names of the arms of this package.

    >>> "tx2-90" in arm_names()
    True
    """
    folder = resources.files("sicp_postprocessors.arm") / "robots"
    return sorted(item.name.removesuffix(".toml") for item in folder.iterdir() if item.name.endswith(".toml"))


def load_arm(robot: str) -> Arm:
    """Return the arm of a name, in upper or lower case, or of a file whose name ends in `.toml`.

    Raises
    ------
    JobError
        If there is none, or with every problem of the file.
    """
    robot = robot.strip()
    if not robot.lower().endswith(".toml"):
        name = robot.lower()
        if name not in arm_names():
            raise JobError(
                f"robot {printable(robot, 60)!r} is not known; known are {', '.join(arm_names())}, or give a file "
                "NAME.toml"
            )
        content = (resources.files("sicp_postprocessors.arm") / "robots" / f"{name}.toml").read_bytes()
        return arm_from_text(content.decode("utf-8"), f"{name}.toml")
    return _arm_from_table(read_toml(robot, "robot"), robot)


def arm_from_text(text: str, file: str) -> Arm:
    """Build an arm from the text of a kinematics file.

    Raises
    ------
    JobError
        With every problem, each with the key that it is about.

    >>> arm_from_text('name = "x"', "my.toml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    sicp_cam.errors.JobError: robot file my.toml: world must be shoulder or base_plate; ...
    """
    return _arm_from_table(toml_from_text(text, file, "robot"), file)


def _arm_from_table(table: Mapping[str, Any], file: str) -> Arm:
    problems: list[str] = []
    _unknown_keys(table, ("name", "world", "remark", "geometry_mm", "joint", "sources"), "", problems)
    name, world, remark = table.get("name", ""), table.get("world", ""), table.get("remark", "")
    if not (_is_line(name, 100) and name.strip()):
        problems.append("name must be a text of printable ASCII")
    if not _is_line(remark, 300):
        problems.append("remark must be a text of printable ASCII, on one line")
    if world not in _WORLDS:
        problems.append(f"world must be {' or '.join(_WORLDS)}")
    lengths = _lengths(_table(table, "geometry_mm", problems), problems)
    joints = _joints(_table(table, "joint", problems), problems)
    sources = _table(table, "sources", problems) if "sources" in table else {}
    problems += [f"sources.{printable(k)} must be a text" for k, v in sources.items() if not isinstance(v, str)]
    if problems:
        raise JobError(*(f"robot file {printable(file)}: {problem}" for problem in problems))
    return Arm(str(name), str(world), **lengths, joints=joints, sources=tuple(sources.items()), remark=remark)


def _is_line(text: object, longest: int) -> bool:
    return isinstance(text, str) and text.isascii() and (not text or text.isprintable()) and len(text) <= longest


def _table(table: Mapping[str, Any], key: str, problems: list[str]) -> Mapping[str, Any]:
    value = table.get(key, {})
    if isinstance(value, dict):
        return value
    problems.append(f"{key} must be a table")
    return {}


def _unknown_keys(table: Mapping[str, Any], known: tuple[str, ...], prefix: str, problems: list[str]) -> None:
    told = ", ".join(known)
    problems += [f"{prefix}{printable(key, 60)} is not known; known are {told}" for key in table if key not in known]


def _lengths(table: Mapping[str, Any], problems: list[str]) -> dict[str, float]:
    _unknown_keys(table, tuple(_LENGTHS), "geometry_mm.", problems)
    lengths = {}
    for key, default in _LENGTHS.items():
        if key not in table and default is None:
            problems.append(f"geometry_mm.{key} must be given")
        value = _number(table, key, default or 0.0, _LONGEST_MM, "geometry_mm.", problems)
        if key in _POSITIVE and key in table and not value > 0:
            problems.append(f"geometry_mm.{key} must be larger than 0")
        lengths[f"{key}_mm"] = value
    return lengths


def _joints(table: Mapping[str, Any], problems: list[str]) -> tuple[Joint, ...]:
    numbers = [str(number) for number in range(1, 7)]
    _unknown_keys(table, tuple(numbers), "joint.", problems)
    return tuple(_joint(number, _table(table, number, problems), problems) for number in numbers)


def _joint(number: str, table: Mapping[str, Any], problems: list[str]) -> Joint:
    prefix = f"joint.{number}."
    _unknown_keys(table, (*_JOINT_NUMBERS, "spindle"), prefix, problems)
    before = len(problems)
    unknown = Joint()
    low, high, fast, sign, straight_up = (
        _number(table, key, getattr(unknown, key), _LARGEST_DEG, prefix, problems) for key in _JOINT_NUMBERS
    )
    spindle = table.get("spindle", False)
    if not isinstance(spindle, bool) or (spindle and number != "6"):
        problems.append(f"{prefix}spindle must be false, or true for joint 6")
    if sign not in (1, -1):
        problems.append(f"{prefix}sign must be 1 or -1")
    if ("lowest_deg" in table) != ("highest_deg" in table):
        problems.append(f"{prefix}lowest_deg and {prefix}highest_deg belong together; give both or neither")
    elif len(problems) == before and not low < high:
        problems.append(f"{prefix}lowest_deg must be less than {prefix}highest_deg")
    if not fast > 0:
        problems.append(f"{prefix}fastest_deg_s must be larger than 0")
    return Joint(low, high, fast, int(sign), straight_up, bool(spindle))


def _number(
    table: Mapping[str, Any], key: str, default: float, largest: float, prefix: str, problems: list[str]
) -> float:
    if key not in table:
        return default
    value = table[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        problems.append(f"{prefix}{key} must be a number")
        return 1.0
    if not abs(value) <= largest:
        problems.append(f"{prefix}{key} must lie within {largest:g}")
        return 1.0
    return float(value)
