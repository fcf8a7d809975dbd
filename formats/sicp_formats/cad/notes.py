"""Collect what is worth telling about a CAD file, few lines of each kind, in a form that goes through JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from enum import IntEnum

from sicp_cam.errors import printable
from sicp_cam.findings import Finding, Level

__all__ = ["Code", "Notes", "as_findings"]

MOST_OF_A_KIND = 5
LONGEST = 1000


class Code(IntEnum):
    """Findings of the CAD readers; repairs from 250 up."""

    UNIT_ASSUMED = 201
    UNITS_MIXED = 202
    INSIDE_OUT = 203
    NOT_UNDERSTOOD = 204
    FACES_MISSING = 205
    EDGE_OFF = 206
    EDGE_ODD = 207
    LOOP_ODD = 208
    MESH_COARSE = 209
    NO_VOLUME = 210
    BODIES = 211
    SEWN = 212
    SIDES_DISAGREE = 213
    OTHER_FILES = 214
    FACES_INVALID = 215
    TRIANGLES_ONLY = 216
    PRODUCTS_SEWN = 217
    FACE_DOUBLED = 218
    FACES_OVERLAP = 219
    HEALED = 250
    ENTITY_LEFT_OUT = 251
    SHAPE_LEFT_OUT = 252
    LOOP_LEFT_OUT = 253
    END_ADDED = 254


class Notes:
    """A list of (code, level, message) that keeps the first `MOST_OF_A_KIND` of each code and counts the rest."""

    def __init__(self) -> None:
        self._kept: list[tuple[int, str, str]] = []
        self._seen: Counter[int] = Counter()

    def add(self, code: int, level: Level, message: str) -> None:
        """Take one note."""
        code = int(code)
        self._seen[code] += 1
        if self._seen[code] <= MOST_OF_A_KIND:
            self._kept.append((code, level.value, printable(message, LONGEST)))

    def rows(self) -> list[tuple[int, str, str]]:
        """Return the notes, with a last line for each code that had more than are kept."""
        levels = {code: level for code, level, _ in self._kept}
        more = [
            (c, levels[c], f"{n - MOST_OF_A_KIND} more of this kind")
            for c, n in self._seen.items()
            if n > MOST_OF_A_KIND
        ]
        return self._kept + more


def as_findings(rows: Iterable[tuple[int, str, str]], where: str) -> tuple[Finding, ...]:
    """Turn rows of `Notes` into findings about a file."""
    return tuple(Finding(int(code), Level(level), message, where) for code, level, message in rows)
