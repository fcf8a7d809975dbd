"""Judge the text of a program through whichever plug-in knows its suffix; it is imported only then."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sicp_cam.errors import JobError
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.plugins import arguments_for, suffix_of
from sicp_cam.plugins.options import keyword_names, takes_any
from sicp_cam.plugins.registry import CHECKERS, owner, owners

__all__ = ["check_program", "checker", "options_taken"]

_NO_OPTIONS: Mapping[str, object] = MappingProxyType({})


def checker(path: Path, *, suffix: str | None = None) -> Callable[..., Any] | None:
    """Return the function that judges programs of a file's suffix, None if there is none.

    Parameters
    ----------
    path
        The file; only its suffix matters.
    suffix
        Treat the file as if it had this suffix.

    Raises
    ------
    JobError
        If two distributions claim the suffix, or the checker cannot be imported.
    """
    claims = owners(CHECKERS).get(suffix_of(path) if suffix is None else suffix.removeprefix(".").lower())
    function: Callable[..., Any] | None = owner(claims).load() if claims else None
    return function


def options_taken(function: Callable[..., Any], options: Collection[str]) -> set[str]:
    """Return those of some option names that a reader or checker takes.

    >>> options_taken(lambda path, *, limits, length=80: (), ["length", "width", "limits"])
    {'length'}
    """
    return set(options) if takes_any(function) else set(options) & set(keyword_names(function))


def check_program(
    function: Callable[..., Any],
    path: Path,
    *,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
) -> tuple[Finding, ...]:
    """Judge a program and return what is to be told of it.

    Parameters
    ----------
    function
        What `checker` returned.
    path, limits
        The file, and the caps to keep.
    options
        What the checker takes by name.

    Raises
    ------
    InputError
        If the file cannot be read.
    JobError
        If an option is unknown or of a wrong type, or the plug-in answers with anything but findings.
    """
    found = function(path, limits=limits, **arguments_for("check", function, options))
    if not isinstance(found, tuple) or not all(isinstance(each, Finding) for each in found):
        raise JobError(
            f"plug-in {function.__module__}:{function.__qualname__} answered with something else than a tuple of"
            " findings; report it to its author"
        )
    return found
