"""`sicp-cam plugins`: who reads and writes what."""

from __future__ import annotations

import dataclasses
from typing import Annotated

from cyclopts import Parameter

from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json

__all__ = ["plugins"]


def plugins(
    *,
    check: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """List the readers of scans, parts and paths, and the postprocessors, with the distributions they come from.

    Parameters
    ----------
    check
        Also import each one, and report those that fail.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """
    with logging_to(talk):
        return reported(lambda: _run(check, as_json), as_json=as_json)


def _run(check: bool, as_json: bool) -> int:
    import logging

    from sicp_cam.plugin_registry import POSTPROCESSORS, broken, listing

    found, findings = listing()
    if check:
        findings += broken(found)
    if as_json:
        say_json(
            {
                "schema": "sicp-cam/1",
                "plugins": [dataclasses.asdict(plugin) for plugin in found],
                "findings": [dataclasses.asdict(finding) for finding in findings],
            }
        )
        return 0
    rows = [
        (
            "post" if plugin.group == POSTPROCESSORS else plugin.name.partition(".")[0],
            plugin.name if plugin.group == POSTPROCESSORS else f".{plugin.name.partition('.')[2]}",
            plugin.value,
            plugin.owner + (" (override)" if plugin.override else ""),
        )
        for plugin in found
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    for row in rows:
        say("  ".join([*(cell.ljust(width) for cell, width in zip(row[:3], widths, strict=True)), row[3]]))
    for finding in findings:
        logging.getLogger("sicp_cam.cli").log(
            logging.WARNING if finding.level != "info" else logging.INFO, finding.message
        )
    return 0
