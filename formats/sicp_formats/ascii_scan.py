"""Point clouds as tables of text: .asc, .xyz, .txt, .csv, .pts, from any scanner and any locale.

What the rows do not prove is never guessed: delimiter, decimal mark and columns are then asked for.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import FloatArray, IntArray, Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.ascii_columns import Columns, named_columns, option_columns, proven_columns, split_header
from sicp_formats.ascii_dialect import DELIMITERS, Dialect, find_dialect
from sicp_formats.source import describe, read_bytes
from sicp_formats.surface_checks import Code, check_coordinates, check_registrable, origin_points, unit_normals
from sicp_formats.text_rows import NUMBER, Row, cells, numbers, text_lines

__all__ = ["read_scan"]

_SAMPLE_ROWS = 200
# A row whose first cell is empty begins with a semicolon too, and must not pass for a comment.
_COMMENT = re.compile(rb"#|//|;(?![\s;]*[-+.,]?[0-9])")
_MARKS = b"#/;"
_HINT = "mark comments with '#', or name the columns with --set scan.columns=x,y,z,..."


@dataclass(frozen=True, slots=True)
class _Head:
    """What stands before the first row: comments, other text, and the number of rows."""

    comments: tuple[Row, ...]
    texts: tuple[Row, ...]
    count: int | None
    count_line: int


def read_scan(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    delimiter: str | None = None,
    decimal: str | None = None,
    columns: str | None = None,
) -> Scan:
    """Read a scan from a table of text.

    Parameters
    ----------
    path
        The file: UTF-8, Latin-1 or UTF-16; comments behind `#`, `//` or `;`; perhaps the number of rows or the names
        of the columns before the first row.
    units
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of the header, such as
        `X [mm]`, or else millimetres.
    limits
        Caps on what the file may ask for.
    delimiter
        "blank", "tab", "comma" or "semicolon"; found out if left out.
    decimal
        "." or ","; found out if left out. If set, the other one may set thousands apart.
    columns
        Names of all columns, separated by commas, of x y z nx ny nz r g b a i skip.

    Returns
    -------
    Scan
        Points in file order, with normals where the file has them.

    Raises
    ------
    FormatError
        If a row is not like the others or holds anything but finite numbers, the rows can be read in two ways, the
        columns are not clear, the number of rows is not as stated, or the points cannot register. With the line.
    JobError
        If an option is wrong.
    UnitError
        If the unit is unknown.
    """
    mm_per_unit("mm" if units is None else units)
    told = option_columns(columns) if columns is not None else None
    content = read_bytes(path, limits)
    rows = text_lines(path, _decoded(path, content), limits)
    head, rows = _head(path, rows, limits)
    data = (row for row in rows if row[1][0] not in _MARKS or not _COMMENT.match(row[1]))
    sample = list(islice(data, _SAMPLE_ROWS))
    if not sample:
        raise FormatError(path, "no points; export the scan again", line=head.count_line or 1)
    told = told or _columns_of_header(path, head, sample[0], units)
    dialect = find_dialect(path, sample, told.used if told else None, delimiter, decimal)
    first_line, width = sample[0][0], len(dialect.words(sample[0][1]))
    if told and told.count != width:
        what = f"the row has {width} columns ({dialect}), and {told.count} are named; {_HINT}"
        raise FormatError(path, what, line=first_line)
    values, lines = _table(path, chain(sample, data), dialect, width, told, limits)
    if head.count is not None and head.count != len(values):
        what = f"{head.count} rows are declared, {len(values)} present; the file is damaged or cut short"
        raise FormatError(path, what, line=head.count_line)
    placed = told or proven_columns(path, values, first_line)
    unit = units if units is not None else placed.unit or "mm"
    with np.errstate(over="ignore"):  # the check of the coordinates tells the line
        points = values[:, placed.xyz] * mm_per_unit(unit)

    def place(row: int) -> dict[str, int]:
        return {"line": int(lines[row])}

    check_coordinates(path, points, place, limits)
    findings = _findings(path, head, placed, units, columns)
    normals = None
    if placed.normal:
        normals, found = unit_normals(path, values[:, placed.normal], place)
        findings += found
    check_registrable(path, points)
    findings += origin_points(path, points)
    stated = units is not None or placed.unit is not None
    return Scan(points, normals, None, describe(path, content, format="ASCII", unit=unit, unit_stated=stated), findings)


def _table(
    path: Path, rows: Iterator[Row], dialect: Dialect, width: int, told: Columns | None, limits: Limits
) -> tuple[FloatArray, IntArray]:
    """Parse all rows; columns that are known to be of no use may hold anything."""
    if not dialect.is_plain:
        rows = ((row[0], dialect.plain(path, row)) for row in rows)
    finite: Sequence[int] = told.used if told else range(width)
    values, lines = numbers(
        path,
        islice(rows, limits.points + 1),
        width,
        finite=finite,
        delimiter=dialect.delimiter,
        used=finite if len(finite) < width else None,
    )
    if len(values) > limits.points:
        raise FormatError(path, f"more points than the limit points = {limits.points}; raise it", line=int(lines[-1]))
    return values, lines


def _decoded(path: Path, content: bytes) -> bytes:
    """Return the text without its byte order mark, as UTF-8 or whatever single bytes it came in."""
    if content.startswith(codecs.BOM_UTF8):
        return content[len(codecs.BOM_UTF8) :]
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            content = content.decode("utf-16").encode("utf-8")
        except UnicodeError as error:
            start = getattr(error, "start", 0)
            raise FormatError(path, "is marked as UTF-16 and is not; save it as UTF-8", byte=start) from None
    zero = content.find(b"\0")
    if zero >= 0:
        raise FormatError(path, "holds a zero byte and is no text; check the format, or save it as UTF-8", byte=zero)
    return content


def _head(path: Path, rows: Iterator[Row], limits: Limits) -> tuple[_Head, Iterator[Row]]:
    """Take off what stands before the first row; return it, and the rows."""
    comments: list[Row] = []
    texts: list[Row] = []
    for row in rows:
        if _COMMENT.match(row[1]):
            comments.append(row)
        elif any(NUMBER.fullmatch(word) for word in re.split(r"[\s;,]+", row[1].decode("latin-1"))):
            return _counted(path, row, tuple(comments), tuple(texts), rows)
        else:
            texts.append(row)
        if len(comments) + len(texts) > limits.header_lines:
            what = f"no row of numbers within the limit header_lines = {limits.header_lines}; is it a scan?"
            raise FormatError(path, what, line=row[0])
    what = "holds no row of numbers; is it a scan?"
    raise FormatError(path, what, line=texts[0][0] if texts else 1)


def _counted(
    path: Path, row: Row, comments: tuple[Row, ...], texts: tuple[Row, ...], rows: Iterator[Row]
) -> tuple[_Head, Iterator[Row]]:
    """Tell a first line with the number of rows from a first row."""
    if not re.fullmatch(rb"[0-9]{1,18}", row[1]):
        return _Head(comments, texts, None, 0), chain([row], rows)
    following = next(rows, None)
    if following is not None and re.fullmatch(rb"[0-9]{1,18}", following[1]):
        what = "two lines with one number each begin a PTX file, which is not read; export as PTS, XYZ or PLY"
        raise FormatError(path, what, line=row[0])
    return _Head(comments, texts, int(row[1]), row[0]), chain([following] if following else [], rows)


def _columns_of_header(path: Path, head: _Head, first_row: Row, units: str | None) -> Columns | None:
    """Place the columns by the last text, or the last comment that names as many columns as the rows have."""
    if head.texts:
        line, text = head.texts[-1]
        found = named_columns(path, split_header(text.decode("latin-1")), line, unit_matters=units is None)
        if found is None or len(head.texts) > 1:
            line, text = head.texts[0]
            what = f"{text.decode('latin-1')[:60]!r} neither is a row of numbers nor names the columns x, y, z; {_HINT}"
            raise FormatError(path, what, line=line)
        return found
    widths = {len(cells(first_row[1], delimiter)) for delimiter in DELIMITERS}
    for line, text in reversed(head.comments):
        names = split_header(text.decode("latin-1"))
        if len(names) in widths and {"x", "y", "z"} <= {name.split(" [")[0].lower() for name in names}:
            return named_columns(path, names, line, unit_matters=units is None)
    return None


def _findings(path: Path, head: _Head, placed: Columns, units: str | None, columns: str | None) -> tuple[Finding, ...]:
    findings = []
    if placed.ignored:
        message = f"columns not used: {', '.join(placed.ignored)}"
        findings.append(Finding(Code.COLUMNS_NOT_USED, Level.INFO, message, str(path)))
    if columns is not None and head.texts:
        message = f"{len(head.texts)} lines of text before the first row were skipped"
        findings.append(Finding(Code.LINES_SKIPPED, Level.INFO, message, f"{path}, line {head.texts[0][0]}"))
    if units is not None and placed.unit not in (None, units):
        message = f"the header states {placed.unit}, the user {units}, which was followed"
        findings.append(Finding(Code.UNIT_OVERRULED, Level.WARN, message, str(path)))
    return tuple(findings)
