"""`sicp-cam inspect`: what is in a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json
from sicp_cam.errors import InputError, JobError, printable

__all__ = ["inspect"]

Role = Literal["scan", "part", "path"]


def inspect(
    file: Path,
    /,
    *,
    role: Role | None = None,
    units: str | None = None,
    picture: Path | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Say what is in a file: kind, units, counts, bounds, findings, and for parts and scans their numbered loops.

    Parameters
    ----------
    file
        A scan, a part or a path.
    role
        What it is, where its suffix leaves that open.
    units
        Unit of its numbers, where the file does not state one: mm, cm, m, inch.
    picture
        Also draw it into this PNG file.
    set_
        KEY=VALUE: what the reader takes, such as decimal=, or format=csv; or a cap, such as limits.points=1000000.
        May be repeated.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _run(file, role, units, picture, set_ or [], as_json), as_json=as_json)


def _run(
    file: Path, role: Role | None, units: str | None, picture: Path | None, pairs: list[str], as_json: bool
) -> int:
    from sicp_cam.job_layers import settings
    from sicp_cam.limits import Limits
    from sicp_cam.option_values import table
    from sicp_cam.units import mm_per_unit

    if units is not None:
        mm_per_unit(units)
    chosen = role or _role(file)
    options: dict[str, object] = {}
    caps: dict[str, object] = {}
    for key, value in settings({}, pairs).values.items():
        own_key = key.removeprefix(f"options.{chosen}.")
        if own_key.startswith("limits."):
            caps[own_key.removeprefix("limits.")] = value
        else:
            options[own_key] = value
    limits, problems = table(Limits, caps)
    if limits is None:
        raise JobError(*(f"limits.{key}: {problem}" for key, problem in problems.items()))

    from sicp_cam import inspection

    document = inspection.inspect(file, role=chosen, units=units, options=options, picture=picture, limits=limits)
    if as_json:
        say_json(document)
    else:
        for line in _lines(document, 0):
            say(line)
    return 0


def _role(file: Path) -> str:
    from sicp_cam.plugins import roles

    possible = roles(file)
    if len(possible) == 1:
        return possible[0]
    if not possible:
        raise InputError(f"{printable(str(file))}: nothing reads this suffix; see sicp-cam plugins")
    raise JobError(f"{printable(str(file))}: may be a {' or a '.join(possible)}; say which with --role")


def _lines(value: Any, depth: int) -> Iterator[str]:
    indent = "  " * depth
    for key, item in value.items() if isinstance(value, dict) else enumerate(value, 1):
        if isinstance(item, dict | list | tuple) and not _plain(item):
            yield f"{indent}{key}:"
            yield from _lines(item, depth + 1)
        else:
            yield f"{indent}{key}: {_text(item)}"


def _plain(item: Any) -> bool:
    return not isinstance(item, dict) and not any(isinstance(part, dict | list | tuple) for part in item)


def _text(item: Any) -> str:
    if isinstance(item, list | tuple):
        return ", ".join(_text(part) for part in item)
    if isinstance(item, float):
        return f"{item:.6g}"
    return printable("-" if item is None else str(item), 1000)
