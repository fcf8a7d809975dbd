"""Load a DXF drawing through ezdxf, strictly or repaired, and let none of its many exceptions out."""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam.errors import FormatError, SicpError, printable
from sicp_formats.dxf.blocks import MOST_ENTITIES
from sicp_formats.dxf.pieces import CurveError
from sicp_formats.dxf.tags import Tags, ascii_tags, tags_of
from sicp_formats.paths.findings import Notice, Tally

__all__ = ["guarded", "load"]

_LARGEST_BYTES = 100 * 2**20
_LARGE_ENTITIES = 100_000
_BINARY = b"AutoCAD Binary DXF\r\n\x1a\x00"
_DWG = re.compile(rb"A[CM](?:[12]\.[0-9]{1,2}|10[0-9]{2}|[0-9.]{4})")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_BOM = b"\xef\xbb\xbf"
_LINE = re.compile(r"line:?\s+([0-9]+)")
_REPAIR = "correct it, or repair it with --recover"
_INCURABLE = "subclass"
_FLAT = ("ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "INSERT")
_ZERO = 1e-12
_SCALES = ("xscale", "yscale", "zscale")
_RATIOS = (1e-6, 1.0 + 1e-9)


@contextmanager
def guarded(path: Path, what: str, line: int = 0, remedy: str = "export the drawing again") -> Iterator[None]:
    """Turn whatever the library raises into a FormatError; nothing else in these modules catches its exceptions.

    Parameters
    ----------
    path, line
        The file, and where it is read, 0 if that is not known.
    what
        What is being read, such as an entity and its handle.
    remedy
        What to do.
    """
    try:
        yield
    except SicpError:
        raise
    except CurveError as error:
        raise FormatError(path, f"{what} {error}", line=line or None) from None
    except Exception as error:
        told = printable(str(error) or type(error).__name__, 160)
        named = _LINE.search(told)
        raise FormatError(
            path, f"{what} cannot be read ({told}); {remedy}", line=line or (int(named[1]) if named else None)
        ) from error


def load(path: Path, content: bytes, tally: Tally, *, recover: bool) -> tuple[Any, Tags]:
    """Return the drawing as the library holds it, and its bare tags.

    Parameters
    ----------
    path, content
        The file and its bytes.
    tally
        Takes what was noticed or repaired.
    recover
        True to repair a damaged drawing.

    Raises
    ------
    FormatError
        With the line where there is one, if the file is no drawing or a damaged one.
    """
    _refuse_others(path, content)
    binary = content.startswith(_BINARY)
    content = content.removeprefix(_BOM)
    with guarded(path, "the drawing"):
        tags = _binary_tags(path, content) if binary else ascii_tags(path, content)
        _check_size(path, tags, tally)
        _check_structure(tags, tally, recover=recover)
        _check_values(tags, tally, recover=recover)
    with _heard() as complaints:
        drawing = _document(path, content, tally, binary=binary, recover=recover)
        if recover:
            with guarded(path, "the drawing"):
                _replace_values(drawing)
    for complaint in complaints:
        tally.note(Notice.DRAWING_REPAIRED, 0, complaint)
    return drawing, tags


def _refuse_others(path: Path, content: bytes) -> None:
    if _DWG.match(content):
        raise FormatError(path, "is a DWG, not a DXF; save the drawing as DXF", byte=0)
    if content.startswith(_UTF16):
        raise FormatError(path, "is UTF-16 text, which no DXF is; save the drawing as DXF again", byte=0)
    if len(content) > _LARGEST_BYTES:
        what = f"has {len(content)} bytes, too large a drawing to be loaded; save the layer of the path alone"
        raise FormatError(path, what)


def _binary_tags(path: Path, content: bytes) -> Tags:
    from ezdxf.lldxf.tagger import binary_tags_loader

    with guarded(path, "the binary drawing is cut short or damaged, it"):
        pairs = [(tag.code, tag.value) for tag in binary_tags_loader(content)]
    return tags_of(path, [code for code, _ in pairs], [value for _, value in pairs], text=False)


def _check_size(path: Path, tags: Tags, tally: Tally) -> None:
    count = len(tags.records)
    if count > MOST_ENTITIES:
        raise FormatError(path, f"has {count} entities, more than {MOST_ENTITIES}; save the layer of the path alone")
    if count > _LARGE_ENTITIES:
        tally.note(Notice.DRAWING_LARGE, 0, count=count)


def _check_structure(tags: Tags, tally: Tally, *, recover: bool) -> None:
    for what, tag, loses_curves in tags.flaws():
        if loses_curves:  # what is left of the last curve would be drawn to the origin
            raise tags.error(f"{what} within its curves; export it again", tag)
        if not recover:
            raise tags.error(f"{what}; export it again, or repair it with --recover", tag)
        tally.note(Notice.DRAWING_REPAIRED, tags.line(tag), what)


def _check_values(tags: Tags, tally: Tally, *, recover: bool) -> None:
    """Refuse or note the values of entities that the library replaces without a word."""
    for tag, what in _replaced_values(tags):
        if not recover:
            raise tags.error(f"{what}; {_REPAIR}", tag)
        tally.note(Notice.VALUE_REPLACED, tags.line(tag), what)
    corners = np.cumsum(tags.codes == 10)
    for tag, record in tags.owners(np.flatnonzero(tags.codes == 90), "LWPOLYLINE"):
        if str(_whole(tags.values[tag])) != str(int(corners[record.end - 1] - corners[record.first])):
            tally.note(Notice.COUNT_IGNORED, tags.line(tag))


def _whole(value: object) -> object:
    try:
        return int(value)  # type: ignore[call-overload]  # bytes, text or a number, as the file has it
    except ValueError:
        return None


def _replaced_values(tags: Tags) -> Iterator[tuple[int, str]]:
    codes, numbers = tags.codes, tags.numbers
    zero = np.abs(numbers) <= _ZERO
    null = (codes[:-2] == 210) & (codes[1:-1] == 220) & (codes[2:] == 230) & zero[:-2] & zero[1:-1] & zero[2:]
    for kind in _FLAT:
        for tag, record in tags.owners(np.flatnonzero(null), kind):
            yield tag, f"{record}: the extrusion direction is (0, 0, 0)"
    for tag, record in tags.owners(np.flatnonzero((codes >= 41) & (codes <= 43) & zero), "INSERT"):
        yield tag, f"{record}: a scale is 0"
    size = np.abs(numbers)
    for tag, record in tags.owners(
        np.flatnonzero((codes == 40) & ~((size >= _RATIOS[0]) & (size <= _RATIOS[1]))), "ELLIPSE"
    ):
        yield tag, f"{record}: the ratio of the half axes is {numbers[tag]:g}"


def _replace_values(drawing: Any) -> None:
    """Give the values that `_replaced_values` finds their defaults: the library does so for some versions only."""
    for entity in drawing.entitydb.values():
        kind, dxf = entity.dxftype(), entity.dxf
        if kind in _FLAT and max(map(abs, dxf.get("extrusion", (0.0, 0.0, 1.0)))) <= _ZERO:
            dxf.discard("extrusion")
        for name in _SCALES if kind == "INSERT" else ():
            if abs(dxf.get(name, 1.0)) <= _ZERO:
                dxf.discard(name)
        if kind == "ELLIPSE":
            dxf.ratio = math.copysign(min(max(abs(dxf.ratio), _RATIOS[0]), 1.0), dxf.ratio)


def _document(path: Path, content: bytes, tally: Tally, *, binary: bool, recover: bool) -> Any:
    try:
        with guarded(path, "the drawing", remedy=_REPAIR):
            return _loaded(content, binary=binary)
    except FormatError as error:
        if _INCURABLE in error.what:
            what = error.what.replace(_REPAIR, "it is R12 with entities of later versions: export it as R2000")
            raise FormatError(path, what, line=error.line) from error
        if not recover:
            if _is_curable(path, content):
                raise
            what = error.what.replace(_REPAIR, "it cannot be repaired either: export it again")
            raise FormatError(path, what, line=error.line) from error
        tally.note(Notice.DRAWING_REPAIRED, error.line or 0, error.what.partition(";")[0])
    return _repaired(path, content, tally)


def _loaded(content: bytes, *, binary: bool) -> Any:
    from ezdxf.document import Drawing
    from ezdxf.filemanagement import dxf_stream_info
    from ezdxf.lldxf.tagger import binary_tags_loader

    if binary:
        return Drawing.load(binary_tags_loader(content))
    encoding = dxf_stream_info(io.TextIOWrapper(io.BytesIO(content), "utf-8", errors="ignore")).encoding
    return Drawing.read(io.TextIOWrapper(io.BytesIO(content), encoding, errors="surrogateescape"))


def _is_curable(path: Path, content: bytes) -> bool:
    """Say whether a repair would succeed, so that none is offered in vain."""
    try:
        _repaired(path, content, Tally())
    except FormatError:
        return False
    return True


def _repaired(path: Path, content: bytes, tally: Tally) -> Any:
    from ezdxf import recover

    with guarded(path, "the drawing is damaged beyond repair, it"):
        drawing, auditor = recover.read(io.BytesIO(content))
    if auditor.errors:
        told = printable(auditor.errors[0].message, 120)
        raise FormatError(path, f"the drawing has {len(auditor.errors)} flaws beyond repair ({told}); export it again")
    for fix in auditor.fixes:
        tally.note(Notice.DRAWING_REPAIRED, 0, printable(fix.message, 120))
    return drawing


@contextmanager
def _heard() -> Iterator[list[str]]:
    """Collect what the library would print."""
    complaints: list[str] = []

    class Listener(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            complaints.append(printable(record.getMessage(), 120))

    logger, listener = logging.getLogger("ezdxf"), Listener(logging.WARNING)
    before = logger.propagate
    logger.addHandler(listener)
    logger.propagate = False
    try:
        yield complaints
    finally:
        logger.removeHandler(listener)
        logger.propagate = before
