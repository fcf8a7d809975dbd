"""What is in a file: counts, bounds, units, findings, the contours of a part and the loops of a scan, numbered."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.checking.facts import bounds, feed_facts, rounded
from sicp_cam.contour.loops import mesh_loops, resampled, rim_loops
from sicp_cam.correction import contours_of, unit_taken
from sicp_cam.errors import InputError, printable
from sicp_cam.job.input_files import is_pose
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import Contour, FloatArray, Source, ToolPath
from sicp_cam.registration.scan_surface import ScanSurface, prepared
from sicp_cam.result_document import findings_list, input_entry

if TYPE_CHECKING:
    from sicp_cam.report.scenes import Scene

__all__ = ["inspect"]

LEAST_LOOP_SPACINGS = 20.0
LEAST_POINTS = 5
"""A scan of fewer points has no spacing: that is measured at the fourth neighbour."""
SKIN_RING_STEP_MM = 20.0
"""A contour with fewer points beside it than one in so many millimetres bounds a face too narrow to be a skin."""
ONE_SIDE = 0.3
"""Length of the mean normal below which a contour looks to no one side; and the least share of an axis named."""


def inspect(
    path: Path,
    *,
    role: str,
    units: str | None = None,
    options: Mapping[str, object] | None = None,
    picture: Path | None = None,
    recover: bool = False,
    force: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> dict[str, Any]:
    """Describe a file as plain data.

    Parameters
    ----------
    path
        The file.
    role
        `scan`, `part` or `path`.
    units, options, recover, limits
        As for the readers.
    picture
        PNG file to draw the part or scan into, with its contours or loops numbered as here. Walls, the contours of
        narrow faces, are left out.
    force
        True if an existing picture is to be replaced.

    Returns
    -------
    dict
        Finite numbers, texts and lists only. A scan of fewer than five points has no `spacing_mm` and no loops.

    Raises
    ------
    InputError, JobError
        As the readers do; and if the file is a pose.
    ReportError, OutputError
        If the picture cannot be drawn or written.
    """
    if is_pose(path):
        raise InputError(f"{printable(str(path))}: this is a pose, a 4x4 matrix, and no {role}; give it with --align")
    if picture is not None:
        if role == "path":
            raise InputError(f"{printable(str(path))}: a path is not drawn; leave out --picture")
        output.check_free(picture.parent, [picture.name], force, [path])
    given: dict[str, Any] = {"units": units, "limits": limits, "options": options or {}, "recover": recover}
    if role == "path":
        return _path_document(path, plugins.read_path(path, **given))
    document, scene = _part_document(path, given) if role == "part" else _scan_document(path, given)
    if picture is not None:
        from sicp_cam.report.scenes import render

        output.write(picture.parent, {picture.name: render([scene()])[0]}, force=force, inputs=[path])
    return document


def _head(path: Path, role: str, source: Source | None, count: int, findings: Any) -> dict[str, Any]:
    entry = input_entry(role, source, count)
    taken = (unit_taken(source, "--units"),) if role != "path" and source is not None and not source.unit_stated else ()
    return {**entry, "path": str(path), "findings": findings_list((*taken, *findings))}


def _part_document(path: Path, given: Mapping[str, Any]) -> tuple[dict[str, Any], Callable[[], Scene]]:
    part = plugins.read_part(path, **given)
    contours = contours_of(part)
    skins = [number for number, contour in enumerate(contours, 1) if _kind(contour) == "skin"]
    shown = skins or list(range(1, len(contours) + 1))
    document = _head(path, "part", part.source, len(contours), part.findings) | {
        "bounds": bounds(part.mesh.vertices_mm),
        "triangles": len(part.mesh.faces),
        "contours": [_contour_entry(number, contour) for number, contour in enumerate(contours, 1)],
    }

    def scene() -> Scene:
        from sicp_cam.report.views import loops_scene

        chosen = [contours[number - 1] for number in shown]
        drawn = loops_scene(
            part.mesh.vertices_mm,
            part.mesh.faces,
            [contour.points_mm for contour in chosen],
            shown,
            title=path.name,
            closed=[contour.closed for contour in chosen],
        )
        left_out = len(contours) - len(shown)
        walls = f"; {_counted(left_out, 'wall')} not drawn" if left_out else ""
        words = replace(drawn.lettering, subtitle=_counted(len(shown), "contour") + walls)
        return replace(drawn, lettering=words)

    return document, scene


def _contour_entry(number: int, contour: Contour) -> dict[str, Any]:
    outward = contour.normals.mean(axis=0)
    return {
        "number": number,
        "kind": _kind(contour),
        "length_mm": round(contour.length_mm, 4),
        "closed": contour.closed,
        "corners": len(contour.corners),
        "centre_mm": rounded(contour.points_mm.mean(axis=0), 3),
        "outward": rounded(outward, 3),
        "looks": _looks(outward),
    }


def _kind(contour: Contour) -> str:
    """Tell skins from walls: the narrow faces between two skins hold no points beside their contour."""
    return "skin" if SKIN_RING_STEP_MM * len(contour.ring_points_mm) >= contour.length_mm else "wall"


def _looks(outward: FloatArray) -> str:
    """Say to which side a mean normal points.

    >>> _looks(np.array([0.0, 0.0, -0.98])), _looks(np.array([0.7, 0.0, 0.7])), _looks(np.zeros(3))
    ('towards -Z', 'towards +X and +Z', 'all round')
    """
    if np.linalg.norm(outward) < ONE_SIDE:
        return "all round"
    shares = outward / np.linalg.norm(outward)
    named = [
        f"{'+' if share > 0 else '-'}{axis}" for axis, share in zip("XYZ", shares, strict=True) if abs(share) > ONE_SIDE
    ]
    return f"towards {' and '.join(named)}"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _scan_loops(surface: ScanSurface) -> list[FloatArray]:
    """Return the closed loops of a scan's rim that are long enough to be an edge, longest first."""
    least_mm = LEAST_LOOP_SPACINGS * surface.spacing_mm
    if surface.faces is None:
        return rim_loops(surface.rim, surface.spacing_mm, least_mm)
    loops = [surface.points_mm[index] for index, closed in mesh_loops(surface.faces) if closed]
    return [loop for loop in loops if resampled(loop, len(loop))[1] >= least_mm]


def _scan_document(path: Path, given: Mapping[str, Any]) -> tuple[dict[str, Any], Callable[[], Scene]]:
    scan = plugins.read_scan(path, **given)
    surface = prepared(scan) if len(scan.points_mm) >= LEAST_POINTS else None
    loops = _scan_loops(surface) if surface else []
    document = _head(path, "scan", scan.source, len(scan.points_mm), scan.findings) | {
        "bounds": bounds(scan.points_mm),
        "triangles": 0 if scan.faces is None else len(scan.faces),
        "normals": scan.normals is not None,
        "columns": [*scan.columns],
        "spacing_mm": round(surface.spacing_mm, 3) if surface else None,
        "loops": [_loop_entry(number, loop) for number, loop in enumerate(loops, 1)],
    }

    def scene() -> Scene:
        from sicp_cam.report.views import loops_scene

        return loops_scene(scan.points_mm, scan.faces, loops, list(range(1, len(loops) + 1)), title=path.name)

    return document, scene


def _loop_entry(number: int, loop: FloatArray) -> dict[str, Any]:
    length_mm = resampled(loop, 1)[1]
    return {"number": number, "length_mm": round(length_mm, 1), "centre_mm": rounded(loop.mean(axis=0), 2)}


def _path_document(path: Path, tool_path: ToolPath) -> dict[str, Any]:
    return _head(path, "path", tool_path.source, len(tool_path), tool_path.findings) | {
        "bounds": bounds(tool_path.tips_mm),
        "name": tool_path.name,
        "rapid_moves": int(tool_path.rapid.sum()),
        "feed_moves": int((~tool_path.rapid).sum()),
        **feed_facts(tool_path),
        "length_mm": round(float(np.linalg.norm(np.diff(tool_path.tips_mm, axis=0), axis=1).sum()), 3),
        "events": dict(Counter(event.kind.value for event in tool_path.events)),
    }
