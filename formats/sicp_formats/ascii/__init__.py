"""Point clouds as tables of text: .asc, .xyz, .txt, .csv, .pts, from any scanner and any locale.

What the rows do not prove is never guessed: delimiter, decimal mark and columns are then asked for.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import BoolArray, FloatArray, Scan
from sicp_cam.units import mm_per_unit
from sicp_formats.ascii.columns import Columns, option_columns
from sicp_formats.ascii.dialect import DELIMITERS, Dialect, find_dialect, likely_rows, may_be_thousands
from sicp_formats.ascii.head import Head, check_comments, columns_of_header, read_head, stated_unit
from sicp_formats.ascii.proof import proven_columns
from sicp_formats.ascii.rows import RowReader
from sicp_formats.ascii.table import places
from sicp_formats.surfaces.checks import Code, check_registrable, no_return_points
from sicp_formats.surfaces.point_rows import point_rows
from sicp_formats.surfaces.unit import StatedUnit, chosen_unit, one_unit
from sicp_formats.tables.rows import NUMBER, Row
from sicp_formats.tables.stream import TextStream, open_text

__all__ = ["read_scan"]


def read_scan(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    delimiter: str | None = None,
    decimal: str | None = None,
    columns: str | None = None,
) -> Scan:
    """Read a scan from a table of text.

    Parameters
    ----------
    path
        The file: UTF-8, Latin-1 or UTF-16, perhaps packed as .gz; comments behind `#`, `//` or `;`; perhaps the number
        of rows or the names of the columns before the first row. With numbers of rows, several scans may follow one
        another.
    units
        Unit of the coordinates, one of `sicp_cam.units.MM_PER_UNIT`; if left out, that of the header or of a comment,
        such as `X [mm]`, `x_mm` or `# unit: mm`, or else millimetres.
    limits
        Caps on what the file may ask for.
    recover
        True to drop rows that are not like the others or hold no finite numbers, and to take a wrong number of rows;
        both are told by a finding.
    delimiter
        "blank", "tab", "comma" or "semicolon"; found out if left out.
    decimal
        "." or ","; found out if left out. If set, the other one may set thousands apart.
    columns
        Names of all columns, separated by commas, of x y z nx ny nz r g b a i skip.

    Returns
    -------
    Scan
        Points in file order, with normals where the file has them, and all further numbers as columns by the name that
        the file gives them; red, green, blue, alpha and intensity where it gives none.

    Raises
    ------
    FormatError
        If a row is not like the others or holds anything but finite numbers, the rows can be read in two ways, the
        columns are not clear, the number of rows is not as stated, or the points cannot register. With the line.
    JobError
        If an option is wrong.
    UnitError
        If the unit is unknown, or not the one that the file states.
    """
    mm_per_unit("mm" if units is None else units)
    told = option_columns(columns) if columns is not None else None
    with open_text(path, limits) as stream:
        head = read_head(path, stream.head(), limits)
        named = columns_of_header(path, head, units, recover) if told is None else None
        told = told or named
        sample = likely_rows(head.sample, told.needed if told else None, delimiter, decimal) if recover else head.sample
        reader, told = _reader(path, sample, told, (delimiter, decimal), limits, recover)
        stated = StatedUnit(named.unit, named.line) if named and named.unit else None
        unit = chosen_unit(path, one_unit(path, stated_unit(path, head), stated), units)
        doubtful = decimal is None and may_be_thousands(sample, reader.dialect)
        if head.count is not None:
            reader.begin_scan(head.count, head.count_line)
        while stream.line < head.line:
            stream.take(head.line - stream.line)
        reader.read(stream)
        return _scan(stream, reader, head, told, unit, columns, doubtful)


def _reader(
    path: Path,
    sample: Sequence[Row],
    told: Columns | None,
    marks: tuple[str | None, str | None],
    limits: Limits,
    recover: bool,
) -> tuple[RowReader, Columns | None]:
    """Find out how to read the rows; return what does it, and the columns if they have names."""
    if told is None and (named := _behind_names(path, sample, marks)):
        dialect, width = named
        used: Sequence[int] = range(1, width)
        return RowReader(path, dialect, width, used, used, limits, recover), None
    dialect = find_dialect(path, sample, told.needed if told else None, *marks)
    words = [dialect.words(text) for _, text in sample]
    width = len(words[0])
    if told is None:
        return RowReader(path, dialect, width, range(width), range(width), limits, recover), None
    if told.count != width:
        what = f"the row has {width} columns ({dialect}), and {told.count} are named; mark comments with '#', or name "
        raise FormatError(path, f"{what}the columns with --set scan.columns=x,y,z,...", line=sample[0][0])
    told = told.without(
        [column for column in range(width) if not all(_is_number(row[column], dialect) for row in words)]
    )
    return RowReader(path, dialect, width, told.used, told.needed, limits, recover), told


def _behind_names(
    path: Path, sample: Sequence[Row], marks: tuple[str | None, str | None]
) -> tuple[Dialect, int] | None:
    """Return the dialect of rows that begin with a name and go on with numbers; None if they do not."""
    if not all(re.match(rb"[\"'A-Za-z]", text) for _, text in sample):
        return None
    found = {}
    for delimiter in DELIMITERS if marks[0] is None else (None,):
        width = len(Dialect(delimiter, ".", quoted=True).words(sample[0][1]))
        if width < 4:
            continue
        try:
            dialect = find_dialect(path, sample, range(1, width), *marks)
        except FormatError:
            continue
        if all(re.search("[A-Za-z]", dialect.words(text)[0]) for _, text in sample):
            found[dialect] = len(dialect.words(sample[0][1]))
    return next(iter(found.items())) if len(found) == 1 else None


def _is_number(cell: str, dialect: Dialect) -> bool:
    return NUMBER.fullmatch(cell.replace(",", ".") if dialect.mark == "," else cell) is not None


def _scan(
    stream: TextStream,
    reader: RowReader,
    head: Head,
    told: Columns | None,
    chosen: tuple[str, bool, tuple[Finding, ...]],
    columns: str | None,
    doubtful: bool,
) -> Scan:
    """Make a scan of the rows that were read; `doubtful` tells that their marks may set thousands apart."""
    path, table = reader.path, reader.table
    if not len(table):
        raise FormatError(path, "no points; export the scan again", line=head.count_line or 1)
    if told is None:
        check_comments(path, head, table.width)
    placed = told.among(reader.used) if told else proven_columns(path, table, table.line(0))
    unit, stated, units_found = chosen
    dialect = reader.dialect if doubtful and table.every(slice(0, table.width), _one_to_thousand) else None

    def place(row: int) -> dict[str, int]:
        return {"line": table.line(row)}

    names = places(placed.xyz, placed.normal, [at for _, at in placed.further])
    mm, limits, recover = mm_per_unit(unit), reader.limits, reader.recover
    rows, found = point_rows(path, table.emptied(), names, place, mm, limits, recover=recover)
    check_registrable(path, rows.points_mm)
    findings = reader.findings() + units_found + _findings(path, head, placed, told is None, columns, dialect)
    findings += found + no_return_points(path, rows.at_origin)
    source = stream.source(format="ASCII", unit=unit, unit_stated=stated)
    named = {name: rows.columns[str(at)] for name, at in placed.further}
    return Scan(rows.points_mm, rows.normals, None, source, findings, named)


def _findings(
    path: Path, head: Head, placed: Columns, proven: bool, columns: str | None, doubtful: Dialect | None
) -> tuple[Finding, ...]:
    findings = []
    if placed.ignored:
        message = f"columns not used, since they hold text: {', '.join(placed.ignored)}"
        findings.append(Finding(Code.COLUMNS_NOT_USED, Level.INFO, message, str(path)))
    if proven and placed.count > 3:
        message = f"the columns are taken as {placed.layout()}; say otherwise with --set scan.columns=..."
        findings.append(Finding(Code.COLUMNS_PROVEN, Level.INFO, message, str(path)))
    skipped = [line for line, _ in head.texts if line != placed.line]
    if skipped:
        message = f"{len(skipped)} lines of text before the first row were skipped"
        level = Level.INFO if columns is not None else Level.WARN  # without names, a repair may have skipped them
        findings.append(Finding(Code.LINES_SKIPPED, level, message, f"{path}, line {skipped[0]}"))
    if doubtful is not None:
        message = (
            f"every number has exactly 3 digits behind its {doubtful.mark!r}, as if it set thousands apart; it was "
            f"taken as the decimal mark: confirm it with --set scan.decimal={doubtful.mark}"
        )
        findings.append(Finding(Code.MARKS_MAY_BE_THOUSANDS, Level.WARN, message, str(path)))
    return tuple(findings)


def _one_to_thousand(block: FloatArray) -> BoolArray:
    sizes = np.abs(block)
    passed: BoolArray = np.logical_and.reduce((sizes >= 1.0) & (sizes < 1000.0), axis=1)
    return passed
