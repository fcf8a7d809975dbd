"""Recognise calls of subprograms that lie beside a G-code program, as long paths are divided for a control."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["called_beside"]

_LINUXCNC = re.compile(r"O[ \t]*<([A-Z0-9_-]{1,100})>[ \t]*(?:CALL|SUB|ENDSUB)", re.ASCII | re.IGNORECASE)
_SIEMENS = re.compile(r"(?:N[0-9]{1,12}[ \t]+)?([A-Z_]{2}[A-Z0-9_]{0,100})", re.ASCII | re.IGNORECASE)


def called_beside(line: str, program: Path) -> str:
    """Return the name of the file beside a program that a line calls, begins or ends as a subprogram; else nothing.

    >>> called_beside("o<part> call", Path("no such folder/a.ngc"))
    ''
    """
    for pattern, suffix in ((_LINUXCNC, ".ngc"), (_SIEMENS, ".spf")):
        found = pattern.fullmatch(line.strip())
        if found is None:
            continue
        for name in (found[1], found[1].lower(), found[1].upper()):
            if program.with_name(f"{name}{suffix}").is_file():
                return f"{name}{suffix}"
    return ""
