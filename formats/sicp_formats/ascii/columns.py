"""What each column of a table of points means, as the user or a header tells it."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sicp_cam.errors import FormatError, JobError
from sicp_cam.units import MM_PER_UNIT
from sicp_formats.surfaces.unit import known_unit

__all__ = ["COLUMN_HINT", "Columns", "known_names", "named_columns", "option_columns", "split_header"]

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
_BRACKET = re.compile(r"\s*[\[(]([^\])]*)[\])]")
_UNIT_ENDING = re.compile(r"(?:_|\s*/\s*|\s+in\s+)(mm|cm|m|inch|in)\s*$", re.IGNORECASE)
_CELL = re.compile(r'"([^"]*)"|\'([^\']*)\'')
_LONG_NAMES = {"r": "red", "g": "green", "b": "blue", "a": "alpha", "i": "intensity"}

COLUMN_HINT = "name the columns with --set scan.columns=x,y,z,... (x y z nx ny nz r g b a i skip)"
"""The remedy where the columns are not clear."""


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
        Unit that a header states for the coordinates, or its word for one that is not known; None if it states none.
    further
        Name and column of each further number.
    ignored
        Names of the columns that are not numbers and are not kept, for a finding.
    line
        Line of the header, 0 if there is none.
    """

    count: int
    xyz: tuple[int, ...]
    normal: tuple[int, ...]
    unit: str | None = None
    further: tuple[tuple[str, int], ...] = ()
    ignored: tuple[str, ...] = ()
    line: int = 0

    @property
    def needed(self) -> tuple[int, ...]:
        """Columns that must hold finite numbers, in file order."""
        return tuple(sorted(self.xyz + self.normal))

    @property
    def used(self) -> tuple[int, ...]:
        """All columns that hold numbers, in file order."""
        return tuple(sorted((*self.needed, *(column for _, column in self.further))))

    def layout(self) -> str:
        """Return the names of all columns in their order."""
        names = dict(zip(self.xyz + self.normal, _XYZ + _NORMAL, strict=False))
        names.update({column: name for name, column in self.further})
        return " ".join(names.get(column, "skip") for column in range(self.count))

    def without(self, texts: Collection[int]) -> Columns:
        """Return the same without the further columns that hold text."""
        kept = tuple((name, column) for name, column in self.further if column not in texts)
        lost = tuple(name for name, column in self.further if column in texts)
        return replace(self, further=kept, ignored=self.ignored + lost)

    def among(self, columns: Sequence[int]) -> Columns:
        """Return the same for a table that holds only these columns of the file."""
        place = {column: index for index, column in enumerate(columns)}
        return replace(
            self,
            count=len(columns),
            xyz=tuple(place[column] for column in self.xyz),
            normal=tuple(place[column] for column in self.normal),
            further=tuple((name, place[column]) for name, column in self.further),
        )


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
    return _placed([_LONG_NAMES.get(name, name) for name in names], names, None)


def split_header(text: str) -> list[str]:
    """Return the cells of a header line or of a comment that may be one.

    >>> split_header('"X [mm]";"Y [mm]";"Z [mm]"')
    ['X [mm]', 'Y [mm]', 'Z [mm]']
    """
    text = text.strip().removeprefix("//").lstrip("#").strip().rstrip(";,")
    quoted: list[str] = []

    def aside(match: re.Match[str]) -> str:
        quoted.append(match[1] if match[1] is not None else match[2])
        return f"\0{len(quoted) - 1}\0"

    # What stands in quotes or brackets stays together, whatever the delimiter is.
    text = _BRACKET.sub(lambda match: f"[{match[1].replace(' ', '')}]", _CELL.sub(aside, text.replace("\0", "")))
    words = re.split(r"[;,\t]", text) if re.search(r"[;,\t]", text) else text.split()
    glued = [re.sub(r"\s*\[", " [", word.strip()) for word in words]
    return [re.sub(r"\0([0-9]+)\0", lambda match: quoted[int(match[1])], word).strip() for word in glued]


def known_names(names: Sequence[str]) -> list[str]:
    """Return x y z nx ny nz for the names that mean them, and the others in small letters.

    >>> known_names(["X [mm]", "y_mm", "PosZ", "Normal_X", "Quality"])
    ['x', 'y', 'z', 'nx', 'quality']
    >>> known_names(["X/mm", "Y in inch"])
    ['x', 'y']
    """
    plain = [re.sub(r"[_\s.]", "", _UNIT_ENDING.sub("", _BRACKET.sub("", name))).lower() for name in names]
    known = [_ALIASES.get(name, name) for name in plain]
    if {"i", "j", "k"} <= {*known} and not {*_NORMAL} & {*known}:
        known = [{"i": "nx", "j": "ny", "k": "nz"}.get(name, name) for name in known]
    return known


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
    known = known_names(names)
    if not {*_XYZ} <= {*known}:
        return None
    twice = [name for name in _XYZ + _NORMAL if known.count(name) > 1]
    if twice or len({*_NORMAL} & {*known}) in (1, 2):
        what = f"the header names {' '.join(twice)} twice" if twice else "the header names a part of the normal only"
        raise FormatError(path, f"{what}; {COLUMN_HINT}", line=line)
    stated = {
        match[1].strip().lower()
        for name, role in zip(names, known, strict=True)
        if role in _XYZ and (match := _BRACKET.search(name) or _UNIT_ENDING.search(name))
    }
    known_units = {known_unit(word) or word for word in stated}
    if unit_matters and (len(known_units) > 1 or not known_units <= {*MM_PER_UNIT}):
        what = (
            f"the header states the unit {' and '.join(sorted(stated))}; state one of {', '.join(MM_PER_UNIT)} yourself"
        )
        raise FormatError(path, what, line=line)
    unit = next(iter(known_units)) if len(known_units) == 1 else None
    return replace(_placed(names, known, unit), line=line)


def _placed(names: Sequence[str], roles: Sequence[str], unit: str | None) -> Columns:
    xyz = tuple(roles.index(name) for name in _XYZ)
    normal = tuple(roles.index(name) for name in _NORMAL) if "nx" in roles else ()
    further: dict[str, int] = {}
    for column, (name, role) in enumerate(zip(names, roles, strict=True)):
        if role not in (*_XYZ, *_NORMAL, "skip"):
            further[_unused(name or f"column_{column + 1}", further)] = column
    return Columns(len(names), xyz, normal, unit, tuple(further.items()))


def _unused(name: str, taken: Collection[str]) -> str:
    number = 2
    free = name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free
