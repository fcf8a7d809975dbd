"""Scans as PCD files of version 0.7, in doubles, so that nothing is lost."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sicp_cam.errors import JobError
from sicp_cam.model import Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.source import unit_to_state
from sicp_formats.surfaces.names import written_names

__all__ = ["write_scan"]

_XYZ = ("x", "y", "z")
_NORMAL = ("normal_x", "normal_y", "normal_z")
_TAKEN = (*_XYZ, *_NORMAL, "X", "Y", "Z", "nx", "ny", "nz", "_")


def write_scan(scan: Scan, *, unit: str = "mm", data: Literal["binary", "ascii"] = "binary") -> bytes:
    """Return a scan as the bytes of a PCD file: points, normals and columns.

    Parameters
    ----------
    scan
        The scan. The format has no place for triangles: of a mesh, the vertices are written.
    unit
        Unit of the coordinates, which a comment states: `# unit mm`.
    data
        How the points are written.

    Returns
    -------
    bytes
        All numbers are doubles: in mm, they read back exactly. Blanks in the names of columns become underscores.

    Raises
    ------
    JobError
        If `data` is unknown, or the name of a column cannot be written.
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan(np.eye(3)), data="ascii").decode().splitlines()[-1]
    '0.0 0.0 1.0'
    """
    if data not in ("binary", "ascii"):
        raise JobError(f"data: '{data}' is none of binary, ascii")
    normals = [] if scan.normals is None else [scan.normals]
    names = (*_XYZ, *(_NORMAL if normals else ()), *written_names(scan.columns, _TAKEN))
    rows = np.column_stack([scan.points_mm / mm_per_unit(unit), *normals, *scan.columns.values()])
    stated = unit_to_state(scan.source, unit)
    lines = ["# .PCD v0.7 - Point Cloud Data file format", *([f"# unit {stated}"] if stated else []), "VERSION 0.7"]
    lines += [f"FIELDS {' '.join(names)}"]
    lines += [
        f"{key} {' '.join([value] * len(names))}" for key, value in (("SIZE", "8"), ("TYPE", "F"), ("COUNT", "1"))
    ]
    lines += [f"WIDTH {len(rows)}", "HEIGHT 1", "VIEWPOINT 0 0 0 1 0 0 0", f"POINTS {len(rows)}", f"DATA {data}", ""]
    head = "\n".join(lines).encode("utf-8")
    if data == "ascii":
        return head + "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist()).encode("ascii")
    return head + rows.astype("<f8").tobytes()
