"""Ranges as data: `Annotated[float, Between(0.1, 100.0)]` says what an option allows, for checks and for help."""

from __future__ import annotations

import math
import typing
from dataclasses import dataclass
from typing import Annotated, Any

__all__ = ["Between", "unwrapped"]


@dataclass(frozen=True, slots=True)
class Between:
    """Least and largest value that a number may have, both allowed.

    >>> Between(0.0, 5.0).allows(5.0), Between(0.0, 5.0).allows(5.1), Between(0.0, 5.0).allows(math.nan)
    (True, False, False)
    """

    lowest: float
    highest: float = math.inf

    def allows(self, value: float) -> bool:
        """Say whether a number lies in the range."""
        return self.lowest <= value <= self.highest

    def __str__(self) -> str:
        """Return the range in words that stand behind "must be"."""
        if self.highest == math.inf:
            return f"at least {self.lowest:.12g}"
        return f"from {self.lowest:.12g} to {self.highest:.12g}"


def unwrapped(hint: Any) -> tuple[Any, Between | None]:
    """Return the type within an annotation, and the range that it carries, if any.

    >>> unwrapped(Annotated[int, Between(1, 9)])
    (<class 'int'>, Between(lowest=1, highest=9))
    >>> unwrapped(int)
    (<class 'int'>, None)
    """
    if typing.get_origin(hint) is not Annotated:
        return hint, None
    wanted, *marks = typing.get_args(hint)
    return wanted, next((mark for mark in marks if isinstance(mark, Between)), None)
