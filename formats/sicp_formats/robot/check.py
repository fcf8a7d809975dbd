"""What checkers of robot programs share: zones against the way to the next points, names, symbols."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sicp_formats.paths.arcs import Vector
from sicp_formats.paths.defects import Check, Defects

__all__ = ["Blend", "check_blends", "check_declared", "check_name"]

_SLACK_MM = 1e-3


@dataclass(frozen=True, slots=True)
class Blend:
    """A move, for the check of its zone: where it ends (None if not known), how far from there it may be cut short."""

    tip_mm: Vector | None
    zone_mm: float
    line: int


def check_blends(defects: Defects, moves: list[Blend]) -> None:
    """Note zones that reach further than half of the way from or to the neighbouring points.

    Two zones would overlap there, and the controller makes them smaller or stops.
    """
    for at, move in enumerate(moves):
        if move.zone_mm <= 0.0 or move.tip_mm is None:
            continue
        beside = [*moves[max(at - 1, 0) : at], *moves[at + 1 : at + 2]]
        ways = [math.dist(move.tip_mm, other.tip_mm) for other in beside if other.tip_mm is not None]
        shortest = min(ways, default=math.inf)
        if move.zone_mm > 0.5 * shortest + _SLACK_MM:
            what = f"the zone of {move.zone_mm:.4g} mm is more than half of the way of {shortest:.4g} mm beside it"
            defects.warn(Check.ZONE, what, move.line)


def check_name(defects: Defects, name: str, line: int, *, longest: int, allowed: str, noun: str) -> None:
    """Note a name that is too long, or does not fully match the regular expression `allowed`."""
    if len(name) > longest:
        defects.fail(Check.NAMES, f"the {noun} {name} has {len(name)} characters, at most {longest} are allowed", line)
    if not re.fullmatch(allowed, name, re.ASCII):
        defects.fail(Check.NAMES, f"{name!r} is not allowed as a {noun}", line)


def check_declared(defects: Defects, declared: Mapping[str, int], used: Iterable[str], noun: str) -> None:
    """Note what is declared, with its line, and never used."""
    known = set(used)
    for name, line in declared.items():
        if name not in known:
            defects.info(Check.SYMBOLS, f"the {noun} {name} is declared and never used", line)
