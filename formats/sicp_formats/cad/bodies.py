"""The bodies of a file: by product and name, sewn where they are loose, and the one that the user wants.

Runs in the child process only: it works on the CAD kernel's shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from OCP.TopAbs import TopAbs_ShapeEnum

from sicp_cam.errors import CadError
from sicp_cam.findings import Level
from sicp_formats.cad.faces import Body, bodies, distinct
from sicp_formats.cad.notes import Code, Notes
from sicp_formats.cad.overlaps import Overlaps, overlaps
from sicp_formats.cad.products import products
from sicp_formats.cad.sewing import Sewn, compound, sewn, without
from sicp_formats.cad.shape import Loaded

__all__ = ["chosen", "described", "list_bodies", "separated"]

_FACE = TopAbs_ShapeEnum.TopAbs_FACE
_SHELL, _SOLID = TopAbs_ShapeEnum.TopAbs_SHELL, TopAbs_ShapeEnum.TopAbs_SOLID
MOST_LISTED = 24
MOST_RANGES = 6
OVERLAP = 2.0
"""Faces lie on each other within this many sewing tolerances; edges are sewn that are a little further apart."""
FINE_GAP_MM = 0.01
"""Seams that are open by more than this are worth a warning."""


def separated(loaded: Loaded, sew_mm: float, notes: Notes) -> list[Body]:
    """Return the bodies of a file with their names; what is loose within one product is sewn first."""
    found, seams = [], []
    for product in products(loaded.shape, loaded.naming):
        shape, stacked = _thinned(product.shape, sew_mm, notes)
        joined = sewn(shape, sew_mm, stacked)
        if joined is not None:
            seams.append(joined)
            shape = joined.shape
            _note_patches(product.patches, notes)
        parts = _parts(shape)
        for part in parts:
            found += bodies(part, (loaded.naming(part).label if len(parts) > 1 else "") or product.name)
    _note_seams(seams, sew_mm, notes)
    return found


def chosen(found: list[Body], wanted: str | None) -> list[Body]:
    """Return the bodies with a number or a name; all of them if none is wanted.

    Raises
    ------
    CadError
        If there is no such body, with the list of those that are there.
    """
    if wanted is None:
        return found
    named = [body for body in found if body.name and body.name.casefold() == wanted.strip().casefold()]
    if named:
        return named
    if wanted.strip().isdecimal() and len(wanted) < 9 and 1 <= int(wanted) <= len(found):
        return [found[int(wanted) - 1]]
    there = _shortened([described(number, body) for number, body in enumerate(found, start=1)], MOST_LISTED)
    raise CadError(f"has no body '{wanted}'; it has {there}")


def described(number: int, body: Body) -> str:
    """Return the number of a body, and its name if it has one."""
    return f"{number} '{body.name}'" if body.name else str(number)


def list_bodies(found: Sequence[Body], wanted: Sequence[Body], owners: Sequence[int], notes: Notes) -> None:
    """Note which contours belong to which body, where there are several.

    Parameters
    ----------
    found, wanted
        All bodies, and those that were read.
    owners
        For each contour, in their order, the number of its body.
    notes
        Receives the list.
    """
    if len(found) < 2:
        return
    lines = []
    for number, body in enumerate(found, start=1):
        numbers = [contour for contour, owner in enumerate(owners, start=1) if owner == number]
        what = _ranges(numbers) if any(body is each for each in wanted) else "not read"
        lines.append(f"{described(number, body)} ({what})")
    text = f"{len(found)} bodies, with their contours: {_shortened(lines, MOST_LISTED)}"
    notes.add(Code.BODIES, Level.INFO, f"{text}; the path chooses among all, or name one as part.body")


def _parts(shape: Any) -> list[Any]:
    """Return the solids, the shells outside of them and the faces outside of these, the last as one."""
    alone = list(distinct(shape, _FACE, _SHELL))
    return [*distinct(shape, _SOLID), *distinct(shape, _SHELL, _SOLID), *([compound(alone)] if alone else [])]


def _thinned(shape: Any, sew_mm: float, notes: Notes) -> tuple[Any, tuple[Any, ...]]:
    """Return a shape without copies of its loose faces, and those that lie on others and are not to be sewn."""
    faces = list(distinct(shape, _FACE, _SOLID))
    doubled = overlaps(faces, OVERLAP * sew_mm) if len(faces) > 1 else Overlaps((), ())
    if doubled.copies:
        line = f"{len(doubled.copies)} of {len(faces)} loose faces are there twice; the copies are left out"
        notes.add(Code.FACE_DOUBLED, Level.WARN, f"{line}, and with them the side that they state as outward")
    if doubled.stacked and sew_mm > 0.0:
        line = f"{len(doubled.stacked)} of {len(faces)} loose faces lie on each other, within {OVERLAP * sew_mm:g} mm"
        notes.add(Code.FACES_OVERLAP, Level.WARN, f"{line}; they are not sewn, each has contours of its own")
    return without(shape, doubled.copies), doubled.stacked


def _note_patches(patches: int, notes: Notes) -> None:
    if patches:
        line = f"{patches} products of one face each, which have no names of their own, are sewn as patches of one skin"
        notes.add(Code.PRODUCTS_SEWN, Level.WARN, f"{line}; if they are parts of their own, set part.sew_mm=0")


def _note_seams(seams: list[Sewn], sew_mm: float, notes: Notes) -> None:
    if seams:
        count, gap = sum(each.seams for each in seams), max(each.gap_mm for each in seams)
        level = Level.INFO if gap <= FINE_GAP_MM else Level.WARN
        line = f"{count} seams of loose faces are sewn (sew_mm = {sew_mm:g}); they are open by up to {gap:.2g} mm"
        notes.add(Code.SEWN, level, line)
    turned = sum(each.turned for each in seams)
    if turned:
        faces = sum(each.faces for each in seams)
        line = (
            f"{turned} of {faces} loose faces state another outward side than those they are sewn to; they are turned"
        )
        notes.add(Code.SIDES_DISAGREE, Level.INFO, line)


def _ranges(numbers: Sequence[int]) -> str:
    """Return numbers in rising order as `1-3, 7`."""
    if not numbers:
        return "no contour"
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return _shortened([str(a) if a == b else f"{a}-{b}" for a, b in runs], MOST_RANGES)


def _shortened(items: Sequence[str], most: int) -> str:
    more = [f"and {len(items) - most} more"] if len(items) > most else []
    return ", ".join([*items[:most], *more])
