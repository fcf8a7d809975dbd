"""Text STL in the layout that nearly all programs write, seven lines a triangle, read at the speed of arrays.

Nothing is accepted here that the reader of words would not accept: whatever is not exactly of this layout, holds a
number that is none, or breaks a limit, is left to that reader, which tells what is wrong and where.
"""

from __future__ import annotations

from io import BytesIO

import numpy as np
import numpy.typing as npt

from sicp_cam.limits import Limits
from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["regular_corners"]

_LINES = 7
_BLOCK_BYTES = 1 << 23
_LARGEST_INDENT = 32
_NEWLINE = ord("\n")
_BLANK = np.isin(np.arange(256), list(b" \t\r"))
_BLANK_OR_END = _BLANK | (np.arange(256) == _NEWLINE)

_Bytes = npt.NDArray[np.uint8]


def regular_corners(content: bytes, limits: Limits) -> tuple[FloatArray, IntArray] | None:
    r"""Return the corners of all triangles of a text STL, and their lines; None if its layout is another.

    Returns
    -------
    corners, lines
        (3n, 3) coordinates and (3n,) 1-based lines, n of at least 1.

    >>> facet = b"facet normal 0 0 1\nouter loop\n" + b"vertex 0 1 2\n" * 3 + b"endloop\nendfacet\n"
    >>> regular_corners(b"solid a\n" + facet + b"endsolid a\n", Limits())[1]
    array([4, 5, 6])
    """
    corners: list[FloatArray] = []
    lines: list[IntArray] = []
    position, line, facets = 0, 1, 0
    while position < len(content):
        end = _end_of_line(content, position)
        if end - position > limits.line_bytes:
            return None
        word = _first_word(content[position:end])
        position, line = end + 1, line + 1
        if word != b"solid":
            if word:
                return None
            continue
        while _first_word(content[position : position + 4 * _LARGEST_INDENT]) != b"endsolid":
            block = _block(content, position, limits)
            if block is None:
                return None
            count, size, found = block
            facets += count
            if facets > limits.faces:
                return None
            corners.append(found)
            starts = line + _LINES * np.arange(count, dtype=np.int64)
            lines.append(np.repeat(starts, 3) + np.tile(np.arange(2, 5), count))
            position, line = position + size, line + _LINES * count
        end = _end_of_line(content, position)
        if end - position > limits.line_bytes:
            return None
        position, line = end + 1, line + 1
    return (np.concatenate(corners), np.concatenate(lines)) if facets else None


def _first_word(text: bytes) -> bytes:
    words = text.split(None, 1)
    return words[0].lower() if words else b""


def _end_of_line(content: bytes, position: int) -> int:
    end = content.find(b"\n", position)
    return len(content) if end < 0 else end


def _block(content: bytes, position: int, limits: Limits) -> tuple[int, int, FloatArray] | None:
    """Return how many triangles stand one behind the other from here, their bytes, and their corners."""
    if position >= len(content):
        return None
    data = np.frombuffer(content, np.uint8, min(_BLOCK_BYTES, len(content) - position), position)
    ends = np.flatnonzero(data == _NEWLINE)
    ends = ends[: len(ends) // _LINES * _LINES]
    if not len(ends):
        return None
    starts = np.concatenate([[0], ends[:-1] + 1])
    if int((ends - starts).max()) > limits.line_bytes:
        return None
    words = _behind_blanks(data, starts).reshape(-1, _LINES)
    good = _well_formed(data, words)
    count = len(good) if good.all() else int(np.argmin(good))
    if count == 0:
        return None
    ends = ends.reshape(-1, _LINES)[:count]
    corners = _coordinates(data, words[:count, 2:5].ravel() + len(b"vertex"), ends[:, 2:5].ravel())
    return None if corners is None else (count, int(ends[-1, -1]) + 1, corners)


def _behind_blanks(data: _Bytes, at: IntArray) -> IntArray:
    """Return where the first byte stands, from each place on, that is not blank."""
    at = np.minimum(at, len(data) - 1)
    for _ in range(_LARGEST_INDENT):
        blank = _BLANK[data[at]]
        if not blank.any():
            break
        at = np.minimum(at + blank, len(data) - 1)
    return at


def _well_formed(data: _Bytes, words: IntArray) -> BoolArray:
    """Tell for each seven lines whether the words of a triangle stand at the given places."""
    facet, outer, loop_end, facet_end = words[:, 0], words[:, 1], words[:, 5], words[:, 6]
    good = _stands(data, facet, b"facet") & _stands(data, outer, b"outer")
    good &= _stands(data, loop_end, b"endloop") & _stands(data, facet_end, b"endfacet")
    for corner in (2, 3, 4):
        good &= _stands(data, words[:, corner], b"vertex")
    good &= _stands(data, _behind_blanks(data, facet + len(b"facet")), b"normal")
    good &= _stands(data, _behind_blanks(data, outer + len(b"outer")), b"loop")
    return good


def _stands(data: _Bytes, at: IntArray, word: bytes) -> BoolArray:
    """Tell for each place whether a word stands there, in either case, with a blank or the end of the line behind."""
    last = len(data) - 1
    found: BoolArray = _BLANK_OR_END[data[np.minimum(at + len(word), last)]]
    for offset, letter in enumerate(word):
        found &= (data[np.minimum(at + offset, last)] | 0x20) == letter
    return found


def _coordinates(data: _Bytes, starts: IntArray, ends: IntArray) -> FloatArray | None:
    """Return the three numbers that stand in each of the given pieces of lines, None if there is anything else."""
    step = np.zeros(len(data) + 1, np.int8)
    step[starts] = 1
    step[ends + 1] = -1  # the line end is kept
    text = data[np.cumsum(step[:-1], dtype=np.int8).view(np.bool_)].tobytes()
    if not text.strip():
        return None
    try:
        values = np.loadtxt(BytesIO(text), comments=None, ndmin=2, encoding="latin-1")
    except ValueError:
        return None
    good = values.shape == (len(starts), 3) and bool(np.isfinite(values).all())
    return values if good else None
