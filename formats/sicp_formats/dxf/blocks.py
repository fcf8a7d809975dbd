"""Unfold the blocks of a drawing: every curve with the motion that brings it to its place, and its layer there.

Blocks may hold one another a thousandfold in a few lines of text, so what they unfold to is counted first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sicp_cam.model import FloatArray
from sicp_formats.dxf.pieces import CurveError

__all__ = ["DEEPEST", "MOST_ENTITIES", "Placed", "Unfolding"]

MOST_ENTITIES = 1_000_000
"""Most entities of a drawing, its blocks unfolded."""
DEEPEST = 16
"""Most blocks within one another."""
_EXTERNAL = 4 | 8
_FROZEN_OR_OFF = ("frozen", "off")


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """An entity of the drawing or of a block: the motion (4, 4) to its place, its layer, and why it is hidden."""

    entity: Any
    motion: FloatArray
    layer: str
    hidden: str = ""


@dataclass(slots=True)
class Unfolding:
    """The blocks and layers of one drawing.

    Parameters
    ----------
    drawing
        The document of the library.
    drops_missing
        True to leave out what stands for a block that the drawing does not hold, False to refuse it.
    missing
        The names of the blocks that were left out.
    """

    drawing: Any
    drops_missing: bool = False
    missing: list[str] = field(default_factory=list)
    _sizes: dict[str, tuple[int, int]] = field(default_factory=dict)
    _layers: dict[str, str] = field(default_factory=dict)

    def check(self, entity: Any) -> int:
        """Return how many entities an entity of the drawing unfolds to.

        Raises
        ------
        CurveError
            If a block holds itself, is missing, or lies too deep.
        """
        return self._size(entity, ())[0]

    def unfold(self, entities: Iterable[Any], motion: FloatArray) -> Iterator[Placed]:
        """Yield the entities of a layout with those of blocks in place of their insertions, in the order drawn."""
        for entity in entities:
            yield from self._unfold(entity, motion, "0")

    def _size(self, entity: Any, above: tuple[str, ...]) -> tuple[int, int]:
        """Return how many entities an entity unfolds to, and how many blocks deep it goes."""
        if entity.dxftype() != "INSERT":
            return 1, 0
        name = str(entity.dxf.get("name", "")).lower()
        if name in above:
            raise CurveError(f"inserts the block {name!r} into itself; correct the drawing")
        if len(above) >= DEEPEST:
            raise CurveError(f"lies more than {DEEPEST} blocks deep; explode some of them")
        if name not in self._sizes:
            sizes = [self._size(inner, (*above, name)) for inner in self._content(entity)]
            self._sizes[name] = (1 + sum(size for size, _ in sizes), 1 + max((deep for _, deep in sizes), default=0))
        size, deep = self._sizes[name]
        if len(above) + deep > DEEPEST:
            raise CurveError(f"lies more than {DEEPEST} blocks deep; explode some of them")
        return size * max(1, entity.dxf.row_count) * max(1, entity.dxf.column_count), deep

    def _content(self, insert: Any) -> Iterable[Any]:
        name = str(insert.dxf.get("name", ""))
        block = self.drawing.blocks.get(name)
        if block is None or block.block is None or block.block.dxf.flags & _EXTERNAL:
            if not self.drops_missing:
                what = (
                    f"inserts the block {name!r}, which is not in the drawing; bind it, or leave it out with --recover"
                )
                raise CurveError(what)
            self.missing.append(name)
            return ()
        content: Iterable[Any] = block
        return content

    def _unfold(self, entity: Any, motion: FloatArray, layer_above: str) -> Iterator[Placed]:
        named = str(entity.dxf.layer)
        layer = layer_above if named == "0" else named
        hidden = "invisible" if entity.dxf.get("invisible", 0) else self._hidden(layer)
        if entity.dxftype() != "INSERT" or hidden in ("frozen", "invisible"):
            yield Placed(entity, motion, layer, hidden)
            return
        content = self.drawing.blocks.get(str(entity.dxf.get("name", "")))
        for offset in _grid(entity) if content is not None else ():
            inner_motion = motion @ offset @ np.array(list(entity.matrix44().rows())).T
            for inner in content:
                yield from self._unfold(inner, inner_motion, layer)

    def _hidden(self, layer: str) -> str:
        """Return why a layer is not to be seen, or nothing."""
        key = layer.lower()
        if key not in self._layers:
            known = self.drawing.layers.has_entry(layer)
            entry = self.drawing.layers.get(layer) if known else None
            state = (False, False) if entry is None else (entry.is_frozen(), entry.is_off())
            self._layers[key] = next((word for word, is_so in zip(_FROZEN_OR_OFF, state, strict=True) if is_so), "")
        return self._layers[key]


def _grid(insert: Any) -> Iterator[FloatArray]:
    """Yield the (4, 4) shift of each place of an array of insertions, once each."""
    dxf, ocs = insert.dxf, insert.ocs()
    angle = np.deg2rad(dxf.rotation)
    along = np.cos(angle) * np.array(ocs.ux.xyz) + np.sin(angle) * np.array(ocs.uy.xyz)
    across = np.cos(angle) * np.array(ocs.uy.xyz) - np.sin(angle) * np.array(ocs.ux.xyz)
    rows = max(1, dxf.row_count) if dxf.row_spacing else 1
    columns = max(1, dxf.column_count) if dxf.column_spacing else 1
    for row in range(rows):
        for column in range(columns):
            shift = np.eye(4)
            shift[:3, 3] = column * dxf.column_spacing * along + row * dxf.row_spacing * across
            yield shift
