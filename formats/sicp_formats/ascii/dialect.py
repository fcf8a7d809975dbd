"""The dialect of a table of numbers: what separates the cells, and what the decimal mark is.

Nothing is guessed. Every pair of delimiter and mark is tried on the first rows; a pair fits if all rows have the same
number of cells and each cell is a number. Where several fit and read the rows differently, the user must decide.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TypeAlias

from sicp_cam.errors import FormatError, JobError
from sicp_formats.tables.rows import NUMBER, Row, cells

__all__ = ["DELIMITERS", "Dialect", "find_dialect", "likely_rows", "may_be_thousands"]

DELIMITERS = (";", "\t", ",", None)
"""What may separate cells; None is any run of blanks."""

_DELIMITER_WORDS = {
    **dict.fromkeys((";", "semicolon"), ";"),
    **dict.fromkeys(("\t", "\\t", "tab"), "\t"),
    **dict.fromkeys((",", "comma"), ","),
    **dict.fromkeys((" ", "blank", "blanks", "space"), None),
}
_MARK_WORDS = {".": ".", "point": ".", "dot": ".", ",": ",", "comma": ","}
_NAMES = {";": "semicolon", "\t": "tab", ",": "comma", None: "blank"}
_OTHER = {".": ",", ",": "."}
_PLAIN = {
    ".": NUMBER,
    ",": re.compile(r"[+-]?(?:[0-9]+(?:,[0-9]+)?|,[0-9]+)(?:e[+-]?[0-9]+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE),
}
_GROUPED = {
    ".": re.compile(r"[+-]?[0-9]{1,3}(?:,[0-9]{3})+(?:\.[0-9]*)?"),
    ",": re.compile(r"[+-]?[0-9]{1,3}(?:\.[0-9]{3})+(?:,[0-9]*)?"),
}
_ONE_GROUP = {mark: re.compile(rf"[+-]?[1-9][0-9]{{0,2}}\{mark}[0-9]{{3}}") for mark in _OTHER}
_QUOTED_COMMA = re.compile(rb'"[^",]*,[^"]*"')
_QUOTED = re.compile(rb'"([^"]*)"')
_MAY_BE_NUMBER = re.compile(rb"\s*[-+0-9.,eE]*\s*")
_GAPS = re.compile(rb"[\s;,]")
_Reading: TypeAlias = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Dialect:
    """How to read the rows of a file.

    Parameters
    ----------
    delimiter
        One character, or None for any run of blanks.
    mark
        "." or ",".
    grouped
        True if the other mark may set thousands apart, as in 1.234,5.
    trailing
        True if each row ends with a delimiter behind its last cell.
    quoted
        True if cells may stand in quotes. A comma can then be both delimiter and decimal mark: the mark within quotes.
    """

    delimiter: str | None
    mark: str
    grouped: bool = False
    trailing: bool = False
    quoted: bool = False

    def plain(self, path: Path, row: Row) -> bytes:
        """Return a row with decimal points, without quotes, marks for thousands and the delimiter at its end.

        Raises
        ------
        FormatError
            If a cell holds the other mark where it cannot set thousands apart.
        """
        number, text = row
        text = self._unquoted(text) if self.quoted else text
        if self.trailing and self.delimiter:
            text = text.removesuffix(self.delimiter.encode("ascii"))
        if self.delimiter == self.mark:
            return text
        other = _OTHER[self.mark].encode("ascii")
        if other in text and (self.mark == "," or self.grouped) and self.delimiter != _OTHER[self.mark]:
            for cell in cells(text, self.delimiter):
                if _OTHER[self.mark] in cell and not (self.grouped and _GROUPED[self.mark].fullmatch(cell)):
                    what = f"{cell!r} is not a number with decimal mark {self.mark!r}; remove or repair the row"
                    raise FormatError(path, what, line=number)
            text = text.replace(other, b"")
        return text.replace(b",", b".") if self.mark == "," else text

    @property
    def is_plain(self) -> bool:
        """True if `plain` has nothing to do."""
        return self.mark == "." and not self.grouped and not self.trailing and not self.quoted

    def words(self, text: bytes) -> list[str]:
        """Return the cells of a row, without the empty one behind a delimiter at its end."""
        found = cells(self._unquoted(text) if self.quoted else text, self.delimiter)
        return found[:-1] if self.trailing and found[-1] == "" else found

    @property
    def mark_of_words(self) -> str:
        """The decimal mark in what `words` returns."""
        return "." if self.delimiter == self.mark else self.mark

    def _unquoted(self, text: bytes) -> bytes:
        """Return a row without quotes; what separates cells within them does so no longer."""

        def inside(match: re.Match[bytes]) -> bytes:
            cell = match[1] if _MAY_BE_NUMBER.fullmatch(match[1]) else _GAPS.sub(b"_", match[1])
            return cell.replace(b",", b"." if self.mark == "," else b"_") if self.delimiter == "," else cell

        return _QUOTED.sub(inside, text)

    def __str__(self) -> str:
        return f"delimiter {_NAMES[self.delimiter]}, decimal {self.mark!r}"


def find_dialect(
    path: Path, rows: Sequence[Row], used: Sequence[int] | None, delimiter: str | None, decimal: str | None
) -> Dialect:
    """Find the one dialect in which the first rows of a file make sense.

    Parameters
    ----------
    path
        The file, for messages.
    rows
        At least one row; a hundred or more where the file has them.
    used
        Columns that must hold numbers, where the columns have names; all if None.
    delimiter, decimal
        What the user set: blank, tab, comma, semicolon; "." or ","; None where it is left open. Only under a mark
        that the user set may the other mark set thousands apart.

    Raises
    ------
    FormatError
        If no dialect fits, or if several fit and read the rows differently; the message names the line.
    JobError
        If an option is not one of the known words.
    """
    delimiters, marks = _options(delimiter, decimal)
    quoted = any(b'"' in text for _, text in rows)
    fits: dict[_Reading, Dialect] = {}
    for each, mark in product(delimiters, marks):
        for grouped in (True, False) if decimal is not None and each != _OTHER[mark] else (False,):
            trailing = each is not None and all(text.endswith(each.encode("ascii")) for _, text in rows)
            dialect = Dialect(each, mark, grouped, trailing, quoted)
            reading = _reading(rows, dialect, used)
            if reading is not None:
                fits.setdefault(reading, dialect)
                break
    if not fits:
        raise _nothing_fits(path, rows, used, delimiters, marks)
    if len(fits) > 1:
        shown = " or as ".join(f"{_shown(reading[0])} ({dialect})" for reading, dialect in fits.items())
        what = f"reads as {shown}; settle it with --set scan.delimiter=... or --set scan.decimal=..."
        raise FormatError(path, what, line=rows[0][0])
    (found,) = fits.values()
    if used is None and decimal is None:
        _refuse_comma_pairs(path, rows, found)
    return found


def likely_rows(
    rows: Sequence[Row], used: Sequence[int] | None, delimiter: str | None, decimal: str | None
) -> Sequence[Row]:
    """Return those of the first rows that make sense in the dialect in which most of them do.

    All are returned if no more than half make sense in any; the parameters are those of `find_dialect`.
    """
    quoted = any(b'"' in text for _, text in rows)
    best: Sequence[Row] = ()
    for each, mark in product(*_options(delimiter, decimal)):
        dialect = Dialect(each, mark, decimal is not None and each != _OTHER[mark], False, quoted)
        good = [row for row in rows if _is_finite(_reading([row], dialect, used))]
        widths = Counter(len(dialect.words(text)) for _, text in good)
        width = widths.most_common(1)[0][0] if widths else 0
        good = [row for row in good if len(dialect.words(row[1])) == width]
        best = max(best, good, key=len)
    return best if 2 * len(best) > len(rows) else rows


def _is_finite(reading: _Reading | None) -> bool:
    return reading is not None and all(math.isfinite(value) for value in reading[0])


def _options(delimiter: str | None, decimal: str | None) -> tuple[tuple[str | None, ...], tuple[str, ...]]:
    problems = []
    if delimiter is not None and delimiter not in _DELIMITER_WORDS:
        problems.append(f"scan.delimiter: {delimiter!r} is unknown; use blank, tab, comma or semicolon")
    if decimal is not None and decimal not in _MARK_WORDS:
        problems.append(f"scan.decimal: {decimal!r} is unknown; use '.' or ','")
    if problems:
        raise JobError(*problems)
    delimiters = DELIMITERS if delimiter is None else (_DELIMITER_WORDS[delimiter],)
    marks = tuple(_OTHER) if decimal is None else (_MARK_WORDS[decimal],)
    if delimiters == marks:
        raise JobError("scan.delimiter and scan.decimal are both a comma; export with another delimiter")
    return delimiters, marks


def _reading(rows: Sequence[Row], dialect: Dialect, used: Sequence[int] | None) -> _Reading | None:
    """Return the numbers of the rows as the dialect reads them, or None where it does not fit."""
    mark = dialect.mark_of_words
    if dialect.delimiter == dialect.mark and not any(_QUOTED_COMMA.search(text) for _, text in rows):
        return None
    plain, grouped, other = _PLAIN[mark], _GROUPED[mark], _OTHER[mark]
    values: list[tuple[float, ...]] = []
    width = len(dialect.words(rows[0][1]))
    # 1.234 may be either number: it reads as thousands only where other cells show what the decimal mark is.
    proven = not dialect.grouped
    for _, text in rows:
        words = dialect.words(text)
        if len(words) != width or width < 3 or (used is not None and width <= max(used)):
            return None
        numeric = words if used is None else [words[column] for column in used]
        if not all(plain.fullmatch(word) or (dialect.grouped and grouped.fullmatch(word)) for word in numeric):
            return None
        proven = proven or any(mark in word for word in numeric)
        found = [float(word.replace(other, "").replace(",", ".")) for word in numeric]
        # One and the same object for every nan, so that equal readings compare equal.
        values.append(tuple(math.nan if math.isnan(value) else value for value in found))
    return tuple(values) if proven else None


def _nothing_fits(
    path: Path,
    rows: Sequence[Row],
    used: Sequence[int] | None,
    delimiters: Sequence[str | None],
    marks: Sequence[str],
) -> FormatError:
    """Name the first row at which the dialect that carries furthest fails."""
    quoted = any(b'"' in text for _, text in rows)
    dialects = [Dialect(delimiter, mark, quoted=quoted) for delimiter, mark in product(delimiters, marks)]
    reach = max(_rows_that_fit(rows, dialect, used) for dialect in dialects)
    number, text = rows[min(reach, len(rows) - 1)]
    shown = text.decode("latin-1")
    what = f"{shown[:60]!r} "
    if re.search(r"[0-9]\.[0-9]{3},[0-9]|[0-9],[0-9]{3}\.[0-9]", shown):
        what += "seems to hold marks for thousands; say what the decimal mark is with --set scan.decimal=..."
    elif reach:
        what += "is no row of numbers like those before it; remove or repair the row, or repair it with --recover"
    else:
        what += "is no row of at least 3 numbers; mark comments with '#', or set scan.delimiter, .decimal and .columns"
    return FormatError(path, what, line=number)


def _rows_that_fit(rows: Sequence[Row], dialect: Dialect, used: Sequence[int] | None) -> int:
    def fails(count: int) -> bool:
        return _reading(rows[:count], dialect, used) is None

    return bisect_left(range(1, len(rows) + 1), True, key=fails)


def _refuse_comma_pairs(path: Path, rows: Sequence[Row], dialect: Dialect) -> None:
    """Refuse 1,25,-3,50,7,00,9: it may be three numbers with decimal commas and a whole one, or seven whole ones."""
    words = [dialect.words(text) for _, text in rows]
    if (dialect.delimiter, dialect.mark) != (",", ".") or len(words[0]) < 6:
        return
    if all(word.lstrip("+-").isdigit() for row in words for word in row):
        pairs = [f"{a}.{b}" for a, b in zip(words[0][::2], words[0][1::2], strict=False)] + words[0][-1:] * (
            len(words[0]) % 2
        )
        what = (
            f"reads as {' '.join(words[0])} or, with decimal commas, perhaps as {' '.join(pairs)}; set "
            "--set scan.decimal=. if the numbers are whole, otherwise export with another delimiter"
        )
        raise FormatError(path, what, line=rows[0][0])


def may_be_thousands(rows: Sequence[Row], dialect: Dialect) -> bool:
    """Tell whether the mark of rows between blanks may set thousands apart: 3 digits behind it, at most 3 before.

    >>> may_be_thousands([(1, b"1.234 -5.678 3.522")], Dialect(None, "."))
    True
    """
    pattern = _ONE_GROUP[dialect.mark]
    return dialect.delimiter is None and all(
        pattern.fullmatch(word) for _, text in rows for word in dialect.words(text)
    )


def _shown(values: Sequence[float]) -> str:
    return " ".join(f"{value:g}" for value in values)
