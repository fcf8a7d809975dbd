"""Pictures of three-dimensional things: what to draw as plain data, drawn by a renderer in a child process.

A renderer is native code on whatever graphics driver the machine has, and may crash or hang; so VTK is never imported
here. The child draws the geometry only; titles, legends and scales are put on by `lettering`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_cam.child_process import ChildCrashError, ChildTimeoutError, run
from sicp_cam.errors import ReportError
from sicp_cam.limits import DEFAULT_LIMITS
from sicp_cam.model import FloatArray, TriangleMesh
from sicp_cam.report.camera import Camera
from sicp_cam.report.lettering import Lettering, lettered

__all__ = ["Arrows", "Dots", "Layer", "Line", "Scene", "Surface", "render"]

_CHILD = "sicp_cam.report.scenes_child"


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles in one colour with their sharp edges and borders drawn."""

    mesh: TriangleMesh
    colour: str


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Points, each with its own colour: (n, 3) mm and (n, 3) red, green, blue of 0..255.

    `lift_mm` brings them nearer to the eye, which a parallel camera does not show: they are not hidden by a surface
    that they lie a little below. The same holds for lines.
    """

    points_mm: FloatArray
    colours: npt.NDArray[np.uint8]
    size_px: float
    lift_mm: float = 0.0
    round: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A polyline through (n, 3) points."""

    points_mm: FloatArray
    colour: str
    width_px: float
    lift_mm: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Arrows:
    """Arrows of one length from (n, 3) points along (n, 3) unit vectors."""

    starts_mm: FloatArray
    directions: FloatArray
    length_mm: float
    colour: str
    lift_mm: float = 0.0


Layer: TypeAlias = Surface | Dots | Line | Arrows


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One picture: the layers, the eye and the words."""

    layers: tuple[Layer, ...]
    camera: Camera
    lettering: Lettering = field(default_factory=Lettering)


def render(scenes: Sequence[Scene], timeout_s: float = 120.0) -> list[bytes]:
    """Draw the scenes in one child process and return a PNG file for each.

    Raises
    ------
    ReportError
        If the renderer crashed, found no way to draw on this machine, or ran out of time.
    """
    if not scenes:
        return []
    arrays: dict[str, npt.NDArray[Any]] = {}
    request = {"scenes": [_told(scene, f"{index}", arrays) for index, scene in enumerate(scenes)]}
    try:
        result = run(_CHILD, request, arrays, timeout_s=timeout_s, memory_bytes=DEFAULT_LIMITS.child_memory_bytes)
    except ChildTimeoutError as error:
        raise ReportError(
            f"pictures: the renderer gave {error}; repeat with more time, or leave the pictures out"
        ) from error
    except (ChildCrashError, OSError) as error:
        raise ReportError(
            f"pictures: the renderer failed ({error}); check with 'sicp-cam doctor' that this machine can draw "
            "off-screen (EGL or OSMesa), or leave the pictures out"
        ) from error
    return [lettered(result.arrays[str(index)], scene.camera, scene.lettering) for index, scene in enumerate(scenes)]


def _told(scene: Scene, name: str, arrays: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    camera = scene.camera
    return {
        "focus": camera.focus_mm.tolist(),
        "up": camera.up.tolist(),
        "towards_eye": camera.towards_eye.tolist(),
        "size_px": [camera.width_px, camera.height_px],
        "mm_per_px": camera.mm_per_px,
        "layers": [_layer(layer, f"{name}.{index}", camera, arrays) for index, layer in enumerate(scene.layers)],
    }


def _layer(layer: Layer, name: str, camera: Camera, arrays: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    match layer:
        case Surface():
            arrays[f"{name}.points"], arrays[f"{name}.faces"] = layer.mesh.vertices_mm, layer.mesh.faces
            if layer.mesh.normals is not None:
                arrays[f"{name}.normals"] = layer.mesh.normals
            return {"kind": "surface", "name": name, "colour": layer.colour}
        case Dots():
            arrays[f"{name}.points"], arrays[f"{name}.colours"] = layer.points_mm, layer.colours
            told = {"kind": "dots", "size_px": layer.size_px, "round": layer.round}
        case Line():
            arrays[f"{name}.points"] = layer.points_mm
            told = {"kind": "line", "radius_mm": 0.5 * layer.width_px * camera.mm_per_px, "colour": layer.colour}
        case Arrows():
            arrays[f"{name}.points"], arrays[f"{name}.directions"] = layer.starts_mm, layer.directions
            told = {"kind": "arrows", "length_mm": layer.length_mm, "colour": layer.colour}
    return told | {"name": name, "lift_mm": layer.lift_mm}
