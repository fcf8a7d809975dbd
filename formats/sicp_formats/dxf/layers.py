"""Choose which curves of a drawing are the path: by layers that the user names, or the only layer that has any."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from sicp_cam.errors import FormatError, printable
from sicp_formats.dxf.blocks import Placed
from sicp_formats.dxf.entities import NO_CURVES, is_curve
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["chosen_curves"]

_MOST_LAYERS = 12


def chosen_curves(path: Path, placed: Iterable[Placed], layers: str | None, tally: Tally) -> list[Placed]:
    """Return the curves that are the path, and note what is left out.

    Parameters
    ----------
    path
        The file, for messages.
    placed
        The entities of the drawing.
    layers
        Names of layers, separated by commas, with the wildcards ``*`` and ``?``; None for the only one with curves.
    tally
        Takes the notes.

    Raises
    ------
    FormatError
        If no curve is left, or no layers are named and several have curves.
    """
    curves, others = [], Counter[str]()
    hidden: Counter[tuple[str, str]] = Counter()
    for item in placed:
        if item.hidden:
            hidden[item.layer, item.hidden] += 1
        elif is_curve(item.entity):
            curves.append(item)
        else:
            others[item.entity.dxftype()] += 1
    _note_others(others, tally)
    curves, left_out = _of_layers(path, curves, layers)
    hidden.update(left_out)
    for (layer, why), count in sorted(hidden.items()):
        tally.note(Notice.LAYER_LEFT_OUT, 0, f"{count} on {printable(layer, 60)} ({why})", count=count)
    if not curves:
        raise FormatError(path, _nothing(others, hidden))
    return curves


def _note_others(others: Counter[str], tally: Tally) -> None:
    for kind, count in sorted(others.items()):
        notice = Notice.NO_CURVE if kind in NO_CURVES else Notice.SURFACE_LEFT_OUT
        tally.note(notice, 0, f"{count} {printable(kind, 40)}", count=count)


def _of_layers(path: Path, curves: list[Placed], layers: str | None) -> tuple[list[Placed], Counter[tuple[str, str]]]:
    counts = Counter(item.layer for item in curves)
    if layers is None:
        if len({layer.lower() for layer in counts}) > 1:
            what = f"curves lie on {len(counts)} layers: {_listed(counts)}; name those of the path with "
            raise FormatError(path, what + "--set path.layers=NAME,...")
        return curves, Counter()
    wanted = [_pattern(name.strip()) for name in layers.split(",") if name.strip()]
    idle = [pattern for pattern in wanted if not any(pattern.fullmatch(layer) for layer in counts)]
    if counts and (idle or not wanted):
        what = f"path.layers = {printable(layers, 80)!r} names a layer without visible curves"
        raise FormatError(path, f"{what}; there are: {_listed(counts)}")
    kept = {layer for layer in counts if any(pattern.fullmatch(layer) for pattern in wanted)}
    left_out = Counter({(layer, "not asked for"): count for layer, count in counts.items() if layer not in kept})
    return [item for item in curves if item.layer in kept], left_out


def _pattern(name: str) -> re.Pattern[str]:
    parts = {"*": ".*", "?": "."}
    return re.compile("".join(parts.get(letter) or re.escape(letter) for letter in name), re.IGNORECASE | re.DOTALL)


def _listed(counts: Counter[str]) -> str:
    named = [f"{printable(layer, 40)} ({count})" for layer, count in sorted(counts.items())[:_MOST_LAYERS]]
    more: Sequence[str] = [f"and {len(counts) - _MOST_LAYERS} more"] if len(counts) > _MOST_LAYERS else ()
    return ", ".join([*named, *more])


def _nothing(others: Counter[str], hidden: Counter[tuple[str, str]]) -> str:
    found = [f"{count} {kind}" for kind, count in sorted(others.items())]
    found += [f"{count} on layer {layer} ({why})" for (layer, why), count in sorted(hidden.items())]
    told = f"no visible curve in model space, but {', '.join(found[:_MOST_LAYERS])}" if found else "nothing at all"
    return f"holds {told}; export the contour into model space as lines, arcs or polylines"
