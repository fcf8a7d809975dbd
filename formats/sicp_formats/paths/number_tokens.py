"""Numbers as they stand in a program: which of them may stay, and how a new one is written in the style of the old."""

from __future__ import annotations

import re

__all__ = ["NUMBER_TOKEN", "restyled", "retold"]

NUMBER_TOKEN = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?", re.ASCII)
"""A number without blanks around it; digits of other scripts are none."""

_PARTS = re.compile(r"([+-]?)([0-9]*)(\.?)([0-9]*)", re.ASCII)


def retold(token: str, value: float, tolerance: float, decimals: int, *, bare: bool = False) -> str:
    """Return the token itself if it tells the value within the tolerance, or the value in the token's style.

    >>> retold("10.", 10.00001, 5e-5, 4), retold("10.", 10.25, 5e-5, 4)
    ('10.', '10.25')
    """
    return token if abs(float(token) - value) < tolerance else restyled(token, value, decimals, bare=bare)


def restyled(token: str, value: float, decimals: int, *, bare: bool = False) -> str:
    """Return a number in the style of a token: its decimals or more, its decimal point, its plus, never an exponent.

    Parameters
    ----------
    token
        A number as it stands in the program.
    value
        The number to write.
    decimals
        Least precision; zeros at the end are left out again where the token has fewer decimals.
    bare
        Whether numbers below one are written without the zero before the point, where the token does not tell.

    >>> restyled("+1.50", 2.0, 4), restyled("7.0000000000", -0.5, 4), restyled(".5", 0.25, 4), restyled("3", -2.0, 4)
    ('+2.00', '-0.5000000000', '.25', '-2')
    """
    sign, whole, point, given = _PARTS.match(token).groups()  # type: ignore[union-attr]  # it can match nothing
    text = f"{abs(value):.{max(decimals, len(given))}f}"
    if len(given) < decimals:
        head, _, tail = text.partition(".")
        tail = tail[: len(given)] + tail[len(given) :].rstrip("0")
        text = f"{head}.{tail}" if tail or point else head
    negative = value < 0.0 and text.strip("0.") != ""
    small = abs(float(token)) < 1.0 and point and given
    if text.startswith("0.") and text != "0." and (whole == "" if small else bare):
        text = text[1:]
    return f"{'-' if negative else sign.replace('-', '')}{text}"
