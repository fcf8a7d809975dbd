"""What an output file may be called, so that it stays in its folder and can be copied to any controller."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from sicp_cam.errors import OutputError, printable

__all__ = ["check_names", "joined", "name_problem"]

_RESERVED = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9\u00b9\u00b2\u00b3])(\..*)?", re.IGNORECASE)
_NAME_BYTES = 200


def name_problem(name: str) -> str | None:
    """Say why a name cannot be a file name on every common system, or None if it can.

    >>> name_problem("corrected") is None
    True
    >>> name_problem("CON.csv")
    'is a reserved name on Windows'
    """
    if name in ("", ".", ".."):
        return "is empty or a step to another folder"
    if any(character in '/\\:*?"<>|' or not character.isprintable() for character in name):
        return 'must not contain / \\ : * ? " < > | or control characters'
    if name != name.strip() or name.endswith("."):
        return "must not begin or end with a blank or end with a dot"
    if _RESERVED.fullmatch(name):
        return "is a reserved name on Windows"
    if len(os.fsencode(name)) > _NAME_BYTES:
        return f"is longer than {_NAME_BYTES} bytes"
    return None


def check_names(names: Sequence[str]) -> None:
    """Check the relative names of a result: inside the folder, portable, and different from each other.

    Raises
    ------
    OutputError
        If a part of a name breaks `name_problem`, two names differ in case only, or a file is also a folder.
    """
    seen: dict[str, str] = {}
    for name in names:
        for part in name.removesuffix("/").split("/"):
            if problem := name_problem(part):
                raise OutputError(f"output name '{printable(name)}': '{printable(part, 60)}' {problem}")
        if seen.setdefault(name.lower(), name) != name:
            raise OutputError(f"output names '{printable(name)}' and '{printable(seen[name.lower()])}' are one file")
    for name in names:
        for parent in PurePosixPath(name).parents:
            if str(parent).lower() in seen:
                raise OutputError(f"output name '{printable(str(parent))}' is both a file and a folder")


def joined(files_by_post: Mapping[str, Mapping[str, bytes]]) -> dict[str, bytes]:
    """Return the files of several posts as one mapping.

    Raises
    ------
    OutputError
        If two posts write a file of the same name.
    """
    files: dict[str, bytes] = {}
    writers: dict[str, str] = {}
    for post, written in files_by_post.items():
        for name, content in written.items():
            other = writers.setdefault(name.lower(), post)
            if other != post:
                raise OutputError(f"{printable(name)}: written by both {other} and {post}; run them into two folders")
            files[name] = content
    return files
