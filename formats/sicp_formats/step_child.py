"""Read a STEP file with the CAD kernel, in a process of its own: `python -m sicp_formats.step_child FOLDER`.

The kernel can hang, crash or print on strange files; `sicp_formats.step` starts this module through
`sicp_cam.child_process` and takes its answer. The file comes as the bytes that were hashed, not by its name.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sicp_cam.child_process import answer, received
from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_cam.model import FloatArray
from sicp_formats.step_faces import Body, bodies
from sicp_formats.step_loading import check_faces, load
from sicp_formats.step_mesh import LARGEST_SAG_MM, FaceMesh, joined, signed_volume, tessellate
from sicp_formats.step_notes import Notes
from sicp_formats.step_rings import ring_points, skin_surface
from sicp_formats.step_sampling import SampledLoop, sample_loop
from sicp_formats.step_skins import Skin, skins

__all__ = ["main"]

GAP_MM, WRONG_MM = 0.05, 0.5
"""Curves that leave their surface, or miss each other, by the first are worth a warning, by the second are refused."""


@dataclass(frozen=True, slots=True, eq=False)
class _SkinOfBody:
    body: Body
    meshes: list[FaceMesh | None]
    skin: Skin


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """One contour to be: a sampled loop with its stability points."""

    loop: SampledLoop
    ring_points: FloatArray
    ring_normals: FloatArray

    def order(self) -> tuple[float, ...]:
        """Return the sort key: longest first, then by position, rounded so that it is the same in every run."""
        points = self.loop.points_mm
        around = np.vstack([points, points[:1]]) if self.loop.closed else points
        length = np.linalg.norm(np.diff(around, axis=0), axis=1).sum()
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        return (-round(float(length), 3), *np.round(middle, 3).tolist(), *np.round(self.loop.normals[0], 3).tolist())


def main(folder: Path) -> None:
    """Answer the request in a folder: the part's arrays, or the error that the parent is to raise."""
    told = received(folder)
    content = told.arrays["content"].tobytes()
    (folder / "part.step").write_bytes(content)
    try:
        values, arrays = _read(folder, content, told.values)
    except (CadError, UnitError) as error:
        values, arrays = {"error": type(error).__name__, "message": str(error)}, {}
    answer(folder, values, arrays)


def _read(folder: Path, content: bytes, request: dict[str, Any]) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    notes = Notes()
    loaded = load(folder / "part.step", folder / "output.txt", request["units"], request["coordinate_mm"], notes)
    parts = _skins(loaded.shape, content, notes)
    edges = sorted((edge for part in parts for edge in _edges(part, notes)), key=_Edge.order)
    members = [[mesh for i in part.skin.faces if (mesh := part.meshes[i]) is not None] for part in parts]
    vertices, triangles, normals = joined([meshes for meshes in members if meshes])
    if not len(triangles):
        raise CadError("the CAD kernel cannot tessellate any of its faces; export it again")
    values = {"unit": loaded.unit, "unit_stated": loaded.unit_stated, "notes": notes.rows()}
    return values, {"vertices": vertices, "triangles": triangles, "vertex_normals": normals, **_packed(edges)}


def _skins(shape: Any, content: bytes, notes: Notes) -> list[_SkinOfBody]:
    """Return the skins of all bodies, outward side out, with the meshes of the body's faces."""
    found = bodies(shape)
    if not found:
        raise CadError("holds no faces, only curves or points; export the solid or its faces")
    check_faces(content, found, notes)
    meshes, sag = tessellate(shape, found)
    if sag > LARGEST_SAG_MM:
        notes.add(
            209, Level.INFO, f"the mesh for pictures is off the surface by up to {sag:.2f} mm; contours are exact"
        )
    parts = []
    for number, (body, body_meshes) in enumerate(zip(found, meshes, strict=True), start=1):
        body, body_meshes = _outward(body, body_meshes, number, notes)
        of_body = skins(body, lambda line: notes.add(207, Level.WARN, line))
        parts += [_SkinOfBody(body, body_meshes, skin) for skin in of_body]
    return parts


def _outward(
    body: Body, meshes: list[FaceMesh | None], number: int, notes: Notes
) -> tuple[Body, list[FaceMesh | None]]:
    missing = sum(mesh is None for mesh in meshes)
    if missing:
        notes.add(209, Level.WARN, f"{missing} faces of body {number} cannot be tessellated; pictures lack them")
    if not body.solid:
        notes.add(210, Level.INFO, f"body {number} encloses no volume; the outward side is the one its faces state")
    elif not missing and signed_volume(mesh for mesh in meshes if mesh is not None) < 0.0:
        notes.add(203, Level.WARN, f"solid {number} is inside out in the file; its faces are turned outward")
        return body.turned(), [mesh.turned() if mesh is not None else None for mesh in meshes]
    return body, meshes


def _edges(part: _SkinOfBody, notes: Notes) -> list[_Edge]:
    surface = skin_surface(part.body, part.skin, part.meshes)
    edges = []
    for loop in part.skin.loops:
        sampled = sample_loop(loop, part.body)
        if sampled is None:
            notes.add(208, Level.WARN, "a loop of edges has no length or no surface normal; it is left out")
            continue
        at = "({:.1f}, {:.1f}, {:.1f})".format(*sampled.points_mm[0])
        if not sampled.closed:
            notes.add(208, Level.WARN, f"the boundary that starts at {at} does not close; it is an open contour")
        if not sampled.gap_mm <= WRONG_MM:
            raise CadError(
                f"the edge through {at} is {sampled.gap_mm:.3g} mm off its surface or the next edge; export it again"
            )
        if sampled.gap_mm > GAP_MM:
            notes.add(206, Level.WARN, f"the edge through {at} is off its surface, or open, by {sampled.gap_mm:.3f} mm")
        edges.append(_Edge(sampled, *ring_points(sampled, surface)))
    return edges


def _packed(edges: list[_Edge]) -> dict[str, npt.NDArray[Any]]:
    """Return the edges as arrays one behind the other, with the number of rows of each."""
    loops = [edge.loop for edge in edges]
    rows = {
        "points": [loop.points_mm for loop in loops],
        "tangents": [loop.tangents for loop in loops],
        "normals": [loop.normals for loop in loops],
        "ring_points": [edge.ring_points for edge in edges],
        "ring_normals": [edge.ring_normals for edge in edges],
    }
    packed: dict[str, npt.NDArray[Any]] = {key: np.vstack([np.zeros((0, 3)), *value]) for key, value in rows.items()}
    packed["corners"] = np.concatenate([np.zeros(0, np.int64), *(loop.corners for loop in loops)])
    packed["closed"] = np.array([loop.closed for loop in loops], dtype=np.bool_)
    packed["counts"] = np.array(
        [(len(e.loop.points_mm), len(e.loop.corners), len(e.ring_points)) for e in edges], dtype=np.int64
    ).reshape(-1, 3)
    return packed


if __name__ == "__main__":
    main(Path(sys.argv[1]))
