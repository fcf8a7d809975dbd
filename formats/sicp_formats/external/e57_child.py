"""Read an E57 file in a process of its own: `python -m sicp_formats.external.e57_child FOLDER`.

The library is native code that damaged files can crash; `sicp_formats.external.e57` starts this module.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pye57
from pye57 import libe57
from pye57.utils import get_node

from sicp_cam.child_process import answer, received
from sicp_cam.model import FloatArray
from sicp_formats.external.scans import packed
from sicp_formats.surfaces.checks import Code

__all__ = ["main"]

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_NORMAL = ("nor:normalX", "nor:normalY", "nor:normalZ")
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")
_COLOURS = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}
_UNIT_TOLERANCE = 1e-3


class _DamagedError(Exception):
    """What is wrong with the file, in one line."""


@dataclass(frozen=True, slots=True, eq=False)
class _Station:
    """One scan of the file in the common frame, metres."""

    points: FloatArray
    normals: FloatArray | None
    columns: Mapping[str, FloatArray]
    invalid: int


def main(folder: Path) -> None:
    """Answer the request in a folder: points, normals and columns of all scans, or the error."""
    told = received(folder)
    try:
        values, arrays = _read(told.values["path"], told.values["points"])
    except _DamagedError as error:
        values, arrays = {"error": str(error)}, {}
    except Exception as error:  # whatever the library raises; it has many kinds
        words = " ".join(str(error).split("\n")[0].split())[:200]
        values, arrays = {"error": f"cannot be read as E57 ({type(error).__name__}: {words}); export it again"}, {}
    answer(folder, values, arrays)


def _read(path: str, most: int) -> tuple[dict[str, Any], dict[str, Any]]:
    stations, total = [], 0
    with pye57.E57(path) as file:
        for number in range(file.scan_count):
            node = file.data3d[number]
            total += node["points"].childCount()
            if total > most:
                raise _DamagedError(f"{total} points are more than the limit points = {most}; raise it")
            if node["points"].childCount():
                stations.append(_station(file.image_file, node, Path(path).stat().st_size, number + 1))
    if not stations:
        raise _DamagedError("has no points; export the scan again")
    return _together(stations, total)


def _together(stations: list[_Station], total: int) -> tuple[dict[str, Any], dict[str, Any]]:
    notes = []
    if invalid := sum(each.invalid for each in stations):
        message = f"{invalid} of {total} points are marked as invalid and were dropped"
        notes.append((int(Code.INVALID_POINTS), "info", message))
    if len(stations) > 1:
        message = f"{len(stations)} scans of the file were brought into one frame by their poses"
        notes.append((int(Code.SCANS_JOINED), "info", message))
    named = [name for name in stations[0].columns if all(name in each.columns for each in stations)]
    if lost := sorted({name for each in stations for name in each.columns} - set(named)):
        message = f"{', '.join(lost)}: not of all scans in the file, and not read"
        notes.append((int(Code.COLUMNS_NOT_USED), "info", message))
    normals = [each.normals for each in stations if each.normals is not None]
    if normals and len(normals) < len(stations):
        notes.append((int(Code.NORMALS_NOT_USED), "info", "not all scans of the file have normals; none were used"))
    points = np.concatenate([each.points for each in stations])
    columns = {name: np.concatenate([each.columns[name] for each in stations]) for name in named}
    return packed(points, np.concatenate(normals) if len(normals) == len(stations) else None, columns, notes)


def _station(file: Any, node: Any, file_bytes: int, number: int) -> _Station:
    vector, count = node["points"], node["points"].childCount()
    prototype = libe57.StructureNode(vector.prototype())
    fields = {name: field for name, field in _fields(prototype).items() if hasattr(field, "minimum")}
    place = next((names for names in (_CARTESIAN, _SPHERICAL) if all(name in fields for name in names)), None)
    if place is None:
        raise _DamagedError(f"scan {number} has neither cartesian nor spherical coordinates; export it with them")
    bits = sum(_least_bits(field) for field in fields.values())
    if count * bits > 8 * file_bytes:
        what = (
            f"scan {number} declares {count} points x {bits} bits = {count * bits // 8} B, {file_bytes} B in the file"
        )
        raise _DamagedError(f"{what}; it is damaged")
    read = _numbers(file, vector, list(fields), count)
    valid = np.ones(count, dtype=np.bool_)
    for name in _INVALID:
        if name in read and name[:9] == place[0][:9]:
            valid &= read[name] == 0.0
    read = {name: values[valid] for name, values in read.items()}
    R, t = _pose(node, number)
    points = np.column_stack([read[name] for name in place])
    points = (_from_spherical(points) if place is _SPHERICAL else points) @ R.T + t
    has_normals = all(name in read for name in _NORMAL)
    normals = np.column_stack([read[name] for name in _NORMAL]) @ R.T if has_normals else None
    used = {*_CARTESIAN, *_SPHERICAL, *_INVALID, *(_NORMAL if has_normals else ())}
    columns = {_COLOURS.get(name, name): values for name, values in read.items() if name not in used}
    return _Station(points, normals, columns, count - int(valid.sum()))


def _fields(prototype: Any) -> dict[str, Any]:
    names = [prototype.get(i).elementName() for i in range(prototype.childCount())]
    return {name: get_node(prototype, name) for name in names}


def _least_bits(field: Any) -> int:
    """Return how many bits a number of this field takes at least."""
    if isinstance(field, libe57.FloatNode):
        return 64 if field.precision() == libe57.E57_DOUBLE else 32
    return int(field.maximum() - field.minimum()).bit_length()


def _numbers(file: Any, vector: Any, names: list[str], count: int) -> dict[str, FloatArray]:
    read = {name: np.empty(count, np.float64) for name in names}
    buffers = libe57.VectorSourceDestBuffer()
    for name, values in read.items():
        buffers.append(libe57.SourceDestBuffer(file, name, values, count, True, True))
    reader = vector.reader(buffers)
    found = reader.read()
    reader.close()
    if found != count:
        raise _DamagedError(f"{count} points are declared and {found} present; it is cut short")
    return read


def _from_spherical(points: FloatArray) -> FloatArray:
    distance, azimuth, elevation = points.T
    level = distance * np.cos(elevation)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)])


def _pose(node: Any, number: int) -> tuple[FloatArray, FloatArray]:
    """Return rotation and translation of a scan: the identity where the file has none."""
    w, x, y, z = _members(node, "rotation", "wxyz", (1.0, 0.0, 0.0, 0.0))
    t = np.array(_members(node, "translation", "xyz", (0.0, 0.0, 0.0)))
    length = np.sqrt(w * w + x * x + y * y + z * z)
    if not (abs(length - 1.0) <= _UNIT_TOLERANCE and np.isfinite(t).all()):
        raise _DamagedError(
            f"the pose of scan {number} is no rigid motion (quaternion of length {length:g}); export it again"
        )
    v, cross = np.array([x, y, z]) / length, np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / length
    w /= length
    return (w * w - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * w * cross, t


def _members(node: Any, name: str, members: str, absent: tuple[float, ...]) -> tuple[float, ...]:
    if not node.isDefined(f"pose/{name}"):
        return absent
    return tuple(float(node[f"pose/{name}/{member}"].value()) for member in members)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
