"""Write numbers of a G-code program as the program writes them."""

from __future__ import annotations

from typing import NamedTuple

from sicp_formats.gcode.words import Word

__all__ = ["Style", "Styles", "number_like"]


class Style(NamedTuple):
    """What stands between letter and number of a word, and a number to write others like."""

    between: str
    token: str


class Styles:
    """How a program wrote the words of each letter last."""

    def __init__(self, decimal: str) -> None:
        self._decimal = decimal
        self._seen: dict[str, tuple[Word, str]] = {}

    def see(self, word: Word, line: str) -> None:
        """Take note of a word of a line."""
        self._seen[word.letter] = (word, line)

    def like(self, *letters: str) -> Style:
        """Return the style of the first of some letters that the program has used; the plain style if it has none."""
        seen = next((self._seen[letter] for letter in letters if letter in self._seen), None)
        if seen is None:
            return Style("", f"0{self._decimal}")
        word, line = seen
        between = "=" if word.manner else line[word.start + len(word.letter) : word.number_start]
        return Style(between, line[word.number_start : word.number_end])


def number_like(token: str, value: float, least: int, decimal: str = ".", *, point: bool = False) -> str:
    """Return a number in the style of another: its sign, decimals, leading zero, decimal point and mark.

    Parameters
    ----------
    token
        The number whose style is taken.
    value
        What is to be written.
    least
        How many decimals it is rounded to, unless the token has more; zeros at the end that the token would not have
        are left out.
    decimal
        Decimal mark of the program.
    point
        True for a decimal point even if the token has none: a control may take a number without one for thousandths.

    >>> number_like("10.", 2.5, 4), number_like("+10.000", 2.50004, 4), number_like(".5", -0.25, 4)
    ('2.5', '+2.500', '-.25')
    >>> number_like("10,5", 3.0, 4, ","), number_like("7", 3.0, 4), number_like("7.", 3.0, 4)
    ('3,0', '3', '3.')
    >>> number_like("7", 3.0, 4, point=True), number_like("7", 3.0, 4, ",", point=True)
    ('3.', '3,0')
    """
    digits = token.lstrip("+-").replace(decimal, ".")
    own = len(digits.partition(".")[2])
    whole, _, part = f"{abs(value):.{max(own, least)}f}".partition(".")
    part = part.rstrip("0").ljust(own, "0")
    negative = value < 0.0 and bool((whole + part).strip("0"))
    if digits.startswith(".") and whole == "0" and part:
        whole = ""
    if point and not part and decimal == ",":
        part = "0"  # a comma at the end might part two words
    sign = "-" if negative else "+" if token.startswith("+") else ""
    return f"{sign}{whole}{decimal if part or point or '.' in digits else ''}{part}"
