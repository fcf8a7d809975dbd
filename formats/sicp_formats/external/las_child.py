"""Read a LAS or LAZ file in a process of its own: `python -m sicp_formats.external.las_child FOLDER`.

The decompressor is native code that damaged files can crash; `sicp_formats.external.las` starts this module.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import laspy
import numpy as np

from sicp_cam.child_process import answer, received
from sicp_formats.external.scans import packed

__all__ = ["main"]

_COORDINATES = ("X", "Y", "Z")


def main(folder: Path) -> None:
    """Answer the request in a folder: points and columns, or the error."""
    told = received(folder)
    try:
        values, arrays = _read(told.values["path"], told.values["points"])
    except Exception as error:  # whatever the libraries raise; they have many kinds
        words = " ".join(str(error).split("\n")[0].split())[:200]
        values, arrays = {"error": f"cannot be read as LAS ({type(error).__name__}: {words}); export it again"}, {}
    answer(folder, values, arrays)


def _read(path: str, count: int) -> tuple[dict[str, Any], dict[str, Any]]:
    with laspy.open(path, read_evlrs=False) as reader:
        header, found = reader.header, reader.read_points(count)
    raw = np.column_stack([np.asarray(found[name]) for name in _COORDINATES])
    points = raw * np.asarray(header.scales, np.float64) + np.asarray(header.offsets, np.float64)
    columns = {}
    for name in found.point_format.dimension_names:
        numbers = np.asarray(found[name])
        # Each point format has a dozen fields, of which most files fill a few.
        if name not in _COORDINATES and numbers.ndim == 1 and numbers.any():
            columns[name] = numbers.astype(np.float64)
    return packed(points, None, columns, ())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
