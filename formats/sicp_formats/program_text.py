"""Decode the text of a program into lines, as an editor would number them."""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits

__all__ = ["program_lines"]


def program_lines(path: Path, content: bytes, limits: Limits) -> list[str]:
    r"""Return the lines of a program without their ends: UTF-8 or UTF-16 with a byte order mark, or Latin-1.

    Only LF, CRLF and CR end a line, as in the editors that show line numbers.

    Raises
    ------
    FormatError
        If the file is not text or a line is longer than `limits.line_bytes`.

    >>> program_lines(Path("a.apt"), b"UNITS/MM\r\nFINI\r\n", Limits())
    ['UNITS/MM', 'FINI', '']
    """
    try:
        encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if "\0" in text:
        raise FormatError(path, "holds NUL bytes, so it is no text; is this a tool path?", byte=content.find(b"\0"))
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if max(map(len, lines)) > limits.line_bytes:
        long = next(number for number, line in enumerate(lines, 1) if len(line) > limits.line_bytes)
        raise FormatError(path, f"the line is longer than the limit line_bytes = {limits.line_bytes}", line=long)
    return lines
