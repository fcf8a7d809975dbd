"""Join faces to skins, and chain the edges where a skin ends to loops.

A *skin* is what an operator calls one surface: faces of one body that meet smoothly. Faces that split a hole, and the
seam of a cylinder, are joined; the edge of a panel is where the outer skin ends.

Runs in the child process only: it works on the CAD kernel's curves and surfaces.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np

from sicp_formats.cad.faces import Body, EdgeUse, edge_uses, outward_normals

__all__ = ["SMOOTH_DEG", "Loop", "Skin", "skins"]

SMOOTH_DEG = 15.0
"""Faces whose normals differ by no more than this all along their common edge belong to one skin."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """Uses of edges in the order of travel; not closed where the shape itself has a gap."""

    uses: tuple[EdgeUse, ...]
    closed: bool


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Indices of a skin's faces in its body, and the loops that bound it."""

    faces: tuple[int, ...]
    loops: tuple[Loop, ...]


def skins(body: Body, report: Callable[[str], None]) -> list[Skin]:
    """Return the skins of a body, each with the loops that bound it.

    Parameters
    ----------
    body
        Faces with their outward sides.
    report
        Called with one line for whatever is not as a body should be: an edge that more than two faces share, or two
        faces that meet with opposite outward sides.
    """
    uses = edge_uses(body)
    twins = _twins(uses, body, report)
    skin_of = _joined(len(body.faces), [(uses[a].face, uses[b].face) for a, b in twins.items()])
    faces: dict[int, list[int]] = defaultdict(list)
    for face, skin in enumerate(skin_of):
        faces[skin].append(face)
    loops: dict[int, list[Loop]] = defaultdict(list)
    for members, closed in _chained(_boundary(uses, twins)):
        loops[skin_of[uses[members[0]].face]].append(Loop(tuple(uses[i] for i in members), closed))
    return [Skin(tuple(members), tuple(loops[skin])) for skin, members in faces.items()]


def _twins(uses: list[EdgeUse], body: Body, report: Callable[[str], None]) -> dict[int, int]:
    """Pair the uses of each edge across which a skin goes on, both ways."""
    by_edge: dict[int, list[int]] = defaultdict(list)
    for index, use in enumerate(uses):
        if not use.degenerate:
            by_edge[use.edge].append(index)
    twins = {}
    for members in by_edge.values():
        if len(members) > 2:
            report(f"an edge near {_place(uses[members[0]])} is shared by {len(members)} faces; it bounds each of them")
        elif len(members) == 2:
            a, b = members
            if uses[a].forward == uses[b].forward:
                report(
                    f"two faces that meet near {_place(uses[a])} have opposite outward sides; check the contours there"
                )
            elif _smooth(uses[a], uses[b], body):
                twins[a], twins[b] = b, a
    return twins


def _place(use: EdgeUse) -> str:
    point = use.curve.Value((use.first + use.last) / 2)
    return f"({point.X():.1f}, {point.Y():.1f}, {point.Z():.1f})"


def _smooth(a: EdgeUse, b: EdgeUse, body: Body) -> bool:
    parameters = np.linspace(a.first, a.last, 9)[1:-1]
    normals_a = outward_normals(body.faces[a.face], a.uv(parameters))
    normals_b = outward_normals(body.faces[b.face], b.uv(parameters))
    cosines = np.sum(normals_a * normals_b, axis=1)
    cosines = cosines[np.isfinite(cosines)]
    return bool(len(cosines) and cosines.min() >= np.cos(np.radians(SMOOTH_DEG)))


def _joined(count: int, pairs: list[tuple[int, int]]) -> list[int]:
    """Return, for each of `count` faces, the smallest face that the pairs connect it with (union-find)."""
    root = list(range(count))

    def find(i: int) -> int:
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        return i

    for a, b in pairs:
        low, high = sorted((find(a), find(b)))
        root[high] = low
    return [find(i) for i in range(count)]


def _followers(uses: list[EdgeUse]) -> list[int | None]:
    """Return, for each use, the one that goes on from its end in the same wire; None where the wire is broken.

    Where a wire visits a vertex more than once, as at a seam, the (u, v) plane of the face tells which one goes on.
    """
    starting: dict[tuple[int, int], list[int]] = defaultdict(list)
    for index, use in enumerate(uses):
        starting[use.wire, use.start].append(index)
    followers: list[int | None] = []
    for use in uses:
        candidates = starting.get((use.wire, use.end), [])
        if len(candidates) > 1:
            gaps = [np.linalg.norm(uses[i].uv_end(False) - use.uv_end(True)) for i in candidates]
            candidates = [candidates[int(np.argmin(gaps))]]
        followers.append(candidates[0] if candidates else None)
    return followers


def _boundary(uses: list[EdgeUse], twins: dict[int, int]) -> dict[int, int | None]:
    """Return the uses that bound a skin, each with the next one along the boundary.

    At the end of a use the walk turns around the vertex, from face to face of the skin, until it meets the boundary.
    """
    followers = _followers(uses)
    boundary: dict[int, int | None] = {}
    for index, use in enumerate(uses):
        if index in twins or use.degenerate:
            continue
        following = followers[index]
        for _ in range(len(uses)):
            if following is None or not (following in twins or uses[following].degenerate):
                break
            following = followers[twins.get(following, following)]
        boundary[index] = following
    return boundary


def _chained(following: dict[int, int | None]) -> list[tuple[list[int], bool]]:
    """Return the chains of a successor map, and whether each closes; open chains start at their true beginning."""
    beginnings = sorted(set(following) - set(following.values()))
    chains = []
    left = set(following)
    for start in chain(beginnings, sorted(following)):
        members = []
        index: int | None = start
        while index is not None and index in left:
            left.remove(index)
            members.append(index)
            index = following[index]
        if members:
            chains.append((members, index == start))
    return chains
