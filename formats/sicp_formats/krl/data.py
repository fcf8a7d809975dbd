"""Values of KUKA programs: aggregates such as {X 1,Y 2,A 90}, declarations, and the variables that hold them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from sicp_cam.errors import printable
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError, split_arguments

__all__ = ["ASSIGNMENT", "Aggregate", "Values", "parsed_aggregate", "plain_name"]

Aggregate = dict[str, float]
"""Numbers of a point, frame or set of joint angles by their upper-case names."""

ASSIGNMENT = re.compile(
    r"(?:(?:GLOBAL|DECL|CONST)[ \t]+)*(?:[A-Z]\w*[ \t]+)?(\$?[A-Z_]\w*)[ \t]*(\[[^\]]*\])?((?:\.\w+)*)[ \t]*=(?!=)(.*)",
    re.ASCII | re.IGNORECASE,
)
"""An assignment or a declaration with a value: name, index, component and value."""

_MEMBER = re.compile(r"(\w+)(\[\])?[ \t]+(.*)", re.ASCII | re.DOTALL)
_KIND = re.compile(r"\{[ \t]*\w+[ \t]*:", re.ASCII)


def parsed_aggregate(text: str) -> Aggregate | None:
    """Return the numbers of an aggregate, None if it is none or holds more than numbers.

    Members that are text or other names, such as `IPO_FRAME #BASE`, are left out.

    >>> parsed_aggregate("{E6POS: X 1.5, y -2, S 2, T 'B10'}")
    {'X': 1.5, 'Y': -2.0, 'S': 2.0}
    """
    text = text.strip()
    if not (text.startswith("{") and text.endswith("}")):
        return None
    inner = _KIND.sub("{", text, count=1)[1:-1]
    numbers: Aggregate = {}
    for member in split_arguments(inner):
        match = _MEMBER.fullmatch(member)
        if match is None:
            return None
        value = number_of(match[3])
        name = match[1].upper()
        if value is not None:
            numbers[name] = value
        elif name in ("X", "Y", "Z", "A", "B", "C") or re.fullmatch(r"[AE][1-6]", name):
            return None
    return numbers


def plain_name(name: str, index: str | None = None) -> str:
    """Return a name as it is looked up: in upper case, its index without blanks.

    >>> plain_name("xP", "[ 1 ]")
    'XP[1]'
    """
    return name.upper() + "".join((index or "").split())


@dataclass(slots=True)
class Values:
    """What the variables of a program hold, as far as that is known: aggregates and numbers by upper-case names."""

    known: dict[str, Aggregate | float | None] = field(default_factory=dict)

    def assign(self, text: str) -> bool:
        """Take an assignment or a declaration with a value; return False if the text is none.

        A value that would have to be computed is held as not known.
        """
        match = ASSIGNMENT.fullmatch(text)
        if match is None:
            return False
        name = plain_name(match[1], match[2])
        value = self._value(match[4])
        component = match[3].upper().removeprefix(".")
        if not component:
            self.known[name] = value
            return True
        held = self.known.get(name)
        if isinstance(held, dict) and isinstance(value, float):
            self.known[name] = {**held, component: value}
        else:
            self.known[name] = None
        return True

    def forget(self, text: str) -> None:
        """Take what an assignment would set as not known."""
        match = ASSIGNMENT.fullmatch(text)
        if match is not None:
            self.known[plain_name(match[1], match[2])] = None

    def aggregate(self, text: str) -> Aggregate:
        """Return the numbers of an aggregate, or of the variable that holds one.

        Raises
        ------
        RobotError
            If it would have to be computed, or is not declared.
        """
        text = text.strip()
        if text.startswith("{"):
            found = parsed_aggregate(text)
            if found is None:
                raise RobotError(f"'{printable(text, 60)}' is computed or no point; write plain numbers")
            return found
        value = self._named(text, "point")
        if not isinstance(value, dict):
            raise RobotError(f"'{printable(text, 40)}' is no point; correct the line")
        return value

    def number(self, text: str) -> float:
        """Return a number, or that which a variable holds; errors as for `aggregate`."""
        value = number_of(text)
        if value is not None:
            return value
        named = self._named(text, "number")
        if not isinstance(named, float):
            raise RobotError(f"'{printable(text, 40)}' is no number; correct the line")
        return named

    def _named(self, text: str, what: str) -> Aggregate | float:
        name = "".join(text.split()).upper()
        if not re.fullmatch(r"[A-Z_]\w*(?:\[[0-9]+(?:,[0-9]+)*\])?", name, re.ASCII):
            raise RobotError(f"'{printable(text, 40)}' is computed; write the {what} in plain numbers")
        if name not in self.known:
            raise RobotError(f"'{printable(text, 40)}' is declared nowhere; is the .dat file beside the program?")
        value = self.known[name]
        if value is None:
            raise RobotError(f"'{printable(text, 40)}' is computed by the program; write the {what} in plain numbers")
        return value

    def _value(self, text: str) -> Aggregate | float | None:
        number = number_of(text)
        if number is not None:
            return number
        if text.strip().startswith("{"):
            return parsed_aggregate(text)
        held = self.known.get("".join(text.split()).upper())
        return dict(held) if isinstance(held, dict) else held
