"""What the columns of a table without names mean: only what the numbers, or the suffix of the file, prove."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.model import BoolArray, FloatArray
from sicp_formats.ascii.columns import COLUMN_HINT, Columns
from sicp_formats.ascii.table import Table

__all__ = ["proven_columns"]

_LENGTH_TOLERANCE = 0.01
_MOSTLY = 0.95
_KINDS = {
    "normal": ("nx", "ny", "nz"),
    "colour": ("red", "green", "blue"),
    "intensity": ("intensity",),
}
# What a suffix says about the columns behind x y z, by their number.
_BY_SUFFIX = {
    (".xyzn", 3): ("normal",),
    (".xyzrgb", 3): ("colour",),
    (".pts", 1): ("intensity",),
    (".pts", 4): ("intensity", "colour"),
}
# Layouts in which four columns before the others are taken as x y z and an intensity, and not as a number and x y z.
_FOUR_BEFORE = (("intensity", "colour"),)
_WIDEST_SHOWN = 12
_NUMBERED = ("skip,x,y,z,nx,ny,nz", "skip,x,y,z,r,g,b", "skip,x,y,z", "x,y,z,nx,ny,nz", "x,y,z,r,g,b", "x,y,z")
_USUAL = (
    "skip,x,y,z",
    "skip,x,y,z,nx,ny,nz",
    "x,y,z,i,nx,ny,nz",
    "x,y,z,nx,ny,nz",
    "x,y,z,r,g,b",
    "r,g,b,x,y,z",
    "x,y,z,i,r,g,b",
    "x,y,z",
)


def proven_columns(path: Path, table: Table, line: int) -> Columns:
    """Place the columns of a table without names: x y z, and behind them what is proven.

    Unit vectors in nearly all rows are normals (the others being zero), whole numbers 0..255 colours, one more column
    behind them an intensity. Where the order of colours and intensity stays open, they are called by the number of
    their column. A first column of whole numbers that never fall may number the points and proves nothing, nor does a
    fourth column: both are asked for where the suffix does not settle them.

    Parameters
    ----------
    path, line
        The file, whose suffix may settle the matter, and its first row.
    table
        All rows.

    Raises
    ------
    FormatError
        If the numbers leave a choice that matters; the message names the options to choose from.
    """
    count = table.width
    if count == 3:
        return Columns(3, (0, 1, 2), ())
    layouts = _layouts(path, table)
    settled = layouts == [_by_suffix(path, count)]
    if len(table) > 1 and (_counts_up(table) or (not settled and _never_falls(table))):
        what = f"{count} columns, of which the first may number the points: whole numbers that never fall"
        raise FormatError(path, f"{what}; {_choices(count, _NUMBERED)}", line=line)
    if not settled and any(layout[0] == "intensity" and layout not in _FOUR_BEFORE for layout in layouts):
        what = f"{count} columns without names: the first may number the points, or the fourth be an intensity"
        raise FormatError(path, f"{what}; {_choices(count, _USUAL)}", line=line)
    places = {_normal_place(layout) for layout in layouts}
    coloured = any("colour" in layout for layout in layouts)
    if len(places) != 1 or (coloured and not _by_suffix(path, count) and table.every(slice(0, 3), _are_colours)):
        what = (
            f"{count} columns without names, which may be normals, colours or anything else; {_choices(count, _USUAL)}"
        )
        raise FormatError(path, what, line=line)
    (place,) = places
    normal = () if place is None else (place, place + 1, place + 2)
    names = [name for kind in layouts[0] for name in _KINDS[kind]]
    if len(layouts) > 1:
        names = [name if column in normal else f"column_{column + 1}" for column, name in enumerate(names, 3)]
    further = tuple((name, column) for column, name in enumerate(names, 3) if column not in normal)
    return Columns(count, (0, 1, 2), normal, None, further)


def _choices(count: int, beginnings: Sequence[str]) -> str:
    """Return the options that would settle what so many columns are, filled up with columns to skip."""
    fitting = [names for names in beginnings if names.count(",") < count <= _WIDEST_SHOWN]
    exact = [names for names in fitting if names.count(",") == count - 1]
    if not exact and "skip,x,y,z" in fitting:
        exact.append("skip,x,y,z" + ",skip" * (count - 4))
    if (plain := "x,y,z") in fitting:
        exact.append(plain + (",i" if count == 4 else ",skip" * (count - 3)))
    if not exact:
        return COLUMN_HINT
    return f"{COLUMN_HINT}, such as {' or '.join(exact)}"


def _layouts(path: Path, table: Table) -> list[tuple[str, ...]]:
    """Return every order of normals, colours and intensity that the numbers allow."""
    told = _by_suffix(path, table.width)
    if told and ("intensity" not in told or _fits(table, told)):
        return [told]
    return [
        layout
        for size in (1, 2, 3)
        for layout in permutations(_KINDS, size)
        if _width(layout) == table.width - 3 and _fits(table, layout)
    ]


def _by_suffix(path: Path, count: int) -> tuple[str, ...] | None:
    suffixes = [suffix.lower() for suffix in path.suffixes if suffix.lower() != ".gz"]
    return _BY_SUFFIX.get((suffixes[-1], count - 3)) if suffixes else None


def _width(layout: Sequence[str]) -> int:
    return sum(len(_KINDS[kind]) for kind in layout)


def _fits(table: Table, layout: Sequence[str]) -> bool:
    begin = 3
    for kind in layout:
        if kind == "normal" and not _is_normal(table, begin):
            return False
        if kind == "colour" and not _is_colour(table, begin):
            return False
        begin += len(_KINDS[kind])
    return True


def _normal_place(layout: Sequence[str]) -> int | None:
    return 3 + _width(layout[: layout.index("normal")]) if "normal" in layout else None


def _is_normal(table: Table, begin: int) -> bool:
    columns = slice(begin, begin + 3)
    return table.every(columns, _unit_or_zero) and table.share(columns, _unit) >= _MOSTLY


def _is_colour(table: Table, begin: int) -> bool:
    # Nothing but 0 and 1 may as well be normals along the axes, some of them missing.
    columns = slice(begin, begin + 3)
    return table.every(columns, _are_colours) and any(piece[:, columns].max() > 1.0 for piece in table.pieces())


def _unit(block: FloatArray) -> BoolArray:
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.einsum("ij,ij->i", block, block)
    low, high = (1.0 - _LENGTH_TOLERANCE) ** 2, (1.0 + _LENGTH_TOLERANCE) ** 2
    passed: BoolArray = (squares >= low) & (squares <= high)
    return passed


def _unit_or_zero(block: FloatArray) -> BoolArray:
    passed = _unit(block)
    if passed.all():
        return passed
    zero: BoolArray = (block == 0.0).all(axis=1)
    return passed | zero


def _are_colours(block: FloatArray) -> BoolArray:
    passed: BoolArray = ((block >= 0.0) & (block <= 255.0) & (block == np.trunc(block))).all(axis=1)
    return passed


def _counts_up(table: Table) -> bool:
    return _steps(table, lambda steps: steps == 1.0)


def _never_falls(table: Table) -> bool:
    return table.every(slice(0, 1), _are_whole) and _steps(table, lambda steps: steps >= 0.0)


def _are_whole(block: FloatArray) -> BoolArray:
    passed: BoolArray = (block == np.trunc(block)).all(axis=1)
    return passed


def _steps(table: Table, test: Callable[[FloatArray], BoolArray]) -> bool:
    """Tell whether each step from one number of the first column to the next passes a test."""
    last = None
    for piece in table.pieces():
        numbers = piece[:, 0] if last is None else np.concatenate([[last], piece[:, 0]])
        with np.errstate(over="ignore", invalid="ignore"):
            if not test(np.diff(numbers)).all():
                return False
        last = numbers[-1]
    return True
