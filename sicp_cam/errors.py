"""Every error that leaves the package, as one tree.

::

    SicpError
    ├── JobError            exit 2  a wrong option, job file or combination
    ├── InputError          exit 3  an input cannot be read or is not valid
    │   ├── FormatError             the bytes of a file: names file and line or byte
    │   ├── UnitError               the unit is unknown or cannot be right
    │   └── CadError                the CAD kernel failed, crashed or ran out of time
    ├── RegistrationError   exit 4  part and scan cannot be brought together
    │   └── AmbiguousPoseError      two poses fit about equally
    ├── PathError           exit 5  the corrected path breaks a gate
    ├── OutputError         exit 6  an output exists, is not writable or left its folder
    ├── WarningsError       exit 7  something was noticed, and the job is strict
    └── ReportError         exit 8  the program is written, a picture or page is not

Each message is one line: what is wrong, where, and what to do about it.
"""

from __future__ import annotations

import os

__all__ = [
    "AmbiguousPoseError",
    "CadError",
    "FormatError",
    "InputError",
    "JobError",
    "OutputError",
    "PathError",
    "RegistrationError",
    "ReportError",
    "SicpError",
    "UnitError",
    "WarningsError",
    "printable",
]


def printable(text: str, limit: int = 200) -> str:
    r"""Return text from a file made safe for a terminal, a log or a page, on one line.

    >>> printable("name\x1b]0;x\n")
    'name\\x1b]0;x\\n'
    """
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
    return safe if len(safe) <= limit else safe[: limit - 3] + "..."


class SicpError(Exception):
    """Root of all errors that the package raises on purpose."""

    exit_code = 1


class JobError(SicpError, ValueError):
    """A job that cannot be run as it is stated; `problems` holds every one found, not the first only."""

    exit_code = 2

    def __init__(self, *problems: str) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems


class InputError(SicpError, ValueError):
    """An input file that cannot be used."""

    exit_code = 3


class FormatError(InputError):
    """A file whose bytes are not what its format demands.

    Parameters
    ----------
    path
        The file, as the user named it.
    what
        What is wrong and, after a semicolon, what to do; one line.
    line, byte
        Where: the 1-based line of a text file, or the 0-based offset in a binary one.
    """

    def __init__(
        self, path: str | os.PathLike[str], what: str, *, line: int | None = None, byte: int | None = None
    ) -> None:
        where = f", line {line}" if line is not None else f", byte {byte}" if byte is not None else ""
        super().__init__(f"{printable(os.fspath(path))}{where}: {printable(what, 400)}")
        self.path = os.fspath(path)
        self.what = what
        self.line = line
        self.byte = byte


class UnitError(InputError):
    """A length unit that is unknown, missing, or contradicted by the size of the other inputs."""


class CadError(InputError):
    """The CAD kernel could not read the file, crashed on it, or did not finish in time."""


class RegistrationError(SicpError, RuntimeError):
    """The scan cannot be registered to the part with any confidence."""

    exit_code = 4


class AmbiguousPoseError(RegistrationError):
    """Two different poses fit about equally well; the message says what would settle it."""


class PathError(SicpError, RuntimeError):
    """The corrected path breaks a limit; no program may be written from it."""

    exit_code = 5


class OutputError(SicpError, OSError):
    """An output that may not or cannot be written."""

    exit_code = 6


class WarningsError(SicpError, RuntimeError):
    """Warnings in a job that demands none (`--strict`)."""

    exit_code = 7


class ReportError(SicpError, RuntimeError):
    """A report or a picture that could not be made."""

    exit_code = 8
