"""The `--set` of the commands that read one file: options by table, and caps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, TypeAlias

from sicp_cam.errors import JobError, printable
from sicp_cam.job.layers import settings
from sicp_cam.limits import Limits
from sicp_cam.options.values import table

__all__ = ["Unit", "reader_settings"]

Unit: TypeAlias = Literal["mm", "cm", "m", "inch"]
"""What --units takes."""


def reader_settings(pairs: Iterable[str], tables: Sequence[str]) -> tuple[Limits, dict[str, dict[str, object]]]:
    """Sort `KEY=VALUE` pairs into caps and the named tables.

    Parameters
    ----------
    pairs
        Such as `scan.decimal=,`, `out.encoding=ascii`, `limits.points=1000000`.
    tables
        Names that may stand before the dot; with one name, it may be left out.

    Raises
    ------
    JobError
        If a key is of no table, or a cap is unknown or of a wrong type; all of them at once.

    >>> reader_settings(["limits.points=10", "decimal=,"], ["scan"])[1]
    {'scan': {'decimal': ','}}
    """
    caps: dict[str, object] = {}
    sorted_: dict[str, dict[str, object]] = {name: {} for name in tables}
    problems = []
    for key, value in settings({}, pairs).values.items():
        name, dot, own_key = key.removeprefix("options.").partition(".")
        if dot and name == "limits":
            caps[own_key] = value
        elif dot and name in sorted_:
            sorted_[name][own_key] = value
        elif len(tables) == 1:
            sorted_[tables[0]][key] = value
        else:
            known = ", ".join(f"{each}." for each in (*tables, "limits"))
            problems.append(f"--set {printable(key, 80)}: must begin with one of {known}")
    limits, wrong = table(Limits, caps)
    problems += [f"limits.{key}: {problem}" for key, problem in wrong.items()]
    if limits is None or problems:
        raise JobError(*problems)
    return limits, sorted_
