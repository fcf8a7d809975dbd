"""Read a CAD file with the CAD kernel, in a process of its own: `python -m sicp_formats.cad.child FOLDER`.

The kernel can hang, crash or print on strange files; `sicp_formats.cad.part` starts this module through
`sicp_cam.child_process` and takes its answer. The file comes as the bytes that were hashed, not by its name.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.Standard import Standard_OutOfMemory

from sicp_cam.child_process import answer, received
from sicp_cam.errors import CadError, UnitError
from sicp_cam.findings import Level
from sicp_cam.model import FloatArray
from sicp_formats.cad import brep_loading, iges_loading, step_loading
from sicp_formats.cad.bodies import chosen, list_bodies, separated
from sicp_formats.cad.faces import Body
from sicp_formats.cad.mesh import LARGEST_SAG_MM, FaceMesh, joined, signed_volume, stored, tessellate
from sicp_formats.cad.notes import Code, Notes
from sicp_formats.cad.repairs import checked
from sicp_formats.cad.rings import ring_points, skin_surface
from sicp_formats.cad.sampling import SampledLoop, sample_loop
from sicp_formats.cad.sewing import compound
from sicp_formats.cad.shape import Loaded, Order, nothing_in
from sicp_formats.cad.skins import Skin, skins

__all__ = ["main"]

GAP_MM, WRONG_MM = 0.05, 0.5
"""Curves that leave their surface, or miss each other, by the first are worth a warning, by the second are refused."""
_LOADERS = {"STEP": step_loading.load, "IGES": iges_loading.load, "BREP": brep_loading.load}


@dataclass(frozen=True, slots=True, eq=False)
class _SkinOfBody:
    number: int
    body: Body
    meshes: list[FaceMesh | None]
    skin: Skin


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """One contour to be: a sampled loop with its stability points, and the number of its body."""

    body: int
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
    (folder / "part.cad").write_bytes(content)
    try:
        values, arrays = _read(folder, content, told.values)
    except (CadError, UnitError) as error:
        values, arrays = {"error": type(error).__name__, "message": str(error)}, {}
    except Exception as error:
        # The kernel's own exceptions have no common root here; running out of memory is not the file's fault.
        if not type(error).__module__.startswith("OCP") or isinstance(error, Standard_OutOfMemory):
            raise
        what = f"the CAD kernel fails on it ({type(error).__name__}: {error}); it is damaged, export it again"
        values, arrays = {"error": "CadError", "message": what}, {}
    answer(folder, values, arrays)


def _read(folder: Path, content: bytes, request: dict[str, Any]) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    notes = Notes()
    recover = bool(request["recover"])
    order = Order(folder / "part.cad", folder / "output.txt", request["units"], request["coordinate_mm"], recover)
    loaded = _LOADERS[request["format"]](order, notes)
    if request["format"] == "STEP":
        step_loading.check_faces(content, loaded.shape, notes)
    loaded = replace(loaded, shape=checked(loaded.shape, recover, notes))
    arrays = _arrays(loaded, request, notes)
    values = {"unit": loaded.unit, "unit_stated": loaded.unit_stated, "notes": notes.rows()}
    return values, arrays


def _arrays(loaded: Loaded, request: dict[str, Any], notes: Notes) -> dict[str, npt.NDArray[Any]]:
    """Return the mesh and the contours of a shape."""
    found = separated(loaded, request["sew_mm"], notes)
    triangles_only = stored(loaded.shape)
    if triangles_only:
        _note_triangles(len(triangles_only), bool(found), notes)
    elif not found:
        raise CadError(nothing_in(loaded.shape))
    wanted = chosen(found, request["body"])
    parts = _skins(found, wanted, request["turned"], notes)
    edges = sorted((edge for part in parts for edge in _edges(part, request["recover"], notes)), key=_Edge.order)
    list_bodies(found, wanted, [edge.body for edge in edges], notes)
    members = [[mesh for i in part.skin.faces if (mesh := part.meshes[i]) is not None] for part in parts]
    vertices, triangles, normals = joined([meshes for meshes in members if meshes] if found else [triangles_only])
    if not len(triangles):
        raise CadError("the CAD kernel cannot tessellate any of its faces; export it again")
    return {"vertices": vertices, "triangles": triangles, "vertex_normals": normals, **_packed(edges)}


def _note_triangles(count: int, others: bool, notes: Notes) -> None:
    if others:
        line = f"{count} faces have triangles and no surface; they are left out of contours and mesh"
        notes.add(Code.TRIANGLES_ONLY, Level.WARN, line)
    else:
        line = (
            f"its {count} faces are triangles only, so contours come from the open edges of the mesh, not exact curves"
        )
        notes.add(Code.TRIANGLES_ONLY, Level.WARN, line)


def _skins(found: list[Body], wanted: list[Body], turned: bool, notes: Notes) -> list[_SkinOfBody]:
    """Return the skins of the wanted bodies, outward side out, with the meshes of the body's faces."""
    meshes, sag = tessellate(compound(face.shape for body in wanted for face in body.faces), wanted)
    if sag > LARGEST_SAG_MM:
        line = f"the mesh for pictures is off the surface by up to {sag:.2f} mm; contours are exact"
        notes.add(Code.MESH_COARSE, Level.INFO, line)
    parts = []
    for body, body_meshes in zip(wanted, meshes, strict=True):
        number = next(number for number, each in enumerate(found, start=1) if each is body)
        if turned and not body.solid:
            body, body_meshes = body.turned(), [mesh.turned() if mesh is not None else None for mesh in body_meshes]
        body, body_meshes = _outward(body, body_meshes, number, notes)
        of_body = skins(body, lambda line: notes.add(Code.EDGE_ODD, Level.WARN, line))
        parts += [_SkinOfBody(number, body, body_meshes, skin) for skin in of_body]
    return parts


def _outward(
    body: Body, meshes: list[FaceMesh | None], number: int, notes: Notes
) -> tuple[Body, list[FaceMesh | None]]:
    missing = sum(mesh is None for mesh in meshes)
    if missing:
        line = f"{missing} faces of body {number} cannot be tessellated; pictures lack them"
        notes.add(Code.MESH_COARSE, Level.WARN, line)
    if not body.solid:
        line = f"body {number} encloses no volume; the outward side is the one its faces state (else set part.turned)"
        notes.add(Code.NO_VOLUME, Level.INFO, line)
    elif not missing and signed_volume(mesh for mesh in meshes if mesh is not None) < 0.0:
        line = f"solid {number} is inside out in the file; its faces are turned outward"
        notes.add(Code.INSIDE_OUT, Level.WARN, line)
        return body.turned(), [mesh.turned() if mesh is not None else None for mesh in meshes]
    return body, meshes


def _edges(part: _SkinOfBody, recover: bool, notes: Notes) -> list[_Edge]:
    surface = skin_surface(part.body, part.skin, part.meshes)
    edges = []
    for loop in part.skin.loops:
        sampled = sample_loop(loop, part.body)
        if sampled is None:
            line = "a loop of edges has no length or no surface normal; it is left out"
            notes.add(Code.LOOP_ODD, Level.WARN, line)
        elif _is_sound(sampled, recover, notes):
            edges.append(_Edge(part.number, sampled, *ring_points(sampled, surface)))
    return edges


def _is_sound(loop: SampledLoop, recover: bool, notes: Notes) -> bool:
    """Say whether a loop can be a contour; note what is odd about it, and refuse one that is far off its surface."""
    at = "({:.1f}, {:.1f}, {:.1f})".format(*loop.points_mm[0])
    if not loop.gap_mm <= WRONG_MM:
        off = f"the edge through {at} is {loop.gap_mm:.3g} mm off its surface or the next edge"
        if not recover:
            raise CadError(f"{off}; export it again, or repair it with --recover")
        notes.add(Code.LOOP_LEFT_OUT, Level.WARN, f"{off}; its contour is left out")
        return False
    if not loop.closed:
        line = f"the boundary that starts at {at} does not close; it is an open contour"
        notes.add(Code.LOOP_ODD, Level.WARN, line)
    if loop.gap_mm > GAP_MM:
        line = f"the edge through {at} is off its surface, or open, by {loop.gap_mm:.3f} mm"
        notes.add(Code.EDGE_OFF, Level.WARN, line)
    return True


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
