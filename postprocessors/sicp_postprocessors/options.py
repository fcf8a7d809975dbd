"""Options of a postprocessor: a frozen dataclass filled from a job file or a command line, with every problem told."""

from __future__ import annotations

import dataclasses
import math
import re
import types
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from sicp_cam.errors import JobError, printable
from sicp_cam.ranges import Between, unwrapped
from sicp_postprocessors.text import counted

__all__ = ["THIS_POST", "NoOptions", "build_options", "flag", "outside"]

THIS_POST = "<post>"
"""Stands for the name of the post in the problems of an options dataclass, which does not know it."""

T = TypeVar("T")

_WORDS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}
_DATA_FILE = ".toml"
_LONGEST_FILE_NAME = 4096
_LONGEST_TEXT = 200
_INTEGER = re.compile(r"[+-]?[0-9]{1,18}", re.ASCII)
_NUMBER = re.compile(r"[+-]?([0-9]{1,18}(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,3})?", re.ASCII)


@dataclasses.dataclass(frozen=True, slots=True)
class NoOptions:
    """A postprocessor without options."""


def build_options(post: str, kind: type[T], given: Mapping[str, object]) -> T:
    """Build the options of a postprocessor, and refuse what does not fit.

    Values may be of the field's own type, or strings as they come from a command line. Fields may be of type bool,
    int, float, str, `Literal[...]` of strings (taken in upper or lower case), a fixed-length tuple of floats, or one
    of these `| None`; `Annotated[float, Between(0.1, 100.0)]` states the range. What goes beyond one field is the
    concern of the dataclass: its `__post_init__` raises `JobError` with one problem per argument, in which `THIS_POST`
    becomes the name of the post.

    Raises
    ------
    JobError
        With every problem found: unknown names, wrong types, values out of range.

    >>> @dataclasses.dataclass(frozen=True)
    ... class Speeds:
    ...     rapid_mm_s: float = 250.0
    ...     blend: bool = False
    >>> build_options("demo", Speeds, {"rapid_mm_s": "2000", "blend": "true"})
    Speeds(rapid_mm_s=2000.0, blend=True)
    >>> build_options("demo", Speeds, {"rapid": 1, "blend": 7})
    Traceback (most recent call last):
    sicp_cam.errors.JobError: post demo has no option 'rapid'; it has rapid_mm_s, blend; option 'blend' of post demo \
must be true or false, not 7
    """
    names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]  # T is a dataclass by contract
    hints = get_type_hints(kind, include_extras=True)
    problems: list[str] = []
    values: dict[str, Any] = {}
    for name, value in given.items():
        if name not in names:
            known = f"it has {', '.join(names)}" if names else "it has none"
            problems.append(f"post {post} has no option {printable(str(name))!r}; {known}")
            continue
        try:
            values[name] = _in_range(_convert(value, unwrapped(hints[name])[0]), unwrapped(hints[name])[1])
        except ValueError as error:
            problems.append(f"option {name!r} of post {post} must be {error}, not {printable(repr(value))}")
    try:
        options = kind(**values)
    except JobError as error:
        problems += [f"post {post}: {problem.replace(THIS_POST, post)}" for problem in error.problems]
    if problems:
        raise JobError(*problems)
    return options


def flag(post: str, option: str, value: str) -> str:
    """Return the words of the command line that set an option of a post.

    >>> flag("val3", "blend", "off")
    '--set post.val3.blend=off'
    """
    return f"--set post.{post}.{option}={value}"


def outside(name: str, value: float, smallest: float, largest: float) -> list[str]:
    """Return the problem of an option outside its range, as a list that is empty if there is none.

    >>> outside("decimals", 9, 3, 6)
    ["option 'decimals' must be from 3 to 6, not 9"]
    """
    if smallest <= value <= largest:
        return []
    return [f"option {name!r} must be from {smallest:g} to {largest:g}, not {value:g}"]


def _in_range(value: Any, allowed: Between | None) -> Any:
    if allowed is not None and value is not None and not allowed.allows(value):
        raise ValueError(str(allowed))
    return value


def _convert(value: object, hint: Any) -> Any:
    """Return a value as the type of its field; ValueError names what would fit."""
    if get_origin(hint) in (Union, types.UnionType):
        if value is None or (isinstance(value, str) and value.strip().lower() in ("", "none")):
            return None
        return _convert(value, next(kind for kind in get_args(hint) if kind is not types.NoneType))
    if get_origin(hint) is Literal:
        words = {word.lower(): word for word in get_args(hint)}
        if isinstance(value, str) and value.strip().lower() in words:
            return words[value.strip().lower()]
        raise ValueError(f"one of {', '.join(map(str, get_args(hint)))}")
    if get_origin(hint) is tuple:
        return _numbers(value, len(get_args(hint)))
    converters: dict[Any, Callable[[object], Any]] = {bool: _truth, int: _integer, float: _number, str: _text}
    if hint not in converters:
        raise TypeError(f"an option may not be of type {hint}")
    return converters[hint](value)


def _truth(value: object) -> bool:
    if isinstance(value, bool):
        return value
    if isinstance(value, str) and value.strip().lower() in _WORDS:
        return _WORDS[value.strip().lower()]
    raise ValueError("true or false")


def _integer(value: object) -> int:
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    if isinstance(value, str) and _INTEGER.fullmatch(value.strip()):
        return int(value)
    raise ValueError("a whole number")


def _number(value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if abs(value) < 1e18 else math.inf
    elif isinstance(value, str) and _NUMBER.fullmatch(value.strip()):
        number = float(value)
    else:
        raise ValueError("a number")
    if not math.isfinite(number):
        raise ValueError("a finite number")
    return number


def _numbers(value: object, count: int) -> tuple[float, ...]:
    parts = value.split(",") if isinstance(value, str) else value
    if not isinstance(parts, Sequence) or len(parts) != count:
        raise ValueError(counted(count, "number"))
    try:
        return tuple(_number(part) for part in parts)
    except ValueError:
        raise ValueError(counted(count, "number")) from None


def _text(value: object) -> str:
    if isinstance(value, str) and value.isprintable():
        # A data file lies in whatever folder the user has; every other text may end up in a program.
        if value.strip().lower().endswith(_DATA_FILE) and len(value) <= _LONGEST_FILE_NAME:
            return value
        if value.isascii() and len(value) <= _LONGEST_TEXT:
            return value
    raise ValueError("a line of plain text (printable ASCII)")
