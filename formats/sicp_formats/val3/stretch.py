"""Stretches of a VAL3 program that are nothing but straight moves from point to point: taken in one go.

Long paths are made of them. Whatever is out of the ordinary leaves a stretch to the reader that goes line by line, and
that says what is wrong with which line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sicp_cam.model import FloatArray
from sicp_formats.robot.program import Language, RobotError, Statement
from sicp_formats.val3.data import Variables
from sicp_formats.val3.scope import Scope

__all__ = ["Stretch", "loop_stretch", "plain_moves", "poses_of"]

FEWEST = 8
"""Fewer moves are not worth it."""

_PLAIN = re.compile(r"movel\((\w+)\[([0-9]{1,9})\],(\w+),(\w+)(?:\[([0-9]{1,9})\])?\)", re.ASCII)
_IN_LOOP = re.compile(r"movel\((\w+)\[(\w+)\],(\w+),(\w+)(?:\[(?:([0-9]{1,9})|(\w+)\[(\w+)\])\])?\)", re.ASCII)
_SIX = ("x", "y", "z", "rx", "ry", "rz")
_NUMBER = frozenset("0123456789.+-eE")
_QUARTERS = np.array([1.0, 0.0, -1.0, 0.0])
"""Cosines of whole quarter turns."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """Straight moves with one tool: for each the point and the speed, as name and key, and the line."""

    points: Sequence[tuple[str, str]]
    speeds: Sequence[tuple[str, str]]
    tool: str
    lines: Sequence[int]

    def names(self) -> set[str]:
        """Return the variables that are named."""
        return {name for name, _ in self.points} | {name for name, _ in self.speeds}


def plain_moves(statements: Sequence[Statement], language: Language) -> Iterator[tuple[int, int, Stretch]]:
    """Yield begin and end of each stretch of moves by constant indices that stands in no block, and the stretch."""
    depth, start = 0, 0
    found: list[re.Match[str]] = []
    for at, statement in enumerate(statements):
        move = _PLAIN.fullmatch(statement.text) if depth == 0 else None
        if move is not None and (not found or move[3] == found[0][3]):
            found.append(move)
            continue
        if len(found) >= FEWEST:
            yield start, at, _stretch(found, statements[start:at])
        found, start = ([move], at) if move is not None else ([], at + 1)
        depth += bool(language.opens.match(statement.text)) - bool(language.closes.match(statement.text))
    if len(found) >= FEWEST:
        yield start, len(statements), _stretch(found, statements[start:])


def _stretch(moves: Sequence[re.Match[str]], statements: Sequence[Statement]) -> Stretch:
    points = [(move[1], str(int(move[2]))) for move in moves]
    speeds = [(move[4], str(int(move[5] or "0"))) for move in moves]
    return Stretch(points, speeds, moves[0][3], [statement.line for statement in statements])


def loop_stretch(counter: str, turns: range, statement: Statement, scope: Scope) -> Stretch | None:
    """Return the moves of a counted loop whose only statement is a move to the points that it counts, else None."""
    move = _IN_LOOP.fullmatch(statement.text)
    if move is None or len(turns) < FEWEST or turns[0] < 0 or turns[-1] < 0:
        return None
    point, index, tool, speed, constant, array, place = move.groups()
    if index != counter or place not in (None, counter) or {counter, array} & (scope.changed | scope.own_names):
        return None
    keys = [str(turn) for turn in turns]
    try:
        chosen = [scope.whole(f"{array}[{key}]") for key in keys] if array else [int(constant or "0")] * len(keys)
    except RobotError:
        return None
    points, speeds = [(point, key) for key in keys], [(speed, str(number)) for number in chosen]
    return Stretch(points, speeds, tool, [statement.line] * len(keys))


def poses_of(
    stretch: Stretch, variables: Variables, scope: Scope, *, keep_frame: bool
) -> tuple[FloatArray, str, bool] | None:
    """Return the poses (n, 4, 4) of a stretch in the unit of the file, their frame, and whether it was applied.

    None where a point is not declared with a value, a number is none, or the frames differ or may have been changed.
    """
    values: list[tuple[str, ...]] = []
    for name, key in stretch.points:
        variable = variables.known.get(name)
        if variable is None or variable.type != "point" or variable.collection or key not in variable.values:
            return None
        attributes = variable.values[key][1]
        values.append((attributes.get("fatherId", ""), *(attributes.get(each, "0") for each in _SIX)))
    fathers, *columns = zip(*values, strict=True)
    if len(set(fathers)) > 1 or not all(set("".join(column)) <= _NUMBER for column in columns):
        return None
    try:
        numbers = np.array(columns, dtype=np.str_).astype(np.float64).T
        father = variables.father(*stretch.points[0])
        above = set() if keep_frame else {*variables.fathers(*stretch.points[0])}
        T_world_frame = None if keep_frame or above & scope.changed else variables.frame(*father)
    except (ValueError, RobotError):
        return None
    if above & scope.changed or not np.isfinite(numbers).all():
        return None
    poses = _poses(numbers)
    told = f"{father[0]}[{father[1]}]"
    return (poses, told, False) if T_world_frame is None else (T_world_frame @ poses, told, True)


def _poses(numbers: FloatArray) -> FloatArray:
    """Return the poses (n, 4, 4) of rows x, y, z, rx, ry, rz, as `pose_xyz` makes each of them."""
    (a, d), (b, e), (c, f) = (_turns(column) for column in numbers[:, 3:].T)
    poses = np.zeros((len(numbers), 4, 4))
    poses[:, 0, :3] = np.column_stack([b * c, -b * f, e])
    poses[:, 1, :3] = np.column_stack([a * f + d * e * c, a * c - d * e * f, -d * b])
    poses[:, 2, :3] = np.column_stack([d * f - a * e * c, d * c + a * e * f, a * b])
    poses[:, :3, 3], poses[:, 3, 3] = numbers[:, :3], 1.0
    return poses


def _turns(degrees: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return cosines and sines, exact for whole quarter turns."""
    quarters, rest = np.divmod(degrees, 90.0)
    angles, quarter = np.radians(np.fmod(degrees, 360.0)), (quarters % 4).astype(np.int64)
    cosines, sines = _QUARTERS[quarter], _QUARTERS[(quarter + 3) % 4]
    return np.where(rest == 0.0, cosines, np.cos(angles)), np.where(rest == 0.0, sines, np.sin(angles))
