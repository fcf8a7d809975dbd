"""Which programs a file or folder holds, and what their readers must be told: as the result of a run says it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sicp_cam import plugins
from sicp_cam.errors import InputError, printable
from sicp_cam.job.input_files import absent

__all__ = ["WrittenProgram", "programs_in"]

_MANIFEST = "result.json"
_MANIFEST_BYTES = 2**26
_PART = re.compile(r"(.+?)_?[0-9]{3,}", re.ASCII)
"""Name of a program that another one calls, which bears the rest of the name: a part of a long path."""
_PROJECT = "pjx"


@dataclass(frozen=True, slots=True)
class WrittenProgram:
    """A program by the file that it is read by.

    Parameters
    ----------
    file
        That file.
    reading
        What its reader must be told.
    unread
        Why no reader can make a path of it; empty where one can.
    """

    file: Path
    reading: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))
    unread: str = ""


def programs_in(target: Path) -> tuple[WrittenProgram, ...]:
    """Return the programs of a file or folder, in order of name.

    A folder is a VAL3 application if a .pjx file lies in it, or holds results if it has a result.json; of other
    folders nobody knows which files are meant. A result.json, in the folder or beside the file or application, says
    how they are read.

    Raises
    ------
    InputError
        If it does not exist, or is another folder.
    """
    name = printable(str(target))
    if not target.is_dir():
        if not target.exists():
            raise InputError(f"{name}: {absent(target)}")
        return (_as_written(target),)
    applications = sorted(file for file in target.iterdir() if plugins.suffix_of(file) == _PROJECT and file.is_file())
    if applications:
        return tuple(map(_as_written, applications))
    if (target / _MANIFEST).is_file():
        return _of_run(target)
    raise InputError(f"{name}: a folder with neither a .pjx nor a {_MANIFEST}; name the programs in it")


def _as_written(file: Path) -> WrittenProgram:
    """Return a program with what a result.json beside it, or beside its folder, says of it."""
    for folder in (file.parent, file.parent.parent):
        if not (folder / _MANIFEST).is_file():
            continue
        try:
            entries = _outputs(folder)
        except InputError:
            continue
        for path, reading in entries.items():
            if folder / path == file:
                return _told(file, reading)
    return WrittenProgram(file)


def _of_run(folder: Path) -> tuple[WrittenProgram, ...]:
    """Return the programs that the result of a run names: those with a word on how they are read, if there are any."""
    entries = {folder / path: reading for path, reading in _outputs(folder).items()}
    main = [file for file, reading in entries.items() if reading is not None]
    found = main or [file for file in entries if "path" in plugins.roles(file) and _begins(file, set(entries))]
    if not found:
        name = printable(str(folder / _MANIFEST))
        raise InputError(f"{name}: names no program that can be read; name the programs in the folder")
    return tuple(_told(file, entries[file]) for file in sorted(found))


def _told(file: Path, reading: object) -> WrittenProgram:
    if isinstance(reading, str):
        return WrittenProgram(file, unread=printable(reading))
    return WrittenProgram(file, dict(reading)) if isinstance(reading, dict) else WrittenProgram(file)


def _outputs(folder: Path) -> dict[str, Any]:
    """Return path and `reading` of the programs below a folder that its result.json names.

    Raises
    ------
    InputError
        If that is no result of a run.
    """
    manifest = folder / _MANIFEST
    name = printable(str(manifest))
    try:
        if manifest.stat().st_size > _MANIFEST_BYTES:
            raise InputError(f"{name}: larger than {_MANIFEST_BYTES} bytes, so it is no result of a run")
        entries = json.loads(manifest.read_text(encoding="utf-8"))["outputs"]
        named = {str(entry["path"]): entry.get("reading") for entry in entries if entry["kind"] == "program"}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{name}: is no result of a run; name the programs in the folder") from error
    return {path: reading for path, reading in named.items() if _is_below(path)}


def _is_below(name: str) -> bool:
    path = Path(name)
    return not path.is_absolute() and ".." not in path.parts


def _begins(file: Path, files: set[Path]) -> bool:
    """Say whether a file is the one to read a program by: a .pjx or .pgf that lists others, or no part of another."""
    suffix = plugins.suffix_of(file)
    if suffix in (_PROJECT, "pgf"):
        return True
    of_project = {each.parent for each in files if plugins.suffix_of(each) == _PROJECT}
    part = _PART.fullmatch(file.stem)
    whole = {file.with_suffix(".pgf")} if suffix in ("mod", "modx") else set()
    if part is not None:
        whole |= {file.with_name(part[1] + file.suffix), file.with_name(part[1] + ".pgf")}
    return not (any(folder in of_project for folder in file.parents) or whole & files)
