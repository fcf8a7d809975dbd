"""Text from users and files, made safe for file names, comments and the names of a controller."""

from __future__ import annotations

import re
import textwrap
import unicodedata

from sicp_cam.model import FloatArray
from sicp_postprocessors.numbers import trimmed

__all__ = ["ascii_line", "ascii_lines", "ascii_name", "counted", "file_stem", "pose_words"]

_RESERVED_STEMS = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
_STEM_BYTES = 120


def ascii_line(text: str, drop: str = "") -> str:
    r"""Return text as one line of printable ASCII, without the characters in `drop`.

    Accents are taken off; anything else outside ASCII becomes a question mark, so that its loss is seen.

    >>> ascii_line("Café (x)\nNext 😀", drop="()")
    'Cafe x Next ?'
    """
    one_line = " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]", " ", text).split())
    bare = "".join(c for c in unicodedata.normalize("NFKD", one_line) if not unicodedata.combining(c))
    plain = "".join(c if " " <= c <= "~" else "?" for c in bare)
    return " ".join(plain.translate({ord(c): None for c in drop}).split())


def ascii_lines(text: str, drop: str = "", width: int = 72) -> list[str]:
    """Return text like `ascii_line`, but broken into lines of at most `width` characters; none if nothing is left.

    >>> ascii_lines("a long remark", width=6)
    ['a long', 'remark']
    """
    return textwrap.wrap(ascii_line(text, drop), width, break_on_hyphens=False)


def ascii_name(text: str, longest: int, other: str = "", fallback: str = "Program") -> str:
    """Return a name of letters and digits, and the characters in `other`, that begins with a letter.

    >>> ascii_name("2nd tür_a", 15, other="_"), ascii_name("😀", 15)
    ('P2ndtur_a', 'Program')
    """
    bare = unicodedata.normalize("NFKD", text)
    name = "".join(c for c in bare if c.isascii() and (c.isalnum() or c in other)).lstrip(other)
    if name and not name[0].isalpha():
        name = f"P{name}"
    return name[:longest] or fallback


def file_stem(name: str) -> str:
    """Return a name as the stem of a file that every common file system takes and that stays in its folder.

    >>> file_stem("../../x"), file_stem("CON"), file_stem("Türrahmen 2.b")
    ('_.._x', '_CON', 'Türrahmen 2.b')
    """
    safe = "".join(c if c.isalnum() or c in "._- " else "_" for c in unicodedata.normalize("NFC", name))
    stem = safe.strip(" ").lstrip(".-").encode("utf-8")[:_STEM_BYTES].decode("utf-8", "ignore").rstrip(". ")
    if stem.split(".")[0].strip().lower() in _RESERVED_STEMS:
        stem = f"_{stem}"
    return stem or "program"


def counted(number: int, noun: str) -> str:
    """Return a number with its noun in singular or plural.

    >>> counted(1, "move"), counted(2, "move")
    ('1 move', '2 moves')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def pose_words(pose: FloatArray) -> str:
    """Return a (4, 4) pose as one line: the translation, and the rows of the rotation."""
    rows = ["  ".join(trimmed(v, 9) for v in row) for row in pose[:3, :3]]
    return f"origin {' '.join(trimmed(v, 6) for v in pose[:3, 3])} mm, rotation rows {' / '.join(rows)}"
