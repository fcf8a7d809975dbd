"""A report as plain data: texts, tables and pictures, in the order in which they are read."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Picture", "ReportDocument", "Table", "Verdict"]


class Verdict(StrEnum):
    """What the report says in large letters."""

    OK = "OK"
    WARNINGS = "WARNINGS"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of plain strings under a heading.

    Parameters
    ----------
    title
        The heading.
    head
        One text per column.
    rows
        As many texts in each row.
    widths
        Relative width of each column.
    numeric
        Columns from this one on are set to the right.
    note
        A line below the table; may be empty.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[float, ...]
    numeric: int = 99
    note: str = ""

    def __post_init__(self) -> None:
        if any(len(row) != len(self.head) for row in (self.widths, *self.rows)):
            raise ValueError(f"table {self.title!r}: every row needs {len(self.head)} cells")


@dataclass(frozen=True, slots=True)
class Picture:
    """A PNG file and what it shows."""

    png: bytes
    caption: str


@dataclass(frozen=True, slots=True)
class ReportDocument:
    """All that a report says; every string is printed literally.

    Parameters
    ----------
    title, job
        What the page is, and the name of the job.
    verdict, reasons
        In large letters, and why, in words.
    sign_convention
        What the signs of the residuals mean; printed after the first table.
    tables
        In order.
    pictures
        In order, from a new page on.
    version
        Version of the product, for the foot of every page.
    """

    title: str
    job: str
    verdict: Verdict
    reasons: tuple[str, ...]
    sign_convention: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[Picture, ...]
    version: str
