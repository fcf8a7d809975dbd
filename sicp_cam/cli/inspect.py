"""`sicp-cam inspect`: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sicp_cam.cli.reader_settings import Unit
from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json

__all__ = ["inspect"]

Role = Literal["scan", "part", "path"]


def inspect(
    file: Path,
    /,
    *,
    role: Role | None = None,
    units: Annotated[Unit | None, Parameter(alias=["--scan-units", "--cad-units", "--path-units"])] = None,
    picture: Path | None = None,
    recover: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Say what is in a file: kind, unit, counts, bounds, findings; the contours of a part and the loops of a scan.

    Contours have the numbers that correct --contour takes. A contour is said to be of a skin, or of a wall: a narrow
    face between two skins, whose contours a path hardly ever follows.

    Parameters
    ----------
    file
        A scan, a part or a path.
    role
        What it is, where neither its suffix nor its content tells.
    units
        Unit of its numbers, where the file does not state one: mm, cm, m, inch.
    picture
        Also draw a part or scan into this PNG file, with the numbers of its loops or of the contours of its skins.
    recover
        Repair a damaged file where that can be done, and tell each repair as a warning.
    force
        Replace an existing picture.
    set_
        KEY=VALUE: what the reader takes, such as decimal=, or format=csv; or a cap, such as limits.points=1000000.
        May be repeated.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _run(file, role, units, picture, recover, force, set_ or [], as_json), as_json=as_json)


def _run(
    file: Path,
    role: Role | None,
    units: str | None,
    picture: Path | None,
    recover: bool,
    force: bool,
    pairs: list[str],
    as_json: bool,
) -> int:
    from sicp_cam.cli.inspect_lines import inspect_lines
    from sicp_cam.cli.reader_settings import reader_settings

    chosen = role or _role(file, units, pairs)
    limits, tables = reader_settings(pairs, [chosen])

    from sicp_cam import inspection

    document = inspection.inspect(
        file,
        role=chosen,
        units=units,
        options=tables[chosen],
        picture=picture,
        recover=recover,
        force=force,
        limits=limits,
    )
    if as_json:
        say_json(document)
    else:
        for line in inspect_lines(document):
            say(line)
    return 0


def _role(file: Path, units: str | None, pairs: list[str]) -> str:
    from sicp_cam.cli.reader_settings import reader_settings
    from sicp_cam.plugins import roles
    from sicp_cam.roles import role_of

    named = [name for name in roles(file) if any(pair.startswith(f"{name}.") for pair in pairs)]
    if len(named) == 1:
        return named[0]
    limits, _ = reader_settings(pairs, ["options"])
    return role_of(file, units=units, limits=limits)
