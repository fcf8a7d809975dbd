"""The values of a result document (schema `sicp-cam/1`), read and put into words.

The document may come from an earlier run or another version: what it does not state is printed as "-", what has the
wrong type is an error that names the key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sicp_cam.errors import ReportError

__all__ = ["entries", "listed", "number", "percent", "section", "sequence", "text", "with_unit"]


def section(parent: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return an object of the document, empty where it is not stated.

    Raises
    ------
    ReportError
        If it is something else.
    """
    value = parent.get(key)
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ReportError(f"result: '{key}' must be an object, not {type(value).__name__}; repeat the run")
    return value


def entries(parent: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """Return a list of objects of the document, empty where it is not stated; otherwise as `section`."""
    found = sequence(parent.get(key) or [], key)
    if not all(isinstance(entry, Mapping) for entry in found):
        raise ReportError(f"result: '{key}' must be a list of objects; repeat the run")
    return list(found)


def sequence(value: Any, key: str) -> Sequence[Any]:
    """Return a list as it is; a `ReportError` that names the key where it is none."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise ReportError(f"result: '{key}' must be a list, not {type(value).__name__}; repeat the run")
    return value


def text(value: object, absent: str = "-") -> str:
    """Return a value as text, and another text where there is none."""
    return absent if value is None or value == "" else str(value)


def number(value: object, decimals: int | None = None) -> str:
    """Format a number: with fixed decimals, or with four significant digits; anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return text(value)
    if not math.isfinite(value):
        return str(value)
    if decimals is None:
        return f"{value:.4g}"
    shown = f"{value:.{decimals}f}"
    return shown[1:] if float(shown) == 0.0 and shown.startswith("-") else shown


def percent(value: object) -> str:
    """Format a fraction in percent."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{number(100.0 * float(str(value)), 1)} %" if is_number else text(value)


def with_unit(section: Mapping[str, Any], keys: Sequence[str], unit: str) -> str:
    """Format some numbers of one object, with three decimals and their unit."""
    return " / ".join(number(section.get(key), 3) for key in keys) + f" {unit}"


def listed(values: Any, key: str, decimals: int = 3) -> str:
    """Format a list of numbers."""
    return "   ".join(number(value, decimals) for value in sequence(values or [], key)) or "-"
