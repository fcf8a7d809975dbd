"""Machines from kinematics files: those of this package by name, or a file of the user's, in TOML.

::

    name = "Trunnion of cell 2"
    home_axis = [0, 0, 1]           # from tip to holder at zero; this if left out
    [[rotary]]                      # the axis next to the part first: tables before heads, the carrying head first
    letter = "C"
    on = "table"                    # or head
    direction = [0, 0, 1]           # of its line at zero, in the machine frame; any length
    sense = "tool"                  # see `RotaryAxis`; "table" where the table itself turns right-handed at plus
    point_mm = [0, 0, 120.5]        # on its line: of a table in the machine frame, of a head from the gauge point
    limits_deg = [-36000, 36000]    # these if left out
    wrap = "none"                   # or 0..360, +-180
    [[rotary]]
    letter = "A"
    on = "table"
    direction = [1, 0, 0]
    point_mm = [0, 0, 85.0]         # of a head, `pivot_mm = 180` is the point at that distance from the gauge point
    limits_deg = [-120, 30]
    [linear_limits_mm]              # travel of the gauge point in the machine frame; not checked if left out
    X = [-400, 400]
    Y = [-250, 250]
    Z = [0, 500]
    [sources]                       # where the numbers are from, any keys
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

from sicp_cam.errors import JobError, printable
from sicp_postprocessors.data_files import read_toml, toml_from_text
from sicp_postprocessors.gcode.machine import NO_LIMITS_DEG, WRAPS, Machine, RotaryAxis, Vector

__all__ = ["load_machine", "machine_from_text", "machine_names"]

_LARGEST = 1e6
_KEYS = ("name", "home_axis", "rotary", "linear_limits_mm", "sources")
_ROTARY_KEYS = ("letter", "on", "direction", "sense", "point_mm", "pivot_mm", "limits_deg", "wrap")


def machine_names() -> list[str]:
    """Return the names of the machines of this package.

    >>> "table-ac" in machine_names()
    True
    """
    return sorted(_presets())


def load_machine(machine: str) -> Machine:
    """Return the machine of a name, in upper or lower case, or of a file whose name ends in `.toml`.

    Raises
    ------
    JobError
        If there is none, or with every problem of the file.
    """
    if not machine.lower().endswith(".toml"):
        if machine.lower() not in _presets():
            known = ", ".join(machine_names())
            raise JobError(f"machine {printable(machine, 60)!r} is not known; known are {known}, or a file NAME.toml")
        return _built(_presets()[machine.lower()], machine)
    return _built(read_toml(machine, "machine"), machine)


def machine_from_text(text: str, file: str) -> Machine:
    """Build a machine from the text of a kinematics file.

    Raises
    ------
    JobError
        With every problem, each with the key that it is about.

    >>> machine_from_text('name = "x"', "my.toml")
    Traceback (most recent call last):
    sicp_cam.errors.JobError: machine file my.toml: rotary must be two tables [[rotary]]
    """
    return _built(toml_from_text(text, file, "machine"), file)


@cache
def _presets() -> dict[str, dict[str, Any]]:
    text = (resources.files("sicp_postprocessors.gcode") / "machines.toml").read_text("utf-8")
    return tomllib.loads(text)


def _built(table: Mapping[str, Any], file: str) -> Machine:
    problems = [f"{printable(key)} is not known here" for key in table if key not in _KEYS]
    name = table.get("name", "")
    if not (isinstance(name, str) and name.strip() and name.isascii() and name.isprintable() and len(name) <= 60):
        problems.append("name must be a text of up to 60 characters of printable ASCII")
    home = _direction(table.get("home_axis", [0, 0, 1]), "home_axis", problems)
    limits = _linear_limits(table.get("linear_limits_mm"), problems)
    entries = table.get("rotary")
    if not (isinstance(entries, list) and len(entries) == 2 and all(isinstance(e, dict) for e in entries)):
        raise JobError(*(f"machine file {printable(file)}: {p}" for p in [*problems, _NO_ROTARY]))
    axes = [_rotary(entry, f"rotary {number}", home, problems) for number, entry in enumerate(entries, 1)]
    machine = Machine(str(name), (axes[0], axes[1]), home, limits)
    problems += [] if problems else machine.problems()
    if problems:
        raise JobError(*(f"machine file {printable(file)}: {problem}" for problem in problems))
    return machine


_NO_ROTARY = "rotary must be two tables [[rotary]]"


def _rotary(entry: Mapping[str, Any], where: str, home: Vector, problems: list[str]) -> RotaryAxis:
    problems += [f"{where}: {printable(key)} is not known here" for key in entry if key not in _ROTARY_KEYS]
    letter = _one_of(entry, "letter", ("A", "B", "C"), where, problems)
    on = _one_of(entry, "on", ("head", "table"), where, problems)
    sense = _one_of({"sense": "tool"} | dict(entry), "sense", ("tool", "table"), where, problems)
    wrap = _one_of({"wrap": "none"} | dict(entry), "wrap", WRAPS, where, problems)
    direction = _direction(entry.get("direction"), f"{where}: direction", problems)
    point = _vector(entry["point_mm"], f"{where}: point_mm", problems) if "point_mm" in entry else None
    if "pivot_mm" in entry:
        pivot = entry["pivot_mm"]
        if on != "head" or point is not None or not _is_number(pivot):
            problems.append(f"{where}: pivot_mm is a number for a head without point_mm")
        else:
            point = (pivot * home[0], pivot * home[1], pivot * home[2])
    limits = _range(entry.get("limits_deg", list(NO_LIMITS_DEG)), f"{where}: limits_deg", problems)
    return RotaryAxis(letter, direction, on, sense, point, limits, wrap)


def _linear_limits(table: object, problems: list[str]) -> tuple[tuple[float, float], ...] | None:
    if table is None:
        return None
    if not (isinstance(table, dict) and set(table) == set("XYZ")):
        problems.append("linear_limits_mm must state X, Y and Z")
        return None
    return tuple(_range(table[axis], f"linear_limits_mm: {axis}", problems) for axis in "XYZ")


def _one_of(entry: Mapping[str, Any], key: str, known: tuple[str, ...], where: str, problems: list[str]) -> str:
    if entry.get(key) in known:
        return str(entry[key])
    problems.append(f"{where}: {key} must be one of {', '.join(known)}")
    return known[0]


def _range(value: object, what: str, problems: list[str]) -> tuple[float, float]:
    if isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)) and value[0] < value[1]:
        return (float(value[0]), float(value[1]))
    problems.append(f"{what} must be a lower and a higher number")
    return NO_LIMITS_DEG


def _direction(value: object, what: str, problems: list[str]) -> Vector:
    vector = _vector(value, what, problems)
    length = math.hypot(*vector)
    if length < 1e-6:
        if not problems or what not in problems[-1]:
            problems.append(f"{what} has no length")
        return (0.0, 0.0, 1.0)
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def _vector(value: object, what: str, problems: list[str]) -> Vector:
    if isinstance(value, list) and len(value) == 3 and all(map(_is_number, value)):
        return (float(value[0]), float(value[1]), float(value[2]))
    problems.append(f"{what} must be three numbers")
    return (0.0, 0.0, 0.0)


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) and abs(value) <= _LARGEST
