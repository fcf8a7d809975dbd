"""The path as a drawing: 3D polylines in an R2000 DXF, for CAD and CAM systems that take curves and nothing else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from sicp_cam.errors import JobError
from sicp_cam.findings import Finding, Level
from sicp_cam.model import Program, Status
from sicp_postprocessors.base import Postprocessor, head_remarks
from sicp_postprocessors.checks import frame_findings, name_findings
from sicp_postprocessors.dxf_frame import FIRST_FREE_HANDLE, MODEL_SPACE, document
from sicp_postprocessors.numbers import rounded
from sicp_postprocessors.options import outside
from sicp_postprocessors.text import ascii_lines, counted, file_stem

__all__ = ["Dxf", "DxfOptions"]

_RAPID, _CUT = "RAPID", "CUT"
_COLOURS = {_CUT: 5, _RAPID: 8, "COVERED": 3, "BRIDGED": 30, "APPROACH": 4}
_MOST_DECIMALS = 12


@dataclass(frozen=True, slots=True)
class DxfOptions:
    """Options of the post: `--set post.dxf.decimals=4`."""

    decimals: int = 6
    """Decimals of positions, in mm."""
    by_status: bool = False
    """True to draw cuts on the layers COVERED, BRIDGED and APPROACH, by how well they are founded, in place of CUT."""

    def __post_init__(self) -> None:
        if problems := outside("decimals", self.decimals, 3, _MOST_DECIMALS):
            raise JobError(*problems)


@dataclass(frozen=True, slots=True)
class _Run:
    """Moves that are one polyline: its layer, and its first and last corner among the tips."""

    layer: str
    first: int
    last: int


class Dxf(Postprocessor):
    """Drawing of the path in mm: a polyline for each run of cuts on the layer CUT, of rapid moves on RAPID.

    A polyline begins where the move before it ended; a path whose first move is the only one of its run begins with a
    point. What made the program stands in comments at the head. A drawing holds neither tool axes nor feeds nor events.
    The same program gives the same bytes: handles are counted, and there are no dates.
    """

    name = "dxf"
    summary = "DXF drawing (R2000) of the tips as 3D polylines, cuts and rapid moves on layers"
    Options = DxfOptions
    suffix = ".dxf"
    holds_axes = holds_feeds = False
    missing_feed = Level.INFO
    options: DxfOptions

    def reading(self) -> str:
        """Say why no path is read back: the lines of a drawing are no moves yet."""
        return "a drawing holds curves, not moves"

    def preflight(self, program: Program) -> list[Finding]:
        """Return the findings of every post, and what a drawing cannot hold."""
        counts = Counter(event.kind for event in program.path.events)
        lost = ["tool axes and feeds", *(counted(n, f"{kind} event") for kind, n in sorted(counts.items()))]
        remedy = "apply T_scan_part of the result to them, or run with --frame scan"
        return [
            *super().preflight(program),
            Finding(610, Level.INFO, f"a drawing holds positions only; not written: {', '.join(lost)}"),
            *name_findings(program, file_stem(program.name)),
            *frame_findings(program, Level.INFO, remedy),
        ]

    def files(self, program: Program) -> dict[str, bytes]:
        """Return the one drawing."""
        remarks = [line for remark in head_remarks(program) for line in ascii_lines(remark)]
        handles = count(FIRST_FREE_HANDLE)
        runs = _runs(program, by_status=self.options.by_status)
        tips = rounded(program.path.tips_mm, self.options.decimals).tolist()
        corner = f"%.{self.options.decimals}f"
        entities = [line for run in runs for line in _polyline(run, tips, corner, handles)]
        layers = {layer: _COLOURS[layer] for layer in sorted({run.layer for run in runs})}
        text = document(remarks, layers, entities, next(handles))
        return {file_stem(program.name) + self.suffix: text.encode("ascii")}


def _runs(program: Program, *, by_status: bool) -> list[_Run]:
    """Return the moves as runs on one layer, each from the tip before it."""
    rapid = program.path.rapid.tolist()
    layers = [_layer(fast, status, by_status=by_status) for fast, status in zip(rapid, program.status, strict=True)]
    runs = []
    begin = 0
    for move in range(1, len(layers) + 1):
        if move == len(layers) or layers[move] != layers[begin]:
            runs.append(_Run(layers[begin], max(begin - 1, 0), move - 1))
            begin = move
    return runs


def _layer(rapid: bool, status: Status, *, by_status: bool) -> str:
    if rapid:
        return _RAPID
    return status.value.upper() if by_status else _CUT


def _polyline(run: _Run, tips: list[list[float]], number: str, handles: Iterator[int]) -> Iterator[str]:
    """Yield the tags of a run: a point if it goes nowhere, because a polyline needs two corners."""
    if run.first == run.last:
        yield from _entity("POINT", next(handles), MODEL_SPACE, run.layer, "AcDbPoint")
        yield from _position(tips[run.first], number)
        return
    owner = next(handles)
    yield from _entity("POLYLINE", owner, MODEL_SPACE, run.layer, "AcDb3dPolyline")
    yield from ("66", "1", *_position([0.0, 0.0, 0.0], number), "70", "8")
    for tip in tips[run.first : run.last + 1]:
        yield from _entity("VERTEX", next(handles), owner, run.layer, "AcDbVertex")
        yield from ("100", "AcDb3dPolylineVertex", *_position(tip, number), "70", "32")
    yield from _entity("SEQEND", next(handles), owner, run.layer)


def _entity(kind: str, handle: int, owner: int, layer: str, subclass: str = "") -> Iterator[str]:
    yield from ("0", kind, "5", f"{handle:X}", "330", f"{owner:X}", "100", "AcDbEntity", "8", layer)
    if subclass:
        yield from ("100", subclass)


def _position(tip: list[float], number: str) -> Iterator[str]:
    for code, value in zip(("10", "20", "30"), tip, strict=True):
        yield from (code, number % value)
