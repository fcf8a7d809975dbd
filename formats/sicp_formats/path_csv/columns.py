"""Which columns of a table are tip, orientation and feed: from a header, from the user, or from their count."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sicp_cam.errors import printable

__all__ = [
    "NUMBER_CELL",
    "OWN_HEADER",
    "Columns",
    "HeaderError",
    "columns_of_names",
    "columns_of_width",
    "names_of_option",
]

Kind: TypeAlias = Literal["axis", "angles", "quaternion"]

NUMBER_CELL = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?", re.ASCII)
"""A number as a cell holds it, with a decimal point or comma."""

_TIP = ("x", "y", "z")
_ORIENTATIONS: tuple[tuple[Kind, tuple[str, ...]], ...] = (
    ("axis", ("i", "j", "k")),
    ("axis", ("nx", "ny", "nz")),
    ("axis", ("ux", "uy", "uz")),
    ("quaternion", ("qw", "qx", "qy", "qz")),
    ("angles", ("rx", "ry", "rz")),
    ("angles", ("w", "p", "r")),
)
_ALIASES = {
    **{f"{prefix}_{name}": name for prefix in ("pos", "position", "point", "tip", "tcp", "p") for name in _TIP},
    **{f"axis_{name}": name for name in "ijk"},
    **{f"{prefix}_{a}": b for prefix in ("axis", "tool_axis") for a, b in zip(_TIP, "ijk", strict=True)},
    **dict.fromkeys(("f", "feedrate", "feed_rate"), "feed"),
    **dict.fromkeys(("speed", "velocity"), "speed"),
    **dict.fromkeys(("g0", "is_rapid"), "rapid"),
}
_LENGTHS = {"mm": "mm", "cm": "cm", "m": "m", "inch": "inch", "in": "inch"}
_FEEDS = {
    **dict.fromkeys(("mm/min", "mm_min", "mmpm"), 1.0),
    **dict.fromkeys(("mm/s", "mm_s"), 60.0),
    **dict.fromkeys(("m/min", "m_min"), 1000.0),
    **dict.fromkeys(("m/s", "m_s"), 60_000.0),
    **dict.fromkeys(("in/min", "in_min", "inch/min", "ipm"), 25.4),
}
_BRACKETED = re.compile(r"(.*?)[\s_]*[(\[]([^()\[\]]*)[)\]]", re.DOTALL)
_SUFFIXED = re.compile(r"(.+?)_(mm/min|mm_min|mm/s|mm_s|m/min|m_min|mm|cm|m|inch|in|deg)")
OWN_HEADER = ("x", "y", "z", "i", "j", "k", "feed", "rapid", "status")
"""What this package itself writes; its unit is settled to be the millimetre."""

_UNUSED = ("-", "skip", "_")


class HeaderError(Exception):
    """What is wrong with the names of the columns; the reader adds file and line."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where the columns of a table are.

    Parameters
    ----------
    width
        Cells in a row.
    tip
        Columns of x, y, z.
    kind, orientation
        What the columns of the orientation hold, and which they are; none for tips only.
    feed, mm_min_per_feed
        Column of the feed, and its factor to mm/min; None for the unit of the table per minute.
    rapid
        Column that says which moves are rapid.
    unit
        Length unit that the names state.
    unused
        Names of the columns that are not read.
    named
        False where nothing but their number says what the columns are.
    """

    width: int
    tip: tuple[int, int, int]
    kind: Kind = "axis"
    orientation: tuple[int, ...] = ()
    feed: int | None = None
    mm_min_per_feed: float | None = None
    rapid: int | None = None
    unit: str | None = None
    unused: tuple[str, ...] = ()
    named: bool = True


def names_of_option(columns: str) -> list[str]:
    """Return the names that the option `columns` gives, separated by commas or blanks; `-` leaves a column out.

    >>> names_of_option("x y,z , - feed")
    ['x', 'y', 'z', '-', 'feed']
    """
    return columns.replace(",", " ").split()


def columns_of_width(width: int) -> Columns:
    """Return the layout of a table without names: x, y, z, or x, y, z, i, j, k.

    Raises
    ------
    HeaderError
        If another number of columns leaves open what they are.
    """
    if width == 3:
        return Columns(3, (0, 1, 2), named=False)
    if width == 6:
        return Columns(6, (0, 1, 2), "axis", (3, 4, 5), named=False)
    proposal = "x,y,z,i,j,k,-"
    if width == 7:
        proposal = "x,y,z,i,j,k,feed or x,y,z,qw,qx,qy,qz, or x,y,z,w,p,r,- with --set path.euler=xyz or zyx"
    raise HeaderError(
        f"{width} columns without a header; name them with --set path.columns={proposal} (- for one that is not read)"
    )


def columns_of_names(cells: Sequence[str], euler: str | None = None) -> Columns:
    """Return the layout of a table whose columns have names, units among them (`x [mm]`, `feed_mm_min`).

    Parameters
    ----------
    cells
        The names.
    euler
        How the user says that angles are meant; only for ``zyx`` are A, B and C angles (about z, y and x: KUKA).

    Raises
    ------
    HeaderError
        If the tip is missing, or names or units contradict each other.

    >>> columns_of_names(["X (in)", "Y (in)", "Z (in)", "Speed [mm/s]"]).unit
    'inch'
    """
    parsed = [_parsed(cell) for cell in cells]
    names = [name for name, _ in parsed]
    if missing := [name for name in _TIP if name not in names]:
        raise HeaderError(
            f"the header does not name {', '.join(missing)}; it needs x,y,z and should have i,j,k: rename the columns "
            "or name them with --set path.columns=..."
        )
    kind, orientation = _orientation(names, euler)
    speed = next((name for name in ("feed", "speed") if name in names), None)
    if speed == "speed" and parsed[names.index("speed")][1] not in _FEEDS:
        speed = None  # of the spindle or of the tool? Only a unit tells.
    used = {*_TIP, *orientation, speed, "rapid"} - {None}
    if twice := sorted(str(name) for name in used if names.count(str(name)) > 1):
        raise HeaderError(f"the header names {', '.join(twice)} more than once; rename the columns")
    feed = None if speed is None else names.index(speed)
    return Columns(
        len(cells),
        (names.index("x"), names.index("y"), names.index("z")),
        kind,
        tuple(names.index(name) for name in orientation),
        feed,
        None if feed is None else _mm_min_per_feed(parsed[feed][1]),
        names.index("rapid") if "rapid" in names else None,
        _length_unit(parsed, names),
        tuple(printable(cell, 40) or "(no name)" for cell, name in zip(cells, names, strict=True) if name not in used),
    )


def _parsed(cell: str) -> tuple[str, str]:
    """Return the name of a column as this module knows it, and the unit that stands behind it."""
    text = cell.strip().lower()
    if text in _UNUSED:
        return "", ""
    match = _BRACKETED.fullmatch(text) or _SUFFIXED.fullmatch(text)
    name, unit = (match[1], match[2].strip()) if match else (text, "")
    name = re.sub(r"[\s._-]+", "_", name).strip("_")
    return _ALIASES.get(name, name), unit


def _orientation(names: Sequence[str], euler: str | None) -> tuple[Kind, tuple[str, ...]]:
    """Return the first orientation that is named in full: vectors before quaternions before angles about x, y, z."""
    for kind, group in _ORIENTATIONS:
        if all(name in names for name in group):
            return kind, group
    if euler == "zyx" and all(name in names for name in "abc"):
        return "angles", ("c", "b", "a")
    if any(name in names for name in "ijk"):
        raise HeaderError("the header names only part of i,j,k; name all three or none")
    for _, group in _ORIENTATIONS[1:-1]:
        if any(name in names for name in group):
            raise HeaderError(f"the header names only part of {','.join(group)}; name all of them or none")
    return "axis", ()


def _length_unit(parsed: Sequence[tuple[str, str]], names: Sequence[str]) -> str | None:
    units = {unit for name, unit in parsed if name in _TIP}
    if unknown := sorted(unit for unit in units if unit and unit not in _LENGTHS):
        raise HeaderError(f"the unit '{printable(unknown[0], 20)}' of x, y, z is not known; use mm, cm, m or inch")
    lengths = {_LENGTHS.get(unit) for unit in units}
    if len(lengths) > 1:
        raise HeaderError("the header gives x, y and z different units; use one")
    return lengths.pop() or ("mm" if tuple(names[: len(OWN_HEADER)]) == OWN_HEADER else None)


def _mm_min_per_feed(unit: str) -> float | None:
    if not unit or unit in _LENGTHS:
        return None
    if unit not in _FEEDS:
        raise HeaderError(f"the unit '{printable(unit, 20)}' of the feed is not known; use mm/min, mm/s or m/min")
    return _FEEDS[unit]
