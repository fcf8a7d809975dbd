"""Data files of the user's, in TOML: a machine, an arm. Whatever stands in them, the answer is a table or one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from sicp_cam.errors import JobError, printable

__all__ = ["read_toml", "toml_from_text"]

_LARGEST_FILE = 65_536


def read_toml(file: str, kind: str) -> dict[str, Any]:
    """Read a data file.

    Parameters
    ----------
    file
        Its name.
    kind
        What it is, for messages: "robot", "machine".

    Raises
    ------
    JobError
        If it cannot be read, is too large to be one, or is not TOML in UTF-8.
    """
    name = f"{kind} file {printable(file)}"
    try:
        with Path(file).open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "its name is not valid"
        raise JobError(f"{name} cannot be read: {reason}") from None
    if len(content) > _LARGEST_FILE:
        raise JobError(f"{name} has more than {_LARGEST_FILE} bytes; it is no kinematics file")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise JobError(f"{name}, byte {error.start}: it is not UTF-8 text") from None
    return toml_from_text(text, file, kind)


def toml_from_text(text: str, file: str, kind: str) -> dict[str, Any]:
    """Return the table of a data file's text.

    Raises
    ------
    JobError
        If it is not TOML; the message names the line.

    >>> toml_from_text('name = "x"', "my.toml", "machine")
    {'name': 'x'}
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise JobError(f"{kind} file {printable(file)}: its values are nested too deeply") from None
    except ValueError as error:  # TOMLDecodeError, or a whole number of thousands of digits
        raise JobError(f"{kind} file {printable(file)}: {printable(str(error))}") from None
