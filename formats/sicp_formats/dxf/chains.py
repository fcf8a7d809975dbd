"""Join the curves of a drawing to chains and loops by their ends, and bring those into an order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from sicp_cam.model import FloatArray, IntArray

__all__ = [
    "SAME_PLACE_MM",
    "BranchingError",
    "Direction",
    "Strand",
    "directed",
    "in_nearest_order",
    "joined",
    "near_ends",
    "unrepeated",
]

Direction: TypeAlias = Literal["file", "ccw", "cw"]

SAME_PLACE_MM = 1e-6
"""Two points this near are one."""
_NEIGHBOURS = 4
_NEAR = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Strand:
    """A curve in straight pieces, or several joined.

    Parameters
    ----------
    points
        (n, 3) in mm, at least 2.
    lines
        (n - 1,) line of the file that each piece came from, 0 if it has none.
    closed
        True if it ends exactly where it begins.
    name
        What the drawing calls the first curve.
    """

    points: FloatArray
    lines: IntArray
    closed: bool
    name: str

    @property
    def reversed(self) -> Strand:
        """The same in the other direction."""
        return Strand(self.points[::-1], self.lines[::-1], self.closed, self.name)

    @property
    def length_mm(self) -> float:
        """Length of the way along it."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


class BranchingError(ValueError):
    """More than two ends of curves at one place (3,) in mm; `strand` is one of them."""

    def __init__(self, place: FloatArray, strand: Strand) -> None:
        super().__init__("more than two curves end at one place")
        self.place = place
        self.strand = strand


def unrepeated(strands: Sequence[Strand]) -> tuple[list[Strand], list[Strand]]:
    """Return the strands without those that lie on an earlier one, point for point, and those left out."""
    known: dict[tuple[object, ...], list[Strand]] = {}
    kept, repeated = [], []
    for strand in strands:
        # Rounded sums are the same in either direction; a key that just misses costs a repeat, never a curve.
        key = (len(strand.points), strand.closed, *(strand.points.sum(axis=0).round(4) + 0.0).tolist())
        alike = known.setdefault(key, [])
        if any(_same(strand.points, other.points) for other in alike):
            repeated.append(strand)
        else:
            alike.append(strand)
            kept.append(strand)
    return kept, repeated


def _same(a: FloatArray, b: FloatArray) -> bool:
    return any(bool(np.abs(a - other).max() <= SAME_PLACE_MM) for other in (b, b[::-1]))


def joined(strands: Sequence[Strand], gap_mm: float) -> list[Strand]:
    """Join strands whose ends are the only two within a distance; the first of the file gives each its direction.

    Parameters
    ----------
    strands
        In the order of the file.
    gap_mm
        Largest distance of two ends that are one.

    Raises
    ------
    BranchingError
        If three ends or more are that near.
    """
    open_ones = [index for index, strand in enumerate(strands) if not strand.closed]
    partner = _partners([strands[index] for index in open_ones], gap_mm)
    result: list[tuple[int, Strand]] = [(i, strand) for i, strand in enumerate(strands) if strand.closed]
    used = [False] * len(open_ones)
    for first in range(len(open_ones)):
        if not used[first]:
            ends = _chain(first, partner, used)
            chosen = [(strands[open_ones[end // 2]], end % 2 == 1) for end in ends]
            members = [strand.reversed if turned else strand for strand, turned in chosen]
            closes = partner[ends[0]] == ends[-1] ^ 1
            result.append((open_ones[first], _merged(members, strands[open_ones[first]].name, closes=closes)))
    return [strand for _, strand in sorted(result, key=lambda item: item[0])]


def _partners(strands: Sequence[Strand], gap_mm: float) -> list[int]:
    """Return the end that each end is joined to, -1 for none; end 2 i is the begin of strand i, 2 i + 1 its end."""
    from scipy.spatial import cKDTree

    if not strands:
        return []
    places = np.array([point for strand in strands for point in (strand.points[0], strand.points[-1])])
    own = np.arange(len(places))
    distance, near = cKDTree(places).query(places, k=_NEIGHBOURS, distance_upper_bound=np.nextafter(gap_mm, np.inf))
    valid = np.isfinite(distance) & (near != own[:, None])
    for end in np.flatnonzero((valid & (near == (own ^ 1)[:, None])).any(axis=1)).tolist():
        if strands[end // 2].length_mm <= 2.0 * gap_mm:  # shorter than the gap: it must not bite its own tail
            valid[end] &= near[end] != end ^ 1
    crowded = np.flatnonzero(valid.sum(axis=1) > 1)
    if len(crowded):
        raise BranchingError(places[crowded[0]], strands[int(crowded[0]) // 2])
    partner = np.where(valid.any(axis=1), near[own, valid.argmax(axis=1)], -1)
    return [int(end) for end in partner]


def _chain(first: int, partner: list[int], used: list[bool]) -> list[int]:
    """Return the ends at which the strands of a chain are entered, in order of travel, the first in its direction."""
    entry = 2 * first
    while partner[entry] >= 0:
        entry = partner[entry] ^ 1
        if entry == 2 * first:
            break  # a loop
    ends = []
    while entry >= 0 and not used[entry // 2]:
        used[entry // 2] = True
        ends.append(entry)
        entry = partner[entry ^ 1]
    return ends


def _merged(members: list[Strand], name: str, *, closes: bool) -> Strand:
    points = np.vstack([members[0].points, *(member.points[1:] for member in members[1:])])
    if closes:
        points[-1] = points[0]
    return Strand(points, np.concatenate([member.lines for member in members]), closes, name)


def near_ends(strands: Sequence[Strand], gap_mm: float) -> tuple[int, float, int]:
    """Return how many open ends have another one within ten gaps, the largest such distance, and the line of it."""
    from scipy.spatial import cKDTree

    open_ones = [strand for strand in strands if not strand.closed]
    if not open_ones:
        return 0, 0.0, 0
    places = np.array([point for strand in open_ones for point in (strand.points[0], strand.points[-1])])
    distance = cKDTree(places).query(places, k=2)[0][:, 1]
    near = distance <= _NEAR * gap_mm
    if not near.any():
        return 0, 0.0, 0
    worst = int(np.where(near, distance, -1.0).argmax())
    return int(near.sum()), float(distance[worst]), int(open_ones[worst // 2].lines[0])


def directed(strand: Strand, direction: Direction, axis: FloatArray, start: FloatArray | None) -> Strand:
    """Return a closed strand in a direction as seen against the tool axis, from its corner nearest to a start (3,).

    An open strand stays as it is: which of its ends comes first only the drawing can tell.
    """
    if not strand.closed:
        return strand
    away = strand.points - strand.points.mean(axis=0)
    area = float(np.cross(away[:-1], away[1:]).sum(axis=0) @ axis)
    if direction != "file" and area != 0.0 and (area > 0.0) != (direction == "ccw"):
        strand = strand.reversed
    if start is None:
        return strand
    first = int(np.linalg.norm(strand.points[:-1] - start, axis=1).argmin())
    points = np.roll(strand.points[:-1], -first, axis=0)
    return Strand(np.vstack([points, points[:1]]), np.roll(strand.lines, -first), True, strand.name)


def in_nearest_order(strands: Sequence[Strand], start: FloatArray | None) -> list[Strand]:
    """Return strands so that each begins nearest to where the one before ended; the first nearest to a start (3,)."""
    begins = np.array([strand.points[0] for strand in strands]).reshape(-1, 3)
    left = np.ones(len(strands), dtype=np.bool_)
    here, result = start, []
    for _ in strands:
        chosen = 0 if here is None else int(np.where(left, np.linalg.norm(begins - here, axis=1), np.inf).argmin())
        left[chosen] = False
        result.append(strands[chosen])
        here = strands[chosen].points[-1]
    return result
