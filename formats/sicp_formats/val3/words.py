"""The words of VAL3 that linter and reader know: keywords, literals, types and instructions of CS8 and CS9."""

from __future__ import annotations

__all__ = [
    "ATTRIBUTES",
    "BLENDS",
    "CODE_ATTRIBUTES",
    "CONFIGURATION",
    "INSTRUCTIONS",
    "KEYWORDS",
    "LITERALS",
    "MOVES_NOTHING",
    "OUTPUTS",
    "RESERVED",
    "SCREEN",
    "TYPES",
    "WAITS",
]

_KEYWORDS = """
    begin end if then else elseif endif for to step endfor while endwhile do until switch case default break
    endswitch call return and or xor not taskcreate taskcreatesync
"""
KEYWORDS = frozenset(_KEYWORDS.split())
"""In lower case."""

CONFIGURATION = {
    "shoulder": ("lefty", "righty", "ssame", "sfree"),
    "elbow": ("epositive", "enegative", "esame", "efree"),
    "wrist": ("wpositive", "wnegative", "wsame", "wfree"),
}
"""Words of each part of the configuration of an arm."""

BLENDS = ("off", "joint", "Cartesian")

LITERALS = frozenset({"true", "false", *BLENDS, *(word for words in CONFIGURATION.values() for word in words)})

_TYPES = """
    num bool string dio aio sio point joint config pointRx jointRx configRx pointRs jointRs configRs
    pointVrb jointVrb configVrb trsf frame tool mdesc screen
"""
TYPES = frozenset(_TYPES.split())

RESERVED = (
    KEYWORDS
    | {word.lower() for word in LITERALS | TYPES}
    | {"world", "flange", "global", "void", "aio", "sio", "endif", "endfor", "endwhile", "endswitch"}
)
"""Names that no variable and no program may have, in lower case."""

_POSE = frozenset({"x", "y", "z", "rx", "ry", "rz"})
_MDESC = frozenset({"accel", "vel", "decel", "blend", "leave", "reach"})
ATTRIBUTES = {
    "point": _POSE | {"shoulder", "elbow", "wrist", "fatherId"},
    "joint": frozenset({"j1", "j2", "j3", "j4", "j5", "j6"}),
    "frame": _POSE | {"fatherId"},
    "tool": _POSE | {"fatherId", "ioLink", "otime", "ctime", "open", "close"},
    "trsf": _POSE,
    "mdesc": _MDESC | {"tmax", "rmax"},
}
"""Attributes of a value in a data file, for the types that decide where the arm goes."""

CODE_ATTRIBUTES = {"mdesc": _MDESC | {"tvel", "rvel"}, "joint": ATTRIBUTES["joint"]}
"""Attributes as code names them: the limits of the speed are tvel and rvel there."""

_SCREEN = "putln put userPage gotoxy cls title setTextMode getDisplayLen get getKey isKeyPressed popPage"
SCREEN = frozenset(_SCREEN.split())
"""Instructions of the screen of a CS8 pendant, which a CS9 does not have."""

WAITS = frozenset({"waitEndMove", "resetMotion", "stopMove", "open", "close", "isEmpty", "isSettled"})
"""After these nothing of the motion before is under way any more, or the program has asked."""

OUTPUTS = frozenset({"aioSet", "dioSet", "setOutput"})

_INSTRUCTIONS = """
    movej movel movec restartMove autoConnectMove getMoveId setMoveId getSpeed getPositionErr getJointForce
    alterBegin alterMovej alterMovel alterMovec alter alterEnd alterStopTime resetTurn herej here
    isInRange jointToPoint pointToJoint position distance appro compose interpolateL interpolateC align
    setFrame link config trsf
    enablePower disablePower isPowered isCalibrated workingMode esStatus safetyFault getMonitorSpeed setMonitorSpeed
    getVersion ioBusStatus ioStatus setPayload setLatch getLatch setMutex
    popUpMsg logMsg getProfile setProfile getLanguage setLanguage getDate help readConfig
    taskSuspend taskResume taskKill taskStatus taskName wait delay clock watch
    libLoad libSave libDelete libPath libList libExist libUnload
    sin cos tan asin acos atan atan2 abs sqrt exp ln log power round roundUp roundDown min max limit sel
    bNot bAnd bOr bXor toBinary fromBinary encode decode
    toString toNum chr asc left right mid insert delete replace find len codeToUtf
    size resize append isDefined first last next prev getData
    dioLink dioGet dioStatus aioLink aioGet aioStatus sioLink sioCtrl sioGet sioSet clearBuffer
"""
INSTRUCTIONS = SCREEN | WAITS | OUTPUTS | frozenset(_INSTRUCTIONS.split())
"""Instructions and functions; those of add-ons begin with a dollar sign and are not listed."""

_MOVES_NOTHING = """
    aioSet autoConnectMove close cls delay disablePower enablePower gotoxy logMsg open popUpMsg put putln resetMotion
    restartMove setMoveId setPayload sioSet stopMove title userPage wait waitEndMove watch dioLink aioLink sioLink
"""
MOVES_NOTHING = frozenset(_MOVES_NOTHING.split())
"""Instructions that a reader of paths may keep as they stand: they neither move the arm nor change a point."""
