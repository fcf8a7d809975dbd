"""Which APT statements must not be passed over, because they move the tool or change the coordinates."""

from __future__ import annotations

from sicp_formats.apt.arguments import split_arguments
from sicp_formats.apt.statements import TEXT_WORDS

__all__ = ["HARMLESS", "MOVES_NOTHING", "reason_to_refuse", "switches_on"]

_AS_POINTS = "output the tool path as points (GOTO)"
_OTHER_FRAME = "it changes the coordinates that follow; export the path in the frame of the part"
_REFUSED = {
    **dict.fromkeys(("NURBS", "KNOT", "CNTRL", "SPLINE", "GCONIC"), f"splines are not read; {_AS_POINTS}"),
    **dict.fromkeys(
        ("COPY", "INDEX", "MACRO", "CALL", "LOOPST", "LOOPND", "JUMPTO", "IF", "DNTCUT", "DEFSUB", "CALSUB", "ENDSUB"),
        "this is APT language, not CL data; run it through the APT processor first",
    ),
    **dict.fromkeys(("ROTATE", "MIRROR", "SCALE", "REFSYS", "MATRIX", "TRANSL", "COORD"), _OTHER_FRAME),
    **dict.fromkeys(
        ("MOVARC", "HELIX", "MOVETO", "POSITN"), f"it moves the tool in a way that is not read; {_AS_POINTS}"
    ),
}
_FRAME_WORDS = ("TRANS", "ORIGIN", "ROTABL", "ROTHED", "TRNTYP", "TRACUT")

_NOT_ABOUT_MOTION = """
    AUTOPS AUXFUN BOX CLAMP CLEARP CSI_SET_EXTENSION_LENGTH CSI_SET_FLUTE_LENGTH CUTCOM CUTTER CYCLE DISPLY DRESS
    END-OF-PATH INTOL LEADER MACHIN MATERIAL MODE MOVE_ATTRIB MULTAX NOPOST OPFEATEND OPFEATSTART OPFUN OPSKIP ORIGIN
    OSETNO OUTTOL PAINT PPFUN PREFUN REWIND ROTABL ROTHED SEQNO SET SETUP STOCK SWITCH SYN TLDATA TOLER TOOLPATH TRACUT
    TRANS TRNTYP UNLOAD
"""
HARMLESS = frozenset(_NOT_ABOUT_MOTION.split())
"""Words that say nothing about the motion once they are not refused, and need no finding."""

MOVES_NOTHING = (HARMLESS - {"CYCLE"}) | {
    *("", *TEXT_WORDS, "UNIT", "UNITS", "MSYS", "CSYS", "FEDRAT", "SPINDL", "COOLNT", "DELAY", "TLAXIS", "RAPID"),
    *("LOADTL", "LOAD", "TURRET", "SELECT", "TOOLNO", "STOP", "OPSTOP", "FINI", "END"),
}
"""Words of statements that may be left out at the end of a file, where none that moves follows."""


def reason_to_refuse(word: str, arguments: str) -> str | None:
    """Return why a statement that no reader executes must stop the reading, and what to do; None if it need not.

    >>> reason_to_refuse("CUTCOM", "OFF") is None
    True
    """
    numbers, words = split_arguments(arguments)
    reason = _REFUSED.get(word)
    if word.startswith(("GO", "TLON", "TLLFT", "TLRGT")):
        reason = f"only GOTO, GODLTA, FROM, GOHOME and CATIA's circles move the tool here; {_AS_POINTS}"
    elif word == "CUTCOM" and words != ["OFF"]:
        reason = (
            "the control would shift this path by the tool radius; output the tool centre without CUTCOM, "
            "or keep the statement as text with --set path.cutcom=ignore"
        )
    elif word == "CYCLE" and words != ["OFF"]:
        reason = (
            "drilling cycles are no contour; take them out of the path, "
            "or keep them as text and their positions as points with --set path.cycles=points"
        )
    elif word in _FRAME_WORDS and _moves_frame(word, numbers, words):
        reason = _OTHER_FRAME
    elif word in ("SET", "MODE") and "INCR" in words:
        reason = f"incremental coordinates are not read; {_AS_POINTS}"
    elif word[0].isdigit() or word[0] in "+-.":
        reason = "numbers without a word; has the $ at the end of the line before been lost?"
    elif "=" in word and (arguments.strip() or word.rpartition("=")[2].startswith("GO")):
        reason = _REFUSED["MACRO"]
    elif word not in HARMLESS and len(numbers) in (3, 6) and not words and _like_goto(word):
        reason = "not known, but much like GOTO; is the file damaged? Correct the line"
    return reason


def switches_on(arguments: str) -> bool:
    """Say whether CUTCOM or CYCLE begin something, rather than end it with OFF.

    >>> switches_on("LEFT,XYPLAN"), switches_on(" off")
    (True, False)
    """
    return split_arguments(arguments)[1] != ["OFF"]


def _like_goto(word: str) -> bool:
    """Say whether one character less, more or other makes a word GOTO."""
    shorter, longer = sorted((word, "GOTO"), key=len)
    if len(longer) - len(shorter) > 1:
        return False
    return any(
        word[:at] + word[at + (len(word) >= 4) :] == "GOTO"[:at] + "GOTO"[at + (len(word) <= 4) :] for at in range(5)
    )


def _moves_frame(word: str, numbers: list[float], words: list[str]) -> bool:
    if word == "TRACUT":
        return words != ["NOMORE"] or bool(numbers)
    if word in ("TRANS", "ORIGIN"):
        return any(numbers) or bool(words) or not numbers
    return any(numbers)
