"""Options as lines for people, and as data."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator

from sicp_cam.errors import printable
from sicp_cam.options.help import Option

__all__ = ["option_entries", "option_lines"]

_WIDTH = 100
_TEXT = 1000


def option_lines(options: Iterable[Option], flag: str) -> Iterator[str]:
    """Yield the lines of each option: how it is set, what it takes, what holds without it; then its text.

    Parameters
    ----------
    options
        What to tell.
    flag
        What stands before the name of an option on the command line, such as `--set gates.`.
    """
    for option in options:
        default = "must be given" if option.default is None else f"default {option.default}"
        yield f"  {_flag(option, flag)}  {printable(f'{option.type}; {default}', _TEXT)}"
        yield from textwrap.wrap(
            printable(option.text, _TEXT), _WIDTH, initial_indent=" " * 6, subsequent_indent=" " * 6
        )


def option_entries(options: Iterable[Option], flag: str) -> list[dict[str, str | None]]:
    """Return the same as data."""
    return [
        {
            "name": option.name,
            "type": option.type,
            "default": option.default,
            "text": option.text,
            "flag": _flag(option, flag),
        }
        for option in options
    ]


def _flag(option: Option, flag: str) -> str:
    if flag == "--":
        return f"--{option.name.replace('_', '-')}"
    return f"{flag}{option.name}=..."
