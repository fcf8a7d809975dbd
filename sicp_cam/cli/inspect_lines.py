"""What `inspect` found, as lines for people."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from sicp_cam.errors import printable

__all__ = ["finding_line", "inspect_lines", "unit_words"]

_TEXT = 1000


def inspect_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines that tell of a part, a scan or a path.

    Parameters
    ----------
    document
        What `sicp_cam.inspection.inspect` returns.
    """
    for key in ("role", "path", "sha256", "format"):
        yield f"{key}: {printable(document[key], _TEXT)}"
    yield f"unit: {unit_words(document)}"
    low, high = document["bounds"]["min_mm"], document["bounds"]["max_mm"]
    yield f"bounds: {_numbers(low)} to {_numbers(high)} mm"
    yield from _BODIES[document["role"]](document)
    yield from _listed("findings", (finding_line(finding) for finding in document["findings"]))


def _part(document: Mapping[str, Any]) -> Iterator[str]:
    yield f"triangles: {document['triangles']}"
    yield from _listed("contours", (_contour(contour) for contour in document["contours"]))


def _scan(document: Mapping[str, Any]) -> Iterator[str]:
    yield f"points: {document['count']}"
    yield f"triangles: {document['triangles'] or 'none'}"
    yield f"normals: {'yes' if document['normals'] else 'none'}"
    yield f"columns: {printable(', '.join(document['columns']), _TEXT) or 'none'}"
    spacing = document["spacing_mm"]
    yield f"spacing: {'not known, too few points' if spacing is None else f'{_number(spacing)} mm'}"
    loops = (
        f"{loop['number']}: {_number(loop['length_mm'])} mm long, centre {_numbers(loop['centre_mm'])}"
        for loop in document["loops"]
    )
    yield from _listed("loops", loops)


def _path(document: Mapping[str, Any]) -> Iterator[str]:
    yield f"name: {printable(document['name'], _TEXT) or 'none'}"
    yield f"moves: {document['count']}, of which {document['rapid_moves']} rapid and {document['feed_moves']} feed"
    yield f"length: {_number(document['length_mm'])} mm"
    feeds = document["feeds_mm_min"]
    few = f", the lowest of {document['different_feeds']}" if document["different_feeds"] > len(feeds) else ""
    yield f"feeds: {_numbers(feeds)} mm/min{few}" if feeds else "feeds: none"
    events = ", ".join(f"{count} {kind}" for kind, count in document["events"].items())
    yield f"events: {events or 'none'}"


_BODIES = {"part": _part, "scan": _scan, "path": _path}


def unit_words(document: Mapping[str, Any]) -> str:
    """Say what unit the numbers of an input have, and whether it says so."""
    if document.get("unit_stated", True):
        return str(document["units"])
    return f"not stated: {document['units']} assumed (say it with --units)"


def _contour(contour: Mapping[str, Any]) -> str:
    corners = contour["corners"]
    words = [
        f"{_number(contour['length_mm'])} mm long",
        "closed" if contour["closed"] else "open",
        f"{corners or 'no'} corner{'' if corners == 1 else 's'}",
        f"centre {_numbers(contour['centre_mm'])}",
        f"looks {contour['looks']}",
    ]
    return f"{contour['number']}: {contour['kind']}, {', '.join(words)}"


def finding_line(finding: Mapping[str, Any]) -> str:
    """Return a finding as one line."""
    where = f"{finding['where']}: " if finding["where"] else ""
    return printable(f"{finding['level']} {finding['code']}: {where}{finding['message']}", _TEXT)


def _listed(name: str, entries: Iterable[str]) -> Iterator[str]:
    told = list(entries)
    yield f"{name}: {len(told) or 'none'}"
    yield from (f"  {entry}" for entry in told)


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(map(_number, values))


def _number(value: float) -> str:
    return f"{value:.7g}"
