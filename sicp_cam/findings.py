"""Findings: what was noticed on the way and did not stop the work, as data.

Codes are stable and stand in bands: 1xx scans and meshes, 2xx CAD, 3xx tool paths, 4xx registration,
5xx corrected path, 6xx programs, 7xx reports, 8xx plug-ins and the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Finding", "Level"]


class Level(StrEnum):
    """How much a finding matters."""

    INFO = "info"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing worth telling the operator.

    Parameters
    ----------
    code
        Stable number, in the band of the room that found it.
    level
        `info`, `warn` (ends a `--strict` run) or `fail`.
    message
        One line in the operator's words.
    where
        File and line, contour, move index: whatever finds the place again; may be empty.
    """

    code: int
    level: Level
    message: str
    where: str = ""
