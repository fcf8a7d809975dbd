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
from sicp_cam.plugins.registry import FORMATS, POSTPROCESSORS, ROLES, WRITERS, owner, owners

if TYPE_CHECKING:
    from sicp_cam.model import Part, Scan, ToolPath

__all__ = [
    "arguments_for",
    "check_reader",
    "encoded",
    "postprocessor",
    "posts_writing",
    "read_part",
    "read_path",
    "read_scan",
    "reader",
    "roles",
    "suffix_of",
    "writable_roles",
]

_Kind = TypeVar("_Kind")
_NO_OPTIONS: Mapping[str, object] = MappingProxyType({})


def roles(path: Path) -> tuple[str, ...]:
    """Return the roles in which a file with this suffix can be read.

    >>> roles(Path("part.step"))
    ('part',)
    """
    claims = owners(FORMATS)
    return tuple(role for role in ROLES if f"{role}.{suffix_of(path)}" in claims)


def suffix_of(path: Path) -> str:
    """Return the suffix that says what a file is: in lower case, without its dot, behind `.gz` and version numbers.

    >>> suffix_of(Path("scan.PLY.gz")), suffix_of(Path("op010.ncl.3")), suffix_of(Path("part"))
    ('ply', 'ncl', '')
    """
    suffixes = [suffix.removeprefix(".").lower() for suffix in path.suffixes]
    while len(suffixes) > 1 and (suffixes[-1] == "gz" or suffixes[-1].isdigit()):
        suffixes.pop()
    return suffixes[-1] if suffixes else ""


def _dotted(path: Path) -> str:
    suffix = suffix_of(path)
    return printable(f".{suffix}", 40) if suffix else ""


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
    wanted = suffix_of(path) if suffix is None else suffix.removeprefix(".").lower()
    name = f"{role}.{wanted}"
    if name in claims:
        function: Callable[..., Any] = owner(claims[name]).load()
        return function
    readable = f"readable: {', '.join(known)}" if known else "no reader is installed for it"
    if suffix is not None:
        raise JobError(f"{role}.format: no reader for '{printable(suffix, 40)}' as a {role}; {readable}")
    raise InputError(
        f"{printable(str(path))}: no reader for a {role} with the suffix "
        f"'{_dotted(path)}'; {readable}; "
        f"or say what it is with --set {role}.format=SUFFIX"
    )


def read_scan(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
    recover: bool = False,
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
    recover
        True to repair what can be repaired; each repair is a finding. A reader that repairs nothing reads as always.

    Raises
    ------
    InputError
        If the file cannot be read.
    JobError
        If an option is unknown or of a wrong type, or the plug-in cannot be used.
    """
    from sicp_cam.model import Scan

    return _read("scan", path, units, limits, options, Scan, recover=recover)


def read_part(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
    recover: bool = False,
) -> Part:
    """Read a nominal part; parameters and errors as in `read_scan`."""
    from sicp_cam.model import Part

    return _read("part", path, units, limits, options, Part, recover=recover)


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    options: Mapping[str, object] = _NO_OPTIONS,
    recover: bool = False,
) -> ToolPath:
    """Read a tool path; parameters and errors as in `read_scan`."""
    from sicp_cam.model import ToolPath

    return _read("path", path, units, limits, options, ToolPath, recover=recover)


def check_reader(role: str, path: Path, options: Mapping[str, object] = _NO_OPTIONS) -> None:
    """Check that a file's suffix has a reader in a role, and that it takes these options; opens no file.

    Raises
    ------
    InputError, JobError
        As `read_scan` does for the same reasons.
    """
    _ready(role, path, options)


def writable_roles(path: Path) -> tuple[str, ...]:
    """Return the roles, of those that are not programs, that can be written into a file with this suffix.

    >>> writable_roles(Path("scan.pcd"))
    ('scan',)
    """
    claims = owners(WRITERS)
    return tuple(role for role in ROLES if f"{role}.{suffix_of(path)}" in claims)


def writable_suffixes() -> tuple[str, ...]:
    """Return the suffixes of everything that can be written into one file, in order."""
    scans_and_parts = {name.partition(".")[2] for name in owners(WRITERS)}
    posts = {getattr(owner(each).load(), "suffix", "").rpartition(".")[2] for each in owners(POSTPROCESSORS).values()}
    return tuple(sorted((scans_and_parts | posts) - {""}))


def encoded(
    role: str, path: Path, thing: Scan | Part, *, unit: str = "mm", options: Mapping[str, object] = _NO_OPTIONS
) -> bytes:
    """Return a scan or part as the bytes of a file, by whichever plug-in writes its suffix.

    Parameters
    ----------
    role
        `scan` or `part`.
    path
        The file; only its suffix matters, and nothing is written.
    thing
        What is to be written.
    unit
        Unit of the numbers in the file.
    options
        What the writer takes by name.

    Raises
    ------
    JobError
        If no writer is known for the suffix, an option is wrong, or the format cannot hold what is given.
    """
    claims = owners(WRITERS)
    name = f"{role}.{suffix_of(path)}"
    if name not in claims:
        known = ", ".join(sorted(each.partition(".")[2] for each in claims if each.startswith(f"{role}.")))
        raise JobError(
            f"{printable(str(path))}: nothing writes a {role} with the suffix '{_dotted(path)}';"
            f" writable: {known or 'none'}"
        )
    function = owner(claims[name]).load()
    content: bytes = function(thing, unit=unit, **arguments_for("out", function, options))
    return content


def posts_writing(path: Path) -> list[str]:
    """Return the names of the postprocessors that write files with this suffix, the one of that name first.

    Raises
    ------
    JobError
        If a postprocessor cannot be imported.
    """
    suffix = suffix_of(path)
    claims = owners(POSTPROCESSORS)
    loaded = {name: getattr(owner(each).load(), "suffix", "") for name, each in sorted(claims.items())}
    return sorted((name for name, wrote in loaded.items() if wrote == f".{suffix}"), key=lambda name: name != suffix)


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
    role: str,
    path: Path,
    units: str | None,
    limits: Limits,
    options: Mapping[str, object],
    kind: type[_Kind],
    *,
    recover: bool,
) -> _Kind:
    function, arguments = _ready(role, path, options)
    if recover and "recover" in inspect.signature(function).parameters:
        arguments["recover"] = True
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
    return function, arguments_for(role, function, rest)


def arguments_for(role: str, function: Callable[..., Any], options: Mapping[str, object]) -> dict[str, Any]:
    """Return the options of a reader, writer or checker in the types that it wants.

    Parameters
    ----------
    role
        One of `ROLES`, `out` for a writer, or `check` for a checker: what stands before the name in a message.
    function, options
        Who takes them, and what is stated.

    Raises
    ------
    JobError
        If some are unknown or of a wrong type; all of them at once.
    """
    known = keyword_names(function)
    taken = inspect.signature(function).parameters.keys() - set(known)
    hints = annotations_of(function) if options else {}
    arguments, problems = {}, []
    for key, value in options.items():
        if key not in known and (not takes_any(function) or key in taken):
            near = nearest(key, [*known, "format"] if role in ROLES else known)
            problems.append(f"{role}.{printable(key)}: unknown option; {near}")
            continue
        try:
            arguments[key] = converted(value, hints.get(key, object) if key in known else object)
        except ValueError as error:
            problems.append(f"{role}.{key}: {error}")
    if problems:
        raise JobError(*problems)
    return arguments
