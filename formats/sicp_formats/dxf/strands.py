"""From the drawing that the library loaded to curves in straight pieces: unfolded, chosen, placed and sampled."""

from __future__ import annotations

from typing import Any

import numpy as np

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_cam.model import FloatArray
from sicp_formats.dxf.blocks import MOST_ENTITIES, Placed, Unfolding
from sicp_formats.dxf.chains import SAME_PLACE_MM, Strand
from sicp_formats.dxf.entities import pieces_of
from sicp_formats.dxf.layers import chosen_curves
from sicp_formats.dxf.loading import guarded
from sicp_formats.dxf.pieces import CurveError, Piece, Straights
from sicp_formats.dxf.tags import Record, Tags
from sicp_formats.paths.findings import Notice
from sicp_formats.paths.moves import MoveList

__all__ = ["strands_of"]


class _Origins:
    """Where the entities of a drawing stand in the file: by their handles, or by their order if they have none."""

    def __init__(self, tags: Tags, in_model: list[Any]) -> None:
        self._by_handle = {record.handle: record for record in tags.records if record.handle}
        self._by_place: dict[int, Record] = {}
        if [record.kind for record in tags.in_model] == [entity.dxftype() for entity in in_model]:
            pairs = zip(in_model, tags.in_model, strict=True)
            self._by_place = {id(entity): record for entity, record in pairs}

    def of(self, entity: Any) -> tuple[str, int]:
        """Return the name of an entity and its line, 0 if that is not known."""
        handle = str(entity.dxf.get("handle", "")).upper()
        record = self._by_place.get(id(entity)) or self._by_handle.get(handle)
        if record is not None and record.kind == entity.dxftype():
            return str(record), record.line
        return f"{entity.dxftype()} #{handle}" if handle else str(entity.dxftype()), 0


def strands_of(moves: MoveList, drawing: Any, tags: Tags, layers: str | None, *, recover: bool) -> list[Strand]:
    """Return the curves of the path in the order of the file, in mm, and note what is left out.

    Parameters
    ----------
    moves
        Takes the notes; knows the limits, the unit and how finely to sample.
    drawing, tags
        What `dxf_loading.load` returned.
    layers
        Names of layers, as in `dxf_layers.chosen_curves`.
    recover
        True to leave out insertions of blocks that the drawing does not hold.

    Raises
    ------
    FormatError
        With the line or the entity, if a curve cannot be drawn, or there is none, or too many.
    """
    with guarded(moves.path, "the drawing"):
        in_model = list(drawing.modelspace())
    origins = _Origins(tags, in_model)
    unfolding = Unfolding(drawing, drops_missing=recover)
    _check_size(moves, origins, unfolding, in_model)
    with guarded(moves.path, "the drawing"):
        placed = list(unfolding.unfold(in_model, np.diag([moves.mm, moves.mm, moves.mm, 1.0])))
        _note_paper_space(moves, drawing)
    curves = chosen_curves(moves.path, placed, layers, moves.tally)
    return _sampled(moves, origins, curves)


def _check_size(moves: MoveList, origins: _Origins, unfolding: Unfolding, in_model: list[Any]) -> None:
    """Refuse what unfolds to too much before any of it is unfolded."""
    total = 0
    for entity in in_model:
        name, line = origins.of(entity)
        with guarded(moves.path, name, line):
            total += unfolding.check(entity)
        if total > MOST_ENTITIES:
            what = f"{name}: the blocks unfold to more than {MOST_ENTITIES} entities; save the contour alone"
            raise FormatError(moves.path, what, line=line or None)
    for block in unfolding.missing:
        moves.note(Notice.DRAWING_REPAIRED, 0, f"insertions of the missing block {block!r} were left out")


def _note_paper_space(moves: MoveList, drawing: Any) -> None:
    on_paper = [
        entity
        for layout in drawing.layouts
        if not layout.is_modelspace
        for entity in layout
        if entity.dxftype() != "VIEWPORT"
    ]
    if on_paper:
        moves.note(Notice.LAYER_LEFT_OUT, 0, f"{len(on_paper)} in paper space", count=len(on_paper))


def _sampled(moves: MoveList, origins: _Origins, curves: list[Placed]) -> list[Strand]:
    strands: list[Strand] = []
    left = moves.limits.path_points
    for item in curves:
        name, line = origins.of(item.entity)
        with guarded(moves.path, name, line), np.errstate(all="ignore"):
            pieces = [piece.placed(item.motion) for piece in pieces_of(item.entity)]
            points = _points(pieces, moves, left)
            _check_reach(points, moves.limits)
        if len(points) < 2:
            moves.note(Notice.CURVE_LEFT_OUT, line, name)
            continue
        for piece in pieces:
            if not isinstance(piece, Straights):
                moves.note(Notice.ARC_FLATTENED, line, "as drawn")
        left -= len(points)
        closed = len(points) > 2 and bool(np.abs(points[-1] - points[0]).max() <= SAME_PLACE_MM)
        if closed:
            points[-1] = points[0]
        strands.append(Strand(points, np.full(len(points) - 1, line, dtype=np.int64), closed, name))
    return strands


def _points(pieces: list[Piece], moves: MoveList, most: int) -> FloatArray:
    """Return the points of pieces that follow one another, none twice in a row."""
    runs: list[FloatArray] = []
    for piece in pieces:
        runs.append(piece.points(moves.chord_mm, moves.step_mm, most))
        most -= len(runs[-1])
    points = np.vstack(runs) if runs else np.zeros((0, 3))
    if len(points) < 2:
        return points[:0]
    # Ends of pieces that meet differ by rounding only.
    moved = np.abs(np.diff(points, axis=0)).max(axis=1) > SAME_PLACE_MM
    kept: FloatArray = points[np.concatenate([[True], moved | ~np.isfinite(moved)])]
    return kept


def _check_reach(points: FloatArray, limits: Limits) -> None:
    if len(points) and not bool((np.abs(points) <= limits.coordinate_mm).all()):
        raise CurveError(
            f"has a coordinate beyond the limit coordinate_mm = {limits.coordinate_mm:g}; is the unit right?"
        )
