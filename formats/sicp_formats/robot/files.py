"""Files of other programs that lie beside a robot program, as its controller would find them by name."""

from __future__ import annotations

from pathlib import Path

__all__ = ["file_beside"]


def file_beside(path: Path, name: str, suffix: str) -> Path | None:
    """Return the file of a program beside another one, whichever case it is written in; None if there is none.

    Parameters
    ----------
    path
        The program that names the other one.
    name
        Name of the other program: a word without any folder.
    suffix
        With its dot, in lower case.

    """
    wanted = {f"{name}{suffix}".lower(), f"{name}{suffix}.gz".lower()}
    files = (file for file in sorted(path.parent.iterdir()) if file.name.lower() in wanted)
    return next(filter(Path.is_file, files), None)
