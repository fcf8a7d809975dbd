"""Cutting moves divided into shorter ones: tips on the straight line, tool axes on the great circle between the two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sicp_cam.model import Event, FloatArray, IntArray, Program, ToolPath

__all__ = ["axis_turns_deg", "divided", "last_pieces"]

_SMALL = 1e-9


def divided(program: Program, pieces: IntArray) -> tuple[Program, IntArray]:
    """Return a program with each move divided into `pieces` (n,), and the move (m,) that each of its moves is part of.

    Feeds, lines and events stay with their moves; the last piece of a move is exactly that move.
    """
    path = program.path
    origin = np.repeat(np.arange(len(path)), pieces)
    last = last_pieces(pieces)
    share = (np.arange(len(origin)) - last[origin] + pieces[origin]) / pieces[origin]
    before = np.maximum(origin - 1, 0)
    tips = path.tips_mm[before] + (path.tips_mm[origin] - path.tips_mm[before]) * share[:, None]
    axes = _between(path.axes[before], path.axes[origin], share)
    tips[last], axes[last] = path.tips_mm, path.axes
    first = np.append(last - pieces + 1, len(origin)).tolist()
    events = tuple(
        Event(first[event.before_move], event.kind, event.value, event.text, event.line) for event in path.events
    )
    new = ToolPath(
        tips, axes, path.feeds_mm_min[origin], path.rapid[origin], path.lines[origin], events, path.name, path.source
    )
    moves = program.source_moves
    return replace(
        program,
        path=new,
        status=tuple(program.status[move] for move in origin.tolist()),
        columns={},
        source_moves=None if moves is None else moves[origin],
    ), origin


def last_pieces(pieces: IntArray) -> IntArray:
    """Return the index of the last piece of each move (n,).

    >>> last_pieces(np.array([1, 3, 1])).tolist()
    [0, 3, 4]
    """
    last: IntArray = np.cumsum(pieces) - 1
    return last


def axis_turns_deg(axes: FloatArray) -> FloatArray:
    """Return how far the tool axis turns on each move (n,), the first one not at all; exact for small turns."""
    chords = np.linalg.norm(np.diff(axes, axis=0), axis=1)
    turns: FloatArray = np.degrees(2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0)))
    return np.concatenate([np.zeros(min(1, len(axes))), turns])


def _between(start: FloatArray, end: FloatArray, share: FloatArray) -> FloatArray:
    """Return unit vectors on the great circle from start to end (n, 3), at shares (n,) of the angle between them."""
    angle = 2.0 * np.arcsin(np.minimum(np.linalg.norm(end - start, axis=1) / 2.0, 1.0))
    sine = np.sin(angle)
    small = sine < _SMALL
    safe = np.where(small, 1.0, sine)
    a = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    b = np.where(small, share, np.sin(share * angle) / safe)
    mixed = a[:, None] * start + b[:, None] * end
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    # Opposite axes have no way between them; `positions` refuses such moves.
    result: FloatArray = np.where(length > _SMALL, mixed / np.maximum(length, _SMALL), end)
    return result
