"""The one typeface of all reports, and text that it can show."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib
from matplotlib.ft2font import FT2Font

from sicp_cam.errors import printable

__all__ = ["BOLD_FILE", "REGULAR_FILE", "literal"]

_FOLDER = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
REGULAR_FILE = _FOLDER / "DejaVuSans.ttf"
BOLD_FILE = _FOLDER / "DejaVuSans-Bold.ttf"
"""DejaVu Sans as it comes with matplotlib: Latin, Greek, Cyrillic and more, the same on every machine."""


def literal(text: str, limit: int = 600) -> str:
    r"""Return the text on one line, with characters that cannot be shown written as \uXXXX rather than as a box.

    >>> literal("Tür 窓")
    'Tür \\u7a93'
    """
    glyphs = _glyphs()
    return "".join(
        c if ord(c) in glyphs else c.encode("unicode_escape").decode("ascii") for c in printable(text, limit)
    )


@cache
def _glyphs() -> frozenset[int]:
    return frozenset(FT2Font(str(REGULAR_FILE)).get_charmap()) & frozenset(FT2Font(str(BOLD_FILE)).get_charmap())
