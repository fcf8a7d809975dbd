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

    >>> file_beside(Path("nowhere/main.src"), "part", ".src") is None
    True
    """
    stems = dict.fromkeys((name, name.lower(), name.upper()))
    names = [stem + end for stem in stems for end in (suffix, suffix.upper(), suffix + ".gz")]
    return next((file for each in names if (file := path.with_name(each)).is_file()), None)
