"""Draw scenes off-screen with VTK; run by `scenes.render` as a process of its own, and imported by nobody.

VTK from 9.4 on looks for a way to draw by itself: the X server of DISPLAY, then EGL (with or without a graphics card),
then OSMesa. None of them needs a screen; a container needs libEGL with Mesa's software driver, or libOSMesa.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from sicp_cam.child_process import answer, received

__all__: list[str] = []

_Array = npt.NDArray[Any]
_FINER = 2
"""Everything is drawn this many times larger and averaged: smooth edges on every driver, without its own smoothing."""


def main(folder: Path) -> None:
    """Answer the request in the folder with one (height, width, 3) array of bytes for each scene."""
    told = received(folder)
    pictures = {str(i): _drawn(scene, told.arrays) for i, scene in enumerate(told.values["scenes"])}
    answer(folder, {}, pictures)


def _drawn(scene: dict[str, Any], arrays: dict[str, _Array]) -> npt.NDArray[np.uint8]:
    width_px, height_px = scene["size_px"]
    plotter = pv.Plotter(off_screen=True, window_size=[width_px * _FINER, height_px * _FINER], lighting="none")
    plotter.disable_anti_aliasing()
    plotter.background_color = pv.Color("white")
    towards_eye = np.array(scene["towards_eye"])
    _light(plotter, towards_eye, np.array(scene["up"]))
    for layer in scene["layers"]:
        points = arrays[f"{layer['name']}.points"] - scene["focus"] + layer.get("lift_mm", 0.0) * towards_eye
        if len(points):
            _DRAW[layer["kind"]](plotter, layer, points, arrays)
    _aim(plotter, scene, towards_eye)
    picture = _averaged(np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8))
    plotter.close()
    if scene["layers"] and (picture == picture[0, 0]).all():
        raise RuntimeError("the renderer returned an empty picture")
    return picture


def _averaged(fine: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    total = np.zeros((fine.shape[0] // _FINER, fine.shape[1] // _FINER, 3), np.uint16)
    for row in range(_FINER):
        for column in range(_FINER):
            total += fine[row::_FINER, column::_FINER]
    return (total // _FINER**2).astype(np.uint8)


def _light(plotter: pv.Plotter, towards_eye: _Array, up: _Array) -> None:
    """Light from over the viewer's left shoulder, and a weaker one from the right, at infinity."""
    right = np.cross(up, towards_eye)
    for direction, strength in ((towards_eye + 0.6 * up - 0.5 * right, 0.75), (towards_eye + 0.8 * right, 0.3)):
        light = pv.Light(position=tuple(direction), focal_point=(0, 0, 0), intensity=strength, light_type="scene light")
        light.positional = False
        plotter.add_light(light)


def _aim(plotter: pv.Plotter, scene: dict[str, Any], towards_eye: _Array) -> None:
    height_mm = scene["size_px"][1] * scene["mm_per_px"]
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point = (0.0, 0.0, 0.0)
    camera.position = tuple(towards_eye * 10.0 * height_mm)
    camera.up = tuple(scene["up"])
    camera.parallel_scale = 0.5 * height_mm
    plotter.renderer.ResetCameraClippingRange()


def _surface(plotter: pv.Plotter, layer: dict[str, Any], points: _Array, arrays: dict[str, _Array]) -> None:
    faces = arrays[f"{layer['name']}.faces"]
    if len(faces) == 0:
        return
    mesh = pv.PolyData.from_regular_faces(points, faces)
    whole = mesh.clean()
    if f"{layer['name']}.normals" in arrays:
        mesh.point_data.active_normals = arrays[f"{layer['name']}.normals"]
    else:
        mesh = whole.compute_normals(split_vertices=True, feature_angle=30.0, consistent_normals=False)
    plotter.add_mesh(mesh, color=layer["colour"], smooth_shading=True, ambient=0.35, diffuse=0.75, specular=0.0)
    edges = whole.extract_feature_edges(feature_angle=30.0, non_manifold_edges=False, manifold_edges=False)
    if edges.n_cells:
        plotter.add_mesh(edges, color="#8a8a8a", line_width=1.5 * _FINER, lighting=False)


def _dots(plotter: pv.Plotter, layer: dict[str, Any], points: _Array, arrays: dict[str, _Array]) -> None:
    plotter.add_points(
        pv.PolyData(points),
        scalars=arrays[f"{layer['name']}.colours"],
        rgb=True,
        point_size=layer["size_px"] * _FINER,
        render_points_as_spheres=layer["round"],
        lighting=layer["round"],
        ambient=0.6 if layer["round"] else 0.0,
        diffuse=0.5 if layer["round"] else 1.0,
    )


def _line(plotter: pv.Plotter, layer: dict[str, Any], points: _Array, arrays: dict[str, _Array]) -> None:
    """Draw a tube: OpenGL's own wide lines get thin on the diagonal and come apart at bends."""
    moved = np.concatenate([[True], np.any(np.diff(points, axis=0) != 0.0, axis=1)])
    points = points[moved]
    if len(points) < 2:
        return
    line = pv.PolyData(points, lines=np.concatenate([[len(points)], np.arange(len(points))]))
    tube = line.tube(radius=layer["radius_mm"], n_sides=12, capping=True)
    plotter.add_mesh(tube, color=layer["colour"], lighting=False)


def _arrows(plotter: pv.Plotter, layer: dict[str, Any], points: _Array, arrays: dict[str, _Array]) -> None:
    cloud = pv.PolyData(points)
    cloud["direction"] = arrays[f"{layer['name']}.directions"]
    shape = pv.Arrow(tip_length=0.25, tip_radius=0.05, shaft_radius=0.016, tip_resolution=16, shaft_resolution=8)
    glyphs = cloud.glyph(orient="direction", scale=False, factor=layer["length_mm"], geom=shape)
    plotter.add_mesh(glyphs, color=layer["colour"], ambient=0.5)


_DRAW = {"surface": _surface, "dots": _dots, "line": _line, "arrows": _arrows}


if __name__ == "__main__":
    main(Path(sys.argv[1]))
