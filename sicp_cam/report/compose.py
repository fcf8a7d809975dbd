"""From the results of a run to the pictures and pages that tell it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import metadata
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from sicp_cam.errors import ReportError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import FloatArray, Scan, ToolPath, TriangleMesh
from sicp_cam.registration.result import Registration
from sicp_cam.report import result_tables
from sicp_cam.report.confidence_table import confidence
from sicp_cam.report.deviation import out_of_surface
from sicp_cam.report.document import Picture, ReportDocument
from sicp_cam.report.figures import (
    BAND_MEANS,
    SEGMENT_STEPS,
    correction_along_contour,
    error_along_contour,
    uncertainty_along_contour,
)
from sicp_cam.report.path_view import largest_correction, paths_scene
from sicp_cam.report.scenes import Scene, render
from sicp_cam.report.views import deviation_scene, sample, subdivision_scene
from sicp_cam.rigid_motion import apply, rotate

__all__ = ["PICTURES_FAILED", "SCHEMA", "document", "pictures"]

SCHEMA = "sicp-cam/1"

PICTURES_FAILED = 701
"""Code of the finding that stands in for the three-dimensional pictures."""

_REACH_MM = 150.0
_TITLE = "Tool path correction report"
_SIGNS = (
    "normal (across the edge, in the surface): positive = into the material, the scan edge lies further in than the "
    "contour; negative = material stands beyond the contour.",
    "out (of the surface): positive = outward, the scan surface lies above the contour; negative = it sags below.",
    "both = sqrt(normal² + out²): the distance across the contour. Sliding along the contour does not change the part "
    "and is not counted.",
    "All in mm, on the stretches that the scan shows. mean and sd keep the sign; p95 and max are of the size.",
)
_CAPTIONS = {
    "error": f"distance between scan and contour along the contour. {result_tables.FIT} "
    "Where a curve is missing, nothing was measured.",
    "uncertainty": f"how sure the corrected contour is. {BAND_MEANS}",
    "deviation": "Scan points on the rigidly registered part, coloured by how far they lie out (of the surface).",
    "subdivision": "segments, subdivision points and stability points on the corrected contour.",
    "paths": "Nominal path, rigidly registered, and corrected path with tool axes; true to scale.",
    "paths_enlarged": "The same with the correction drawn larger than it is, by the factor in the picture's title.",
    "correction": "what the correction adds to the rigid pose along the contour. Ticks at the top, if there are "
    f"any, are the borders of the segments. {SEGMENT_STEPS}",
}
"""In the order in which the report shows them."""


def pictures(
    part_mesh: TriangleMesh,
    scan: Scan,
    registration: Registration,
    path_rigid: ToolPath | None,
    path_corrected: ToolPath | None,
    tolerance_mm: float,
    *,
    timeout_s: float = 120.0,
) -> tuple[dict[str, bytes], tuple[Finding, ...]]:
    """Draw all pictures of a run.

    Parameters
    ----------
    part_mesh
        The nominal part, in the part frame.
    scan, path_rigid, path_corrected
        In the scan frame; without the paths their picture is left out.
    tolerance_mm
        Deviations up to it share one colour.
    timeout_s
        For all three-dimensional pictures together.

    Returns
    -------
    tuple
        PNG files by file name, and what went wrong: where the renderer fails, a finding with code `PICTURES_FAILED`
        stands in for the three-dimensional pictures and the curves are there nevertheless.
    """
    drawn: dict[str, bytes] = {}
    for contour in registration.contours:
        drawn[f"error_{contour.number}.png"] = error_along_contour(contour, registration.method, tolerance_mm)
        if contour.normal_u_mm is not None and contour.out_u_mm is not None:
            drawn[f"uncertainty_{contour.number}.png"] = uncertainty_along_contour(contour, registration.method)
        drawn[f"correction_{contour.number}.png"] = correction_along_contour(contour)
    scenes = _scenes(part_mesh, scan, registration, path_rigid, path_corrected, tolerance_mm)
    try:
        drawn |= zip(scenes, render(list(scenes.values()), timeout_s), strict=True)
    except ReportError as error:
        return drawn, (Finding(PICTURES_FAILED, Level.WARN, str(error), "report"),)
    return drawn, ()


def document(
    result: Mapping[str, Any], pictures: Mapping[str, bytes], *, job: str, version: str | None = None
) -> ReportDocument:
    """Return the report of a run, fresh or from its `result.json`.

    Times are left out: the report of the same run is the same file.

    Parameters
    ----------
    result
        The result document of schema `sicp-cam/1`.
    pictures
        PNG files by file name, as `pictures` returns them; other names follow at the end with the name as caption.
    job
        Name of the job.
    version
        Version of the product; that of the installed one if left out.

    Raises
    ------
    ReportError
        If the result has another schema, or values that the schema does not allow.
    """
    if result.get("schema") != SCHEMA:
        raise ReportError(f"result: 'schema' is {result.get('schema')!r}; this version draws reports of {SCHEMA!r}")
    verdict, reasons = result_tables.verdict(result)
    tables = (
        result_tables.inputs(result),
        result_tables.statistics(result),
        confidence(result),
        result_tables.gates(result),
        result_tables.findings(result),
        result_tables.details(result),
    )
    shown = tuple(Picture(pictures[name], _caption(name)) for name in sorted(pictures, key=_place))
    product = metadata.version("sicp-cam") if version is None else version
    return ReportDocument(_TITLE, job, verdict, reasons, _SIGNS, tables, shown, product)


def _place(name: str) -> tuple[int, int, str]:
    """Sort pictures by kind, then by contour."""
    stem, _, number = name.removesuffix(".png").rpartition("_")
    kind = stem if number.isdigit() else name.removesuffix(".png")
    return (
        list(_CAPTIONS).index(kind) if kind in _CAPTIONS else len(_CAPTIONS),
        int(number) if number.isdigit() else 0,
        name,
    )


def _caption(name: str) -> str:
    stem, _, number = name.removesuffix(".png").rpartition("_")
    if number.isdigit() and stem in _CAPTIONS:
        return f"Contour {int(number)}: {_CAPTIONS[stem]}"
    return _CAPTIONS.get(name.removesuffix(".png"), name)


def _scenes(
    part_mesh: TriangleMesh,
    scan: Scan,
    registration: Registration,
    path_rigid: ToolPath | None,
    path_corrected: ToolPath | None,
    tolerance_mm: float,
) -> dict[str, Scene]:
    if not registration.contours:
        return {}
    normals = None if part_mesh.normals is None else rotate(registration.T_scan_part, part_mesh.normals)
    mesh = TriangleMesh(apply(registration.T_scan_part, part_mesh.vertices_mm), part_mesh.faces, normals)
    points, deviation = _deviations(mesh, scan, registration)
    scenes = {
        "deviation.png": deviation_scene(mesh, points, deviation, registration, tolerance_mm, len(scan.points_mm))
    }
    for contour in registration.contours:
        scenes[f"subdivision_{contour.number}.png"] = subdivision_scene(contour, registration)
    if path_rigid is not None and path_corrected is not None:
        scenes["paths.png"] = paths_scene(mesh, path_rigid, path_corrected, registration)
        larger = _exaggeration(path_rigid, path_corrected)
        if larger > 1.0:
            scenes["paths_enlarged.png"] = paths_scene(mesh, path_rigid, path_corrected, registration, larger)
    return scenes


def _exaggeration(path_rigid: ToolPath, path_corrected: ToolPath) -> float:
    """Return the round factor that shows the largest correction as some 5 % of the path's size; 1 where none helps."""
    largest = largest_correction(path_rigid, path_corrected)
    if largest < 0.01:
        return 1.0
    wanted = 0.05 * float(np.linalg.norm(np.ptp(path_rigid.tips_mm[~path_rigid.rapid], axis=0))) / largest
    return max((step for step in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0) if step <= wanted), default=1.0)


def _deviations(mesh: TriangleMesh, scan: Scan, registration: Registration) -> tuple[FloatArray, FloatArray]:
    """Return scan points near the contours, as many as a picture shows, and how far out of the outer skin they lie."""
    stations = np.concatenate([contour.rigid.points_mm for contour in registration.contours])
    outward = np.concatenate([contour.rigid.outward for contour in registration.contours])
    low, high = stations.min(axis=0) - _REACH_MM, stations.max(axis=0) + _REACH_MM
    points = scan.points_mm[np.all((scan.points_mm >= low) & (scan.points_mm <= high), axis=1)]
    points = points[sample(len(points))]
    distance, _ = cKDTree(stations).query(points, distance_upper_bound=_REACH_MM)
    points = points[np.isfinite(distance)]
    return points, out_of_surface(points, mesh, stations, outward)
