"""The scenes of a report: deviations of the scan, subdivision of the contour, the two paths, and numbered loops."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from sicp_cam.contour.frames import FramedCurve, at
from sicp_cam.model import FloatArray, IntArray, TriangleMesh
from sicp_cam.registration.result import RegisteredContour, Registration
from sicp_cam.report.camera import Camera, looking_at, pixels
from sicp_cam.report.deviation_colours import deviation_bar, deviation_colours
from sicp_cam.report.lettering import Key, Label, Lettering
from sicp_cam.report.scenes import Dots, Layer, Line, Scene, Surface
from sicp_cam.report.stretches import covered_twice, marked

__all__ = ["PART", "SHOWN_POINTS", "camera_on", "deviation_scene", "loops_scene", "sample", "subdivision_scene"]

PART, GAP = "#d4d4d4", "#e8a0a8"
_PIECES = ("#1f6fb4", "#e08a1e", "#2f9e62")
SHOWN_POINTS = 150_000


def deviation_scene(
    mesh_scan_frame: TriangleMesh,
    points_scan_mm: FloatArray,
    deviation_mm: FloatArray,
    registration: Registration,
    tolerance_mm: float,
    scan_points: int,
) -> Scene:
    """Return the picture of the rigidly registered part with the scan points on it, coloured by their deviation.

    Parameters
    ----------
    mesh_scan_frame
        The part, registered.
    points_scan_mm, deviation_mm
        (n, 3) scan points near the contours and (n,) how far they lie out of the nominal surface; NaN where there is
        no surface under a point.
    tolerance_mm
        Points within it share one neutral colour.
    scan_points
        How many points the whole scan has.
    """
    curves = [contour.rigid for contour in registration.contours]
    points, deviation = points_scan_mm, deviation_mm
    seen = np.concatenate([*(curve.points_mm for curve in curves), points])
    camera = camera_on(seen, registration, tilt_deg=20.0)
    known = np.isfinite(deviation)
    bar = deviation_bar(deviation_mm, tolerance_mm)
    lift = float(np.nanmax(np.abs(deviation[known]), initial=0.0)) + 5.0
    size = float(np.clip(registration.spacing_mm / camera.mm_per_px, 2.0, 10.0))
    grey = np.full((int((~known).sum()), 3), 90, np.uint8)
    layers: list[Layer] = [
        Surface(mesh_scan_frame, PART),
        Dots(points[~known], grey, 2.0, lift),
        Dots(points[known], deviation_colours(deviation[known], bar), size, lift),
        *(_loop(curve, "#1a1a1a", 2.5, 2.0 * lift) for curve in curves),
    ]
    keys = [Key("nominal contour, rigidly registered", "#1a1a1a")]
    if not known.all():
        keys.append(Key("scan point with no nominal surface under it", "#5a5a5a", "."))
    few = f"; {len(points):,} of the scan's {scan_points:,} points drawn" if len(points) < scan_points else ""
    words = Lettering(
        "Scan against the rigidly registered part",
        f"out (of the surface), + outward; within ±{tolerance_mm:g} mm: one colour{few}",
        tuple(keys),
        bar,
    )
    return Scene(tuple(layers), camera, words)


def subdivision_scene(contour: RegisteredContour, registration: Registration) -> Scene:
    """Return the picture of a contour with its segments, subdivision and stability points (figures 5 and 8)."""
    curve = contour.corrected
    alone = replace(registration, contours=(contour,))
    camera = camera_on(np.concatenate([curve.points_mm, contour.stability_scan_mm]), alone, tilt_deg=20.0)
    lift = camera.mm_per_px * 10
    gaps = [_line(curve, stretch, GAP, 20.0, 0.0) for stretch in marked(curve, ~contour.covered)]
    splits = at(curve, contour.split_s_mm).points_mm if len(contour.split_s_mm) else np.zeros((0, 3))
    layers: list[Layer] = [
        *gaps,
        *_pieces(contour, lift),
        *(_line(curve, stretch, "#1a1a1a", 2.0, 2 * lift) for stretch in _overlaps(contour)),
        Dots(contour.stability_scan_mm, _one_colour(contour.stability_scan_mm, (130, 60, 150)), 7.0, lift, True),
        Dots(splits, _one_colour(splits, (200, 20, 30)), 20.0, 3 * lift, True),
    ]
    count = max(len(contour.segments), 1)
    keys = [Key("segments, alternating", _PIECES[0])] if contour.segments else [Key("contour", _PIECES[0])]
    if contour.segments:
        keys += [Key("overlap of two segments", "#1a1a1a"), Key("subdivision point", "#c8141e", "o")]
    if len(contour.stability_scan_mm):
        keys.append(Key("stability point", "#823c96", "."))
    if gaps:
        keys.append(Key("not seen by the scan", GAP))
    many = f"{count} segments" if count > 1 else "one rigid motion"
    stability = len(contour.stability_scan_mm)
    words = Lettering(
        f"Contour {contour.number}: subdivision",
        f"{many}, {stability} stability point{'' if stability == 1 else 's'}, length {curve.length_mm:.1f} mm",
        tuple(keys),
    )
    return Scene(tuple(layers), camera, words)


def loops_scene(
    points_mm: FloatArray,
    faces: IntArray | None,
    loops_mm: Sequence[FloatArray],
    numbers: Sequence[int],
    outward: FloatArray | None = None,
    title: str = "Loops",
    closed: Sequence[bool] | None = None,
) -> Scene:
    """Return the picture of a part or a scan with its loops numbered, for `inspect`.

    Parameters
    ----------
    points_mm, faces
        Vertices and triangles of a part or mesh; a cloud where `faces` is None.
    loops_mm
        One (k, 3) polyline for each loop, the first point not repeated.
    numbers
        The number to write at each loop.
    outward
        (3,) direction to look from; across the loops' best plane if left out.
    title
        Usually the name of the file; printed literally.
    closed
        For each loop whether its ends are joined; all are if left out.
    """
    seen = np.concatenate([points_mm, *loops_mm])
    towards = _across(np.concatenate(loops_mm) if loops_mm else points_mm) if outward is None else outward
    camera = looking_at(seen, towards)
    lift = 0.002 * camera.mm_per_px * camera.width_px
    layers: list[Layer] = []
    if faces is None:
        shown = points_mm[sample(len(points_mm))]
        layers.append(Dots(shown, _one_colour(shown, (165, 170, 178)), 2.0))
    else:
        layers.append(Surface(TriangleMesh(points_mm, faces), PART))
    labels = []
    joined = [True] * len(loops_mm) if closed is None else closed
    for index, (loop, number, ring) in enumerate(zip(loops_mm, numbers, joined, strict=True)):
        colour = _PIECES[index % len(_PIECES)]
        layers.append(Line(np.concatenate([loop, loop[:1]]) if ring else loop, colour, 4.0, lift))
        labels.append(Label(str(number), _extremes(loop, camera), colour))
    hidden = faces is None and len(points_mm) > SHOWN_POINTS
    few = f"; {SHOWN_POINTS:,} of {len(points_mm):,} points drawn" if hidden else ""
    count = f"{len(loops_mm)} loop{'' if len(loops_mm) == 1 else 's'}"
    return Scene(tuple(layers), camera, Lettering(title, count + few, labels=tuple(labels)))


def camera_on(points: FloatArray, registration: Registration, tilt_deg: float) -> Camera:
    """Return the camera that looks on the outer side of the registered contours with all (n, 3) points in view."""
    curves = [contour.rigid for contour in registration.contours]
    outward = np.concatenate([curve.outward for curve in curves]).mean(axis=0)
    if np.linalg.norm(outward) < 0.1:  # contours all round a body: the mean says nothing
        outward = _across(np.concatenate([curve.points_mm for curve in curves]))
    return looking_at(points, outward, tilt_deg=tilt_deg, axes=registration.T_scan_part[:3, :3])


def _across(points: FloatArray) -> FloatArray:
    """Return the unit normal of the best plane, on the side where its largest component is positive."""
    offset = points - points.mean(axis=0)
    _, directions = np.linalg.eigh(offset.T @ offset)
    normal: FloatArray = directions[:, 0]
    return normal if normal[np.argmax(np.abs(normal))] > 0 else -normal


def sample(count: int) -> IntArray:
    """Return the indices of at most `SHOWN_POINTS` of so many points, spread evenly and always the same."""
    if count <= SHOWN_POINTS:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, SHOWN_POINTS, replace=False))


def _one_colour(points: FloatArray, rgb: tuple[int, int, int]) -> npt.NDArray[np.uint8]:
    return np.tile(np.array(rgb, np.uint8), (len(points), 1))


def _loop(curve: FramedCurve, colour: str, width_px: float, lift_mm: float) -> Line:
    points = np.concatenate([curve.points_mm, curve.points_mm[:1]]) if curve.closed else curve.points_mm
    return Line(points, colour, width_px, lift_mm)


def _line(curve: FramedCurve, stretch: tuple[float, float], colour: str, width_px: float, lift_mm: float) -> Line:
    count = max(2, int(np.ceil(len(curve) * (stretch[1] - stretch[0]) / curve.length_mm)) + 1)
    s = np.linspace(stretch[0], stretch[1], count)
    return Line(at(curve, s).points_mm, colour, width_px, lift_mm)


def _pieces(contour: RegisteredContour, lift_mm: float) -> Iterable[Line]:
    """Yield the contour between its subdivision points, neighbours in different colours."""
    curve = contour.corrected
    borders = np.sort(contour.split_s_mm)
    if curve.closed and len(borders) < 2:
        borders = np.array([0.0, curve.length_mm])
    elif curve.closed:
        borders = np.append(borders, borders[0] + curve.length_mm)
    else:
        borders = np.unique(np.concatenate([[0.0], borders, [curve.length_mm]]))
    count = len(borders) - 1
    for index in range(count):
        odd_seam = curve.closed and count % 2 == 1 and count > 1 and index == count - 1
        colour = _PIECES[2] if odd_seam else _PIECES[index % 2]
        yield _line(curve, (float(borders[index]), float(borders[index + 1])), colour, 8.0, lift_mm)


def _overlaps(contour: RegisteredContour) -> list[tuple[float, float]]:
    curve = contour.corrected
    return marked(curve, covered_twice(contour.segments, curve, curve.s_mm)) if len(contour.segments) > 1 else []


def _extremes(loop: FloatArray, camera: Camera) -> FloatArray:
    """Return the points of a loop that are farthest to eight sides of the picture, where its number may stand."""
    placed = pixels(camera, loop)
    angles = np.radians([45, 0, 90, 135, 180, 225, 270, 315])
    sides = np.stack([np.cos(angles), np.sin(angles)])
    extremes: FloatArray = loop[np.argmax(placed @ sides, axis=0)]
    return extremes
