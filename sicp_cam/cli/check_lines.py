"""What `check` found, as lines for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sicp_cam.cli.inspect_lines import finding_line
from sicp_cam.errors import printable

__all__ = ["check_lines", "counted"]


def check_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield for each program a line that says what it is, and a line for each finding.

    Parameters
    ----------
    document
        What `sicp_cam.checking.check` returns.
    """
    units = {entry["path"]: entry for entry in document["inputs"]}
    for program in document["programs"]:
        name = printable(program["path"])
        unread = f"not read, {program['unread']}" if program["unread"] else "cannot be read"
        yield f"{name}: {_what(program['facts'], units.get(program['path'])) or printable(unread)}"
        if program["against"] is not None:
            yield f"against {_against(program['against'])}"
        findings = program["findings"]
        yield f"findings: {len(findings) or 'none'}"
        yield from (f"  {finding_line(finding)}" for finding in findings)


def counted(count: int, noun: str) -> str:
    """Return a count with its noun.

    >>> counted(1, "move"), counted(2, "move")
    ('1 move', '2 moves')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _what(facts: Mapping[str, Any] | None, source: Mapping[str, Any] | None) -> str:
    """Say what a program is; nothing where it was not read."""
    if facts is None or source is None:
        return ""
    feeds = facts["feeds_mm_min"]
    more = facts["different_feeds"] - len(feeds)
    words = [
        facts["format"],
        f"{counted(facts['moves'], 'move')}, {facts['cuts']} of them cuts",
        f"{facts['length_mm']:.7g} mm",
        f"feeds {', '.join(f'{feed:.7g}' for feed in feeds)}{f' and {more} more' if more else ''} mm/min"
        if feeds
        else "no feeds",
        f"tools {', '.join(map(str, facts['tools']))}" if facts["tools"] else "no tool named",
        f"unit {source['units']}{'' if source['unit_stated'] else ' assumed'}",
    ]
    return printable(", ".join(words), 1000)


def _against(facts: Mapping[str, Any]) -> str:
    name = printable(facts["reference"])
    if facts["max_mm"] is None:
        return f"{name}: another path"
    axes = "" if facts["max_axis_deg"] is None else f", axes at most {facts['max_axis_deg']:.3g} degrees"
    feeds = "" if facts["max_feed_share"] is None else f", feeds at most {100.0 * facts['max_feed_share']:.3g} %"
    added = f", {facts['added_moves']} moves added" if facts["added_moves"] else ""
    return f"{name}: {facts['moves']} moves, tips at most {facts['max_mm']:.3g} mm off{axes}{feeds}{added}"
