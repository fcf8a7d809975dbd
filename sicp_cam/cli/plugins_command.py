"""`sicp-cam plugins`: who reads and writes what, and what each one takes."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json

if TYPE_CHECKING:
    from sicp_cam.findings import Finding
    from sicp_cam.plugins.options import PluginOptions
    from sicp_cam.plugins.registry import Plugin

__all__ = ["plugins"]

_UNUSABLE = 2


def plugins(
    name: str | None = None,
    /,
    *,
    check: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """List readers and writers of scans, parts and paths, postprocessors and checkers of programs, and whose they are.

    With a name, list the options of that one instead, with types, defaults and the flag that sets each.

    Parameters
    ----------
    name
        A postprocessor such as val3, a reader such as scan.asc or path.nc, or a checker such as check.nc.
    check
        Also import each one; exit code 2 if one cannot be imported, or two claim the same name.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _listed(check, as_json) if name is None else _told(name, as_json), as_json=as_json)


def _listed(check: bool, as_json: bool) -> int:
    from sicp_cam.findings import Level
    from sicp_cam.plugins.registry import broken, listing

    found, findings = listing()
    if check:
        findings += broken(found)
    code = _UNUSABLE if check and any(finding.level is not Level.INFO for finding in findings) else 0
    if as_json:
        say_json(
            {
                "schema": "sicp-cam/1",
                "status": "fail" if code else "ok",
                "exit_code": code,
                "plugins": [dataclasses.asdict(plugin) for plugin in found],
                "findings": [dataclasses.asdict(finding) for finding in findings],
            }
        )
    else:
        for line in _table(found):
            say(line)
    _log(findings, logging.ERROR if code else logging.WARNING)
    return code


def _table(found: Iterable[Plugin]) -> Iterator[str]:
    from sicp_cam.plugins.registry import CHECKERS, POSTPROCESSORS, WRITERS

    kinds = {POSTPROCESSORS: "post", WRITERS: "write {}", CHECKERS: "check"}
    rows = [
        (
            kinds.get(plugin.group, "{}").format(plugin.name.partition(".")[0]),
            plugin.name if plugin.group == POSTPROCESSORS else f".{plugin.name.partition('.')[2] or plugin.name}",
            plugin.value,
            plugin.owner + (" (override)" if plugin.override else ""),
        )
        for plugin in found
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    for row in rows:
        yield "  ".join([*(cell.ljust(width) for cell, width in zip(row[:3], widths, strict=True)), row[3]])


def _log(findings: Iterable[Finding], level: int) -> None:
    """Tell findings as loud as they matter: errors are told under -q too."""
    log = logging.getLogger("sicp_cam.cli")
    for finding in findings:
        log.log(logging.INFO if finding.level == "info" else level, "%s", finding.message)


def _told(name: str, as_json: bool) -> int:
    from sicp_cam.cli.option_lines import option_entries
    from sicp_cam.plugins.options import plugin_options, with_name

    described = [plugin_options(plugin) for plugin in with_name(name)]
    if as_json:
        entries: list[dict[str, Any]] = [
            {
                **dataclasses.asdict(one.plugin),
                "role": one.role,
                "summary": one.summary,
                "options": option_entries(one.options, f"--set {one.prefix}."),
                "any_option": one.any_option,
                "capabilities": dict(one.capabilities),
            }
            for one in described
        ]
        say_json({"schema": "sicp-cam/1", "plugins": entries})
    else:
        for number, one in enumerate(described):
            for line in ["", *_description(one)] if number else _description(one):
                say(line)
    return 0


def _description(one: PluginOptions) -> Iterator[str]:
    from sicp_cam.cli.option_lines import option_lines
    from sicp_cam.errors import printable

    plugin = one.plugin
    role = plugin.name.partition(".")[0]
    kinds = {"post": "postprocessor", "out": f"writer of a {role}", "check": "checker of programs with that suffix"}
    kind = kinds.get(one.role, f"reader of a {role}")
    yield f"{plugin.name}: {kind}, {plugin.value}, from {plugin.owner}"
    if one.summary:
        yield printable(one.summary)
    yield from (f"  {matter}: {printable(what)}" for matter, what in one.capabilities.items())
    if one.options:
        of_job = f"as below, in a job file in the table [options.{one.prefix}]"
        where = {"out": "of convert", "check": "of check"}.get(one.role, of_job)
        yield f"on the command line {where}:"
    yield from option_lines(one.options, f"--set {one.prefix}.")
    if one.any_option:
        yield "it takes options by name and does not list them; see its own documentation"
    elif not one.options:
        yield "it takes no options"
