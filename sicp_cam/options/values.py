"""Values that a user states - in a job file, on the command line, in the environment - brought to the type wanted.

A job file has types of its own, so `"1.5"` there is a text and no number. A word typed on a command line has none:
it comes as `Word` and is read as whatever is wanted.
"""

from __future__ import annotations

import math
import os
import re
import types
import typing
from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, TypeVar, Union

from sicp_cam.errors import printable
from sicp_cam.ranges import unwrapped

__all__ = ["Range", "Word", "closest", "converted", "nearest", "table"]

_INTEGER = re.compile(r"[+-]?[0-9]{1,18}", re.ASCII)
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?", re.ASCII)
Range: TypeAlias = tuple[float, float]
_ANY_RANGE: Mapping[str, Range] = types.MappingProxyType({})
_YES_NO = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


class Word(str):
    """A text without a type of its own, from the command line or the environment."""

    __slots__ = ()


class _DataclassType(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Any]]


_Table = TypeVar("_Table", bound=_DataclassType)


def converted(value: object, wanted: Any) -> Any:
    """Return a stated value as the type that an annotation wants.

    Knows bool, int, float, str, Path, enumerations, Literal, tuples and unions of them; `object` and `Any` take
    everything. A bool is no number, a number must be finite, and within its `Between` where it is annotated with one.

    Raises
    ------
    ValueError
        If the value is not of the type; the message says what is wanted and fits behind "KEY: ".

    >>> converted(Word("14"), int | None), converted(2, float), converted(Word("a,b"), tuple[str, ...])
    (14, 2.0, ('a', 'b'))
    >>> converted("1.5", float)
    Traceback (most recent call last):
        ...
    ValueError: must be a number, not the text '1.5'
    """
    wanted, allowed = unwrapped(wanted)
    if allowed is not None:
        number = converted(value, wanted)
        if number is not None and not allowed.allows(number):
            raise ValueError(f"must be {allowed}, not {number:g}")
        return number
    origin = typing.get_origin(wanted)
    if wanted is Any or wanted is object:
        return str(value) if isinstance(value, Word) else value
    if origin is Union or origin is types.UnionType:
        return _one_of(value, typing.get_args(wanted))
    if origin is Literal:
        return _choice(value, typing.get_args(wanted))
    if origin is tuple:
        return _several(value, typing.get_args(wanted))
    if isinstance(wanted, type) and issubclass(wanted, Enum):
        return wanted(_choice(value, tuple(member.value for member in wanted)))
    if wanted in _SIMPLE:
        return _SIMPLE[wanted](value)
    raise ValueError(f"cannot be set from a job: its type {wanted!r} has no written form")


def table(
    kind: type[_Table], values: Mapping[str, object], ranges: Mapping[str, Range] = _ANY_RANGE
) -> tuple[_Table | None, dict[str, str]]:
    """Build a dataclass of settings from stated values.

    Parameters
    ----------
    kind
        A dataclass whose fields all have defaults.
    values
        Value by field name.
    ranges
        Least and largest value of a numeric field, both allowed; fields not named must not be negative.

    Returns
    -------
    object or None
        The dataclass, or None where there are problems.
    dict
        What is wrong by key: unknown, of a wrong type, out of range.

    >>> from sicp_cam.registration.settings import RegistrationSettings
    >>> table(RegistrationSettings, {"segmets": 3})
    (None, {'segmets': 'unknown key; did you mean segments?'})
    """
    wanted = typing.get_type_hints(kind)
    names = [field.name for field in fields(kind)]
    built, problems = {}, {}
    for key, value in values.items():
        if key not in names:
            problems[key] = f"unknown key; {nearest(key, names)}"
            continue
        try:
            built[key] = _within(converted(value, wanted[key]), ranges.get(key, (0.0, math.inf)))
        except ValueError as error:
            problems[key] = str(error)
    return (None, problems) if problems else (kind(**built), problems)


def nearest(key: str, known: typing.Iterable[str]) -> str:
    """Say which known key was probably meant, or which keys there are.

    >>> nearest("stabilty", ["stability", "overlap"]), nearest("x", ["stability"])
    ('did you mean stability?', 'known: stability')
    """
    names = sorted(known)
    close = closest(key, names)
    if close:
        return f"did you mean {printable(close)}?"
    return f"known: {', '.join(map(printable, names))}" if names else "none is known here"


def closest(word: str, known: typing.Iterable[str]) -> str | None:
    """Return the known word that was probably meant, whatever its case; None if none is near.

    >>> closest("VAL3", ["csv", "val3"]), closest("x", ["csv"])
    ('val3', None)
    """
    import difflib

    names = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), names, n=1)
    return names[close[0]] if close else None


def _within(value: Any, allowed: Range) -> Any:
    low, high = allowed
    if isinstance(value, int | float) and not isinstance(value, bool) and not low <= value <= high:
        span = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
        raise ValueError(f"must be {span}, not {value:g}")
    return value


def _shown(value: object) -> str:
    if isinstance(value, str):
        return f"{'' if isinstance(value, Word) else 'the text '}'{printable(value, 60)}'"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple | dict):
        return "a table" if isinstance(value, dict) else "a list"
    return printable(str(value), 60)


def _bool(value: object) -> bool:
    if isinstance(value, bool):
        return value
    if isinstance(value, Word) and value.lower() in _YES_NO:
        return _YES_NO[value.lower()]
    raise ValueError(f"must be true or false, not {_shown(value)}")


def _int(value: object) -> int:
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    if isinstance(value, Word) and _INTEGER.fullmatch(value):
        return int(value)
    raise ValueError(f"must be a whole number, not {_shown(value)}")


def _float(value: object) -> float:
    if isinstance(value, Word) and _NUMBER.fullmatch(value):
        value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"must be a number, not {_shown(value)}")
    if not math.isfinite(value) or abs(value) > 1e300:
        raise ValueError(f"must be a finite number, not {_shown(value)}")
    return float(value)


def _str(value: object) -> str:
    if isinstance(value, str):
        return str(value)
    raise ValueError(f"must be a text, not {_shown(value)}")


def _path(value: object) -> Path:
    if not isinstance(value, str | os.PathLike):
        raise ValueError(f"must be a file name, not {_shown(value)}")
    if not os.fspath(value) or "\0" in os.fspath(value):
        raise ValueError("must be a file name, not empty and without NUL")
    return Path(value)


def _none(value: object) -> None:
    if value is None or (isinstance(value, Word) and value.lower() == "none"):
        return
    raise ValueError(f"must be none, not {_shown(value)}")


_SIMPLE: dict[Any, Any] = {
    bool: _bool,
    int: _int,
    float: _float,
    str: _str,
    Path: _path,
    type(None): _none,
    None: _none,
}


def _choice(value: object, choices: tuple[Any, ...]) -> Any:
    for choice in choices:
        if type(choice) is bool or not isinstance(value, Word):
            same = type(value) is type(choice) and value == choice
        else:
            same = value == str(choice)
        if same:
            return choice
    names = [str(choice) for choice in choices]
    close = closest(value, names) if isinstance(value, str) else None
    hint = f" (did you mean {close}?)" if close else ""
    raise ValueError(f"must be one of {', '.join(names)}, not {_shown(value)}{hint}")


def _one_of(value: object, kinds: tuple[Any, ...]) -> Any:
    complaint: ValueError | None = None
    for kind in sorted(kinds, key=lambda kind: kind is str):  # a text takes everything, so it is tried last
        try:
            return converted(value, kind)
        except ValueError as error:
            complaint = complaint if kind in (None, type(None)) else error
    raise complaint or ValueError(f"must be none, not {_shown(value)}")


def _several(value: object, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
    if isinstance(value, Word):
        items: list[object] = [Word(item.strip()) for item in value.split(",")] if value.strip() else []
    elif isinstance(value, list | tuple):
        items = list(value)
    else:
        raise ValueError(f"must be a list, not {_shown(value)}")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(converted(item, kinds[0]) for item in items)
    if len(items) != len(kinds):
        raise ValueError(f"must have {len(kinds)} items, not {len(items)}")
    return tuple(converted(item, kind) for item, kind in zip(items, kinds, strict=True))
