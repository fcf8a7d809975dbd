"""Many rows of numbers at once: the C parser of pandas, for rows that leave no doubt.

pandas reads four times as fast as NumPy, but forgives a lot: it fills short rows with nan, takes words such as `NA` and
`inf`, drops quotes and reads `1e400` as an infinity. So it only sees bytes that numbers are made of, with everything
switched off that makes up a value, and what it returns must be finite and have the shape that was asked for. Whoever
gets None looks at the rows one by one, and knows what to say about them.
"""

from __future__ import annotations

import re
from functools import cache
from io import BytesIO
from typing import Any

import numpy as np

from sicp_cam.model import FloatArray

__all__ = ["quick_columns", "quick_numbers"]

_IN_NUMBERS = b"0123456789+-.eE\r\n"
_BLANKS = b" \t"
_BLANK_INSIDE = re.compile(rb"[0-9.eE+-][ \t]+[0-9.eE+-]")
_EXACT_BY_DEFAULT = (3, 1)


def quick_numbers(text: bytes, columns: int, *, delimiter: str | None = None, decimal: str = ".") -> FloatArray | None:
    r"""Parse whole lines of finite numbers, every row with the same number of columns.

    Parameters
    ----------
    text
        Lines that end with LF or CRLF; the last one may lack it. Blank lines count for nothing.
    columns
        Cells in each row.
    delimiter
        One character, or None for any run of blanks and tabs.
    decimal
        "." or ",".

    Returns
    -------
    array or None
        (n, columns) numbers, each the double next to what is written; None if anything is unusual about the text, which
        says nothing about whether it can be read.

    >>> quick_numbers(b"1 2.5 3\n4 5 6e1\n", 3).tolist()
    [[1.0, 2.5, 3.0], [4.0, 5.0, 60.0]]
    >>> quick_numbers(b"1 2 3\n4 5 x\n", 3) is None
    True
    """
    found = quick_columns(text, columns, delimiter=delimiter, decimal=decimal)
    return None if found is None else np.array(found).T


def quick_columns(
    text: bytes, columns: int, *, delimiter: str | None = None, decimal: str = "."
) -> list[FloatArray] | None:
    r"""Parse as `quick_numbers` does, and return each column by itself, as the parser leaves them: read-only, (n,).

    >>> [column.tolist() for column in quick_columns(b"1 2.5\n4 5\n", 2)]
    [[1.0, 4.0], [2.5, 5.0]]
    """
    plain = _plain(text, delimiter, decimal)
    if plain is None or columns < 2:  # a single column has no delimiter that a short row could lack
        return None
    for separator in _separators(plain, columns, delimiter):
        found = _parsed(plain, separator)
        if found is not None and len(found) == columns and all(bool(np.isfinite(each).all()) for each in found):
            return found
    return None


def _plain(text: bytes, delimiter: str | None, decimal: str) -> bytes | None:
    """Return the text with decimal points and LF, or None if it holds other bytes than those of numbers."""
    between = _BLANKS if delimiter is None else delimiter.encode("ascii")
    allowed = _IN_NUMBERS.replace(b".", b",") if decimal == "," else _IN_NUMBERS
    if delimiter == decimal or text.translate(None, allowed + _BLANKS + between):
        return None
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n")
        if b"\r" in text:
            return None
    if decimal == ",":
        text = text.replace(b",", b".")
    if delimiter in (None, "\t", " ") or not (b" " in text or b"\t" in text):
        return text
    return None if _BLANK_INSIDE.search(text) else text.translate(None, _BLANKS)


def _separators(text: bytes, columns: int, delimiter: str | None) -> tuple[str, ...]:
    if delimiter is not None:
        return (delimiter,)
    # A single blank everywhere is read faster than runs of blanks; which of the two it is shows in the first line.
    first = text[: text.find(b"\n") + 1 or None].rstrip(b"\n")
    return (" ", r"\s+") if first.count(b" ") == columns - 1 and not first.endswith(b" ") else (r"\s+",)


def _parsed(text: bytes, separator: str) -> list[FloatArray] | None:
    import pandas  # only where a table is read: it takes half a second to load

    if separator == r"\s+":
        text = re.sub(rb"[ \t]+$", b"", text, flags=re.MULTILINE) if _ends_with_blanks(text) else text
    try:
        frame = pandas.read_csv(
            BytesIO(text),
            engine="c",
            sep=separator,
            header=None,
            dtype=np.float64,
            na_filter=False,  # an empty cell is an error, and no nan
            quoting=3,
            low_memory=False,
            **_exact(pandas.__version__),
        )
    except ValueError:  # all that this parser raises, its own errors and those of numbers alike
        return None
    return [frame[name].to_numpy() for name in frame]


def _ends_with_blanks(text: bytes) -> bool:
    return b" \n" in text or b"\t\n" in text or text.endswith((b" ", b"\t"))


@cache
def _exact(version: str) -> dict[str, Any]:
    """Return what makes the parser round to the nearest double.

    From 3.1 on it does so by itself, as fast as with any setting (and warns of this one). Before, only "round_trip" is
    exact, at twice the time; "high" is off by a unit in the last place now and then, which a round trip would show.
    """
    numbers = tuple(int(part) for part in re.findall(r"[0-9]+", version)[:2])
    return {} if numbers >= _EXACT_BY_DEFAULT else {"float_precision": "round_trip"}
