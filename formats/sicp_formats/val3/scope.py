"""What the names in a VAL3 program stand for while it runs: declared variables, counters, and what is not known."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from sicp_cam.errors import printable
from sicp_formats.robot.program import RobotError
from sicp_formats.val3.data import ITEM, Variables

__all__ = ["Scope"]

_TERM = r"(?:[0-9]{1,9}|size[ \t]*\([ \t]*\w+[ \t]*\)|[A-Za-z_]\w*(?:\[[^\[\]]*\])?)"
_SUM = re.compile(rf"[ \t]*([+-]?)[ \t]*({_TERM})[ \t]*", re.ASCII)


@dataclass(slots=True)
class Scope:
    """The names of a program that runs.

    Parameters
    ----------
    variables
        The declared variables of the application.
    numbers
        Whole numbers that the program has set.
    changed
        Variables that the program may have changed, so that their declared values do not hold.
    own_names
        Parameters and locals of the program, which hide declared variables.
    """

    variables: Variables
    numbers: dict[str, int] = field(default_factory=dict)
    changed: set[str] = field(default_factory=set)
    own_names: frozenset[str] = frozenset()

    @contextmanager
    def within(self, own_names: frozenset[str]) -> Iterator[None]:
        """Enter a program with names of its own."""
        hidden = {name: self.numbers.pop(name) for name in own_names if name in self.numbers}
        before, self.own_names = self.own_names, own_names
        yield
        self.own_names = before
        for name in own_names:
            self.numbers.pop(name, None)
        self.numbers |= hidden

    def item(self, text: str) -> tuple[str, str]:
        """Return name and key of a variable that no statement before may have changed."""
        match = ITEM.fullmatch(text)
        if match is None:
            raise RobotError(f"'{printable(text, 40)}' is computed or from a library; only declared variables are read")
        self.refuse_changed([match[1]])
        if match[1] in self.own_names:
            raise RobotError(f"'{match[1]}' is a parameter or local of the program; only declared variables are read")
        return match[1], str(self.whole(match[2])) if match[2] is not None else "0"

    def refuse_changed(self, names: list[str]) -> None:
        """Refuse variables that a statement before may have changed."""
        for name in names:
            if name in self.changed:
                raise RobotError(f"'{name}' is changed by the program before; write its value into the .dtx file")

    def whole(self, text: str) -> int:
        """Return the value of a sum of whole numbers: constants, loop counters, sizes and declared numbers."""
        if text in self.numbers:
            return self.numbers[text]
        if text.isdigit() and text.isascii():
            return int(text)
        total, at = 0, 0
        while at < len(text) or at == 0:
            match = _SUM.match(text, at)
            if match is None or (at > 0 and not match[1]):
                raise RobotError(f"'{printable(text, 40)}' is not computed here; write plain numbers")
            total += (-1 if match[1] == "-" else 1) * self._term(match[2])
            at = match.end()
        return total

    def _term(self, text: str) -> int:
        if text.isdigit():
            return int(text)
        if text.startswith("size") and text.endswith(")"):
            name = text[4:].strip(" \t()")
            if name not in self.variables.known:
                raise RobotError(f"the variable '{printable(name, 40)}' is in no .dtx file of the application")
            return self.variables.known[name].size
        if text in self.numbers:
            return self.numbers[text]
        name, key = self.item(text)
        value = self.variables.number(name, key, "value", 0.0)
        if self.variables.type_of(name) != "num" or not value.is_integer():
            raise RobotError(f"'{printable(text, 40)}' is no whole number; nothing is computed here")
        return int(value)

    def set(self, name: str, value: int | None) -> None:
        """Take a new value of a variable, None for one that is not known."""
        self.numbers.pop(name, None)
        self.changed.discard(name)
        if value is not None:
            self.numbers[name] = value
        else:
            self.changed.add(name)
