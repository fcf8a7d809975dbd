"""What a tool path holds, as plain data: counts, lengths, feeds, tools, bounds, the range of its axes."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from sicp_cam.model import EventKind, FloatArray, ToolPath

__all__ = ["bounds", "feed_facts", "path_facts", "rounded"]

FEEDS_LISTED = 20


def rounded(values: FloatArray, decimals: int) -> Any:
    """Return numbers as plain ones, without a negative zero.

    >>> rounded(np.array([1.26, -0.01]), 1)
    [1.3, 0.0]
    """
    return (np.round(values, decimals) + 0.0).tolist()


def bounds(points_mm: FloatArray) -> dict[str, list[float]]:
    """Return the least and largest coordinates of (n, 3) points."""
    return {"min_mm": rounded(points_mm.min(axis=0), 4), "max_mm": rounded(points_mm.max(axis=0), 4)}


def feed_facts(path: ToolPath) -> dict[str, Any]:
    """Return the different feeds of the cutting moves, the lowest of them by value."""
    feeds = np.unique(path.feeds_mm_min[~path.rapid & (path.feeds_mm_min > 0.0)])
    return {"different_feeds": len(feeds), "feeds_mm_min": rounded(feeds[:FEEDS_LISTED], 4)}


def path_facts(path: ToolPath) -> dict[str, Any]:
    """Return what a path holds.

    Returns
    -------
    dict
        Finite numbers, texts and lists only; lengths in mm, feeds in mm/min. `axis_range` has the least and largest
        components of the axis (tip to holder), and the largest angle between it and Z in degrees.
    """
    steps = np.linalg.norm(np.diff(path.tips_mm, axis=0), axis=1)
    tools = dict.fromkeys(round(event.value) for event in path.events if event.kind is EventKind.TOOL)
    tilt = np.degrees(np.arctan2(np.hypot(path.axes[:, 0], path.axes[:, 1]), path.axes[:, 2]))
    return {
        "name": path.name,
        "format": path.source.format if path.source is not None else "memory",
        "moves": len(path),
        "cuts": int((~path.rapid).sum()),
        "rapids": int(path.rapid.sum()),
        "length_mm": round(float(steps.sum()), 3),
        "cut_length_mm": round(float(steps[~path.rapid[1:]].sum()), 3),
        **feed_facts(path),
        "tools": list(tools),
        "bounds": bounds(path.tips_mm),
        "axis_range": {
            "min": rounded(path.axes.min(axis=0), 6),
            "max": rounded(path.axes.max(axis=0), 6),
            "largest_tilt_deg": round(float(tilt.max()), 4),
        },
        "events": dict(Counter(event.kind.value for event in path.events)),
    }
