"""What each column of a table of points means: told by the user, by a header, or by the numbers alone.

Without names only those layouts are read that the numbers prove; the rest is refused and must be named.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np

from sicp_cam.errors import FormatError, JobError
from sicp_cam.model import FloatArray
from sicp_cam.units import MM_PER_UNIT

__all__ = ["Columns", "named_columns", "option_columns", "proven_columns", "split_header"]

_XYZ = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_OPTION_NAMES = (*_XYZ, *_NORMAL, "r", "g", "b", "a", "i", "skip")
_ALIASES = {
    f"{before}{axis}{after}": f"{target}{axis}"
    for axis in "xyz"
    for before, after, target in (
        ("", "", ""),
        ("pos", "", ""),
        ("position", "", ""),
        ("coord", "", ""),
        ("", "coord", ""),
        ("n", "", "n"),
        ("normal", "", "n"),
        ("", "normal", "n"),
    )
}
_UNIT_NAMES = {**{name: name for name in MM_PER_UNIT}, "in": "inch", "millimeter": "mm", "meter": "m"}
_BRACKET = re.compile(r"\s*[\[(]([^\])]*)[\])]")
_LENGTH_TOLERANCE = 0.01
_HINT = "name the columns with --set scan.columns=x,y,z,... (x y z nx ny nz r g b a i skip)"


@dataclass(frozen=True, slots=True)
class Columns:
    """Which columns hold what.

    Parameters
    ----------
    count
        All columns of a row.
    xyz
        Those of the coordinates.
    normal
        Those of the normal, or () where there is none.
    unit
        Unit that a header states for the coordinates, None if it states none.
    ignored
        Names of the columns that are not used, for a finding.
    """

    count: int
    xyz: tuple[int, ...]
    normal: tuple[int, ...]
    unit: str | None = None
    ignored: tuple[str, ...] = ()

    @property
    def used(self) -> tuple[int, ...]:
        """All columns that must hold numbers, in file order."""
        return tuple(sorted(self.xyz + self.normal))


def option_columns(columns: str) -> Columns:
    """Parse the option `scan.columns`, a comma separated list of names.

    Raises
    ------
    JobError
        If a name is unknown or stands twice, or if x, y, z or a part of the normal is missing.

    >>> option_columns("skip,x,y,z,i").xyz
    (1, 2, 3)
    """
    names = [name.strip().lower() for name in columns.split(",")]
    problems = [
        f"scan.columns: {name!r} is unknown; use {' '.join(_OPTION_NAMES)}"
        for name in names
        if name not in _OPTION_NAMES
    ]
    problems += [f"scan.columns: {name} stands twice" for name in _XYZ + _NORMAL if names.count(name) > 1]
    problems += [f"scan.columns: {name} is missing" for name in _XYZ if name not in names]
    if len({*_NORMAL} & {*names}) in (1, 2):
        problems.append("scan.columns: of nx, ny, nz name all or none")
    if problems:
        raise JobError(*problems)
    return _placed(names, None)


def split_header(text: str) -> list[str]:
    """Return the cells of a header line or of a comment that may be one.

    >>> split_header('"X [mm]";"Y [mm]";"Z [mm]"')
    ['X [mm]', 'Y [mm]', 'Z [mm]']
    """
    text = text.strip().removeprefix("//").lstrip("#").strip().rstrip(";,")
    glued = _BRACKET.sub(lambda match: f"[{match[1].replace(' ', '')}]", text)
    words = re.split(r"[;,\t]", glued) if re.search(r"[;,\t]", glued) else glued.split()
    names = [word.strip().strip("\"'").strip() for word in words]
    return [re.sub(r"\[", " [", name) for name in names]


def named_columns(path: Path, names: Sequence[str], line: int, *, unit_matters: bool) -> Columns | None:
    """Place the columns by the names of a header.

    Parameters
    ----------
    path, line
        Where the header stands.
    names
        Cells of the header, as `split_header` returns them.
    unit_matters
        False if the user states the unit, so that one that is unknown does no harm.

    Returns
    -------
    Columns or None
        None if the names do not tell x, y and z.

    Raises
    ------
    FormatError
        If a coordinate stands twice, the normal is incomplete, or the unit is unknown or differs between columns.
    """
    plain = [re.sub(r"[_\s.]", "", _BRACKET.sub("", name)).lower() for name in names]
    known = [_ALIASES.get(name, name) for name in plain]
    if {"i", "j", "k"} <= {*known} and not {*_NORMAL} & {*known}:
        known = [{"i": "nx", "j": "ny", "k": "nz"}.get(name, name) for name in known]
    if not {*_XYZ} <= {*known}:
        return None
    twice = [name for name in _XYZ + _NORMAL if known.count(name) > 1]
    if twice or len({*_NORMAL} & {*known}) in (1, 2):
        what = f"the header names {' '.join(twice)} twice" if twice else "the header names a part of the normal only"
        raise FormatError(path, f"{what}; {_HINT}", line=line)
    stated = {
        match[1].strip().lower()
        for name, role in zip(names, known, strict=True)
        if role in _XYZ and (match := _BRACKET.search(name))
    }
    if unit_matters and (len(stated) > 1 or not stated <= {*_UNIT_NAMES}):
        what = (
            f"the header states the unit {' and '.join(sorted(stated))}; state one of {', '.join(MM_PER_UNIT)} yourself"
        )
        raise FormatError(path, what, line=line)
    unit = _UNIT_NAMES.get(next(iter(stated))) if len(stated) == 1 else None
    return _placed(known, unit)


def proven_columns(path: Path, values: FloatArray, line: int) -> Columns:
    """Place the columns of a table without names: x y z, and behind them what the numbers prove.

    Unit vectors in all rows are normals, whole numbers 0..255 colours, one more column an intensity.

    Parameters
    ----------
    path, line
        The file, and its first row.
    values
        (n, columns) all numbers.

    Raises
    ------
    FormatError
        If the numbers leave a choice.
    """
    count = values.shape[1]
    if count == 3:
        return Columns(3, (0, 1, 2), ())
    if len(values) > 1 and (np.diff(values[:, 0]) == 1.0).all():
        raise FormatError(path, f"{count} columns, of which the first counts the rows; {_HINT}", line=line)
    layouts = [
        layout
        for size in (1, 2, 3)
        for layout in permutations(("normal", "colour", "intensity"), size)
        if sum(_WIDTHS[kind] for kind in layout) == count - 3 and _fits(values, layout)
    ]
    places = {_normal_place(layout) for layout in layouts}
    coloured = any("colour" in layout for layout in layouts)
    if len(places) != 1 or (coloured and _is_colour(values[:, :3])):
        what = f"{count} columns without names, which may be normals, colours or anything else; {_HINT}"
        raise FormatError(path, what, line=line)
    (place,) = places
    normal = () if place is None else (place, place + 1, place + 2)
    ignored = tuple(kind for kind in layouts[0] if kind != "normal")
    return Columns(count, (0, 1, 2), normal, None, ignored)


_WIDTHS = {"normal": 3, "colour": 3, "intensity": 1}


def _placed(names: Sequence[str], unit: str | None) -> Columns:
    xyz = tuple(names.index(name) for name in _XYZ)
    normal = tuple(names.index(name) for name in _NORMAL) if "nx" in names else ()
    ignored = tuple(name for name in names if name not in _XYZ + _NORMAL + ("skip",))
    return Columns(len(names), xyz, normal, unit, ignored)


def _fits(values: FloatArray, layout: Sequence[str]) -> bool:
    begin = 3
    for kind in layout:
        block = values[:, begin : begin + _WIDTHS[kind]]
        if (kind == "normal" and not _is_normal(block)) or (kind == "colour" and not _is_colour(block)):
            return False
        begin += _WIDTHS[kind]
    return True


def _normal_place(layout: Sequence[str]) -> int | None:
    if "normal" not in layout:
        return None
    return 3 + sum(_WIDTHS[kind] for kind in layout[: layout.index("normal")])


def _is_normal(block: FloatArray) -> bool:
    largest = np.abs(block).max(initial=0.0)  # a first look that keeps squares from overflowing
    return bool(largest < 2.0 and (np.abs(np.linalg.norm(block, axis=1) - 1.0) <= _LENGTH_TOLERANCE).all())


def _is_colour(block: FloatArray) -> bool:
    # Nothing but 0 and 1 may as well be normals along the axes, some of them missing.
    whole = ((block >= 0.0) & (block <= 255.0) & (block == np.trunc(block))).all()
    return bool(whole and block.max(initial=0.0) > 1.0)
