"""The bare tags of a DXF drawing: what the loading library mends without a word is seen here, with its line.

A drawing is a row of pairs, a group code and a value, one below the other in a text file. The library neither knows the
lines that its entities came from, nor tells which numbers it replaced; both are needed to refuse a drawing precisely.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from sicp_cam.errors import FormatError, printable
from sicp_cam.model import BoolArray, FloatArray, IntArray

__all__ = ["Record", "Tags", "Value", "ascii_tags", "tags_of"]

Value: TypeAlias = bytes | str | float | int
_WITH_CURVES = ("ENTITIES", "BLOCKS")
_PARTS = ("VERTEX", "SEQEND", "ATTRIB")
_LARGEST_CODE = 10_000
_REAL_CODES = ((10, 60), (110, 150), (210, 240))


@dataclass(frozen=True, slots=True)
class Record:
    """An entity as it stands in the file: type, handle (may be empty), tags from `first` to before `end`, and line.

    `line` is 0 in a binary drawing.
    """

    kind: str
    handle: str
    first: int
    end: int
    line: int

    def __str__(self) -> str:
        return printable(f"{self.kind} #{self.handle}" if self.handle else self.kind, 60)


@dataclass(frozen=True, slots=True, eq=False)
class Tags:
    """The tags of one drawing up to its end mark.

    Parameters
    ----------
    codes, values, numbers
        (n,) each: group codes, values as they stand, and the real numbers among those of entities (NaN for the rest).
    records
        The entities of drawing and blocks in order; the corners of old polylines are records of their own.
    in_model
        The entities of the model space alone, without the parts of others.
    text
        True for a drawing in text form, which has lines.
    """

    path: Path
    codes: IntArray
    values: Sequence[Value]
    numbers: FloatArray
    records: tuple[Record, ...]
    in_model: tuple[Record, ...]
    text: bool

    def line(self, tag: int) -> int:
        """Return the 1-based line of the value of a tag, 0 in a binary drawing."""
        return 2 * tag + 2 if self.text else 0

    def error(self, what: str, tag: int) -> FormatError:
        """Return the error that names the line of the value of a tag, if it has one."""
        return FormatError(self.path, what, line=self.line(tag) or None)

    def owners(self, tags: IntArray, kind: str) -> Iterator[tuple[int, Record]]:
        """Return those of some tags that stand in entities of one type, each with its entity."""
        firsts = np.array([record.first for record in self.records], dtype=np.int64)
        of_kind = np.array([record.kind == kind for record in self.records], dtype=np.bool_)
        places = np.searchsorted(firsts, tags, side="right") - 1
        inside = places >= 0
        inside[inside] = of_kind[places[inside]]
        for tag, place in zip(tags[inside].tolist(), places[inside].tolist(), strict=True):
            if tag < self.records[place].end:
                yield tag, self.records[place]

    def insunits(self) -> tuple[int, int] | None:
        """Return the header variable $INSUNITS and its line; None where it is not set."""
        for tag in np.flatnonzero(self.codes[:-1] == 9).tolist():
            if _word(self.values[tag]) == "$INSUNITS":
                try:
                    return int(self.values[tag + 1]), self.line(tag + 1)
                except ValueError:
                    raise self.error("$INSUNITS is no whole number; save the drawing with a unit", tag + 1) from None
        return None

    def flaws(self) -> Iterator[tuple[str, int, bool]]:
        """Return where the sections of the drawing are not closed: what is wrong, the tag, and if curves are lost."""
        section = ""
        last = len(self.codes) - 1
        for tag in np.flatnonzero(self.codes == 0).tolist():
            name = _word(self.values[tag])
            if name in ("SECTION", "EOF") and section:
                yield f"the section {printable(section, 40)} has no end (ENDSEC)", tag, False
            if name == "SECTION":
                section = _word(self.values[tag + 1]) if tag < last else "?"
            elif name == "ENDSEC":
                section = ""
            elif name == "EOF":
                return
        yield "the drawing has no end (EOF), it is cut short", last, section in _WITH_CURVES


def ascii_tags(path: Path, content: bytes) -> Tags:
    """Return the tags of a drawing in text form.

    Raises
    ------
    FormatError
        With the line, if a group code is no number, or a coordinate of an entity no finite one.
    """
    lines = content.splitlines()
    try:
        codes = list(map(int, lines[: len(lines) // 2 * 2 : 2]))
    except ValueError:
        codes = _codes_one_by_one(path, lines)
    return tags_of(path, codes, lines[1 : 2 * len(codes) : 2], text=True)


def tags_of(path: Path, codes: list[int], values: Sequence[Value], *, text: bool) -> Tags:
    """Return tags that have been split already; errors as in `ascii_tags`, without lines if they are no text."""
    if 0 not in codes:
        raise FormatError(path, "holds no section of a drawing; export it again as DXF", line=1 if text else None)
    group = np.array([min(max(code, -1), _LARGEST_CODE) for code in codes], dtype=np.int64)
    starts = np.flatnonzero(group == 0).tolist()
    names = [_word(values[tag]) for tag in starts]
    if "EOF" in names:
        count = names.index("EOF") + 1
        starts, names = starts[:count], names[:count]
        group, values = group[: starts[-1] + 1], values[: starts[-1] + 1]
    records, in_model, drawn = _records(group, values, (starts, names), text=text)
    bare = Tags(path, group, values, np.full(len(group), np.nan), records, in_model, text)
    return Tags(path, group, values, _numbers(bare, drawn), records, in_model, text)


def _codes_one_by_one(path: Path, lines: list[bytes]) -> list[int]:
    """Return the group codes up to the end mark: what follows it is no part of the drawing and need not be codes."""
    codes: list[int] = []
    for place in range(0, len(lines) - 1, 2):
        try:
            codes.append(int(lines[place]))
        except ValueError:
            told = printable(lines[place].decode("latin-1").strip(), 40)
            what = f"the group code {told!r} is no whole number; is it a DXF? Export it again"
            raise FormatError(path, what, line=place + 1) from None
        if codes[-1] == 0 and lines[place + 1].strip() == b"EOF":
            break
    return codes


def _records(
    codes: IntArray, values: Sequence[Value], heads: tuple[list[int], list[str]], *, text: bool
) -> tuple[tuple[Record, ...], tuple[Record, ...], BoolArray]:
    """Return the records of the sections that hold curves, those in model space, and which tags are in them."""
    handles = _first_words(codes, values, 5, heads[0])
    on_paper = {start for start, word in _first_words(codes, values, 67, heads[0]).items() if word == "1"}
    drawn = np.zeros(len(codes), dtype=np.bool_)
    records, in_model, section = [], [], ""
    for start, end, kind in zip(heads[0], [*heads[0][1:], len(codes)], heads[1], strict=True):
        if kind in ("SECTION", "ENDSEC", "EOF"):
            section = _word(values[start + 1]) if kind == "SECTION" and end > start + 1 else ""
        elif section in _WITH_CURVES:
            record = Record(kind, handles.get(start, "").upper(), start, end, 2 * start + 1 if text else 0)
            records.append(record)
            drawn[start:end] = True
            if section == "ENTITIES" and kind not in _PARTS and start not in on_paper:
                in_model.append(record)
    return tuple(records), tuple(in_model), drawn


def _first_words(codes: IntArray, values: Sequence[Value], code: int, starts: list[int]) -> dict[int, str]:
    """Return the first value of one group code in each record, by where the record begins."""
    tags = np.flatnonzero(codes == code)
    places = np.searchsorted(np.array(starts, dtype=np.int64), tags, side="right") - 1
    words: dict[int, str] = {}
    for tag, place in zip(tags.tolist(), places.tolist(), strict=True):
        if place >= 0:
            words.setdefault(starts[place], _word(values[tag]))
    return words


def _numbers(tags: Tags, drawn: BoolArray) -> FloatArray:
    """Return the real numbers of the entities; refuse those that are none, with the entity and the line."""
    real = np.zeros(len(drawn), dtype=np.bool_)
    for low, high in _REAL_CODES:
        real |= (tags.codes >= low) & (tags.codes < high)
    wanted = np.flatnonzero(real & drawn)
    numbers = tags.numbers.copy()
    try:
        numbers[wanted] = [float(tags.values[tag]) for tag in wanted.tolist()]
        bad = wanted[~np.isfinite(numbers[wanted])]
    except ValueError:
        bad = np.array([tag for tag in wanted.tolist() if not _is_number(tags.values[tag])][:1], dtype=np.int64)
    if len(bad):
        tag = int(bad[0])
        owner = next(record for record in tags.records if record.first <= tag < record.end)
        told = printable(_word(tags.values[tag]), 40)
        raise tags.error(f"{owner}: {told!r} is no finite number (group code {tags.codes[tag]}); correct it", tag)
    return numbers


def _is_number(value: Value) -> bool:
    try:
        float(value)
    except ValueError:
        return False
    return True


def _word(value: Value) -> str:
    return (value.decode("latin-1") if isinstance(value, bytes) else str(value)).strip()
