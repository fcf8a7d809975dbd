"""Write scans as tables of text: .asc, .xyz (blanks), .csv (commas), .txt (tabs), and .pts.

A header names the columns, and the unit where it is known, so that nothing needs to be guessed when the table is read
again. Numbers are written so that reading gives the same doubles, unless a number of decimals is asked for. Such tables
hold points only: triangles are not written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, JobError, printable
from sicp_cam.model import FloatArray, Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.ascii.columns import named_columns, split_header
from sicp_formats.source import unit_to_state

__all__ = ["write_csv", "write_pts", "write_scan", "write_txt"]

_DELIMITERS = {"blank": " ", "tab": "\t", "comma": ",", "semicolon": ";"}
_SIMPLE = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*")
_BATCH_ROWS = 50_000
_LARGEST_WHOLE = 2.0**53
_COLOURS = ("red", "green", "blue")


def write_scan(
    scan: Scan,
    *,
    unit: str = "mm",
    delimiter: str = "blank",
    decimal: str = ".",
    header: bool = True,
    decimals: int | None = None,
) -> bytes:
    """Write a scan as a table with its header in a comment, which other programs pass over: .asc and .xyz.

    Parameters
    ----------
    scan
        Points, normals and further columns are written, triangles are not.
    unit
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`.
    delimiter
        "blank", "tab", "comma" or "semicolon".
    decimal
        "." or ",".
    header
        False to leave the names of the columns away.
    decimals
        Decimals of all numbers that are not whole; as many as it takes to be exact if left out.

    Raises
    ------
    JobError
        If an option is wrong, or the name of a column would not be read as it is.
    UnitError
        If the unit is unknown.

    >>> write_scan(Scan([[0, 0, 0.5], [1, 0, 0], [0, 1, 0]])).decode().splitlines()[:2]
    ['# x_mm y_mm z_mm', '0.0 0.0 0.5']
    """
    return _table(scan, unit, delimiter, decimal, "# " if header else None, decimals)


def write_csv(
    scan: Scan,
    *,
    unit: str = "mm",
    delimiter: str = "comma",
    decimal: str = ".",
    header: bool = True,
    decimals: int | None = None,
) -> bytes:
    """Write a scan as a table with commas and a line of names, for spreadsheets and the like: .csv.

    Parameters
    ----------
    scan, unit
        As for `write_scan`.
    delimiter
        "blank", "tab", "comma" or "semicolon".
    decimal
        "." or ",".
    header
        False to leave the names of the columns away.
    decimals
        Decimals of all numbers that are not whole; as many as it takes to be exact if left out.

    Raises
    ------
    JobError, UnitError
        As `write_scan` does.
    """
    return _table(scan, unit, delimiter, decimal, "" if header else None, decimals)


def write_txt(
    scan: Scan,
    *,
    unit: str = "mm",
    delimiter: str = "tab",
    decimal: str = ".",
    header: bool = True,
    decimals: int | None = None,
) -> bytes:
    """Write a scan as a table with tabs and a line of names: .txt.

    Parameters
    ----------
    scan, unit
        As for `write_scan`.
    delimiter
        "blank", "tab", "comma" or "semicolon".
    decimal
        "." or ",".
    header
        False to leave the names of the columns away.
    decimals
        Decimals of all numbers that are not whole; as many as it takes to be exact if left out.

    Raises
    ------
    JobError, UnitError
        As `write_scan` does.
    """
    return _table(scan, unit, delimiter, decimal, "" if header else None, decimals)


def write_pts(scan: Scan, *, unit: str = "mm", decimals: int | None = None) -> bytes:
    """Write a scan as PTS: the number of points, then x y z, the intensity and the colours where the scan has them.

    Normals, triangles and other columns have no place in the format and are not written; the unit is not stated.

    Parameters
    ----------
    scan
        The points.
    unit
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`.
    decimals
        Decimals of the coordinates; as many as it takes to be exact if left out.

    Raises
    ------
    JobError
        If an option is wrong, or colours are not whole numbers 0..255.
    UnitError
        If the unit is unknown.
    """
    _check_decimals(decimals)
    columns = {name: scan.columns[name] for name in ("intensity",) if name in scan.columns}
    if all(name in scan.columns for name in _COLOURS):
        columns |= {name: scan.columns[name] for name in _COLOURS}
        colours = np.stack([scan.columns[name] for name in _COLOURS])
        if not ((colours >= 0.0) & (colours <= 255.0) & (colours == np.trunc(colours))).all():
            raise JobError("PTS holds colours as whole numbers 0..255; scale the columns red, green and blue")
    rows = _rows(_blocks(scan.points_mm, unit, None), columns, " ", decimals)
    return b"".join([b"%d\n" % len(scan.points_mm), *(row.encode("ascii") for row in rows)])


def _table(scan: Scan, unit: str, delimiter: str, decimal: str, prefix: str | None, decimals: int | None) -> bytes:
    """Write the header behind a prefix, or none if that is None, and the rows."""
    mm_per_unit(unit)
    _check_decimals(decimals)
    if delimiter not in _DELIMITERS or decimal not in (".", ","):
        raise JobError("out.delimiter is one of blank, tab, comma, semicolon, and out.decimal '.' or ','")
    if (delimiter, decimal) == ("comma", ","):
        raise JobError("out.delimiter and out.decimal are both a comma; choose another delimiter")
    between = _DELIMITERS[delimiter]
    parts = []
    if prefix is not None:
        parts.append(f"{prefix}{_header(scan, unit, between)}\n".encode())
    rows = _rows(_blocks(scan.points_mm, unit, scan.normals), scan.columns, between, decimals)
    parts += [text.replace(".", decimal).encode("ascii") for text in rows]
    return b"".join(parts)


def _check_decimals(decimals: int | None) -> None:
    if decimals is not None and not 0 <= decimals <= 17:
        raise JobError(f"out.decimals: {decimals} is not possible; use 0 to 17, or leave it out")


def _header(scan: Scan, unit: str, between: str) -> str:
    """Return the names of all columns as a line that the reader understands."""
    names = [f"{axis}_{unit}" if unit_to_state(scan.source, unit) else axis for axis in "xyz"] + (
        ["nx", "ny", "nz"] if scan.normals is not None else []
    )
    names += scan.columns
    line = between.join(name if _SIMPLE.fullmatch(name) else f'"{name}"' for name in names)
    try:
        read = named_columns(Path(), split_header(line), 1, unit_matters=True)
    except FormatError:
        read = None
    back = [] if read is None else [name for name, _ in read.further]
    if back != [*scan.columns] or not line.replace("\t", " ").isprintable() or len(line) > 4096:
        shown = ", ".join(printable(name, 30) for name in scan.columns)
        raise JobError(
            f"the columns {printable(shown, 150)} would be read as others; rename them, or set out.header=no"
        )
    return line


def _blocks(points_mm: FloatArray, unit: str, normals: FloatArray | None) -> list[FloatArray]:
    mm = mm_per_unit(unit)
    points = points_mm if mm == 1.0 else points_mm / mm
    return [points] if normals is None else [points, normals]


def _rows(
    vectors: list[FloatArray], columns: Mapping[str, FloatArray], between: str, decimals: int | None
) -> Iterator[str]:
    """Yield the text of some rows at a time."""
    whole = [_is_whole(values) for values in columns.values()]
    for begin in range(0, len(vectors[0]), _BATCH_ROWS):
        batch = slice(begin, begin + _BATCH_ROWS)
        cells = [_texts(column, decimals) for block in vectors for column in block[batch].T]
        for values, is_whole in zip(columns.values(), whole, strict=True):
            part = values[batch]
            cells.append([str(int(value)) for value in part.tolist()] if is_whole else _texts(part, decimals))
        yield "\n".join(map(between.join, zip(*cells, strict=True))) + "\n"


def _is_whole(values: FloatArray) -> bool:
    return bool((np.abs(values) < _LARGEST_WHOLE).all() and (values == np.trunc(values)).all())


def _texts(values: FloatArray, decimals: int | None) -> list[str]:
    """Return numbers as the shortest texts that are read as the same doubles, or with so many decimals."""
    if decimals is None:
        return [repr(value) for value in values.tolist()]
    return [f"{value:z.{decimals}f}" for value in values.tolist()]  # z: no minus before zero
