"""Hard caps on what a file may ask of this machine."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["DEFAULT_LIMITS", "Limits"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Caps that readers check before they allocate; raise one in the job file where a real input needs it.

    Parameters
    ----------
    file_bytes
        Largest input file; of a gzip file, also the most bytes in it.
    archive_ratio
        How many times its own size a gzip file may unpack to.
    points, faces
        Most points and triangles of a scan or mesh.
    header_bytes, header_lines
        Longest header of a file.
    line_bytes
        Longest line of a text file.
    list_length
        Most corners of a polygon.
    path_points
        Most moves of a tool path.
    coordinate_mm
        Largest coordinate, either sign.
    cad_seconds
        Longest time that the CAD kernel may take.
    child_memory_bytes
        Most memory that the CAD kernel may take, where the system can limit it.
    """

    file_bytes: int = 4 * 2**30
    archive_ratio: float = 200.0
    points: int = 200_000_000
    faces: int = 100_000_000
    header_bytes: int = 2**20
    header_lines: int = 10_000
    line_bytes: int = 64 * 2**10
    list_length: int = 1_000
    path_points: int = 2_000_000
    coordinate_mm: float = 1e7
    cad_seconds: float = 120.0
    child_memory_bytes: int = 8 * 2**30


DEFAULT_LIMITS = Limits()
