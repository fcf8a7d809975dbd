"""Turn the entities of a drawing into curves: lines, arcs, circles, ellipses, polylines with bulges, splines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sicp_cam.model import FloatArray
from sicp_formats.dxf.pieces import Conic, CurveError, Nurbs, Piece, Straights

__all__ = ["CURVES", "NO_CURVES", "is_curve", "pieces_of"]

CURVES = frozenset({"LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX"})
_TEXTS = {"TEXT", "MTEXT", "RTEXT", "ATTDEF", "ATTRIB", "SHAPE", "TOLERANCE", "ACAD_TABLE"}
_DIMENSIONS = {"DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION", "LEADER", "MULTILEADER", "MLEADER"}
_AIDS = {"POINT", "RAY", "XLINE", "HATCH", "MPOLYGON", "VIEWPORT", "LIGHT", "SUN", "GEODATA"}
_PICTURES = {"IMAGE", "WIPEOUT", "PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "OLEFRAME", "OLE2FRAME"}
NO_CURVES = frozenset(_TEXTS | _DIMENSIONS | _AIDS | _PICTURES)
"""What explains a drawing and is never a contour."""
_MESHES = 16 | 64
_SPLINE_FRAME = 16
_STRAIGHT_BULGE = 1e-9
_FULL_TURN_TOLERANCE = 1e-9


def is_curve(entity: Any) -> bool:
    """Say whether an entity of the library is a curve: a polyline may also be a mesh."""
    kind = entity.dxftype()
    return kind in CURVES and not (kind == "POLYLINE" and entity.dxf.flags & _MESHES)


def pieces_of(entity: Any) -> list[Piece]:
    """Return the pieces of a curve in their order, in the coordinates of its block or drawing.

    Raises
    ------
    CurveError
        If its numbers make no curve.
    """
    kind = entity.dxftype()
    if kind == "LINE":
        return [Straights(np.array([entity.dxf.start.xyz, entity.dxf.end.xyz]))]
    if kind in ("SPLINE", "HELIX"):
        return [_spline(entity)]
    if kind == "ELLIPSE":
        return [_ellipse(entity)]
    if kind in ("ARC", "CIRCLE"):
        return [_circle(entity).placed(_object_frame(entity))]
    if kind == "LWPOLYLINE":
        return _light_polyline(entity)
    return _old_polyline(entity)


def _object_frame(entity: Any) -> FloatArray:
    """Return the (4, 4) motion from the plane that a flat entity is drawn in, which its extrusion direction names."""
    ocs = entity.ocs()
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([ocs.ux.xyz, ocs.uy.xyz, ocs.uz.xyz])
    return frame


def _circle(entity: Any) -> Conic:
    radius = float(entity.dxf.radius)
    if radius < 0.0:
        raise CurveError("has a negative radius; correct it")
    start, sweep = 0.0, math.tau
    if entity.dxftype() == "ARC":
        start = math.radians(entity.dxf.start_angle)
        sweep = _turn(start, math.radians(entity.dxf.end_angle))
    return Conic(
        np.array(entity.dxf.center.xyz), np.array([radius, 0.0, 0.0]), np.array([0.0, radius, 0.0]), start, sweep
    )


def _ellipse(entity: Any) -> Conic:
    dxf = entity.dxf
    major = np.array(dxf.major_axis.xyz)
    up = np.array(dxf.extrusion.normalize().xyz)
    minor = float(dxf.ratio) * np.cross(up, major)
    return Conic(np.array(dxf.center.xyz), major, minor, dxf.start_param, _turn(dxf.start_param, dxf.end_param))


def _turn(start: float, end: float) -> float:
    """Return the angle from start to end counter-clockwise, a full turn where they are the same."""
    sweep = (end - start) % math.tau
    return math.tau if sweep < _FULL_TURN_TOLERANCE else sweep


def _light_polyline(entity: Any) -> list[Piece]:
    table = np.array(entity.get_points("xyb"), dtype=np.float64).reshape(-1, 3)
    corners = np.column_stack([table[:, :2], np.full(len(table), float(entity.dxf.elevation))])
    frame = _object_frame(entity)
    return [piece.placed(frame) for piece in _bulged(corners, table[:, 2], closed=bool(entity.closed))]


def _old_polyline(entity: Any) -> list[Piece]:
    drawn = [corner.dxf for corner in entity.vertices if not corner.dxf.flags & _SPLINE_FRAME]
    corners = np.array([corner.location.xyz for corner in drawn], dtype=np.float64).reshape(-1, 3)
    closed = bool(entity.is_closed)
    if entity.is_3d_polyline:
        return [Straights(np.vstack([corners, corners[:1]]) if closed else corners)] if drawn else []
    if entity.dxf.hasattr("elevation"):
        corners[:, 2] = entity.dxf.elevation.z
    bulges = np.array([corner.get("bulge", 0.0) for corner in drawn], dtype=np.float64)
    frame = _object_frame(entity)
    return [piece.placed(frame) for piece in _bulged(corners, bulges, closed=closed)]


def _bulged(corners: FloatArray, bulges: FloatArray, *, closed: bool) -> list[Piece]:
    """Return lines and arcs through corners; a bulge is the tangent of a quarter of the arc's angle to the next one."""
    if closed and len(corners):
        corners = np.vstack([corners, corners[:1]])
    pieces: list[Piece] = []
    begin = 0
    for bent in np.flatnonzero(np.abs(bulges[: len(corners) - 1]) > _STRAIGHT_BULGE).tolist():
        if bent > begin:
            pieces.append(Straights(corners[begin : bent + 1]))
        if (corners[bent] != corners[bent + 1]).any():
            pieces.append(_bulge_arc(corners[bent], corners[bent + 1], float(bulges[bent])))
        begin = bent + 1
    if begin < len(corners) - 1:
        pieces.append(Straights(corners[begin:]))
    return pieces


def _bulge_arc(start: FloatArray, end: FloatArray, bulge: float) -> Conic:
    chord = end - start
    left = np.array([-chord[1], chord[0], 0.0])
    share = (1.0 / bulge - bulge) / 4.0
    if not abs(share) < 1e9:
        raise CurveError(f"has a bulge of {bulge:g}; correct it")
    centre = start + chord / 2.0 + share * left
    a = start - centre
    return Conic(centre, a, np.array([-a[1], a[0], 0.0]), 0.0, 4.0 * math.atan(bulge))


def _spline(entity: Any) -> Nurbs:
    control = np.array([tuple(point) for point in entity.control_points], dtype=np.float64).reshape(-1, 3)
    if len(control):
        weights = np.array(entity.weights, dtype=np.float64)
        return Nurbs(
            control,
            weights if len(weights) else np.ones(len(control)),
            np.array(entity.knots, dtype=np.float64),
            int(entity.dxf.degree),
        )
    return _fitted(entity)


def _fitted(entity: Any) -> Nurbs:
    """Return the cubic spline through the fit points of a drawing that gives nothing else."""
    from ezdxf.math import Vec3, fit_points_to_cad_cv

    points = np.array([tuple(point) for point in entity.fit_points], dtype=np.float64).reshape(-1, 3)
    kept = np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1)) if len(points) else np.zeros(0, np.bool_)
    points = points[kept]
    if len(points) < 2:
        raise CurveError("has neither control points nor two different fit points; draw the spline anew")
    tangents = [entity.dxf.get(name) for name in ("start_tangent", "end_tangent")]
    stated = None if None in tangents else tangents
    tool = fit_points_to_cad_cv([Vec3(point) for point in points.tolist()], tangents=stated)
    control = np.array([point.xyz for point in tool.control_points])
    return Nurbs(control, np.ones(len(control)), np.array(tool.knots()), tool.order - 1)
