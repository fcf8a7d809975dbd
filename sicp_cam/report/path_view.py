"""The scene of the nominal and the corrected path with their tool axes."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from sicp_cam.model import BoolArray, FloatArray, ToolPath, TriangleMesh
from sicp_cam.registration.result import Registration
from sicp_cam.report.camera import Camera, pixels
from sicp_cam.report.lettering import Key, Lettering
from sicp_cam.report.scenes import Arrows, Layer, Line, Scene, Surface
from sicp_cam.report.views import PART, camera_on

__all__ = ["largest_correction", "paths_scene"]

RIGID, CORRECTED, RAPID = "#d0761f", "#1f4fa3", "#8f8f8f"
_SHOWN_ARROWS = 44


def paths_scene(
    mesh_scan_frame: TriangleMesh,
    path_rigid: ToolPath,
    path_corrected: ToolPath,
    registration: Registration,
    exaggeration: float = 1.0,
) -> Scene:
    """Return the picture of the nominal (rigidly registered) and the corrected path with tool axes (figure 11).

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
    seen = np.concatenate([*(places[~path.rapid] for path, places, _, _ in drawn), *(c.points_mm for c in curves)])
    length = 0.07 * float(np.linalg.norm(np.ptp(seen, axis=0)))
    heads = [(places + length * path.axes)[~path.rapid] for path, places, _, _ in drawn]
    camera = camera_on(np.concatenate([seen, *heads]), registration, tilt_deg=50.0)
    # Seen aslant, a path that sags by d lies up to some 3 d behind the surface.
    lift = camera.mm_per_px * 6 + 3.0 * exaggeration * min(largest_correction(path_rigid, path_corrected), length)
    layers: list[Layer] = [Surface(mesh_scan_frame, PART)]
    for path, places, colour, width in drawn:
        for rapid, run in _runs(places, path.rapid):
            layers.append(Line(_thinned(run, camera), RAPID if rapid else colour, 1.5 if rapid else width, lift))
        cut = np.flatnonzero(~path.rapid)
        chosen = cut[np.unique(np.linspace(0, len(cut) - 1, min(_SHOWN_ARROWS, len(cut))).astype(np.int64))]
        layers.append(Arrows(places[chosen], path.axes[chosen], length, colour, lift))
        lift += camera.mm_per_px * 4
    keys = [Key("nominal path, rigidly registered", RIGID), Key("corrected path", CORRECTED)]
    if path_rigid.rapid.any() or path_corrected.rapid.any():
        keys.append(Key("rapid moves", RAPID))
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


def _runs(tips: FloatArray, rapid: BoolArray) -> Iterable[tuple[bool, FloatArray]]:
    """Yield the path in pieces of rapid and of cutting moves, each from where the piece before it ended."""
    borders = [0, *(np.flatnonzero(rapid[1:] != rapid[:-1]) + 1).tolist(), len(tips)]
    for start, end in pairwise(borders):
        if end > start:
            yield bool(rapid[start]), tips[max(start - 1, 0) : end]


def _thinned(tips: FloatArray, camera: Camera) -> FloatArray:
    """Leave out points that fall on the pixel of the point before them."""
    cell = np.round(pixels(camera, tips) * 2.0)
    moved = np.any(np.diff(cell, axis=0) != 0, axis=1)
    kept = np.ones(len(tips), np.bool_)
    kept[1:-1] = moved[:-1]
    thin: FloatArray = tips[kept]
    return thin
