"""What is in a file: counts, bounds, units, findings, and for parts and scans the numbered loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.contour.loops import mesh_loops, resampled, rim_loops
from sicp_cam.correction import contours_of
from sicp_cam.errors import InputError
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Part, Scan, Source, ToolPath
from sicp_cam.registration.scan_surface import ScanSurface, prepared
from sicp_cam.result_document import findings_list, input_entry

__all__ = ["inspect"]

LEAST_LOOP_SPACINGS = 20.0


def inspect(
    path: Path,
    *,
    role: str,
    units: str | None = None,
    options: Mapping[str, object] | None = None,
    picture: Path | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> dict[str, Any]:
    """Describe a file as plain data.

    Parameters
    ----------
    path
        The file.
    role
        `scan`, `part` or `path`.
    units, options, limits
        As for the readers.
    picture
        PNG file to draw the part or scan into, with its loops numbered as `--contour` counts them.

    Raises
    ------
    InputError, JobError
        As the readers do.
    ReportError, OutputError
        If the picture cannot be drawn or written.
    """
    if role == "path":
        if picture is not None:
            raise InputError(f"{path}: a path has no loops to draw; leave out --picture")
        tool_path = plugins.read_path(path, units=units, limits=limits, options=options or {})
        return _head(path, role, tool_path.source, len(tool_path), tool_path.findings) | _path_body(tool_path)
    faces: IntArray | None
    if role == "part":
        part = plugins.read_part(path, units=units, limits=limits, options=options or {})
        loops: Sequence[FloatArray] = [contour.points_mm for contour in contours_of(part)]
        body = _head(path, role, part.source, len(loops), part.findings) | _part_body(part)
        points, faces = part.mesh.vertices_mm, part.mesh.faces
    else:
        scan = plugins.read_scan(path, units=units, limits=limits, options=options or {})
        surface = prepared(scan)
        loops = _scan_loops(surface)
        body = _head(path, role, scan.source, len(scan.points_mm), scan.findings)
        body |= _scan_body(scan, surface.spacing_mm, loops)
        points, faces = scan.points_mm, scan.faces
    if picture is not None:
        _draw(points, faces, loops, path, picture)
    return body


def _head(path: Path, role: str, source: Source | None, count: int, findings: Any) -> dict[str, Any]:
    entry = input_entry(role, source, count)
    return {**entry, "path": str(path), "findings": findings_list(findings)}


def _bounds(points_mm: FloatArray) -> dict[str, list[float]]:
    return {"min_mm": points_mm.min(axis=0).round(4).tolist(), "max_mm": points_mm.max(axis=0).round(4).tolist()}


def _part_body(part: Part) -> dict[str, Any]:
    contours = [
        {
            "number": number,
            "length_mm": round(contour.length_mm, 4),
            "closed": contour.closed,
            "corners": len(contour.corners),
            "centre_mm": contour.points_mm.mean(axis=0).round(3).tolist(),
            "outward": contour.normals.mean(axis=0).round(3).tolist(),
        }
        for number, contour in enumerate(contours_of(part), 1)
    ]
    return {"bounds": _bounds(part.mesh.vertices_mm), "triangles": len(part.mesh.faces), "contours": contours}


def _scan_loops(surface: ScanSurface) -> list[FloatArray]:
    """Return the closed loops of a scan's rim that are long enough to be an edge, longest first."""
    least_mm = LEAST_LOOP_SPACINGS * surface.spacing_mm
    if surface.faces is None:
        return rim_loops(surface.rim, surface.spacing_mm, least_mm)
    loops = [surface.points_mm[index] for index, closed in mesh_loops(surface.faces) if closed]
    return [loop for loop in loops if resampled(loop, len(loop))[1] >= least_mm]


def _scan_body(scan: Scan, spacing_mm: float, loops: Sequence[FloatArray]) -> dict[str, Any]:
    listed = [
        {
            "number": number,
            "length_mm": round(float(np.linalg.norm(np.diff(loop, axis=0), axis=1).sum()), 1),
            "centre_mm": loop.mean(axis=0).round(2).tolist(),
        }
        for number, loop in enumerate(loops, 1)
    ]
    return {
        "bounds": _bounds(scan.points_mm),
        "triangles": 0 if scan.faces is None else len(scan.faces),
        "normals": scan.normals is not None,
        "spacing_mm": round(spacing_mm, 3),
        "loops": listed,
    }


def _path_body(path: ToolPath) -> dict[str, Any]:
    feeds = np.unique(path.feeds_mm_min[~path.rapid])
    return {
        "bounds": _bounds(path.tips_mm),
        "name": path.name,
        "rapid_moves": int(path.rapid.sum()),
        "feed_moves": int((~path.rapid).sum()),
        "feeds_mm_min": feeds[:20].tolist(),
        "length_mm": round(float(np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1).sum()), 3),
        "events": dict(Counter(event.kind.value for event in path.events)),
    }


def _draw(
    points_mm: FloatArray, faces: IntArray | None, loops: Sequence[FloatArray], source: Path, picture: Path
) -> None:
    from sicp_cam.report.scenes import render
    from sicp_cam.report.views import loops_scene

    output.check_free(picture.parent, [picture.name], True, [source])
    scene = loops_scene(points_mm, faces, loops, list(range(1, len(loops) + 1)), title=source.name)
    output.write(picture.parent, {picture.name: render([scene])[0]}, force=True, inputs=[source])
