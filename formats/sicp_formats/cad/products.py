"""Split the shape of a file into its products, which are never sewn to each other.

Runs in the child process only: it works on the CAD kernel's shapes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Any

from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS_Iterator

from sicp_formats.cad.faces import distinct
from sicp_formats.cad.sewing import compound
from sicp_formats.cad.shape import Named

__all__ = ["Product", "products"]

_COMPOUND, _FACE = TopAbs_ShapeEnum.TopAbs_COMPOUND, TopAbs_ShapeEnum.TopAbs_FACE
_SOLID = TopAbs_ShapeEnum.TopAbs_SOLID


@dataclass(frozen=True, slots=True, eq=False)
class Product:
    """The shape of one product, its name, and how many patches it is made of.

    A *patch* is a product of one face without a name of its own: some systems write each face of a skin so.
    """

    shape: Any
    name: str
    patches: int = 0


def products(shape: Any, naming: Callable[[Any], Named]) -> list[Product]:
    """Return the products of an assembly; patches and what is of no product stay with the product that holds them."""
    return _products(_node(shape, naming), "")


@dataclass(frozen=True, slots=True, eq=False)
class _Node:
    """A shape, the name of its product or None, and what it is made of."""

    shape: Any
    product: str | None
    one_face: bool
    children: tuple[_Node, ...]

    def standing_apart(self) -> list[_Node]:
        """Return the children that are, or hold, a product that is no patch; a name that is shared tells none apart."""
        names = Counter((child.product or "").casefold() for child in self.children if child.one_face)
        return [
            child
            for child in self.children
            if (child.product is not None and not child.one_face)
            or (child.product and names[child.product.casefold()] == 1)
            or child.standing_apart()
        ]

    def patches(self) -> int:
        """Return how many products of one face the shape is made of."""
        if self.product is not None and self.one_face:
            return 1
        return sum(child.patches() for child in self.children)


def _node(shape: Any, naming: Callable[[Any], Named]) -> _Node:
    inner = []
    if shape.ShapeType() == _COMPOUND:
        children = TopoDS_Iterator(shape)
        while children.More():
            inner.append(_node(children.Value(), naming))
            children.Next()
    one_face = next(distinct(shape, _SOLID), None) is None and len(list(islice(distinct(shape, _FACE), 2))) == 1
    return _Node(shape, naming(shape).product, one_face, tuple(inner))


def _products(node: _Node, name: str) -> list[Product]:
    own = node.product or name
    apart = node.standing_apart()
    if not apart:
        return [Product(node.shape, own, node.patches())]
    split = [product for child in apart for product in _products(child, own)]
    rest = [child for child in node.children if not any(child is one for one in apart)]
    if not rest:
        return split
    return [*split, Product(compound([child.shape for child in rest]), own, sum(child.patches() for child in rest))]
