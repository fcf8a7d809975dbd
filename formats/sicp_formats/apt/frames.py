"""Frames that APT and CL files state beside their coordinates, as motions to the frame of the CAD model."""

from __future__ import annotations

import re

import numpy as np

from sicp_cam.model import FloatArray
from sicp_cam.rigid_motion import from_parts, is_rigid
from sicp_formats.apt.arguments import split_arguments
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["FRAME_CHOICES", "CatiaAxisSystem", "Frames", "is_identity", "pose_from_axes", "pose_from_rows"]

FRAME_CHOICES = ("refuse", "apply", "keep")

_TOLERANCE = 1e-4  # CATIA writes five decimals
_EXACT = 1e-12
_FOUR_NUMBERS = re.compile(r"\s+".join([r"([+-]?[0-9]+\.[0-9]*)"] * 4), re.ASCII)


def pose_from_axes(numbers: list[float]) -> FloatArray | None:
    """Return the motion of NX's MSYS: origin, X axis and Y axis of the machining system in the model, (4, 4).

    None if these are not nine numbers or the axes are not two perpendicular unit vectors.

    >>> pose_from_axes([1, 2, 3, 0, 1, 0, -1, 0, 0])[:3].astype(int).tolist()
    [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]
    """
    if len(numbers) != 9 or not _moderate(numbers):
        return None
    x, y = np.array(numbers[3:6], dtype=np.float64), np.array(numbers[6:9], dtype=np.float64)
    return _rigid(np.column_stack([x, y, np.cross(x, y)]), np.array(numbers[:3], dtype=np.float64))


def pose_from_rows(numbers: list[float]) -> FloatArray | None:
    """Return the motion of three rows a1 a2 a3 t, x_model = A x + t, (4, 4); None if A is not a rotation."""
    if len(numbers) != 12 or not _moderate(numbers):
        return None
    rows = np.array(numbers, dtype=np.float64).reshape(3, 4)
    return _rigid(rows[:, :3], rows[:, 3])


def is_identity(T: FloatArray) -> bool:
    """Say whether a motion leaves the coordinates as they are, within the decimals of the files."""
    return bool(np.allclose(T, np.eye(4), rtol=0.0, atol=1e-7))


class CatiaAxisSystem:
    """Collects the matrix that CATIA writes into comments: ``$$*CATIA0``, a name, and three rows of four numbers."""

    __slots__ = ("_left", "_numbers")

    def __init__(self) -> None:
        self._left = 0
        self._numbers: list[float] = []

    def feed(self, comment: str) -> list[float] | None:
        """Take the next comment; return the numbers (12 if the matrix is sound) once all rows are there.

        >>> system = CatiaAxisSystem()
        >>> for text in ("*CATIA0", "Program.1", "1.0 0.0 0.0 5.0", "0.0 1.0 0.0 0.0", "0.0 0.0 1.0 0.0"):
        ...     numbers = system.feed(text)
        >>> numbers
        [1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        """
        if comment.upper().startswith("*CATIA0"):
            self._left, self._numbers = 4, []
        elif self._left:
            self._left -= 1
            if self._left < 3:
                row = _FOUR_NUMBERS.fullmatch(comment.strip())
                self._numbers += [float(number) for number in row.groups()] if row else []
                return self._numbers if self._left == 0 else None
        return None

    @property
    def complete(self) -> bool:
        """True unless the file ended, or went on with statements, before the matrix was there."""
        return self._left == 0


class Frames:
    """Takes the frames of one file and refuses, applies or keeps them as the user chose (one of `FRAME_CHOICES`)."""

    __slots__ = ("_catia", "_choice", "_moves")

    def __init__(self, moves: MoveList, choice: str) -> None:
        self._moves = moves
        self._choice = choice
        self._catia = CatiaAxisSystem()

    def msys(self, line: int, arguments: str) -> None:
        """MSYS/x,y,z,Xi,Xj,Xk,Yi,Yj,Yk of NX."""
        numbers, words = split_arguments(arguments)
        self._take(line, "MSYS", None if words else pose_from_axes(numbers), can_apply=True)

    def csys(self, line: int, arguments: str) -> None:
        """CSYS/12 numbers of Creo and SolidWorks CAM."""
        numbers, words = split_arguments(arguments)
        # Whether its rows or its columns are the axes of the frame is not documented, so it is never applied.
        self._take(line, "CSYS", None if words else pose_from_rows(numbers), can_apply=False)

    def comment(self, line: int, text: str) -> None:
        """Look for a frame in a comment, where CATIA and Creo write it."""
        numbers = self._catia.feed(text)
        if numbers is not None:
            self._take(line, "$$*CATIA0", pose_from_rows(numbers), can_apply=True)
        if text.startswith("->") and (creo := text[2:].strip()).upper().startswith("CSYS"):
            self.csys(line, creo.partition("/")[2])

    def finish(self, last_line: int) -> None:
        """Refuse a file that ends within an axis system."""
        if not self._catia.complete:
            raise self._moves.error("the axis system $$*CATIA0 is not complete; is the file?", last_line)

    def _take(self, line: int, word: str, T: FloatArray | None, *, can_apply: bool) -> None:
        moves = self._moves
        if T is None:
            raise moves.error(f"{word} is no rigid frame (orthonormal, right-handed); export the path again", line)
        apply = self._choice == "apply" and can_apply
        if not is_identity(T) and not apply and self._choice != "keep":
            choice = "path.frame=apply or keep" if can_apply else "path.frame=keep"
            raise moves.error(
                f"{word} states a frame that is not that of the part; export the path in the frame of the CAD model, "
                f"or decide with --set {choice}",
                line,
            )
        if not is_identity(T):
            moves.note(Notice.FRAME_CHOSEN, line, f"{word} {'applied' if apply else 'not applied'}")
        if apply or moves.poses:
            moves.change_frame(T)


def _moderate(numbers: list[float]) -> bool:
    return all(abs(number) <= 1e9 for number in numbers)


def _rigid(rotation: FloatArray, translation: FloatArray) -> FloatArray | None:
    T = from_parts(rotation, translation)
    if not is_rigid(T, _TOLERANCE):
        return None
    # The nearest rotation: the file's few decimals must not stretch the path.
    U, _, Vt = np.linalg.svd(rotation)
    exact = np.abs(rotation @ rotation.T - np.eye(3)).max() < _EXACT
    return from_parts(rotation if exact else U @ Vt, translation)
