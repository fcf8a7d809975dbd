"""`sicp-cam settings`: what a job may set beside the options of readers and posts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json
from sicp_cam.errors import JobError, printable

if TYPE_CHECKING:
    from sicp_cam.options.help import Option

__all__ = ["settings"]


def settings(
    table: str | None = None,
    /,
    *,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """List what a job may set: its flags, and the settings of registration, tool path, gates and limits.

    Each has its type, its default and its meaning. What readers and posts take, sicp-cam plugins NAME tells.

    Parameters
    ----------
    table
        One of job, registration, toolpath, gates, limits; all if left out.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _run(table, as_json), as_json=as_json)


def _run(table: str | None, as_json: bool) -> int:
    from sicp_cam.cli.option_lines import option_entries, option_lines
    from sicp_cam.options.values import nearest

    tables = _tables()
    if table is not None and table not in tables:
        raise JobError(f"no table '{printable(table, 60)}'; {nearest(table, tables)} (for plug-ins: sicp-cam plugins)")
    wanted = [table] if table is not None else list(tables)
    flags = {name: "--" if name == "job" else f"--set {name}." for name in wanted}
    if as_json:
        entries = {name: option_entries(tables[name][1], flags[name]) for name in wanted}
        say_json({"schema": "sicp-cam/1", "settings": entries})
        return 0
    for name in wanted:
        text, options = tables[name]
        say(f"job file, {'top level' if name == 'job' else f'[{name}]'}: {text}")
        for line in option_lines(options, flags[name]):
            say(line)
    return 0


def _tables() -> dict[str, tuple[str, tuple[Option, ...]]]:
    """Return a line of text and the options of each table, and of the job itself under `job`."""
    from sicp_cam.job import Job
    from sicp_cam.job.tables import RANGES, TABLES
    from sicp_cam.options.help import dataclass_options, summary

    own = [o for o in dataclass_options(Job) if o.name not in TABLES and not o.name.endswith("_options")]
    tables = {name: (summary(kind), dataclass_options(kind, RANGES[name])) for name, kind in TABLES.items()}
    return {"job": (summary(Job), tuple(own)), **tables}
