"""The neutral nouns that every room speaks: Scan, Part, Contour, ToolPath, Program.

Lengths are millimetres, directions unit vectors, feeds mm/min; arrays are C-contiguous and read-only. The *part
frame* is that of CAD and CAM path, the *scan frame* that of the measured part in its clamps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sicp_cam.findings import Finding

__all__ = [
    "BoolArray",
    "Contour",
    "Event",
    "EventKind",
    "FloatArray",
    "IntArray",
    "Original",
    "Part",
    "Program",
    "Rewritten",
    "Scan",
    "Source",
    "Status",
    "ToolPath",
    "TriangleMesh",
]

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


def _own(value: npt.ArrayLike, dtype: type) -> npt.NDArray[Any]:
    """Return an array that nobody else can change: a copy, unless its maker has locked it already."""
    if isinstance(value, np.ndarray) and value.base is None and not value.flags.writeable:
        return np.ascontiguousarray(value, dtype=dtype)
    return np.array(value, dtype=dtype, order="C")


def _vectors(name: str, value: npt.ArrayLike, rows: int | None = None) -> FloatArray:
    array = _own(value, np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or (rows is not None and len(array) != rows):
        expected = "n" if rows is None else str(rows)
        raise ValueError(f"{name} must have shape ({expected}, 3), not {array.shape}")
    with np.errstate(over="ignore", invalid="ignore"):
        finite = np.isfinite(array.sum()) or np.isfinite(array).all()  # a finite sum is the quicker proof
    if not finite:
        raise ValueError(f"{name} holds numbers that are not finite")
    array.setflags(write=False)
    return array


def _column(name: str, value: npt.ArrayLike, rows: int, dtype: type) -> npt.NDArray[np.generic]:
    array = _own(value, dtype)
    if array.shape != (rows,):
        raise ValueError(f"{name} must have shape ({rows},), not {array.shape}")
    array.setflags(write=False)
    return array


def _faces(name: str, value: npt.ArrayLike, vertices: int) -> IntArray:
    array = _own(value, np.int64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (m, 3), not {array.shape}")
    if array.size and (array.min() < 0 or array.max() >= vertices):
        raise ValueError(f"{name} points at vertices outside 0..{vertices - 1}")
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True)
class Source:
    """Where an object came from: file, format, hash, and the unit its numbers had before they became millimetres."""

    path: str
    format: str
    sha256: str
    unit: str = "mm"
    unit_stated: bool = False
    """True if the file or the user stated the unit; False if the format has none and mm was assumed."""


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh:
    """Triangles: vertices (n, 3) in mm, faces (m, 3), and optionally one outward unit normal per vertex."""

    vertices_mm: FloatArray
    faces: IntArray
    normals: FloatArray | None = None

    def __post_init__(self) -> None:
        vertices = _vectors("vertices_mm", self.vertices_mm)
        object.__setattr__(self, "vertices_mm", vertices)
        object.__setattr__(self, "faces", _faces("faces", self.faces, len(vertices)))
        if self.normals is not None:
            object.__setattr__(self, "normals", _vectors("normals", self.normals, len(vertices)))


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A measured surface in the scan frame: points (n, 3) in mm, with normals and triangles where the file has them.

    `normals` are unit vectors on the outward side, or zero where the file gives none for a point. `columns` are further
    (n,) numbers of each point, by the name that the file gives them: intensity, red, quality ...
    """

    points_mm: FloatArray
    normals: FloatArray | None = None
    faces: IntArray | None = None
    source: Source | None = None
    findings: tuple[Finding, ...] = ()
    columns: Mapping[str, FloatArray] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        points = _vectors("points_mm", self.points_mm)
        object.__setattr__(self, "points_mm", points)
        if self.normals is not None:
            object.__setattr__(self, "normals", _vectors("normals", self.normals, len(points)))
        if self.faces is not None:
            object.__setattr__(self, "faces", _faces("faces", self.faces, len(points)))
        columns = {name: _column(name, values, len(points), np.float64) for name, values in self.columns.items()}
        object.__setattr__(self, "columns", MappingProxyType(columns))


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """A nominal edge of the part, sampled densely on the exact curve, in the part frame.

    The samples run so that the material lies to the left of the travel as seen from outside: with tangent T and
    outward surface normal N, B = N x T points into the material. A closed contour does not repeat its first point.

    Parameters
    ----------
    points_mm, tangents, normals
        (n, 3) each. At a corner the tangent is the bisector of the two sides.
    closed
        True for a loop.
    corners
        Indices of samples where the tangent jumps.
    ring_points_mm, ring_normals
        (q, 3) each: exact points on the surface about 10 and 30 mm inside the material (stability points).
    """

    points_mm: FloatArray
    tangents: FloatArray
    normals: FloatArray
    closed: bool = True
    corners: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    ring_points_mm: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    ring_normals: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        points = _vectors("points_mm", self.points_mm)
        ring = _vectors("ring_points_mm", self.ring_points_mm)
        corners = np.array(self.corners, dtype=np.int64)
        corners.setflags(write=False)
        object.__setattr__(self, "points_mm", points)
        object.__setattr__(self, "tangents", _vectors("tangents", self.tangents, len(points)))
        object.__setattr__(self, "normals", _vectors("normals", self.normals, len(points)))
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "ring_points_mm", ring)
        object.__setattr__(self, "ring_normals", _vectors("ring_normals", self.ring_normals, len(ring)))

    @property
    def length_mm(self) -> float:
        """Arc length of the sampled polyline."""
        points = np.vstack([self.points_mm, self.points_mm[:1]]) if self.closed else self.points_mm
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """The nominal part: its contours, and a tessellation good enough for pictures and coarse distances.

    `contours` is empty where the format knows triangles only; the contour room then finds the loops of the mesh.
    """

    contours: tuple[Contour, ...]
    mesh: TriangleMesh
    source: Source | None = None
    findings: tuple[Finding, ...] = ()


class EventKind(StrEnum):
    """What happens between two moves."""

    SPINDLE = "spindle"
    TOOL = "tool"
    COOLANT = "coolant"
    DWELL = "dwell"
    STOP = "stop"
    COMMENT = "comment"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Event:
    """Something other than motion, at its place in the path.

    Parameters
    ----------
    before_move
        Index of the move that it precedes; the number of moves if it follows the last one.
    kind
        The meaning.
    value
        SPINDLE: signed speed in rev/min (+ clockwise, - counter-clockwise, 0 off); TOOL: number; COOLANT: 1 on, 0 off;
        DWELL: seconds; otherwise 0.
    text
        COMMENT: the text; otherwise the words as they stand in the source.
    line
        1-based line of the source, 0 if there is none.
    """

    before_move: int
    kind: EventKind
    value: float = 0.0
    text: str = ""
    line: int = 0


@dataclass(frozen=True, slots=True)
class Rewritten:
    """A program written again in its own words: its bytes, and what must be said about them."""

    content: bytes
    findings: tuple[Finding, ...] = ()


class Original(Protocol):
    """The program that a path was read from, which can be written again with other coordinates.

    Whoever reads a program knows its dialect best; the path carries this along, so that a postprocessor can write the
    same program again without knowing any format.
    """

    @property
    def suffix(self) -> str:
        """Suffix of the file, with its dot, such as `.apt`."""

    def rewritten(self, path: ToolPath, source_moves: IntArray) -> Rewritten:
        """Return the program with the moves of a path.

        Parameters
        ----------
        path
            The path that was read from this program, or that path corrected: in the frame of the program.
        source_moves
            (n,) index of the move, as it was read, that each move of `path` ends or is a part of; it never falls, and
            the last of those with one index is that move itself, those before it were added.

        Returns
        -------
        Rewritten
            Byte for byte the program that was read where no move differs; otherwise only coordinates, tool axes and
            inverse-time feeds differ, and lines stand for added moves. A finding of level FAIL tells that the program
            has no words for something that must be said; no content then.
        """


@dataclass(frozen=True, slots=True, eq=False)
class ToolPath:
    """Moves of the tool tip, in order, and the events between them.

    Parameters
    ----------
    tips_mm
        (n, 3) target of each move; the first is where the path begins.
    axes
        (n, 3) unit vector from the tip to the tool holder.
    feeds_mm_min
        (n,) feed of each move; 0 where the move is rapid, or where the source states none (see `findings`).
    rapid
        (n,) True for rapid moves.
    lines
        (n,) 1-based line of the source that each move came from; 0 if there is none.
    original
        The program that the path was read from, where its format can be written again.
    """

    tips_mm: FloatArray
    axes: FloatArray
    feeds_mm_min: FloatArray
    rapid: BoolArray
    lines: IntArray
    events: tuple[Event, ...] = ()
    name: str = ""
    source: Source | None = None
    findings: tuple[Finding, ...] = ()
    original: Original | None = None

    def __post_init__(self) -> None:
        tips = _vectors("tips_mm", self.tips_mm)
        rows = len(tips)
        object.__setattr__(self, "tips_mm", tips)
        object.__setattr__(self, "axes", _vectors("axes", self.axes, rows))
        object.__setattr__(self, "feeds_mm_min", _column("feeds_mm_min", self.feeds_mm_min, rows, np.float64))
        object.__setattr__(self, "rapid", _column("rapid", self.rapid, rows, np.bool_))
        object.__setattr__(self, "lines", _column("lines", self.lines, rows, np.int64))

    def __len__(self) -> int:
        return len(self.tips_mm)


class Status(StrEnum):
    """How well a corrected move is founded."""

    COVERED = "covered"
    """The scan shows the edge here."""
    BRIDGED = "bridged"
    """A gap in the scan: carried over from both sides."""
    APPROACH = "approach"
    """Off the contour: carried along with it, or with the rigid pose."""


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """What a postprocessor turns into files: a path in the program's own frame, and what is said about it.

    Parameters
    ----------
    name
        File stem and program name, as the user gave it; each post makes it fit its controller's rules.
    path
        Tips and axes expressed in the program frame.
    status
        One `Status` per move.
    T_scan_program
        (4, 4) pose of the program frame in the scan frame, mm: the identity where all correction is in the points,
        the rigid registration where the program keeps the part's own coordinates.
    notes
        Lines for the head of the program: what made it, from which inputs. No dates.
    columns
        More per-move numbers, such as an uncertainty, for the posts that can carry them.
    overridden
        One line for each gate that failed and that the operator overrode: its name, value and limit. Every post writes
        them.
    source_moves
        (n,) move of the path as it was read that each move is or is a part of, see `Original`; None if not known.
    corrected
        False for a path that was only converted: its coordinates are in the frame that they were read in.
    placed
        False before the registration, while nobody knows where the path will lie: nothing is judged that depends on it.
    """

    name: str
    path: ToolPath
    status: tuple[Status, ...]
    T_scan_program: FloatArray = field(default_factory=lambda: np.eye(4))
    notes: tuple[str, ...] = ()
    columns: Mapping[str, FloatArray] = field(default_factory=lambda: MappingProxyType({}))
    overridden: tuple[str, ...] = ()
    source_moves: IntArray | None = None
    corrected: bool = True
    placed: bool = True

    def __post_init__(self) -> None:
        if len(self.status) != len(self.path):
            raise ValueError(f"{len(self.status)} statuses for {len(self.path)} moves")
        if self.source_moves is not None:
            moves = _column("source_moves", self.source_moves, len(self.path), np.int64)
            object.__setattr__(self, "source_moves", moves)
        pose = np.array(self.T_scan_program, dtype=np.float64)
        if pose.shape != (4, 4) or not np.isfinite(pose).all():
            raise ValueError("T_scan_program must be a finite (4, 4) matrix")
        pose.setflags(write=False)
        object.__setattr__(self, "T_scan_program", pose)
