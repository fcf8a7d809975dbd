"""Say what was meant by a key that has no place in a job."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields

from sicp_cam.errors import printable
from sicp_cam.job.layers import OPTION_TABLES
from sicp_cam.job.tables import TABLES, table_key
from sicp_cam.options.values import closest, nearest
from sicp_cam.plugins.registry import POSTPROCESSORS, owners

__all__ = ["misplaced"]


def misplaced(key: str, value: object, plain: Collection[str]) -> str | None:
    """Say why a key that is no plain one has no place in a job; what lies below a table, the table itself checks."""
    first, _, rest = key.partition(".")
    if key in (*TABLES, "options") or (first == "options" and rest in OPTION_TABLES):
        return None if value == {} else f"must be a table, not {printable(str(value), 60)}"
    if first in TABLES:
        return None
    if first == "options":
        option_table = rest.partition(".")[0]
        return None if option_table in OPTION_TABLES else f"unknown table; {nearest(option_table, OPTION_TABLES)}"
    if first in OPTION_TABLES:
        return f"{first} takes a value; the options of its reader or post stand in the table options.{first}"
    if first in plain:
        return f"{first} takes a value, not a table"
    return f"unknown key; {_meant(key, plain)}"


def _meant(key: str, plain: Collection[str]) -> str:
    """Say which key was meant: one of a table whose name was left out, an option of a post, or one spelt nearly so."""
    first, _, rest = key.partition(".")
    if whole := table_key(key):
        return f"did you mean {whole}?"
    if rest and first in owners(POSTPROCESSORS):
        return f"did you mean options.post.{printable(key)}?"
    known = {name: name for name in (*plain, *TABLES, "options")}
    if not rest:
        known |= {f.name: f"{name}.{f.name}" for name, kind in TABLES.items() for f in fields(kind)}
    near = closest(first, known)
    return f"did you mean {known[near]}?" if near else nearest(first, (*plain, *TABLES, "options"))
