"""Keywords of Siemens programs that do not move an axis: they are kept as text."""

from __future__ import annotations

__all__ = ["KEYWORDS_KEPT", "TIP_CONTROL_OFF", "TIP_CONTROL_ON"]

TIP_CONTROL_ON = "TRAORI"
TIP_CONTROL_OFF = "TRAFOOF"

_ORIENTATION = ("ORIWKS", "ORIVECT", "ORIAXES", "ORIVIRT1", "ORIPLANE", "ORISON", "ORISOF", "ORIC", "ORID")
_MOTION_CONTROL = (
    "SOFT", "SOFTA", "BRISK", "BRISKA", "DRIVE", "DRIVEA", "FFWON", "FFWOF", "COMPON", "COMPOF", "COMPCURV", "COMPCAD",
    "COMPSURF", "UPATH", "SPATH", "FGROUP", "CFC", "CFIN", "CFTCP", "FNORM", "FLIN", "ADIS", "ADISPOS", "CYCLE832",
    "STOPRE", "STARTFIFO", "STOPFIFO", "FIFOCTRL",
)  # fmt: skip
_CUTTER_OFF = ("NORM", "KONT", "KONTC", "KONTT", "CUT2D", "CUT2DF", "CUT3DC", "CUT3DF", "CUT3DFS", "DIAMOF", "CDOF")
_MACHINE = ("SUPA", "SETMS", "WORKPIECE", "SPOS")

KEYWORDS_KEPT = frozenset((TIP_CONTROL_ON, TIP_CONTROL_OFF, *_ORIENTATION, *_MOTION_CONTROL, *_CUTTER_OFF, *_MACHINE))
"""Names of transformation, orientation, dynamics and look-ahead; `SUPA` makes its block one in machine coordinates."""
