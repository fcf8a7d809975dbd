"""The work offset that coordinates are counted from: one path has one."""

from __future__ import annotations

from sicp_formats.gcode.words import Block, GCodeError

__all__ = ["WorkOffset"]

_CHOICES = frozenset({54.0, 54.1, 55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3, 154.0, 500.0})
_WITH_NUMBER = {54.0: "P", 54.1: "P", 154.0: "P", 15.0: "H"}  # G15 H: Okuma's; G15 alone ends polar coordinates
_DYNAMIC = {254.0: "G254", 255.0: ""}


class WorkOffset:
    """The offset that rules, and the one in which the coordinates so far were stated.

    How far offsets lie apart only the control knows, so coordinates in two of them are no one path.
    """

    __slots__ = ("_changed", "_chosen", "_dynamic", "_used")

    def __init__(self) -> None:
        self._chosen = self._dynamic = ""
        self._changed = ""
        self._used: tuple[str, str] | None = None

    @property
    def is_in_use(self) -> bool:
        """True if coordinates were stated in the offset that rules."""
        return self._used == (self._chosen, self._dynamic)

    def take(self, block: Block, line: int) -> None:
        """Take the choice of an offset in a block, and note its line."""
        chosen = {_name(code, block) for code in block.g} - {""}
        dynamic = {_DYNAMIC[code] for code in block.g if code in _DYNAMIC}
        if len(chosen) > 1 or len(dynamic) > 1:
            raise GCodeError(f"two work offsets on one line: {', '.join(sorted(chosen | dynamic))}; take one out")
        before = (self._chosen, self._dynamic)
        stated = chosen | {f"G{code:g}" for code in block.g if code in _DYNAMIC}
        self._chosen = chosen.pop() if chosen else self._chosen
        self._dynamic = dynamic.pop() if dynamic else self._dynamic
        if before != (self._chosen, self._dynamic):
            self._changed = f"by {' '.join(sorted(stated))} in line {line}"

    def use(self) -> None:
        """Note that coordinates are stated; raise a GCodeError if others were stated in another offset."""
        now = (self._chosen, self._dynamic)
        if self._used is None:
            self._used = now
        if self._used != now:
            raise GCodeError(
                f"the work offset changes within the path, from {_words(self._used)} {self._changed}; post one "
                "operation for each work offset"
            )


def _name(code: float, block: Block) -> str:
    number = block.words.get(_WITH_NUMBER.get(code, ""))
    if code in _CHOICES or 505.0 <= code <= 599.0 or (code == 15.0 and number is not None):
        return f"G{code:g}" if number is None else f"G{code:g} {_WITH_NUMBER[code]}{float(number):g}"
    return ""


def _words(offset: tuple[str, str]) -> str:
    return " ".join(word for word in offset if word) or "the one that is not stated"
