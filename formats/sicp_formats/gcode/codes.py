"""Sort the G codes of a block: what this reader executes, what it keeps as text, and what it must refuse."""

from __future__ import annotations

from sicp_formats.gcode.words import Block, GCodeError

__all__ = ["HOMING", "MOTION", "UNITS", "heidenhain_text", "kept_words", "one_of", "refuse_codes", "unknown_m"]

MOTION = frozenset({0.0, 1.0, 2.0, 3.0, 80.0})
UNITS = {20.0: "inch", 70.0: "inch", 700.0: "inch", 21.0: "mm", 71.0: "mm", 710.0: "mm"}
HOMING = frozenset({28.0, 30.0, 53.0, 153.0})
_MODES = frozenset({4.0, 17.0, 18.0, 19.0, 90.0, 91.0, 90.1, 91.1, 93.0, 94.0, 95.0})
# Codes that neither move an axis nor change what coordinates mean, beyond the choice of a work offset or tool length.
_HARMLESS = frozenset(
    {8.0, 9.0, 11.0, 13.1, 15.0, 40.0, 40.1, 43.0, 43.1, 43.4, 43.5, 49.0, 49.1, 54.0, 54.1, 55.0, 56.0, 57.0, 58.0,
     59.0, 59.1, 59.2, 59.3, 60.0, 61.0, 61.1, 62.0, 63.0, 64.0, 69.0, 69.1, 97.0, 98.0, 99.0, 103.0, 113.0, 154.0,
     169.0, 170.0, 187.0, 234.0, 254.0, 255.0, 450.0, 451.0, 500.0, 601.0, 602.0, 603.0, 641.0, 642.0, 643.0, 644.0,
     645.0}
)  # fmt: skip
_M_OF_MACHINE = frozenset({0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 17.0, 30.0, 99.0})
# Clamps, coolants, doors, conveyors, overrides, gears: commands that controls agree on.
_M_KNOWN = frozenset(
    {10.0, 11.0, 12.0, 13.0, 14.0, 19.0, 21.0, 22.0, 23.0, 24.0, 29.0, 31.0, 33.0, 34.0, 40.0, 41.0, 42.0, 43.0, 44.0,
     45.0, 48.0, 49.0, 50.0, 51.0, 52.0, 53.0, 60.0, 68.0, 69.0, 70.0, 83.0, 84.0, 88.0, 89.0, 126.0, 127.0, 128.0,
     129.0, 428.0, 429.0, 430.0}
)  # fmt: skip
# The words that codes kept as text take along; M codes may have P or Q, and H and D choose tool offsets anywhere.
_OWN_WORDS = {
    5.0: "PQR", 5.1: "PQR", 8.0: "P", 43.4: "PQ", 43.5: "PQ", 54.0: "P", 54.1: "P", 61.1: "P", 62.0: "P", 64.0: "PQ",
    103.0: "P", 154.0: "P", 187.0: "PE", 234.0: "PQ",
}  # fmt: skip
_OWN_WORDS_OF_M = {19.0: "PQR", 66.0: "PELQ"}
_OTHER_FRAME = "it changes what the coordinates mean; post the path in the frame of the part"
_REFUSED = {
    **dict.fromkeys((41.0, 41.1, 42.0, 42.1), "cutter radius compensation; post the path of the tool centre"),
    **dict.fromkeys((73.0, 74.0, 76.0, *map(float, range(81, 90))), "canned cycles are no contour; take them out"),
    **dict.fromkeys((10.0, 16.0, 50.0, 50.1, 51.0, 51.1, 52.0, 53.1, 68.0, 68.2, 92.0, 92.1, 92.2, 92.3), _OTHER_FRAME),
    **dict.fromkeys((44.0, 45.0, 46.0, 47.0, 48.0), "tool offsets that move the tool; post G43 or the path of the tip"),
    **dict.fromkeys((65.0, 66.0, 67.0), "macros are not called; post the path as one program"),
    96.0: "constant surface speed; post the spindle speed in rev/min",
}
# In Heidenhain's dialect of ISO 6983 many numbers mean something else: G30, G31 the blank, G99 a tool, G15, G16 polar.
_HEIDENHAIN = frozenset({0.0, 1.0, 2.0, 3.0, 4.0, 17.0, 18.0, 19.0, 40.0, 51.0, 70.0, 71.0, 90.0, 91.0})
_HEIDENHAIN_TEXT = frozenset({30.0, 31.0, 99.0})


def refuse_codes(block: Block, heidenhain: bool = False) -> None:
    """Raise a GCodeError for a G code that must not be passed over, or that is not known."""
    for code in block.g:
        if heidenhain and code not in _HEIDENHAIN:
            raise GCodeError(f"G{code:g} is not executed in Heidenhain's dialect; post plain G0 to G3 blocks")
        if heidenhain and code == 51.0:
            continue
        if code in _REFUSED:
            raise GCodeError(f"G{code:g}: {_REFUSED[code]}")
        if code in (58.0, 59.0) and any(letter in block.words for letter in "XYZABC"):
            # Siemens shifts the zero point by these numbers, others go there in the offset that G58, G59 choose.
            raise GCodeError(
                f"G{code:g} with coordinates may shift the zero point (Siemens); state it in its own block"
            )
        if code == 5.0 or code == 5.1:
            _refuse_splines(block, code)
        elif not (code in MOTION or code in UNITS or code in HOMING or code in _MODES or _harmless(code)):
            raise GCodeError(f"unknown g code used: G{code:g}; take it out if it does not move the tool")


def one_of(block: Block, codes: frozenset[float] | dict[float, str]) -> float | None:
    """Return the one code of a modal group in a block, or None.

    Raises
    ------
    GCodeError
        If there are two.
    """
    found = {code for code in block.g if code in codes}
    if len(found) > 1:
        names = ", ".join(f"G{code:g}" for code in sorted(found))
        raise GCodeError(f"two g codes used from same modal group: {names}; take one out")
    return found.pop() if found else None


def kept_words(block: Block, *, arc: bool = False) -> str:
    """Take the codes that are kept as text, with the words that belong to them, out of a block; return the text.

    `arc` says that the block is an arc, which needs its R and P itself.

    >>> block = Block(g=[64.0], words={"P": "0.01", "X": "1", "E": "2"})
    >>> kept_words(block), block.words
    ('G64 P0.01', {'X': '1', 'E': '2'})
    """
    kept = [f"G{code:g}" for code in block.g if _harmless(code) or code in (5.0, 5.1, 51.0)]
    kept += [f"M{code:g}" for code in block.m if code not in _M_OF_MACHINE]
    kept += block.keywords
    letters = _own_words(block).difference("RP" if arc else "")
    kept += [f"{letter}{block.words.pop(letter)}" for letter in "HDPQERL" if letter in letters & block.words.keys()]
    # S1=, M1=: one of several spindles, of which none is known to be that of the tool.
    numbered = [letter for letter in block.words if letter[0] in "SM" and len(letter) > 1]
    kept += [f"{letter}={block.words.pop(letter)}" for letter in numbered]
    return " ".join(kept)


def unknown_m(block: Block) -> list[str]:
    """Return the commands of a block that machine builders define as they like; they cannot change coordinates.

    >>> unknown_m(Block(m=[3.0, 128.0, 777.0]))
    ['M777']
    """
    unknown = [f"M{code:g}" for code in block.m if code not in _M_OF_MACHINE and code not in _M_KNOWN]
    return unknown + [f"{word}={number}" for word, number in block.words.items() if word[0] in "SM" and len(word) > 1]


def heidenhain_text(block: Block) -> bool:
    """Say whether a block of Heidenhain's dialect states the blank or a tool, which no tip follows."""
    return any(code in _HEIDENHAIN_TEXT for code in block.g)


def _own_words(block: Block) -> set[str]:
    """Return the letters that codes and commands of a block, and not its motion, may have."""
    letters = set("HD")
    for code in block.g:
        letters.update(_OWN_WORDS.get(code, ""))
    for code in block.m:
        if code not in _M_OF_MACHINE:
            letters.update(_OWN_WORDS_OF_M.get(code, "PQ"))
    if any(letter in block.words for letter in "XYZABC"):
        letters.discard("E")  # behind a coordinate it would be an exponent
    return letters


def _harmless(code: float) -> bool:
    return code in _HARMLESS or 505.0 <= code <= 599.0


def _refuse_splines(block: Block, code: float) -> None:
    # G5 P10000 and G5.1 Q1 are look-ahead modes of some controls, splines with end points on others.
    if any(letter in block.words for letter in "XYZIJ"):
        raise GCodeError(f"G{code:g} with coordinates is a spline; post the path as G1 blocks")
