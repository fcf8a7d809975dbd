"""How a point stands in an APT statement: its numbers, and every blank, comma and line break around them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from sicp_formats.apt.statements import split_line
from sicp_formats.paths.number_tokens import NUMBER_TOKEN, retold

__all__ = ["Layout", "Precision", "comments_of"]

_LABEL = re.compile(r"^(\s*)(?:[A-Za-z0-9]+\)\s*|[Nn][0-9]+\s*(?=[A-Za-z]))", re.ASCII)
_BLANKS = re.compile(r" *\Z")
_AXIS_TOKENS = ("0.0000000",) * 3
_LONGEST_LINE = 72
_AXIS_TOLERANCE, _AXIS_DECIMALS = 5e-8, 7


@dataclass(frozen=True, slots=True)
class Precision:
    """How near a coordinate of the file must be to be kept, how many decimals new ones get, and their style below 1."""

    tolerance: float
    decimals: int
    bare: bool


@dataclass(frozen=True, slots=True)
class Layout:
    r"""One statement taken apart: `lead`, then its numbers with `gaps` between them, then `tail` up to the line end.

    >>> layout = Layout.of(["GOTO / 1.00 , 2.00 $\r\n", ", 3.00 $$ here\r\n"])
    >>> layout.tokens, layout.gaps, layout.tail
    (('1.00', '2.00', '3.00'), (' , ', ' $\r\n, '), ' $$ here')
    >>> layout.written(layout.renewed([1.0, 2.5, 3.0], Precision(5e-5, 4, False)))
    'GOTO / 1.00 , 2.50 $\r\n, 3.00 $$ here'
    """

    lead: str
    tokens: tuple[str, ...]
    gaps: tuple[str, ...]
    tail: str

    @classmethod
    def of(cls, lines: Sequence[str]) -> Layout:
        """Take the lines of a statement apart, given with their ends; the end of the last one is left out."""
        places: list[tuple[int, int]] = []
        start, slash = 0, False
        for line in lines:
            code = split_line(line.rstrip("\r\n"))[0]
            begin = 0 if slash else code.find("/") + 1
            slash = slash or begin > 0
            if slash:
                places += [(start + m.start(), start + m.end()) for m in NUMBER_TOKEN.finditer(code, begin)]
            start += len(line)
        text = "".join(lines).rstrip("\r\n")
        if not places:
            code = split_line(lines[0].rstrip("\r\n"))[0].rstrip()
            return cls(code, (), (), text[len(code) :])
        inner = pairwise(places)
        return cls(
            text[: places[0][0]],
            tuple(text[begin:end] for begin, end in places),
            tuple(text[before[1] : after[0]] for before, after in inner),
            text[places[-1][1] :],
        )

    def bare_lead(self) -> str:
        """Return what stands before the numbers, without the label or number of the statement."""
        return _LABEL.sub(r"\1", self.lead)

    def without_comments(self) -> Layout:
        """Return the layout on one line if there are remarks between its numbers, which are to be said once only."""
        return replace(self, gaps=tuple("," if "$" in gap else gap for gap in self.gaps))

    def with_axis(self, sample: Layout | None, line_end: str) -> Layout:
        """Return the layout with room for an axis behind its three numbers, as in the sample if there is one."""
        if sample is not None:
            return replace(self, tokens=self.tokens + sample.tokens[3:], gaps=self.gaps + sample.gaps[2:])
        gap = self.gaps[0] if "$" not in self.gaps[0] else ","
        layout = replace(self, tokens=self.tokens + _AXIS_TOKENS, gaps=(*self.gaps, gap, gap, gap))
        if len(layout.written(layout.tokens).rpartition("\n")[2]) <= _LONGEST_LINE:
            return layout
        return replace(layout, gaps=(*self.gaps, f"{gap.rstrip()} ${line_end}", gap, gap))

    def renewed(self, values: Sequence[float], precision: Precision) -> tuple[str, ...]:
        """Return the numbers of three coordinates, and of an axis behind them if there is one, each kept or anew."""
        coordinates = [
            retold(token, value, precision.tolerance, precision.decimals, bare=precision.bare)
            for token, value in zip(self.tokens[:3], values[:3], strict=False)
        ]
        axis = [
            retold(token, value, _AXIS_TOLERANCE, _AXIS_DECIMALS, bare=precision.bare)
            for token, value in zip(self.tokens[3:], values[3:], strict=False)
        ]
        return (*coordinates, *axis)

    def written(self, tokens: Sequence[str], lead: str | None = None, tail: str | None = None) -> str:
        """Return the statement with other numbers; columns that blanks line up stay in line."""
        parts = []
        gaps = (self.lead if lead is None else lead, *self.gaps)
        for gap, old, new in zip(gaps, self.tokens, tokens, strict=False):
            blanks = len(_BLANKS.search(gap)[0])  # type: ignore[index]  # it always matches
            if blanks > 1 and len(new) != len(old):
                gap = gap[:-blanks] + " " * max(1, blanks + len(old) - len(new))
            parts += [gap, new]
        return "".join(parts) + (self.tail if tail is None else tail)


def comments_of(lines: Sequence[str]) -> str:
    r"""Return the comments of a statement as lines of their own.

    >>> comments_of(["CIRCLE/0,0,0,$ $$ first orbit\n", "0,0,1\n"])
    '$$ first orbit\n'
    """
    kept = []
    for line in lines:
        body = line.rstrip("\r\n")
        comment = split_line(body)[2]
        if comment is not None:
            kept.append(f"$$ {comment}{line[len(body) :]}")
    return "".join(kept)
