"""What may be set: name, type, default and text of every option, read from the code that takes it.

Posts and settings are dataclasses, with a text under each field or a `Parameters` section; readers are functions, whose
keyword-only parameters are told of in such a section (numpydoc).
"""

from __future__ import annotations

import ast
import inspect
import itertools
import math
import re
import textwrap
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from enum import Enum
from pathlib import Path
from typing import Any, Literal, Union

from sicp_cam.errors import JobError
from sicp_cam.options.values import Range
from sicp_cam.ranges import unwrapped

__all__ = ["Option", "annotations_of", "dataclass_options", "function_options", "parameter_texts", "summary", "written"]

_NO_RANGES: Mapping[str, Range] = types.MappingProxyType({})
_ANY_NUMBER: Range = (-math.inf, math.inf)
_NOT_NEGATIVE: Range = (0.0, math.inf)
_TYPES: Mapping[Any, str] = types.MappingProxyType(
    {
        bool: "true or false",
        int: "whole number",
        float: "number",
        str: "text",
        Path: "file name",
        types.NoneType: "none",
        None: "none",
        Any: "anything",
        object: "anything",
    }
)
_SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}[ ]*$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Option:
    """One thing that may be set.

    Parameters
    ----------
    name
        As the dataclass or function calls it.
    type
        What it takes, in words.
    default
        What holds if it is left out, as it is written; None where it must be given.
    text
        What its author says about it; may be empty.
    """

    name: str
    type: str
    default: str | None
    text: str


def dataclass_options(kind: type, ranges: Mapping[str, Range] | None = None) -> tuple[Option, ...]:
    """Describe the fields of a dataclass.

    Parameters
    ----------
    kind
        The dataclass; its texts stand under the fields, or in its `Parameters` section.
    ranges
        Least and largest value of a numeric field, where others must not be negative; no range is told if left out.

    >>> from sicp_cam.registration.settings import RegistrationSettings
    >>> dataclass_options(RegistrationSettings, {"overlap": (0.0, 0.5)})[1]  # doctest: +ELLIPSIS
    Option(name='overlap', type='number from 0 to 0.5', default='0.3', text='Fraction of the mean length ...')
    """
    texts = parameter_texts(kind) | _texts_under_fields(kind)
    hints = annotations_of(kind)
    options = []
    for field in fields(kind):
        value = field.default_factory() if field.default_factory is not MISSING else field.default
        allowed = _ANY_NUMBER if ranges is None else ranges.get(field.name, _NOT_NEGATIVE)
        default = None if value is MISSING else written(value)
        options.append(Option(field.name, _type(hints[field.name], allowed), default, texts.get(field.name, "")))
    return tuple(options)


def function_options(function: Callable[..., Any], names: typing.Iterable[str]) -> tuple[Option, ...]:
    """Describe some keyword-only parameters of a function, by its `Parameters` section."""
    texts, hints, parameters = (
        parameter_texts(function),
        annotations_of(function),
        inspect.signature(function).parameters,
    )
    options = []
    for name in names:
        default = parameters[name].default
        told = None if default is inspect.Parameter.empty else written(default)
        options.append(Option(name, _type(hints.get(name, object), _ANY_NUMBER), told, texts.get(name, "")))
    return tuple(options)


def annotations_of(thing: Any) -> dict[str, Any]:
    """Return the annotations of a function or class as types.

    Raises
    ------
    JobError
        If one names what its module does not have, or has for type checkers only.
    """
    try:
        return typing.get_type_hints(thing, include_extras=True)
    except (NameError, AttributeError, TypeError) as error:
        where = f"{thing.__module__}:{thing.__qualname__}"
        raise JobError(
            f"plug-in {where}: a type of its options is not known: {error}; report it to its author"
        ) from error


def written(value: object) -> str:
    """Return a value as it is written behind `--set KEY=`, an empty text as two quotes.

    >>> written(None), written(True), written((1.0, 2.5)), written("")
    ('none', 'true', '1.0,2.5', '""')
    """
    if isinstance(value, Enum):
        return written(value.value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return ",".join(written(item) for item in value) or "none"
    return "none" if value is None else str(value) or '""'


def summary(thing: Any) -> str:
    """Return the first line of a docstring, or nothing."""
    return (inspect.getdoc(thing) or "").partition("\n")[0]


def parameter_texts(thing: Any) -> dict[str, str]:
    """Return the text of each name in the `Parameters` section of a docstring."""
    doc = inspect.getdoc(thing) or ""
    sections = list(_SECTION.finditer(doc))
    ends = [*(section.start() for section in sections), len(doc)][1:]
    texts: dict[str, str] = {}
    for section, end in zip(sections, ends, strict=True):
        if section[1] == "Parameters":
            for entry in re.split(r"\n(?=\S)", doc[section.end() : end].strip("\n")):
                names, _, text = entry.partition("\n")
                told = _one_line(text)
                texts |= {name.strip().lstrip("*"): told for name in names.partition(" :")[0].split(",")}
    return texts


def _texts_under_fields(kind: type) -> dict[str, str]:
    """Return the text under each field, those of a base class first; none where there is no source."""
    texts: dict[str, str] = {}
    for owner in reversed(kind.__mro__):
        try:
            (definition,) = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
        except (OSError, TypeError, SyntaxError, ValueError):
            continue
        for field, text in itertools.pairwise(getattr(definition, "body", ())):
            if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
                continue
            if (
                isinstance(text, ast.Expr)
                and isinstance(text.value, ast.Constant)
                and isinstance(text.value.value, str)
            ):
                texts[field.target.id] = _one_line(text.value.value)
    return texts


def _one_line(text: str) -> str:
    return " ".join(text.replace("``", "`").split())


def _type(wanted: Any, allowed: Range, count: str = "") -> str:
    """Say in words what an annotation wants; `count` is how many of them."""
    wanted, stated = unwrapped(wanted)
    allowed = (stated.lowest, stated.highest) if stated else allowed
    origin, parts = typing.get_origin(wanted), typing.get_args(wanted)
    many = "s" if count else ""
    if origin in (Union, types.UnionType):
        return ", or ".join(_type(part, allowed) for part in sorted(parts, key=lambda part: part is types.NoneType))
    if origin is Literal or (isinstance(wanted, type) and issubclass(wanted, Enum)):
        choices = parts if origin is Literal else tuple(member.value for member in wanted)
        return _either([written(choice) for choice in choices])
    if origin is tuple and len(parts) == 2 and parts[1] is Ellipsis:
        return f"list of {_type(parts[0], allowed, 'many')}, separated by commas"
    if origin is tuple:
        return f"{len(parts)} {_type(parts[0], _ANY_NUMBER, 'many')}, separated by commas"
    words = _TYPES.get(wanted) or (wanted.__name__ if isinstance(wanted, type) and origin is None else str(wanted))
    return f"{words}{many}{_span(allowed) if wanted in (int, float) else ''}"


def _either(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _span(allowed: Range) -> str:
    low, high = allowed
    if high < math.inf:
        return f" from {low:.12g} to {high:.12g}"
    return f" of at least {low:.12g}" if low > -math.inf else ""
