"""Scans and meshes as PLY files, in doubles, so that nothing is lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeAlias

import numpy as np

from sicp_cam.errors import JobError
from sicp_cam.model import FloatArray, IntArray, Part, Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.source import unit_to_state
from sicp_formats.surfaces.names import written_names

__all__ = ["write_part", "write_scan"]

Encoding: TypeAlias = Literal["ascii", "binary_little_endian", "binary_big_endian"]

_XYZ = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_TAKEN = (*_XYZ, *_NORMAL, "X", "Y", "Z", "normal_x", "normal_y", "normal_z")
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def write_scan(scan: Scan, *, unit: str = "mm", encoding: Encoding = "binary_little_endian") -> bytes:
    """Return a scan as the bytes of a PLY file: points, normals, columns and faces.

    Parameters
    ----------
    scan
        The scan.
    unit
        Unit of the coordinates, which a comment states, `comment unit mm`, unless that of the scan is not known.
    encoding
        How the rows are written.

    Returns
    -------
    bytes
        All numbers are doubles: in mm, they read back exactly. Blanks in the names of columns become underscores.

    Raises
    ------
    JobError
        If the encoding is unknown, or the name of a column cannot be written.
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan(np.eye(3)), encoding="ascii").decode().splitlines()[-1]
    '0.0 0.0 1.0'
    """
    return _encoded(
        scan.points_mm, scan.normals, scan.columns, scan.faces, unit, unit_to_state(scan.source, unit), encoding
    )


def write_part(part: Part, *, unit: str = "mm", encoding: Encoding = "binary_little_endian") -> bytes:
    """Return the mesh of a part as the bytes of a PLY file.

    The format has no place for contours; they are found again as the loops of the mesh.

    Parameters
    ----------
    part, unit
        As for `write_scan`.
    encoding
        "binary_little_endian", "binary_big_endian" or "ascii".

    Raises
    ------
    JobError, UnitError
        As `write_scan` does; and if the part has no triangles.
    """
    mesh = part.mesh
    if not len(mesh.faces):
        raise JobError("the part has no triangles, and a PLY file of a part needs them; write it as a scan")
    return _encoded(mesh.vertices_mm, mesh.normals, {}, mesh.faces, unit, unit_to_state(part.source, unit), encoding)


def _encoded(
    points_mm: FloatArray,
    normals: FloatArray | None,
    columns: Mapping[str, FloatArray],
    faces: IntArray | None,
    unit: str,
    stated: str,
    encoding: Encoding,
) -> bytes:
    if encoding not in _ORDERS:
        raise JobError(f"encoding: '{encoding}' is none of {', '.join(_ORDERS)}")
    factor = mm_per_unit(unit)
    names = (*_XYZ, *(() if normals is None else _NORMAL), *written_names(columns, _TAKEN))
    rows = np.column_stack([points_mm / factor, *([] if normals is None else [normals]), *columns.values()])
    lines = ["ply", f"format {encoding} 1.0", *([f"comment unit {stated}"] if stated else [])]
    lines += [f"element vertex {len(rows)}"]
    lines += [f"property double {name}" for name in names]
    faces = np.zeros((0, 3), np.int64) if faces is None else faces
    if len(faces):
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head = "\n".join([*lines, "end_header", ""]).encode("utf-8")
    return head + (_text(rows, faces) if encoding == "ascii" else _binary(rows, faces, _ORDERS[encoding]))


def _text(rows: FloatArray, faces: IntArray) -> bytes:
    lines = [" ".join(map(repr, row)) for row in rows.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    return "".join(f"{line}\n" for line in lines).encode("ascii")


def _binary(rows: FloatArray, faces: IntArray, order: str) -> bytes:
    corners = np.zeros(len(faces), [("count", "u1"), ("corners", f"{order}i4", (3,))])
    corners["count"], corners["corners"] = 3, faces
    return rows.astype(f"{order}f8").tobytes() + corners.tobytes()
