"""Decode the text of a program into lines, as an editor would number them."""

from __future__ import annotations

from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits

__all__ = ["decoded", "program_lines", "program_text", "suffix_of_program"]


def program_text(path: Path, content: bytes) -> str:
    r"""Return a program as text whose lines end with LF: UTF-8 or UTF-16 with a byte order mark, or Latin-1.

    Only LF, CRLF and CR end a line, as in the editors that show line numbers.

    Raises
    ------
    FormatError
        If the file is not text.

    >>> program_text(Path("a.apt"), b"UNITS/MM\r\nFINI\r\n")
    'UNITS/MM\nFINI\n'
    """
    text = decoded(content)[0]
    if "\0" in text:
        raise FormatError(path, "holds NUL bytes, so it is no text; is this a tool path?", byte=content.find(b"\0"))
    return text.replace("\r\n", "\n").replace("\r", "\n")


_MARKS = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8"), (b"", "utf-8"))


def decoded(content: bytes) -> tuple[str, bytes, str]:
    r"""Return the text of a program, the byte order mark before it, and the encoding that gives the same bytes again.

    >>> decoded(b"\xff\xfeG\x000\x00"), decoded(b"\xe9")
    (('G0', b'\xff\xfe', 'utf-16-le'), ('é', b'', 'latin-1'))
    """
    mark, encoding = next(pair for pair in _MARKS if content.startswith(pair[0]))
    try:
        return content[len(mark) :].decode(encoding), mark, encoding
    except UnicodeDecodeError:
        return content.decode("latin-1"), b"", "latin-1"


def suffix_of_program(path: Path) -> str:
    """Return the suffix of a program with its dot: before `.gz`, and before the version numbers of Creo.

    >>> suffix_of_program(Path("op010.ncl.3")), suffix_of_program(Path("a.apt.gz"))
    ('.ncl', '.apt')
    """
    suffixes = path.suffixes
    while len(suffixes) > 1 and (suffixes[-1].lower() == ".gz" or suffixes[-1][1:].isdigit()):
        suffixes.pop()
    return suffixes[-1] if suffixes else ""


def program_lines(path: Path, content: bytes, limits: Limits) -> list[str]:
    r"""Return the lines of a program without their ends.

    Raises
    ------
    FormatError
        If the file is not text or a line is longer than `limits.line_bytes`.

    >>> program_lines(Path("a.apt"), b"UNITS/MM\r\nFINI\r\n", Limits())
    ['UNITS/MM', 'FINI', '']
    """
    lines = program_text(path, content).split("\n")
    if max(map(len, lines)) > limits.line_bytes:
        long = next(number for number, line in enumerate(lines, 1) if len(line) > limits.line_bytes)
        raise FormatError(path, f"the line is longer than the limit line_bytes = {limits.line_bytes}", line=long)
    return lines
