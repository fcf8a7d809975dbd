"""Read files and make postprocessors through whichever plug-in serves them; it is imported only then.

How a plug-in registers stands in `sicp_cam.plugins.registry`; our own formats and posts do it the same way.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from sicp_cam.errors import InputError, JobError, printable
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.options.help import annotations_of
from sicp_cam.options.values import converted, nearest
from sicp_cam.plugins.options import keyword_names, takes_any
from sicp_cam.plugins.registry import FORMATS, POSTPROCESSORS, ROLES, owner, owners

if TYPE_CHECKING:
    from sicp_cam.model import Part, Scan, ToolPath

__all__ = ["check_reader", "postprocessor", "read_part", "read_path", "read_scan", "reader", "roles"]

_Kind = TypeVar("_Kind")
_NO_OPTIONS: Mapping[str, object] = MappingProxyType({})


def roles(path: Path) -> tuple[str, ...]:
    """Return the roles in which a file with this suffix can be read.

    >>> roles(Path("part.step"))
    ('part',)
    """
    claims = owners(FORMATS)
    return tuple(role for role in ROLES if f"{role}{path.suffix.lower()}" in claims)


def reader(role: str, path: Path, *, suffix: str | None = None) -> Callable[..., Any]:
    """Return the function that reads a file in a role.

    Parameters
    ----------
    role
        One of `ROLES`.
    path
        The file; only its suffix matters.
    suffix
        Treat the file as if it had this suffix.

    Raises
    ------
    InputError
        If no reader is known for the suffix.
    JobError
        If `suffix` names no reader, two distributions claim it, or the reader cannot be imported.
    """
    claims = owners(FORMATS)
    known = sorted(name.removeprefix(f"{role}.") for name in claims if name.startswith(f"{role}."))
    wanted = path.suffix.removeprefix(".").lower() if suffix is None else suffix.removeprefix(".").lower()
    name = f"{role}.{wanted}"
    if name in claims:
        function: Callable[..., Any] = owner(claims[name]).load()
        return function
    readable = f"readable: {', '.join(known)}" if known else "no reader is installed for it"
    if suffix is not None:
        raise JobError(f"{role}.format: no reader for '{printable(suffix, 40)}' as a {role}; {readable}")
    raise InputError(
        f"{printable(str(path))}: no reader for a {role} with the suffix '{printable(path.suffix, 40)}'; {readable}; "
        f"or say what it is with --set {role}.format=SUFFIX"
    )


def read_scan(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
) -> Scan:
    """Read a scan with whichever plug-in knows its suffix.

    Parameters
    ----------
    path
        The file.
    units
        Unit of its numbers where the file does not say; None leaves that to the reader.
    limits
        Caps that the reader keeps.
    options
        What the reader takes by name beyond that, and `format`: the suffix to treat the file as.

    Raises
    ------
    InputError
        If the file cannot be read.
    JobError
        If an option is unknown or of a wrong type, or the plug-in cannot be used.
    """
    from sicp_cam.model import Scan

    return _read("scan", path, units, limits, options, Scan)


def read_part(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
) -> Part:
    """Read a nominal part; parameters and errors as in `read_scan`."""
    from sicp_cam.model import Part

    return _read("part", path, units, limits, options, Part)


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
) -> ToolPath:
    """Read a tool path; parameters and errors as in `read_scan`."""
    from sicp_cam.model import ToolPath

    return _read("path", path, units, limits, options, ToolPath)


def check_reader(role: str, path: Path, options: Mapping[str, object] = _NO_OPTIONS) -> None:
    """Check that a file's suffix has a reader in a role, and that it takes these options; opens no file.

    Raises
    ------
    InputError, JobError
        As `read_scan` does for the same reasons.
    """
    _ready(role, path, options)


def postprocessor(name: str, options: Mapping[str, object] = _NO_OPTIONS) -> Any:
    """Return the postprocessor of that name, made with its options.

    Raises
    ------
    JobError
        If the name is unknown or claimed twice, its plug-in cannot be imported, or an option is wrong.
    """
    claims = owners(POSTPROCESSORS)
    if name not in claims:
        raise JobError(f"post: no postprocessor '{printable(name, 60)}'; {nearest(name, claims)}")
    return owner(claims[name]).load()(options)


def _read(
    role: str, path: Path, units: str | None, limits: Limits, options: Mapping[str, object], kind: type[_Kind]
) -> _Kind:
    function, arguments = _ready(role, path, options)
    result = function(path, units=units, limits=limits, **arguments)
    if not isinstance(result, kind):
        raise JobError(
            f"plug-in {function.__module__}:{function.__qualname__} answered with a {type(result).__name__} instead of "
            f"a {kind.__name__}; report it to its author"
        )
    return result


def _ready(role: str, path: Path, options: Mapping[str, object]) -> tuple[Callable[..., Any], dict[str, Any]]:
    """Return the reader of a file and its options in their types."""
    suffix = options.get("format")
    if suffix is not None and not isinstance(suffix, str):
        raise JobError(f"{role}.format: must be a suffix such as 'csv', not {printable(str(suffix), 40)}")
    function = reader(role, path, suffix=suffix)
    rest = {key: value for key, value in options.items() if key != "format"}
    return function, _arguments(role, function, rest)


def _arguments(role: str, function: Callable[..., Any], options: Mapping[str, object]) -> dict[str, Any]:
    known = keyword_names(function)
    taken = inspect.signature(function).parameters.keys() - set(known)
    hints = annotations_of(function) if options else {}
    arguments, problems = {}, []
    for key, value in options.items():
        if key not in known and (not takes_any(function) or key in taken):
            problems.append(f"{role}.{printable(key)}: unknown option; {nearest(key, [*known, 'format'])}")
            continue
        try:
            arguments[key] = converted(value, hints.get(key, object) if key in known else object)
        except ValueError as error:
            problems.append(f"{role}.{key}: {error}")
    if problems:
        raise JobError(*problems)
    return arguments
