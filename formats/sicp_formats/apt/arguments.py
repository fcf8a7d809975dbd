"""The arguments of APT statements: which of them are numbers, and which are words."""

from __future__ import annotations

import re

__all__ = ["NUMBER", "split_arguments"]

NUMBER = r"\s*([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*"
"""Pattern of a number as APT writes it, with blanks around and one group; digits of other scripts are none."""

_NUMBER = re.compile(NUMBER)


def split_arguments(arguments: str) -> tuple[list[float], list[str]]:
    """Return the numbers and the words (upper case) among the arguments, each in order; empty ones are left out.

    >>> split_arguments(" rpm, 1000., CLW")
    ([1000.0], ['RPM', 'CLW'])
    """
    numbers, words = [], []
    for argument in arguments.split(","):
        if match := _NUMBER.fullmatch(argument):
            numbers.append(float(match[1]))
        elif word := argument.strip().upper():
            words.append(word)
    return numbers, words
