"""`sicp-cam inspect`: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

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
        What it is, where its suffix leaves that open.
    units
        Unit of its numbers, where the file does not state one: mm, cm, m, inch.
    picture
        Also draw a part or scan into this PNG file, with the numbers of its loops or of the contours of its skins.
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
        return reported(lambda: _run(file, role, units, picture, force, set_ or [], as_json), as_json=as_json)


def _run(
    file: Path, role: Role | None, units: str | None, picture: Path | None, force: bool, pairs: list[str], as_json: bool
) -> int:
    from sicp_cam.cli.inspect_lines import inspect_lines
    from sicp_cam.job.layers import settings
    from sicp_cam.limits import Limits
    from sicp_cam.options.values import table
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

    document = inspection.inspect(
        file, role=chosen, units=units, options=options, picture=picture, force=force, limits=limits
    )
    if as_json:
        say_json(document)
    else:
        for line in inspect_lines(document):
            say(line)
    return 0


def _role(file: Path) -> str:
    from sicp_cam.job.input_files import absent, is_pose
    from sicp_cam.plugins import roles

    name = printable(str(file))
    if not file.exists():
        raise InputError(f"{name}: {absent(file)}")
    if is_pose(file):
        raise InputError(f"{name}: this is a pose, a 4x4 matrix; give it with --align")
    possible = roles(file)
    if len(possible) == 1:
        return possible[0]
    if not possible:
        job = "; if it is a job, give it to sicp-cam correct" if file.suffix.lower() == ".toml" else ""
        raise InputError(f"{name}: nothing reads this suffix; see sicp-cam plugins{job}")
    raise JobError(f"{name}: may be a {' or a '.join(possible)}; say which with --role")
