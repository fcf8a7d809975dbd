"""Rows of text from columns of numbers, all rows in one go: a program has a line for each of very many moves.

The digits are those that `numbers.fixed` writes; they are taken from a table of 10,000 four-digit texts, as bytes of
one array, in which zero bytes stand for nothing and are left out at the end.
"""

from __future__ import annotations

import string
from collections.abc import Sequence
from functools import cache
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_postprocessors.numbers import rounded

__all__ = ["rows", "words"]

Bytes: TypeAlias = npt.NDArray[np.uint8]
Column: TypeAlias = npt.ArrayLike

_CHUNK = 8192
_END = 1
"""A byte that no text holds, at the end of each row: rows may have several lines."""
_EXACT = 2.0**53
_ZERO, _DOT, _MINUS, _PLUS = b"0.-+"


def rows(template: str, *columns: Column) -> list[str]:
    r"""Return a text for each row, from a template with one field for each column.

    Parameters
    ----------
    template
        Printable ASCII, with line feeds where a row has several lines. Fields: `{:.4}` a number with 4 decimals,
        `{:+.4}` always with its sign, `{:.4t}` without zeros at its end, `{:.4p}` so but with its dot, `{:d}` a whole
        number, `{}` a text as `words` returns it.
    columns
        Arrays of n numbers, or texts.

    Raises
    ------
    PathError
        If a number is not finite or too large to be written.

    >>> rows("X{:.3} Y{:+.1}{}", [1.0, -0.0004], [0.25, -2.0], words(["", " F600"]))
    ['X1.000 Y+0.2', 'X0.000 Y-2.0 F600']
    >>> rows("F{:.3p}", [200.0, 1.5])
    ['F200.', 'F1.5']
    >>> rows("p[{:d}]\n{:.3t}", [9, 10], [0.5, 200.0])
    ['p[9]\n0.5', 'p[10]\n200']
    """
    arrays = [np.asarray(column) for column in columns]
    count = len(arrays[0])
    texts: list[str] = []
    for start in range(0, count, _CHUNK):
        part = [array[start : start + _CHUNK] for array in arrays]
        texts += _chunk(template, part).decode("ascii").split(chr(_END))[:-1]
    return texts


def words(texts: Sequence[str]) -> npt.NDArray[np.bytes_]:
    """Return texts of plain ASCII as a column; many of them cost little where few are different.

    >>> words(["a", ""]).tolist()
    [b'a', b'']
    """
    return np.array(texts, dtype=np.bytes_)


def _chunk(template: str, columns: list[npt.NDArray[Any]]) -> bytes:
    count, left = len(columns[0]), list(columns)
    parts: list[Bytes] = []
    for literal, name, kind, _ in string.Formatter().parse(template):
        if literal:
            parts.append(np.broadcast_to(np.frombuffer(literal.encode("ascii"), np.uint8), (count, len(literal))))
        if name is not None:
            parts.append(_field(left.pop(0), kind or ""))
    if left:
        raise ValueError(f"the template {template!r} has fewer fields than columns")
    parts.append(np.full((count, 1), _END, np.uint8))
    table = np.concatenate(parts, axis=1).reshape(-1)
    written: bytes = table[table != 0].tobytes()
    return written


def _field(column: npt.NDArray[Any], kind: str) -> Bytes:
    if column.dtype.kind == "S":
        return np.ascontiguousarray(column).view(np.uint8).reshape(len(column), -1)
    if kind == "d":
        return _digits(column.astype(np.float64), 0)
    sign, _, decimals = kind.partition(".")
    count = int(decimals.rstrip("tp"))
    chars = _digits(column, count, signed=sign == "+")
    return _trimmed(chars, count, point=decimals.endswith("p")) if decimals[-1] in "tp" else chars


def _digits(values: npt.NDArray[Any], decimals: int, *, signed: bool = False) -> Bytes:
    """Return (n, width) characters of numbers with fixed decimals, with zero bytes in front."""
    numbers = rounded(np.asarray(values, np.float64), decimals)
    scaled = np.abs(numbers) * 10.0**decimals
    if scaled.max(initial=0.0) >= _EXACT:
        texts = [f"{value:{'+' if signed else ''}.{decimals}f}" for value in numbers.tolist()]
        longest = max(map(len, texts))
        return _field(np.array([text.rjust(longest, "\0").encode() for text in texts]), "")
    whole = np.rint(scaled).astype(np.int64)
    places = max(len(str(int(whole.max(initial=0)))), decimals + 1)
    digits = _decimal_digits(whole, places)
    for place in range(places - decimals - 1):
        digits[whole < 10 ** (places - 1 - place), place] = 0
    sign = np.where(numbers < 0.0, _MINUS, _PLUS if signed else 0).astype(np.uint8)[:, None]
    if decimals == 0:
        return np.concatenate([sign, digits], axis=1)
    dot = np.full((len(whole), 1), _DOT, np.uint8)
    return np.concatenate([sign, digits[:, : places - decimals], dot, digits[:, places - decimals :]], axis=1)


def _decimal_digits(whole: npt.NDArray[np.int64], places: int) -> Bytes:
    """Return the last `places` digits of whole numbers as (n, places) characters."""
    groups = []
    for _ in range(-(-places // 4)):
        whole, four = np.divmod(whole, 10_000)
        groups.append(_four_digits()[four])
    return np.concatenate(groups[::-1], axis=1)[:, -places:]


@cache
def _four_digits() -> Bytes:
    table = np.array([f"{number:04d}".encode() for number in range(10_000)]).view(np.uint8).reshape(-1, 4)
    table.setflags(write=False)
    return table


def _trimmed(chars: Bytes, decimals: int, *, point: bool) -> Bytes:
    """Take zeros off the end of numbers, and a dot that nothing follows unless `point` keeps it."""
    nothing = np.ones(len(chars), np.bool_)
    for place in range(chars.shape[1] - 1, chars.shape[1] - 1 - decimals, -1):
        nothing &= chars[:, place] == _ZERO
        chars[nothing, place] = 0
    if decimals and not point:
        chars[nothing, chars.shape[1] - 1 - decimals] = 0
    return chars
