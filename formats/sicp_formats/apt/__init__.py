"""Read tool paths from APT and CL files: CATIA, NX, Creo, SolidWorks CAM and posts that write ISO 4343 APT.

Only what a contour needs is executed; a statement that would change coordinates in a way that is not sure is refused
with its line; every other statement goes into the path as an event. The path carries its program along, so that it
can be written again in its own words (`apt_rewrite`).
"""

from __future__ import annotations

from pathlib import Path

from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats.apt.options import AptOptions
from sicp_formats.apt.reader import execute
from sicp_formats.apt.rewrite import AptOriginal
from sicp_formats.source import read_bytes

__all__ = ["read_path"]


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    feed_mm_min: float | None = None,
    chord_mm: float = 0.005,
    step_mm: float = 2.0,
    frame: str = "refuse",
    arc_sense: str = "auto",
    arc_points: str = "refuse",
    cutcom: str = "refuse",
    cycles: str = "refuse",
) -> ToolPath:
    """Read an APT or CL file into a path in mm, mm/min and unit axes (tip to holder).

    Parameters
    ----------
    path
        The file.
    units
        Unit of a file that states none; must not contradict one that does.
    limits
        Caps on the file and the path.
    recover
        Repair what moves nothing: leave out a last statement that is cut short and NUL bytes after the end, and keep
        damaged FEDRAT and DELAY statements as text. A damaged motion stays an error, wherever it stands.
    feed_mm_min
        Feed for cutting moves that the file gives none.
    chord_mm, step_mm
        How far a piece of an arc may lie from it, and how long it may be.
    frame
        What to do with a machining frame (NX MSYS, CATIA's ``$$*CATIA0``, CSYS) other than that of the part:
        ``refuse``, ``apply`` it so that the path comes into the frame of the CAD model, or ``keep`` the coordinates.
    arc_sense
        ``ccw`` or ``cw`` about the axis of CIRCLE statements; ``auto`` takes that of the dialect.
    arc_points
        What further points on the same circle behind an arc mean: ``arc`` (Creo), ``straight`` moves, or ``refuse``.
    cutcom
        ``ignore`` to keep CUTCOM/LEFT or RIGHT as text, whether the points are those of the tool or of the contour.
    cycles
        ``points`` to keep drilling cycles as text, and their positions as points of the path.

    Raises
    ------
    FormatError
        With the line, if a statement cannot be understood or must not be guessed at.
    UnitError
        If `units` is unknown or contradicts the file.
    JobError
        If another option is not valid.
    """
    options = AptOptions(
        units, limits, feed_mm_min, chord_mm, step_mm, frame, arc_sense, arc_points, cutcom, cycles, recover
    )
    content = read_bytes(path, limits)
    reader = execute(path, content, options)
    original = AptOriginal(path, content, options)
    return reader.moves.build(content, format="APT", name=reader.name, feed_mm_min=feed_mm_min, original=original)
