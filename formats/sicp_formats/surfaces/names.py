"""Names of further columns as words in the header of a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sicp_cam.errors import JobError, printable

__all__ = ["written_names"]


def written_names(names: Iterable[str], taken: Sequence[str]) -> tuple[str, ...]:
    """Return names without blanks and characters that are not printable; an underscore stands for each of them.

    Parameters
    ----------
    names
        Those of the columns.
    taken
        What would mean something else in the file.

    Raises
    ------
    JobError
        If two names become the same, or one is taken or empty.

    >>> written_names(["red", "Range [m]"], ["x"])
    ('red', 'Range_[m]')
    """
    written: list[str] = []
    for name in names:
        word = "".join(letter if letter.isprintable() and not letter.isspace() else "_" for letter in name)
        if not word or word in taken or word in written:
            clash = "is empty" if not word else "means something else in this format, or is there twice"
            raise JobError(f"the name '{printable(name, 60)}' of a column {clash}; rename the column or leave it out")
        written.append(word)
    return tuple(written)
