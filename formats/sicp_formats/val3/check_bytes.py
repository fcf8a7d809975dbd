"""The bytes of a VAL3 file: the encoding that it declares and the one that it has, its line ends, its sections."""

from __future__ import annotations

import re
from pathlib import Path

from sicp_cam.errors import printable
from sicp_cam.findings import Level
from sicp_formats.val3.check_report import Report

__all__ = ["check_bytes", "early_end"]

_DECLARED = re.compile(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([\w.-]+)[\"']")
_UTF8, _LATIN = ("utf-8", "utf8"), ("iso-8859-1", "latin-1", "latin1")
_BOM = b"\xef\xbb\xbf"


def early_end(content: bytes) -> int:
    """Return the line of a ]]> that is not the end of a section of code, 0 if there is none."""
    for match in re.finditer(rb"\]\]>", content):
        if not re.match(rb"\s*</", content[match.end() :]):
            return content.count(b"\n", 0, match.start()) + 1
    return 0


def check_bytes(file: Path, content: bytes, report: Report) -> None:
    """Check that the encoding is the one that is declared, and the line ends."""
    marked = content.startswith(_BOM)
    found = _DECLARED.match(content[3:] if marked else content)
    declared = found[1].decode("ascii").lower() if found else "utf-8"
    wrong = _first_not_utf8(content)
    plain = content[3:].isascii() if marked else content.isascii()
    if declared not in _UTF8 + _LATIN:
        what = f"the encoding {printable(declared, 20)} is neither utf-8 nor iso-8859-1; save it as UTF-8"
        report.add(851, Level.WARN, what, file, 1)
    elif declared in _UTF8 and wrong:
        what = "a byte here is no UTF-8, which the file declares; save it as UTF-8"
        report.add(851, Level.FAIL, what, file, wrong)
    elif declared in _LATIN and (marked or (not plain and not wrong)):
        what = "the file declares iso-8859-1, but its bytes are those of UTF-8; declare utf-8"
        report.add(851, Level.WARN, what, file, 1)
    elif declared in _UTF8 and not marked:
        what = "UTF-8 without byte order mark; the manufacturer's tool writes one"
        report.add(851, Level.INFO if plain else Level.WARN, what, file, 1)
    ends = content.count(b"\r\n"), content.count(b"\n"), content.count(b"\r")
    if ends[0] != ends[1] or ends[0] != ends[2]:
        mixed = ends[0] > 0 or (ends[1] > 0 and ends[2] > 0)
        what = "line ends are mixed; save it with CRLF" if mixed else "lines do not end with CRLF, as on the controller"
        report.add(851, Level.WARN if mixed else Level.INFO, what, file, _first_odd_end(content) if mixed else 1)


def _first_not_utf8(content: bytes) -> int:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        return content.count(b"\n", 0, error.start) + 1
    return 0


def _first_odd_end(content: bytes) -> int:
    odd = re.search(rb"\r(?!\n)|(?<!\r)\n", content)
    return content.count(b"\n", 0, odd.start()) + 1 if odd else 0
