"""The scene of the nominal and the corrected path with their tool axes."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from matplotlib.colors import to_rgb

from sicp_cam.model import BoolArray, FloatArray, ToolPath, TriangleMesh
from sicp_cam.registration.result import Registration
from sicp_cam.report.camera import Camera, pixels
from sicp_cam.report.lettering import Key, Lettering
from sicp_cam.report.scenes import Arrows, Dots, Layer, Line, Scene, Surface
from sicp_cam.report.views import PART, camera_on

__all__ = ["largest_correction", "paths_scene"]

RIGID, CORRECTED, RAPID = "#d0761f", "#1f4fa3", "#c2189b"
_RAPID_RGB = np.round(255.0 * np.array(to_rgb(RAPID))).astype(np.uint8)
_SHOWN_ARROWS = 44
_DOT_EVERY_PX, _MOST_DOTS = 13.0, 50_000


def paths_scene(
    mesh_scan_frame: TriangleMesh,
    path_rigid: ToolPath,
    path_corrected: ToolPath,
    registration: Registration,
    exaggeration: float = 1.0,
) -> Scene:
    """Return the picture of the nominal (rigidly registered) and the corrected path with tool axes (figure 11).

    All feed moves are in view. Rapid moves of the corrected path are dotted as far as they are in view; a rapid move
    at the very beginning comes from a place that the path does not say, and is not drawn.

    Parameters
    ----------
    exaggeration
        How many times larger than it is the correction is drawn, which the title then says; other than 1 only for
        paths that correspond move by move. Axes are never exaggerated.
    """
    curves = [contour.rigid for contour in registration.contours]
    tips = path_corrected.tips_mm
    if exaggeration != 1.0:
        tips = path_rigid.tips_mm + exaggeration * (tips - path_rigid.tips_mm)
    drawn = ((path_rigid, path_rigid.tips_mm, RIGID, 2.5), (path_corrected, tips, CORRECTED, 3.5))
    seen = np.concatenate([*(places[_fed(path.rapid)] for path, places, _, _ in drawn), *(c.points_mm for c in curves)])
    length = 0.07 * float(np.linalg.norm(np.ptp(seen, axis=0)))
    heads = [(places + length * path.axes)[~path.rapid] for path, places, _, _ in drawn]
    camera = camera_on(np.concatenate([seen, *heads]), registration, tilt_deg=50.0)
    # Seen aslant, a path that sags by d lies up to some 3 d behind the surface.
    lift = camera.mm_per_px * 6 + 3.0 * exaggeration * min(largest_correction(path_rigid, path_corrected), length)
    layers: list[Layer] = [Surface(mesh_scan_frame, PART)]
    for path, places, colour, width in drawn:
        feeds = _runs(places, path.rapid, rapid=False)
        layers += [Line(_thinned(run, camera), colour, width, lift) for run in feeds]
        cut = np.flatnonzero(~path.rapid)
        chosen = cut[np.unique(np.linspace(0, len(cut) - 1, min(_SHOWN_ARROWS, len(cut))).astype(np.int64))]
        layers.append(Arrows(places[chosen], path.axes[chosen], length, colour, lift))
        lift += camera.mm_per_px * 4
    keys = [Key("nominal path, rigidly registered", RIGID), Key("corrected path", CORRECTED)]
    dots = [_dotted(run, camera) for run in _runs(tips, path_corrected.rapid, rapid=True)]
    rapids = np.concatenate([np.zeros((0, 3)), *dots])
    if len(rapids):
        lift += camera.mm_per_px * 8  # over the feed moves: in and out are often the same line
        layers.append(Dots(rapids, np.tile(_RAPID_RGB, (len(rapids), 1)), 6.0, lift, True))
        keys.append(Key("rapid moves, corrected path", RAPID, ":"))
    larger = "" if exaggeration == 1.0 else f", correction drawn {exaggeration:g} times larger"
    scale = "true to scale" if exaggeration == 1.0 else "positions of the corrected path are NOT true to scale"
    words = Lettering(
        f"Nominal and corrected path{larger}",
        f"{scale}; arrows: tool axis from tip to holder, {_SHOWN_ARROWS} of each path at most",
        tuple(keys),
    )
    return Scene(tuple(layers), camera, words)


def largest_correction(path_rigid: ToolPath, path_corrected: ToolPath) -> float:
    """Return the largest distance between corresponding cutting moves, mm; 0 if the paths do not correspond."""
    if len(path_rigid) != len(path_corrected):
        return 0.0
    shift = np.linalg.norm(path_corrected.tips_mm - path_rigid.tips_mm, axis=1)
    return float(np.max(shift[~path_rigid.rapid], initial=0.0))


def _fed(rapid: BoolArray) -> BoolArray:
    """Mark the ends and the starts of the feed moves."""
    fed = ~rapid
    fed[:-1] |= ~rapid[1:]
    return fed


def _runs(tips: FloatArray, among: BoolArray, *, rapid: bool) -> Iterable[FloatArray]:
    """Yield the pieces of rapid or of feed moves, each from where the piece before it ended."""
    borders = [0, *(np.flatnonzero(among[1:] != among[:-1]) + 1).tolist(), len(tips)]
    for start, end in pairwise(borders):
        if end > start and among[start] == rapid:
            yield tips[max(start - 1, 0) : end]


def _dotted(tips: FloatArray, camera: Camera) -> FloatArray:
    """Return (n, 3) points along a polyline, equally far apart in the picture, as far as they lie in it."""
    across = np.linalg.norm(np.diff(pixels(camera, tips), axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(across)])
    if not np.ptp(tips, axis=0).any():
        return np.zeros((0, 3))
    count = min(max(2, int(along[-1] / _DOT_EVERY_PX)), _MOST_DOTS)
    wanted = np.linspace(0.0, along[-1], count)
    dots = np.stack([np.interp(wanted, along, tips[:, axis]) for axis in range(3)], axis=1)
    placed = pixels(camera, dots)
    inside: FloatArray = dots[np.all((placed >= 0.0) & (placed <= [camera.width_px, camera.height_px]), axis=1)]
    return inside


def _thinned(tips: FloatArray, camera: Camera) -> FloatArray:
    """Leave out points that fall on the pixel of the point before them."""
    cell = np.round(pixels(camera, tips) * 2.0)
    moved = np.any(np.diff(cell, axis=0) != 0, axis=1)
    kept = np.ones(len(tips), np.bool_)
    kept[1:-1] = moved[:-1]
    thin: FloatArray = tips[kept]
    return thin
