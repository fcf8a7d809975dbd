"""Read tool paths from .txt files: APT, G-code or a table, whichever the words in the file prove."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from sicp_cam.errors import FormatError, JobError, printable
from sicp_cam.findings import Finding
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_formats import apt, gcode, path_csv
from sicp_formats.apt.check import check as check_apt
from sicp_formats.gcode.check import check as check_gcode
from sicp_formats.path_csv.check import check as check_csv
from sicp_formats.path_csv.columns import NUMBER_CELL
from sicp_formats.path_csv.rows import cells_of, delimiter_of, without_remark
from sicp_formats.paths.findings import Notice, Tally
from sicp_formats.paths.text import program_lines
from sicp_formats.robot.motion import number_of
from sicp_formats.source import read_bytes

__all__ = ["check", "read_path"]

_READERS: dict[str, tuple[str, Callable[..., ToolPath]]] = {
    "apt": ("APT", apt.read_path),
    "nc": ("G-code", gcode.read_path),
    "csv": ("a table", path_csv.read_path),
}
_CHECKERS: dict[str, Callable[..., tuple[Finding, ...]]] = {"apt": check_apt, "nc": check_gcode, "csv": check_csv}
_APT_WORDS = (
    "GOTO|FEDRAT|FROM|GODLTA|SPINDL|LOADTL|COOLNT|CUTTER|UNITS?|MULTAX|TLAXIS|CIRCLE|PPRINT|TOOLPATH|MSYS|INDIRV|TLON"
    "|LOAD|TURRET|PPFUN|INTOL|OUTTOL|CYCLE|DELAY|SYN"
)
_APT = re.compile(
    rf"[ \t]*(?:\$\$|(?:{_APT_WORDS})[ \t]*(?:/|,|$)|(?:PARTNO|RAPID|FINI|END-OF-PATH)\b)", re.ASCII | re.IGNORECASE
)
# Each word can be matched in one way only: otherwise a long line that is none would take for ever.
_WORD = r"[A-Z](?:[A-Z]*|[A-Z0-9]*=)[ \t]*[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)[ \t]*"
_GCODE = re.compile(rf"[ \t]*(?:%|\(|;|:[0-9]|/?[ \t]*(?:{_WORD})+(?:[(;].*)?$)", re.ASCII | re.IGNORECASE)
_CODE = re.compile(r"(?:^|[^A-Z])[GM][ \t]*[0-9]", re.IGNORECASE)
_LINES_LOOKED_AT = 2000
_LONGEST_LINE = 2000
_FEW = 0.02
_MOST = 0.7
_HEADER_AND_CUT_ROW = 2


def read_path(
    path: Path,
    *,
    units: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    recover: bool = False,
    **options: object,
) -> ToolPath:
    """Read a text file as what its words prove it to be, with the options of that reader.

    APT has statements such as ``GOTO/``, G-code has blocks of G and M words, a table has rows of numbers. Where that is
    not clear, nothing is guessed.

    Parameters
    ----------
    path
        The file.
    units, limits, recover, **options
        As for the reader of APT, G-code or tables.

    Raises
    ------
    FormatError, UnitError
        As that reader does; or if the file cannot be told.
    JobError
        If that reader does not take an option.
    """
    kind = _kind_of(path, limits)
    told, reader = _READERS[kind]
    arguments = _arguments(told, reader, options)
    if "recover" in inspect.signature(reader).parameters:
        arguments["recover"] = recover
    found = reader(path, units=units, limits=limits, **arguments)
    tally = Tally()
    tally.note(Notice.TEXT_READ_AS, 0, f"{told}; if that is wrong, say what it is with --set path.format=SUFFIX")
    findings = sorted((*found.findings, *tally.findings(path)), key=lambda finding: finding.code)
    return replace(found, findings=tuple(findings))


def check(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> tuple[Finding, ...]:
    """Check a text file as what its words prove it to be: APT, G-code or a table.

    Parameters
    ----------
    path
        The file.
    limits
        Caps on it.

    Raises
    ------
    FormatError
        If it is no text, or cannot be told.
    """
    return _CHECKERS[_kind_of(path, limits)](path, limits=limits)


def _kind_of(path: Path, limits: Limits) -> str:
    lines = program_lines(path, read_bytes(path, limits), limits)
    return _kind(path, [line for line in lines if line.strip() and len(line) <= _LONGEST_LINE][:_LINES_LOOKED_AT])


def _kind(path: Path, lines: list[str]) -> str:
    """Return the suffix that the words of the file prove."""
    apt_lines = sum(bool(_APT.match(line)) for line in lines)
    codes = sum(bool(_GCODE.match(line) and (_CODE.search(line) or line.strip()[0] in "%(NnOo:")) for line in lines)
    blocks = sum(bool(_GCODE.match(line)) for line in lines)
    rows, others = _rows(lines)
    if apt_lines and codes <= _FEW * apt_lines and any("/" in line for line in lines):
        return "apt"
    if codes and not apt_lines and blocks >= _MOST * len(lines):
        return "nc"
    if rows >= 2 and not apt_lines and not codes and (others <= _HEADER_AND_CUT_ROW or rows >= _MOST * len(lines)):
        return "csv"
    raise FormatError(
        path,
        f"{apt_lines} lines look like APT, {codes} like G-code, {rows} like rows of a table; "
        "say what it is with --set path.format=apt (or nc, csv)",
        line=1,
    )


def _rows(lines: list[str]) -> tuple[int, int]:
    """Count the lines whose first three cells are numbers, and the others, without remarks."""
    plain = [text for line in lines if (text := without_remark(line)[0]).strip()]
    delimiter = delimiter_of(plain[0]) if plain else None
    cells = (cells_of(text, delimiter)[:3] for text in plain)
    rows = sum(len(row) == 3 and all(NUMBER_CELL.fullmatch(cell) for cell in row) for row in cells)
    return rows, len(plain) - rows


def _arguments(told: str, reader: Callable[..., ToolPath], options: dict[str, object]) -> dict[str, Any]:
    """Return the options in the types that the reader wants: a command line has words only."""
    taken = {
        name: str(parameter.annotation)
        for name, parameter in inspect.signature(reader).parameters.items()
        if parameter.kind is parameter.KEYWORD_ONLY
    }
    arguments: dict[str, Any] = {}
    problems = []
    for name, value in options.items():
        if name not in taken:
            problems.append(f"path.{printable(name, 40)}: the file was read as {told}, whose reader has no such option")
            continue
        try:
            arguments[name] = _typed(value, taken[name])
        except ValueError as error:
            problems.append(f"path.{name}: {error}")
    if problems:
        raise JobError(*problems)
    return arguments


def _typed(value: object, wanted: str) -> object:
    if not isinstance(value, str) or "str" in wanted:
        return value
    if "bool" in wanted and value.lower() in ("true", "false", "yes", "no", "1", "0"):
        return value.lower() in ("true", "yes", "1")
    number = number_of(value)
    if number is None or ("float" not in wanted and not ("int" in wanted and number.is_integer())):
        raise ValueError(f"must be {wanted}, not {printable(value, 40)!r}")
    return number if "float" in wanted else int(number)
